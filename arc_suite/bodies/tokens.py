"""What one policy for all bodies observes and does: legs, torso and command, without dimension and padded.

Legs are tokens: a vector for each, the same for every body. They are computed from the blocks that the body's own
policy observes. Everything is a product, a sum or a root of numbers, which round alike in batches of any size.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import GRAVITY, measure_standing
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

LEGS, JOINTS = 12, 4  # at most, of a body, and of a leg

# The blocks that tokens are made from, and the parts that each has to have.
BLOCKS = {
    "posture": (Scalar, Quaternion, Joints),
    "velocities": (Vector, Vector, Joints),
    "contact_forces": (RigidParts,),
    "gait_clock": (Phase,),
}
_UPWARD = 5  # place of the upward force among the torque and force on a rigid part

# Sizes: of a leg, of the torso and of the command in every step, and of a leg and the torso in the description.
LEG, TORSO, COMMAND = 2 * JOINTS + 4, 12, 6
LEG_DESCRIPTION, TORSO_DESCRIPTION = 9 + 8 * JOINTS, 10

# Sizes of the blocks of one vector that holds all of it.
FLAT = {
    "legs": LEGS * LEG,
    "torso": TORSO,
    "command": COMMAND,
    "leg_descriptions": LEGS * LEG_DESCRIPTION,
    "torso_description": TORSO_DESCRIPTION,
}

# What a network of legs sees of one leg: its token and description, and those of the torso, and the command.
LEG_INPUTS = LEG + LEG_DESCRIPTION + TORSO + COMMAND + TORSO_DESCRIPTION
_COUNTS = slice(8, 12)  # of a leg's description: the number of joints, as one of four

_CARRIES = 0.05  # share of the weight from which on a foot counts as loaded
_LARGEST_FORCE = 0.5  # that is asked for, as observed forces are clipped to 1


class Description(NamedTuple):
    """Bodies as a policy knows them: lengths in h, rates in sqrt(g / h), torques in those of the motors.

    Attributes:
        legs: (..., 12, 41) foot and mount from the torso's origin (6), direction of the foot (2), number of joints as
            one of four (4), Jacobian of the sole (3 x 4), joint ranges, rad (4 x 2), stiffness, action per rad, and
            damping of position control (4 + 4), duty factor.
        torso: (..., 10) number of legs by 12, half-extents of the first solid (3), center of mass (3), static
            stability margin, R, duty factor.
        mask: (..., 12, 4) booleans, which joints there are.
        reach: (..., 12, 4) angles that an action of 1 asks for, rad.
    """

    legs: np.ndarray
    torso: np.ndarray
    mask: np.ndarray
    reach: np.ndarray


def pad_joints(body: Body, values: np.ndarray) -> np.ndarray:
    """Return values (joints, ...) of a body's joints as (12, 4, ...), 0 where there is none."""
    array = np.zeros((LEGS * JOINTS, *np.shape(values)[1:]))
    array[joint_slots(body)] = values
    return array.reshape(LEGS, JOINTS, *array.shape[1:])


def privileged_sizes(task: Task) -> dict[str, int]:
    """Return the sizes of the blocks of a task's privileged observation, padded to 12 legs of 4 joints."""
    return {name: _padding(block).size for name, block in task.privileged_blocks.items()}


def pad_privileged(task: Task, vectors: np.ndarray) -> np.ndarray:
    """Return privileged observations (environments, size) with 12 legs of 4 joints, 0 where there is none."""
    return spread(privileged_padding(task), vectors)


def privileged_padding(task: Task) -> Padding:
    """Return the places of a task's privileged observation in that of bodies of 12 legs of 4 joints."""
    return join_padding([_padding(block) for block in task.privileged_blocks.values()])


def spread(padding: Padding, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (environments, numbers of the body) at their places in padded ones, 0 elsewhere."""
    padded_vectors = np.zeros((len(vectors), padding.size), vectors.dtype)
    padded_vectors[:, padding.places] = vectors
    return padded_vectors


def _padding(block: Block) -> Padding:
    """Return the places of a block's numbers in that of a body of 12 legs of 4 joints."""
    return join_padding([part.padding(LEGS, JOINTS) for part in block.parts])


@functools.lru_cache(maxsize=256)
def _slots(body: Body) -> tuple[int, ...]:
    return joint_places(body, LEGS, JOINTS)


def joint_slots(body: Body) -> np.ndarray:
    """Return the places (joints,) of a body's joints among the 12 x 4 of all legs.

    Raises:
        ValueError: the body has more than 12 legs, or a leg more than 4 joints.
    """
    return np.array(_slots(body))


def flatten_tokens(tokens: Mapping[str, np.ndarray], legs: np.ndarray, torso: np.ndarray) -> np.ndarray:
    """Return tokens and a description as one vector (environments, 664), blocks as in `FLAT`.

    Args:
        tokens: see `Tokens.make_tokens`.
        legs: (environments, 12, 41) of the description.
        torso: (environments, 10) of the description.
    """
    parts = *(tokens[name] for name in ("legs", "torso", "command")), legs, torso
    return np.concatenate([part.reshape(len(part), -1) for part in parts], axis=-1)


def split_flat(vectors) -> dict[str, Any]:
    """Return vectors (..., 664) of NumPy or JAX as the blocks of `FLAT`, by name."""
    return {name: vectors[..., part] for name, part in blocks.slices(FLAT).items()}


def leg_inputs(vectors):
    """Return the inputs (..., 12, 81) of a network of legs, and which joints there are (..., 12, 4).

    Args:
        vectors: (..., 664) of `flat`, of NumPy or JAX; normalized ones keep the number of joints as it is.
    """
    numpy = vectors.__array_namespace__()
    legs, torso, command, leg_descriptions, torso_description = split_flat(vectors).values()
    leading = vectors.shape[:-1]
    descriptions = leg_descriptions.reshape(*leading, LEGS, LEG_DESCRIPTION)
    shared = numpy.concatenate([torso, command, torso_description], axis=-1)[..., None, :]
    shared = numpy.broadcast_to(shared, (*leading, LEGS, shared.shape[-1]))
    inputs = numpy.concatenate([legs.reshape(*leading, LEGS, LEG), descriptions, shared], axis=-1)
    counts = descriptions[..., _COUNTS]
    # A leg of k joints has the first k.
    mask = numpy.stack([counts[..., joint:].sum(axis=-1) for joint in range(JOINTS)], axis=-1) > 0.5
    return inputs, mask


def repeat_for_legs(values: np.ndarray, counts: float) -> np.ndarray:
    """Return numbers (81,) of the inputs of one leg as those (664,) of the vector; `counts` for numbers of joints."""
    leg, description, torso, command, about = np.split(values, np.cumsum((LEG, LEG_DESCRIPTION, TORSO, COMMAND)))
    description = description.copy()
    description[_COUNTS] = counts
    parts = np.tile(leg, LEGS), torso, command, np.tile(description, LEGS), about
    return np.concatenate(parts).astype(np.float32)


def body_description(task: Task) -> Description:
    """Return the description of the body of a task, in the gait that the task prescribes; no leading axes.

    Raises:
        ValueError: too many legs or joints, or a task that prescribes no gait.
    """
    if task.parameters is None:
        raise ValueError(f"task {task.name}: expected one that prescribes a gait")
    body, pose, duty = task.scene.body, measure_standing(task.scene.body), task.parameters.duty_factor
    height, first = pose.height, body.torso.solids[0]
    count, rate = len(body.legs), math.sqrt(GRAVITY / pose.height)
    stiffness, damping = position_gains(size_body(body), pose.inertias)
    ranges = np.radians([joint.range_deg for joint in body.joints])
    feet, mounts = np.array([leg.foot_position for leg in body.legs]), np.array([leg.mount for leg in body.legs])
    away = feet[:, :2] / np.maximum(np.hypot(feet[:, 0], feet[:, 1]), 1e-9)[:, None]
    counts = np.eye(JOINTS)[[len(leg.joints) - 1 for leg in body.legs]]
    jacobians = pad_joints(body, np.concatenate([jacobian.T for jacobian in pose.jacobians]))[:count]
    by_leg = (pad_joints(body, values)[:count] for values in (ranges, stiffness, damping * rate))
    parts = [feet / height, mounts / height, away, counts, jacobians.swapaxes(1, 2) / height, *by_leg]
    legs = np.zeros((LEGS, LEG_DESCRIPTION))
    legs[:count] = np.concatenate([part.reshape(count, -1) for part in parts] + [np.full((count, 1), duty)], axis=-1)
    half = np.array((*first.size, *(first.size[-1],) * (3 - len(first.size))))
    lengths = np.array((*half, *pose.center, pose.margin, reach(body))) / height
    return Description(
        legs=legs.astype(np.float32),
        torso=np.array((count / LEGS, *lengths, duty), np.float32),
        mask=pad_joints(body, np.ones(len(ranges))).astype(bool),
        reach=pad_joints(body, abs(ranges).max(axis=-1)).astype(np.float32),
    )


class Tokens(NamedTuple):
    """How observations of environments become tokens, in float32; all arrays have a leading axis for environments.

    Attributes:
        places: (environments, n) where in the body's own observation vector the torso's posture and velocity (5 + 6),
            joint angles and velocities (48 + 48), upward forces on feet (12), clock (2) and command (6, or 0) lie; any
            place for what is not there.
        mask: (environments, 12, 4) 1 where there is a joint.
        legs: (environments, 12) 1 where there is a leg.
        height: (environments,) h, m.
        speed: (environments,) sqrt(g h), m/s.
        rate: (environments,) sqrt(g / h), rad/s.
        units: (environments, 3) of the command; see `fitting.velocity_units`.
        turn: (environments,) R / h.
        forward: (environments,) 1 for a walk forward, -1 for one backward.
        loaded: (environments,) upward force from which on a foot is loaded, in units of the block.
        offset: (environments, 12, 2) sine and cosine of the phase of each leg over the clock.
        middle: (environments, 2) sine and cosine of the phase in the middle of stance.
    """

    places: np.ndarray
    mask: np.ndarray
    legs: np.ndarray
    height: np.ndarray
    speed: np.ndarray
    rate: np.ndarray
    units: np.ndarray
    turn: np.ndarray
    forward: np.ndarray
    loaded: np.ndarray
    offset: np.ndarray
    middle: np.ndarray

    @classmethod
    def of(cls, tasks: Sequence[Task]) -> Self:
        """Return the tokens of a batch whose environment i does the i-th task.

        Raises:
            ValueError: see `described`, or a task that does not observe the blocks `BLOCKS`.
        """
        made = {id(task): cls._of_one(task) for task in {id(task): task for task in tasks}.values()}
        return cls(*(np.stack(values) for values in zip(*(made[id(task)] for task in tasks), strict=True)))

    @classmethod
    def _of_one(cls, task: Task) -> tuple:
        if "history" in task.blocks:
            raise ValueError("history: expected 0 for different bodies, as tokens of legs hold the present alone")
        if any(name not in task.blocks or task.blocks[name].kinds != kinds for name, kinds in BLOCKS.items()):
            raise ValueError(f"task {task.name}: expected the blocks {', '.join(BLOCKS)}, got {', '.join(task.blocks)}")
        body, parameters, pose = task.scene.body, task.parameters, measure_standing(task.scene.body)
        # Forces are in N, or in weights where a task has a command.
        weight = 1.0 if "command" in task.blocks else pose.mass * GRAVITY
        phases = np.zeros(LEGS)
        phases[: len(body.legs)] = parameters.phase_offsets
        middle = math.pi * parameters.duty_factor
        mask = pad_joints(body, np.ones(len(body.joint_names)))
        units = velocity_units(body, parameters.target_velocity)
        numbers = (
            mask,
            mask.any(axis=-1),
            pose.height,
            math.sqrt(GRAVITY * pose.height),
            math.sqrt(GRAVITY / pose.height),
            units,
            units[0] / units[2] / pose.height,
            math.copysign(1.0, parameters.target_velocity),
            min(_CARRIES * weight, _LARGEST_FORCE),
            np.stack([np.sin(phases), np.cos(phases)], axis=-1),
            np.array((math.sin(middle), math.cos(middle))),
        )
        return cls._places(task), *(np.asarray(number, np.float32) for number in numbers)

    @staticmethod
    def _places(task: Task) -> np.ndarray:
        body = task.scene.body
        numbers = {name: np.arange(part.start, part.stop) for name, part in blocks.slices(task.sizes).items()}
        parts = {name: [numbers[name][part] for part in task.blocks[name].slices] for name in BLOCKS}
        height, orientation, angles = parts["posture"]
        linear, angular, speeds = parts["velocities"]
        (forces,) = parts["contact_forces"]
        upward = np.zeros(LEGS, int)
        rigid_parts = task.blocks["contact_forces"].parts[0]
        upward[: len(body.legs)] = [forces[rigid_parts.places(name)[_UPWARD]] for name in body.foot_names]
        joints = [pad_joints(body, places).ravel() for places in (angles, speeds)]
        command = numbers.get("command", [])
        places = [height, orientation, linear, angular, *joints, upward, numbers["gait_clock"], command]
        return np.concatenate(places).astype(int)

    def gather_inputs(self, vectors: np.ndarray) -> np.ndarray:
        """Return the numbers (environments, n) of observation vectors (environments, size) that tokens are made from.

        Vectors of bodies with different joints have different sizes; these numbers have one layout.
        """
        return np.take_along_axis(vectors, self.places, axis=-1)

    @staticmethod
    def split_inputs(gathered: np.ndarray) -> list[np.ndarray]:
        """Return gathered numbers (..., n), or their places, in the parts that `places` names."""
        return np.split(gathered, np.cumsum((5, 6, LEGS * JOINTS, LEGS * JOINTS, LEGS, 2)), axis=-1)

    def make_tokens(self, gathered: np.ndarray) -> dict[str, np.ndarray]:
        """Return the tokens of gathered numbers (environments, n).

        Returns:
            legs (environments, 12, 12): joint angles, rad, and velocities (4 + 4), sine and cosine of the leg's phase,
            whether it is to stand, whether it is loaded; 0 for legs and joints that are not there.
            torso (environments, 12): height, up axis (3), forward axis (2), velocity (3), angular velocity (3).
            command (environments, 6): the desired velocity and the present one, as the torso heads, in units of
            the command.
        """
        pose, velocities, angles, speeds, forces, clock, command = self.split_inputs(gathered.astype(np.float32))
        angles, speeds = (array.reshape(self.mask.shape) * self.mask for array in (angles, speeds))
        sine = clock[:, :1] * self.offset[..., 1] + clock[:, 1:] * self.offset[..., 0]
        cosine = clock[:, 1:] * self.offset[..., 1] - clock[:, :1] * self.offset[..., 0]
        still = clock == 0.0
        stands = sine * self.middle[:, :1] + cosine * self.middle[:, 1:] >= self.middle[:, 1:]
        stands = stands | (still[:, :1] & still[:, 1:])
        phase = np.stack([sine, cosine, stands, forces >= self.loaded[:, None]], axis=-1) * self.legs[..., None]
        legs = np.concatenate([angles, speeds / self.rate[:, None, None], phase], axis=-1)

        height, w, x, y, z = pose.T
        up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))  # the world's, in the torso
        ahead, aside = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
        level = np.maximum(np.sqrt(ahead * ahead + aside * aside), np.float32(1e-6))
        cos, sin = ahead / level, aside / level
        vx, vy, vz, *angular = velocities.T
        linear = [cos * vx + sin * vy, cos * vy - sin * vx, vz]
        rates = [speed / self.speed for speed in linear] + [speed / self.rate for speed in angular]
        torso = np.stack([height / self.height, *up, ahead, aside, *rates], axis=-1)
        if not command.shape[-1]:  # along world x, and back into that direction
            turn = (-sin * self.turn).clip(-1.0, 1.0)
            desired = [self.forward * cos, -self.forward * sin, turn]
            motion = [speed / unit for speed, unit in zip((*linear[:2], angular[2]), self.units.T, strict=True)]
            command = np.stack([*desired, *motion], axis=-1)
        return {"legs": legs, "torso": torso, "command": command}

    def select(self, indices) -> Self:
        """Return the tokens of some environments."""
        return type(self)(*(values[indices] for values in self))

    def body_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return the bodies' own actions (environments, joints) of padded ones (environments, 12, 4)."""
        flat = actions.reshape(len(actions), -1)
        return flat[self.mask.reshape(flat.shape) > 0.0].reshape(len(actions), -1)
