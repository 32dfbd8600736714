"""The kinematic sketch of an imported body: its legs in the torso's frame, as it stands."""

import math

import mujoco
import numpy as np

from arc_suite.importing import tree
from arc_suite.importing.naming import Names
from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import Robot
from arc_suite.robots import spec
from arc_suite.robots.spec import MAX_ALIAS, Foot, Joint, Link, Servo, Solid, Torso, TrackingCamera

_APART = 1e-4  # of the standing height, at least between two joints of a leg: a link has a length
_SHARE = 0.25  # of the foot's radius, of a link that has no collider
_CAMERA = np.array((0.0, -4.0, 1.6))  # by the larger of height and span; that of `sizing`
_ROUND = (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))


def sketch_legs(robot: Robot, stance: Stance, names: Names, servos: dict[int, Servo]) -> tuple[spec.Leg, ...]:
    """Return the legs of the spec, in the order of the file."""
    data = robot.placed(stance.qpos)
    return tuple(
        _leg(robot, stance, data, leg, label, servos) for label, leg in zip(names.legs, stance.legs, strict=True)
    )


def _leg(robot: Robot, stance: Stance, data: mujoco.MjData, leg: Leg, label: str, servos: dict) -> spec.Leg:
    points = _points(data, leg, _APART * stance.height)
    links = []
    for place, joint in enumerate(leg.joints):
        given = _joint(robot, stance, data, joint, f"joint{place + 1}", servos[joint])
        end = _floats(points[place + 1] - points[place])
        links.append(Link(name=f"link{place + 1}", end=end, radius=_radius(robot, leg, joint), joint=given))
    return spec.Leg(name=label, mount=_floats(points[0]), links=tuple(links), foot=Foot(radius=leg.radius))


def _floats(numbers) -> spec.Vector:
    x, y, z = map(float, numbers)
    return x, y, z


def _points(data: mujoco.MjData, leg: Leg, apart: float) -> list[np.ndarray]:
    """Return the anchors of a leg's joints and the foot's center, no two in one place; the foot stays where it is."""
    points = [data.xanchor[joint].copy() for joint in leg.joints] + [leg.center]
    for place in range(len(points) - 2, -1, -1):
        if np.linalg.norm(points[place + 1] - points[place]) < apart:
            points[place] = points[place + 1] + (0.0, 0.0, apart)
    return points


def _joint(robot: Robot, stance: Stance, data: mujoco.MjData, joint: int, name: str, servo: Servo) -> Joint:
    model, dof = robot.model, robot.model.jnt_dofadr[joint]
    home = stance.qpos[robot.place(joint)]
    low, high = (math.degrees(limit - home) for limit in robot.range(joint))
    low, high = max(min(low, 0.0), -180.0), min(max(high, 0.0), 180.0)
    return Joint(
        name=name,
        axis=_floats(data.xaxis[joint]),
        range_deg=(low, high if high > low else low + 1e-3),
        armature=float(model.dof_armature[dof]),
        damping=float(model.dof_damping[dof]),
        servo=servo,
        alias=robot.name(joint)[:MAX_ALIAS],
    )


def _radius(robot: Robot, leg: Leg, joint: int) -> float:
    """Return the radius of a link for pictures: the thinnest of its round colliders, or a share of the foot's."""
    model, body = robot.model, robot.model.jnt_bodyid[joint]
    own = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body and model.geom_type[geom] in _ROUND]
    return min((float(model.geom_size[geom][0]) for geom in own), default=_SHARE * leg.radius)


def sketch_torso(robot: Robot, stance: Stance) -> Torso:
    """Return the torso: one box around its colliders, or around the mounts of its legs if it has none."""
    data = robot.placed(stance.qpos)
    own = [geom for geom in robot.colliders if not robot.chains[int(robot.model.geom_bodyid[geom])]]
    axes = np.eye(3)
    far = [np.diag([tree.support_point(robot.model, data, geom, axis) @ axes for axis in axes]) for geom in own]
    near = [np.diag([tree.support_point(robot.model, data, geom, -axis) @ axes for axis in axes]) for geom in own]
    mounts = [data.xanchor[leg.joints[0]] for leg in stance.legs]
    high, low = np.max(far or mounts, axis=0), np.min(near or mounts, axis=0)
    half = np.maximum(0.5 * (high - low), 0.05 * stance.height)
    trunk = Solid(name="trunk", shape="box", size=_floats(half), position=_floats(0.5 * (high + low)))
    return Torso(standing_height=stance.height, solids=(trunk,))


def sketch_camera(stance: Stance) -> TrackingCamera:
    """Return a camera from which all feet are seen."""
    size = max(*(abs(leg.center[:2]).max() for leg in stance.legs), stance.height)
    return TrackingCamera(position=_floats(size * _CAMERA))
