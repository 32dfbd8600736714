"""Following motions: the poses, speeds and places of one motion or of several, from a clip of an animator, for example.

An episode draws a motion, whether it is followed as its mirror image, and where in it the body starts, moving as the
motion does. The motion repeats. At the start of every cycle its place is set to that of the body, so that drift does
not add up.

Actions are positions about the next pose of the motion: an action of 0 holds it.

The reward compares with the motion's spread: an error in a joint that hardly moves counts more than the same error in
one that swings.
"""

import functools
import math
import os
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.markers import Marker
from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import measure_standing, rate_unit
from arc_suite.motions import Motion, check_body, motion_text, striding
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks, parameters, parts
from arc_suite.tasks import readings as reading
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import FileSetting, Inputs, Start, Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.ghost import draw_pose
from arc_suite.tasks.motion_tables import POSES_AHEAD, MotionTables, split_next_angles
from arc_suite.tasks.parameters import Noise, Parameters
from arc_suite.tasks.readings import Readings

_NOISE_SHARE = 0.3  # of the noise of a start in walk: the body starts in the middle of a motion
_MAX_MOTIONS = 64

# Widths of kernels: errors at which a bonus is 0.4. Those of joints and feet are in spreads of the motion.
_POSE_WIDTH = 0.5
_SPEED_WIDTH = 1.5
_FEET_WIDTH = 0.5
_PLACE_WIDTH = 0.08  # standing heights
_ATTITUDE_WIDTH = 0.1  # rad

# An episode ends where the body is further from the motion than this.
_MAX_DISTANCE = 0.5  # standing heights, of the torso
_MAX_ATTITUDE = 1.0  # rad, about

_GHOST_DISTANCE = 2.2  # of the motion's pose in pictures from the motion, mean distances of the feet


class MimicSettings(NamedTuple):
    """Settings of following motions.

    Attributes:
        motions: the motions.
        both_sides: whether half of the episodes follow the mirror image.
        weights: signed weight of every term.
        noise: noise of the start.
    """

    motions: tuple[Motion, ...]
    both_sides: bool
    weights: dict[str, float]
    noise: Noise


class Errors(NamedTuple):
    """How far a body is from its motion, (...) each.

    Attributes:
        pose: mean square error of joint angles, in squares of their spreads in the motion.
        speed: mean square error of joint velocities, in squares of their spreads.
        feet: mean square distance of the feet, seen from the torso, in squares of their spreads.
        angles: mean square error of joint angles, rad^2.
        distance: square distance of the torso, in squares of the standing height.
        attitude: 2 (1 - cos a), about the square of the angle a between both orientations of the torso, rad^2.
    """

    pose: np.ndarray
    speed: np.ndarray
    feet: np.ndarray
    angles: np.ndarray
    distance: np.ndarray
    attitude: np.ndarray


class MimicMemory(NamedTuple):
    """Memory of an episode.

    Attributes:
        steps: (...) control steps since the start.
        tick: (...) control steps since the start of the motion's cycle.
        motion: (...) index of the motion.
        side: (...) 0 where the motion is followed, 1 where its mirror image is.
        origin: (..., 3) place of the cycle's start in the world: x and y, m, and yaw, rad.
        action: (..., joints) action of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) action of the step before; 0 before the first.
        errors: in the latest step.
        all_angles: (...) sum of `errors.angles` over the steps.
        all_distances: (...) sum of `errors.distance` over the steps.
    """

    steps: int | np.ndarray
    tick: int | np.ndarray
    motion: int | np.ndarray
    side: int | np.ndarray
    origin: np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    errors: Errors
    all_angles: np.ndarray
    all_distances: np.ndarray


class Mimic(Task):
    """Following one motion or several."""

    name = "mimic"
    modifiers = {"actions": "position"}
    demonstrators = ("tracked",)
    file_settings = {"motion": FileSetting(motion_text.embed, motion_text.names_file, motion_text.label)}
    weights: ClassVar[dict[str, float]] = {
        "pose": 1.5,
        "joint_speed": 0.25,
        "feet": 0.5,
        "place": 1.0,
        "attitude": 0.75,
        "control": -0.01,
        "smoothness": -0.02,
    }

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the settings."""
        return ("motion", "both_sides", "weights", *parameters.SHARED_NOISE, *Noise._fields)

    @classmethod
    def settings_for(cls, body: Body, overrides: Mapping[str, Any]) -> MimicSettings:
        """Return the settings for a body.

        Args:
            body: the body.
            overrides: `motion`: "walk" for a kinematic walk in the gait of the task walk, the path of a file, a motion
                as text, or a list of these. `both_sides`, `weights`, and those of the noise of a start.

        Raises:
            ValueError: an unknown name, a value that does not fit, or a motion of another body.
            OSError: a file that cannot be read.
        """
        values = parameters.values(body, overrides, cls.name, cls.names(), names_of_others=("arena",))
        noise = parameters.noise(values)
        unset_noise = {name for name in Noise._fields if not _sets_noise(overrides, name)}
        scaled_noise = {name: _NOISE_SHARE * getattr(noise, name) for name in unset_noise}
        walk = parameters.parameters(body, values)
        return MimicSettings(
            motions=_read_motions(body, walk, overrides.get("motion", striding.NAME)),
            both_sides=checks.boolean("both_sides", overrides.get("both_sides", False)),
            weights=parameters.weights(cls.weights, changed=overrides.get("weights")),
            noise=noise._replace(**scaled_noise),
        )

    @functools.cached_property
    def tables(self) -> MotionTables:
        """The tables of the motions."""
        scene = self.scene
        tables = MotionTables.of(scene.body, self.settings.motions, scene.control_timestep, rate_unit(self._height))
        if self.settings.both_sides and not tables.mirror_offset:
            raise ValueError(f"both_sides: {scene.body.name} has no left-right symmetry, expected False")
        return tables

    @property
    def _height(self) -> float:
        """The standing height, m."""
        return self.scene.body.torso.standing_height

    @functools.cached_property
    def blocks(self) -> Mapping[str, Block]:
        """Posture and velocities; which motion is followed, where in its cycle, and the poses that come next."""
        body = self.scene.body
        motion_parts = [
            parts.Scalar("cycle sine"),
            parts.Scalar("cycle cosine"),
            parts.Scalar("side of the motion", sign=-1),
        ]
        if len(self.settings.motions) > 1:
            motion_parts += [parts.Scalar(f"motion {index}") for index in range(len(self.settings.motions))]
        pose_parts = []
        for ahead in range(1, 1 + POSES_AHEAD):
            pose_parts += [
                parts.Planar(f"torso in {ahead} steps", "h"),
                parts.Scalar(f"torso up in {ahead} steps", "h"),
                parts.Quaternion(f"torso quaternion in {ahead} steps"),
                parts.Joints(body, f"angle of {{}} in {ahead} steps", "rad"),
            ]
        return {
            "posture": blocks.posture(body),
            "velocities": blocks.velocities(body, headed=True),
            "motion": Block(tuple(motion_parts)),
            "next_poses": Block(tuple(pose_parts)),
        }

    def start(self, random: np.random.RandomState, stream: Any) -> Start:
        """Draw the motion, its side, and a place in its cycle; the body moves there as the motion does, with noise."""
        scene = self.scene
        tables = self.tables
        noise_qpos, noise_qvel = self.settings.noise.draw(scene.standing, random)
        draws = random.uniform(size=3)
        motion = int(draws[0] * len(tables.counts))
        tick = int(draws[1] * tables.counts[motion])
        side = int(self.settings.both_sides and draws[2] < 0.5)
        row = int(tables.starts[motion]) + tick + side * tables.mirror_offset
        noise = noise_qpos - scene.standing
        qpos = noise_qpos.copy()
        qpos[:2] = tables.places[row, :2] + noise[:2]
        qpos[2] = tables.heights[row] + noise[2]
        quaternion = tables.quaternions[row] + noise[3:7]
        qpos[3:7] = quaternion / np.linalg.norm(quaternion)
        layout = scene.layout
        qpos[layout.joint_angles] += tables.angles[row]
        qvel = noise_qvel.copy()
        qvel[layout.velocities] += tables.velocities[row]
        zero = np.float64(0.0)
        no_action = np.zeros(len(scene.body.joint_names))
        memory = MimicMemory(
            steps=0,
            tick=tick,
            motion=motion,
            side=side,
            origin=np.zeros(3),
            action=no_action,
            previous_action=no_action,
            errors=Errors(*[zero] * len(Errors._fields)),
            all_angles=zero,
            all_distances=zero,
        )
        return Start(qpos, qvel, memory)

    def begin(self, memory: MimicMemory, readings: Readings) -> MimicMemory:
        """Return the memory with the errors at the start."""
        return memory._replace(errors=self._compare(memory, readings))

    def position_center(self, memory: MimicMemory):
        """Return targets (..., joints) by which position control brings joints to the next pose at its speed, rad."""
        row = self._row(memory)
        angles = self.tables.angles
        return self._lead(self.tables.entries(angles, row + 1), self.tables.entries(angles, row + 2))

    def observed_position_center(self, blocks: Mapping[str, np.ndarray]):
        """Return the same angles (..., joints) from the block `next_poses`, rad."""
        return self._lead(*split_next_angles(blocks["next_poses"], len(self.scene.body.joint_names)))

    def _lead(self, angles, later_angles):
        """Return angles (..., joints) that are ahead of a pose, as position control damps the speed of joints."""
        return angles + self._lead_steps * (later_angles - angles)

    @functools.cached_property
    def _lead_steps(self) -> np.ndarray:
        """Control steps (joints,) that targets are ahead: damping over stiffness."""
        body = self.scene.body
        stiffness, damping = position_gains(size_body(body), measure_standing(body).inertias)
        return damping / stiffness / self.scene.control_timestep

    def before(self, memory: MimicMemory, action) -> tuple[MimicMemory, Inputs]:
        """Return the memory with the action, and the action as the input."""
        return memory._replace(action=action, previous_action=memory.action), Inputs(action)

    def after(self, memory: MimicMemory, readings: Readings) -> MimicMemory:
        """Return the memory a step later; a cycle that ends begins again at the body's place."""
        memory = memory._replace(steps=memory.steps + 1, tick=memory.tick + 1)
        errors = self._compare(memory, readings)
        place = _read_place(readings)
        xp = place.__array_namespace__()
        is_over = memory.tick >= self.tables.entries(self.tables.counts, memory.motion)
        return memory._replace(
            tick=xp.where(is_over, 0, memory.tick),
            origin=xp.where(xp.asarray(is_over)[..., None], place, memory.origin),
            errors=errors,
            all_angles=memory.all_angles + errors.angles,
            all_distances=memory.all_distances + errors.distance,
        )

    def _row(self, memory: MimicMemory):
        """Return the row (...) of the tables that belongs to a memory."""
        start = self.tables.entries(self.tables.starts, memory.motion)
        return start + memory.tick + memory.side * self.tables.mirror_offset

    def _compare(self, memory: MimicMemory, readings: Readings) -> Errors:
        """Return how far the body is from its motion."""
        tables = self.tables
        row = self._row(memory)
        spread_row = memory.motion + memory.side * len(tables.counts)
        angle_errors = readings.joint_angles - tables.entries(tables.angles, row)
        rate_errors = readings.velocities[..., 6:] - tables.entries(tables.velocities, row)[..., 6:]
        foot_errors = self._feet_from_torso(readings) - tables.entries(tables.feet, row)
        relative_angles = angle_errors / tables.entries(tables.angle_spreads, spread_row)
        relative_rates = rate_errors / tables.entries(tables.rate_spreads, spread_row)
        relative_feet = foot_errors / tables.entries(tables.foot_spreads, spread_row)[..., None]
        distances = self._torso_offset(memory, readings, row)
        quaternion = rotations.turn_about_z(tables.entries(tables.quaternions, row), memory.origin[..., 2])
        half_cosine = (quaternion * readings.torso_quaternion).sum(axis=-1)
        return Errors(
            pose=(relative_angles * relative_angles).mean(axis=-1),
            speed=(relative_rates * relative_rates).mean(axis=-1),
            feet=(relative_feet * relative_feet).sum(axis=-1).mean(axis=-1),
            angles=(angle_errors * angle_errors).mean(axis=-1),
            distance=(distances * distances).sum(axis=-1),
            attitude=4.0 * (1.0 - half_cosine * half_cosine),
        )

    def _feet_from_torso(self, readings: Readings):
        """Return the centers of the feet (..., legs, 3): forward and left of the torso, and over the ground, m."""
        feet = readings.foot_positions
        xp = feet.__array_namespace__()
        heading = rotations.yaw(readings.torso_quaternion)[..., None]
        from_torso = feet[..., :2] - readings.torso_position[..., None, :2]
        ground = rotations.to_heading_frame(from_torso, heading)
        return xp.concatenate([ground, readings.foot_heights[..., None]], axis=-1)

    def _torso_offset(self, memory: MimicMemory, readings: Readings, row):
        """Return how far (..., 3) the torso of a row is from the body's: forward, left and up, standing heights."""
        tables = self.tables
        position = tables.entries(tables.places, row)
        xp = readings.posture.__array_namespace__()
        from_origin = rotations.to_heading_frame(position[..., :2], -memory.origin[..., 2])
        in_world = memory.origin[..., :2] + from_origin - readings.torso_position[..., :2]
        ground = rotations.to_heading_frame(in_world, rotations.yaw(readings.torso_quaternion))
        rise = tables.entries(tables.heights, row) - readings.torso_height
        return xp.concatenate([ground, rise[..., None]], axis=-1) / self._height

    def terms(self, memory: MimicMemory, readings: Readings) -> dict:
        """Return a bonus of 1 for each kind of error that is 0, and costs of torques."""
        errors = memory.errors
        jerk = memory.action - memory.previous_action
        return {
            "pose": _kernel(errors.pose, _POSE_WIDTH),
            "joint_speed": _kernel(errors.speed, _SPEED_WIDTH),
            "feet": _kernel(errors.feet, _FEET_WIDTH),
            "place": _kernel(errors.distance, _PLACE_WIDTH),
            "attitude": _kernel(errors.attitude, _ATTITUDE_WIDTH),
            "control": (memory.action**2).sum(axis=-1),
            "smoothness": (jerk**2).sum(axis=-1),
        }

    def observe(self, memory: MimicMemory, readings: Readings) -> dict:
        """Return the blocks; directions are relative to the heading of the torso."""
        heading = rotations.yaw(readings.torso_quaternion)
        observation = {
            **reading.observe_by_heading(readings, heading),
            "motion": self._observe_motion(memory, readings),
            "next_poses": self._observe_next_poses(memory, readings, heading),
        }
        return reading.remove_negative_zeros(observation)

    def _observe_motion(self, memory: MimicMemory, readings: Readings):
        """Return the block `motion` (..., size): place in the cycle, side, and which of several motions is followed."""
        tables = self.tables
        xp = readings.posture.__array_namespace__()
        circle = tables.entries(tables.circle, self._row(memory))
        sign = xp.asarray(1.0 - 2.0 * memory.side)[..., None]
        is_followed = xp.asarray(memory.motion)[..., None] == np.arange(len(tables.counts))
        observed_motions = [is_followed.astype(float)] if len(tables.counts) > 1 else []
        return xp.concatenate([circle, sign, *observed_motions], axis=-1)

    def _observe_next_poses(self, memory: MimicMemory, readings: Readings, heading):
        """Return the block `next_poses` (..., size): the poses of the next control steps, as seen from the torso."""
        tables = self.tables
        xp = readings.posture.__array_namespace__()
        row = self._row(memory)
        turn = memory.origin[..., 2] - heading
        numbers = []
        for ahead in range(1, 1 + POSES_AHEAD):
            quaternion = rotations.turn_about_z(tables.entries(tables.quaternions, row + ahead), turn)
            sign = xp.where(quaternion[..., :1] < 0.0, -1.0, 1.0)  # q and -q are one orientation
            offset = self._torso_offset(memory, readings, row + ahead)
            numbers += [offset, sign * quaternion, tables.entries(tables.angles, row + ahead)]
        return xp.concatenate(numbers, axis=-1)

    def markers(self, memory: MimicMemory, readings: Readings) -> list[Marker]:
        """Return the motion's pose as a ghost to the left of the body."""
        tables = self.tables
        index = self._row(memory)
        heading = memory.origin[2]
        ground = rotations.to_heading_frame(tables.places[index, :2], -heading) + memory.origin[:2]
        quaternion = rotations.turn_about_z(tables.quaternions[index], heading)
        aside = _GHOST_DISTANCE * reach(self.scene.body)
        leftward = np.array((-math.sin(heading), math.cos(heading)))
        position = np.append(ground + aside * leftward, tables.heights[index])
        return draw_pose(self.scene.body, position, quaternion, tables.angles[index])

    def ended(self, memory: MimicMemory, readings: Readings) -> tuple:
        """Return whether the body has lost its motion, which terminates, or has left the ground, which truncates."""
        position = readings.torso_position
        return self._is_lost(memory), self.scene.arena.has_left(position[..., 0], position[..., 1])

    def _is_lost(self, memory: MimicMemory):
        """Return whether (...) the body is too far from its motion."""
        errors = memory.errors
        return (errors.distance > _MAX_DISTANCE**2) | (errors.attitude > _MAX_ATTITUDE**2)

    def progress(self, memory: MimicMemory) -> dict:
        """Return the errors of joints, rad, and of the torso, standing heights: roots of mean squares; and `fell`."""
        steps = memory.steps + (memory.steps == 0)  # at least 1
        xp = memory.all_angles.__array_namespace__()
        return {
            "joint_error": xp.sqrt(memory.all_angles / steps),
            "torso_error": xp.sqrt(memory.all_distances / steps),
            "fell": self._is_lost(memory),
        }


def _kernel(squares, width: float):
    """Return the bonus (...) of squared errors (...): 1 at 0, 0.4 at the square of the width, near exp(-x)."""
    share = squares / (width * width)
    return 1.0 / (1.0 + share * (1.0 + 0.5 * share))


def _read_place(readings: Readings):
    """Return the place (..., 3) of the torso: x and y, m, and yaw, rad."""
    xp = readings.posture.__array_namespace__()
    yaw = rotations.yaw(readings.torso_quaternion)
    return xp.concatenate([readings.torso_position[..., :2], yaw[..., None]], axis=-1)


def _sets_noise(overrides: Mapping[str, Any], name: str) -> bool:
    """Return whether settings set a noise, under its own name or under one that it shares."""
    names = [shared for shared, members in parameters.SHARED_NOISE.items() if name in members]
    return any(setting in overrides for setting in (name, *names))


def _read_motions(body: Body, walk: Parameters, setting: Any) -> tuple[Motion, ...]:
    """Return the motions of a body, given the setting `motion`: a text or a list of texts; see `Mimic.settings_for`."""
    texts = [setting] if isinstance(setting, str | os.PathLike) else setting
    if not isinstance(texts, list | tuple) or not 0 < len(texts) <= _MAX_MOTIONS:
        raise ValueError(f"motion: expected a motion, or a list of up to {_MAX_MOTIONS}, got {checks.preview(texts)}")
    motions = []
    for text in texts:
        if text == striding.NAME:
            offsets = walk.phase_offsets / (2.0 * math.pi)
            motion = striding.stride(body, walk.gait_frequency, walk.duty_factor, offsets, walk.target_velocity)
        else:
            motion = motion_text.read(text)
        check_body(motion, body)
        motions.append(motion)
    return tuple(motions)
