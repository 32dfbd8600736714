"""Health: when a body has fallen."""

import dataclasses
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.tasks.context import Context
from arc_suite.tasks.readings import Readings, component


class Condition(NamedTuple):
    """Memory of a body's health.

    Attributes:
        upright: (...) cosine of the torso's tilt.
        fell: (...) whether the torso lies on the ground or is tilted too far.
    """

    upright: np.ndarray
    fell: np.ndarray


@dataclasses.dataclass(frozen=True)
class Upright:
    """A body is healthy while its torso is upright, high enough and not carried by the ground.

    Attributes:
        lowest: height of the torso over the ground, h.
        lying: share of the weight; a torso that the ground carries with more lies on it.
        least_upright: cosine of the torso's tilt.
    """

    lowest: float = 0.3
    lying: float = 0.5
    least_upright: float = 0.4

    def start(self) -> Condition:
        """Return the memory at the start."""
        return Condition(np.float64(1.0), np.False_)

    def after(self, context: Context, readings: Readings, crouch=1.0) -> Condition:
        """Return the memory after a control step, in which the torso was asked to keep a share (...) of its height."""
        high = readings.torso_height >= self.lowest * context.height * crouch
        lies = component(readings.contact_forces, 5) >= self.lying  # upwards on the torso
        upright = rotations.upright(readings.torso_quaternion)
        return Condition(upright, ~(high & ~lies & (upright >= self.least_upright)))

    def terms(self, memory: Condition) -> dict:
        """Return the bonus for health."""
        return {"healthy": (~memory.fell).astype(float)}

    def progress(self, memory: Condition) -> dict:
        """Return whether the body fell, 0 or 1."""
        return {"fell": memory.fell * 1.0}
