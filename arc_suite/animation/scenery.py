"""Scenery of a recorded episode as plain data: the ground, obstacles, and debug markers of the command."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite import models
from arc_suite.animation.parts import KINDS
from arc_suite.markers import Marker
from arc_suite.style.tracks import Track
from arc_suite.tasks import Task, readings

_GROUND_MARGIN = 12.0  # standing heights of ground around the path
_DEPTH = 0.01  # standing heights, by which a plane lies below a surface that is drawn in place of its geoms
_MAX_REPLAY_ERROR = 1e-3  # standing heights, by which the torso of a replay may be off
_FLOOR_PREFIX = "floor"  # of the names of geoms of the ground and of obstacles


def describe_scenery(track: Track) -> dict[str, Any]:
    """Return the scenery of an episode; lengths are in m and the world's axes.

    The episode is started again by its seed, which places the obstacles. It is replayed by the controls that the motors
    had, for the debug markers. They end where the replay differs from the recording, for example of another version.

    Returns:
        A dictionary:
            `level`: whether the ground is the plane z = 0;
            `planes`: heights of planes;
            `fields`: height fields, each `low` (2,), `cell` (2,) and `heights` (rows, columns);
            `solids`: shapes, each `kind`, `size`, `place` and `color`, None for that of the ground times `shade`;
            `styles`: of marks, `shape`, `radius` and `color`;
            `marks`: for every step of the track, of each mark the index of its style, start and end;
            `failed`: for every step the names of the parts of legs whose motors have failed.
            The last two are empty where they are empty in all steps.
    """
    environment = track.setup.load()
    environment.reset(track.seed)
    margin = _GROUND_MARGIN * track.body.torso.standing_height
    path = track.positions[:, :2]
    scenery = describe_ground(environment, path.min(axis=0) - margin, path.max(axis=0) + margin)
    replay = _Replay(styles=[], marks=[], failed=[])
    if _has_marks_or_failures(environment.task):
        replay = _replay(environment, track)
    environment.close()
    return scenery | replay._asdict()


def describe_ground(environment, low: np.ndarray, high: np.ndarray) -> dict[str, Any]:
    """Return the ground and the obstacles of an episode between two corners (2,), m: `level` to `solids` of `scenery`.

    Args:
        environment: environment of `arc_suite.load`, in an episode.
        low: the corner of the least x and y.
        high: the opposite corner.
    """
    arena = environment.task.definition.scene.arena
    model = models.model_spec(environment.task.body, arena, decorated=True).compile()
    data = mujoco.MjData(model)
    data.mocap_pos[:] = environment.physics.data.mocap_pos  # of obstacles
    mujoco.mj_kinematics(model, data)
    planes = []
    fields = []
    solids = []
    if arena.surface is not None:
        fields.append(arena.surface.crop(low, high)._asdict())
    for geom in range(model.ngeom):
        if not model.geom(geom).name.startswith(_FLOOR_PREFIX):
            continue
        kind = int(model.geom_type[geom])
        center = data.geom_xpos[geom]
        if kind == mujoco.mjtGeom.mjGEOM_PLANE:
            depth = 0.0 if arena.surface is None else _DEPTH * environment.task.body.torso.standing_height
            planes.append(float(center[2]) - depth)
        elif arena.surface is not None:
            continue  # it is drawn
        elif kind == mujoco.mjtGeom.mjGEOM_HFIELD:
            fields.append(_describe_field(model, model.geom_dataid[geom], center, low, high))
        else:
            extent = model.geom_size[geom][:2].max()
            is_inside = (center[:2] + extent > low).all() and (center[:2] - extent < high).all()
            if is_inside:
                solids.append(_describe_solid(model, geom, KINDS[kind], center))
    return {"level": arena.is_level, "planes": planes, "fields": fields, "solids": solids}


def _describe_field(model: mujoco.MjModel, field: int, center, low, high) -> dict[str, Any]:
    """Return the part of a height field that lies between two corners (2,), m."""
    rows = model.hfield_nrow[field]
    columns = model.hfield_ncol[field]
    first_height = model.hfield_adr[field]
    height_shares = model.hfield_data[first_height : first_height + rows * columns].reshape(rows, columns)
    half_x, half_y, max_height, _ = model.hfield_size[field]
    half_sides = np.array((half_x, half_y))
    cells = np.array((columns - 1, rows - 1))  # along x and y
    cell = 2.0 * half_sides / cells  # m
    corner = center[:2] - half_sides
    first = np.floor((low - corner) / cell).astype(int).clip(0, cells - 1)
    last = np.ceil((high - corner) / cell).astype(int).clip(first + 1, cells)
    first_column, first_row = first
    last_column, last_row = last
    visible_shares = height_shares[first_row : last_row + 1, first_column : last_column + 1]
    return {
        "low": corner + first * cell,
        "cell": cell,
        "heights": center[2] + max_height * visible_shares.astype(float),
    }


def _describe_solid(model: mujoco.MjModel, geom: int, kind: str, center) -> dict[str, Any]:
    """Return a shape of the ground, whose axes are the world's, or an obstacle."""
    is_obstacle = model.body_mocapid[model.geom_bodyid[geom]] >= 0
    return {
        "kind": kind,
        "size": model.geom_size[geom],
        "place": center.copy(),
        "color": model.mat_rgba[model.geom_matid[geom], :3] if is_obstacle else None,
        "shade": float(model.geom_rgba[geom, 0]),
    }


class _Replay(NamedTuple):
    """What a replay shows, as of `describe_scenery`.

    Attributes:
        styles: styles of marks.
        marks: for every step, of each mark the index of its style, start and end.
        failed: for every step, the names of the parts of legs whose motors have failed.
    """

    styles: list[dict]
    marks: list[list]
    failed: list[list[str]]


def _has_marks_or_failures(task) -> bool:
    """Return whether a task has debug markers, or legs whose motors fail."""
    kind = type(task.definition)
    return kind.markers is not Task.markers or kind.failed_legs is not Task.failed_legs


def _replay(environment, track: Track) -> _Replay:
    """Return what an episode shows until it differs from its track, given its environment at the start.

    A track has the controls of the motors, and not the actions that they come from.
    """
    task = environment.task
    physics = environment.physics
    joints = len(track.body.joint_names)
    substeps = task.definition.scene.substeps
    part_names_of_leg = {leg.name: leg.part_names for leg in track.body.legs}
    max_error = _MAX_REPLAY_ERROR * track.body.torso.standing_height
    styles: dict[_Style, int] = {}
    marks = []
    failed = []
    for control, recorded_position in zip(track.actions, track.positions, strict=True):
        # An action passes through delays, positions and weak motors; what was recorded has passed through them.
        task.before_step(np.zeros(joints), physics)
        physics.data.ctrl[:joints] = control
        physics.step(substeps)
        task.after_step(physics)
        torso_position = readings.torso_qpos(physics.data.qpos, task.definition.scene.layout)[:3]
        if abs(torso_position - recorded_position).max() > max_error:
            break
        marks.append(_describe_marks(task.markers(physics), styles))
        failed.append([name for leg in task.failed_legs() for name in part_names_of_leg[leg]])
    return _Replay(
        styles=[{"shape": style.shape, "radius": style.radius, "color": style.color} for style in styles],
        marks=marks if any(marks) else [],
        failed=failed if any(failed) else [],
    )


class _Style(NamedTuple):
    """How a mark looks.

    Attributes:
        shape: "arrow" or "cylinder".
        radius: m.
        color: red, green, blue and opacity, 0 to 1.
        number: counts the marks of one step that look alike, from 1, as each of them needs a style of its own.
    """

    shape: str
    radius: float
    color: tuple[float, ...]
    number: int


def _describe_marks(markers: Sequence[Marker], styles: dict[_Style, int]) -> list[list]:
    """Return the marks of one step: of each the index of its style, start and end.

    Args:
        markers: markers of the step.
        styles: indices of styles; new styles are added.
    """
    marks = []
    count_of_look: dict[tuple, int] = {}
    for marker in markers:
        look = (marker.shape, float(marker.radius), tuple(float(channel) for channel in marker.color))
        count_of_look[look] = count_of_look.get(look, 0) + 1
        style = _Style(*look, number=count_of_look[look])
        index = styles.setdefault(style, len(styles))
        endpoints = np.concatenate([marker.start, marker.end])  # m
        marks.append([index, *endpoints.tolist()])
    return marks
