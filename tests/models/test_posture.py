"""Poses of the torso over its feet."""

import imports
import numpy as np
import pytest

from arc_suite.models import posture
from arc_suite.robots import ROBOTS


def test_a_pose_is_as_wide_as_legs_reach_with_room_about_their_feet():
    tick = posture.find_wide_pose(ROBOTS["tick"], 0.2, 0.15)
    rest = posture.find_rest_pose(ROBOTS["tick"])
    height = ROBOTS["tick"].torso.standing_height
    moved = abs(tick.sole_positions) - abs(rest.sole_positions)
    np.testing.assert_allclose(moved[:, 1:], np.tile((0.2 * height, -0.15 * height), (6, 1)), atol=0.02 * height)
    assert tick.ride_height == pytest.approx(rest.ride_height - 0.15)
    # The rear hips of Leaper are at their limit: it keeps its pose, as does a body whose pose is not to change.
    for name, numbers in (("leaper", (0.2, 0.15)), ("tick", (0.0, 0.0))):
        kept = posture.find_wide_pose(ROBOTS[name], *numbers)
        np.testing.assert_array_equal(kept.joint_angles, posture.find_rest_pose(ROBOTS[name]).joint_angles)


def test_robots_with_weak_motors_stand_half_as_wide():
    robot = imports.quadruped()  # needs 0.64 of its torques in a trot in this pose

    def weaken(link):
        servo = link.joint.servo
        return link.replace(joint=link.joint.replace(servo=servo.replace(limit=0.5 * servo.limit)))

    legs = [leg.replace(links=tuple(weaken(link) if link.joint else link for link in leg.links)) for leg in robot.legs]
    weak_robot = robot.replace(legs=tuple(legs))
    assert posture.find_wide_pose(robot, 0.5, 0.25).ride_height == 0.75
    assert posture.find_wide_pose(weak_robot, 0.5, 0.25).ride_height == 0.875


def test_a_torso_moves_ahead_and_up_over_its_feet():
    leaper = ROBOTS["leaper"]
    height = leaper.torso.standing_height
    rest = posture.find_rest_pose(leaper)
    shifted = posture.find_shifted_pose(leaper, 0.12, 0.1)
    moved = rest.sole_positions - shifted.sole_positions
    np.testing.assert_allclose(moved, np.tile((0.12 * height, 0.0, 0.1 * height), (4, 1)), atol=0.02 * height)
    assert shifted.ride_height == pytest.approx(rest.ride_height + 0.1)
    out_of_reach = posture.find_shifted_pose(leaper, 3.0, 0.0)
    np.testing.assert_array_equal(out_of_reach.joint_angles, rest.joint_angles)


def test_a_body_that_takes_poses_by_command_rests_where_its_joints_have_room():
    """The rear knees of Leaper are at their limits in its pose at rest, so that it could not lean at all."""
    leaper = ROBOTS["leaper"]
    posed = posture.find_pose_with_room(leaper)
    rest = posture.find_rest_pose(leaper)
    moved = (rest.sole_positions - posed.sole_positions) / leaper.torso.standing_height
    np.testing.assert_allclose(moved, np.tile((0.05, 0.0, 0.1), (4, 1)), atol=0.02)
    assert posed.ride_height == pytest.approx(rest.ride_height + 0.1)
    low, high = posture.measure_room(leaper, planted=False).T
    assert (low <= -0.05).all() and (high >= 0.05).all()
    # Others keep their pose.
    for name in ("queen", "bastion", "tick"):
        pose, rest = posture.find_pose_with_room(ROBOTS[name]), posture.find_rest_pose(ROBOTS[name])
        np.testing.assert_array_equal(pose.joint_angles, rest.joint_angles)
        np.testing.assert_array_equal(pose.sole_positions, rest.sole_positions)
