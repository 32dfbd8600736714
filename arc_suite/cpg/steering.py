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
        lift: height of a foot in mid-swing, in standing heights.
        gain: gain of the feedback on the motion's error: forward, left and turning.
        integral: gain of the same error, added up over a cycle of the gait.
        attitude: how far the low side of the torso is pushed up, rad of lift per rad of tilt.
        share: share of a joint's range that the neutral pose leaves to either side.
        level: weight of a foot's vertical motion in stance against its motion along its path.
        sweep: most that a joint is swept to either side, rad.
        unload: unload of the standing height, by which a leg is held up that cannot sweep as requested.
        lead: lead of all legs over the gait's clock, cycles.
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


_SLIP_WEIGHT = 0.1  # of a foot's slip across its path against its motion along it
_DAMPING_SHARE = 0.1  # of the leg's largest Jacobian entry, for a joint with room for _DAMPING_ROOM
_DAMPING_ROOM = 0.5  # rad
_USABLE_RANGE = 0.95  # share of the way from the neutral pose to a joint's bound
_MIN_SWEEP_ROOM = 1e-3  # rad
_LEVELING_ITERATIONS = 50  # of the search for the neutral pose
_LEVELING_STEP = 0.5  # share of a sole's error in height that an iteration takes away
_MIN_LENGTH = 1e-9  # m, of a path that has a direction


class _Leg(NamedTuple):
    """A leg in the neutral pose.

    Attributes:
        jacobian: (3, n) jacobian of the sole, m/rad.
        room: (n,) room to either side for sweeping, rad.
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
        feet: (legs, 2) positions of the soles, from the center of mass, m.
        extent: extent of the feet from the center of mass, m.
    """

    def __init__(self, task: Task, parameters: SteeringParameters):
        """Fit the law to a task; see `CommandLaw`."""
        body = size_body(task.scene.body)
        self.neutral = _find_neutral_pose(body, parameters.share)
        super().__init__(task, parameters, tuple(self.neutral))
        self.legs = self._make_legs()
        self.feet = (self.mechanics.soles - self.mechanics.center)[:, :2]
        foot_radii = [leg.foot.radius for leg in body.legs]
        self.extent = float(max(np.hypot(*self.feet.T) + foot_radii))

    def initial_paths(self, count: int) -> tuple:
        """Return nothing: the law remembers no more than `CommandLawState` does."""
        return ()

    def follow_request(self, state: tuple, request: Request, observation: Mapping) -> tuple:
        """Return the state, target angles (environments, joints), rad, and their change in a step; see `CommandLaw`."""
        xp = request.motion.__array_namespace__()
        parameters = self.parameters
        velocity = request.motion * self.units
        half_paths = 0.5 * self.stance_duration * point_velocities(velocity, self.feet)
        # The low side of the torso is pushed up: its feet go down.
        vertical = rotations.matrix(observation["posture"][:, 1:5])[:, 2]  # the world's, in the torso's frame
        depths = -tilt_heights(vertical, self.feet) / self.mechanics.height  # standing heights, by which feet are low
        unload_share = parameters.unload / parameters.lift
        next_phase = request.phase + request.advance
        targets = []
        next_targets = []
        for index, leg in enumerate(self.legs):
            sweep, able_share = _solve_sweep(leg, half_paths[:, index], parameters.level)
            depth = depths[:, index : index + 1]
            lift_share = (1.0 - able_share) * unload_share - parameters.attitude * depth
            raised = lift_share * leg.lift
            leg_phase = (request.phase + self.phase_offsets[index]) % 1.0
            next_leg_phase = (next_phase + self.phase_offsets[index]) % 1.0
            targets.append(raised + cycle_angles(leg_phase[:, None], self.duty_factor, sweep, leg.lift))
            next_targets.append(raised + cycle_angles(next_leg_phase[:, None], self.duty_factor, sweep, leg.lift))
        departure = request.size * xp.concatenate(targets, axis=-1)  # from the neutral pose
        next_departure = request.size * xp.concatenate(next_targets, axis=-1)
        return state, self.neutral + departure, next_departure - departure

    def _make_legs(self) -> list[_Leg]:
        low, high = _joint_bounds(self.body) - self.neutral
        lift_height = self.parameters.lift * self.mechanics.height  # m
        legs = []
        first = 0
        for leg, jacobian in zip(self.body.legs, self.mechanics.jacobians, strict=True):
            joints = slice(first, first + len(leg.joints))
            first = joints.stop
            room_below = -_USABLE_RANGE * low[joints]
            room_above = _USABLE_RANGE * high[joints]
            room = np.minimum(np.minimum(room_below, room_above), self.parameters.sweep).clip(_MIN_SWEEP_ROOM)
            lift = lift_angles(jacobian, lift_height, room_below, room_above)
            legs.append(_Leg(jacobian, room, lift))
        return legs


def _solve_sweep(leg: _Leg, path, level: float) -> tuple:
    """Return joint angles that move a foot along a path, and the share of the path that they manage.

    Args:
        leg: in the neutral pose.
        path: (environments, 2) path of the foot, forward and left, m.
        level: weight of the vertical motion.

    Returns:
        Angles (environments, n), rad, and shares (environments, 1) from 0 to 1.
    """
    xp = path.__array_namespace__()
    length = xp.hypot(path[:, 0], path[:, 1])[:, None]
    direction = path / xp.maximum(length, _MIN_LENGTH)
    # Motion of the foot along the path, across it and up, with their weights, per joint angle: (environments, 3, n).
    weighted_jacobian = path_weights(path, _SLIP_WEIGHT, level) @ leg.jacobian
    transposed = weighted_jacobian.swapaxes(-1, -2)
    pull = transposed[..., :1] * length[..., None]
    angles = damped_changes(weighted_jacobian, pull, np.diag(_squared_damping(leg)))[..., 0]
    # Damping shortens the motion. It is scaled by least squares to the length of the path, then to the joints' room.
    motion = (weighted_jacobian @ angles[..., None])[..., 0]
    squared_motion = xp.maximum((motion**2).sum(axis=-1, keepdims=True), 1e-12)
    angles = angles * (motion[:, :1] * length / squared_motion)
    room_shares = leg.room / xp.maximum(abs(angles), 1e-12)
    angles = angles * xp.minimum(1.0, room_shares.min(axis=-1, keepdims=True))
    # A product for each environment by itself: one of all would round differently with their number.
    ground_motion = (leg.jacobian[:2] @ angles[..., None])[..., 0]
    length_managed = (direction * ground_motion).sum(axis=-1, keepdims=True)
    share = xp.where(length > _MIN_LENGTH, length_managed / xp.maximum(length, _MIN_LENGTH), 1.0)
    return angles, share.clip(0.0, 1.0)


def _squared_damping(leg: _Leg) -> np.ndarray:
    """Return the squared damping (n,) of the least squares, m^2; joints with little room have more."""
    return (_DAMPING_SHARE * abs(leg.jacobian).max() * _DAMPING_ROOM / leg.room) ** 2


def _joint_bounds(body: Body) -> np.ndarray:
    """Return the lowest and the highest angles of the joints, (2, joints), rad."""
    return np.radians([joint.range_deg for joint in body.joints]).T


@functools.lru_cache(maxsize=64)
def _find_neutral_pose(body: Body, share: float) -> np.ndarray:
    """Return angles (joints,), rad, at which feet are level and joints have a share of their range to either side."""
    lowest, highest = _joint_bounds(body)
    low = lowest + share * (highest - lowest)
    high = highest - share * (highest - lowest)
    angles = np.zeros_like(low).clip(low, high)
    for _ in range(_LEVELING_ITERATIONS):
        mechanics = pose_mechanics(body, angles)
        level = np.median(mechanics.soles[:, 2])
        min_square = 1e-6 * mechanics.height**2
        first = 0
        for leg, jacobian, sole in zip(body.legs, mechanics.jacobians, mechanics.soles, strict=True):
            joints = slice(first, first + len(leg.joints))
            first = joints.stop
            rise = jacobian[2]  # of the sole by each joint, m/rad
            angles[joints] += _LEVELING_STEP * (level - sole[2]) * rise / max(rise @ rise, min_square)
        angles = angles.clip(low, high)
    return angles
