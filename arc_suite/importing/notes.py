"""What a user is told of an import, a line each."""

from collections.abc import Iterator, Sequence

import numpy as np

from arc_suite.importing import motors
from arc_suite.importing.naming import Names
from arc_suite.importing.opening import RobotFile
from arc_suite.importing.poses import Stance
from arc_suite.importing.tree import Robot
from arc_suite.models.standing import GRAVITY


def import_notes(robot: Robot, stance: Stance, names: Names, order: Sequence[int]) -> Iterator[str]:
    """Yield the legs, the map of the joints, and the standing pose.

    Args:
        robot: the file's.
        stance: in which it stands.
        names: of its parts.
        order: joints of the legs in the order of the file.
    """
    kinds = sorted({len(leg.joints) for leg in stance.legs})
    yield f"legs: {len(stance.legs)} ({', '.join(names.legs)}), {' or '.join(map(str, kinds))} joints each"
    pairs = ", ".join(f"{robot.name(joint)} {names.joints[joint]}" for joint in order)
    yield f"joints in the file's order, each with its name in the suite: {pairs}"
    places = [stance.joints.index(joint) for joint in order]
    same = places == sorted(places)
    yield f"joint map: {'the file has the order of actions' if same else f'places of the file in an action: {places}'}"
    yield f"standing pose: {stance.origin}, torso {stance.height:.3g} m above the floor"


def omission_notes(file: RobotFile, robot: Robot, stance: Stance, names: Names) -> Iterator[str]:
    """Yield what does not come in, or not as it is in the file."""
    model = file.model
    others = sum(model.body_parentid[body] == 0 for body in range(1, model.nbody)) - 1
    hulls = sorted(
        {file.meshes[geom].name for geom in robot.colliders if geom in file.meshes and not file.meshes[geom].whole}
    )
    if hulls:
        yield f"reduced: {len(hulls)} large meshes to their hulls, such as {hulls[0]}; contacts differ by some digits"
    swims = bool(model.opt.density or model.opt.viscosity)
    counts = {
        "tendons": model.ntendon,
        "equality constraints": model.neq,
        "actuators that are no motors of single joints": model.nu - motors.count_joint_actuators(robot),
        "shapes in a fluid": int(swims * (model.geom_fluid[:, 0] > 0.0).sum()),
        "sensors": model.nsensor,
        "other bodies in the world": others,
    }
    for what, count in counts.items():
        if count:
            yield f"left out: {count} {what}"
    yield "left out: contacts of the robot with itself; looks, as pictures show the colliders"
    wheels = [robot.chains[leg.body][-1] for leg in stance.legs if robot.chains[leg.body][-1] != leg.joints[-1]]
    if wheels:
        yield f"left out: {len(wheels)} wheels, which are held, such as {robot.name(wheels[0])}"
    gravity = float(np.linalg.norm(model.opt.gravity))
    if abs(gravity - GRAVITY) > 0.05 * GRAVITY:
        yield f"units: the file's gravity is {gravity:g}; speeds and times of the tasks count on {GRAVITY:g} m/s^2"
    if names.held:
        shown = ", ".join(robot.name(joint) for joint in names.held[:4])
        yield f"held: {len(names.held)} joints outside of the legs stay in the standing pose ({shown})"
