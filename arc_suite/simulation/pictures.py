"""Pictures of a body in an arena: the decorated model in the pose of a simulation."""

import functools
from collections.abc import Iterable, Sequence
from numbers import Integral
from typing import Any, NamedTuple

import mujoco
import numpy as np
from dm_control import mujoco as dm_mujoco
from dm_control.mujoco import engine, wrapper

from arc_suite import checks, models, rotations
from arc_suite.arenas import FLAT, Arena
from arc_suite.markers import Marker
from arc_suite.models import visuals
from arc_suite.models.builder import EYE
from arc_suite.models.swinging import list_bones
from arc_suite.models.visuals.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl

_SHAPES = {"arrow": mujoco.mjtGeom.mjGEOM_ARROW, "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER}


class Quality(NamedTuple):
    """The quality of a picture.

    Attributes:
        shadows: size of the shadow map, pixels.
        scale: factor on the size at which a picture is drawn before it is averaged. That is faster than OpenGL's
            multisampling, and also smooths edges of shadows.
        faces: numbers of faces of a round solid, around and along it.
        ornaments: whether ornaments are drawn, which have no mass and touch nothing.
    """

    shadows: int
    scale: int
    faces: tuple[int, int] = (28, 16)
    ornaments: bool = True


# "sense" is for policies: it leaves out ornaments, which could cover the view of the camera `eye`. "fast" is for live
# views, "film" for films, "still" for single pictures.
QUALITIES = {
    "sense": Quality(0, 1, faces=(12, 8), ornaments=False),
    "fast": Quality(2048, 2),
    "film": Quality(4096, 2),
    "still": Quality(4096, 4),
}
MAX_SCALE = 2  # of the largest picture

# Of pictures of environments; width and height in pixels.
_DEFAULT_OPTIONS: dict[str, Any] = {"width": 640, "height": 480, "camera_id": "tracking"}
_FAILED_LEG_COLOR = (0.07, 0.07, 0.08, 1.0)
_FIELDS_OF_CAMERA = ("type", "fixedcamid", "trackbodyid", "distance", "azimuth", "elevation", "orthographic")


class _PlacedCamera(engine.Camera):
    """A camera of dm_control where a caller's `MjvCamera` is."""

    def __init__(self, physics, height, width, placed: mujoco.MjvCamera, scene_callback=None):
        super().__init__(physics, height, width, camera_id=-1, scene_callback=scene_callback)
        for name in _FIELDS_OF_CAMERA:  # copied, as MuJoCo moves a camera that tracks a part
            setattr(self._render_camera, name, getattr(placed, name))
        self._render_camera.lookat[:] = placed.lookat


class _SwingingGeom(NamedTuple):
    """A geom that swings with a bone of ornaments.

    Attributes:
        number: number of the geom.
        bone: index of the bone.
        pivot: (3,) of the bone, m.
        position, quaternion: of the geom at rest.
    """

    number: int
    bone: int
    pivot: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray


class Decorated(dm_mujoco.Physics):
    """A body with its visuals in an arena, for pictures of poses; it is never stepped.

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
            quality: quality of the pictures.
            ground: red, green, blue and alpha of a ground without a grid; None keeps the grid.
        """
        decorated = cls.from_model(wrapper.MjModel(models.model_spec(body, arena, decorated=True).compile()))
        model_quality = decorated.model.vis.quality
        model_quality.shadowsize = quality.shadows
        model_quality.offsamples = 0
        model_quality.numslices, model_quality.numstacks = quality.faces
        if not quality.ornaments:
            groups = decorated.model.geom_group
            groups[groups > 0] = mujoco.mjNGROUP - 1  # a group that pictures leave out
        if ground is not None:
            is_of_world = decorated.model.geom_bodyid == 0
            decorated.model.geom_matid[is_of_world] = -1
            decorated.model.geom_rgba[is_of_world] = ground
        decorated._legs = _geoms_by_leg(body, decorated.model.ptr)
        decorated._swinging_geoms = _list_swinging_geoms(body, decorated.model.ptr)
        decorated._colors = decorated.model.geom_rgba.copy()
        decorated._glow = decorated.model.ptr.material("glow").rgba.copy()
        buffer = decorated.model.vis.global_
        buffer.offwidth = 1  # it grows with the size of pictures
        buffer.offheight = 1
        return decorated

    def pose(
        self,
        qpos: np.ndarray,
        share: float | None = None,
        mocap_pos: np.ndarray | None = None,
        markers: Iterable[Marker] = (),
        failed_legs: Iterable[str] = (),
        swings: Sequence[np.ndarray] | np.ndarray | None = None,
    ) -> None:
        """Take a pose and show a reward.

        Args:
            qpos: (nq,) positions of the simulation.
            share: share of the greatest reward, 0 to 1, shown as the color of the material `glow`; None
                keeps its own color.
            mocap_pos: (nmocap, 3) positions of the arena's movable bodies; None where it has none.
            markers: debug markers to show.
            failed_legs: names of legs to show dark.
            swings: (bones, 4) how bones of ornaments are turned in the torso's frame; None for bones at rest.
        """
        self.markers = markers
        model = self.model.ptr
        data = self.data.ptr
        self._turn_ornaments(swings)
        data.qpos[:] = qpos
        if mocap_pos is not None:
            data.mocap_pos[:] = mocap_pos
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight):
            update(model, data)
        model.material("glow").rgba = self._glow if share is None else visuals.reward_color(share)
        self.darken(failed_legs)

    def _turn_ornaments(self, swings: Sequence[np.ndarray] | np.ndarray | None) -> None:
        """Turn ornaments about their pivots; see `pose`."""
        model = self.model.ptr
        for geom in self._swinging_geoms:
            position = geom.position
            quaternion = geom.quaternion
            if swings is not None:
                turn = swings[geom.bone]
                position = geom.pivot + rotations.matrix(turn) @ (position - geom.pivot)
                quaternion = rotations.product(turn, quaternion)
            model.geom_pos[geom.number] = position
            model.geom_quat[geom.number] = quaternion

    def darken(self, failed_legs: Iterable[str]) -> None:
        """Show legs dark, given their names, and all other legs in their own colors."""
        colors = self.model.geom_rgba
        colors[:] = self._colors
        for name in failed_legs:
            colors[self._legs[name]] = _FAILED_LEG_COLOR  # prevails over the color of the material

    def render(self, height, width, camera_id, **kwargs):
        """Draw the pose; arguments as in dm_control."""
        buffer = self.model.vis.global_
        buffer.offheight = max(height, buffer.offheight)
        buffer.offwidth = max(width, buffer.offwidth)
        callback_of_caller = kwargs.pop("scene_callback", None)
        shows_markers = not (kwargs.get("depth") or kwargs.get("segmentation"))

        def callback(physics, scene):
            if shows_markers:
                for marker in self.markers:
                    scene.ngeom += 1
                    geom_of(marker, scene.geoms[scene.ngeom - 1])
            if callback_of_caller is not None:
                callback_of_caller(physics, scene)

        if not isinstance(camera_id, mujoco.MjvCamera):
            return super().render(height, width, camera_id, scene_callback=callback, **kwargs)
        camera = _PlacedCamera(self, height, width, camera_id, scene_callback=callback)
        try:
            return camera.render(**kwargs)
        finally:
            camera.scene.free()

    @property
    def contexts(self):
        """The OpenGL contexts that draw all pictures of this process."""
        return opengl.contexts(self.model)


def geom_of(marker: Marker, geom: mujoco.MjvGeom | None = None) -> mujoco.MjvGeom:
    """Return a debug marker as a geom of a scene, a new one or the given one."""
    if geom is None:
        geom = mujoco.MjvGeom()
    kind = _SHAPES[marker.shape]
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(marker.color, np.float32))
    mujoco.mjv_connector(geom, kind, marker.radius, marker.start, marker.end)
    if marker.shape == "arrow":
        geom.size[2] *= 2.0  # MuJoCo draws arrows half as long as other connectors
    return geom


def _geoms_by_leg(body: Body, model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Return a mask (geoms,) of the geoms of each leg of a decorated model, by name."""
    part_names = [model.body(index).name for index in model.geom_bodyid]
    return {leg.name: np.isin(part_names, leg.part_names) for leg in body.legs}


def _list_swinging_geoms(body: Body, model: mujoco.MjModel) -> list[_SwingingGeom]:
    """Return the geoms of a decorated model that swing."""
    bones = list_bones(body)
    bone_names = [bone.name for bone in bones]
    geoms = []
    for geom_name, bone_name in visuals.geoms_of_bones(body).items():
        geom = model.geom(geom_name)
        bone = bone_names.index(bone_name)
        model.geom_sameframe[geom.id] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # else MuJoCo takes the torso's frame
        geoms.append(_SwingingGeom(geom.id, bone, bones[bone].place, geom.pos.copy(), geom.quat.copy()))
    return geoms


@functools.lru_cache(maxsize=8)
def _compile_for_pictures(body: Body, arena: Arena, quality: Quality, visuals_key: str) -> Decorated:
    """Return the decorated body of all pictures with the same `visuals.key_of`, for OpenGL's thread alone."""
    return Decorated.from_body(body, arena, quality)


def picture(
    body: Body,
    arena: Arena,
    qpos: np.ndarray,
    height: int,
    width: int,
    camera_id: int | str | mujoco.MjvCamera,
    share: float | None = None,
    mocap_pos: np.ndarray | None = None,
    markers: Iterable[Marker] = (),
    failed_legs: Iterable[str] = (),
    swings: Sequence[np.ndarray] | np.ndarray | None = None,
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
        camera_id: a camera's name or index, -1 for a free one, or a placed camera, which does not change.
        share: share of the greatest reward, 0 to 1, shown as the color of the material `glow`; None keeps its own.
        mocap_pos: (nmocap, 3) positions of the arena's movable bodies; None where it has none.
        markers: debug markers; pictures of depth or segments show none.
        failed_legs: names of legs to show dark.
        swings: (bones, 4) how bones of ornaments are turned in the torso's frame; None for bones at rest.
        quality: a name of `QUALITIES`. Pictures of depth or segments are not averaged, and the largest pictures less.
            "sense" has no ornaments, markers, reward or failed legs. None for "sense" through the camera `eye`, and
            for "fast" through others.
        **kwargs: keyword arguments of dm_control's `Physics.render`, such as `depth=True`.

    Returns:
        (height, width, 3) uint8; with `depth`, (height, width) float32, m.

    Raises:
        ValueError: no such camera or quality, or an impossible size.
        RenderingUnavailable: no OpenGL here.
    """
    check_size(height, width)
    if quality is None:
        quality = "sense" if isinstance(camera_id, str) and camera_id == EYE else "fast"
    if quality == "sense":
        share = None
        markers = ()
        failed_legs = ()
    drawn_quality = QUALITIES[checks.name(quality, QUALITIES, "quality")]
    if kwargs.get("depth") or kwargs.get("segmentation"):
        scale = 1
    else:
        scale = min(drawn_quality.scale, MAX_SCALE * MAX_HEIGHT // height, MAX_SCALE * MAX_WIDTH // width)

    def draw():
        decorated = _compile_for_pictures(body, arena, drawn_quality, visuals.key_of(body))
        if isinstance(camera_id, mujoco.MjvCamera):
            check_placed_camera(decorated.model.ptr, camera_id)
        else:
            check_camera(decorated.model.ptr, camera_id)
        decorated.pose(qpos, share, mocap_pos, markers, failed_legs, swings)
        return decorated.render(scale * height, scale * width, camera_id, **kwargs)

    pixels = opengl.call(draw)
    return pixels if scale == 1 else shrink(pixels, scale)


def shrink(picture: np.ndarray, scale: int) -> np.ndarray:
    """Return the means of squares of pixels.

    Args:
        picture: (scale * height, scale * width, channels) uint8.
        scale: scale of the squares, up to 16.

    Returns:
        (height, width, channels) uint8.
    """
    pixels = scale * scale  # of a square
    total = np.zeros_like(picture[::scale, ::scale], np.uint16)
    for row in range(scale):
        for column in range(scale):
            total += picture[row::scale, column::scale]
    return ((total + pixels // 2) // pixels).astype(np.uint8)


def options(
    render_mode: str | None, width: int | None, height: int | None, camera_id: int | str | None
) -> dict[str, Any]:
    """Return size and camera of an environment's pictures as arguments of `render`, with defaults where they are None.

    Args:
        render_mode: the checked mode; None for an environment without pictures, which takes none of the others.
        width: width of a picture, pixels; a window, mode human, has its own size.
        height: height of a picture, pixels; see `width`.
        camera_id: a camera, which `check_camera` checks.

    Raises:
        ValueError: an argument that has no effect in this mode, no integer, or a picture that is too large.
    """
    size = {"width": width, "height": height}
    arguments: dict[str, Any] = {**size, "camera_id": camera_id}
    for name, value in arguments.items():
        if value is not None and render_mode is None:
            raise ValueError(f"{name}={checks.preview(value)}: goes with a render_mode, such as 'rgb_array'")
    for name, value in size.items():
        if value is not None and render_mode == "human":
            raise ValueError(f"{name}={checks.preview(value)}: expected none, as the window has its own size")
    given_arguments = {name: value for name, value in arguments.items() if value is not None}
    picture_options = {**_DEFAULT_OPTIONS, **given_arguments}
    check_size(picture_options["height"], picture_options["width"])
    return picture_options


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
        ValueError: it has no such camera.
    """
    cameras = [model.camera(index).name for index in range(model.ncam)]
    if isinstance(camera_id, str):
        checks.name(camera_id, cameras, "camera")
    elif isinstance(camera_id, mujoco.MjvCamera):
        raise ValueError(f"camera_id: expected one of {cameras}; an MjvCamera is for physics.render")
    elif not isinstance(camera_id, Integral) or camera_id not in range(-1, len(cameras)):
        raise ValueError(
            f"no camera {checks.preview(camera_id)}: expected -1 (free) to {len(cameras) - 1}, or one of {cameras}"
        )


def check_placed_camera(model: mujoco.MjModel, camera: mujoco.MjvCamera) -> None:
    """Check that a placed camera is free, or belongs to a part or camera of a model.

    Raises:
        ValueError: it does not.
    """
    kinds = mujoco.mjtCamera
    if camera.type == kinds.mjCAMERA_TRACKING:
        checks.integer("trackbodyid of the camera", camera.trackbodyid, 0, model.nbody - 1)
    elif camera.type == kinds.mjCAMERA_FIXED:
        checks.integer("fixedcamid of the camera", camera.fixedcamid, 0, model.ncam - 1)
    elif camera.type != kinds.mjCAMERA_FREE:
        raise ValueError(
            f"type of the camera: expected mjCAMERA_FREE, mjCAMERA_TRACKING or mjCAMERA_FIXED, got {camera.type}"
        )
