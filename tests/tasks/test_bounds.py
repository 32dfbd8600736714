"""Settings at their bounds: what a task computes is finite, or one line says why not."""

import math
import warnings

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite.arenas import terrain
from arc_suite.envs.gym import Env
from arc_suite.tasks import TASKS, modifiers, parameters
from arc_suite.tasks.command import MAX_COMMAND
from arc_suite.tasks.ground import LEVELS

LARGEST = parameters.LARGEST
BOUNDS = {
    **parameters.BOUNDS,
    **modifiers.bounds(),
    **terrain.SIZES,
    "difficulty": (0.0, 1.0),
    "level": (0, LEVELS - 1),
    "terrain_seed": (0, 2**32 - 1),
    "cost_limit": (1e-9, LARGEST),
    "velocity_band": (1e-9, LARGEST),
    "healthy_range": ((-LARGEST, LARGEST), (LARGEST - 1.0, LARGEST)),
    "weights": ({"smoothness": -LARGEST}, {"control": LARGEST}),
    "time_limit": (1e-9, LARGEST),
    "actuator_failure": (0, 5),
    "poses": (0.0, 1.0),
    "fall_seed": (0, 2**32 - 1),
    "commands": ({"forward": -MAX_COMMAND}, {"left": MAX_COMMAND, "turning": (-MAX_COMMAND, MAX_COMMAND)}),
}
NOT_NUMBERS = ("gait", "gaits", "start", "curriculum", "scan", "motion", "both_sides")
LEVEL = ("steer", "directed", "shoved", "limp")
FEW = ("walk", "rough")


def values(task, name):
    """Settings with one at its bounds; speeds at the least of either direction, too."""
    bounds = BOUNDS[name]
    if name == "target_velocity":
        least = parameters.MIN_SPEED
        bounds = (least, bounds[1], *((-least, bounds[0]) if task == "walk" else ()))
    wider = {"commands": {"forward": 1.5}} if task in LEVEL else {}
    return [{name: value, **({"curriculum": True, **wider} if name == "level" else {})} for value in bounds]


@pytest.mark.parametrize(
    "task", [pytest.param(task, marks=() if task in FEW else pytest.mark.release) for task in TASKS]
)
def test_bounds_are_finite(task):
    for name in (*TASKS[task].names(), "time_limit", *BOUNDS.keys() & modifiers.MODIFIERS.keys()):
        for settings in values(task, name) if name not in NOT_NUMBERS else ():
            assert_finite(task, settings)


def assert_finite(task, settings):
    try:
        environment = Env("tick", task, {"on_divergence": "truncate", **settings})
    except ValueError as error:
        assert "\n" not in str(error), settings
        return
    observation, _ = environment.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        for _ in range(4):
            assert environment.observation_space.contains(observation) and np.isfinite(observation).all(), settings
            observation, reward, terminated, truncated, info = environment.step(np.full(18, 0.5, np.float32))
            assert math.isfinite(reward) and all(map(math.isfinite, info.values())), (settings, reward, info)
            if terminated or truncated:
                break


@pytest.mark.parametrize(
    ("task", "settings", "message"),
    [
        ("walk", {"target_velocity": 0}, "target_velocity: expected at least 0.001 m/s in either direction, got 0.0"),
        (
            "walk",
            {"target_velocity": 1e-9},
            "target_velocity: expected at least 0.001 m/s in either direction, got 1e-09",
        ),
        ("steer", {"target_velocity": 1e-320}, "target_velocity: expected a number from 0.001 to 1000, got 1e-320"),
        ("rough", {"target_velocity": -4}, "target_velocity: expected a number from 0.001 to 1000, got -4"),
        (
            "walk",
            {"default_angles": 1e308},
            "default_angles: expected one number from -6.28319 to 6.28319 or 18 of them, got 1e+308",
        ),
        ("walk", {"gait_frequency": 0}, "gait_frequency: expected a number from 0.001 to 1000, got 0"),
    ],
)
def test_settings_out_of_bounds(task, settings, message):
    with refused(message):
        arc_suite.load("tick", task, settings)


def test_walk_goes_backward():
    assert arc_suite.load("tick", "walk", {"target_velocity": -0.3}).task.definition.target_velocity == -0.3
