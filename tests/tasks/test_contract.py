"""The contract: every task of the registry, on every robot and another body, keeps it, where it takes place or may."""

import itertools
import types

import gymnasium
import numpy as np
import pytest
import twins
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import tiers, turn, turns

import arc_suite
from arc_suite.arenas import ARENAS
from arc_suite.bodies import generator
from arc_suite.envs import trees
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import TASKS
from arc_suite.tasks.walk import Walk

BODIES = {**ROBOTS, "random": generator.random_body(3)}
every_task = pytest.mark.parametrize("task_name", TASKS)
# Every task in its own arena, or in one of each kind: a plane, a height field, boxes.
PLACES = [
    (name, settings)
    for name, task in TASKS.items()
    for settings in ([{}] if task.own_arena else [{"arena": "flat"}, {"arena": "bumps"}, {"arena": "stairs"}])
]
_PAIRS = [(name, settings, body) for name, settings in PLACES for body in BODIES]


def in_turn(name, settings, body, bodies=1):
    """Whether it is the turn of a body, which go from place to place, so many in each."""
    return turn(body, BODIES, PLACES.index((name, settings)), bodies)


def at_once(name, settings, body):
    """Whether `make check` has it: tasks that choose their arena on a height field, the others in their own."""
    return in_turn(name, settings, body) and settings.get("arena") in (None, "bumps")


every_place_and_body = pytest.mark.parametrize(
    ("task_name", "settings", "body"), tiers(_PAIRS, at_once, lambda *pair: in_turn(*pair, bodies=2))
)


def frozen(memory):
    """The memory with arrays that refuse to be written."""
    for leaf in trees.leaves(memory):
        if isinstance(leaf, np.ndarray):
            leaf.flags.writeable = False
    return memory


def started(task, seed=0):
    """A simulation of one environment at the start of an episode, its data, and the memory."""
    batch = Batch(compile_model(task.scene.body, task.scene.arena), 1, 1, task.reads)
    start = task.start(np.random.RandomState(seed), task.first())
    mask = np.ones(1, bool)
    batch.reset(mask, start.qpos[None], start.qvel[None])
    memory = frozen(start.memory)
    lifted = task.clear_spawn(memory, task.read(read_only(batch, task)))
    if lifted is not None:
        batch.place(mask, lifted[None])
    return batch, frozen(task.begin(memory, task.read(read_only(batch, task))))


def read_only(batch, task):
    """The fields that a task declares, of the first environment, which nobody can write."""
    fields = {name: getattr(batch.data, name)[0].copy() for name in task.reads}
    for field in fields.values():
        field.flags.writeable = False
    return types.SimpleNamespace(**fields)


@every_place_and_body
def test_functions_are_pure_and_read_what_is_declared(task_name, body, settings):
    task, _ = prepare_task(BODIES[body], task_name, settings)
    batch, memory = started(task)
    rng = np.random.RandomState(1)
    for _ in range(5):
        action = rng.uniform(-0.3, 0.3, len(task.scene.body.joint_names))
        action.flags.writeable = False
        before, inputs = task.before(memory, action)
        batch.data.ctrl[0] = inputs.ctrl
        batch.step(25, np.ones(1, bool))
        readings = task.read(read_only(batch, task))
        memory = frozen(task.after(frozen(before), readings))
        for function in (task.after, task.terms, task.observe, task.ended):
            arguments = (before if function == task.after else memory), readings
            for once, again in zip(leaves(function(*arguments)), leaves(function(*arguments)), strict=True):
                assert_array_equal(once, again)
        assert type(memory) is type(before)
        assert task.terms(memory, readings).keys() == task.settings.weights.keys()
        assert {name: block.shape for name, block in task.observe(memory, readings).items()} == {
            name: (size,) for name, size in task.sizes.items()
        }
        assert all(np.shape(figure) == () for figure in task.progress(memory).values())
        assert np.shape(task.resampled(memory)) == ()


def leaves(value):
    return [np.asarray(leaf) for leaf in trees.leaves(tuple(value.values()) if isinstance(value, dict) else value)]


@pytest.mark.slow
@pytest.mark.parametrize(("body", "task_name"), tiers(itertools.product(BODIES, TASKS), turns(BODIES, TASKS)))
def test_the_number_of_draws_is_fixed(task_name, body):
    """Whatever is drawn, and whatever the settings are, the stream is at the same place afterwards."""
    task, _ = prepare_task(BODIES[body], task_name)
    numbers = []
    for seed in range(20):
        random = Counting(seed)
        task.start(random, task.first())
        numbers.append(random.draws)
    assert len(set(numbers)) == 1 and numbers[0] > 0


class Counting(np.random.RandomState):
    """Counts the numbers that are drawn, as every draw of an array asks for its size."""

    draws = 0

    def uniform(self, *arguments, **keywords):
        return self._counted(super().uniform(*arguments, **keywords))

    def standard_normal(self, *arguments, **keywords):
        return self._counted(super().standard_normal(*arguments, **keywords))

    def randint(self, *arguments, **keywords):
        return self._counted(super().randint(*arguments, **keywords))

    def _counted(self, drawn):
        self.draws += np.size(drawn)
        return drawn


@pytest.mark.parametrize(
    ("task_name", "settings", "body", "threads"),
    tiers(
        [(*pair, threads) for pair in _PAIRS for threads in (1, 3)],
        check=lambda *case: case[-1] == 3 and case[0] in ("walk", "roam", "navigate") and at_once(*case[:-1]),
        test=lambda *case: case[-1] == 3 and in_turn(*case[:-1]),
    ),
)
def test_an_environment_is_bit_equal_to_a_single_environment(task_name, body, settings, threads):
    """Over several episodes, among environments that fall or stand still at other times."""
    settings = settings | {"time_limit": 14 * prepare_task(BODIES[body], "walk")[0].scene.control_timestep}
    envs = VectorEnv(BODIES[body], task_name, 3, threads, task_kwargs=settings)
    single = gymnasium.make(SINGLE, domain_name=BODIES[body], task_name=task_name, task_kwargs=settings)
    observations, observation = envs.reset(seed=40)[0], single.reset(seed=41)[0]
    assert_array_equal(observations[1], observation)
    random, ended, episodes = np.random.RandomState(0), False, 0
    for step in range(45):
        action = random.uniform(-1.0, 1.0, envs.single_action_space.shape).astype(np.float32)
        if step == 6:  # an environment that starts in mid-episode of the others
            envs.reset(seed=9, options={"reset_mask": np.array([True, False, False])})
        ended = twins.step(envs, single, action, ended)
        episodes += ended
    assert episodes >= 3


ARENA_NAMES = f"(there are: {', '.join(ARENAS)}, module:name to import it)"
SINGLE = "arc_suite/queen-walk-v0"  # whose domain and task other arguments take the place of


@every_task
def test_settings_check_themselves(task_name):
    own = f"arena: task {task_name} has a ground of its own, expected none" if TASKS[task_name].own_arena else None
    for settings, message in (
        ({"weigths": {}}, f"unknown setting of {task_name} 'weigths'; did you mean 'weights'?"),
        ({"weights": {"contrl": 1.0}}, "unknown term of weights 'contrl'; did you mean 'control'?"),
        ({"arena": "bump"}, own or f"unknown arena 'bump'; did you mean 'bumps'? {ARENA_NAMES}"),
        ({"time_limit": 0}, "time_limit: expected a number above 0, at most 1e+06, got 0"),
    ):
        with refused(message, begins=True):
            arc_suite.load("tick", task_name, settings)


@pytest.mark.parametrize(
    ("change", "observed"),
    [
        (
            lambda blocks: blocks | {"gait_clock": np.append(blocks["gait_clock"], np.zeros(3))},
            "{'posture': 17, 'velocities': 18, 'contact_forces': 126, 'gait_clock': 5}",
        ),
        (
            lambda blocks: dict(reversed(blocks.items())),
            "{'gait_clock': 2, 'contact_forces': 126, 'velocities': 18, 'posture': 17}",
        ),
        (
            lambda blocks: {name: blocks[name] for name in list(blocks)[:-1]},
            "{'posture': 17, 'velocities': 18, 'contact_forces': 126}",
        ),
    ],
    ids=["of another size", "in another order", "left out"],
)
def test_blocks_other_than_declared_are_impossible(monkeypatch, change, observed):
    class Careless(Walk):
        name = "careless"

        def observe(self, memory, readings):
            return change(super().observe(memory, readings))

    monkeypatch.setitem(TASKS, "careless", Careless)
    declared = "{'posture': 17, 'velocities': 18, 'contact_forces': 126, 'gait_clock': 2}"
    environment = arc_suite.load("leaper", "careless")
    with refused(f"observation of careless: expected blocks {declared}, got {observed}"):
        environment.reset()
