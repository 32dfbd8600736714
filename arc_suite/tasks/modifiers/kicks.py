"""Kicks: sudden changes of the torso's velocity."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.arrows import draw_arrow
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Planar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene

SHOWN = 10  # control steps for which pictures show a kick


class KicksState(NamedTuple):
    """A schedule of kicks, which begins again once it has run out.

    Attributes:
        steps: (..., SCHEDULE) control steps, counted from 1, before which kicks come.
        kicks: (..., SCHEDULE, 2) changes of the torso's velocity in the world, m/s.
    """

    steps: np.ndarray
    kicks: np.ndarray

    def due(self, elapsed):
        """Return the change of velocity (..., 2) by a kick in the step after others (..., 1)."""
        is_due = elapsed % self.steps[..., -1:] + 1 == self.steps
        return (is_due[..., None] * self.kicks).sum(axis=-2)


class _KicksFields(NamedTuple):
    kicks: float
    height: np.ndarray
    velocities: int


class Kicks(_KicksFields, Modifier):
    """Kicks of the torso.

    Attributes:
        kicks: the greatest change of the torso's velocity by a kick, sqrt(g h): each of a schedule is
            uniform from 0 up to it, in any horizontal direction, 40 to 120 control steps apart.
        height: (1,) the standing height, m.
        velocities: how many the simulation has.
    """

    __slots__ = ()

    defaults = {"kicks": 0.0}
    bounds = {"kicks": (0.0, 100.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        joints = len(body.joint_names) + len(body.held)
        return cls(cls.check_number("kicks", settings), np.array([body.torso.standing_height]), 6 + joints)

    @property
    def is_active(self) -> bool:
        """Whether there are kicks."""
        return self.kicks > 0.0

    def draw(self, episode: Episode) -> KicksState:
        """Return the schedule of the episode."""
        stream = episode.stream
        directions = np.stack([np.cos(stream.kick_directions), np.sin(stream.kick_directions)], axis=-1)
        unit = self.kicks * math.sqrt(GRAVITY * episode.scene.body.torso.standing_height)
        return KicksState(stream.kick_steps, unit * stream.kick_sizes[:, None] * directions)

    def drive(self, state: KicksState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with the kick (..., nv) that is due."""
        push = state.due(elapsed)
        xp = push.__array_namespace__()
        kick = xp.concatenate([push, xp.zeros((*push.shape[:-1], self.velocities - 2))], axis=-1)
        return inputs._replace(kick=kick if inputs.kick is None else inputs.kick + kick)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `kick`: change of the torso's velocity in the latest step."""
        return {"kick": Block((Planar("kick", "sqrt(g h)"),))}

    def privileged(self, state: KicksState, elapsed, heading) -> dict[str, Any]:
        """Return the kick as the torso heads."""
        has_begun = elapsed > 0
        kick = state.due(elapsed - has_begun) * has_begun / (GRAVITY * self.height) ** 0.5
        return {"kick": rotations.to_heading_frame(kick, heading)}

    def markers(self, scene: Scene, state: KicksState, readings: Readings, elapsed: int) -> Iterator[Marker]:
        """Yield an arrow for some steps after a kick."""
        since = elapsed - state.steps
        is_shown = (since >= 0) & (since % state.steps[-1] < SHOWN)
        for kick in state.kicks[is_shown] / math.sqrt(GRAVITY * scene.body.torso.standing_height):
            yield from draw_arrow(scene.body, readings, kick)
