"""The dynamics of a file itself, against those of what was imported from it."""

import pathlib
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np

from arc_suite.importing import facing, urdf
from arc_suite.robots.spec import Body

STATES = 200
# All that a class of the file would set otherwise.
FLOOR = {"friction": [1.0, 0.5, 0.5], "solref": [0.02, 1.0], "solimp": [0.9, 0.95, 0.001, 0.5, 2.0], "margin": 0.0}
FLOOR |= {"gap": 0.0, "condim": 3, "priority": 0, "solmix": 1.0, "contype": 0, "conaffinity": 1}


def same_bits(path: pathlib.Path, body: Body) -> int:
    """Return in how many random states near the standing pose, on a floor, both have the same accelerations.

    Motors are off, parts of the robot do not touch one another, tendons are out of both, and so are equalities that
    the body has not.

    Args:
        path: of an MJCF, or of a URDF, which is compared as `importing.urdf` repairs it. Its torso may be turned.
        body: as imported from it.
    """
    has_loops = "<equality>" in body.source
    turned = [facing.LEVEL.turn(axis) for axis in ("-x", "y", "-y")]
    best = 0
    for one in (facing.LEVEL, *facing.Y_UP, *turned):
        best = max(best, _same(body, _robot(path, one, has_loops)))
        if best == STATES:
            break
    return best


def _same(body: Body, file: mujoco.MjSpec) -> int:
    ours, theirs = _model(mujoco.MjSpec.from_string(body.source)), _model(file)
    if (ours.nq, ours.nv) != (theirs.nq, theirs.nv):
        return 0
    for joint in file.joints:  # an import adds armature where joints would buzz without it, and tells it
        if joint.armature == 0.0:
            joint.armature = ours.dof_armature[theirs.jnt_dofadr[joint.id]]
    theirs = file.compile()
    home, random = ours.key("home").qpos, np.random.default_rng(0)
    pairs = [(model, mujoco.MjData(model)) for model in (ours, theirs)]
    return sum(_equal(pairs, home, random) for _ in range(STATES))


def _equal(pairs, home: np.ndarray, random: np.random.Generator) -> bool:
    """Return whether models with their data have the same accelerations in a random state."""
    ours = pairs[0][0]
    qpos = home.copy()
    qpos[2] *= random.uniform(0.95, 1.05)
    qpos[7:] += random.uniform(-0.3, 0.3, len(qpos) - 7)
    qvel, torque = random.normal(size=ours.nv), 0.3 * ours.body_mass.sum() * random.normal(size=ours.nv)
    found = []
    for model, data in pairs:
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = qpos, qvel, torque
        mujoco.mj_forward(model, data)
        found.append(data.qacc.copy())
    return np.isfinite(found[0]).all() and np.array_equal(*found)


def _robot(path: pathlib.Path, turned: facing.Facing, has_loops: bool) -> mujoco.MjSpec:
    """Return the file's robot alone, free to move, with its loops if the body has some."""
    if path.suffix == ".urdf":
        cured, *_ = urdf.repair_urdf(ElementTree.parse(path).getroot(), path.parent)
        spec = mujoco.MjSpec.from_string(cured)
    else:
        spec = mujoco.MjSpec.from_file(str(path))
    spec.compile()  # which fuses what is fixed in a URDF
    tops = list(spec.worldbody.bodies)
    root = max(tops, key=lambda top: len(top.find_all("joint")))
    world = [*spec.worldbody.geoms, *(top for top in tops if top is not root)]
    others = (spec.cameras, spec.lights, spec.keys, spec.tendons, spec.pairs, spec.excludes)
    if not has_loops:
        others += (spec.equalities,)
    for element in (*spec.actuators, *spec.sensors, *(one for kind in others for one in kind), *world):
        spec.delete(element)
    if not root.joints:
        root.add_freejoint()
    model = spec.compile()
    facing.turn_torso(spec, model, model.body(root.name).id, turned)
    return spec


def _model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a robot on a floor, without contacts of its parts with one another."""
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = int(bool(geom.contype or geom.conaffinity)), 0
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(name="our floor", type=plane, size=(0.0, 0.0, 1.0), **FLOOR)
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return spec.compile()
