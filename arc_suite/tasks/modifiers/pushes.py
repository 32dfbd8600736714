"""Pushes: forces on the torso that last."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY, standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.arrows import draw_arrow
from arc_suite.tasks.modifiers.draws import LONGEST, SHORTEST, Episode
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Planar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene

MOST_STEPS = 4  # control steps of a push


class PushesState(NamedTuple):
    """A schedule of forces on the torso, which begins again once it has run out.

    Attributes:
        first: (..., SCHEDULE) control steps, counted from 1, in which they begin.
        last: (..., SCHEDULE) control steps in which they act last.
        forces: (..., SCHEDULE, 2) in the world, N.
    """

    first: np.ndarray
    last: np.ndarray
    forces: np.ndarray

    def acting(self, step):
        """Return the force (..., 2) that acts in a control step (..., 1), counted from 1."""
        now = (step - 1) % (self.first[..., -1:] + MOST_STEPS) + 1
        return (((self.first <= now) & (now <= self.last))[..., None] * self.forces).sum(axis=-2)


class _PushesFields(NamedTuple):
    force: float
    weight: float


class Pushes(_PushesFields, Modifier):
    """Pushes of the torso.

    Attributes:
        force: the greatest force on the torso, of the body's weight: each of a schedule is uniform from 0 up to it, in
            any horizontal direction, lasts 1 to 4 control steps, and begins 40 to 120 after the one before.
        weight: of the body without a load, N.
    """

    __slots__ = ()

    defaults = {"force": 0.0}
    bounds = {"force": (0.0, 100.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(cls.check_number("force", settings), GRAVITY * standing(body).mass)

    @property
    def is_active(self) -> bool:
        """Whether there are pushes."""
        return self.force > 0.0

    def draw(self, episode: Episode) -> PushesState:
        """Return the schedule of the episode."""
        keyed = episode.keyed
        first = np.cumsum(SHORTEST + (keyed.pauses * (LONGEST - SHORTEST)).astype(int))
        angles = 2.0 * math.pi * keyed.directions
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        forces = self.force * self.weight * keyed.sizes[:, None] * directions
        return PushesState(first, first + (keyed.lengths * MOST_STEPS).astype(int), forces)

    def drive(self, state: PushesState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with the force (..., 3) that acts, N."""
        push = state.acting(elapsed + np.uint32(1))
        force = push.__array_namespace__().concatenate([push, 0.0 * push[..., :1]], axis=-1)
        return inputs._replace(force=force if inputs.force is None else inputs.force + force)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `force`: on the torso in the latest step, of the body's weight."""
        return {"force": Block((Planar("force", "weight"),))}

    def privileged(self, state: PushesState, elapsed, heading) -> dict[str, Any]:
        """Return the force as the torso heads."""
        xp = state.forces.__array_namespace__()
        force = state.acting(elapsed) * (elapsed > 0) / xp.asarray(self.weight)[..., None]
        return {"force": rotations.to_heading_frame(force, heading)}

    def markers(self, scene: Scene, state: PushesState, readings: Readings, elapsed: int) -> Iterator[Marker]:
        """Yield an arrow for a force that acts."""
        if elapsed:
            yield from draw_arrow(scene.body, readings, state.acting(elapsed) / self.weight)
