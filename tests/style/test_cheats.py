"""The known ways to cheat show in the metrics."""

import functools
import math

import numpy as np
import pytest
from synthetic import DT, LEGS, synthetic
from tiers import tiers

import arc_suite
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.law import joint_targets, proprioception, torques
from arc_suite.cpg.prescribed import lay_out_pattern
from arc_suite.cpg.presets import PRESETS
from arc_suite.robots import ROBOTS
from arc_suite.style import measure, record


class Scripted:
    """A demonstrator that cheats: `stand`, `hop` with all feet at once, `drag` the first leg, or walk `back`."""

    def __init__(self, robot, cheat):
        body, self.preset, self.cheat = ROBOTS[robot], PRESETS[robot]["medium"], cheat
        honest = lay_out_pattern(body, self.preset)
        changes = {"hop": {"offset": 0.0 * honest.offset}, "back": {"sweep": -honest.sweep}}
        self.pattern = honest._replace(**changes.get(cheat, {}))
        self.limp = len(body.legs[0].joints)

    def reset(self, indices, seeds):
        self.clock = 0

    def act(self, observation, rewards):
        _, angles, velocities = proprioception(observation)
        targets = joint_targets(self.pattern, np.full(1, DT * self.clock))
        self.clock += 1
        if self.cheat == "stand":
            targets = 0.0 * targets
        action = torques(targets, angles, velocities, self.preset.stiffness, self.preset.damping)
        if self.cheat == "drag":
            action[:, : self.limp] = 0.0
        return action


ONE = pytest.mark.parametrize("robot", tiers(ROBOTS, lambda robot: robot == "queen"))


@functools.cache
def measured(robot, cheat=None):
    policy = Scripted(robot, cheat) if cheat else Demonstrator(robot, "medium")
    return measure(record(arc_suite.load(robot, "walk"), policy, seed=0, max_steps=400))


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_standing_still_shows(robot):
    honest, cheat = measured(robot), measured(robot, "stand")
    assert cheat["gait_compliance"].value > 0.55  # which alone would not tell
    assert abs(cheat["speed"].value) < 0.01 < 0.3 < honest["speed"].value
    assert math.isnan(cheat["stride_length"].value)
    assert cheat["duty_factor"].value > 0.99 > 0.8 > honest["duty_factor"].value
    assert cheat["foot_clearance"].value < 0.25 * honest["foot_clearance"].value
    assert cheat["foot_slip"].value == cheat["cost_of_transport"].value == math.inf


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_hopping_shows(robot):
    honest, cheat = measured(robot), measured(robot, "hop")
    assert cheat["asymmetry"].value > 10 * honest["asymmetry"].value
    assert cheat["foot_slip"].value > 4 * honest["foot_slip"].value
    assert honest["phase_scatter"].value < 0.5  # 1.0 of ideal hops, with all feet in the air at once


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_dragging_one_leg_shows(robot):
    honest, cheat = measured(robot), measured(robot, "drag")
    leg = ROBOTS[robot].legs[0].name
    assert cheat["asymmetry"].legs[leg] > 20 * honest["asymmetry"].legs[leg]
    assert cheat["torque"].legs[leg] == cheat["action_change"].legs[leg] == 0.0
    drag = measure(synthetic(dragged=0))
    assert drag["foot_slip"].legs[LEGS[0]] > 1.0 > 0.3 > max(honest["foot_slip"].legs.values())


@pytest.mark.slow
@ONE
def test_walking_backwards_shows(robot):
    honest, cheat = measured(robot), measured(robot, "back")
    assert cheat["speed"].value < -0.1 < 0.3 < honest["speed"].value
    assert cheat["stride_length"].value < -0.05 < 0.1 < honest["stride_length"].value
    turned = measure(synthetic(course=0.0, facing=math.pi))  # tail first along the way
    assert turned["heading_error"].value > 3.0 > 0.5 > honest["heading_error"].value
