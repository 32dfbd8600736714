"""An observation as each leg of a body sees it, so that one network can act for all legs.

Legs are alike up to a turn and a reflection. A leg on the right sees the mirrored observation. The torso's planar
vectors are turned about the vertical, and signs of joints chosen, so that each foot moves as that of the first leg.
A command to the left is then to one leg what a command forward is to another. Every view is linear: the parts of
blocks say what a leg sees of them, see `parts.Part.view`.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.standing import by_leg, standing
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.mirrors import Mirror, Symmetry
from arc_suite.tasks.parts import ViewingLeg, diagonal, rotation

VERSION = 1  # of what legs see; runs without one have turned the blocks `TURNED_BEFORE` alone
TURNED_BEFORE = ("posture", "velocities", "gait_clock", "command")


class LegViews(NamedTuple):
    """What the legs of a body see and do; a leg with fewer joints than another has zeros in their place.

    Attributes:
        sources: (2, legs, features) places of the two numbers of a vector that a feature is made from.
        factors: (2, legs, features) of these numbers.
        bias: (legs, features) of the features; the first ones are 1 for the pair that a leg belongs to, else 0.
        joints: (joints,) places among what all legs do, (legs * joints of a leg,), of what the body's joints take.
        signs: (joints,) of what they take.
        most: joints of a leg.
        sizes: of the parts of the features: of pairs, then of blocks.
    """

    sources: np.ndarray
    factors: np.ndarray
    bias: np.ndarray
    joints: np.ndarray
    signs: np.ndarray
    most: int
    sizes: tuple[int, ...]


def leg_views(body: Body, blocks: Mapping[str, Block], symmetry: Symmetry | None) -> LegViews:
    """Return the views of the legs of a body.

    Args:
        body: with the legs.
        blocks: of the vectors that they see, by name, in order: those of an observation, and others after them.
        symmetry: mirror maps of such vectors; None for legs that are not each other's images.

    Raises:
        ValueError: a block has numbers without a frame, or a feature is made from more than two numbers.
    """
    kinds, is_mirrored = _kinds(body, symmetry)
    pairs = kinds[:, None] == np.unique(kinds)
    weights = []
    biases = []
    actions = []
    for leg, pair, mirrored in zip(_viewing_legs(body, kinds), pairs, is_mirrored, strict=True):
        views = [_view_block(name, block, leg) for name, block in blocks.items()]
        weight = diagonal(np.zeros((0, len(pair))), *(view.weights for view in views))
        action = leg.joints
        if mirrored:
            weight = _matrix(symmetry.observation) @ weight
            action = action @ _matrix(symmetry.action)
        weights.append(weight)
        biases.append(np.concatenate([pair, *(view.bias for view in views)]))
        actions.append(action)
    weight = np.stack(weights, axis=1)
    sources = np.argsort(-abs(weight), axis=0, kind="stable")[:2]
    action = np.concatenate(actions)
    places = abs(action).argmax(axis=0)
    return LegViews(
        sources,
        np.take_along_axis(weight, sources, axis=0).astype(np.float32),
        np.stack(biases).astype(np.float32),
        places,
        action[places, range(len(places))].astype(np.float32),
        len(action) // len(body.legs),
        (len(pair), *(len(view.bias) for view in views)),
    )


class _BlockView(NamedTuple):
    """What a leg sees of a block: weights (size, features) of its numbers, and the bias (features,)."""

    weights: np.ndarray
    bias: np.ndarray


def _view_block(name: str, block: Block, leg: ViewingLeg) -> _BlockView:
    if not block.has_frame:
        raise ValueError(f"network legs: block {name!r} has numbers without a frame, expected other parts")
    weights = []
    biases = []
    for part in block.parts:
        features = part.view(leg)
        constants = part.constants(leg)
        weights.append(np.pad(features, ((0, 0), (0, len(constants)))))
        biases += [np.zeros(features.shape[1]), constants]
    weight = diagonal(*weights)
    if (most := np.count_nonzero(weight, axis=0).max(initial=0)) > 2:
        raise ValueError(f"network legs: block {name!r}: expected features of two numbers at most, got {most}")
    return _BlockView(weight, np.concatenate(biases))


def _kinds(body: Body, symmetry: Symmetry | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the leg (legs,) whose views each leg has, and whether (legs,) it has them in the mirror."""
    indices = np.arange(len(body.legs))
    if symmetry is None:
        return indices, np.zeros(len(indices), bool)
    is_right = standing(body).soles[:, 1] < 0.0
    return np.where(is_right, mirror.image(body).legs, indices), is_right


def _viewing_legs(body: Body, kinds: Iterable[int]) -> Iterator[ViewingLeg]:
    """Yield the legs that observations are transformed for."""
    jacobians = _jacobians(body)
    soles = standing(body).soles[:, :2]
    joints = by_leg(body, np.eye(len(body.joint_names)))
    for kind in kinds:
        turn, signs = _align(jacobians[kind], jacobians[kinds[0]])
        yield ViewingLeg(kind, turn, signs[:, None] * _pad(joints[kind], len(signs)), soles[kind] / reach(body))


def _align(jacobian: np.ndarray, first: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the turn, rad, and the signs of joints, for which a foot's Jacobian (joints, 3) is most like the first."""
    turns = np.radians(range(360))
    planar = np.einsum("ji,tik->tjk", jacobian[:, :2], [rotation(turn) for turn in turns])
    products = (planar * first[:, :2]).sum(axis=-1) + jacobian[:, 2] * first[:, 2]
    best = abs(products).sum(axis=-1).round(9).argmax()
    return turns[best], np.where(products[best] < 0.0, -1.0, 1.0)


def _jacobians(body: Body) -> list[np.ndarray]:
    """Velocities (joints, 3) of each sole per joint velocity, with as many rows for each leg."""
    most = max(len(leg.joints) for leg in body.legs)
    return [_pad(jacobian.T, most) for jacobian in standing(body).jacobians]


def _pad(rows: np.ndarray, count: int) -> np.ndarray:
    return np.concatenate([rows, np.zeros((count - len(rows), *rows.shape[1:]))])


def _matrix(mirror_map: Mirror) -> np.ndarray:
    """Return the matrix (n, n) that maps vectors (..., n) as a mirror does, from the right."""
    return mirror_map(np.eye(len(mirror_map.signs)))
