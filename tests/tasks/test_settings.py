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
from arc_suite.tasks.ground import Level
from arc_suite.tasks.modified_task import add_modifiers
from arc_suite.tasks.modifiers import SUITE_MODIFIERS
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
    "slope": 0.3,
    "width": 0.05,
    "commands": {"forward": (-1.5, 1.5)},
    "start": "belly",
    "poses": 1.0,
    "gaits": ("ripple",),
    "cost_limit": 0.3,
    "friction": (0.2, 0.3),
    "mass": (2.0, 2.5),
    "payload": (1.0, 2.0),
    "center_of_mass": 0.3,
    "joint_offset": 0.3,
    "gains": (0.3, 0.4),
    "actions": "position",
    "motor_strength": (0.2, 0.3),
    "joint_strength": (0.2, 0.3),
    "armature": (3.0, 4.0),
    "actuator_failure": True,
    "kicks": 2.0,
    "force": 2.0,
    "delay": (2, 3),
    "exclude_blocks": ("posture",),
    "sensors_only": True,
    "observation_noise": {"posture": 1.0},
    "history": 2,
    **dict.fromkeys((*parameters.SHARED_NOISE, *parameters.Noise._fields), 0.05),
}
WIDER = {"commands": {"forward": (-1.5, 1.5)}}
WITH = {"level": {"curriculum": True}, "gains": {"actions": "position"}}  # settings without which others are refused
ON_LEVEL_GROUND = {"curriculum": WIDER, "level": WIDER}  # others, on level ground
SCENE = ("geom_pos", "geom_size", "hfield_data")  # what a body may not reach in a few steps


def names(task):
    """The settings that a task has, without those of every task."""
    return TASKS[task].names()


MODIFIERS = [name for kind in SUITE_MODIFIERS for name in kind.defaults]
PAIRS = [(task, name) for task in TASKS for name in names(task)]
PAIRS += [(task, name) for task in ("walk", "steer", "navigate") for name in MODIFIERS]


def prerequisites(task, name):
    """The settings without which a task refuses a setting."""
    on_level_ground = ON_LEVEL_GROUND if "start" in names(task) else {}
    return WITH.get(name, {}) | on_level_ground.get(name, {})


def told(task, settings):
    """Everything that a task tells of two episodes of 40 steps of random actions, and its scene."""
    environment = arc_suite.load("tick", task, {"random": 5, **settings})
    random, found = np.random.RandomState(2), []
    for _ in range(2):
        timestep = environment.reset()
        found += [flat(timestep)]
        for _ in range(40):
            if timestep.last():
                break
            timestep = environment.step(random.uniform(-0.6, 0.6, 18))
            found += [flat(timestep), np.array([timestep.reward, timestep.discount])]
    model = environment.physics.model.ptr
    return np.concatenate([*found, *(getattr(model, name).ravel() for name in SCENE)])


@pytest.mark.parametrize(
    ("task", "name"),
    tiers(PAIRS, lambda task, name: task == "walk" or task == "rough" and name in ("gait", "level", "weights")),
)
def test_every_setting_changes_something(task, name):
    given = prerequisites(task, name)
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


LANES = [task for task in TASKS if "difficulty" in names(task)]
LEVELED = [task for task in TASKS if "level" in names(task)]


@pytest.mark.parametrize("task", LEVELED)
def test_a_level_needs_a_curriculum(task):
    with refused("level: needs the setting curriculum=True, got 5"):
        arc_suite.load("tick", task, {"level": 5})


@pytest.mark.parametrize("task", LANES)
def test_a_difficulty_is_none_of_a_curriculum(task):
    message = "difficulty: expected none with curriculum=True, as each level has its own, got 0.3"
    with refused(message):
        arc_suite.load("tick", task, {"curriculum": True, "difficulty": 0.3})
    environment = arc_suite.load("tick", task, {"difficulty": 0.3})
    with refused("level: needs the setting curriculum=True, got 3"):
        environment.change_settings({"level": 3})


@pytest.mark.parametrize("task", [name for name in TASKS if name != "walk"])
def test_settings_of_walk_alone_are_refused_elsewhere(task):
    for name in ("velocity_band", "healthy_range"):
        with refused(f"setting '{name}': {task} has none; walk has it"):
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


@pytest.mark.parametrize("task", TASKS)
def test_short_episodes_have_finite_metrics(task):
    """An episode may end before a step, after one, or before the first cycle of the gait, with a curriculum, too."""
    task_class = TASKS[task]
    for curriculum in (False, True):
        settings = {"time_limit": 0.1, "random": 0}
        if curriculum:
            if not hasattr(task_class, "ground") or task == "navigate":
                continue
            settings["curriculum"] = True
            if isinstance(task_class.ground, Level):
                settings["commands"] = {"forward": (-1.0, 2.0)}
        environment = arc_suite.load("tick", task, settings)
        for steps in (0, 0, 1, 0, 2, 2):
            environment.reset()
            for _ in range(steps):
                timestep = environment.step(np.ones(18))
            assert np.isfinite(list(environment.task.progress.values())).all()
            if steps:
                assert np.isfinite(np.concatenate(list(timestep.observation.values()))).all()
