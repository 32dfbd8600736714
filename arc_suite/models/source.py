"""Models of imported bodies: their source, edited by MuJoCo's `MjSpec` and never rebuilt.

A source is MJCF of one free body `torso` alone, whose parts and joints have the names of the body's legs. It stays
the record of the physics. Servos, cameras and a sensor are added, and the ground.
"""

import functools
from typing import Any

import mujoco
import numpy as np
from dm_control import mjcf

from arc_suite.arenas import Arena
from arc_suite.models import builder, visuals
from arc_suite.models.visuals import scene
from arc_suite.robots.spec import Body, Servo, SpecError

HOME = "home"  # keyframe of the standing pose

# Of elements of the ground and of its looks, by the list of a spec that has them: all that a default class of the
# source could change is among them.
_FIELDS = {
    "hfields": ("name", "size", "nrow", "ncol", "userdata"),
    "textures": ("name", "type", "builtin", "mark", "width", "height", "rgb1", "rgb2", "markrgb"),
    "materials": ("name", "textures", "texuniform", "texrepeat", "emission", "specular", "shininess", "rgba"),
}
_GEOM = ("name", "type", "size", "pos", "quat", "hfieldname", "material", "rgba", "group", "mass", "density")
_TOUCH = ("contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp", "margin", "gap")
_LIGHT = ("name", "mode", "type", "castshadow", "pos", "dir", "diffuse", "specular")

_MATERIAL_ALONE = (0.5, 0.5, 0.5, 1.0)  # colour of a geom that has that of its material

_MOTOR = {"trntype": mujoco.mjtTrn.mjTRN_JOINT, "ctrllimited": mujoco.mjtLimited.mjLIMITED_TRUE}
_AFFINE = mujoco.mjtGain.mjGAIN_AFFINE, mujoco.mjtBias.mjBIAS_AFFINE


def parsed(body: Body, arena: Arena | None = None, decorated: bool = False) -> mujoco.MjSpec:
    """Return the spec of an imported body's model.

    Args:
        body: with a source.
        arena: where it moves; None for nowhere.
        decorated: whether it has looks; colliders are what is seen.

    Raises:
        SpecError: a source that MuJoCo cannot read, or that lacks a part of the body.
    """
    spec, home = read(body), angles_at_home(body)
    spec.modelname = body.name
    spec.option.timestep = body.simulation.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    torso = spec.body("torso")
    for leg in body.legs:
        for joint in leg.joints:
            reach = np.radians(np.abs(joint.range_deg)).max()
            _add_servo(spec, leg.full_name(joint), joint.servo, home[leg.full_name(joint)], reach)
    for joint in body.held:
        _add_servo(spec, joint.name, joint.servo, home[joint.name], 0.0)
    for name, camera in builder.cameras(body).items():
        torso.add_camera(name=name, mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM, **camera)
    acceleration = {"type": mujoco.mjtSensor.mjSENS_ACCELEROMETER, "objtype": mujoco.mjtObj.mjOBJ_SITE}
    spec.add_sensor(name="torso_acceleration", objname="torso", **acceleration)
    if decorated:
        _show_colliders(spec, body)
    if arena is not None:
        _add_ground(spec, body, arena, decorated)
    return spec


def read(body: Body) -> mujoco.MjSpec:
    """Return the spec of a source as it is.

    Raises:
        SpecError: MuJoCo cannot read it.
    """
    try:
        return mujoco.MjSpec.from_string(body.source)
    except ValueError as error:
        raise _refused(body, error) from None


@functools.lru_cache(maxsize=64)
def bare(body: Body) -> mujoco.MjModel:
    """Return the compiled model of a source as it is, whose keyframe is the standing pose.

    Raises:
        SpecError: MuJoCo cannot compile it, or it lacks the keyframe, a part or a joint of the body.
    """
    try:
        model = read(body).compile()
        model.key(HOME)
        for name in body.part_names:
            model.body(name)
        for name in (*body.joint_names, *(joint.name for joint in body.held)):
            model.joint(name)
    except (ValueError, KeyError) as error:
        raise _refused(body, error) from None
    return model


def angles_at_home(body: Body) -> dict[str, float]:
    """Return the positions of a source's joints in the standing pose by name: rad, or m of a slide."""
    model = bare(body)
    hinges = (joint for joint in range(model.njnt) if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE)
    return {model.joint(joint).name: float(model.key(HOME).qpos[model.jnt_qposadr[joint]]) for joint in hinges}


def _refused(body: Body, error: Exception) -> SpecError:
    return SpecError(" ".join(str(error).split())[:200], "source", f"Body({body.name})")


def _add_servo(spec: mujoco.MjSpec, name: str, servo: Servo, home: float, reach: float) -> None:
    """Add a servo that holds a joint at `home` for a control of 0, and `reach` away from it for 1, rad."""
    added = spec.add_actuator(name=name, target=name, ctrlrange=(-1.0, 1.0), **_MOTOR)
    added.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    added.gainprm[0] = servo.stiffness * reach
    added.biasprm[:3] = servo.stiffness * home, -servo.stiffness, -servo.damping
    joint = spec.joint(name)  # the sum of what acts on a joint is limited
    joint.actfrclimited, joint.actfrcrange = mujoco.mjtLimited.mjLIMITED_TRUE, (-servo.limit, servo.limit)


def add_releases(spec: mujoco.MjSpec, body: Body) -> None:
    """Add to each servo of a leg a motor that takes a share of its torque away, so that joints can weaken or hang.

    Servos of legs come first, then their releases in the same order, then the servos of held joints.

    The servo's torque is k (reach u + home - q) - d v for a control u. That of its release is -r (k (home - q) - d v)
    for a control r. With controls s u and 1 - s a joint has the share s of its torque.
    """
    for name in body.joint_names:
        servo = spec.actuator(name)
        added = spec.add_actuator(name=f"{name}-release", target=name, ctrlrange=(0.0, 1.0), **_MOTOR)
        added.gaintype = mujoco.mjtGain.mjGAIN_AFFINE
        added.gainprm[:3] = -servo.biasprm[:3]
    home = angles_at_home(body)
    for joint in body.held:
        spec.delete(spec.actuator(joint.name))
        _add_servo(spec, joint.name, joint.servo, home[joint.name], 0.0)


def _add_ground(spec: mujoco.MjSpec, body: Body, arena: Arena, decorated: bool) -> None:
    root = mjcf.RootElement(model="ground")
    root.compiler.angle = "radian"
    root.worldbody.add("body", name="torso")  # which lights ride on
    arena.add_to(root, **builder.contact(body.simulation))
    if decorated:
        scene.add_scene(root, body.torso.standing_height)
        visuals.add_materials(root, body)
    ground = mujoco.MjSpec.from_string(root.to_xml_string())
    for kind, fields in _FIELDS.items():
        for element in getattr(ground, kind):
            _copy(element, getattr(spec, f"add_{kind.removesuffix('s')}")(), fields)
    for each in ground.worldbody.geoms:
        _copy(each, spec.worldbody.add_geom(), (*_GEOM, *_TOUCH))
    for obstacle in ground.worldbody.bodies:
        if obstacle.name == "torso":
            for light in obstacle.lights:
                _copy(light, spec.body("torso").add_light(), _LIGHT)
            continue
        added = spec.worldbody.add_body()
        _copy(obstacle, added, ("name", "mocap", "pos", "quat"))
        for each in obstacle.geoms:
            _copy(each, added.add_geom(), (*_GEOM, *_TOUCH))
    if decorated:
        for part in ("global_", "quality", "map", "rgba", "headlight"):
            setattr(spec.visual, part, getattr(ground.visual, part))
        spec.stat.extent, spec.stat.center = ground.stat.extent, ground.stat.center


def _copy(old: Any, new: Any, fields: tuple[str, ...]) -> None:
    for field in fields:
        setattr(new, field, getattr(old, field))


def _show_colliders(spec: mujoco.MjSpec, body: Body) -> None:
    """Give the colliders materials, and the feet spheres that can show a reward."""
    torso = {"torso"}
    for part in spec.bodies:
        for geom in part.geoms:
            geom.material, geom.group, geom.rgba = "shell" if part.name in torso else "limb", 0, _MATERIAL_ALONE
    for leg, name in zip(body.legs, body.foot_names, strict=True):
        ball = spec.body(name).add_geom(name=f"visual-{name}", type=mujoco.mjtGeom.mjGEOM_SPHERE, material="glow")
        ball.size[0], ball.mass, ball.group, ball.contype, ball.conaffinity = 1.04 * leg.foot.radius, 0.0, 2, 0, 0
