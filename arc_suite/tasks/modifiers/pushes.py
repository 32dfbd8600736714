"""Pushes: forces on the torso that last."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.arrows import draw_arrow
from arc_suite.tasks.modifiers.draws import INTERVAL_BOUND, MIN_INTERVAL, Episode
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Planar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene

MAX_PUSH_STEPS = 4  # control steps that a push lasts at most


class PushesState(NamedTuple):
    """A schedule of forces on the torso, which begins again once it has run out.

    Attributes:
        first: (..., SCHEDULE) the first control step of each push, counted from 1.
        last: (..., SCHEDULE) the last control step of each push.
        forces: (..., SCHEDULE, 2) world x and y, N.
    """

    first: np.ndarray
    last: np.ndarray
    forces: np.ndarray

    def force_in(self, step):
        """Return the force (..., 2), N, that acts in a control step (..., 1), counted from 1."""
        period = self.first[..., -1:] + MAX_PUSH_STEPS
        step_of_schedule = (step - 1) % period + 1
        acts = (self.first <= step_of_schedule) & (step_of_schedule <= self.last)
        return (acts[..., None] * self.forces).sum(axis=-2)


class _PushesFields(NamedTuple):
    force: float
    weight: float


class Pushes(_PushesFields, Modifier):
    """Pushes of the torso.

    Attributes:
        force: the greatest force on the torso, as a multiple of the body's weight. The force of each push is uniform
            from 0 up to it, in any horizontal direction. A push lasts 1 to 4 control steps, and the next one begins 40
            to 120 control steps after its begin.
        weight: weight of the body without a load, N.
    """

    __slots__ = ()

    defaults = {"force": 0.0}
    bounds = {"force": (0.0, 100.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(cls.check_number("force", settings), GRAVITY * measure_standing(body).mass)

    @property
    def is_active(self) -> bool:
        """Whether there are pushes."""
        return self.force > 0.0

    def draw(self, episode: Episode) -> PushesState:
        """Return the schedule of the episode."""
        keyed = episode.keyed
        intervals = MIN_INTERVAL + (keyed.push_intervals * (INTERVAL_BOUND - MIN_INTERVAL)).astype(int)
        first = np.cumsum(intervals)
        last = first + (keyed.push_durations * MAX_PUSH_STEPS).astype(int)
        angles = 2.0 * math.pi * keyed.push_directions
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        forces = self.force * self.weight * keyed.push_sizes[:, None] * directions
        return PushesState(first, last, forces)

    def drive(self, state: PushesState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with the force (..., 3) of this control step, N."""
        planar_force = state.force_in(elapsed + np.uint32(1))
        xp = planar_force.__array_namespace__()
        vertical_force = 0.0 * planar_force[..., :1]
        force = xp.concatenate([planar_force, vertical_force], axis=-1)
        return inputs._replace(force=force if inputs.force is None else inputs.force + force)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `force`: the force of a push in the latest step, in body weights."""
        return {"force": Block((Planar("force", "weight"),))}

    def privileged(self, state: PushesState, elapsed, heading) -> dict[str, Any]:
        """Return the force of the latest step, forward and left of the torso; 0 before the first step."""
        xp = state.forces.__array_namespace__()
        has_begun = elapsed > 0  # counts as 0 or 1
        force = state.force_in(elapsed) * has_begun / xp.asarray(self.weight)[..., None]
        return {"force": rotations.to_heading_frame(force, heading)}

    def markers(self, scene: Scene, state: PushesState, readings: Readings, elapsed: int) -> Iterator[Marker]:
        """Yield an arrow for a push in the latest step."""
        if elapsed > 0:
            yield from draw_arrow(scene.body, readings, state.force_in(elapsed) / self.weight)
