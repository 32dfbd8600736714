"""The demonstrators `steered`, `surefooted` and `reactive`: one law for any body that follows a command of velocities.

Each foot on the ground is to move, relative to the torso, against the velocity that is requested
where it stands; in swing it returns and is lifted. Both are directions in a leg's joint space,
found by damped least squares at a neutral pose that leaves every joint room to both sides. The
request is the command, corrected by feedback.
"""

import functools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.command_law import CommandLaw, Request
from arc_suite.models.kinematics import damped_changes, path_weights, point_velocities, tilt_heights
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import pose_mechanics
from arc_suite.models.stride import cycle_angles, lift_angles
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task


class SteeringParameters(NamedTuple):
    """How a steering demonstrator walks.

    Attributes:
        lift: of a foot in mid-swing, in standing heights.
        gain: of the motion's error, forward, left and turning.
        integral: of the same, a cycle of the gait.
        attitude: how far the low side of the torso is pushed up, rad of lift per rad of tilt.
        share: of a joint's range that the neutral pose leaves to either side.
        level: weight of a foot's vertical motion in stance against its motion along its path.
        sweep: most that a joint is swept to either side, rad.
        unload: of the standing height, by which a leg is held up that cannot sweep as requested.
        lead: of all legs over the gait's clock, cycles.
    """

    lift: float = 0.2
    gain: tuple[float, float, float] = (1.0, 1.0, 0.5)
    integral: float = 0.3
    attitude: float = 0.0
    share: float = 0.25
    level: float = 4.0
    sweep: float = 0.5
    unload: float = 0.1
    lead: float = 0.0


_ACROSS = 0.1  # weight of a foot's slip across its path against its motion along it
_DAMPING = 0.1  # of the leg's largest Jacobian entry, for a joint with room for _ROOM
_ROOM = 0.5  # rad


class _Leg(NamedTuple):
    """A leg in the neutral pose.

    Attributes:
        jacobian: (3, n) of the sole.
        room: (n,) to either side for sweeping, rad.
        lift: (n,) angles in mid-swing, rad.
    """

    jacobian: np.ndarray
    room: np.ndarray
    lift: np.ndarray


class Steered(CommandLaw):
    """Follows a command on level ground, without sight.

    Attributes:
        neutral: (joints,) pose, rad.
        legs: in that pose.
        feet: (legs, 2) places of the soles, from the center of mass, m.
        extent: of the feet from the center of mass, m.
    """

    def __init__(self, task: Task, parameters: SteeringParameters):
        """Fit the law to a task; see `CommandLaw`."""
        body = size_body(task.scene.body)
        self.neutral = _neutral(body, parameters.share)
        super().__init__(task, parameters, tuple(self.neutral))
        self.legs = list(self._legs())
        self.feet = (self.mechanics.soles - self.mechanics.center)[:, :2]
        self.extent = float(max(np.hypot(*self.feet.T) + [leg.foot.radius for leg in body.legs]))

    def initial_paths(self, count: int) -> tuple:
        """Return nothing: the law remembers no more than `CommandLawState` does."""
        return ()

    def planned(self, none: tuple, request: Request, observation: Mapping) -> tuple:
        """Return the target angles (environments, joints), rad, and their change in a step; see `CommandLaw`."""
        numpy, quaternion = request.motion.__array_namespace__(), observation["posture"][:, 1:5]
        paths = 0.5 * self.stance_duration * point_velocities(request.motion * self.units, self.feet)
        # The low side of the torso is pushed up: its feet go down.
        lows = -tilt_heights(rotations.matrix(quaternion)[:, 2], self.feet) / self.mechanics.height
        unload = self.parameters.unload / self.parameters.lift
        now, later = [], []
        for index, leg in enumerate(self.legs):
            sweep, able = _sweep(leg, paths[:, index], self.parameters.level)
            low = lows[:, index : index + 1]
            raised = ((1.0 - able) * unload - self.parameters.attitude * low) * leg.lift
            for targets, phase in ((now, request.phase), (later, request.phase + request.advance)):
                cycle = (phase + self.phase_offsets[index]) % 1.0
                targets.append(raised + cycle_angles(cycle[:, None], self.duty_factor, sweep, leg.lift))
        now, later = (request.size * numpy.concatenate(targets, axis=-1) for targets in (now, later))
        return none, self.neutral + now, later - now

    def _legs(self):
        low, high = _ranges(self.body) - self.neutral
        first = 0
        for leg, jacobian in zip(self.body.legs, self.mechanics.jacobians, strict=True):
            joints = slice(first, first + len(leg.joints))
            first = joints.stop
            below, above = -0.95 * low[joints], 0.95 * high[joints]
            room = np.minimum(np.minimum(below, above), self.parameters.sweep).clip(1e-3)
            yield _Leg(
                jacobian, room, lift_angles(jacobian, self.parameters.lift * self.mechanics.height, below, above)
            )


def _sweep(leg: _Leg, path, level: float):
    """Joint angles (environments, n) that move a foot along a path (environments, 2), and the share (environments, 1)
    of it that they manage."""
    numpy = path.__array_namespace__()
    length = numpy.hypot(path[:, 0], path[:, 1])[:, None]
    along = path / numpy.maximum(length, 1e-9)
    weighted = path_weights(path, _ACROSS, level) @ leg.jacobian
    damping = np.diag(_damping(leg))
    turned = weighted.swapaxes(-1, -2)
    angles = damped_changes(weighted, turned[..., :1] * length[..., None], damping)[..., 0]
    moved = (weighted @ angles[..., None])[..., 0]
    angles = angles * (moved[:, :1] * length / numpy.maximum((moved**2).sum(axis=-1, keepdims=True), 1e-12))
    angles = angles * numpy.minimum(1.0, (leg.room / numpy.maximum(abs(angles), 1e-12)).min(axis=-1, keepdims=True))
    # A product for each environment by itself: one of all would round differently with their number.
    reached = (along * (leg.jacobian[:2] @ angles[..., None])[..., 0]).sum(axis=-1, keepdims=True)
    return angles, numpy.where(length > 1e-9, reached / numpy.maximum(length, 1e-9), 1.0).clip(0.0, 1.0)


def _damping(leg: _Leg) -> np.ndarray:
    """Squared damping (n,) of the least squares, m^2."""
    return (_DAMPING * abs(leg.jacobian).max() * _ROOM / leg.room) ** 2


def _ranges(body: Body) -> np.ndarray:
    """Bounds (2, joints) of the joints, rad."""
    return np.radians([joint.range_deg for joint in body.joints]).T


@functools.lru_cache(maxsize=64)
def _neutral(body: Body, share: float) -> np.ndarray:
    """A pose (joints,) whose feet are level and whose joints have a share of their range to either side, rad."""
    low, high = _ranges(body)
    low, high = low + share * (high - low), high - share * (high - low)
    angles = np.zeros_like(low).clip(low, high)
    for _ in range(50):
        pose, first = pose_mechanics(body, angles), 0
        aim = np.median(pose.soles[:, 2])
        for leg, jacobian, sole in zip(body.legs, pose.jacobians, pose.soles, strict=True):
            last, rise = first + len(leg.joints), jacobian[2]
            angles[first:last] += 0.5 * (aim - sole[2]) * rise / max(rise @ rise, 1e-6 * pose.height**2)
            first = last
        angles = angles.clip(low, high)
    return angles
