"""An observation as each leg of a body sees it, so that one network can act for all legs.

A turn and a reflection map one leg onto another. A leg on the right sees the mirrored observation. For each leg, the
torso's planar vectors are turned about the vertical, and joints get signs. Then the same actions move every foot like
that of the first leg: a command to the left is to one leg what a command forward is to another. Every view is linear:
`parts.Part.view` says what a leg sees of a part.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.standing import by_leg, measure_standing
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.mirrors import Mirror, Symmetry
from arc_suite.tasks.parts import ViewingLeg, diagonal, rotation

VERSION = 1  # of what legs see; runs without a version have turned only the blocks in `TURNED_BEFORE`
TURNED_BEFORE = ("posture", "velocities", "gait_clock", "command")

_SIMILARITY_DIGITS = 9  # decimals, so that of equally good turns the first is chosen despite rounding


class LegViews(NamedTuple):
    """What the legs of a body see and do; a leg with fewer joints than another has zeros in their place.

    Attributes:
        sources: (2, legs, features) indices of the two numbers of a vector whose weighted sum is a feature.
        factors: (2, legs, features) weights of these numbers.
        bias: (legs, features) added to the sum. The first features say to which pair a leg belongs: 1, or else 0.
        joints: (joints,) index of each joint's action among the actions of all legs, (legs * most,).
        signs: (joints,) signs by which these actions are multiplied.
        most: number of joints of the leg with the most joints; each leg has as many actions.
        sizes: numbers of features: first those of pairs, then those of each block.
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
        body: the body with the legs.
        blocks: the blocks of the vectors that legs see, by name, in the order of a vector: first those of the
            observation, then further ones.
        symmetry: mirror maps of such vectors; None for a body whose legs are no mirror images of each other.

    Raises:
        ValueError: a block has numbers without a frame, or a feature is made from more than two numbers.
    """
    viewing_leg_of, is_mirrored = _pair_legs(body, symmetry)
    pairs = viewing_leg_of[:, None] == np.unique(viewing_leg_of)  # (legs, pairs)
    weights_of_legs = []
    biases_of_legs = []
    actions_of_legs = []
    for leg, pair, mirrored in zip(_viewing_legs(body, viewing_leg_of), pairs, is_mirrored, strict=True):
        views = [_view_block(name, block, leg) for name, block in blocks.items()]
        no_weights_of_pairs = np.zeros((0, len(pair)))
        leg_weights = diagonal(no_weights_of_pairs, *(view.weights for view in views))
        leg_actions = leg.joints
        if mirrored:
            leg_weights = _matrix(symmetry.observation) @ leg_weights
            leg_actions = leg_actions @ _matrix(symmetry.action)
        weights_of_legs.append(leg_weights)
        biases_of_legs.append(np.concatenate([pair, *(view.bias for view in views)]))
        actions_of_legs.append(leg_actions)
        sizes = (len(pair), *(len(view.bias) for view in views))  # the same for each leg
    weights = np.stack(weights_of_legs, axis=1)  # (numbers, legs, features)
    sources = np.argsort(-abs(weights), axis=0, kind="stable")[:2]
    actions = np.concatenate(actions_of_legs)  # (actions of all legs, joints), one number of each column is not 0
    action_of_joint = abs(actions).argmax(axis=0)
    signs = actions[action_of_joint, np.arange(len(action_of_joint))]
    return LegViews(
        sources=sources,
        factors=np.take_along_axis(weights, sources, axis=0).astype(np.float32),
        bias=np.stack(biases_of_legs).astype(np.float32),
        joints=action_of_joint,
        signs=signs.astype(np.float32),
        most=len(actions) // len(body.legs),
        sizes=sizes,
    )


class _BlockView(NamedTuple):
    """What a leg sees of a block: weights (size, features) of its numbers, and the bias (features,)."""

    weights: np.ndarray
    bias: np.ndarray


def _view_block(name: str, block: Block, leg: ViewingLeg) -> _BlockView:
    """Return what a leg sees of a block: of each part its features, then its constants."""
    if not block.has_frame:
        raise ValueError(f"network legs: block {name!r} has numbers without a frame, expected other parts")
    weights_of_parts = []
    biases = []
    for part in block.parts:
        features = part.view(leg)
        constants = part.constants(leg)
        weights_of_parts.append(np.pad(features, ((0, 0), (0, len(constants)))))
        biases.append(np.zeros(features.shape[1]))
        biases.append(constants)
    weights = diagonal(*weights_of_parts)
    numbers_of_a_feature = np.count_nonzero(weights, axis=0).max(initial=0)
    if numbers_of_a_feature > 2:
        expected = "expected features of two numbers at most"
        raise ValueError(f"network legs: block {name!r}: {expected}, got {numbers_of_a_feature}")
    return _BlockView(weights, np.concatenate(biases))


def _pair_legs(body: Body, symmetry: Symmetry | None) -> tuple[np.ndarray, np.ndarray]:
    """Return for each leg the index (legs,) of the leg whose view it has, and whether (legs,) the view is mirrored.

    With a symmetry, a leg on the right has the mirrored view of its counterpart on the left.
    """
    indices = np.arange(len(body.legs))
    if symmetry is None:
        return indices, np.zeros(len(indices), bool)
    is_right = measure_standing(body).soles[:, 1] < 0.0
    return np.where(is_right, mirror.image(body).legs, indices), is_right


def _viewing_legs(body: Body, indices: np.ndarray) -> Iterator[ViewingLeg]:
    """Yield the legs with these indices (n,), aligned with the first of them."""
    jacobians = _sole_jacobians(body)
    soles = measure_standing(body).soles[:, :2]  # m
    one_hot_joints = by_leg(body, np.eye(len(body.joint_names)))  # (joints of the leg, joints) of each leg
    first_jacobian = jacobians[indices[0]]
    for index in indices:
        turn, signs = _align(jacobians[index], first_jacobian)
        joints = signs[:, None] * _pad(one_hot_joints[index], len(signs))
        yield ViewingLeg(index, turn, joints, foot=soles[index] / reach(body))


def _align(jacobian: np.ndarray, first: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the turn, rad, and the signs (joints,), that align a leg with the first one.

    Of the turns by whole degrees, it is the one by which the joints move both soles in the most similar way.

    Args:
        jacobian: (joints, 3) velocity of the leg's sole per joint velocity.
        first: the same of the first leg.
    """
    turns = np.radians(range(360))
    rotations = [rotation(turn) for turn in turns]
    planar_velocities = np.einsum("ji,tik->tjk", jacobian[:, :2], rotations)  # (turns, joints, 2)
    products = (planar_velocities * first[:, :2]).sum(axis=-1) + jacobian[:, 2] * first[:, 2]  # (turns, joints)
    similarities = abs(products).sum(axis=-1).round(_SIMILARITY_DIGITS)
    best = similarities.argmax()
    signs = np.where(products[best] < 0.0, -1.0, 1.0)
    return turns[best], signs


def _sole_jacobians(body: Body) -> list[np.ndarray]:
    """Return the velocities (joints, 3) of each sole per joint velocity; 0 for joints that only other legs have."""
    most = max(len(leg.joints) for leg in body.legs)
    return [_pad(jacobian.T, most) for jacobian in measure_standing(body).jacobians]


def _pad(array: np.ndarray, count: int) -> np.ndarray:
    """Return an array (n, ...) with zeros at its end (count, ...)."""
    zeros = np.zeros((count - len(array), *array.shape[1:]))
    return np.concatenate([array, zeros])


def _matrix(mirror_map: Mirror) -> np.ndarray:
    """Return the matrix (n, n) that maps vectors (..., n) as a mirror does, from the right."""
    return mirror_map(np.eye(len(mirror_map.signs)))
