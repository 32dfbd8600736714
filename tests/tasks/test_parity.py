"""Walk against a computation by hand, from plain MuJoCo and the paper's formulas alone."""

import math
from typing import NamedTuple

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers

import arc_suite
from arc_suite import models
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS

STEPS = 60  # of each episode
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
WEIGHTS = {
    "forward": 1.5,
    "healthy": 1.0,
    "gait_bonus": 1.5,
    "gait_cost": -0.1,
    "control": -0.05,
    "smoothness": -0.02,
    "contact": -0.0005,
    "angular_velocity": -0.05,
    "vertical_velocity": -0.02,
    "posture": -0.001,
}


class Figures(NamedTuple):
    """A robot's numbers, taken down from the published ones, apart from the package's own table."""

    control: float  # weight
    frequency: float
    target: float
    sigma: float
    threshold: float
    healthy: tuple[float, float]


FIGURES = {
    "queen": Figures(-0.05, 1.5, 0.5, 0.3, 0.12, (0.25, 1.2)),
    "bastion": Figures(-0.08, 1.5, 0.5, 0.3, 0.08, (0.15, 1.0)),
    "tick": Figures(-0.05, 1.5, 0.33, 0.33, 0.06, (0.08, 0.35)),
    "leaper": Figures(-0.1, 1.2, 0.6, 0.4, 0.08, (0.2, 1.0)),
}
LAST_HALF = ("l1", "r2", "l3", "fr", "rl")  # legs whose phase is half a cycle ahead


class Published:
    """The published environment's step: 25 times mj_step of the model as a file holds it, with masks."""

    def __init__(self, robot, environment):
        """Starts where an environment that has just been reset stands."""
        self.figures = FIGURES[robot]
        self.weights = WEIGHTS | {"control": self.figures.control}
        self.model = mujoco.MjModel.from_xml_string(models.assemble(ROBOTS[robot]).to_xml_string())
        assert self.model.npair == 0 and self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.data = mujoco.MjData(self.model)
        self.feet = [self.model.body(name).id for name in ROBOTS[robot].foot_names]
        self.offsets = math.pi * np.array([name.startswith(LAST_HALF) for name in ROBOTS[robot].foot_names])
        physics = environment.physics
        state = np.empty(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(physics.model.ptr, physics.data.ptr, state, STATE)
        mujoco.mj_setState(self.model, self.data, state, STATE)
        mujoco.mj_kinematics(self.model, self.data)
        self.phase, self.last_action = 0.0, np.zeros(self.model.nu)
        self.speeds, self.schedule_errors = [], []

    def step(self, action):
        """Returns the observation and the terms of the reward."""
        figures, data = self.figures, self.data
        action = np.clip(action, -1.0, 1.0)
        before = data.body("torso").xpos[0]
        data.ctrl[:] = action
        for _ in range(25):
            mujoco.mj_step(self.model, data)
        speed = (data.body("torso").xpos[0] - before) / (25 * self.model.opt.timestep)
        self.phase = (self.phase + 2 * math.pi * figures.frequency * 0.05) % (2 * math.pi)
        wanted = (self.phase + self.offsets) % (2 * math.pi) < 2 * math.pi * 0.6
        wrong = int(((data.xpos[self.feet, 2] < figures.threshold) != wanted).sum())
        self.speeds.append(speed), self.schedule_errors.append(wrong)
        forces = np.clip(data.cfrc_ext[1:], -1.0, 1.0).ravel()
        terms = {
            "forward": max(0.0, 1.0 - abs(speed - figures.target) / figures.sigma),
            "healthy": 1.0,
            "gait_bonus": 1.0 - wrong / len(self.feet),
            "gait_cost": wrong,
            "control": np.sum(action**2),
            "smoothness": np.sum((action - self.last_action) ** 2),
            "contact": np.sum(forces**2),
            "angular_velocity": np.sum(data.qvel[3:5] ** 2),
            "vertical_velocity": data.qvel[2] ** 2,
            "posture": np.sum(data.qpos[7:] ** 2),
        }
        self.last_action = action
        clock = (math.sin(self.phase), math.cos(self.phase))
        observation = np.concatenate([data.qpos[2:], data.qvel, forces, clock])
        return observation, terms


@pytest.mark.parametrize("fallen", [False, True], ids=["walking", "falling"])
@pytest.mark.parametrize("robot", tiers(FIGURES, lambda robot: robot in ("tick", "leaper")))
def test_observation_reward_and_progress_are_the_published_ones(robot, fallen):
    assert arc_suite.load(robot, "walk").task.settings.healthy_range == FIGURES[robot].healthy
    environment = arc_suite.load(robot, "walk", {"random": 3, "healthy_range": (-9.0, 9.0)})
    policy, random = Demonstrator(robot, "tuned"), np.random.RandomState(4)
    for _ in range(2):  # episodes
        timestep = environment.reset()
        published = Published(robot, environment)
        speeds = []
        for _ in range(STEPS):
            action = policy(timestep) + random.normal(0.0, 1.0 if fallen else 0.1, published.model.nu)
            timestep = environment.step(action)
            observation, terms = published.step(action)
            assert_array_equal(environment.physics.state(), np.concatenate([published.data.qpos, published.data.qvel]))
            assert_allclose(np.concatenate(list(timestep.observation.values())), observation, rtol=0.0, atol=1e-9)
            assert environment.task.terms.keys() == terms.keys()
            for name, term in terms.items():
                assert_allclose(environment.task.terms[name], term, rtol=1e-9, atol=1e-9, err_msg=name)
            reward = sum(weight * terms[name] for name, weight in published.weights.items())
            assert_allclose(timestep.reward, reward, rtol=0.0, atol=1e-12)
            speeds.append(environment.task.terms["forward"])
        progress = environment.task.progress
        assert_allclose(progress["speed"], np.mean(published.speeds), rtol=0.0, atol=1e-12)
        assert 0 < np.sum(published.schedule_errors) < STEPS * len(published.feet)
        compliance = 1.0 - np.mean(published.schedule_errors) / len(published.feet)
        assert_allclose(progress["gait_compliance"], compliance, rtol=0.0, atol=1e-12)
        assert np.count_nonzero(speeds) > 0  # the term that looks at the frame's position has been looked at


def test_overriding_one_weight_keeps_the_others():
    weights = arc_suite.load("tick", "walk", {"weights": {"contact": -1}}).task.settings.weights
    assert weights == WEIGHTS | {"contact": -1.0}
    assert arc_suite.load("tick", "walk").task.settings.weights == WEIGHTS
