"""Observations and actions of one policy for all bodies: legs, torso and command, without dimension and padded.

Each leg is a token: a vector with the same layout for every body. Tokens are computed from the blocks that the body's
own policy observes. Everything is a product, a sum or a root of numbers, which round alike in batches of any size.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import GRAVITY, PoseMechanics, measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks import blocks
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach, velocity_units
from arc_suite.tasks.parts import (
    Joints,
    Padding,
    Phase,
    Quaternion,
    RigidParts,
    Scalar,
    Vector,
    join_padding,
    joint_places,
)

MAX_LEGS = 12  # at most, of a body
MAX_JOINTS = 4  # at most, of a leg

# The blocks that tokens are made from, and the parts that each has to have.
BLOCKS = {
    "posture": (Scalar, Quaternion, Joints),
    "velocities": (Vector, Vector, Joints),
    "contact_forces": (RigidParts,),
    "gait_clock": (Phase,),
}
_UPWARD_FORCE = 5  # its index among the torque and force on a rigid part

# Sizes of what changes in every step: of a leg, of the torso and of the command.
LEG_SIZE = 2 * MAX_JOINTS + 4
TORSO_SIZE = 12
COMMAND_SIZE = 6

# Sizes of the description, which stays the same: of a leg and of the torso.
LEG_DESCRIPTION_SIZE = 9 + 8 * MAX_JOINTS
TORSO_DESCRIPTION_SIZE = 10

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
_MIN_LENGTH = 1e-9  # m, of vectors in divisions
_MIN_HEADING = np.float32(1e-6)  # length of the forward axis seen from above, in divisions

# Sizes of the parts of what `Tokens.gather_inputs` returns, before the command: posture, velocities, joint angles,
# joint velocities, forces, clock.
_INPUT_SIZES = (5, 6, MAX_LEGS * MAX_JOINTS, MAX_LEGS * MAX_JOINTS, MAX_LEGS, 2)


class Description(NamedTuple):
    """Properties of bodies that stay the same: lengths in h, rates in sqrt(g / h), torques in those of the motors.

    Attributes:
        legs: (..., 12, 41) foot and mount from the torso's origin (6), direction of the foot (2), number of joints as
            one of four (4), Jacobian of the sole (3 x 4), joint ranges, rad (4 x 2), stiffness, action per rad, and
            damping of position control (4 + 4), duty factor.
        torso: (..., 10) number of legs by 12, half-extents of the first solid (3), center of mass (3), static
            stability margin, R, duty factor.
        mask: (..., 12, 4) whether a leg has a joint.
        reach: (..., 12, 4) angles that an action of 1 asks for, rad.
    """

    legs: np.ndarray
    torso: np.ndarray
    mask: np.ndarray
    reach: np.ndarray


def pad_joints(body: Body, values: np.ndarray) -> np.ndarray:
    """Return values (joints, ...) of a body's joints as (12, 4, ...), 0 where there is none."""
    padded_values = np.zeros((MAX_LEGS * MAX_JOINTS, *np.shape(values)[1:]))
    padded_values[joint_slots(body)] = values
    return padded_values.reshape(MAX_LEGS, MAX_JOINTS, *padded_values.shape[1:])


def privileged_sizes(task: Task) -> dict[str, int]:
    """Return the sizes of the blocks of a task's privileged observation, padded to 12 legs of 4 joints."""
    return {name: _padding(block).size for name, block in task.privileged_blocks.items()}


def pad_privileged_blocks(task: Task, vectors: np.ndarray) -> np.ndarray:
    """Return privileged observations (environments, size) with 12 legs of 4 joints, 0 where there is none."""
    return spread(privileged_padding(task), vectors)


def privileged_padding(task: Task) -> Padding:
    """Return the indices of a task's privileged observation in that of a body of 12 legs of 4 joints."""
    return join_padding([_padding(block) for block in task.privileged_blocks.values()])


def spread(padding: Padding, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (environments, size) of a body as padded ones (environments, padded size), 0 where padded."""
    padded_vectors = np.zeros((len(vectors), padding.size), vectors.dtype)
    padded_vectors[:, padding.places] = vectors
    return padded_vectors


def _padding(block: Block) -> Padding:
    """Return the indices of a block's numbers in the block of a body of 12 legs of 4 joints."""
    return join_padding([part.padding(MAX_LEGS, MAX_JOINTS) for part in block.parts])


def joint_slots(body: Body) -> np.ndarray:
    """Return the indices (joints,) of a body's joints among the 12 x 4 joints of padded legs.

    Raises:
        ValueError: the body has more than 12 legs, or a leg more than 4 joints.
    """
    return np.array(_cached_slots(body))


@functools.lru_cache(maxsize=256)
def _cached_slots(body: Body) -> tuple[int, ...]:
    return joint_places(body, MAX_LEGS, MAX_JOINTS)


def flatten_tokens(tokens: Mapping[str, np.ndarray], legs: np.ndarray, torso: np.ndarray) -> np.ndarray:
    """Return tokens and a description as one vector (environments, 664), blocks as in `FLAT_SIZES`.

    Args:
        tokens: see `Tokens.make_tokens`.
        legs: (environments, 12, 41) legs of the description.
        torso: (environments, 10) torso of the description.
    """
    parts = [tokens["legs"], tokens["torso"], tokens["command"], legs, torso]
    return np.concatenate([part.reshape(len(part), -1) for part in parts], axis=-1)


def split_flat(vectors) -> dict[str, Any]:
    """Return vectors (..., 664) of NumPy or JAX as the blocks of `FLAT_SIZES`, by name."""
    return {name: vectors[..., part] for name, part in blocks.slices(FLAT_SIZES).items()}


def leg_inputs(vectors):
    """Return the inputs (..., 12, 81) of a network of legs, and whether a leg has a joint (..., 12, 4).

    Args:
        vectors: (..., 664) vectors of `flatten_tokens`, of NumPy or JAX; normalized ones keep the number of joints as
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
    """Return numbers (81,) for the inputs of one leg as numbers (664,) for the vector of `flatten_tokens`.

    Args:
        values: (81,) in the order of `leg_inputs`.
        counts: in place of the numbers of joints.
    """
    ends = np.cumsum((LEG_SIZE, LEG_DESCRIPTION_SIZE, TORSO_SIZE, COMMAND_SIZE))
    leg, leg_description, torso, command, torso_description = np.split(values, ends)
    leg_description = leg_description.copy()
    leg_description[_JOINT_COUNTS] = counts
    legs = np.tile(leg, MAX_LEGS)
    leg_descriptions = np.tile(leg_description, MAX_LEGS)
    return np.concatenate([legs, torso, command, leg_descriptions, torso_description]).astype(np.float32)


def body_description(task: Task) -> Description:
    """Return the description of the body of a task, in the gait that the task prescribes; no leading axes.

    Raises:
        ValueError: too many legs or joints, or a task that prescribes no gait.
    """
    if task.parameters is None:
        raise ValueError(f"task {task.name}: expected one that prescribes a gait")
    body = task.scene.body
    duty_factor = task.parameters.duty_factor
    pose = measure_standing(body)
    height = pose.height  # m, of the torso
    leg_count = len(body.legs)
    ranges = np.radians([joint.range_deg for joint in body.joints])

    legs = np.zeros((MAX_LEGS, LEG_DESCRIPTION_SIZE))
    legs[:leg_count] = _describe_legs(body, pose, ranges, duty_factor)
    first_solid = body.torso.solids[0]
    missing_extents = 3 - len(first_solid.size)  # of solids that are round about an axis
    half_extents = np.array((*first_solid.size, *(first_solid.size[-1],) * missing_extents))
    lengths = np.array((*half_extents, *pose.center, pose.margin, reach(body))) / height
    return Description(
        legs=legs.astype(np.float32),
        torso=np.array((leg_count / MAX_LEGS, *lengths, duty_factor), np.float32),
        mask=pad_joints(body, np.ones(len(ranges))).astype(bool),
        reach=pad_joints(body, abs(ranges).max(axis=-1)).astype(np.float32),
    )


def _describe_legs(body: Body, pose: PoseMechanics, ranges: np.ndarray, duty_factor: float) -> np.ndarray:
    """Return the descriptions (legs, 41) of a body's legs; see `Description`.

    Args:
        body: any body.
        pose: the standing one.
        ranges: (joints, 2) ranges of the joints, rad.
        duty_factor: duty factor of the gait.
    """
    leg_count = len(body.legs)
    rate = math.sqrt(GRAVITY / pose.height)  # rad/s
    feet = np.array([leg.foot_position for leg in body.legs])  # (legs, 3) m
    mounts = np.array([leg.mount for leg in body.legs])  # (legs, 3) m
    foot_distances = np.maximum(np.hypot(feet[:, 0], feet[:, 1]), _MIN_LENGTH)  # from the torso, seen from above
    foot_directions = feet[:, :2] / foot_distances[:, None]
    joint_counts = np.eye(MAX_JOINTS)[[len(leg.joints) - 1 for leg in body.legs]]
    jacobians = pad_joints(body, np.concatenate([jacobian.T for jacobian in pose.jacobians]))[:leg_count]
    stiffness, damping = position_gains(size_body(body), pose.inertias)
    parts = [
        feet / pose.height,
        mounts / pose.height,
        foot_directions,
        joint_counts,
        jacobians.swapaxes(1, 2) / pose.height,
        pad_joints(body, ranges)[:leg_count],
        pad_joints(body, stiffness)[:leg_count],
        pad_joints(body, damping * rate)[:leg_count],
        np.full((leg_count, 1), duty_factor),
    ]
    return np.concatenate([part.reshape(leg_count, -1) for part in parts], axis=-1)


class Tokens(NamedTuple):
    """Constants that turn observations of environments into tokens, in float32; the leading axis is for environments.

    Attributes:
        input_indices: (environments, n) in the body's own observation vector: indices of the torso's posture and
            velocity (5 + 6), joint angles and velocities (48 + 48), upward forces on feet (12), clock (2) and command
            (6); any index for legs and joints that the body does not have, and for the command of a task without one.
        mask: (environments, 12, 4) 1 for a joint of the body.
        legs: (environments, 12) 1 for a leg of the body.
        height: (environments,) h, m.
        velocity_unit: (environments,) sqrt(g h), m/s.
        rate_unit: (environments,) sqrt(g / h), rad/s.
        command_units: (environments, 3) units of the command; see `fitting.velocity_units`.
        turn_scale: (environments,) R / h.
        direction: (environments,) 1 for a walk forward, -1 for one backward.
        has_command: (environments,) 1 for a task with a command.
        loaded_force: (environments,) upward force from which on a foot is loaded, in units of the block.
        leg_phase: (environments, 12, 2) sine and cosine of the phase of each leg over the clock.
        mid_stance: (environments, 2) sine and cosine of the phase in the middle of stance.
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
    has_command: np.ndarray
    loaded_force: np.ndarray
    leg_phase: np.ndarray
    mid_stance: np.ndarray

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
        tokens = cls(
            input_indices=cls._find_input_indices(task),
            mask=mask,
            legs=mask.any(axis=-1),
            height=pose.height,
            velocity_unit=math.sqrt(GRAVITY * pose.height),
            rate_unit=math.sqrt(GRAVITY / pose.height),
            command_units=units,
            turn_scale=units[0] / units[2] / pose.height,
            direction=math.copysign(1.0, parameters.target_velocity),
            has_command=has_command,
            loaded_force=min(_MIN_CARRIED_SHARE * weight, _MAX_THRESHOLD),
            leg_phase=np.stack([np.sin(phases), np.cos(phases)], axis=-1),
            mid_stance=np.array((math.sin(mid_stance_phase), math.cos(mid_stance_phase))),
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
        indices = [
            height,
            orientation,
            linear_velocity,
            angular_velocity,
            pad_joints(body, angles).ravel(),
            pad_joints(body, joint_velocities).ravel(),
            upward_forces,
            block_indices["gait_clock"],
            block_indices.get("command", np.zeros(COMMAND_SIZE, int)),
        ]
        return np.concatenate(indices).astype(int)

    def gather_inputs(self, vectors: np.ndarray) -> np.ndarray:
        """Return the numbers (environments, n) of observation vectors (environments, size) that tokens are made from.

        Vectors of bodies with different joints have different sizes; these numbers have one layout.
        """
        return np.take_along_axis(vectors, self.input_indices, axis=-1)

    @staticmethod
    def split_inputs(inputs: np.ndarray) -> list[np.ndarray]:
        """Return gathered numbers (..., n), or their indices, in the parts that `input_indices` names."""
        return np.split(inputs, np.cumsum(_INPUT_SIZES), axis=-1)

    def make_tokens(self, inputs: np.ndarray) -> dict[str, np.ndarray]:
        """Return the tokens of gathered numbers (environments, n).

        Returns:
            legs (environments, 12, 12): joint angles, rad, and velocities (4 + 4), sine and cosine of the leg's phase,
            whether it is to stand, whether it is loaded; 0 for legs and joints that a body does not have.
            torso (environments, 12): height, up axis (3), forward axis (2), velocity (3), angular velocity (3).
            command (environments, 6): the desired velocity and the present one, along the torso's heading, in units
            of the command.
        """
        pose, velocities, angles, joint_velocities, forces, clock, command = self.split_inputs(
            inputs.astype(np.float32)
        )
        legs = self._leg_tokens(angles, joint_velocities, forces, clock)

        height, w, x, y, z = pose.T
        # The world's vertical in the torso's frame.
        up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        # The torso's forward axis in the world, seen from above.
        forward_x = 1.0 - 2.0 * (y * y + z * z)
        forward_y = 2.0 * (x * y + w * z)
        length = np.maximum(np.sqrt(forward_x * forward_x + forward_y * forward_y), _MIN_HEADING)
        cos_heading = forward_x / length
        sin_heading = forward_y / length
        vx, vy, vz, *angular_velocity = velocities.T  # in the world
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
        command = has_command * command + (1.0 - has_command) * straight_ahead
        return {"legs": legs, "torso": torso, "command": command}

    def _leg_tokens(self, angles, joint_velocities, forces, clock) -> np.ndarray:
        """Return the tokens of legs (environments, 12, 12).

        Args:
            angles: (environments, 48) rad.
            joint_velocities: (environments, 48) rad/s.
            forces: (environments, 12) upward on feet.
            clock: (environments, 2) sine and cosine of the gait's phase; both are 0 while a body is to stand.
        """
        masked_angles = angles.reshape(self.mask.shape) * self.mask
        masked_velocities = joint_velocities.reshape(self.mask.shape) * self.mask
        offset_sine = self.leg_phase[..., 0]
        offset_cosine = self.leg_phase[..., 1]
        # Sine and cosine of each leg's phase: that of the clock plus the leg's offset.
        sine = clock[:, :1] * offset_cosine + clock[:, 1:] * offset_sine
        cosine = clock[:, 1:] * offset_cosine - clock[:, :1] * offset_sine
        has_stopped = clock == 0.0  # in both numbers, for a body that is to stand
        # A leg stands while its phase is nearer to mid-stance than phase 0 is, the touchdown.
        middle_sine = self.mid_stance[:, :1]
        middle_cosine = self.mid_stance[:, 1:]
        is_in_stance = sine * middle_sine + cosine * middle_cosine >= middle_cosine
        is_to_stand = is_in_stance | (has_stopped[:, :1] & has_stopped[:, 1:])
        is_loaded = forces >= self.loaded_force[:, None]
        phase = np.stack([sine, cosine, is_to_stand, is_loaded], axis=-1) * self.legs[..., None]
        return np.concatenate([masked_angles, masked_velocities / self.rate_unit[:, None, None], phase], axis=-1)

    def select(self, indices) -> Self:
        """Return the tokens of some environments."""
        return type(self)(*(values[indices] for values in self))

    def body_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return the bodies' own actions (environments, joints) of padded ones (environments, 12, 4)."""
        flat_actions = actions.reshape(len(actions), -1)
        has_joint = self.mask.reshape(flat_actions.shape) > 0.0
        return flat_actions[has_joint].reshape(len(actions), -1)
