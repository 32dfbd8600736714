"""An observation as each leg of a body sees it, so that one network can act for all legs.

Legs are alike up to a turn and a reflection. A leg on the right sees the mirrored observation. The torso's planar
vectors are turned about the vertical, and signs of joints chosen, so that each foot moves as that of the first leg.
A command to the left is then to one leg what a command forward is to another. Every view is linear.
"""

import itertools
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.standing import by_leg, standing
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task
from arc_suite.tasks.mirrors import Mirror, Symmetry

# Of blocks: where planar vectors begin, and where joints do.
_PLANAR = {"posture": (2,), "velocities": (0, 3), "command": (0, 3)}
_JOINTS = {"posture": 5, "velocities": 6}


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


def leg_views(task: Task, sizes: Mapping[str, int], symmetry: Symmetry | None) -> LegViews:
    """Return the views of the legs of a task's body.

    Args:
        task: whose observations they are.
        sizes: of the blocks of a vector, in order: those of the observation, and others after them.
        symmetry: mirror maps of such vectors; None for legs that are not each other's images.
    """
    body = task.scene.body
    kinds, right = np.arange(len(body.legs)), np.zeros(len(body.legs), bool)
    if symmetry is not None:
        right = standing(body).soles[:, 1] < 0.0
        kinds = np.where(right, mirror.image(body).legs, kinds)
    phases = np.zeros(len(kinds)) if task.parameters is None else task.parameters.phase_offsets
    jacobians, joints = _jacobians(body), by_leg(body, np.eye(len(body.joint_names)))
    weights, actions = [], []
    for kind, reflected in zip(kinds, right, strict=True):
        turn, signs = _alignment(jacobians[kind], jacobians[kinds[0]])
        action = signs[:, None] * _padded(joints[kind], len(signs))
        weight = _features(sizes, action, turn, phases[kind])
        if reflected:
            weight, action = _matrix(symmetry.observation) @ weight, action @ _matrix(symmetry.action)
        weights.append(weight)
        actions.append(action)
    pairs, weight, action = kinds[:, None] == np.unique(kinds), np.stack(weights, axis=1), np.concatenate(actions)
    weight = np.concatenate([np.zeros((len(weight), *pairs.shape)), weight], axis=-1)
    sources = np.argsort(-abs(weight), axis=0, kind="stable")[:2]
    places = abs(action).argmax(axis=0)
    return LegViews(
        sources,
        np.take_along_axis(weight, sources, axis=0).astype(np.float32),
        np.pad(pairs, ((0, 0), (0, weight.shape[-1] - pairs.shape[1]))).astype(np.float32),
        places,
        action[places, range(len(places))].astype(np.float32),
        len(signs),
        (pairs.shape[1], *(_JOINTS[name] + len(signs) if name in _JOINTS else size for name, size in sizes.items())),
    )


def _features(sizes: Mapping[str, int], joints: np.ndarray, turn: float, phase: float) -> np.ndarray:
    """Return the weight (size, features) of the features of vectors whose blocks have these sizes.

    Args:
        sizes: of the blocks.
        joints: (joints of a leg, joints) signs of the leg's own joints.
        turn: of planar vectors, rad.
        phase: by which the leg is ahead of the clock, rad.
    """
    numbers, starts = np.eye(sum(sizes.values())), itertools.accumulate(sizes.values(), initial=0)
    parts = []
    for (name, size), start in zip(sizes.items(), starts, strict=False):
        part = numbers[:, start : start + size].copy()
        for place in _PLANAR.get(name, ()):
            part[:, place : place + 2] @= _rotation(turn)
        if name == "gait_clock":
            part @= _rotation(-phase)
        if name in _JOINTS:
            part = np.concatenate([part[:, : _JOINTS[name]], part[:, _JOINTS[name] :] @ joints.T], axis=-1)
        parts.append(part)
    return np.concatenate(parts, axis=-1)


def _alignment(jacobian: np.ndarray, first: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the turn, rad, and the signs of joints, for which a foot's Jacobian (joints, 3) is most like the first."""
    turns = np.radians(range(360))
    planar = np.einsum("ji,tik->tjk", jacobian[:, :2], [_rotation(turn) for turn in turns])
    products = (planar * first[:, :2]).sum(axis=-1) + jacobian[:, 2] * first[:, 2]
    best = abs(products).sum(axis=-1).round(9).argmax()
    return turns[best], np.where(products[best] < 0.0, -1.0, 1.0)


def _rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) that turns planar vectors (..., 2) by an angle, rad, from the right."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array(((cos, sin), (-sin, cos)))


def _jacobians(body: Body) -> list[np.ndarray]:
    """Velocities (joints, 3) of each sole per joint velocity, with as many rows for each leg."""
    most = max(len(leg.joints) for leg in body.legs)
    return [_padded(jacobian.T, most) for jacobian in standing(body).jacobians]


def _padded(rows: np.ndarray, count: int) -> np.ndarray:
    return np.concatenate([rows, np.zeros((count - len(rows), *rows.shape[1:]))])


def _matrix(mirrored: Mirror) -> np.ndarray:
    """Return the matrix (n, n) that maps vectors (..., n) as a mirror does, from the right."""
    return mirrored(np.eye(len(mirrored.signs)))
