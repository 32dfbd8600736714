"""Every setting of every task changes something, and a task refuses those of others under its own name."""

import copy
import pickle

import numpy as np
import pytest
from episodes import flat
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite.tasks import TASKS, parameters
from arc_suite.tasks.contract import Task
from arc_suite.tasks.modified_task import add_modifiers
from arc_suite.tasks.suite import Steer

# Another value of every setting.
OTHER = {
    "target_velocity": 0.2,
    "velocity_band": 2.0,
    "gait_frequency": 1.1,
    "duty_factor": 0.8,
    "phase_offsets": 1.0,
    "stance_threshold": 0.02,
    "default_angles": 0.3,
    "healthy_range": (0.175, 0.5),
    "weights": {"control": -0.5},
    "gait": "wave",
    "difficulty": 0.1,
    "curriculum": True,
    "level": 5,
    "terrain_seed": 3,
    "rise": 0.05,
    "cost_limit": 0.3,
    **dict.fromkeys((*parameters.SHARED_NOISE, *parameters.Noise._fields), 0.05),
}
WITH = {"level": {"curriculum": True}}


def names(task):
    """The settings that a task has, without those of every task."""
    return TASKS[task].names()


PAIRS = [(task, name) for task in ("walk", "steer", "rough", "navigate") for name in names(task)]


def told(task, settings):
    """Everything that a task tells of 40 steps of random actions."""
    environment = arc_suite.load("tick", task, {"random": 5, **settings})
    random, timestep = np.random.RandomState(2), environment.reset()
    found = [flat(timestep)]
    for _ in range(40):
        if timestep.last():
            break
        timestep = environment.step(random.uniform(-1.0, 1.0, 18))
        found += [flat(timestep), np.array([timestep.reward, timestep.discount])]
    return np.concatenate(found)


@pytest.mark.parametrize(
    ("task", "name"),
    tiers(PAIRS, lambda task, name: task == "walk" or task == "rough" and name in ("gait", "level", "weights")),
)
def test_every_setting_changes_something(task, name):
    given = WITH.get(name, {})
    plain, changed = told(task, given), told(task, given | {name: OTHER[name]})
    assert plain.shape != changed.shape or not np.array_equal(plain, changed)


def test_tasks_that_differ_in_data_alone_have_the_same_settings():
    assert {task: names(task) for task in TASKS if task in ("shoved", "limp")} == dict.fromkeys(
        ("shoved", "limp"), names("steer")
    )
    sizes = {
        "rough": ["rise"],
        "slopes": ["slope"],
        "stairs": ["rise", "width"],
        "gaps": ["width"],
        "leap": ["rise", "width"],
        "course": [],
    }
    for task, own in (sizes | {"roam": ["commands", "rise"]}).items():
        assert sorted(names(task)) == sorted((*names("course"), *own))


@pytest.mark.parametrize("task", [name for name in TASKS if name != "walk"])
def test_settings_of_walk_alone_are_refused_elsewhere(task):
    for name in ("velocity_band", "healthy_range"):
        with refused(f"unknown setting of {task} '{name}'", begins=True):
            arc_suite.load("tick", task, {name: OTHER[name]})


def test_a_modified_task_has_every_member_of_the_contract_and_of_its_own():
    plain = arc_suite.load("tick", "steer").task.definition
    task = add_modifiers(plain, {"kicks": 1.0})
    members = {name for name in (*vars(Task), *Task.__annotations__, *vars(Steer)) if not name.startswith("_")}
    assert [name for name in members if not hasattr(task, name)] == []
    assert (task.context, task.health, task.unwrapped) == (plain.context, plain.health, plain)
    with pytest.raises(AttributeError, match="'contxet'"):
        task.contxet  # noqa: B018


def test_methods_of_a_task_are_given_its_own_memory():
    """Also those that the contract does not know."""
    environment = arc_suite.load("tick", "steer", {"kicks": 1.0})
    environment.reset()
    environment.step(np.zeros(18))
    task, memory = environment.task.definition, environment.task.memory
    assert task.judged_steps(memory) == task.task.judged_steps(memory.task) == 1
    assert task.phase(memory) == task.task.phase(memory.task)


def test_a_modified_task_is_copied_and_pickled():
    task = arc_suite.load("tick", "shoved").task.definition
    for again in (copy.deepcopy(task), pickle.loads(pickle.dumps(task))):
        assert (type(again), again.name, again.sizes) == (type(task), "shoved", task.sizes)
