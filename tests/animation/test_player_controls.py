"""What a person chooses poses and gaits from."""

import numpy as np
import pytest

from arc_suite.animation import player_controls
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.models.outline import torso_box
from arc_suite.robots import ROBOTS

BODIES = [*ROBOTS.values(), generator.random_body(4)]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_torsos_stay_above_the_ground(body):
    low, high = player_controls.pose_room(body).T
    assert (low <= 0.0).all() and (high >= 0.0).all() and (high > low).any()
    ride, height = posture.find_rest_pose(body).ride_height, body.torso.standing_height
    assert (ride + low[0]) * height + torso_box(body)[0][2] > 0.07 * height
    kept = posture.measure_room(body, planted=False)
    np.testing.assert_allclose(player_controls.pose_room(body)[1:], kept[1:], atol=1e-9)  # which stays as it was
    assert (kept[0, 0] <= low[0] + 1e-9) and kept[0, 1] == pytest.approx(high[0])


def test_what_is_set_of_a_task():
    task = Setup.of("tick", "directed").definition
    asked = player_controls.commands(task, (1.0, 0.0, 0.0), (-9.0, 0.0, 0.0, 0.0, 0.0, 0.0), "ripple")
    assert asked["command"] == (1.0, 0.0, 0.0)
    np.testing.assert_allclose(asked["pose"], (-0.29, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert asked["gait"][-2:] == [0.75, task.parameters.gait_frequency]
    quick = player_controls.commands(task, None, None, "ripple", 1.2)["gait"]
    assert quick == [*asked["gait"][:-1], 1.2 * task.parameters.gait_frequency]
    most = player_controls.pose_room(task.scene.body)[:, 1]
    np.testing.assert_allclose(
        player_controls.commands(task, None, most, None)["pose"], most / 6.0
    )  # together they are less
    slow = player_controls.commands(task, (0.6, 0.0, 0.0), None, "ripple")["gait"]
    assert slow[-2:] == pytest.approx([0.8, 0.82 * task.parameters.gait_frequency])
    own = player_controls.commands(task, None, None, "trot")["gait"]  # which does not fit
    assert own == player_controls.commands(task, None, None, player_controls.OWN_GAIT)["gait"]
    assert own[-2] == task.parameters.duty_factor
    assert player_controls.commands(task, None, None, None) == {"command": None, "pose": None, "gait": None}


@pytest.mark.parametrize(("name", "asked"), [("steer", {"command": None}), ("walk", {}), ("navigate", {})])
def test_tasks_without_poses(name, asked):
    assert (
        player_controls.commands(Setup.of("tick", name).definition, None, np.zeros(6), player_controls.OWN_GAIT)
        == asked
    )
