"""The gait's clock: phases added up in double precision, by tick."""

import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from arc_suite.envs.prepare import prepare_task
from arc_suite.robots import ROBOTS
from arc_suite.tasks.clock import Clock, desired_contacts

TWO_PI = 2.0 * math.pi


@pytest.mark.parametrize("robot", ROBOTS)
def test_phases_are_summed_step_by_step(robot):
    task, _ = prepare_task(robot, "walk")
    phase, turn = 0.0, TWO_PI * task.parameters.gait_frequency * 0.05
    for tick in range(1001):
        assert task.clock.phases[tick] == phase
        assert_array_equal(task.clock.entries(task.clock.circle, tick), [np.sin(phase), np.cos(phase)])
        wanted = desired_contacts(np.float64(phase), task.parameters.duty_factor, task.parameters.phase_offsets)
        assert_array_equal(task.clock.entries(task.clock.stance, tick), wanted)
        phase = (phase + turn) % TWO_PI


@pytest.mark.parametrize("frequency", [1.5, 1.2345])
def test_an_endless_episode_goes_round_without_a_jump(frequency):
    clock = Clock.make(frequency, 0.6, np.zeros(1), 0.05, math.inf)
    period, turn = len(clock.phases), TWO_PI * frequency * 0.05
    before, after = clock.entries(clock.phases, period - 1), clock.entries(clock.phases, period)
    assert after == 0.0
    jump = (after - before - turn + math.pi) % TWO_PI - math.pi
    assert abs(jump) < 1e-3 * turn
