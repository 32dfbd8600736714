"""The servos of an imported robot: gains and torque limits of the file where it has them, else by rule."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Self

import mujoco
import numpy as np

from arc_suite.importing.drives import find_drives
from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import Robot
from arc_suite.models.standing import GRAVITY, foot_loads
from arc_suite.robots.spec import Servo

# The rule for stiffness: an error of so many radians makes a servo give this multiple of the load. The load of a joint
# is the torque that holds it in the standing pose.
_RULE_ERROR = 0.1  # rad
_RULE_LOADS = 10.0
_MIN_LOAD_SHARE = 0.5  # of the largest load in the leg: a joint with a smaller load counts with this one
_MIN_FREQUENCY = 17.0  # rad/s, natural frequency of a joint with the inertia that it moves
_MAX_FREQUENCY = 40.0  # rad/s, the same: a leg on the floor moves the torso, and not its links alone
_DAMPING_RATIO = 0.7

_LOADS_PER_LIMIT = 30.0  # torque limit of a motor in loads, where the file has no limit

# Limits that are placeholders, as some files have them for motors that nobody knew.
_PLACEHOLDER_TORQUE = 1000.0  # N m, and more
_MAX_LOADS_PER_LIMIT = 200.0  # in loads of the joint in the leg that bears most

_MIN_RANGE_LOSS = 0.01  # rad, by which controls reach less far than a joint, for a note

# Speeds that are placeholders: these and faster ones, and those below a share of sqrt(g / h) of the standing height h.
_PLACEHOLDER_SPEED = 100.0  # rad/s
_MIN_SWING = 0.5

# Origins of a limit. Other origins are names of attributes in the file.
_BY_RULE = "sized"
_PLACEHOLDER = "placeholder"


class Motors(NamedTuple):
    """The servos of all joints, and notes on where their limits come from.

    Attributes:
        servos: by joint.
        notes: a line for each kind of limit.
    """

    servos: dict[int, Servo]
    notes: tuple[str, ...]


class _Gains(NamedTuple):
    """Gains of a servo.

    Attributes:
        stiffness: N m/rad.
        damping: N m s/rad, in addition to that of the joint.
    """

    stiffness: float
    damping: float

    def choose(self, stiffness: float | None, damping: float | None) -> Self:
        """Return gains in which those that a user chose, not None, replace these."""
        chosen_stiffness = self.stiffness if stiffness is None else stiffness
        chosen_damping = self.damping if damping is None else damping
        return type(self)(chosen_stiffness, chosen_damping)


class _Limit(NamedTuple):
    """A torque limit.

    Attributes:
        low: least torque, N m.
        high: largest torque, N m.
        origin: the attribute of the file that sets it, `_BY_RULE` or `_PLACEHOLDER`.
    """

    low: float
    high: float
    origin: str

    @property
    def torque(self) -> float:
        """Return the limit of a servo, which has the same torque both ways, N m."""
        return max(abs(self.low), abs(self.high))

    @classmethod
    def of(cls, bounds, gear: float, origin: str) -> Self:
        """Return the limit of an actuator with bounds (2,) of its force; a gear below 0 turns it round."""
        low, high = sorted(gear * bounds)
        return cls(float(low), float(high), origin)


def find_motors(
    robot: Robot,
    stance: Stance,
    speeds: Mapping[str, float],
    stiffness: float | None = None,
    damping: float | None = None,
) -> Motors:
    """Return the servos of a robot's joints, without those that are passive.

    Args:
        robot: robot of the file.
        stance: stance in which it stands.
        speeds: speeds, rad/s, at which joints get no torque, by name in the file.
        stiffness: of each servo for which the file has no gains, N m/rad; None to size it.
        damping: the same, N m s/rad.
    """
    inertias, loads = _mechanics(robot, stance)
    gains_of_file = _find_gains(robot)
    delays_of_file = _find_delays(robot)
    limits_of_file = _find_limits(robot)
    servos = {}
    origins = {}
    for joints in _group_joints(robot, stance):
        largest_load = max(loads[joint] for joint in joints)
        for joint in joints:
            load = max(loads[joint], _MIN_LOAD_SHARE * largest_load)
            limit = limits_of_file.get(joint) or _limit_by_rule(load, inertias[joint])
            limit = _mark_placeholder(limit, largest_load)
            sized_gains = _gains_by_rule(load, inertias[joint], limit.torque, _joint_damping(robot, joint))
            gains = gains_of_file.get(joint) or sized_gains.choose(stiffness, damping)
            speed = speeds.get(robot.joint_name(joint))
            servos[joint] = Servo(
                stiffness=gains.stiffness,
                damping=gains.damping,
                limit=limit.torque,
                no_load_speed=speed if _is_speed(speed, stance.height) else None,
                delay=delays_of_file.get(joint, 0.0),
            )
            origins[joint] = limit.origin
    all_notes = (
        *_limit_notes(stance.joints, servos, origins),
        *_speed_notes(robot, stance.joints, servos, speeds),
        *_one_sided_notes(robot, stance.joints, limits_of_file),
        *_mirror_notes(robot, stance.joints),
        *_range_notes(robot, gains_of_file),
        *_delay_notes(stance.joints, servos),
        _gain_note(stance.joints, servos, gains_of_file, stiffness, damping),
    )
    return Motors(servos, all_notes)


def _joint_damping(robot: Robot, joint: int) -> float:
    """Return the damping of a joint in the file, N m s/rad."""
    return float(robot.model.dof_damping[robot.model.jnt_dofadr[joint]])


def _mark_placeholder(limit: _Limit, largest_load: float) -> _Limit:
    """Return a limit with its origin: a placeholder if it is too large for the load, N m, of joints like its own."""
    exceeds_load = largest_load > 0.0 and limit.torque > _MAX_LOADS_PER_LIMIT * largest_load
    is_placeholder = limit.torque >= _PLACEHOLDER_TORQUE or exceeds_load
    return limit._replace(origin=_PLACEHOLDER) if is_placeholder else limit


def _is_speed(speed: float | None, height: float) -> bool:
    """Return whether a speed, rad/s, is one of a motor, and no placeholder, in a robot that stands at a height, m."""
    if speed is None:
        return False
    slowest = _MIN_SWING * math.sqrt(GRAVITY / height)
    return slowest <= speed < _PLACEHOLDER_SPEED


def _group_joints(robot: Robot, stance: Stance) -> list[tuple[int, ...]]:
    """Return the joints of each leg, then each joint that belongs to no leg and is not passive."""
    groups = [leg.joints for leg in stance.legs]
    grouped_joints = {*stance.joints, *robot.passive}
    groups += [(joint,) for joint in robot.joints if joint not in grouped_joints]
    return groups


def _limit_by_rule(load: float, inertia: float) -> _Limit:
    """Return the torque limit of a motor without one in the file; without a load it still moves its link."""
    least_load = inertia * _MIN_FREQUENCY**2 * _RULE_ERROR / _RULE_LOADS
    torque = _LOADS_PER_LIMIT * max(load, least_load)
    return _Limit(-torque, torque, _BY_RULE)


def _gains_by_rule(load: float, inertia: float, torque_limit: float, joint_damping: float) -> _Gains:
    """Return the gains of a servo without gains in the file; the joint's own damping counts towards its damping."""
    desired_stiffness = max(_RULE_LOADS * load / _RULE_ERROR, inertia * _MIN_FREQUENCY**2)
    stiffness = min(desired_stiffness, torque_limit / _RULE_ERROR)
    effective_inertia = max(inertia, stiffness / _MAX_FREQUENCY**2)
    desired_damping = 2.0 * _DAMPING_RATIO * np.sqrt(stiffness * effective_inertia)
    return _Gains(stiffness, max(desired_damping - joint_damping, 0.0))


def _mechanics(robot: Robot, stance: Stance) -> tuple[dict[int, float], dict[int, float]]:
    """Return, by joint, the inertia with armature that it moves, and its load while all feet carry."""
    model = robot.model
    data = robot.forward_kinematics(stance.qpos)
    mujoco.mj_forward(model, data)
    mass_matrix = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass_matrix)

    mass = float(model.body_subtreemass[robot.root])
    weight = mass * float(np.linalg.norm(model.opt.gravity))
    center_of_mass = data.subtree_com[robot.root]
    soles = np.array([leg.sole for leg in stance.legs])
    forces = foot_loads(weight, soles[:, :2] - center_of_mass[:2])
    torques = data.qfrc_bias.copy()
    for leg, force in zip(stance.legs, forces, strict=True):
        torques -= force * _vertical_jacobian(model, data, leg)

    dofs = {joint: int(model.jnt_dofadr[joint]) for joint in robot.joints}
    inertias = {joint: float(mass_matrix[dof, dof]) for joint, dof in dofs.items()}
    loads = {joint: float(abs(torques[dof])) for joint, dof in dofs.items()}
    return inertias, loads


def _vertical_jacobian(model: mujoco.MjModel, data: mujoco.MjData, leg: Leg) -> np.ndarray:
    """Return the vertical velocity of a sole per velocity of each degree of freedom (nv,)."""
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, leg.sole, leg.body)
    return jacobian[2]


def _find_gains(robot: Robot) -> dict[int, _Gains]:
    """Return the gains of joints that a position actuator drives, by joint; the last actuator of a joint counts."""
    model = robot.model
    gains = {}
    for drive in find_drives(robot):
        gain = float(model.actuator_gainprm[drive.actuator, 0])
        _, position_bias, velocity_bias = model.actuator_biasprm[drive.actuator, :3]
        is_affine = model.actuator_biastype[drive.actuator] == mujoco.mjtBias.mjBIAS_AFFINE
        is_position_actuator = is_affine and gain > 0.0 and gain == -position_bias
        if is_position_actuator and drive.gear != 0.0:
            damping = max(float(-velocity_bias), 0.0)
            gains[drive.joint] = _Gains(gain * drive.gear**2, damping * drive.gear**2)
    return gains


def _find_limits(robot: Robot) -> dict[int, _Limit]:
    """Return the least torque limit of each joint that has one above 0."""
    model = robot.model
    limits_of_joint = defaultdict(list)
    for drive in find_drives(robot):
        if model.actuator_forcelimited[drive.actuator]:
            bounds = model.actuator_forcerange[drive.actuator]
            limits_of_joint[drive.joint].append(_Limit.of(bounds, drive.gear, "forcerange"))
        is_motor = model.actuator_biastype[drive.actuator] == mujoco.mjtBias.mjBIAS_NONE
        if is_motor and model.actuator_ctrllimited[drive.actuator]:
            gain = model.actuator_gainprm[drive.actuator, 0]
            bounds = gain * model.actuator_ctrlrange[drive.actuator]
            limits_of_joint[drive.joint].append(_Limit.of(bounds, drive.gear, "ctrlrange"))
    for joint in robot.joints:
        if model.jnt_actfrclimited[joint]:
            limits_of_joint[joint].append(_Limit.of(model.jnt_actfrcrange[joint], 1.0, "actuatorfrcrange or effort"))

    least_limits = {}
    for joint, limits in limits_of_joint.items():
        positive_limits = [limit for limit in limits if limit.torque > 0.0]
        if positive_limits:
            # Of equal torques, the origin that comes first in the alphabet.
            least_limits[joint] = min(positive_limits, key=lambda limit: (limit.torque, limit.origin))
    return least_limits


def _find_delays(robot: Robot) -> dict[int, float]:
    """Return the delays of actuators, s, by joint; the longest of a joint counts."""
    delays: dict[int, float] = {}
    for drive in find_drives(robot):
        delay = float(robot.model.actuator_delay[drive.actuator])
        delays[drive.joint] = max(delay, delays.get(drive.joint, 0.0))
    return delays


def _limit_notes(joints_of_legs: Sequence[int], servos: dict[int, Servo], origins: dict[int, str]) -> Iterator[str]:
    """Yield a line for each origin of the limits of the legs' motors."""
    counts = Counter(origins[joint] for joint in joints_of_legs)
    for origin, count in counts.items():
        torques = [servos[joint].limit for joint in joints_of_legs if origins[joint] == origin]
        span = format_span(min(torques), max(torques))
        if origin == _BY_RULE:
            text = f"none in the file for {count} motors, sized to {span} N m, {_LOADS_PER_LIMIT:g} times their load"
        elif origin == _PLACEHOLDER:
            text = f"{span} N m of {count} motors is a placeholder, far above their load"
        else:
            text = f"{span} N m of {count} motors, from {origin}"
        yield f"limits: {text}"


def _one_sided_notes(robot: Robot, joints_of_legs: Sequence[int], limits: dict[int, _Limit]) -> Iterator[str]:
    """Yield a line on motors of legs that are stronger one way than the other in the file."""
    joints = [joint for joint in joints_of_legs if joint in limits and limits[joint].low != -limits[joint].high]
    if joints:
        limit = limits[joints[0]]
        yield (
            f"limits: {len(joints)} motors are stronger one way in the file, such as {robot.joint_name(joints[0])} "
            f"with {limit.low:.4g} to {limit.high:.4g} N m; here they have {limit.torque:.4g} N m both ways"
        )


def _mirror_notes(robot: Robot, joints_of_legs: Sequence[int]) -> Iterator[str]:
    """Yield a line on motors of legs that turn their joints backwards in the file."""
    joints = [drive.joint for drive in find_drives(robot) if drive.gear < 0.0 and drive.joint in joints_of_legs]
    if joints:
        yield (
            f"mirrored: {len(joints)} motors have a gear below 0 in the file, such as {robot.joint_name(joints[0])}; "
            "actions count along the joints' axes"
        )


def _range_notes(robot: Robot, gains_of_file: dict[int, _Gains]) -> Iterator[str]:
    """Yield a line on position actuators whose controls reach less far than their joints."""
    model = robot.model
    joints = []
    for drive in find_drives(robot):
        if drive.joint in gains_of_file and model.actuator_ctrllimited[drive.actuator]:
            low, high = sorted(model.actuator_ctrlrange[drive.actuator] / drive.gear)
            low_limit, high_limit = robot.limits(drive.joint)
            if low > low_limit + _MIN_RANGE_LOSS or high < high_limit - _MIN_RANGE_LOSS:
                joints.append(drive.joint)
    if joints:
        name = robot.joint_name(joints[0])
        yield f"left out: ctrlrange of {len(joints)} position actuators, less than the joint's range, such as {name}"


def _speed_notes(
    robot: Robot, joints_of_legs: Sequence[int], servos: dict[int, Servo], speeds: Mapping[str, float]
) -> Iterator[str]:
    """Yield a line on the speeds of legs' motors that are used, and on those that are placeholders."""
    used = []
    unused = []
    for joint in joints_of_legs:
        speed = speeds.get(robot.joint_name(joint))
        if joint in servos and speed is not None:
            (unused if servos[joint].no_load_speed is None else used).append(speed)
    if used:
        span = format_span(min(used), max(used))
        yield f"speeds: torques of {len(used)} motors fall to 0 at {span} rad/s, from velocity"
    if unused:
        span = format_span(min(unused), max(unused))
        yield f"speeds: {span} rad/s of {len(unused)} motors is a placeholder, torques do not fall with speed"


def _delay_notes(joints_of_legs: Sequence[int], servos: dict[int, Servo]) -> Iterator[str]:
    """Yield a line on the delays of legs' motors."""
    delays = [servos[joint].delay for joint in joints_of_legs if servos[joint].delay]
    if delays:
        yield f"delays: controls of {len(delays)} motors act after {format_span(min(delays), max(delays))} s"


def format_span(low: float, high: float) -> str:
    """Return "low to high", or one number if both read the same."""
    low_text = f"{low:.4g}"
    high_text = f"{high:.4g}"
    if low_text == high_text:
        return low_text
    return f"{low_text} to {high_text}"


def _gain_note(
    joints_of_legs: Sequence[int],
    servos: dict[int, Servo],
    gains_of_file: dict[int, _Gains],
    stiffness: float | None,
    damping: float | None,
) -> str:
    """Return a line on where the gains of the legs' servos come from; gains that a user chose are not None."""
    sized_servos = [servos[joint] for joint in joints_of_legs if joint not in gains_of_file]
    count = len(joints_of_legs) - len(sized_servos)
    if not sized_servos:
        return "gains: all servos have those of the file's position actuators"
    stiffnesses = [servo.stiffness for servo in sized_servos]
    dampings = [servo.damping for servo in sized_servos]
    stiffness_span = format_span(min(stiffnesses), max(stiffnesses))
    damping_span = format_span(min(dampings), max(dampings))
    stiffness_text = f"{'sized' if stiffness is None else 'chosen'} stiffness {stiffness_span} N m/rad"
    damping_text = f"{'sized' if damping is None else 'chosen'} damping {damping_span} N m s/rad"
    count_text = "none in the file"
    if count:
        count_text = f"{count} of {len(joints_of_legs)} servos have those of the file's position actuators, the others"
    return f"gains: {count_text}: {stiffness_text}, {damping_text}"
