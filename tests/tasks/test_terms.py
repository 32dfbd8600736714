"""The ten terms, recomputed by hand from raw simulation data."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite.cpg import Demonstrator
from arc_suite.envs import dm
from arc_suite.envs.prepare import prepared
from arc_suite.robots import ROBOTS
from arc_suite.simulation.physics import Physics
from arc_suite.tasks import terms
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.suite import Steer

DT = 0.05
PI = math.pi

# Taken down from the published figures, apart from the package's own table.
FIGURES = {
    "queen": dict(
        control=0.05, frequency=1.5, target=0.5, sigma=0.3, threshold=0.12, z=(0.25, 1.2), feet="l1 l2 l3 r1 r2 r3"
    ),
    "bastion": dict(
        control=0.08, frequency=1.5, target=0.5, sigma=0.3, threshold=0.08, z=(0.15, 1.0), feet="l1 l2 l3 r1 r2 r3"
    ),
    "tick": dict(
        control=0.05, frequency=1.5, target=0.33, sigma=0.33, threshold=0.06, z=(0.08, 0.35), feet="l1 l2 l3 r1 r2 r3"
    ),
    "leaper": dict(control=0.1, frequency=1.2, target=0.6, sigma=0.4, threshold=0.08, z=(0.2, 1.0), feet="fl fr rl rr"),
}
OFFSETS = {"l1": PI, "r1": 0, "l2": 0, "r2": PI, "l3": PI, "r3": 0, "fl": 0, "fr": PI, "rl": PI, "rr": 0}


def by_hand(robot, model, data, x_before, phase, action, previous_action):
    """Terms and reward from the formulas of the paper's Section 4, one number at a time."""
    f = FIGURES[robot]
    wrong = 0
    for leg in f["feet"].split():
        target = (phase + OFFSETS[leg]) % (2 * PI) < 2 * PI * 0.6
        wrong += (data.body(f"{leg}_foot").xpos[2] < f["threshold"]) != target
    feet = len(f["feet"].split())
    bodies = [i for i in range(model.nbody) if model.body(i).name != "world"]
    joints = [model.joint(i) for i in range(model.njnt) if model.joint(i).name != "root"]
    terms = {
        "forward": max(0.0, 1 - abs((data.body("torso").xpos[0] - x_before) / DT - f["target"]) / f["sigma"]),
        "healthy": float(f["z"][0] <= data.qpos[2] <= f["z"][1]),
        "gait_bonus": 1 - wrong / feet,
        "gait_cost": float(wrong),
        "control": sum(a * a for a in action),
        "smoothness": sum((a - b) ** 2 for a, b in zip(action, previous_action, strict=True)),
        "contact": sum(min(1.0, max(-1.0, c)) ** 2 for body in bodies for c in data.cfrc_ext[body]),
        "angular_velocity": data.qvel[3] ** 2 + data.qvel[4] ** 2,
        "vertical_velocity": data.qvel[2] ** 2,
        "posture": sum(data.qpos[joint.qposadr[0]] ** 2 for joint in joints),
    }
    reward = (
        1.5 * terms["forward"]
        + 1.0 * terms["healthy"]
        + 1.5 * terms["gait_bonus"]
        - 0.1 * terms["gait_cost"]
        - f["control"] * terms["control"]
        - 0.02 * terms["smoothness"]
        - 0.0005 * terms["contact"]
        - 0.05 * terms["angular_velocity"]
        - 0.02 * terms["vertical_velocity"]
        - 0.001 * terms["posture"]
    )
    return terms, reward


@pytest.mark.parametrize("robot", tiers(FIGURES, lambda robot: robot == "leaper"))
def test_terms_and_reward_against_the_formulas(robot):
    environment = arc_suite.load(robot, "walk", {"random": 3})
    demonstrator = Demonstrator(robot, "fast")
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    noise = np.random.RandomState(0)
    timestep = environment.reset()
    previous, phase = np.zeros(model.nu), 0.0
    seen = {name: set() for name in environment.task.settings.weights}
    for steps in range(1, 121):
        action = (demonstrator(timestep) + noise.normal(0, 0.2, model.nu)).clip(-1, 1)
        x_before, phase = (
            float(data.body("torso").xpos[0]),
            (phase + 2 * PI * FIGURES[robot]["frequency"] * DT) % (2 * PI),
        )
        timestep = environment.step(action)
        terms, reward = by_hand(robot, model, data, x_before, phase, action, previous)
        assert environment.task.terms.keys() == terms.keys()
        for name, value in terms.items():
            assert_allclose(environment.task.terms[name], value, rtol=1e-9, atol=1e-9, err_msg=f"{name}, step {steps}")
            seen[name].add(round(value, 6))
        assert_allclose(timestep.reward, reward, rtol=1e-9, atol=1e-9)
        previous = action
    assert all(len(values) > 1 for name, values in seen.items() if name != "healthy"), seen


def test_healthy_term_is_zero_after_a_fall():
    environment = arc_suite.load("queen", "walk", {"random": 0, "healthy_range": (0.76, 1.2)})
    environment.reset()
    timestep = environment.step(np.zeros(18))
    while not timestep.last():
        timestep = environment.step(np.zeros(18))
    assert environment.task.terms["healthy"] == 0.0
    assert timestep.discount == 0.0


def test_costs_of_a_batch_are_the_costs_of_its_environments():
    rng = np.random.default_rng(0)
    default = rng.uniform(-0.5, 0.5, 12)
    shapes = Readings((17,), (3,), (4,), (12,), (18,), (126,), (3,), (4,))
    for axes in ((5,), (2, 3)):
        readings = Readings(*(rng.normal(0, 0.3, axes + shape) for shape in shapes))
        step = *rng.uniform(-1, 1, (2, *axes, 12)), rng.integers(0, 5, axes).astype(float)
        batch = terms.costs(readings, *step, default)
        for index in np.ndindex(*axes):
            one = Readings(*(array[index] for array in readings))
            row = terms.costs(one, *(array[index] for array in step), default)
            for name, value in row.items():
                assert batch[name].shape == axes
                assert batch[name][index] == value, name


def test_the_triangular_kernel_has_compact_support():
    def forward(velocity):
        return terms.triangle(np.float64(velocity) - 0.5, 0.3)

    assert forward(0.5) == 1.0
    assert_allclose(forward(0.65), 0.5)
    assert_allclose(forward(0.35), 0.5)
    assert forward(0.81) == forward(0.19) == forward(-0.5) == 0.0


@pytest.mark.filterwarnings("error")
def test_an_infinite_velocity_earns_nothing():
    for velocities in (np.float64(np.inf), np.float64(-np.inf), np.array([np.inf, -np.inf])):
        assert_array_equal(terms.triangle(velocities - 0.5, 0.3), 0.0)


class Longer(Steer):
    """Steer with one more bonus."""

    weights = Steer.weights | {"lower": 0.5}

    def terms(self, memory, readings):
        return super().terms(memory, readings) | {"lower": 1.0 - readings.torso_height}


def reward_of_a_step(kind):
    """The reward of a step of a class of tasks, and its terms."""
    plain, _ = prepared("tick", "steer")
    task = kind(plain.scene, kind.settings_for(plain.scene.body, {}))
    run = dm.TaskRun(task, 0)
    environment = dm.Environment(Physics.from_body(task.scene.body, task.scene.arena), run, {})
    environment.reset()
    return environment.step(np.full(18, 0.5)).reward, run.terms


def test_a_term_from_outside_counts_and_costs_are_limited_after_it():
    plain, terms_of_plain = reward_of_a_step(Steer)
    reward, found = reward_of_a_step(Longer)
    assert_allclose(reward, plain + 0.5 * found["lower"], rtol=1e-12)
    assert found == terms_of_plain | {"lower": found["lower"]}
    costs = sum(Longer.weights[name] * found[name] for name in found if Longer.weights[name] < 0.0)
    assert 0.1 < -costs < Steer.settings_for(ROBOTS["tick"], {}).cost_limit


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (Steer.weights | {"lowre": 0.5}, "unknown weight 'lowre'; did you mean 'lower'? (there are: gait_cost, "),
        (Steer.weights, "term 'lower' has no weight (there are: progress, tracking, "),
    ],
    ids=["a weight without a term", "a term without a weight"],
)
def test_terms_and_weights_that_do_not_pair_are_one_line(weights, message):
    with refused(message, begins=True):
        reward_of_a_step(type("Unpaired", (Longer,), {"weights": weights}))
