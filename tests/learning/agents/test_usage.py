"""A run counts its steps, and learns in its own episodes from the sources that its algorithm declares."""

import contextlib
import copy
import dataclasses
import functools
import sys
import threading

import gymnasium
import numpy as np
import pytest
from tqdm import tqdm

import arc_suite
from arc_suite import evaluation, usage
from arc_suite.bodies import universal
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, learner, run_folder, run_usage
from arc_suite.learning.agents.algorithms import Algorithm
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.learner import Slice
from arc_suite.learning.agents.training import train
from arc_suite.policies import load_network, network, other_libraries, policy, protocol
from arc_suite.policies.separate import Separate
from arc_suite.policies.tracing import traced
from arc_suite.tasks.contract import Task
from arc_suite.usage import Usage

SHORT = {"time_limit": 0.5}  # s: episodes of 10 steps
SETUP = Setup.of("tick", "walk", SHORT)
ENVS = 4
silent = functools.partial(tqdm, disable=True)


@dataclasses.dataclass(frozen=True)
class Nothing:
    """No hyperparameters."""


def zero_policy(task: Task):
    """A policy that stands still."""
    weight = np.zeros((task.size, len(task.scene.body.joint_names)), np.float32)
    return traced(lambda x: x.node("Product", weight), task.size)


def slices_of(act):
    """A learner that calls `act` with its context before each slice, and learns nothing."""

    def learn(hp, context):
        number = int((context.checkpoint or {"number": 0})["number"])
        while True:
            act(context)
            number += 1
            yield Slice({"number": float(number)}, zero_policy(context.setup.definition), {"number": np.array(number)})

    return learn


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A function that trains by a learner, and returns the folder of the run."""

    def train_by(act, steps=16, stop=lambda: False, **fields):
        algorithm = Algorithm(slices_of(act), Nothing(), "learns nothing", evaluate_every=8, **fields)
        monkeypatch.setitem(algorithms.ALGORITHMS, "mine", algorithm)
        configuration = Configuration.of(SETUP, "mine", steps=steps)
        train(configuration, tmp_path / "run", progress=silent, stop=stop)
        return tmp_path / "run"

    return train_by


def step_vector(context):
    """A control step of four environments."""
    with contextlib.closing(context.environment(ENVS)) as environment:
        environment.reset()
        environment.step(np.zeros(environment.action_space.shape, np.float32))


def evaluated_steps(folder):
    """The environment steps of the evaluations of a run."""
    return sorted(set(run_folder.table(folder, "evaluations")["step"].tolist()))


def test_a_step_of_four_environments_counts_four(run):
    folder = run(step_vector)
    assert evaluated_steps(folder) == [8, 16]
    progress = run_folder.read_progress(folder)
    assert (progress["environment_steps"], progress["steps_by_learner"], progress["sources"]) == (16, 0, [])


def test_a_run_that_resumes_goes_on_counting(run):
    stopped = run(step_vector, stop=lambda: True)
    assert run_folder.read_progress(stopped)["environment_steps"] == 4
    assert evaluated_steps(run(step_vector)) == [8, 16]


def open_dm(context):
    """An environment of dm_env, with a seed of the run."""
    return arc_suite.load("tick", "walk", SHORT | {"random": context.first_seed})


def step_dm(context):
    """A control step of dm_env."""
    environment = open_dm(context)
    environment.reset()
    environment.step(np.zeros(environment.action_spec().shape))


def step_gym(context):
    """A control step of Gymnasium."""
    environment = gymnasium.make("arc_suite/tick-walk-v0", task_kwargs=SHORT)
    environment.reset(seed=context.first_seed)
    environment.step(environment.action_space.sample())


def step_bodies(context):
    """A control step of two bodies."""
    with contextlib.closing(Setup.of("random:0-1", "walk", SHORT).make_vec(2, seed=context.first_seed)) as environment:
        environment.reset()
        environment.step(np.zeros(environment.action_space.shape, np.float32))


def step_in_thread(context):
    """A control step of dm_env in a thread of the learner."""
    thread = threading.Thread(target=step_dm, args=(context,))
    thread.start()
    thread.join()


@pytest.mark.parametrize(
    ("act", "steps"),
    [(step_dm, 1), (step_gym, 1), (step_bodies, 2), (step_in_thread, 1)],
    ids=lambda x: getattr(x, "__name__", x),
)
def test_every_face_counts(act, steps, run):
    folder = run(act, steps=steps)
    assert run_folder.read_progress(folder)["environment_steps"] == steps


def test_a_reset_counts_no_step():
    with usage.record(Usage("mine")) as used:
        environment = arc_suite.load("tick", "walk", {"time_limit": 0.1})
        action = np.zeros(environment.action_spec().shape)
        for _ in range(6):  # starts an episode, makes two steps, and so on
            environment.step(action)
        assert used.steps == 4
        with usage.pause():
            environment.step(action)
            environment.step(action)
        assert used.steps == 4


def test_the_steps_of_runs_side_by_side_are_shared():
    with usage.record(Usage("mine", runs=2)) as one, usage.record(Usage("mine", runs=2, environment_steps=8)) as other:
        usage.count_steps(8)
    assert (one.steps, other.steps) == (4, 12)


def reset_with_seed_0(context):
    """Learn in the episodes that judge."""
    context.environment(ENVS).reset(seed=0)


def evaluate_in_training(context):
    """Play an episode of evaluation."""
    environment = arc_suite.load("tick", "walk", SHORT)
    evaluation.run(environment, policy("zero", "tick"), seed=0)


def open_with_seed_0(context):
    """Open an environment of dm_env with the seed of an episode that judges."""
    arc_suite.load("tick", "walk", SHORT | {"random": 0})


def open_worlds_of_others(context):
    """Open mixed bodies with the seeds of another run."""
    Setup.of("random:0-1", "walk", SHORT).make_vec(2, seed=200_000)


@pytest.mark.parametrize(
    ("act", "seed"),
    [(reset_with_seed_0, 0), (evaluate_in_training, 0), (open_with_seed_0, 0), (open_worlds_of_others, 200_000)],
    ids=lambda x: getattr(x, "__name__", x),
)
def test_episodes_of_others_are_refused(act, seed, run):
    with pytest.raises(ValueError) as caught:
        run(act)
    assert str(caught.value) == (
        f"algorithm mine: seed {seed} is of an episode of others; this run learns in those of seeds 100000 to 199999"
    )


def imitate(context):
    """Act by a demonstrator."""
    environment = open_dm(context)
    act = Demonstrator(environment)
    environment.step(act(environment.reset()))


def read_packaged_policy(context):
    """Act by a policy of the package."""
    policy("ppo", "tick")


def read_teacher(context):
    """Act by the demonstrators of a batch."""
    from arc_suite.learning.teachers import Teacher

    with contextlib.closing(context.environment(ENVS)) as environment:
        observation, _ = environment.reset()
        Teacher(environment).act(environment.task.split(observation), np.zeros(ENVS))


def read_law(context):
    """Ask the law of a demonstrator, without its method `act`."""
    Demonstrator("tick", "refined").law.initial(ENVS)


@pytest.mark.parametrize(
    ("act", "source"),
    [
        (read_law, "a demonstrator"),
        (imitate, "a demonstrator"),
        (read_teacher, "a demonstrator"),
        (read_packaged_policy, "a policy"),
    ],
    ids=lambda x: getattr(x, "__name__", x),
)
@pytest.mark.parametrize("declared", ["nothing", "prior data"])
def test_a_source_that_is_not_declared_ends_the_run(act, source, declared, run):
    with pytest.raises(ValueError) as caught:
        run(act, source=declared)
    assert str(caught.value) == (
        f"algorithm mine: uses {source} and declares source={declared!r}; declare source={source!r}"
    )


def test_an_unknown_source_is_recorded(run):
    folder = run(imitate, steps=1)
    assert run_folder.read_progress(folder)["sources"] == ["a demonstrator"]
    assert run_folder.read_progress(folder)["environment_steps"] == 1


def test_an_algorithm_that_does_not_act_makes_no_step(run):
    with pytest.raises(ValueError) as caught:
        run(step_vector, acts=False)
    assert str(caught.value) == (
        "algorithm mine: declares acts=False, and has made 4 environment steps; declare acts=True, so that these are "
        "the run's steps"
    )


def test_a_learner_counts_what_the_suite_does_not_see(run):
    folder = run(lambda context: context.count_steps(8), acts=False)
    progress = run_folder.read_progress(folder)
    assert evaluated_steps(folder) == [8, 16]
    assert (progress["environment_steps"], progress["steps_by_learner"]) == (0, 16)


def test_no_steps_are_taken_back(run):
    with pytest.raises(ValueError, match=r"steps: expected an integer from 0(?: to [0-9]+)?, got -8"):
        run(lambda context: context.count_steps(-8))


def test_algorithms_of_the_package_declare_their_sources():
    assert {entry.source for entry in algorithms.ALGORITHMS.values()} <= set(usage.SOURCES) - {usage.UNKNOWN}
    assert Algorithm(lambda hp, context: iter(()), Nothing(), "of another package").source == usage.UNKNOWN


TWO_BODIES = Setup.of("random:0-1", "walk", SHORT)
RUN_SEEDS = range(100_000, 200_000)
OTHERS = {
    0: "algorithm mine: seed 0 is of an episode of others; this run learns in those of seeds 100000 to 199999",
    None: "algorithm mine: an episode has no known seed, so give reset one; this run learns in those of seeds 100000 "
    "to 199999",
}


def open_gym(seed=None):
    """An environment of Gymnasium; without a seed if that is None."""
    settings = SHORT if seed is None else SHORT | {"random": seed}
    return gymnasium.make("arc_suite/tick-walk-v0", task_kwargs=settings).unwrapped


OPENERS = {
    "vector": lambda seed=None: SETUP.make_vec(ENVS, seed=seed),
    "bodies": lambda seed=None: TWO_BODIES.make_vec(2, seed=seed),
    "dm_env": lambda seed=None: arc_suite.load("tick", "walk", SHORT | {"random": seed}),
    "gym": open_gym,
}


def stand(environment):
    """Make a control step, in an environment of any face."""
    space = getattr(environment, "action_space", None)
    shape = environment.action_spec().shape if space is None else space.shape
    return environment.step(np.zeros(shape, np.float32))


@pytest.mark.parametrize("seed", [0, None])
@pytest.mark.parametrize("face", OPENERS)
def test_snapshots_of_others_are_refused(face, seed, run):
    before = OPENERS[face](seed)
    before.reset()
    snapshot = before.snapshot()
    with pytest.raises(ValueError) as caught:
        run(lambda context: OPENERS[face]().restore(snapshot))
    assert str(caught.value) == OTHERS[seed]


@pytest.mark.parametrize("seed", [0, None])
@pytest.mark.parametrize("face", OPENERS)
def test_episodes_that_began_before_the_run_are_refused(face, seed, run):
    environment = OPENERS[face](seed)
    environment.reset()
    for opened in (environment, copy.deepcopy(environment)):
        with pytest.raises(ValueError) as caught:
            run(lambda context, opened=opened: stand(opened))
        assert str(caught.value) == OTHERS[seed]


@pytest.mark.parametrize("face", OPENERS)
def test_a_run_restores_its_snapshots(face, run):
    snapshots = []

    def restore(context):
        environment = OPENERS[face]()
        environment.reset()
        snapshots.append(environment.snapshot())
        environment.restore(snapshots[0])
        stand(environment)

    run(restore, stop=lambda: True)
    run(restore)


def test_a_vector_environment_resumes_from_its_checkpoint(run):
    def restore(context):
        with contextlib.closing(context.environment(ENVS)) as environment:
            environment.reset()
            learner.restore_environment(environment, learner.environment_arrays(environment))
            stand(environment)

    assert run_folder.read_progress(run(restore))["environment_steps"] == 16


@pytest.mark.parametrize("face", OPENERS)
def test_a_reset_without_a_seed_begins_an_episode_of_the_run(face, run):
    seeds, starts = [], []

    def learn(context):
        for _ in range(2):
            environment = OPENERS[face]()
            starts.append(np.concatenate([np.ravel(array) for array in _values(environment.reset())]))
            seed = environment.task.stream_seed if face == "dm_env" else environment.np_random_seed
            seeds.extend([seed] if isinstance(seed, int) else seed)
            stand(environment)
            environment.reset()  # continues the stream

    run(learn, stop=lambda: True)
    count = len(seeds)
    assert seeds == [RUN_SEEDS[-1 - number] for number in range(count)]
    assert not np.array_equal(*starts)
    run(learn)
    assert seeds[count : 2 * count] == seeds[:count]  # as the run has resumed
    np.testing.assert_array_equal(starts[2:4], starts[:2])


def _values(result):
    """The arrays of what a reset returns, on any face."""
    observation = getattr(result, "observation", None)
    observation = result[0] if observation is None else observation
    return observation.values() if hasattr(observation, "values") else [observation]


def test_streams_of_known_seeds_go_on(run):
    def learn(context):
        environment = SETUP.make_vec(3)
        environment.reset(seed=[context.first_seed, None, context.first_seed])
        assert environment.np_random_seed == (100_000, RUN_SEEDS[-1], 100_000)
        environment.reset(options={"reset_mask": np.array([True, True, False])})
        assert environment.np_random_seed == (100_000, RUN_SEEDS[-1], 100_000)
        stand(environment)

    run(learn, steps=1)


def test_an_environment_without_a_seed_that_is_older_than_the_run_begins_anew(run):
    environment = SETUP.make_vec(ENVS)
    environment.reset()
    run(lambda context: (environment.reset(), stand(environment)), steps=4)
    assert environment.np_random_seed == tuple(RUN_SEEDS[-1 - number] for number in range(ENVS))


def test_outside_of_runs_streams_stay_unknown():
    environment = SETUP.make_vec(2)
    with usage.record(Usage("mine", seeds=[RUN_SEEDS])), usage.pause():
        environment.reset()
    with usage.record(Usage("mine")):
        environment.reset()
    assert environment.np_random_seed == (-1, -1)


def give_random_state(context):
    """Give dm_env a generator in place of a seed."""
    arc_suite.load("tick", "walk", SHORT | {"random": np.random.RandomState(0)})


def set_random_state(context):
    """Give the task of dm_env another generator."""
    open_dm(context).task.random = np.random.RandomState(0)


def set_generator(context):
    """Give Gymnasium's environment another generator."""
    open_gym().np_random = np.random.Generator(np.random.MT19937(0))


@pytest.mark.parametrize("act", [give_random_state, set_random_state, set_generator])
def test_generators_have_no_seed(act, run):
    with pytest.raises(ValueError) as caught:
        run(act)
    assert str(caught.value) == OTHERS[None]


@pytest.mark.filterwarnings("ignore:.*ERROR")
@pytest.mark.skipif(sys.platform != "linux", reason="children are not forked")
def test_forked_environments_are_given_seeds(run):
    def learn(context, **seed):
        environment = gymnasium.make_vec(
            "arc_suite/tick-walk-v0",
            num_envs=2,
            vectorization_mode="async",
            vector_kwargs={"context": "fork"},
            task_kwargs=SHORT,
        )
        try:
            environment.reset(**seed)
            stand(environment)
        finally:
            environment.close(terminate=True)
        context.count_steps(2)

    with pytest.raises(ValueError, match="of another process begins without a seed; give reset a seed from 100000 to"):
        run(learn)
    folder = run(lambda context: learn(context, seed=context.first_seed), steps=2)
    assert run_folder.read_progress(folder)["environment_steps"] == 0


def write_make(folder):
    """Write a file with a function that makes a policy, and return its path."""
    path = folder / "teacher.py"
    path.write_text(
        "import numpy as np\n\n\ndef make(robot):\n    return lambda timestep: np.zeros(18)\n", encoding="utf-8"
    )
    return path


def blocks():
    """The blocks of the observation of one environment, by name."""
    return {name: np.zeros((1, size)) for name, size in SETUP.definition.sizes.items()}


class Reader:
    """A reader of files of another library, and the policy that it reads: it stands still."""

    joints = 18

    @staticmethod
    def setup(path):
        """The setup of the training."""
        return SETUP

    @staticmethod
    def load(path, further):
        """The policy of a file, without a look at it."""
        return Reader


def act_by(made):
    """A learner that acts by a policy."""
    made.reset([0], [0])

    def act(context):
        made.act(blocks(), np.zeros(1))

    return act


POLICIES = {
    "packaged": lambda folder: policy("ppo", "tick"),
    "noisy": lambda folder: policy("ppo", "tick", noise=0.1),
    "universal": lambda folder: policy("universal", "tick"),
    "module": lambda folder: policy(f"{write_make(folder)}:make", "tick"),
}


def refuse_policy(run, act):
    """Check that a run without sources is refused a policy."""
    with pytest.raises(ValueError) as caught:
        run(act, source="nothing")
    assert str(caught.value) == (
        "algorithm mine: uses a policy and declares source='nothing'; declare source='a policy'"
    )


@pytest.mark.parametrize("name", POLICIES)
def test_policies_count_where_they_act(name, run, tmp_path):
    refuse_policy(run, act_by(POLICIES[name](tmp_path)))


@pytest.mark.parametrize("name", POLICIES)
def test_policies_count_where_they_are_made(name, run, tmp_path):
    refuse_policy(run, lambda context: POLICIES[name](tmp_path))


def test_files_of_other_libraries_count(run, monkeypatch):
    monkeypatch.setattr(other_libraries.PolicyFile, "reader", Reader)
    refuse_policy(run, lambda context: policy("agent.zip", "tick"))
    refuse_policy(run, lambda context: load_network("agent.zip"))


def test_parts_of_stored_networks_count(run):
    stored = network.load(network.PACKAGED / "tick-walk.npz")
    observations = np.zeros((1, stored.size), np.float32)
    for use in (
        lambda context: stored.actions(observations),
        lambda context: stored.graph(observations),
        lambda context: stored._replace(training_seeds=None).graph.arrays,
    ):
        refuse_policy(run, use)


def test_universal_policies_of_one_body_count(run):
    tick = universal.for_body(universal.load("universal"), SETUP)
    moving = policy("universal", "tick")
    refuse_policy(run, lambda context: tick.act(blocks(), np.zeros(1)))
    refuse_policy(run, lambda context: moving.graph)


def test_modules_in_a_process_count(run, tmp_path):
    arguments = write_make(tmp_path), "make", "tick", 1, dict(SETUP.definition.sizes), "teacher"
    with contextlib.closing(Separate(*arguments)) as separate:
        refuse_policy(run, act_by(separate))
    refuse_policy(run, lambda context: Separate(*arguments))


def test_policies_that_the_learner_makes_are_no_source(run):
    task = SETUP.definition

    def act(context):
        own = network.Network(zero_policy(task), SETUP, dict(task.sizes))
        act_by(own)(context)
        act_by(protocol.Individuals(lambda: lambda timestep: np.zeros(18), 1, 18))(context)
        evaluation.run(open_dm(context), own, seed=context.first_seed)

    folder = run(act, steps=8, source="nothing")
    assert run_folder.read_progress(folder)["sources"] == []


def pause_in_slice(context):
    """Play an episode that judges, unseen."""
    with usage.pause():
        context.environment(ENVS).reset(seed=0)


def pause_in_thread(context):
    """Pause in a thread of the learner."""
    errors = []

    def pause():
        try:
            pause_in_slice(context)
        except ValueError as error:
            errors.append(error)

    thread = threading.Thread(target=pause)
    thread.start()
    thread.join()
    raise errors[0]


@pytest.mark.parametrize("act", [pause_in_slice, pause_in_thread])
def test_a_learner_does_not_pause(act, run):
    with pytest.raises(ValueError) as caught:
        run(act)
    assert str(caught.value) == "algorithm mine: pauses the record of its usage; only judges do, between slices"


def test_a_learner_does_not_pause_before_its_first_slice(tmp_path, monkeypatch):
    def learn(hp, context):
        pause_in_slice(context)
        return slices_of(step_vector)(hp, context)

    monkeypatch.setitem(algorithms.ALGORITHMS, "mine", Algorithm(learn, Nothing(), "learns nothing"))
    with pytest.raises(ValueError, match="pauses the record of its usage"):
        train(Configuration.of(SETUP, "mine", steps=16), tmp_path / "run", progress=silent)


@pytest.mark.parametrize("acts", [True, False])
def test_a_learner_that_counts_nothing_ends(acts, run, monkeypatch):
    monkeypatch.setattr(run_usage, "MAX_STALLED_SLICES", 3)
    with pytest.raises(ValueError) as caught:
        run(lambda context: None, acts=acts)
    assert str(caught.value) == (
        "algorithm mine: 3 slices have counted no step after step 0; count what the suite does not see by "
        "context.count_steps, or yield is_complete=False before a step"
    )


def test_slices_before_a_step_are_not_complete():
    watch = run_usage.StepWatch("mine")
    for step in range(3):
        for _ in range(run_usage.MAX_STALLED_SLICES):
            watch.check(step)
    with pytest.raises(ValueError, match="1000 slices have counted no step after step 2"):
        watch.check(2)
