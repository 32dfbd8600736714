"""Robots of others: from an MJCF or URDF file to a body whose physics are those of the file."""

import contextlib
import functools
import hashlib
import math
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite.importing import motors, notes, opening, poses, sketch, tree, urdf, writing
from arc_suite.importing.naming import choose_names, clean_name
from arc_suite.importing.opening import RobotFile
from arc_suite.importing.poses import Stance
from arc_suite.importing.tree import Robot
from arc_suite.robots import ROBOTS, sources
from arc_suite.robots.spec import MAX_NAME, Body, Held, Simulation, SpecError

_CONTROL_STEP = 0.02  # s
_LARGEST_TIMESTEP = 0.004  # s
_GRAVITIES = (0.1, 1000.0)  # m/s^2, downwards
_MASSES = (1e-6, 1e9)  # kg
_UNNAMED = "MuJoCo Model"  # of MJCF without a name


class ImportedRobot(NamedTuple):
    """A robot of others.

    Attributes:
        body: with a source.
        notes: a line each: its legs, joint map, standing pose, limits, what is left out.
    """

    body: Body
    notes: tuple[str, ...]


def import_robot(path: str | os.PathLike, home: str | None = None, feet: Sequence[str] = ()) -> ImportedRobot:
    """Return the legged robot of an MJCF or URDF file.

    Args:
        path: of the file.
        home: name of the keyframe in which it stands; None to find a pose.
        feet: names of bodies or geoms at the ends of its legs; none to find them.

    Raises:
        SpecError: it cannot come in; one line that names the file.
        OSError: the file cannot be read.
    """
    path = Path(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of MuJoCo, about attributes of the file that it will drop
            return _imported(path, home, feet)
    except SpecError as error:
        raise SpecError(f"{path}: {error}") from None


def body_of(path: str | os.PathLike) -> Body:
    """Return the body of `imported`; the same one as long as the file stays as it is.

    Raises:
        SpecError: as `imported`.
        OSError: as `imported`.
    """
    return _body(os.path.realpath(path), hashlib.sha256(opening.content(Path(path))).digest())


@functools.lru_cache(maxsize=64)
def _body(path: str, _content: bytes) -> Body:
    return import_robot(path).body


def _imported(path: Path, home: str | None, feet: Sequence[str]) -> ImportedRobot:
    file, robot, stance = _standing(path, home, feet)
    _check_world(robot)
    _check_hinges(robot, stance)
    names = choose_names(robot, stance.legs)
    driven = motors.find_motors(robot, stance)
    order = _order(robot, stance, file.order)
    body = Body(
        name=_name(robot, path),
        torso=sketch.sketch_torso(robot, stance),
        legs=sketch.sketch_legs(robot, stance, names, driven.servos),
        camera=sketch.sketch_camera(stance),
        simulation=_simulation(float(robot.model.opt.timestep)),
        source=writing.write_source(robot, stance, names, file.meshes),
        held=tuple(Held(name=names.joints[joint], servo=driven.servos[joint]) for joint in names.held),
        file_joints=tuple(robot.name(joint) for joint in order),
    )
    told = notes.import_notes(robot, stance, names, order)
    return ImportedRobot(
        sources.check(body), (*told, *driven.notes, *file.notes, *notes.omission_notes(file, robot, stance, names))
    )


def _standing(path: Path, home: str | None, feet: Sequence[str]) -> tuple[RobotFile, Robot, Stance]:
    """Return the robot of a file as it stands; a URDF in which it does not may have another axis that points up."""

    def tried(turn: str) -> tuple[RobotFile, Robot, Stance]:
        file = opening.open_robot(path, turn)
        robot = tree.robot_of(file.model, file.root, file.notes)
        return file, robot, poses.find_stance(robot, home, feet)

    try:
        return tried(urdf.LEVEL)
    except poses.NoStance as error:
        for turn in urdf.TURNS if path.suffix.lower() == ".urdf" else ():
            with contextlib.suppress(SpecError):
                file, robot, stance = tried(turn)
                if np.ptp([leg.center for leg in stance.legs], axis=0).argmax() == 0:
                    note = "turned: the file's y axis points up, the torso's frame has z there"
                    return file._replace(notes=(*file.notes, note)), robot, stance
        raise SpecError(str(error)) from None


def _check_world(robot: Robot) -> None:
    """Refuse gravity that does not pull down, and a robot of an impossible weight."""
    gravity, mass = robot.model.opt.gravity, float(robot.model.body_subtreemass[robot.root])
    if not (_GRAVITIES[0] <= -gravity[2] <= _GRAVITIES[1] and abs(gravity[:2]).max() < 1e-6):
        given = " ".join(f"{each:g}" for each in gravity)
        raise SpecError(f"option: gravity: expected 0 0 -9.81 or the like, got {given}")
    if not _MASSES[0] <= mass <= _MASSES[1]:
        raise SpecError(f"expected a robot of {_MASSES[0]:g} to {_MASSES[1]:g} kg, got {mass:g}")


def _check_hinges(robot: Robot, stance: Stance) -> None:
    for joint in stance.joints:
        if robot.model.jnt_type[joint] != tree.HINGE:
            raise SpecError(f"joint {robot.name(joint)!r} of a leg is a slide joint; expected hinges")


def _name(robot: Robot, path: Path) -> str:
    """Return the model's name, or that of the file, cleaned; a robot's own would give the body its numbers."""
    given = robot.model.names[: robot.model.names.index(b"\0")].decode("utf-8", "replace")
    name = clean_name("" if given == _UNNAMED else given) or clean_name(path.stem) or "robot"
    return f"{name[: MAX_NAME - 9]}_imported" if name in ROBOTS else name


def _simulation(timestep: float) -> Simulation:
    """Return the constants: the file's timestep, or the next smaller one that divides a control step."""
    if timestep <= 0.0:
        raise SpecError(f"option: timestep: expected a number above 0, got {timestep:g}")
    substeps = max(2, math.ceil(_CONTROL_STEP / min(timestep, _LARGEST_TIMESTEP) - 1e-6))
    step = _CONTROL_STEP / substeps
    return Simulation(timestep=step, contact_time=max(0.02, 2.0 * step), contact_margin=0.0, substeps=substeps)


def _order(robot: Robot, stance: Stance, given: tuple[str, ...]) -> list[int]:
    """Return the joints of the legs in the order of the file: of its actuators, or of its joints."""
    legs = stance.joints
    named = {robot.name(joint): joint for joint in robot.joints}
    orders = (motors.actuated_joints(robot), [named[name] for name in given if name in named], robot.joints)
    return next([joint for joint in order if joint in legs] for order in orders if set(legs) <= set(order))
