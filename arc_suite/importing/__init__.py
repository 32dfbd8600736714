"""Robots of others: from an MJCF or URDF file to a body whose physics are those of the file."""

import hashlib
import math
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, files, parsers
from arc_suite.importing import (
    armatures,
    drives,
    kinds,
    loops,
    motors,
    notes,
    opening,
    poses,
    sketch,
    tree,
    trunk,
    units,
    writing,
)
from arc_suite.importing.facing import AXES, LEVEL, Y_UP, Facing
from arc_suite.importing.front import find_front
from arc_suite.importing.naming import choose_names, clean_name
from arc_suite.importing.opening import RobotFile
from arc_suite.importing.poses import Stance
from arc_suite.importing.tree import Robot
from arc_suite.robots import ROBOTS, sources
from arc_suite.robots.spec import MAX_NAME, Body, Held, Simulation, SpecError

_CONTROL_STEP = 0.02  # s
_MAX_TIMESTEP = 0.004  # s
_MIN_SUBSTEPS = 2  # in a control step
_MIN_CONTACT_TIME = 0.02  # s
_GRAVITY_RANGE = (0.1, 1000.0)  # m/s^2, downwards
_MASS_RANGE = (1e-6, 1e9)  # kg
_DEFAULT_NAME = "MuJoCo Model"  # which MuJoCo gives MJCF without a name
_MAX_CACHED_BODIES = 64
_IMPORTED = "_imported"  # ends the name of a body that would have a robot's name


class ImportedRobot(NamedTuple):
    """A robot from a file of others.

    Attributes:
        body: with a source.
        notes: a line each: its legs, joint map, standing pose, limits, what is left out.
    """

    body: Body
    notes: tuple[str, ...]


class _CachedBody(NamedTuple):
    """A body from a file.

    Attributes:
        body: the body.
        digests: hashes of all files that it depends on; None for those that were looked for and are missing.
    """

    body: Body
    digests: dict[Path, bytes | None]


_cached_bodies: dict[str, _CachedBody] = {}  # by path, the last one used last


class _Choices(NamedTuple):
    """What a user says of a file; see `import_robot`."""

    home: str | None = None
    feet: tuple[str, ...] = ()
    armature: float | None = None
    forward: str | None = None
    scale: float = 1.0
    stiffness: float | None = None
    damping: float | None = None


class _StandingRobot(NamedTuple):
    """A file, its robot, and how it stands."""

    file: RobotFile
    robot: Robot
    stance: Stance


def import_robot(
    path: str | os.PathLike[str],
    home: str | None = None,
    feet: str | Sequence[str] = (),
    armature: float | None = None,
    forward: str | None = None,
    scale: float = 1.0,
    stiffness: float | None = None,
    damping: float | None = None,
) -> ImportedRobot:
    """Return the legged robot of an MJCF or URDF file.

    Args:
        path: path of the file.
        home: name of the keyframe in which it stands, or angles of its joints, rad, such as "*_thigh=0.8,*_calf=-1.5":
            other joints are at zero, or at the nearest angle of their range; None to find a pose.
        feet: names of bodies or geoms at the ends of its legs, or of links fixed to them; none to find them. Several
            names on a leg, such as heel and toe, are one foot.
        armature: rotor inertia of each joint for which the file has none, kg m^2; None for none, or for a small one
            where joints buzz without it.
        forward: axis of the file's torso that points ahead, out of `facing.AXES`; None for x, or for another one where
            names and hinges of the legs say so.
        scale: factor of all lengths: 0.01 for a file in cm.
        stiffness: of each servo for which the file has no gains, N m/rad; None to size it.
        damping: of each servo for which the file has no gains, N m s/rad; None to size it.

    Raises:
        SpecError: it cannot come in; one line that names the file.
        OSError: the file cannot be read.
    """
    if forward is not None:
        checks.name(forward, AXES, "axis")
    min_scale, max_scale = units.SCALE_RANGE
    if not min_scale <= scale <= max_scale:
        raise SpecError(f"{path}: scale: expected a number from {min_scale:g} to {max_scale:g}, got {scale:g}")
    foot_names = (feet,) if isinstance(feet, str) else tuple(feet)
    choices = _Choices(home, foot_names, armature, forward, scale, stiffness, damping)
    imported_robot, _ = _import_file(Path(path), choices)
    return imported_robot


def body_of(path: str | os.PathLike[str]) -> Body:
    """Return the body of `import_robot`; the same one as long as all files that were read for it stay as they are.

    Raises:
        SpecError: as `import_robot`.
        OSError: as `import_robot`.
    """
    key = os.fspath(Path(path).absolute())  # of a link itself, whose name and neighbors count
    cached_body = _cached_bodies.pop(key, None)
    if cached_body is None or any(_digest(part) != digest for part, digest in cached_body.digests.items()):
        imported_robot, parts = _import_file(Path(path), _Choices())
        cached_body = _CachedBody(imported_robot.body, {part.absolute(): _digest(part) for part in parts})
    while len(_cached_bodies) >= _MAX_CACHED_BODIES:
        oldest_key = next(iter(_cached_bodies))
        _cached_bodies.pop(oldest_key, None)
    _cached_bodies[key] = cached_body
    return cached_body.body


def _digest(path: Path) -> bytes | None:
    """Return the hash of a file's content; None where there is no file."""
    if not path.is_file():
        return None
    with files.reading(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


def _import_file(path: Path, choices: _Choices) -> tuple[ImportedRobot, tuple[Path, ...]]:
    """Return the robot of a file, and all files that it depends on; errors name the file."""
    with warnings.catch_warnings(), parsers.guard(str(path), passes=(OSError,), raises=SpecError):
        warnings.simplefilter("ignore")  # MuJoCo warns about attributes that are dropped here
        file, robot, stance = _find_standing_robot(path, choices)
        return _describe_robot(path, file, robot, stance, choices), file.parts


def _describe_robot(path: Path, file: RobotFile, robot: Robot, stance: Stance, choices: _Choices) -> ImportedRobot:
    """Return the body of a robot that stands, and notes."""
    _check_world(robot)
    _check_hinges(robot, stance)
    unit_notes = units.unit_notes(robot, stance)
    armature_notes: tuple[str, ...] = ()
    if choices.armature is not None:
        robot, armature_notes = armatures.add_armature(robot, choices.armature)
    servos, motor_notes = motors.find_motors(robot, stance, file.speeds, choices.stiffness, choices.damping)
    names = choose_names(robot, stance.legs)
    order = _order_joints(robot, stance, file.order)

    def write_body(robot: Robot) -> Body:
        body = Body(
            name=_choose_body_name(robot, path),
            torso=sketch.sketch_torso(robot, stance),
            legs=sketch.sketch_legs(robot, stance, names, servos),
            camera=sketch.sketch_camera(stance),
            simulation=_choose_simulation(float(robot.model.opt.timestep)),
            source=writing.write_source(robot, stance, names, file),
            held=tuple(Held(name=names.joints[joint], servo=servos[joint]) for joint in names.held),
            file_joints=tuple(robot.joint_name(joint) for joint in order),
        )
        return sources.check(body)

    body = write_body(robot)
    if choices.armature is None:
        body, armature_notes = armatures.calm(body, robot, servos, write_body)
    first_notes = notes.import_notes(robot, stance, names, order)
    resistance = notes.resistance_notes(robot, stance)
    last_notes = notes.omission_notes(file, robot, stance, names)
    all_notes = (*first_notes, *unit_notes, *motor_notes, *resistance, *armature_notes, *file.notes, *last_notes)
    return ImportedRobot(body, all_notes)


def _find_standing_robot(path: Path, choices: _Choices) -> _StandingRobot:
    """Return the robot of a file as it stands; the file's y axis may point up."""
    facings = (LEVEL, *Y_UP)
    if choices.forward is not None:
        facings = tuple(Facing(choices.forward, up) for up in ("z", "y") if up != choices.forward[-1])
    reasons = []
    for facing in facings:
        try:
            standing_robot = _open_standing_robot(path, choices, facing)
        except poses.NoStance as reason:
            reasons.append(reason)
            continue
        extents = np.ptp([leg.center for leg in standing_robot.stance.legs], axis=0)  # (3,) of the feet, m
        is_longest_forward = extents.argmax() == 0  # as robots are
        if facing not in Y_UP or choices.forward is not None or is_longest_forward:
            return standing_robot
    raise reasons[0]


def _open_standing_robot(path: Path, choices: _Choices, facing: Facing) -> _StandingRobot:
    """Return the robot of a file as it stands, with its torso turned; names and hinges may turn it on."""
    file, robot = _open_turned_robot(path, facing, choices.scale)
    front_notes: tuple[str, ...] = ()
    if facing.up == "y":
        front_notes = ("turned: the file's y axis points up, the torso's frame has z there",)
    if choices.forward is None:
        front = find_front(robot)
        if front.forward != "x":
            facing = facing.turn(front.forward)
            file, robot = _open_turned_robot(path, facing, choices.scale)
        front_notes += front.notes(facing)
    file = file._replace(notes=(*file.notes, *front_notes))
    feet = trunk.find_feet(robot)
    robot = drives.release_joints(robot, file.driven)
    loops.check_legs(robot, feet)
    named_feet = [file.carriers.get(foot, foot) for foot in choices.feet]
    stance = poses.find_stance(robot, choices.home, named_feet)
    loops.check_legs(robot, [leg.body for leg in stance.legs])
    return _StandingRobot(file, robot, stance)


def _open_turned_robot(path: Path, facing: Facing, scale: float) -> tuple[RobotFile, Robot]:
    """Return a file and its robot, with its torso turned."""
    file = opening.open_robot(path, facing, scale)
    kind = kinds.describe_kind(file.model, file.root)
    if kind:
        raise SpecError(f"{kind}; {kinds.EXPECTED}")
    return file, trunk.place_torso(tree.robot_of(file.model, file.root, file.notes))


def _check_world(robot: Robot) -> None:
    """Refuse gravity that does not pull down, and a robot of an impossible weight."""
    gravity = robot.model.opt.gravity
    min_gravity, max_gravity = _GRAVITY_RANGE
    is_vertical = abs(gravity[:2]).max() < 1e-6
    if not (min_gravity <= -gravity[2] <= max_gravity and is_vertical):
        gravity_text = " ".join(f"{component:g}" for component in gravity)
        raise SpecError(f"option: gravity: expected 0 0 -9.81 or the like, got {gravity_text}")
    mass = float(robot.model.body_subtreemass[robot.root])
    min_mass, max_mass = _MASS_RANGE
    if not min_mass <= mass <= max_mass:
        raise SpecError(f"expected a robot of {min_mass:g} to {max_mass:g} kg, got {mass:g}")


def _check_hinges(robot: Robot, stance: Stance) -> None:
    for joint in stance.joints:
        if robot.model.jnt_type[joint] != tree.HINGE:
            raise SpecError(f"joint {robot.joint_name(joint)!r} of a leg is a slide joint; expected hinges")


def _choose_body_name(robot: Robot, path: Path) -> str:
    """Return the model's name, or that of the file, cleaned.

    A robot of the suite keeps its name for itself: parameters are found by it.
    """
    model_name = robot.model.names[: robot.model.names.index(b"\0")].decode("utf-8", "replace")
    if model_name == _DEFAULT_NAME:
        model_name = ""
    name = clean_name(model_name) or clean_name(path.stem) or "robot"
    if name in ROBOTS:
        return name[: MAX_NAME - len(_IMPORTED)] + _IMPORTED
    return name


def _choose_simulation(timestep: float) -> Simulation:
    """Return the constants: the file's timestep, s, or the next smaller one that divides a control step."""
    if timestep <= 0.0:
        raise SpecError(f"option: timestep: expected a number above 0, got {timestep:g}")
    substeps = math.ceil(_CONTROL_STEP / min(timestep, _MAX_TIMESTEP) - 1e-6)
    substeps = max(_MIN_SUBSTEPS, substeps)
    suite_timestep = _CONTROL_STEP / substeps
    contact_time = max(_MIN_CONTACT_TIME, 2.0 * suite_timestep)
    return Simulation(timestep=suite_timestep, contact_time=contact_time, contact_margin=0.0, substeps=substeps)


def _order_joints(robot: Robot, stance: Stance, urdf_order: tuple[str, ...]) -> list[int]:
    """Return the joints of the legs in the order of the file: of its actuators, of a URDF, or of the model."""
    joints_of_legs = set(stance.joints)
    joint_by_name = {robot.joint_name(joint): joint for joint in robot.joints}
    joints_in_urdf = [joint_by_name[name] for name in urdf_order if name in joint_by_name]
    for order in (drives.actuated_joints(robot), joints_in_urdf):
        if joints_of_legs <= set(order):
            return [joint for joint in order if joint in joints_of_legs]
    return [joint for joint in robot.joints if joint in joints_of_legs]
