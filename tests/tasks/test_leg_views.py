"""What legs see of an observation, and do."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.envs.setup import Setup
from arc_suite.robots import mirror
from arc_suite.tasks.leg_views import leg_views

BODIES = ["queen", "bastion", "tick", "leaper", "hound", "random:1", "varied:5"]
LEVEL = {"exclude_blocks": ["contact_forces"]}


def seen(views, vectors):
    """The features (n, legs, features) of vectors (n, size)."""
    return sum((vectors[..., views.sources[i]] * views.factors[i] for i in range(2)), views.bias)


def done(views, legs):
    """The actions (joints,) of what legs do (legs, joints of a leg)."""
    return legs.ravel()[views.joints] * views.signs


def made(body, symmetric=True):
    task = Setup.of(body, "steer", LEVEL).definition
    return task, leg_views(task.scene.body, task.blocks, task.symmetry if symmetric else None)


@pytest.mark.parametrize("body", BODIES)
def test_a_mirrored_body_has_its_legs_exchanged(body):
    task, views = made(body)
    random, across = np.random.default_rng(0), mirror.image(task.scene.body).legs
    vectors = random.normal(size=(4, task.size))
    assert_array_equal(seen(views, task.symmetry.observation(vectors)), seen(views, vectors)[:, across])
    legs = random.normal(size=(len(across), views.most))
    assert_array_equal(task.symmetry.action(done(views, legs)), done(views, legs[across]))


@pytest.mark.parametrize("body", BODIES)
def test_every_joint_belongs_to_its_leg(body):
    task, views = made(body)
    counts = [len(leg.joints) for leg in task.scene.body.legs]
    own = np.repeat(np.arange(len(counts)), counts)
    assert_array_equal(views.joints // views.most, own)
    assert len(set(views.joints)) == len(own) and set(abs(views.signs)) == {1.0}
    # A leg sees the angle of the joint that it moves, with the sign by which it moves it.
    vectors = np.eye(task.size)[5 : 5 + len(own)]
    angles = seen(views, vectors)[:, :, views.sizes[0] + 5 :][range(len(own)), own, views.joints % views.most]
    assert_array_equal(angles, views.signs)


def test_the_legs_of_tick_differ_by_a_turn_and_a_reflection():
    task, views = made("tick")
    first = views.sizes[0] + views.sizes[1]
    ahead = seen(views, np.eye(task.size)[[5 + 18, 5 + 18 + 1]])[:, :, first : first + 2]  # velocity along x, y
    yaw = np.radians([leg.yaw_deg for leg in task.scene.body.legs[:3]])
    outward = np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1)
    outward = np.concatenate([outward, outward * (1.0, -1.0)])
    # The velocity that points out along a leg is the same to all of them.
    found = np.einsum("lk,klf->lf", outward, ahead)
    assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-6)
    assert_array_equal(views.bias[:, :3].argmax(axis=-1), [0, 1, 2, 0, 1, 2])


def test_the_clock_of_a_leg_is_its_own():
    task, views = made("queen")
    phase, offsets = 0.7, task.parameters.phase_offsets
    vector = np.zeros(task.size)
    start = list(task.sizes).index("gait_clock")
    place = sum(list(task.sizes.values())[:start])
    vector[place : place + 2] = np.sin(phase), np.cos(phase)
    first = sum(views.sizes[: 1 + start])
    found = seen(views, vector[None])[0, :, first : first + 2]
    assert_allclose(found, np.stack([np.sin(phase + offsets), np.cos(phase + offsets)], axis=-1), atol=1e-6)


def test_legs_that_are_no_images_are_of_their_own_kinds():
    _, views = made("queen", symmetric=False)
    assert_array_equal(views.bias[:, :6], np.eye(6))
