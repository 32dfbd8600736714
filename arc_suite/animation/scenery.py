"""Scenery of a recorded episode as plain data: the ground, obstacles, and debug markers of the command."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from arc_suite import models
from arc_suite.animation.parts import KINDS
from arc_suite.markers import Marker
from arc_suite.style.tracks import Track
from arc_suite.tasks import Task

_MARGIN = 12.0  # standing heights of ground around the path
_SAME = 1e-3  # of the standing height, by which an episode that is repeated may differ from the recorded one


def describe_scenery(track: Track) -> dict[str, Any]:
    """Return the scenery of an episode; lengths are in m and the world's axes.

    The episode is started again by its seed, which places the obstacles, and replayed by its actions for the debug
    markers. Markers end where the replay differs from the recording, for example with weak motors, as the
    recorded actions are the applied ones.

    Returns:
        A dictionary:
            `level`: whether the ground is the plane z = 0;
            `planes`: heights of planes;
            `fields`: height fields, each `low` (2,), `cell` (2,) and `heights` (rows, columns);
            `solids`: shapes, each `kind`, `size`, `place` and `color`, None for that of the ground times `shade`;
            `styles`: of marks, `shape`, `radius` and `color`;
            `marks`: for every row of the track, of each mark the index of its style, start and end;
            `failed`: for every row the names of the parts of legs whose motors have failed.
            The last two are empty where all rows are.
    """
    environment = track.setup.load()
    environment.reset(track.seed)
    margin = _MARGIN * track.body.torso.standing_height
    low, high = track.positions[:, :2].min(axis=0) - margin, track.positions[:, :2].max(axis=0) + margin
    found = describe_ground(environment, low, high)
    styles, marks, failed = _marks(environment, track)
    environment.close()
    return found | {"styles": styles, "marks": marks, "failed": failed}


def describe_ground(environment, low: np.ndarray, high: np.ndarray) -> dict[str, Any]:
    """Return the ground and the obstacles of an episode between two corners (2,), m: `level` to `solids` of `scenery`.

    Args:
        environment: of `arc_suite.load`, in an episode.
        low: the corner of the least x and y.
        high: the opposite corner.
    """
    arena = environment.task.definition.scene.arena
    model = models.model_spec(environment.task.body, arena, decorated=True).compile()
    data = mujoco.MjData(model)
    data.mocap_pos[:] = environment.physics.data.mocap_pos
    mujoco.mj_kinematics(model, data)
    found: dict[str, Any] = {"level": arena.is_level, "planes": [], "fields": [], "solids": []}
    for geom in range(model.ngeom):
        if not model.geom(geom).name.startswith("floor"):
            continue
        kind, place, size = int(model.geom_type[geom]), data.geom_xpos[geom], model.geom_size[geom]
        if kind == mujoco.mjtGeom.mjGEOM_PLANE:
            found["planes"].append(float(place[2]))
        elif kind == mujoco.mjtGeom.mjGEOM_HFIELD:
            found["fields"].append(_field(model, model.geom_dataid[geom], place, low, high))
        elif (place[:2] + size[:2].max() > low).all() and (place[:2] - size[:2].max() < high).all():
            found["solids"].append(_solid(model, geom, KINDS[kind], place))
    return found


def _field(model: mujoco.MjModel, index: int, place, low, high) -> dict[str, Any]:
    """The part of a height field that lies between two corners (2,)."""
    shape = np.array((model.hfield_nrow[index], model.hfield_ncol[index]))
    start = model.hfield_adr[index]
    heights = model.hfield_data[start : start + shape.prod()].reshape(shape)
    halves, (columns, rows) = model.hfield_size[index], shape[::-1]
    cell = 2.0 * halves[:2] / (shape[::-1] - 1)
    corner = place[:2] - halves[:2]
    first = np.floor((low - corner) / cell).astype(int).clip(0, (columns - 2, rows - 2))
    last = np.ceil((high - corner) / cell).astype(int).clip(first + 1, (columns - 1, rows - 1))
    part = heights[first[1] : last[1] + 1, first[0] : last[0] + 1]
    return {"low": corner + first * cell, "cell": cell, "heights": place[2] + halves[2] * part.astype(float)}


def _solid(model: mujoco.MjModel, geom: int, kind: str, place) -> dict[str, Any]:
    """A shape of the ground, whose axes are the world's, or an obstacle."""
    ground = model.body_mocapid[model.geom_bodyid[geom]] < 0
    color = None if ground else model.mat_rgba[model.geom_matid[geom], :3]
    shade = float(model.geom_rgba[geom, 0])
    return {"kind": kind, "size": model.geom_size[geom], "place": place.copy(), "color": color, "shade": shade}


def _marks(environment, track: Track) -> tuple[list, list, list]:
    """The styles of marks, and of every row marks and parts of failed legs, of an environment at a track's start."""
    physics, task, styles, rows, failed = environment.physics, environment.task, {}, [], []
    shown = type(task.definition)
    if shown.markers is Task.markers and shown.failed_legs is Task.failed_legs:
        return [], [], []  # nothing is shown: nothing to replay for
    parts = {leg.name: leg.part_names for leg in track.body.legs}
    near = _SAME * track.body.torso.standing_height
    for action, position in zip(track.actions, track.positions, strict=True):
        environment.step(action)
        if abs(physics.data.qpos[:3] - position).max() > near:
            break
        rows.append(_styled(task.markers(physics), styles))
        failed.append([name for leg in task.failed_legs() for name in parts[leg]])
    looks = [dict(zip(("shape", "radius", "color"), style[:3], strict=True)) for style in styles]
    return looks, rows if any(rows) else [], failed if any(failed) else []


def _styled(marks: Sequence[Marker], styles: dict[tuple, int]) -> list[list]:
    """Marks as indices of styles, start and end; styles that are new are added. None has two marks at once."""
    row, counts = [], {}
    for mark in marks:
        style = (mark.shape, float(mark.radius), tuple(map(float, mark.color)))
        counts[style] = counts.get(style, 0) + 1
        index = styles.setdefault((*style, counts[style]), len(styles))
        row.append([index, *np.concatenate([mark.start, mark.end]).tolist()])
    return row
