"""Which chains of a robot are legs, and the pose in which it stands on them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import checks
from arc_suite.importing import candidates, home_angles, kinds, loops, tree
from arc_suite.importing.candidates import ChainEnd
from arc_suite.importing.tree import Chain, Robot
from arc_suite.models.standing import stability_margin
from arc_suite.robots.spec import SpecError

# Checks of a pose, in standing heights.
_MAX_FOOT_DIFFERENCE = 0.15  # in height, between feet on the floor
_MAX_CHAIN_DEPTH = 0.5  # of the end of a chain that is no leg; a lower one is a leg that hangs
_MIN_MARGIN = 0.02  # of the center of mass inside of three or more feet
_MAX_OVERHANG = 0.15  # of the center of mass from the line between two feet, which may be long
_MIN_THIGH = 0.2  # a leg with a shorter thigh does not count as straight
_MAX_STRAIGHTNESS = 0.96  # distance from hip to sole, as a share of thigh and shank
_MAX_REASONS = 2  # of poses that do not stand, in one line
_LIMIT_TOLERANCE = 1e-6  # rad or m, by which a joint may be out of its range

# Shapes of feet.
_MAX_FOOT_RADIUS = 0.05  # standing heights, of a foot that is neither sphere nor capsule
_CONTACT_HEIGHT = 0.01  # standing heights: shapes of a foot that are at most so much higher touch the floor, too
_SOLE_TILT = 0.05  # rad, of the directions in which the sole of a flat foot is measured
_SOLE_DIRECTIONS = 16

# Wheels.
_MAX_HUB_OFFSET = 0.1  # of the wheel's radius, between its joint and its middle
_MAX_WHEEL_AXIS_RISE = 0.5  # vertical part of a wheel's axis, a unit vector

# Integers, since numpy's integers are not found in a tuple of MuJoCo's enumerations.
_SPHERE = int(mujoco.mjtGeom.mjGEOM_SPHERE)
_ROUND_SHAPES = (_SPHERE, int(mujoco.mjtGeom.mjGEOM_CAPSULE))


class Leg(NamedTuple):
    """A leg of a robot in its standing pose, in the torso's frame.

    Attributes:
        joints: joints of the leg alone, from the torso outwards.
        body: the last link.
        geom: the foot's collider.
        sole: (3,) the lowest point.
        center: (3,) center of the foot, as a ball that touches the floor at the sole.
        radius: radius of that ball, m.
    """

    joints: tuple[int, ...]
    body: int
    geom: int
    sole: np.ndarray
    center: np.ndarray
    radius: float


class Stance(NamedTuple):
    """A standing pose.

    Attributes:
        qpos: (nq,) qpos of the file's model, with the torso's frame as the world's.
        legs: in the order of the file.
        height: height of the torso's origin above the lowest sole, m.
        origin: where the pose comes from, in words.
    """

    qpos: np.ndarray
    legs: tuple[Leg, ...]
    height: float
    origin: str

    @property
    def joints(self) -> list[int]:
        """Return the legs' joints, in the order of the action."""
        return [joint for leg in self.legs for joint in leg.joints]


class NoStance(SpecError):
    """No pose in which a robot stands."""


class _Unfit(Exception):
    """A pose in which the robot does not stand; the message says why."""


def find_stance(robot: Robot, home: str | None, feet: Sequence[str]) -> Stance:
    """Return the pose in which a robot stands.

    The first of keyframes, zero angles, a search for bent knees, and the middles of the ranges in which all feet
    reach the floor, with the center of mass inside them and no straight legs.

    Args:
        robot: robot of the file.
        home: name of a keyframe or angles of joints, which are then taken without checks; None to find a pose.
        feet: names of bodies or geoms at the ends of the legs; none to find them.

    Raises:
        NoStance: no pose stands.
        SpecError: a name is not in the file, or the pose of `home` has no legs.
    """
    named_feet = _find_named_feet(robot, feet) if feet else None
    if home is not None:
        return _stance_of_home(robot, home, named_feet)
    # Straight legs are better than none: a second round admits them.
    origins_by_reason: dict[str, str] = {}
    tried_poses = []
    for origin, qpos in candidates.list_poses(robot, named_feet):
        try:
            return _stance_of_pose(robot, qpos, origin, named_feet)
        except _Unfit as reason:
            origins_by_reason.setdefault(str(reason), origin)
        tried_poses.append((origin, qpos))
    for origin, qpos in tried_poses:
        try:
            return _stance_of_pose(robot, qpos, origin, named_feet, admits_straight_legs=True)
        except _Unfit as reason:
            origins_by_reason.setdefault(str(reason), origin)
    reasons = [f"{origin}: {reason}" for reason, origin in origins_by_reason.items()]
    chains = kinds.describe_chains(robot.model, robot.root)
    cure = "name a keyframe that stands, or give its angles, with --home, or the feet with --feet"
    raise NoStance(f"{chains}, and no standing pose ({'; '.join(reasons[:_MAX_REASONS])}); {cure}")


def _stance_of_home(robot: Robot, home: str, named_feet: dict[Chain, list[int]] | None) -> Stance:
    """Return the stance of a keyframe or of angles, without checks except that it has legs."""
    keyframes = [robot.model.key(key).name for key in range(robot.model.nkey)]
    if home not in keyframes and home_angles.is_angles(home):
        origin = "angles of --home"
        qpos = home_angles.pose_of_angles(robot, home)
    elif any(keyframes):
        origin = f"keyframe {home}"
        key = keyframes.index(_check_name(home, keyframes, "keyframe"))
        qpos = robot.model.key_qpos[key]
    else:
        raise SpecError(
            f"keyframe {checks.preview(home)}: the file names none; --home takes angles, too, such as knee=-1.4,hip=0; "
            "without --home a standing pose is found"
        )
    try:
        return _stance_of_pose(robot, qpos, origin, named_feet, is_checked=False)
    except _Unfit as reason:
        raise SpecError(f"{origin}: {reason}") from None


def _check_name(name: str, valid_names: Sequence[str], kind: str) -> str:
    """Return a name that is one of the valid ones; parts without a name do not count."""
    try:
        return checks.name(name, [valid_name for valid_name in valid_names if valid_name], kind)
    except ValueError as error:
        raise SpecError(str(error)) from None


def _find_named_feet(robot: Robot, feet: Sequence[str]) -> dict[Chain, list[int]]:
    """Return the colliders of feet that are named by body or geom, by the chain that leads to them."""
    model = robot.model
    geoms_by_name = {model.geom(geom).name: [geom] for geom in robot.colliders}
    for body in robot.bodies[1:]:
        body_colliders = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body]
        if body_colliders:
            geoms_by_name[model.body(body).name] = body_colliders
    foot_colliders: dict[Chain, list[int]] = {}
    for foot in feet:
        geoms = geoms_by_name[_check_name(foot, list(geoms_by_name), "foot")]
        chain = robot.chain_of_geom(geoms[0])
        if not chain:
            raise SpecError(f"foot {foot!r}: no joint lies between it and the torso")
        geoms_of_chain = foot_colliders.setdefault(chain, [])
        geoms_of_chain.extend(geom for geom in geoms if geom not in geoms_of_chain)
    return foot_colliders


def _stance_of_pose(
    robot: Robot,
    qpos: np.ndarray,
    origin: str,
    named_feet: dict[Chain, list[int]] | None,
    admits_straight_legs: bool = False,
    is_checked: bool = True,
) -> Stance:
    """Return the stance of a pose.

    Args:
        robot: robot of the file.
        qpos: (nq,) the pose.
        origin: where it comes from.
        named_feet: colliders of feet that the user names, by chain; None to find them.
        admits_straight_legs: whether legs may be straight.
        is_checked: whether the robot must stand; otherwise it needs legs alone.

    Raises:
        _Unfit: the robot does not stand in it, or has no legs.
    """
    qpos, is_closed = loops.close(robot, qpos)
    if is_checked:
        _check_limits(robot, qpos)
        if not is_closed:
            raise _Unfit("its loops do not close")
    data = robot.forward_kinematics(qpos)
    foot_colliders = robot.end_colliders() if named_feet is None else named_feet
    ends = {}
    for chain, geoms in foot_colliders.items():
        if chain:
            ends[chain] = ChainEnd(*tree.lowest_point(robot, data, geoms))
    if not ends:
        raise _Unfit("no chain of joints ends in a collider")
    height = -min(end.point[2] for end in ends.values())
    if height <= 0.0:
        raise _Unfit("no foot is below the torso")
    if named_feet is None:
        highest_foot = -(1.0 - _MAX_FOOT_DIFFERENCE) * height
        low_ends = {chain: end for chain, end in ends.items() if end.point[2] < highest_foot}
    else:
        low_ends = ends
    legs = _find_legs(robot, data, foot_colliders, low_ends, height)
    if is_checked:
        _check_feet(robot, ends, legs, height)
        _check_torso(robot, data, legs, height)
        if not admits_straight_legs:
            _check_knees(data, legs, height)
    return Stance(data.qpos.copy(), legs, float(height), origin)


def _find_legs(
    robot: Robot,
    data: mujoco.MjData,
    foot_colliders: Mapping[Chain, list[int]],
    low_ends: Mapping[Chain, ChainEnd],
    height: float,
) -> tuple[Leg, ...]:
    """Return the legs of chains that end low; joints of several chains, and of wheels, belong to none."""
    legs = []
    for chain, end in sorted(low_ends.items(), key=lambda item: item[0]):
        joints_of_other_chains = {joint for other_chain in low_ends if other_chain != chain for joint in other_chain}
        joints = tuple(joint for joint in chain if joint not in joints_of_other_chains)
        if joints and _is_wheel(robot, data, joints[-1], end):
            joints = joints[:-1]
        if not joints:
            raise _Unfit(f"joint {robot.joint_name(chain[-1])} turns a wheel or several feet")
        body = int(robot.model.geom_bodyid[end.geom])
        sole, radius = _measure_sole(robot, data, foot_colliders[chain], height)
        legs.append(Leg(joints, body, end.geom, sole, center=sole + (0.0, 0.0, radius), radius=radius))
    if len(legs) < 2:
        raise _Unfit(f"{len(legs)} foot on the floor")
    return tuple(legs)


def _is_wheel(robot: Robot, data: mujoco.MjData, joint: int, end: ChainEnd) -> bool:
    """Return whether a joint turns a foot without end about the foot's own middle."""
    low, high = robot.limits(joint)
    axis = data.xaxis[joint]
    anchor = data.xanchor[joint]
    hub_offset = np.linalg.norm(np.cross(axis, data.geom_xpos[end.geom] - anchor))
    wheel_radius = np.linalg.norm(np.cross(axis, end.point - anchor))
    turns_without_end = high - low > candidates.MIN_WHEEL_RANGE
    is_axis_level = abs(axis[2]) < _MAX_WHEEL_AXIS_RISE
    return bool(turns_without_end and is_axis_level and hub_offset < _MAX_HUB_OFFSET * wheel_radius)


def _measure_sole(robot: Robot, data: mujoco.MjData, geoms: Sequence[int], height: float) -> tuple[np.ndarray, float]:
    """Return the middle (3,) of what touches the floor, and the radius of a ball in its place, m."""
    model = robot.model
    lowest, lowest_geom = tree.lowest_point(robot, data, geoms)
    contact_height = lowest[2] + _CONTACT_HEIGHT * height
    touching_geoms = [geom for geom in geoms if tree.lowest_point(robot, data, [geom])[0][2] < contact_height]
    shape = model.geom_type[lowest_geom]
    radius = float(model.geom_size[lowest_geom][0])
    if shape == _SPHERE and len(touching_geoms) == 1:
        return lowest, radius

    azimuths = np.linspace(0.0, 2.0 * np.pi, _SOLE_DIRECTIONS, endpoint=False)
    downwards = np.full(_SOLE_DIRECTIONS, -1.0)
    directions = np.stack((_SOLE_TILT * np.cos(azimuths), _SOLE_TILT * np.sin(azimuths), downwards), axis=1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = [tree.support_point(model, data, geom, direction) for direction in directions for geom in touching_geoms]
    floor_points = np.array(points)[:, :2]
    middle = 0.5 * (floor_points.max(axis=0) + floor_points.min(axis=0))
    sole = np.array((*middle, lowest[2]))
    if shape in _ROUND_SHAPES:
        return sole, radius
    half_height = 0.5 * (tree.support_point(model, data, lowest_geom, -tree.DOWN)[2] - lowest[2])
    return sole, float(min(half_height, _MAX_FOOT_RADIUS * height))


def _check_limits(robot: Robot, qpos: np.ndarray) -> None:
    """Refuse joints out of their ranges."""
    for joint in robot.joints:
        low, high = robot.limits(joint)
        if not low - _LIMIT_TOLERANCE <= qpos[robot.qpos_index(joint)] <= high + _LIMIT_TOLERANCE:
            raise _Unfit(f"joint {robot.joint_name(joint)} is out of its range")


def _check_feet(robot: Robot, ends: Mapping[Chain, ChainEnd], legs: tuple[Leg, ...], height: float) -> None:
    """Refuse feet that hang above the floor."""
    foot_geoms = {leg.geom for leg in legs}
    for chain, end in ends.items():
        if end.geom not in foot_geoms and end.point[2] < -_MAX_CHAIN_DEPTH * height:
            name = robot.joint_name(chain[-1])
            raise _Unfit(f"the chain of {name} ends {height + end.point[2]:.3g} m above the floor")
    highest_foot = max(leg.sole[2] for leg in legs) + height  # m above the floor
    if highest_foot > _MAX_FOOT_DIFFERENCE * height:
        raise _Unfit(f"a foot hangs {highest_foot:.3g} m above the floor")


def _check_torso(robot: Robot, data: mujoco.MjData, legs: tuple[Leg, ...], height: float) -> None:
    """Refuse a torso or an arm below the feet, and a center of mass outside of the feet."""
    leg_joints = {joint for leg in legs for joint in leg.joints}
    other_geoms = [geom for geom in robot.colliders if not leg_joints.intersection(robot.chain_of_geom(geom))]
    if other_geoms:
        lowest, _ = tree.lowest_point(robot, data, other_geoms)
        if lowest[2] < -height:
            raise _Unfit("the torso is lower than the feet")
    margin = stability_margin(data.subtree_com[robot.root], [leg.sole for leg in legs])
    min_margin = _MIN_MARGIN if len(legs) > 2 else -_MAX_OVERHANG
    if margin < min_margin * height:
        raise _Unfit(f"the center of mass is {margin:.3g} m inside of the feet")


def _check_knees(data: mujoco.MjData, legs: tuple[Leg, ...], height: float) -> None:
    """Refuse straight legs."""
    for leg in legs:
        if len(leg.joints) < 2:
            continue
        hip, knee = (data.xanchor[joint] for joint in leg.joints[-2:])
        thigh = np.linalg.norm(knee - hip)
        shank = np.linalg.norm(leg.sole - knee)
        is_straight = np.linalg.norm(leg.sole - hip) > _MAX_STRAIGHTNESS * (thigh + shank)
        if thigh > _MIN_THIGH * height and is_straight:
            raise _Unfit("the legs are straight")
