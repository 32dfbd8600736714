"""Notes for the user of an import, a line each."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from arc_suite import checks
from arc_suite.importing import drives, loops, mesh_colors, trunk, visual_meshes
from arc_suite.importing.motors import format_span
from arc_suite.importing.naming import Names
from arc_suite.importing.opening import RobotFile
from arc_suite.importing.poses import Stance
from arc_suite.importing.tree import Robot, colliding_geoms
from arc_suite.models.standing import GRAVITY

_MAX_GRAVITY_DIFFERENCE = 0.05  # of the suite's gravity, without a note
_BIPED = ": a biped, which no demonstrator walks"
_MAX_SLOPE = 0.01  # degrees, of a floor that counts as level


def import_notes(robot: Robot, stance: Stance, names: Names, order: Sequence[int]) -> Iterator[str]:
    """Yield notes on the legs, the map of the joints, and the standing pose.

    Args:
        robot: robot of the file.
        stance: stance in which it stands.
        names: names of its parts.
        order: joints of the legs in the order of the file.
    """
    joint_counts = sorted({len(leg.joints) for leg in stance.legs})
    counts_text = " or ".join(map(str, joint_counts))
    kind = _BIPED if len(stance.legs) == 2 else ""
    noun = "joint" if joint_counts == [1] else "joints"
    yield f"legs: {len(stance.legs)} ({', '.join(names.legs)}), {counts_text} {noun} each{kind}"
    pairs = ", ".join(f"{robot.joint_name(joint)} {names.joints[joint]}" for joint in order)
    yield f"joints in the file's order, each with its name in the suite: {pairs}"
    action_indices = [stance.joints.index(joint) for joint in order]
    if action_indices == sorted(action_indices):
        yield "joint map: the file has the order of actions"
    else:
        yield f"joint map: places of the file in an action: {action_indices}"
    yield f"standing pose: {stance.origin}, torso {stance.height:.3g} m above the floor"
    yield from trunk.placement_notes(robot)


def resistance_notes(robot: Robot, stance: Stance) -> Iterator[str]:
    """Yield notes on the damping, friction and springs of the legs' joints, which are those of the file."""
    model = robot.model
    dofs = model.jnt_dofadr[list(stance.joints)]
    count = len(dofs)
    damping = _span_above_zero(model.dof_damping[dofs], "N m s/rad")
    friction = _span_above_zero(model.dof_frictionloss[dofs], "N m")
    springs = _span_above_zero(model.jnt_stiffness[list(stance.joints)], "N m/rad")
    if damping:
        yield f"joint damping: that of the file, {damping} of {count} joints; servos damp in addition"
    elif not model.dof_dampingpoly[dofs].any():
        yield "joint damping: none in the file; servos alone damp"
    yield (
        f"joint friction: that of the file, {friction} of {count} joints"
        if friction
        else "joint friction: none in the file"
    )
    if springs:
        yield f"joint springs: those of the file, {springs} of {count} joints"
    torso_damping = model.dof_damping[model.jnt_dofadr[model.body_jntadr[robot.root]]]
    if torso_damping:
        yield f"torso damping: the file resists its movement by {torso_damping:.4g} N s/m, kept"


def _span_above_zero(values: np.ndarray, unit: str) -> str:
    """Return the range of the values (n,) above 0, and their count, such as "0.1 N m at 4"; "" if there are none."""
    positive = values[values > 0.0]
    if not len(positive):
        return ""
    return f"{format_span(positive.min(), positive.max())} {unit} at {len(positive)}"


def omission_notes(file: RobotFile, robot: Robot, stance: Stance, names: Names) -> Iterator[str]:
    """Yield notes on what is left out, or is not as in the file."""
    model = file.model
    hulls = _reduced_meshes(file, robot)
    if hulls:
        yield f"reduced: {len(hulls)} large meshes to their hulls, such as {hulls[0]}; contacts differ by some digits"
    for kind, count in _omission_counts(file, robot, stance).items():
        if count:
            yield f"left out: {count} {kind}"
    bodies_with_visuals = file.visuals.bodies
    shown_colliders = [geom for geom in robot.colliders if int(model.geom_bodyid[geom]) not in bodies_with_visuals]
    colored_colliders = sum(mesh_colors.is_color(model.geom_rgba[geom]) for geom in shown_colliders)
    yield visual_meshes.describe_visuals(file.visuals, file.colored_shapes, colored_colliders)
    yield "left out: contacts of the robot with itself"
    yield from _world_notes(robot)
    wheels = _find_wheels(robot, stance)
    if wheels:
        yield f"left out: {len(wheels)} wheels, which are held, such as {robot.joint_name(wheels[0])}"
    gravity = float(np.linalg.norm(model.opt.gravity))
    if abs(gravity - GRAVITY) > _MAX_GRAVITY_DIFFERENCE * GRAVITY:
        yield f"units: the file's gravity is {gravity:g}; speeds and times of the tasks count on {GRAVITY:g} m/s^2"
    yield from _loop_notes(file, robot, stance)
    if names.held:
        held_names = _name_joints(robot, names.held)
        yield f"held: {len(names.held)} joints outside of the legs stay in the standing pose ({held_names})"


def _loop_notes(file: RobotFile, robot: Robot, stance: Stance) -> Iterator[str]:
    """Yield notes on closed loops, on joints that follow others, and on joints without a motor."""
    closed_loops = [loop for loop in robot.loops if loop.follower is None]
    followers = [loop.follower for loop in robot.loops if loop.follower is not None]
    if closed_loops:
        yield f"kept: {len(closed_loops)} closed loops, such as of {loops.name_parts(robot, closed_loops[0])}"
    if followers:
        yield f"kept: {len(followers)} joints follow others ({_name_joints(robot, followers)})"
    freed = sorted(loops.followers_in_legs(robot, stance.joints))
    if freed:
        yield f"motors: {len(freed)} joints of legs follow others in the file, not here ({_name_joints(robot, freed)})"
    passive = [joint for joint in robot.passive if joint not in followers]
    if passive:
        yield _passive_note(file, robot, stance, passive)


def _passive_note(file: RobotFile, robot: Robot, stance: Stance, passive: Sequence[int]) -> str:
    """Return a note on joints without a motor, with the cure where most joints of the legs are among them."""
    names_text = _name_joints(robot, passive)
    note = f"passive: {len(passive)} joints without a motor keep their springs and damping ({names_text})"
    joints_to_feet = {joint for leg in stance.legs for joint in robot.lineage(leg.body)}
    if len(joints_to_feet.intersection(passive)) <= len(stance.joints):
        return note
    cure = "add an actuator for each joint that has a motor"
    if file.is_urdf:
        cure = (
            "add a transmission for each joint that has a motor, or remove all of them; an effort of 0 means no motor"
        )
    return f"{note}: most joints of the legs; {cure}"


def _name_joints(robot: Robot, joints: Sequence[int]) -> str:
    """Return the names of the first joints."""
    return checks.join_first([robot.joint_name(joint) for joint in joints])


def _world_notes(robot: Robot) -> Iterator[str]:
    """Yield notes on floors that slope, on other shapes of the world, and on drag in a fluid."""
    model = robot.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shapes = [geom for geom in colliding_geoms(model) if model.geom_bodyid[geom] == 0]
    planes = [geom for geom in shapes if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE]
    vertical = -model.opt.gravity / np.linalg.norm(model.opt.gravity)
    normals = data.geom_xmat[planes].reshape(-1, 3, 3)[..., 2]
    slopes = np.degrees(np.arccos((normals @ vertical).clip(-1.0, 1.0)))
    floors = 1 if len(planes) else 0  # the most level plane; others are walls
    if floors and slopes.min() > _MAX_SLOPE:
        yield f"left out: a floor that slopes by {slopes.min():.3g} degrees, as arenas have their own ground"
    if len(shapes) > floors:
        yield f"left out: {len(shapes) - floors} shapes of the world, as arenas have their own ground"
    is_ellipsoid = (model.geom_fluid[:, 0] > 0.0) & np.isin(model.geom_bodyid, robot.bodies)
    if is_ellipsoid.any() and (model.opt.density or model.opt.viscosity):
        yield f"fluid: {is_ellipsoid.sum()} shapes have the drag of ellipsoids in the file, here that of their inertia"


def _reduced_meshes(file: RobotFile, robot: Robot) -> list[str]:
    """Return the names of colliders' meshes that are reduced to their hulls, sorted."""
    names = set()
    for geom in robot.colliders:
        mesh = file.meshes.get(geom)
        if mesh is not None and not mesh.whole:
            names.add(mesh.name)
    return sorted(names)


def _omission_counts(file: RobotFile, robot: Robot, stance: Stance) -> dict[str, int]:
    """Return how many things of each kind are left out."""
    model = file.model
    followers = loops.followers_in_legs(robot, stance.joints)
    bodies_in_world = sum(model.body_parentid[body] == 0 for body in range(1, model.nbody))
    return {
        "tendons": model.ntendon,
        "equality constraints": model.neq - len(robot.loops) - len(followers),
        "actuators that are no motors of single joints": model.nu - drives.count_joint_actuators(robot),
        "sensors": model.nsensor,
        "other bodies in the world": bodies_in_world - 1,
    }


def _find_wheels(robot: Robot, stance: Stance) -> list[int]:
    """Return the joints of wheels: the last joint before a foot that is no joint of the leg."""
    last_joints = [(leg, robot.chains[leg.body][-1]) for leg in stance.legs]
    return [joint for leg, joint in last_joints if joint != leg.joints[-1]]
