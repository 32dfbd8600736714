"""The kinematic sketch of an imported body: its legs in the torso's frame, as it stands."""

import math
from collections.abc import Mapping

import mujoco
import numpy as np

from arc_suite.importing import tree
from arc_suite.importing.naming import Names
from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import Robot
from arc_suite.robots import spec
from arc_suite.robots.spec import MAX_ALIAS, Foot, Joint, Link, Servo, Solid, Torso, TrackingCamera

_MIN_LINK_LENGTH = 1e-4  # standing heights
_MIN_HALF_EXTENT = 0.05  # standing heights, of the torso's box
_MIN_RANGE = 1e-3  # degrees
_RADIUS_SHARE = 0.25  # radius of a link without a collider, in radii of the foot
_CAMERA_OFFSET = np.array((0.0, -4.0, 1.6))  # in the larger of height and span; the same as in `models.sizing`
_ROUND_SHAPES = (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))


def sketch_legs(robot: Robot, stance: Stance, names: Names, servos: Mapping[int, Servo]) -> tuple[spec.Leg, ...]:
    """Return the legs of the spec, in the order of the file.

    Args:
        robot: robot of the file.
        stance: stance in which it stands.
        names: names of its parts.
        servos: by joint.
    """
    data = robot.forward_kinematics(stance.qpos)
    return tuple(
        _sketch_leg(robot, stance, data, leg, label, servos) for label, leg in zip(names.legs, stance.legs, strict=True)
    )


def _sketch_leg(
    robot: Robot, stance: Stance, data: mujoco.MjData, leg: Leg, label: str, servos: Mapping[int, Servo]
) -> spec.Leg:
    points = _leg_points(data, leg, _MIN_LINK_LENGTH * stance.height)
    links = []
    for index, joint in enumerate(leg.joints):
        link = Link(
            name=f"link{index + 1}",
            end=_to_vector(points[index + 1] - points[index]),
            radius=_link_radius(robot, leg, joint),
            joint=_sketch_joint(robot, stance, data, joint, f"joint{index + 1}", servos[joint]),
        )
        links.append(link)
    return spec.Leg(name=label, mount=_to_vector(points[0]), links=tuple(links), foot=Foot(radius=leg.radius))


def _to_vector(numbers) -> spec.Vector:
    x, y, z = map(float, numbers)
    return x, y, z


def _leg_points(data: mujoco.MjData, leg: Leg, min_length: float) -> list[np.ndarray]:
    """Return the anchors of a leg's joints and the foot's center (3,), m.

    Where two of them are nearer than a minimum length, m, the one nearer to the torso is moved up. The foot stays.
    """
    points = [data.xanchor[joint].copy() for joint in leg.joints]
    points.append(leg.center)
    for index in reversed(range(len(leg.joints))):
        next_point = points[index + 1]
        if np.linalg.norm(next_point - points[index]) < min_length:
            points[index] = next_point + (0.0, 0.0, min_length)
    return points


def _sketch_joint(robot: Robot, stance: Stance, data: mujoco.MjData, joint: int, name: str, servo: Servo) -> Joint:
    """Return a joint of the spec, whose angle is 0 in the standing pose."""
    model = robot.model
    dof = model.jnt_dofadr[joint]
    standing_angle = stance.qpos[robot.qpos_index(joint)]  # rad
    low_limit, high_limit = robot.limits(joint)
    low = max(min(math.degrees(low_limit - standing_angle), 0.0), -180.0)
    high = min(max(math.degrees(high_limit - standing_angle), 0.0), 180.0)
    if high <= low:
        high = low + _MIN_RANGE
    return Joint(
        name=name,
        axis=_to_vector(data.xaxis[joint]),
        range_deg=(low, high),
        armature=float(model.dof_armature[dof]),
        damping=float(model.dof_damping[dof]),
        servo=servo,
        alias=robot.joint_name(joint)[:MAX_ALIAS],
    )


def _link_radius(robot: Robot, leg: Leg, joint: int) -> float:
    """Return the radius of a link for pictures: the thinnest of its round colliders, or a share of the foot's."""
    model = robot.model
    body = model.jnt_bodyid[joint]
    colliders_of_link = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body]
    radii = [float(model.geom_size[geom][0]) for geom in colliders_of_link if model.geom_type[geom] in _ROUND_SHAPES]
    return min(radii, default=_RADIUS_SHARE * leg.radius)


def sketch_torso(robot: Robot, stance: Stance) -> Torso:
    """Return the torso: one box around its colliders, or around the mounts of its legs if it has none."""
    data = robot.forward_kinematics(stance.qpos)
    bodies = robot.model.geom_bodyid
    torso_colliders = [geom for geom in robot.colliders if not robot.lineage(int(bodies[geom]))]
    if torso_colliders:
        high_points = [_geom_bounds(robot, data, geom, side=1.0) for geom in torso_colliders]
        low_points = [_geom_bounds(robot, data, geom, side=-1.0) for geom in torso_colliders]
    else:
        high_points = [data.xanchor[leg.joints[0]] for leg in stance.legs]
        low_points = high_points
    high = np.max(high_points, axis=0)
    low = np.min(low_points, axis=0)
    half_extents = np.maximum(0.5 * (high - low), _MIN_HALF_EXTENT * stance.height)
    center = 0.5 * (high + low)
    trunk = Solid(name="trunk", shape="box", size=_to_vector(half_extents), position=_to_vector(center))
    return Torso(standing_height=stance.height, solids=(trunk,))


def _geom_bounds(robot: Robot, data: mujoco.MjData, geom: int, side: float) -> np.ndarray:
    """Return the highest coordinates (3,) of a geom, m, or with a side of -1 the lowest ones."""
    axes = np.eye(3)
    support_points = [tree.support_point(robot.model, data, geom, side * axis) @ axes for axis in axes]
    return np.diag(support_points)


def sketch_camera(stance: Stance) -> TrackingCamera:
    """Return a camera from which all feet are seen."""
    span = max(abs(leg.center[:2]).max() for leg in stance.legs)
    size = max(span, stance.height)
    return TrackingCamera(position=_to_vector(size * _CAMERA_OFFSET))
