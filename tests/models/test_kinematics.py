"""Kinematics of legs, against MuJoCo's."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.bodies import generator
from arc_suite.models.kinematics import Legs, damped_changes, least_changes
from arc_suite.models.standing import pose_mechanics
from arc_suite.robots import ROBOTS

BODIES = [*ROBOTS.values(), *map(generator.random_body, (1, 2, 8))]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_soles_and_jacobians_are_those_of_the_model(body):
    legs = Legs.of(body)
    angles = np.random.RandomState(0).uniform(-0.5, 0.5, len(body.joint_names))
    pose, (soles, jacobians) = pose_mechanics(body, angles), legs.soles(legs.by_leg(angles))
    assert_allclose(soles, pose.soles, atol=1e-12)
    for leg, expected in enumerate(pose.jacobians):
        assert_allclose(jacobians[leg][:, legs.has_joint[leg]], expected, atol=1e-12)
    assert_array_equal(legs.by_joint(legs.by_leg(angles)), angles)


@pytest.mark.parametrize("robot", ["queen", "tick"])
def test_three_joints_reach_places_near_by(robot):
    legs, random = Legs.of(ROBOTS[robot]), np.random.RandomState(1)
    middle, height = 0.5 * (legs.low + legs.high), ROBOTS[robot].torso.standing_height
    goals = legs.soles(middle + 0.2 * random.uniform(-1.0, 1.0, (5, *middle.shape)) * (legs.high - legs.low))[0]
    weights = np.tile(np.eye(3), (*goals.shape[:2], 1, 1))
    found = legs.solve_joint_angles(np.broadcast_to(middle, goals.shape), goals, weights, 0.02 * height, 30)
    assert_allclose(legs.soles(found)[0], goals, atol=0.01 * height)
    assert ((found >= legs.low) & (found <= legs.high)).all()


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_what_is_out_of_reach_stays_within_bounds(body):
    legs = Legs.of(body)
    middle = 0.5 * (legs.low + legs.high)
    goals = legs.soles(middle)[0] + (0.0, 0.0, 10.0 * body.torso.standing_height)
    weights = np.tile(np.eye(3), (len(goals), 1, 1))
    found = legs.solve_joint_angles(middle, goals, weights, 0.02, 20)
    assert np.isfinite(found).all() and ((found >= legs.low) & (found <= legs.high)).all()


def test_damped_least_squares_have_two_forms_and_the_least_error():
    random = np.random.RandomState(2)
    jacobian, missing, damping = random.normal(size=(4, 3, 5)), random.normal(size=(4, 3, 1)), 0.3
    changes = least_changes(jacobian, missing, damping)
    pull = jacobian.swapaxes(-1, -2) @ missing
    assert_allclose(changes, damped_changes(jacobian, pull, damping**2 * np.eye(5))[..., 0], atol=1e-12)

    def error(angles):
        left = missing[..., 0] - (jacobian @ angles[..., None])[..., 0]
        return (left**2).sum(axis=-1) + damping**2 * (angles**2).sum(axis=-1)

    for other in changes + 0.01 * random.normal(size=(20, *changes.shape)):
        assert (error(other) > error(changes)).all()


def test_a_joint_with_more_damping_changes_less():
    jacobian = np.ones((3, 2))
    first, second = damped_changes(jacobian, jacobian.T @ np.ones(3), np.diag((0.1, 10.0)))
    assert first == pytest.approx(100.0 * second)


def test_redundant_joints_return_to_rest_under_soles_that_stay():
    body = generator.random_body(4)
    legs = Legs.of(body)
    assert (legs.has_joint.sum(axis=-1) == 4).all()
    height = body.torso.standing_height
    rest_angles = 0.5 * (legs.low + legs.high)
    soles, _ = legs.soles(rest_angles)
    bent_angles = rest_angles + 0.2 * (legs.high - legs.low) * (0.0, 1.0, -1.0, 1.0)
    weights = np.tile(np.eye(3), (len(soles), 1, 1))
    angles = legs.solve_joint_angles(bent_angles, soles, weights, 0.02 * height, 40)
    assert abs(angles - rest_angles).max(axis=-1).min() > 0.2  # in another pose each foot is in its place
    for _ in range(100):
        angles = legs.relax_redundant_joints(angles, rest_angles, 0.1, 1e-3 * height)
    assert_allclose(legs.soles(angles)[0], soles, atol=0.03 * height)
    assert abs(angles - rest_angles).max() < 0.05


@pytest.mark.parametrize("body", [*ROBOTS.values(), generator.random_body(1)], ids=lambda body: body.name)
def test_joints_that_a_foot_needs_do_not_relax(body):
    legs = Legs.of(body)
    assert legs.relax_redundant_joints(legs.low, legs.high, 0.2, 0.01) is legs.low
