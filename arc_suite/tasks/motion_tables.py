"""Tables of motions by control step: what a task that follows motions compares a body with.

A motion becomes a cycle of whole control steps: its duration changes by up to half a step. A loop goes on where it
ends; any other motion returns to its first pose, and so becomes a loop. Places in a cycle are relative to its start.
Soles of a motion stand on the ground. In the physics they rest above it, by the margins of contacts, and tables are
higher than the motion by as much.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite import motions, rotations
from arc_suite.models import sizing
from arc_suite.models.kinematics import Legs
from arc_suite.motions import Motion
from arc_suite.motions.motion import MAX_PLANTED_HEIGHT, find_soles
from arc_suite.robots import mirror
from arc_suite.robots.spec import Body

POSES_AHEAD = 2  # rows after the end of a cycle, which continue it: a policy sees so many poses ahead

_RETURN_SECONDS = 0.5  # in which a motion that does not loop returns to its first pose

# Least spreads: motions in which a joint or a foot rests are not followed more exactly than this.
_MIN_ANGLE_SPREAD = 0.05  # rad
_MIN_RATE_SPREAD = 0.15  # sqrt(g / h), given as a share of the rate unit
_MIN_FOOT_SPREAD = 0.03  # standing heights


class MotionTables(NamedTuple):
    """Tables of motions, one after the other; the tables of their mirror images follow.

    Attributes:
        starts: (motions,) first row of each motion.
        counts: (motions,) rows in a cycle of each motion.
        mirror_offset: rows from a motion to its mirror image; 0 for a body without one.
        places: (rows, 3) of the torso: x and y, m, and yaw, rad, from the start of the cycle.
        heights: (rows,) of the torso, as high as a body in contact carries it, m.
        quaternions: (rows, 4) of the torso, w first, in the frame of the start of the cycle.
        angles: (rows, joints) from the standing pose, rad.
        velocities: (rows, 6 + joints) as in `Readings`, in the frame of the start of the cycle.
        feet: (rows, legs, 3) centers of feet: forward and left of the torso, and over the ground, m.
        planted: (rows, legs) whether a foot stands on the ground.
        circle: (rows, 2) sine and cosine of the share of the cycle.
        angle_spreads: (motions, joints) standard deviations of angles, rad; those of the mirror images follow.
        rate_spreads: the same of joint velocities, rad/s.
        foot_spreads: (motions, legs) the same of the places of feet, m.
    """

    starts: np.ndarray
    counts: np.ndarray
    mirror_offset: int
    places: np.ndarray
    heights: np.ndarray
    quaternions: np.ndarray
    angles: np.ndarray
    velocities: np.ndarray
    feet: np.ndarray
    planted: np.ndarray
    circle: np.ndarray
    angle_spreads: np.ndarray
    rate_spreads: np.ndarray
    foot_spreads: np.ndarray

    @classmethod
    def of(cls, body: Body, body_motions: Sequence[Motion], control_timestep: float, rate_unit: float) -> Self:
        """Return the tables of motions of a body.

        Args:
            body: the body.
            body_motions: motions of this body, at least one.
            control_timestep: s between rows.
            rate_unit: sqrt(g / h), rad/s.
        """
        loops = [motion if motion.loops else _return_to_start(motion) for motion in body_motions]
        counts = np.array([max(1, round(loop.seconds / control_timestep)) for loop in loops])
        lengths = counts + POSES_AHEAD
        mirror_offset = 0
        images = []
        if mirror.has_image(body):
            mirror_offset = int(lengths.sum())
            images = [motions.mirror(loop, body) for loop in loops]
        tables = []
        for loop, count in zip([*loops, *images], np.resize(counts, len(loops) + len(images)), strict=True):
            tables.append(_tabulate(body, loop, int(count), rate_unit))
        columns = {name: np.concatenate([getattr(table, name) for table in tables]) for name in _COLUMNS}
        return cls(lengths.cumsum() - lengths, counts, mirror_offset, **columns)

    def entries(self, table: np.ndarray, index):
        """Return the entries (..., n) of a table at indices (...), integers of Python, NumPy or JAX."""
        if not isinstance(index, int):
            table = index.__array_namespace__().asarray(table)
        return table[index]


_COLUMNS = MotionTables._fields[3:]  # tables with rows, and spreads, which follow those of the motion before


def _return_to_start(motion: Motion) -> Motion:
    """Return a motion that ends with its first pose at its last place, and so is a loop."""
    frames = max(1, round(_RETURN_SECONDS * motion.frame_rate))
    progress = np.linspace(0.0, 1.0, frames + 1)[1:, None]
    share = progress**2 * (3.0 - 2.0 * progress)

    def blend(last, first):
        return last + share * (first - last)

    longer = motions.repeat(motion, 0, motion.frames + frames)
    headings = rotations.yaw(motion.quaternions[[0, -1]])
    first_tilt, last_tilt = rotations.turn_about_z(motion.quaternions[[0, -1]], -headings)
    if first_tilt @ last_tilt < 0.0:
        first_tilt = -first_tilt
    tilts = blend(last_tilt, first_tilt)
    tilts = tilts / np.linalg.norm(tilts, axis=-1, keepdims=True)
    quaternions = longer.quaternions.copy()
    quaternions[-frames:] = rotations.turn_about_z(tilts, headings[1])
    positions = longer.positions.copy()
    positions[-frames:, 2:] = blend(motion.positions[-1, 2:], motion.positions[0, 2:])
    angles = longer.angles.copy()
    angles[-frames:] = blend(motion.angles[-1], motion.angles[0])
    return longer._replace(loops=True, positions=positions, quaternions=quaternions, angles=angles)


def split_next_angles(next_poses, joints: int) -> tuple:
    """Return the angles (..., joints) of both poses in the block `next_poses` (..., size): its poses end with them."""
    size = next_poses.shape[-1] // POSES_AHEAD
    return next_poses[..., size - joints : size], next_poses[..., -joints:]


def _tabulate(body: Body, loop: Motion, count: int, rate_unit: float) -> MotionTables:
    """Return the table of one loop with a number of rows in a cycle, and with those that continue it.

    Velocities are differences between rows: motors that get an action a row can follow no faster change.
    """
    loop = motions.resample(loop, count / loop.seconds)
    velocities = motions.velocities(loop)
    rows = count + POSES_AHEAD
    frames = motions.repeat(loop, 0, rows)
    positions = frames.positions
    quaternions = frames.quaternions
    yaw = np.unwrap(rotations.yaw(quaternions))
    angles = frames.angles
    legs = Legs.of(body)
    soles = find_soles(legs, positions, quaternions, angles)  # edits of frames may have left `soles` behind
    from_torso = rotations.to_heading_frame((soles - positions[:, None])[..., :2], yaw[:, None])
    clearance = sizing.sole_clearance(body)
    standing_height = body.torso.standing_height
    center_heights = soles[..., 2:] + legs.radii[:, None] + clearance
    in_cycle = np.arange(rows) % count
    turns = yaw - yaw[in_cycle]
    linear = velocities.linear[in_cycle]
    ground_velocities = rotations.to_heading_frame(linear[:, :2], -turns)
    phases = 2.0 * np.pi * np.arange(rows) / count
    columns = (ground_velocities, linear[:, 2:], velocities.angular[in_cycle], velocities.joints[in_cycle])
    velocity_rows = np.concatenate(columns, axis=-1)
    feet = np.concatenate([from_torso, center_heights], axis=-1)
    foot_variances = feet.var(axis=0).sum(axis=-1)
    return MotionTables(
        starts=np.zeros(1, int),
        counts=np.array([count]),
        mirror_offset=0,
        places=np.concatenate([positions[:, :2], yaw[:, None]], axis=-1),
        heights=positions[:, 2] + clearance,
        quaternions=quaternions,
        angles=angles,
        velocities=velocity_rows,
        feet=feet,
        planted=soles[..., 2] < MAX_PLANTED_HEIGHT * standing_height,
        circle=np.stack([np.sin(phases), np.cos(phases)], axis=-1),
        angle_spreads=angles.std(axis=0, keepdims=True).clip(_MIN_ANGLE_SPREAD),
        rate_spreads=velocity_rows[:, 6:].std(axis=0, keepdims=True).clip(_MIN_RATE_SPREAD * rate_unit),
        foot_spreads=np.sqrt(foot_variances)[None].clip(_MIN_FOOT_SPREAD * standing_height),
    )
