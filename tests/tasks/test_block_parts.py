"""What follows from the parts of blocks: views of legs, mirror images, places in vectors of many bodies, names."""

import functools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.bodies import generator
from arc_suite.bodies.padding import MAX_JOINTS, MAX_LEGS
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS, mirror
from arc_suite.tasks import TASKS, mirrors
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.leg_views import leg_views
from arc_suite.tasks.parts import (
    Grid,
    Joints,
    Legs,
    Part,
    Phase,
    Planar,
    Quaternion,
    Rays,
    Repeated,
    RigidParts,
    Scalar,
    Unframed,
    Vector,
    join_padding,
)

STAR = generator.generate(6, 3, layout="radial")  # six equal legs at 60 degrees
TURN = np.radians(60.0)
TRIPOD = np.array((0.0, np.pi) * 3)

RAYS = np.stack([np.cos(np.arange(12) * TURN / 2.0), np.sin(np.arange(12) * TURN / 2.0)])
GRID = np.stack(np.meshgrid((0.0, 1.0), (-1.0, 0.0, 1.0))).reshape(2, -1)


class Pair(Part):
    """Two numbers of every leg, as a package of its own may have them."""

    size = 12

    def mirror(self, image):
        return mirrors.repeat(image.legs, mirrors.Mirror.with_signs(1, 1))

    def view(self, leg):
        return np.eye(12)[:, [2 * leg.index, 2 * leg.index + 1]]

    def entries(self):
        yield from ((str(index), "") for index in range(12))


# One of each part, as another package may declare them.
OUTSIDE = {
    "scalar": Block((Scalar(), Scalar(sign=-1))),
    "planar": Block((Planar(), Planar(axial=True))),
    "vector": Block((Vector(), Vector(axial=True), Quaternion())),
    "joints": Block((Joints(STAR), Joints(STAR, signed=False))),
    "legs": Block((Legs(STAR), RigidParts(STAR, (Vector(), Scalar())))),
    "phase": Block((Phase("", TRIPOD), Phase())),
    "rays": Block((Rays(RAYS),)),
    "repeated": Block((Repeated((Planar(), Joints(STAR), Legs(STAR)), 3),)),
    "pair": Block((Pair(),)),
}


def settings(task):
    """Settings in which the observation has a history, and legs of the body take turns, if the task has a gait."""
    gait = {"phase_offsets": tuple(TRIPOD), "default_angles": (0.0,) * 18}
    return {"history": 2} | {name: value for name, value in gait.items() if name in TASKS[task].names()}


@functools.cache
def blocks_of(task):
    """All blocks of a task for the star, privileged ones too."""
    definition = Setup.of(STAR, task, settings(task)).definition
    return {**definition.blocks, **{f"privileged {name}": b for name, b in definition.privileged_blocks.items()}}


def shift(part):
    """The matrix by which numbers of a part change (from the right) in a state turned by one leg, counterclockwise."""
    next_leg = np.roll(np.eye(6), 1, axis=1)
    turn = np.array(((np.cos(TURN), np.sin(TURN)), (-np.sin(TURN), np.cos(TURN))))
    match part:
        case Scalar():
            return np.eye(1)
        case Planar():
            return turn
        case Vector():
            return np.block([[turn, np.zeros((2, 1))], [np.zeros((1, 2)), 1.0]])
        case Quaternion():
            return np.block(
                [
                    [1.0, np.zeros((1, 3))],
                    [np.zeros((2, 1)), turn, np.zeros((2, 1))],
                    [np.zeros((1, 3)), 1.0],
                ]
            )
        case Joints():
            return np.kron(next_leg, np.eye(3))
        case Legs():
            return next_leg
        case Pair():
            return np.kron(next_leg, np.eye(2))
        case RigidParts():
            order = np.zeros((25, 25))
            order[0, 0], order[1:, 1:] = 1.0, np.kron(next_leg, np.eye(4))
            return np.kron(order, together([shift(each) for each in part.parts]))
        case Phase():  # legs next to each other are half a cycle apart; without offsets each has its own
            return -np.eye(2) if part.offsets is not None else np.eye(2)
        case Rays():
            return np.roll(np.eye(part.size), part.size // 6, axis=1)
        case Repeated():
            return np.kron(np.eye(part.count), together([shift(each) for each in part.parts]))
    raise AssertionError(part)


def together(matrices):
    """The matrix with others on its diagonal."""
    joined = np.zeros((sum(map(len, matrices)),) * 2)
    for matrix, last in zip(matrices, np.cumsum([len(matrix) for matrix in matrices]), strict=True):
        joined[last - len(matrix) : last, last - len(matrix) : last] = matrix
    return joined


def seen(views, vectors):
    """What legs see (n, legs, features) of vectors (n, size)."""
    return sum((vectors[..., views.sources[i]] * views.factors[i] for i in range(2)), views.bias)


def turns(block):
    """Whether legs see a block turned: grids stay as the body has them."""
    return Grid not in block.kinds


@pytest.mark.parametrize("task", [*TASKS, OUTSIDE], ids=[*TASKS, "outside"])
def test_a_turned_state_permutes_the_views(task):
    """To each leg, a state that is turned by 60 degrees is what the leg before saw of the state."""
    every = blocks_of(task) if isinstance(task, str) else task
    blocks = {name: block for name, block in every.items() if turns(block)}
    views = leg_views(STAR, blocks, None)
    vectors = np.random.default_rng(0).normal(size=(4, sum(block.size for block in blocks.values())))
    turned = vectors @ together([shift(part) for block in blocks.values() for part in block.parts])
    pairs = views.sizes[0]
    assert_allclose(np.roll(seen(views, vectors), 1, axis=1)[..., pairs:], seen(views, turned)[..., pairs:], atol=1e-6)


@pytest.mark.parametrize("task", [*TASKS, OUTSIDE | {"grid": Block((Grid(GRID),))}], ids=[*TASKS, "outside"])
def test_a_mirrored_state_reflects_the_views(task):
    """To each leg, a mirrored state is what the leg across saw of the state, its own pair included."""
    blocks, image = blocks_of(task) if isinstance(task, str) else task, mirror.image(STAR)
    observation = mirrors.join([block.mirror(image) for block in blocks.values()])
    views = leg_views(STAR, blocks, mirrors.Symmetry(observation, mirrors.joints(image)))
    vectors = np.random.default_rng(1).normal(size=(4, sum(block.size for block in blocks.values())))
    assert_allclose(seen(views, observation(vectors)), seen(views, vectors)[:, image.legs], atol=1e-6)


def test_rays_between_two_are_interpolated():
    angles = np.radians(90.0) * np.arange(4)
    rays = Rays(np.stack([np.cos(angles), np.sin(angles)]))
    views = leg_views(ROBOTS["tick"], {"ranges": Block((rays,))}, None)
    pairs = views.sizes[0]
    assert_allclose(seen(views, np.ones((1, 4)))[..., pairs:], 1.0, atol=1e-6)
    assert 0.0 < views.factors[1, :, pairs:].max() <= 0.5


def test_the_place_of_the_foot_is_beside_a_grid():
    body = ROBOTS["tick"]
    views = leg_views(body, {"scan": Block((Grid(GRID),))}, None)
    feet = views.bias[:, -2:]
    assert views.sizes[1] == GRID.shape[1] + 2
    directions = np.array([leg.foot_position[:2] for leg in body.legs])
    assert (np.sum(feet * directions, axis=-1) > 0.9 * np.hypot(*directions.T) * np.hypot(*feet.T)).all()


@pytest.mark.parametrize(
    "part", [Unframed(2), Repeated((Planar(), Unframed(2)), 2), RigidParts(STAR, (Unframed(),))], ids=lambda p: type(p)
)
def test_numbers_without_a_frame_are_refused_in_one_line(part):
    """Also within other parts."""
    message = "^network legs: block 'odd' has numbers without a frame, expected other parts$"
    with pytest.raises(ValueError, match=message):
        leg_views(STAR, {"odd": Block((Joints(STAR), part))}, None)


def test_a_view_of_many_numbers_is_refused_in_one_line():
    class Sum(Pair):
        def view(self, leg):
            return np.ones((12, 1))

    message = "^network legs: block 'sum': expected features of two numbers at most, got 12$"
    with pytest.raises(ValueError, match=message):
        leg_views(STAR, {"sum": Block((Sum(),))}, None)


@pytest.mark.parametrize("task", TASKS)
def test_every_number_has_a_name_and_a_place(task):
    for name, block in blocks_of(task).items():
        assert len(block.entries()) == block.size, name
        padding = join_padding([part.padding(MAX_LEGS, MAX_JOINTS) for part in block.parts])
        assert len(set(padding.places)) == block.size <= padding.size, name
        assert padding.places.max() < padding.size, name


def test_numbers_of_bodies_lie_at_the_same_places_by_leg():
    """The second leg's numbers of a body of four legs and of one of six have one place."""
    for body in (generator.generate(4, 2), generator.generate(6, 3)):
        joints = len(body.legs[0].joints)
        assert Legs(body).padding(12, 4).places[1] == 1
        assert Joints(body).padding(12, 4).places[joints] == 4
        rigid = RigidParts(body, (Vector(), Vector())).padding(12, 4)
        assert rigid.places[6 * (1 + len(body.legs[0].parts))] == 6 * (1 + 5) and rigid.size == 6 * (1 + 12 * 5)


def test_a_body_of_too_many_legs_is_refused_in_one_line():
    with pytest.raises(ValueError, match="expected at most 4 legs, got 6$"):
        Legs(STAR).padding(4, 4)
    with pytest.raises(ValueError, match="expected at most 12 legs of at most 2 joints, got 6 legs of up to 3$"):
        Joints(STAR).padding(12, 2)


def test_noise_is_given_for_each_part():
    block = Block((Scalar(), Vector()), (0.1, 0.2))
    assert_array_equal(block.widths, (0.1, 0.2, 0.2, 0.2))
    assert_array_equal(Block((Scalar(), Vector()), 0.3).widths, (0.3,) * 4)
