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
        fell: (...) whether the torso lies on the ground or is tilted too far; False before the body has risen.
        has_risen: (...) whether the torso was up, or `patience` is over.
    """

    upright: np.ndarray
    fell: np.ndarray
    has_risen: np.ndarray


@dataclasses.dataclass(frozen=True)
class Upright:
    """A body is healthy while its torso is upright, high enough and not carried by the ground.

    Attributes:
        lowest: lowest height of the torso over the ground, h.
        lying: share of the weight; a torso that carries as much or more of it on the ground lies.
        least_upright: lowest cosine of the torso's tilt.
        up: height of the torso at which a body that starts lying has risen, h.
        patience: time within which it has to rise, sqrt(h / g).
    """

    lowest: float = 0.3
    lying: float = 0.5
    least_upright: float = 0.4
    up: float = 0.6
    patience: float = 12.0

    def start(self, lies: bool = False) -> Condition:
        """Return the memory at the start of a body that stands or lies."""
        return Condition(np.float64(1.0), np.False_, np.bool_(not lies))

    def after(self, context: Context, memory: Condition, readings: Readings, steps, height_share=1.0) -> Condition:
        """Return the memory after a control step.

        Args:
            context: context of the task.
            memory: before the step.
            readings: after it.
            steps: (...) since the start, this one included.
            height_share: share (...) of its height that the torso is asked to keep.
        """
        is_high = readings.torso_height >= self.lowest * context.height * height_share
        upward_force_on_torso = component(readings.contact_forces, 5)  # in the body's weight
        lies = upward_force_on_torso >= self.lying
        upright = rotations.upright(readings.torso_quaternion)
        is_healthy = is_high & ~lies & (upright >= self.least_upright)
        is_up = is_healthy & (readings.torso_height >= self.up * context.height)
        has_risen = memory.has_risen | is_up | (steps >= self.patience * context.tempo)
        return Condition(upright, has_risen & ~is_healthy, has_risen)

    def terms(self, memory: Condition) -> dict:
        """Return the bonus for health."""
        return {"healthy": (~memory.fell).astype(float)}

    def progress(self, memory: Condition) -> dict:
        """Return whether the body fell, 0 or 1."""
        return {"fell": memory.fell * 1.0}
