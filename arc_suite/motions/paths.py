"""Paths of a torso and of feet in standing heights, and which feet of two bodies belong together."""

import math
from typing import NamedTuple

import numpy as np


class Size(NamedTuple):
    """Size of paths, relative to those of another body: of all of them, and to the sides in addition."""

    all: float = 1.0
    side: float = 1.0

    @property
    def ahead_left_up(self) -> np.ndarray:
        """Factors (3,) on displacements ahead, to the left and up."""
        return self.all * np.array((1.0, self.side, 1.0))


class Paths(NamedTuple):
    """What a body is to do, without its joints; lengths in standing heights, in the world.

    Attributes:
        seconds: duration, s.
        positions: (frames, 3) positions of the torso.
        quaternions: (frames, 4) quaternions of the torso, w first.
        soles: (frames, legs, 3) positions of soles.
        planted: (frames, legs) whether feet stand.
    """

    seconds: float
    positions: np.ndarray
    quaternions: np.ndarray
    soles: np.ndarray
    planted: np.ndarray

    def select(self, frames: np.ndarray) -> "Paths":
        """Return the paths at frames (n,) alone."""
        return self._replace(
            positions=self.positions[frames],
            quaternions=self.quaternions[frames],
            soles=self.soles[frames],
            planted=self.planted[frames],
        )


def scale_heights(heights: np.ndarray, rest_height: float, other_rest_height: float) -> np.ndarray:
    """Return the heights of a torso for another body, all in standing heights.

    Below its height at rest a torso sinks by the same share. Above it, it rises as far as feet do.
    """
    ratio = other_rest_height / rest_height
    return np.where(heights < rest_height, ratio * heights, other_rest_height + heights - rest_height)


def shrink_turns(quaternions: np.ndarray, size: float) -> np.ndarray:
    """Return orientations (frames, 4) that turn from the level one by a share of what others do."""
    level = np.array((1.0, 0.0, 0.0, 0.0))
    near = np.where(quaternions[:, :1] < 0.0, -quaternions, quaternions)
    smaller = (1.0 - size) * level + size * near
    return smaller / np.linalg.norm(smaller, axis=-1, keepdims=True)


def match_feet(rest_soles: np.ndarray, other_rest_soles: np.ndarray) -> list[int | None]:
    """Return for each foot of another body the foot that stands in the same place, None without one.

    Places are relative to the extent of each body, so that front feet match front feet. Nearest pairs come first.

    Args:
        rest_soles: (legs, 3) of the body that has the motion.
        other_rest_soles: (other legs, 3) of the body that is to move.
    """
    places = _relative_places(rest_soles)
    other_places = _relative_places(other_rest_soles)
    distances = np.linalg.norm(other_places[:, None] - places[None], axis=-1)
    partners: list[int | None] = [None] * len(other_places)
    for _ in range(min(distances.shape)):
        other_foot, foot = np.unravel_index(distances.argmin(), distances.shape)
        partners[other_foot] = int(foot)
        distances[other_foot] = np.inf
        distances[:, foot] = np.inf
    return partners


def _relative_places(soles: np.ndarray) -> np.ndarray:
    """Return places (legs, 2) of soles from -1 to 1 along and across the body."""
    ground = soles[:, :2]
    middle = 0.5 * (ground.max(axis=0) + ground.min(axis=0))
    half_extent = 0.5 * np.ptp(ground, axis=0)
    return (ground - middle) / np.maximum(half_extent, 1e-9)  # feet in a line have no extent across it


def time_scale(standing_height: float, other_height: float) -> float:
    """Return by how much longer a motion of another standing height takes: as a pendulum of that length swings."""
    return math.sqrt(other_height / standing_height)
