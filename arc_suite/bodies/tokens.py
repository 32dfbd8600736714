"""Observations and actions of one policy for all bodies: legs, torso and command, without dimension and padded.

Each leg is a token: a vector with the same layout for every body. Tokens are computed from the blocks that the body's
own policy observes. Everything is a product, a sum or a root of numbers, which round alike in batches of any size.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.bodies.descriptions import (
    LEG_DESCRIPTION_SIZE,
    TORSO_DESCRIPTION_SIZE,
    Description,  # noqa: F401  pickles of earlier versions have it here
)
from arc_suite.bodies.padding import MAX_JOINTS, MAX_LEGS, pad_joints
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach, velocity_units
from arc_suite.tasks.parts import Joints, Phase, Quaternion, RigidParts, Scalar, Vector
from arc_suite.tasks.sensors import SCAN

# The blocks that tokens are made from, and the parts that each has to have.
BLOCKS = {
    "posture": (Scalar, Quaternion, Joints),
    "velocities": (Vector, Vector, Joints),
    "contact_forces": (RigidParts,),
    "gait_clock": (Phase,),
}
_UPWARD_FORCE = 5  # its index among the torque and force on a rigid part

# Points about the standing place of a foot, forward and left, R, under which a leg sees the ground.
_PATCH = np.array([(-0.3, 0.0), (-0.15, 0.0), (0.0, 0.0), (0.15, 0.0), (0.3, 0.0), (0.0, 0.4), (0.0, -0.4)])
PATCH_SIZE = len(_PATCH)

# Sizes of what changes in every step: of a leg, of the torso and of the command.
LEG_SIZE = 2 * MAX_JOINTS + 4 + PATCH_SIZE
TORSO_SIZE = 12
_VELOCITY_SIZE = 6  # of the block `command`, the desired velocity and the present one
_POSE_SIZE = 6
COMMAND_SIZE = _VELOCITY_SIZE + _POSE_SIZE + 5

# Sizes of the blocks of one vector that holds everything.
FLAT_SIZES = {
    "legs": MAX_LEGS * LEG_SIZE,
    "torso": TORSO_SIZE,
    "command": COMMAND_SIZE,
    "leg_descriptions": MAX_LEGS * LEG_DESCRIPTION_SIZE,
    "torso_description": TORSO_DESCRIPTION_SIZE,
}

# Inputs of a network for one leg: token and description of the leg, token and description of the torso, and command.
LEG_INPUT_SIZE = LEG_SIZE + LEG_DESCRIPTION_SIZE + TORSO_SIZE + COMMAND_SIZE + TORSO_DESCRIPTION_SIZE
_JOINT_COUNTS = slice(8, 12)  # of a leg's description: the number of joints, as one of four

_MIN_CARRIED_SHARE = 0.05  # of the weight, on a foot that counts as loaded
_MAX_THRESHOLD = 0.5  # of the force on a loaded foot, as observed forces are clipped to 1
_MISSING = np.zeros(0)  # of a field that pickles of earlier versions lack
_MIN_HEADING = np.float32(1e-6)  # length of the forward axis seen from above, in divisions

# Coefficients of the series of sine and cosine, the highest power first: policy files have sums and products alone.
_SINE_SERIES = [(-1.0) ** k / math.factorial(2 * k + 1) for k in range(5, -1, -1)]
_COSINE_SERIES = [(-1.0) ** k / math.factorial(2 * k) for k in range(5, -1, -1)]


class Inputs(NamedTuple):
    """The numbers that tokens are made from, or their indices, (environments, size) each, in this order.

    Numbers of legs, joints and blocks that a body or its task lacks are arbitrary.

    Attributes:
        posture: height and quaternion of the torso (5).
        velocities: linear and angular velocity of the torso (6).
        joint_angles: (48)
        joint_velocities: (48)
        forces: upward forces on feet (12).
        clock: sine and cosine of the phase of the gait (2); both are 0 while a body is to stand.
        velocity_command: the desired velocity and the present one (6).
        pose: the commanded pose (6).
        leg_sines, leg_cosines: sine and cosine of the phase of each leg in the commanded gait (12 + 12).
        gait: duty factor and frequency of that gait (2).
        ground: heights of the ground about the feet (84).
    """

    posture: np.ndarray
    velocities: np.ndarray
    joint_angles: np.ndarray
    joint_velocities: np.ndarray
    forces: np.ndarray
    clock: np.ndarray
    velocity_command: np.ndarray
    pose: np.ndarray
    leg_sines: np.ndarray
    leg_cosines: np.ndarray
    gait: np.ndarray
    ground: np.ndarray


_SLOTS = MAX_LEGS * MAX_JOINTS
_INPUT_SIZES = (5, 6, _SLOTS, _SLOTS, MAX_LEGS, 2, _VELOCITY_SIZE, _POSE_SIZE, MAX_LEGS, MAX_LEGS, 2)  # before `ground`


def flatten_tokens(tokens: Mapping[str, np.ndarray], legs: np.ndarray, torso: np.ndarray) -> np.ndarray:
    """Return tokens and a description as one vector (environments, 759), blocks as in `FLAT_SIZES`.

    Args:
        tokens: see `Tokens.make_tokens`.
        legs: (environments, 12, 41) legs of the description.
        torso: (environments, 10) torso of the description.
    """
    parts = [tokens["legs"], tokens["torso"], tokens["command"], legs, torso]
    return np.concatenate([part.reshape(len(part), -1) for part in parts], axis=-1)


def split_flat(vectors) -> dict[str, Any]:
    """Return vectors (..., 759) of NumPy or JAX as the blocks of `FLAT_SIZES`, by name."""
    return {name: vectors[..., part] for name, part in blocks.slices(FLAT_SIZES).items()}


def leg_inputs(vectors):
    """Return the inputs (..., 12, 98) of a network of legs, and whether a leg has a joint (..., 12, 4).

    Args:
        vectors: (..., 759) vectors of `flatten_tokens`, of NumPy or JAX; normalized ones keep the number of joints as
            it is.
    """
    xp = vectors.__array_namespace__()
    legs, torso, command, leg_descriptions, torso_description = split_flat(vectors).values()
    batch_shape = vectors.shape[:-1]
    leg_tokens = legs.reshape(*batch_shape, MAX_LEGS, LEG_SIZE)
    descriptions = leg_descriptions.reshape(*batch_shape, MAX_LEGS, LEG_DESCRIPTION_SIZE)
    shared = xp.concatenate([torso, command, torso_description], axis=-1)[..., None, :]
    shared_by_legs = xp.broadcast_to(shared, (*batch_shape, MAX_LEGS, shared.shape[-1]))
    inputs = xp.concatenate([leg_tokens, descriptions, shared_by_legs], axis=-1)
    # A leg of k joints has the joints 0 to k - 1. Entry k - 1 of its counts is 1.
    counts = descriptions[..., _JOINT_COUNTS]
    has_joint = [counts[..., joint:].sum(axis=-1) for joint in range(MAX_JOINTS)]
    mask = xp.stack(has_joint, axis=-1) > 0.5
    return inputs, mask


def repeat_for_legs(values: np.ndarray, counts: float) -> np.ndarray:
    """Return numbers (98,) for the inputs of one leg as numbers (759,) for the vector of `flatten_tokens`.

    Args:
        values: (98,) in the order of `leg_inputs`.
        counts: in place of the numbers of joints.
    """
    ends = np.cumsum((LEG_SIZE, LEG_DESCRIPTION_SIZE, TORSO_SIZE, COMMAND_SIZE))
    leg, leg_description, torso, command, torso_description = np.split(values, ends)
    leg_description = leg_description.copy()
    leg_description[_JOINT_COUNTS] = counts
    legs = np.tile(leg, MAX_LEGS)
    leg_descriptions = np.tile(leg_description, MAX_LEGS)
    return np.concatenate([legs, torso, command, leg_descriptions, torso_description]).astype(np.float32)


class Tokens(NamedTuple):
    """Constants that turn observations of environments into tokens, in float32; the leading axis is for environments.

    Attributes:
        input_indices: (environments, n) indices of `Inputs` in the body's own observation vector.
        mask: (environments, 12, 4) 1 for a joint of the body.
        legs: (environments, 12) 1 for a leg of the body.
        height: (environments,) h, m.
        velocity_unit: (environments,) sqrt(g h), m/s.
        rate_unit: (environments,) sqrt(g / h), rad/s.
        command_units: (environments, 3) units of the command; see `fitting.velocity_units`.
        turn_scale: (environments,) R / h.
        direction: (environments,) 1 for a walk forward, -1 for one backward.
        loaded_force: (environments,) upward force from which on a foot is loaded, in units of the block.
        leg_phase: (environments, 12, 2) sine and cosine of the phase of each leg over the clock.
        mid_stance: (environments, 2) sine and cosine of the phase in the middle of stance.
        has_command, has_pose, has_scan: (environments,) 1 for a task that observes a command, a pose and a gait by
            command, and the heights of the ground.
        gait: (environments, 2) duty factor and frequency of the prescribed gait, of which tasks with a gait by command
            observe another one.
    """

    input_indices: np.ndarray
    mask: np.ndarray
    legs: np.ndarray
    height: np.ndarray
    velocity_unit: np.ndarray
    rate_unit: np.ndarray
    command_units: np.ndarray
    turn_scale: np.ndarray
    direction: np.ndarray
    loaded_force: np.ndarray
    leg_phase: np.ndarray
    mid_stance: np.ndarray
    has_command: np.ndarray = _MISSING
    has_pose: np.ndarray = _MISSING
    has_scan: np.ndarray = _MISSING
    gait: np.ndarray = _MISSING

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> Self:
        """Return the tokens of a batch whose environment i does the i-th task.

        Raises:
            ValueError: see `body_description`, or a task that does not observe the blocks `BLOCKS`.
        """
        task_by_id = {id(task): task for task in tasks}
        values_by_id = {key: cls._of_task(task) for key, task in task_by_id.items()}
        columns = zip(*(values_by_id[id(task)] for task in tasks), strict=True)
        return cls(*(np.stack(column) for column in columns))

    @classmethod
    def _of_task(cls, task: Task) -> Self:
        """Return the tokens of one task, without the leading axis for environments."""
        if "history" in task.blocks:
            raise ValueError("history: expected 0 for different bodies, as tokens of legs hold the present alone")
        if any(name not in task.blocks or task.blocks[name].kinds != kinds for name, kinds in BLOCKS.items()):
            raise ValueError(f"task {task.name}: expected the blocks {', '.join(BLOCKS)}, got {', '.join(task.blocks)}")
        body = task.scene.body
        parameters = task.parameters
        pose = measure_standing(body)
        # Forces are in weights where a task has a command, else in N.
        has_command = "command" in task.blocks
        weight = 1.0 if has_command else pose.mass * GRAVITY
        phases = np.zeros(MAX_LEGS)  # rad
        phases[: len(body.legs)] = parameters.phase_offsets
        mid_stance_phase = math.pi * parameters.duty_factor  # rad
        mask = pad_joints(body, np.ones(len(body.joint_names)))
        units = velocity_units(body, parameters.target_velocity)
        rate_unit = math.sqrt(GRAVITY / pose.height)
        tokens = cls(
            input_indices=cls._find_input_indices(task),
            mask=mask,
            legs=mask.any(axis=-1),
            height=pose.height,
            velocity_unit=math.sqrt(GRAVITY * pose.height),
            rate_unit=rate_unit,
            command_units=units,
            turn_scale=units[0] / units[2] / pose.height,
            direction=math.copysign(1.0, parameters.target_velocity),
            loaded_force=min(_MIN_CARRIED_SHARE * weight, _MAX_THRESHOLD),
            leg_phase=np.stack([np.sin(phases), np.cos(phases)], axis=-1),
            mid_stance=np.array((math.sin(mid_stance_phase), math.cos(mid_stance_phase))),
            has_command=has_command,
            has_pose="pose" in task.blocks,
            has_scan="scan" in task.blocks,
            gait=np.array((parameters.duty_factor, parameters.gait_frequency / rate_unit)),
        )
        # Everything except the indices is float32.
        indices, *numbers = tokens
        return cls(indices, *(np.asarray(number, np.float32) for number in numbers))

    @staticmethod
    def _find_input_indices(task: Task) -> np.ndarray:
        """Return the indices (n,) in the task's observation of the numbers that tokens are made from."""
        body = task.scene.body
        block_slices = blocks.slices(task.sizes)
        block_indices = {name: np.arange(part.start, part.stop) for name, part in block_slices.items()}
        parts = {name: [block_indices[name][part] for part in task.blocks[name].slices] for name in BLOCKS}
        height, orientation, angles = parts["posture"]
        linear_velocity, angular_velocity, joint_velocities = parts["velocities"]
        (forces,) = parts["contact_forces"]
        rigid_parts = task.blocks["contact_forces"].parts[0]
        upward_forces = np.zeros(MAX_LEGS, int)
        for leg, name in enumerate(body.foot_names):
            upward_forces[leg] = forces[rigid_parts.places(name)[_UPWARD_FORCE]]
        leg_sines, leg_cosines, gait = _find_gait(block_indices, len(body.legs))
        indices = Inputs(
            posture=np.append(height, orientation),
            velocities=np.append(linear_velocity, angular_velocity),
            joint_angles=pad_joints(body, angles).ravel(),
            joint_velocities=pad_joints(body, joint_velocities).ravel(),
            forces=upward_forces,
            clock=block_indices["gait_clock"],
            velocity_command=block_indices.get("command", np.zeros(_VELOCITY_SIZE)),
            pose=block_indices.get("pose", np.zeros(_POSE_SIZE)),
            leg_sines=leg_sines,
            leg_cosines=leg_cosines,
            gait=gait,
            ground=_find_ground(body, block_indices),
        )
        return np.concatenate(indices).astype(int)

    def gather_inputs(self, vectors: np.ndarray) -> np.ndarray:
        """Return the numbers (environments, n) of observation vectors (environments, size) that tokens are made from.

        Vectors of bodies with different joints have different sizes; these numbers have one layout.
        """
        return np.take_along_axis(vectors, self.input_indices, axis=-1)

    @staticmethod
    def split_inputs(inputs: np.ndarray) -> Inputs:
        """Return gathered numbers (..., n), or their indices, by name."""
        return Inputs(*np.split(inputs, np.cumsum(_INPUT_SIZES), axis=-1))

    def make_tokens(self, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """Return the tokens of gathered numbers (environments, n).

        Returns:
            legs (environments, 12, 19): joint angles, rad, and velocities (4 + 4), sine and cosine of the leg's phase,
            whether it is to stand, whether it is loaded, heights of the ground about its foot over that under the
            torso, h (7), 0 where a task observes none; 0 for legs and joints that a body does not have.
            torso (environments, 12): height, up axis (3), forward axis (2), velocity (3), angular velocity (3).
            command (environments, 17): the desired velocity and the present one, along the torso's heading, in units
            of the command (6), the commanded pose (6), duty factor and frequency of the gait, and whether the task
            observes a command, a pose and a gait, and heights of the ground.
        """
        numbers = self.split_inputs(inputs.astype(np.float32))
        height, w, x, y, z = numbers.posture.T
        # The world's vertical in the torso's frame.
        up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        # The torso's forward axis in the world, seen from above.
        forward_x = 1.0 - 2.0 * (y * y + z * z)
        forward_y = 2.0 * (x * y + w * z)
        length = np.maximum(np.sqrt(forward_x * forward_x + forward_y * forward_y), _MIN_HEADING)
        cos_heading = forward_x / length
        sin_heading = forward_y / length
        vx, vy, vz, *angular_velocity = numbers.velocities.T  # in the world
        forward_velocity = cos_heading * vx + sin_heading * vy
        left_velocity = cos_heading * vy - sin_heading * vx
        linear_rates = [velocity / self.velocity_unit for velocity in (forward_velocity, left_velocity, vz)]
        angular_rates = [velocity / self.rate_unit for velocity in angular_velocity]
        torso = np.stack([height / self.height, *up, forward_x, forward_y, *linear_rates, *angular_rates], axis=-1)

        # Without a command, along world x, and back into that direction.
        turn = (-sin_heading * self.turn_scale).clip(-1.0, 1.0)
        desired = [self.direction * cos_heading, -self.direction * sin_heading, turn]
        forward_unit, left_unit, turn_unit = self.command_units.T
        motion = [
            forward_velocity / forward_unit,
            left_velocity / left_unit,
            angular_velocity[2] / turn_unit,
        ]
        straight_ahead = np.stack([*desired, *motion], axis=-1)
        has_command = self.has_command[:, None]
        has_pose = self.has_pose[:, None]
        command = has_command * numbers.velocity_command + (1.0 - has_command) * straight_ahead
        gait = has_pose * numbers.gait + (1.0 - has_pose) * self.gait
        flags = np.stack([self.has_command, self.has_pose, self.has_scan], axis=-1)
        return {
            "legs": self._leg_tokens(numbers, gait[:, :1]),
            "torso": torso,
            "command": np.concatenate([command, has_pose * numbers.pose, gait, flags], axis=-1),
        }

    def _leg_tokens(self, numbers: Inputs, duty_factor: np.ndarray) -> np.ndarray:
        """Return the tokens of legs (environments, 12, 19), given the duty factor (environments, 1) of the gait."""
        masked_angles = numbers.joint_angles.reshape(self.mask.shape) * self.mask
        masked_velocities = numbers.joint_velocities.reshape(self.mask.shape) * self.mask
        sine, cosine, is_to_stand = self._leg_phases(numbers, duty_factor)
        is_loaded = numbers.forces >= self.loaded_force[:, None]
        phase = np.stack([sine, cosine, is_to_stand, is_loaded], axis=-1) * self.legs[..., None]

        torso_height = numbers.posture[:, :1] / self.height[:, None]
        ground = numbers.ground + torso_height - 1.0  # the block has 0 a standing height under the torso
        seen_ground = (ground * self.has_scan[:, None]).reshape(*self.legs.shape, PATCH_SIZE) * self.legs[..., None]
        rates = masked_velocities / self.rate_unit[:, None, None]
        return np.concatenate([masked_angles, rates, phase, seen_ground], axis=-1)

    def _leg_phases(self, numbers: Inputs, duty_factor: np.ndarray) -> tuple:
        """Return sine and cosine of the phase of each leg, and whether it is to stand, (environments, 12) each."""
        clock = numbers.clock
        offset_sine = self.leg_phase[..., 0]
        offset_cosine = self.leg_phase[..., 1]
        # Sine and cosine of each leg's phase: that of the clock plus the leg's offset.
        sine = clock[:, :1] * offset_cosine + clock[:, 1:] * offset_sine
        cosine = clock[:, 1:] * offset_cosine - clock[:, :1] * offset_sine
        has_stopped = clock == 0.0  # in both numbers, for a body that is to stand
        has_stopped = has_stopped[:, :1] & has_stopped[:, 1:]
        has_pose = self.has_pose[:, None]
        walks_in_commanded_gait = has_pose - has_pose * has_stopped
        sine = (1.0 - has_pose) * sine + walks_in_commanded_gait * numbers.leg_sines
        cosine = (1.0 - has_pose) * cosine + walks_in_commanded_gait * numbers.leg_cosines
        # A leg stands while its phase is nearer to mid-stance than phase 0 is, the touchdown.
        angle = (duty_factor - 0.5) * math.pi  # of the middle of stance, from a quarter of the cycle on
        angle_squared = angle * angle
        middle_sine = has_pose * _series(_COSINE_SERIES, angle_squared) + (1.0 - has_pose) * self.mid_stance[:, :1]
        sine_of_angle = angle * _series(_SINE_SERIES, angle_squared)
        middle_cosine = (1.0 - has_pose) * self.mid_stance[:, 1:] - has_pose * sine_of_angle
        is_in_stance = sine * middle_sine + cosine * middle_cosine >= middle_cosine
        return sine, cosine, is_in_stance | has_stopped

    def select(self, indices) -> Self:
        """Return the tokens of some environments."""
        return type(self)(*(values[indices] for values in self))

    def body_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return the bodies' own actions (environments, joints) of padded ones (environments, 12, 4)."""
        flat_actions = actions.reshape(len(actions), -1)
        has_joint = self.mask.reshape(flat_actions.shape) > 0.0
        return flat_actions[has_joint].reshape(len(actions), -1)


def _find_gait(block_indices: Mapping[str, np.ndarray], leg_count: int) -> tuple:
    """Return the indices of the sines and cosines (12 + 12) of the legs' phases, and of the gait's numbers (2)."""
    leg_sines = np.zeros(MAX_LEGS)
    leg_cosines = np.zeros(MAX_LEGS)
    if "gait" not in block_indices:
        return leg_sines, leg_cosines, np.zeros(2)
    indices = block_indices["gait"]
    leg_sines[:leg_count] = indices[:leg_count]
    leg_cosines[:leg_count] = indices[leg_count : 2 * leg_count]
    return leg_sines, leg_cosines, indices[2 * leg_count :]


def _find_ground(body: Body, block_indices: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the indices (84,) of the points of the block `scan` that are nearest to those about each foot."""
    nearest_points = np.zeros((MAX_LEGS, PATCH_SIZE))
    if "scan" not in block_indices:
        return nearest_points.ravel()
    feet = np.array([leg.foot_position[:2] for leg in body.legs]) / reach(body)
    points = feet[:, None] + _PATCH  # (legs, 7, 2)
    distances = np.linalg.norm(points[:, :, None] - SCAN.T, axis=-1)  # to each point of the scan
    nearest_points[: len(feet)] = block_indices["scan"][distances.argmin(axis=-1)]
    return nearest_points.ravel()


def _series(coefficients: Sequence[float], x):
    """Return the sum of powers of x with coefficients, the highest power first."""
    total = coefficients[0]
    for coefficient in coefficients[1:]:
        total = total * x + coefficient
    return total
