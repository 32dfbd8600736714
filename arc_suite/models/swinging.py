"""Bones of ornaments that swing: a damped spring pulls the mass of a bone to where the torso holds it.

The bone points from its pivot to its mass, which moves in the world. The offset e of the mass from the place where the
torso holds it follows e'' + 2 d w e' + w^2 e = -a, a being the acceleration of that place. While
that place goes straight on, z = e' + (d w + i r) e decays as exp((i r - d w) t), with r = w sqrt(1 - d^2); a change of
its velocity is taken from z. So steps of any length are exact, and no step is too long. web/swinging.js is a port.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.arenas import Arena
from arc_suite.models import visuals
from arc_suite.models.standing import time_unit
from arc_suite.models.visuals.springs import SPRINGS
from arc_suite.robots.spec import Body

_REARWARD = 0.01  # of a unit vector: a bone that points into the ground falls to the rear


class Swing(NamedTuple):
    """How a bone of ornaments swings; see `springs.Spring`.

    Attributes:
        tip: (3,) its tip in its own frame, m.
        mass: (3,) where its mass is, in the same frame, m.
        frequency: rad/s.
        damping: damping ratio.
        limit: rad.
        pivot_radius, tip_radius: radii of balls at both ends whose convex hull holds its shapes, m.
    """

    tip: np.ndarray
    mass: np.ndarray
    frequency: float
    damping: float
    limit: float
    pivot_radius: float
    tip_radius: float


class SwingingBone(NamedTuple):
    """A bone of ornaments on the torso.

    Attributes:
        name: its name.
        place: (3,) its pivot in the torso's frame, m.
        swing: how it swings.
    """

    name: str
    place: np.ndarray
    swing: Swing


class State(NamedTuple):
    """A mass on its way.

    Attributes:
        anchor: (3,) where the torso holds it, m.
        velocity: (3,) velocity of that place, m/s.
        ring: (3,) complex, z of the offset, m/s; see the module.
    """

    anchor: np.ndarray
    velocity: np.ndarray
    ring: np.ndarray


def list_bones(body: Body) -> tuple[SwingingBone, ...]:
    """Return the bones of a body's ornaments."""
    return tuple(_make_bone(body, bone) for bone in visuals.bones(body))


def _make_bone(body: Body, bone: visuals.Bone) -> SwingingBone:
    pivot = np.array(bone.pivot)
    tip = np.array(bone.tip) - pivot
    spring = SPRINGS[checks.name(bone.spring, SPRINGS, "spring")]
    swing = Swing(
        tip=tip,
        mass=0.5 * tip,
        frequency=spring.frequency / time_unit(body),
        damping=spring.damping,
        limit=math.radians(spring.limit),
        pivot_radius=bone.pivot_radius,
        tip_radius=bone.tip_radius,
    )
    return SwingingBone(bone.name, pivot, swing)


def rest_turns(body: Body, samples: int) -> np.ndarray:
    """Return the turns (samples, bones, 4) of bones at rest."""
    return np.tile(rotations.NO_TURN, (samples, len(list_bones(body)), 1))


def hold_mass(bone: SwingingBone, position: np.ndarray, orientation: np.ndarray) -> np.ndarray:
    """Return where the torso holds the mass of a bone, (..., 3) m, given its positions (..., 3) and matrices."""
    return position + orientation @ (bone.place + bone.swing.mass)


def rest(anchor: np.ndarray) -> State:
    """Return the state of a mass at rest at a place (3,), m."""
    return State(anchor, np.zeros(3), np.zeros(3, complex))


def advance(bone: SwingingBone, state: State, anchor: np.ndarray, seconds: float) -> State:
    """Return the state after a time, s, in which the place of the mass has gone straight to another one (3,), m."""
    velocity = (anchor - state.anchor) / seconds
    ring = (state.ring - (velocity - state.velocity)) * decay(bone, seconds)
    return State(anchor, velocity, ring)


def decay(bone: SwingingBone, seconds: float) -> complex:
    """Return what z is multiplied by in a time, s."""
    swing = bone.swing
    return complex(np.exp(complex(-swing.damping * swing.frequency, _rate(swing)) * seconds))


def turn_vectors(bone: SwingingBone, orientation: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Return the turns (..., 3) of a bone in the torso's frame, rad, without a limit.

    Args:
        bone: bone that swings.
        orientation: (..., 3, 3) of the torso in the world.
        ring: (..., 3) z of the offset; see the module.
    """
    swing = bone.swing
    offset = (orientation.swapaxes(-1, -2) @ (ring.imag / _rate(swing))[..., None])[..., 0]
    return np.cross(swing.mass, offset) / (swing.mass @ swing.mass)


def orient(
    bone: SwingingBone, position: np.ndarray, orientation: np.ndarray, turns: np.ndarray, ground: float = 0.0
) -> np.ndarray:
    """Return how a bone is turned in the torso's frame, (..., 4), within its limit and above the ground.

    Args:
        bone: bone that swings.
        position: (..., 3) of the torso, m.
        orientation: (..., 3, 3) of the torso.
        turns: (..., 3) see `turn_vectors`.
        ground: height of the ground below the bone, m.
    """
    swing = bone.swing
    length = np.linalg.norm(swing.tip)
    direction = swing.tip / length
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)
    axis = turns / np.maximum(angle, 1e-12)
    bounded_angle = swing.limit * np.tanh(angle / swing.limit)
    bone_direction = np.cos(bounded_angle) * direction + np.sin(bounded_angle) * np.cross(axis, direction)

    in_world = (orientation @ bone_direction[..., None])[..., 0]
    pivot_height = position[..., 2] + orientation[..., 2, :] @ bone.place - ground
    min_rise = ((swing.tip_radius - pivot_height) / length).clip(-1.0, 1.0)
    sideways = in_world[..., :2] - _REARWARD * orientation[..., :2, 0]
    sideways = sideways / np.maximum(np.linalg.norm(sideways, axis=-1, keepdims=True), 1e-12)
    lying = np.concatenate([sideways * np.sqrt(1.0 - min_rise**2)[..., None], min_rise[..., None]], axis=-1)
    in_world = np.where((in_world[..., 2] < min_rise)[..., None], lying, in_world)
    bone_direction = (orientation.swapaxes(-1, -2) @ in_world[..., None])[..., 0]
    return _turn_between(direction, bone_direction)


def _turn_between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the shortest turns (..., 4) from a unit vector (3,) to others (..., 3)."""
    cosine = (second @ first)[..., None]
    quaternion = np.concatenate([1.0 + cosine, np.cross(first, second)], axis=-1)
    return quaternion / np.maximum(np.linalg.norm(quaternion, axis=-1, keepdims=True), 1e-12)


def _rate(swing: Swing) -> float:
    """Return the frequency at which a bone swings freely, rad/s."""
    return swing.frequency * math.sqrt(1.0 - swing.damping**2)


class Swinging:
    """Bones of a body in a simulation, for pictures of it."""

    def __init__(self, bones: Sequence[SwingingBone]):
        """Begin with bones at rest."""
        self._bones = bones
        self._states: list[State] = []
        self._time = math.inf

    def follow(self, time: float, torso: np.ndarray, arena: Arena) -> list[np.ndarray]:
        """Return how bones are turned in the torso's frame, (4,) each.

        Args:
            time: s, of the simulation; an earlier one begins anew, and so does a jump of the torso at the same time.
            torso: (7,) position, m, and quaternion of the torso.
            arena: ground below it.
        """
        position = torso[:3]
        ground = float(arena.height(*position[:2]))
        orientation = rotations.matrix(torso[3:7])
        anchors = [hold_mass(bone, position, orientation) for bone in self._bones]
        has_jumped = time == self._time and not np.array_equal(anchors, [state.anchor for state in self._states])
        if time < self._time or has_jumped:
            self._states = [rest(anchor) for anchor in anchors]
        elif time > self._time:
            seconds = time - self._time
            self._states = [
                advance(bone, state, anchor, seconds)
                for bone, state, anchor in zip(self._bones, self._states, anchors, strict=True)
            ]
        self._time = time
        turns = []
        for bone, state in zip(self._bones, self._states, strict=True):
            vector = turn_vectors(bone, orientation, state.ring)
            turns.append(orient(bone, position, orientation, vector, ground))
        return turns
