"""Pictures of a body in an arena: the decorated model in the pose of a simulation."""

import functools
from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from dm_control import mujoco as dm_mujoco
from dm_control.mujoco import wrapper

from arc_suite import checks, models
from arc_suite.arenas import FLAT, Arena
from arc_suite.markers import Marker
from arc_suite.models import visuals
from arc_suite.models.builder import EYE
from arc_suite.models.visuals.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl

_SHAPES = {"arrow": mujoco.mjtGeom.mjGEOM_ARROW, "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER}


class Quality(NamedTuple):
    """How carefully a picture is drawn.

    Attributes:
        shadows: pixels of the shadow map's sides.
        scale: a picture is drawn so many times as large and averaged. That is faster than OpenGL's samples, and smooths
            edges of shadows, too.
        faces: of a round solid, around and along.
        ornaments: whether visuals are drawn that have no mass and touch nothing.
    """

    shadows: int
    scale: int
    faces: tuple[int, int] = (28, 16)
    ornaments: bool = True


# For policies that see, without what would stand before the eye; for people; for films; for pictures that are kept.
QUALITIES = {
    "sense": Quality(0, 1, faces=(12, 8), ornaments=False),
    "fast": Quality(2048, 2),
    "film": Quality(4096, 2),
    "still": Quality(4096, 4),
}
LARGEST = 2  # times the largest picture's sides: what OpenGL draws at once

_LIMP = (0.07, 0.07, 0.08, 1.0)  # color of a leg whose motors have failed


class Decorated(dm_mujoco.Physics):
    """A body with its visuals in an arena; it takes poses and is never stepped.

    Attributes:
        markers: debug markers of pictures; those of depth or segments show none.
    """

    markers: Iterable[Marker] = ()

    @classmethod
    def from_body(
        cls, body: Body, arena: Arena = FLAT, quality: Quality = QUALITIES["fast"], ground: tuple | None = None
    ) -> "Decorated":
        """Compile the decorated body in an arena, for pictures of a quality.

        Args:
            body: the spec.
            arena: where it stands.
            quality: of the pictures.
            ground: red, green, blue and alpha of a ground without a grid; None keeps the grid.
        """
        decorated = cls.from_model(wrapper.MjModel(models.model_spec(body, arena, decorated=True).compile()))
        drawing = decorated.model.vis.quality
        drawing.shadowsize, drawing.offsamples = quality.shadows, 0
        drawing.numslices, drawing.numstacks = quality.faces
        if not quality.ornaments:
            groups = decorated.model.geom_group
            groups[groups > 0] = mujoco.mjNGROUP - 1  # which pictures leave out
        if ground is not None:
            still = decorated.model.geom_bodyid == 0
            decorated.model.geom_matid[still], decorated.model.geom_rgba[still] = -1, ground
        decorated._legs = _legs(body, decorated.model.ptr)
        decorated._colors = decorated.model.geom_rgba.copy()
        decorated._glow = decorated.model.ptr.material("glow").rgba.copy()
        buffer = decorated.model.vis.global_
        buffer.offwidth = buffer.offheight = 1  # grows with the size of pictures
        return decorated

    def pose(
        self,
        qpos: np.ndarray,
        share: float | None = None,
        mocap_pos: np.ndarray | None = None,
        markers: Iterable[Marker] = (),
        failed_legs: Iterable[str] = (),
    ) -> None:
        """Take a pose and show a reward.

        Args:
            qpos: (nq,) positions of the simulation to look at.
            share: of the greatest reward, 0 to 1, shown as the color of the material `glow`; None
                keeps its own color.
            mocap_pos: (nmocap, 3) positions of the arena's movable bodies; None where it has none.
            markers: debug markers to show.
            failed_legs: names of legs to show dark.
        """
        model, data, self.markers = self.model.ptr, self.data.ptr, markers
        data.qpos[:] = qpos
        if mocap_pos is not None:
            data.mocap_pos[:] = mocap_pos
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight):
            update(model, data)
        model.material("glow").rgba = self._glow if share is None else visuals.reward_color(share)
        self.darken(failed_legs)

    def darken(self, failed_legs: Iterable[str]) -> None:
        """Show legs dark, given their names, and all others as they are."""
        colors = self.model.geom_rgba
        colors[:] = self._colors
        for name in failed_legs:
            colors[self._legs[name]] = _LIMP  # goes before that of the material

    def render(self, height, width, camera_id, **kwargs):
        """Draw the pose; arguments as in dm_control."""
        buffer = self.model.vis.global_
        buffer.offheight, buffer.offwidth = max(height, buffer.offheight), max(width, buffer.offwidth)
        own = kwargs.pop("scene_callback", None)

        def callback(physics, scene):
            if not (kwargs.get("depth") or kwargs.get("segmentation")):
                for marker in self.markers:
                    scene.ngeom += 1
                    geom_of(marker, scene.geoms[scene.ngeom - 1])
            if own is not None:
                own(physics, scene)

        return super().render(height, width, camera_id, scene_callback=callback, **kwargs)

    @property
    def contexts(self):
        """The OpenGL contexts that draw all pictures of this process."""
        return opengl.contexts(self.model)


def geom_of(marker: Marker, geom: mujoco.MjvGeom | None = None) -> mujoco.MjvGeom:
    """Return a debug marker as a geom of a scene, a new one or the given one."""
    geom, kind = geom or mujoco.MjvGeom(), _SHAPES[marker.shape]
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(marker.color, np.float32))
    mujoco.mjv_connector(geom, kind, marker.radius, marker.start, marker.end)
    if marker.shape == "arrow":
        geom.size[2] *= 2.0  # MuJoCo draws an arrow half as long as a connector is
    return geom


def _legs(body: Body, model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """The geoms of a decorated model (geoms,), booleans, that belong to each leg."""
    owners = [model.body(index).name for index in model.geom_bodyid]
    return {leg.name: np.isin(owners, leg.part_names) for leg in body.legs}


# Shared by all pictures of the same body; used in OpenGL's thread alone.
_shared = functools.lru_cache(maxsize=8)(Decorated.from_body)


def picture(
    body: Body,
    arena: Arena,
    qpos: np.ndarray,
    height: int,
    width: int,
    camera_id: int | str,
    share: float | None = None,
    mocap_pos: np.ndarray | None = None,
    markers: Iterable[Marker] = (),
    failed_legs: Iterable[str] = (),
    quality: str | None = None,
    **kwargs,
) -> np.ndarray:
    """Draw the decorated body in a pose.

    Args:
        body: the spec.
        arena: where it stands.
        qpos: (nq,) its positions.
        height: pixels.
        width: pixels.
        camera_id: a camera's name or index, -1 for a free one.
        share: of the greatest reward, 0 to 1, shown as the color of the material `glow`; None keeps its own.
        mocap_pos: (nmocap, 3) positions of the arena's movable bodies; None where it has none.
        markers: debug markers; pictures of depth or segments show none.
        failed_legs: names of legs to show dark.
        quality: of `QUALITIES`; pictures of depth or segments are not averaged, the largest ones less. "sense" shows
            what has mass or touches: no ornaments, markers, reward or failed legs. None for "sense" through the camera
            `eye`, else "fast".
        **kwargs: of dm_control's `Physics.render`, such as `depth=True`.

    Returns:
        (height, width, 3) uint8; with `depth`, (height, width) float32, m.

    Raises:
        ValueError: no such camera or quality, or an impossible size.
        RenderingUnavailable: no OpenGL here.
    """
    check_size(height, width)
    if quality is None:
        quality = "sense" if camera_id == EYE else "fast"
    if quality == "sense":
        share, markers, failed_legs = None, (), ()
    drawing = QUALITIES[checks.name(quality, QUALITIES, "quality")]
    single = kwargs.get("depth") or kwargs.get("segmentation")
    scale = 1 if single else min(drawing.scale, LARGEST * MAX_HEIGHT // height, LARGEST * MAX_WIDTH // width)

    def draw():
        decorated = _shared(body, arena, drawing)
        check_camera(decorated.model.ptr, camera_id)
        decorated.pose(qpos, share, mocap_pos, markers, failed_legs)
        return decorated.render(scale * height, scale * width, camera_id, **kwargs)

    drawn = opengl.call(draw)
    return drawn if scale == 1 else smaller(drawn, scale)


def smaller(picture: np.ndarray, scale: int) -> np.ndarray:
    """Return the means of squares of pixels.

    Args:
        picture: (scale * height, scale * width, channels) uint8.
        scale: of the squares, up to 16.

    Returns:
        (height, width, channels) uint8.
    """
    rows, columns = np.divmod(np.arange(scale * scale), scale)
    total = sum(picture[row::scale, column::scale].astype(np.uint16) for row, column in zip(rows, columns, strict=True))
    return ((total + scale * scale // 2) // (scale * scale)).astype(np.uint8)


def check_size(height: int, width: int) -> None:
    """Check the size of pictures, pixels.

    Raises:
        ValueError: no integers, or too large.
    """
    checks.integer("height", height, 1, MAX_HEIGHT)
    checks.integer("width", width, 1, MAX_WIDTH)


def check_camera(model: mujoco.MjModel, camera_id: int | str) -> None:
    """Check that a model has a camera: a name, an index, or -1 for the free one.

    Raises:
        ValueError: it has not.
    """
    cameras = [model.camera(index).name for index in range(model.ncam)]
    if isinstance(camera_id, str):
        checks.name(camera_id, cameras, "camera")
    elif camera_id not in range(-1, len(cameras)):
        raise ValueError(f"no camera {camera_id}: expected -1 (free) to {len(cameras) - 1}, or one of {cameras}")
