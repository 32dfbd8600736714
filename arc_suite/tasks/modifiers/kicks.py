"""Kicks: sudden changes of the torso's velocity."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.standing import GRAVITY, speed_unit
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.arrows import draw_arrow
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Planar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs, Scene

ARROW_STEPS = 10  # control steps for which pictures show the arrow of a kick


class KicksState(NamedTuple):
    """A schedule of kicks, which begins again once it has run out.

    Attributes:
        steps: (..., SCHEDULE) control steps, counted from 1, before which kicks come.
        kicks: (..., SCHEDULE, 2) changes of the torso's velocity in the world, m/s.
    """

    steps: np.ndarray
    kicks: np.ndarray

    def kick_after(self, elapsed):
        """Return the kick (..., 2), m/s, that comes after (..., 1) control steps; 0 where no kick comes."""
        period = self.steps[..., -1:]
        step = elapsed % period + 1
        comes = step == self.steps
        return (comes[..., None] * self.kicks).sum(axis=-2)


class _KicksFields(NamedTuple):
    kicks: float
    height: np.ndarray
    velocities: int


class Kicks(_KicksFields, Modifier):
    """Kicks of the torso.

    Attributes:
        kicks: the greatest change of the torso's velocity by a kick, sqrt(g h). The size of each kick is uniform from 0
            up to it, in any horizontal direction. Kicks are 40 to 120 control steps apart.
        height: (1,) the standing height, m.
        velocities: the number of velocities of torso and joints, held ones included, at the beginning of qvel.
    """

    __slots__ = ()

    defaults = {"kicks": 0.0}
    bounds = {"kicks": (0.0, 100.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        joints = len(body.joint_names) + len(body.held)  # `held` joints move in the simulation, but have no motors
        velocities = 6 + joints  # 6 of the torso
        return cls(cls.check_number("kicks", settings), np.array([body.torso.standing_height]), velocities)

    @property
    def is_active(self) -> bool:
        """Whether there are kicks."""
        return self.kicks > 0.0

    def draw(self, episode: Episode) -> KicksState:
        """Return the schedule of the episode."""
        stream = episode.stream
        directions = np.stack([np.cos(stream.kick_directions), np.sin(stream.kick_directions)], axis=-1)
        greatest = self.kicks * speed_unit(episode.scene.body.torso.standing_height)  # m/s
        return KicksState(stream.kick_steps, greatest * stream.kick_sizes[:, None] * directions)

    def drive(self, state: KicksState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with the kick (..., velocities) of this control step."""
        planar_kick = state.kick_after(elapsed)
        xp = planar_kick.__array_namespace__()
        zeros = xp.zeros((*planar_kick.shape[:-1], self.velocities - 2))
        kick = xp.concatenate([planar_kick, zeros], axis=-1)
        return inputs._replace(kick=kick if inputs.kick is None else inputs.kick + kick)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `kick`: the change of the torso's velocity by a kick in the latest step."""
        return {"kick": Block((Planar("kick", "sqrt(g h)"),))}

    def privileged(self, state: KicksState, elapsed, heading) -> dict[str, Any]:
        """Return the kick of the latest step, forward and left of the torso, in sqrt(g h); 0 before the first step."""
        has_begun = elapsed > 0  # counts as 0 or 1
        steps_before_latest = elapsed - has_begun
        velocity_unit = (GRAVITY * self.height) ** 0.5  # m/s
        kick = state.kick_after(steps_before_latest) * has_begun / velocity_unit
        return {"kick": rotations.to_heading_frame(kick, heading)}

    def markers(self, scene: Scene, state: KicksState, readings: Readings, elapsed: int) -> Iterator[Marker]:
        """Yield an arrow for some control steps after a kick."""
        period = state.steps[-1]
        steps_since_kick = elapsed - state.steps
        is_shown = (steps_since_kick >= 0) & (steps_since_kick % period < ARROW_STEPS)
        for kick in state.kicks[is_shown] / speed_unit(scene.body.torso.standing_height):
            yield from draw_arrow(scene.body, readings, kick)
