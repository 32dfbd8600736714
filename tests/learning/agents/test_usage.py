"""A run counts its steps, and learns in its own episodes from the sources that its algorithm declares."""

import contextlib
import dataclasses
import functools
import threading

import numpy as np
import pytest
from tqdm import tqdm

import arc_suite
from arc_suite import evaluation, usage
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, run_folder
from arc_suite.learning.agents.algorithms import Algorithm
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.learner import Slice
from arc_suite.learning.agents.training import train
from arc_suite.policies import policy
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
    import gymnasium

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
