"""The text of a task under `jax.jit` and `jax.vmap`: what it computes is what NumPy computes."""

import pathlib
import re
import types

import numpy as np
import pytest

from arc_suite.bodies import generator
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, terms

jax = pytest.importorskip("jax", reason="of the extra `jax`: make check-jax")
jax.config.update("jax_enable_x64", True)

GUIDE = (pathlib.Path(__file__).parents[2] / "docs" / "adding_a_task.md").read_text()
(OF_THE_GUIDE,) = re.findall(r"```python\n([^`]*?class LevelSteer.*?)```", GUIDE, re.DOTALL)

BODIES = {"queen": ROBOTS["queen"], "leaper": ROBOTS["leaper"], "random": generator.random_body(3)}
NUM_ENVS, STEPS = 3, 60
MODIFIERS = {"kicks": 1.0, "motor_strength": (0.5, 1.0), "actuator_failure": True, "observation_noise": 1.0}
MODIFIERS |= {"delay": (0, 3), "actions": "position", "exclude_blocks": "gait_clock"}
MODIFIERS |= {
    "joint_offset": 0.05,
    "joint_strength": (0.5, 1.0),
    "sensors_only": True,
    "gains": (0.8, 1.2),
    "force": 0.3,
    "history": 2,
}


def assert_close(ours, theirs):
    ours, theirs = jax.tree.leaves(ours), jax.tree.leaves(theirs)
    assert len(ours) == len(theirs)
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(np.asarray(other), np.asarray(mine), rtol=1e-12, atol=1e-12)


def recorded(body, task_name, settings):
    """Yields memory, action and fields of the simulation, before and after steps of environments that walk about."""
    envs = VectorEnv(body, task_name, NUM_ENVS, 1, task_kwargs=settings)
    envs.reset(seed=0)
    task, random = envs.task.definition, np.random.RandomState(0)
    for _ in range(STEPS):
        memory = envs._memory
        action = random.uniform(-0.4, 0.4, envs.action_space.shape)
        envs.step(action)
        yield task, memory, action, {name: getattr(envs.batch.data, name).copy() for name in task.reads}


PLACES = [
    (name, settings)
    for name, task in TASKS.items()
    for settings in ([{}] if task.own_arena else [{"arena": "flat"}, {"arena": "bumps"}, {"arena": "stairs"}])
]
PLACES += [(name, MODIFIERS) for name in ("walk", "steer", "course")]


def test_the_term_and_the_block_of_the_guide():
    there = {"__name__": "level_steer"}
    exec(compile(OF_THE_GUIDE, "adding_a_task.md", "exec"), there)
    try:
        settings = {"observation_noise": {"last_action": 0.02}}
        test_jit_and_vmap_compute_what_numpy_computes("level_steer", settings, "leaper")
    finally:
        del TASKS["level_steer"]


@pytest.mark.parametrize(("task_name", "settings"), PLACES)
@pytest.mark.parametrize("body", BODIES)
def test_jit_and_vmap_compute_what_numpy_computes(task_name, settings, body):
    def step(task, memory, action, fields):
        """A control step as a driver runs it, without the simulation: everything that a task computes."""
        data = types.SimpleNamespace(**fields)
        readings = task.read(data)
        memory, inputs = task.before(memory, action)
        memory = task.after(memory, readings)
        ends = tuple(end | np.zeros((), bool) for end in task.ended(memory, readings))
        return (
            readings,
            memory,
            inputs,
            terms.reward(task.terms(memory, readings), task.settings.weights, task.cost_limit),
            task.observe(memory, readings),
            task.privileged(memory, data),
            ends[0],
            task.progress(memory),
            task.resampled(memory) | np.zeros((), bool),
            task.begin(memory, readings),
            task.clear_spawn(memory, readings),
        )

    compiled = None
    for task, memory, action, fields in recorded(BODIES[body], task_name, settings):
        if compiled is None:
            compiled = {
                "environments at once": jax.jit(lambda *values, task=task: step(task, *values)),
                "one environment, mapped": jax.jit(jax.vmap(lambda *values, task=task: step(task, *values))),
            }
        expected = step(task, memory, action, fields)
        for function in compiled.values():
            assert_close(expected, function(*jax.tree.map(jax.numpy.asarray, (memory, action, fields))))
