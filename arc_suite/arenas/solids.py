"""Solids: ground of planes, boxes and other shapes that stand still, as a scene has it."""

import dataclasses
import functools
from typing import Any, NamedTuple

import mujoco
import numpy as np
from dm_control import mjcf

from arc_suite.arenas.mapped import Mapped, Surface, check_sides
from arc_suite.robots.spec import Body

SIZES = {"plane": 0, "box": 3, "sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "mesh": 0}  # numbers of a size

_CELL = 1.0 / 16.0  # of the surface, standing heights
_MAX_NODES = 641  # of the surface along either side, as each is measured by a ray
_MAX_REACH = 120.0  # of the surface from the start, standing heights: the fastest walk leads 92 in 1000 control steps
_MAX_LISTED = 2  # solids, whose pairs with the parts of a body are listed
_DOWN = np.array((0.0, 0.0, -1.0))


class Solid(NamedTuple):
    """A shape that stands still.

    Attributes:
        kind: type of the geom, a key of `SIZES`.
        pos: place, m.
        quat: orientation, a quaternion.
        size: size of the geom, m.
        points: corners of a mesh, which is convex, m.
    """

    kind: str
    pos: tuple[float, ...]
    quat: tuple[float, ...]
    size: tuple[float, ...] = ()
    points: tuple[tuple[float, ...], ...] = ()


class Solids(NamedTuple):
    """The ground of a scene as data of a file.

    Attributes:
        name: name of its file.
        parts: planes are level.
    """

    name: str
    parts: tuple[Solid, ...]


@dataclasses.dataclass(frozen=True)
class SolidGround(Mapped):
    """The solids of a scene. Heights are sampled from above, so that edges are wide by a cell.

    Attributes:
        solids: the solids of a scene.
    """

    solids: Solids

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the solids `floor_<number>`, and the first plane as `floor`."""
        _add_solids(root, self.solids, self._start_height, **contact)

    @property
    def has_edge(self) -> bool:
        """Whether there is no plane."""
        return not _planes(self.solids)

    @property
    def lists_contacts(self) -> bool:
        """Return whether the solids are few."""
        return len(self.solids.parts) <= _MAX_LISTED

    @functools.cached_property
    def surface(self) -> Surface:
        """The heights of the solids, where there are any; else the lowest height of the ground."""
        surface = self._samples
        return surface._replace(heights=surface.heights - self._start_height)

    @functools.cached_property
    def _start_height(self) -> float:
        """The height of the scene at the start, m."""
        return float(self._samples.height(np.float64(0.0), np.float64(0.0)))

    @functools.cached_property
    def _samples(self) -> Surface:
        """The heights of the scene as it is in its file."""
        low, high = _bounds(self.solids, _MAX_REACH * self.unit)
        cells = np.ceil((high - low) / (_CELL * self.unit)).astype(int).clip(1, _MAX_NODES - 1)
        columns, rows = cells + 1
        x, y = np.meshgrid(np.linspace(low[0], high[0], columns), np.linspace(low[1], high[1], rows))
        heights = _measure_heights(self.solids, x, y)
        cell = (high - low) / cells
        return Surface((float(low[0]), float(low[1])), (float(cell[0]), float(cell[1])), heights)


def fit(body: Body, solids: Solids) -> SolidGround:
    """Return the ground of a scene for a body.

    Raises:
        ValueError: no ground under the start, or too little of it for the body.
    """
    unit = body.torso.standing_height
    if not np.isfinite(_cast_rays(solids, np.zeros(1), np.zeros(1))).all():
        raise ValueError(f"arena {solids.name!r}: expected ground under the start, at x = y = 0")
    ground = SolidGround(unit, solids)
    if ground.has_edge:
        low, high = _bounds(solids, np.inf)
        check_sides(solids.name, tuple(high - low), unit)
    return ground


def _planes(solids: Solids) -> list[Solid]:
    return [solid for solid in solids.parts if solid.kind == "plane"]


def _add_solids(root: mjcf.RootElement, solids: Solids, start_height: float, **contact) -> None:
    """Add solids to a model, lower by the height of the start."""
    names = _name_solids(solids)
    for solid, name in zip(solids.parts, names, strict=True):
        x, y, z = solid.pos
        attributes = {"name": name, "type": solid.kind, "pos": (x, y, z - start_height), "quat": solid.quat}
        if solid.kind == "plane":
            attributes["size"] = (0.0, 0.0, 1.0)
        elif solid.kind == "mesh":
            vertices = np.ravel(solid.points)
            attributes["mesh"] = root.asset.add("mesh", name=name, vertex=vertices, inertia="convex")
        else:
            attributes["size"] = solid.size
        root.worldbody.add("geom", **attributes, conaffinity=1, **contact)


def _name_solids(solids: Solids) -> list[str]:
    """Return the names of solids: `floor` for the first plane, else `floor_<number>`."""
    kinds = [solid.kind for solid in solids.parts]
    first_plane = kinds.index("plane") if "plane" in kinds else 0
    return ["floor" if index == first_plane else f"floor_{index}" for index in range(len(kinds))]


@functools.lru_cache(maxsize=8)
def _compile(solids: Solids) -> mujoco.MjModel:
    """Return a model of the scene alone."""
    root = mjcf.RootElement()
    _add_solids(root, solids, 0.0)
    return mujoco.MjModel.from_xml_string(root.to_xml_string())


def _bounds(solids: Solids, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (2,) of lowest and highest x and y, m, of what stands on the planes up to a distance.

    Where nothing stands there, the corners are those of a square around the start.
    """
    model = _compile(solids)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    is_solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    rotations = data.geom_xmat[is_solid].reshape(-1, 3, 3)
    boxes = model.geom_aabb[is_solid]  # center and half-sides in the frame of the geom
    centers = data.geom_xpos[is_solid] + np.einsum("nij,nj->ni", rotations, boxes[:, :3])
    halves = np.einsum("nij,nj->ni", abs(rotations), boxes[:, 3:])
    margin = 0.0 if not _planes(solids) else 1e-3
    lows = (centers - halves)[:, :2] - margin
    highs = (centers + halves)[:, :2] + margin
    is_near = ((lows < reach) & (highs > -reach)).all(axis=1)
    if not is_near.any():
        return np.full(2, -1.0), np.full(2, 1.0)
    return lows[is_near].min(axis=0).clip(-reach, reach), highs[is_near].max(axis=0).clip(-reach, reach)


def _measure_heights(solids: Solids, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the heights (...) of a scene at places x (...) and y (...), m; where there is none, the lowest height."""
    heights = _cast_rays(solids, x.ravel(), y.ravel())
    is_ground = np.isfinite(heights)
    heights[~is_ground] = heights[is_ground].min() if is_ground.any() else 0.0
    return heights.reshape(x.shape)


def _cast_rays(solids: Solids, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the height (n,) at which a ray from above ends; -inf where there is no ground."""
    model = _compile(solids)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    top = float((data.geom_xpos[:, 2] + model.geom_rbound).max()) + 1.0
    geom = np.zeros(1, np.int32)
    heights = np.empty(len(x))
    for index, origin in enumerate(np.column_stack([x, y, np.full(len(x), top)])):
        distance = mujoco.mj_ray(model, data, origin, _DOWN, None, 1, -1, geom)
        heights[index] = top - distance if geom[0] >= 0 else -np.inf
    return heights
