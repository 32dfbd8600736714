"""The drawing of views: ground and light of their own, a camera that goes along, and how large the creature is."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from arc_suite import rotations
from arc_suite.models.outline import outline
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl, pictures
from media import views
from media.views import Instant, Look, View

_CAMERA = "profile"
_SUN_DISTANCE = 6.0  # of the sun from the torso, standing heights
_MAX_DRIFT = 0.05  # to a side, as a share of the way, along which tiles of the ground still meet
_FRAMING_INTERVAL = 8  # frames from one whose framing is checked to the next
MIN_SHARE = 1.0 / 3.0  # of the width of a picture, that a creature has


class Camera:
    """A camera that stands, or goes along a straight line, and looks at the torso."""

    def __init__(self, view: View, body: Body, poses: np.ndarray):
        """Fit the line to the torso's poses (frames, 7)."""
        positions = poses[:, :3]
        degree = 1 if view.drives and len(poses) > 1 else 0
        self._line = np.polynomial.polynomial.polyfit(np.arange(len(poses)), positions, degree)
        azimuth = rotations.yaw(poses[len(poses) // 2, 3:7]) + math.radians(view.azimuth)
        elevation = math.radians(view.elevation)
        reach = abs(outline(body)[..., :2]).max()  # m, of the farthest foot
        horizontal = np.array((math.cos(azimuth), math.sin(azimuth), 0.0))
        vertical = np.array((0.0, 0.0, 1.0))
        direction = math.cos(elevation) * horizontal + math.sin(elevation) * vertical
        self._offset = view.distance * reach * direction  # m, of the camera from what it looks at
        self._up = math.cos(elevation) * vertical - math.sin(elevation) * horizontal
        self._from_torso = np.array((0.0, 0.0, view.aim * body.torso.standing_height))

    def aim(self, scene, frame: int) -> None:
        """Aim the cameras of a scene at a frame."""
        target = np.polynomial.polynomial.polyval(frame, self._line) + self._from_torso
        for camera in scene.camera:
            camera.pos = target + self._offset
            camera.up = self._up
            camera.forward = -self._offset / np.linalg.norm(self._offset)

    @property
    def way(self) -> np.ndarray:
        """The way (3,) in a frame, m."""
        return self._line[1] if len(self._line) > 1 else np.zeros(3)


def pictures_of(view: View, size: tuple[int, int], is_film: bool) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of a view: of all frames of its film, or of its moment alone.

    Raises:
        ValueError: the creature is narrower than `MIN_SHARE` of a picture, or an edge cuts it.
    """
    environment = views.open_environment(view)
    film = views.film_instants(view, environment)
    still = None if is_film else views.still_instant(view, environment)
    still_frame = round(view.moment * environment.control_timestep() * views.FPS)
    environment.close()
    body = environment.task.body
    camera = Camera(view, body, np.array([instant.qpos[:7] for instant in film]))
    stage = Stage(body, environment.physics.arena, view.look, camera, view.frames)
    try:
        stage.check_framing(film, size)
        if still is not None:
            yield stage.draw(still, still_frame, size, pictures.QUALITIES["still"].scale)
            return
        film_pictures = [
            stage.draw(instant, frame, size, pictures.QUALITIES["film"].scale) for frame, instant in enumerate(film)
        ]
        yield from close(film_pictures, view.fade)
    finally:
        stage.close()


def close(film: Sequence[np.ndarray], fade: int) -> list[np.ndarray]:
    """Return a film (height, width, 3) without its first pictures, into which its last ones fade."""
    closed = list(film[fade:])
    for number, before in enumerate(film[:fade]):
        share = (number + 1) / (fade + 1)
        index = len(closed) - fade + number
        closed[index] = np.rint((1.0 - share) * closed[index] + share * before).astype(np.uint8)
    return closed


class Stage:
    """A body in an arena, in the look of a view."""

    def __init__(self, body: Body, arena, look: Look, camera: Camera, frames: int):
        """Compile the body and set ground and light; tiles of a level ground meet after so many frames."""
        self._camera = camera
        quality = pictures.QUALITIES["film"]._replace(shadows=look.shadows)
        self._drawing = opengl.call(lambda: pictures.Decorated.from_body(body, arena, quality))
        model = self._drawing.model.ptr
        _color_texture(model, "ground", look.ground)
        _color_texture(model, "sky", look.sky)
        model.vis.rgba.haze[:3] = look.sky  # as the sky is at the horizon
        _set_light(model, look, body.torso.standing_height)
        displacement = frames * camera.way
        if arena.is_level and abs(displacement[0]) > 0.0 and abs(displacement[1]) < _MAX_DRIFT * abs(displacement[0]):
            _fit_tiles(model, abs(displacement[0]))

    def draw(self, instant: Instant, frame: int, size: tuple[int, int], scale: int) -> np.ndarray:
        """Return the picture (height, width, 3) of an instant, drawn larger by a scale and averaged."""
        width, height = size
        return pictures.shrink(self._render(instant, frame, scale * width, scale * height), scale)

    def check_framing(self, film: Sequence[Instant], size: tuple[int, int]) -> None:
        """Raise ValueError where the creature is narrower than `MIN_SHARE`, or reaches an edge of the picture."""
        width, height = size
        model = self._drawing.model.ptr
        is_creature = (model.geom_bodyid > 0) & (model.body_mocapid[model.geom_bodyid] < 0)  # mocap: obstacles
        for frame in {*range(0, len(film), _FRAMING_INTERVAL), len(film) - 1}:
            geoms = self._render(film[frame], frame, width, height, segmentation=True)[..., 0]
            shows_body = (geoms >= 0) & is_creature[geoms]
            columns = np.flatnonzero(shows_body.any(axis=0))
            share = (np.ptp(columns) + 1) / width if len(columns) else 0.0
            if share < MIN_SHARE:
                raise ValueError(f"frame {frame}: the creature has {share:.2f} of the width, at least {MIN_SHARE:.2f}")
            edges = (shows_body[:, 0], shows_body[:, -1], shows_body[0], shows_body[-1])
            for name, edge in zip(("left", "right", "top", "bottom"), edges, strict=True):
                if edge.any():
                    raise ValueError(f"frame {frame}: the {name} edge cuts the creature")

    def _render(self, instant: Instant, frame: int, width: int, height: int, **kwargs) -> np.ndarray:
        def render():
            self._drawing.pose(instant.qpos, None, instant.mocap_pos, instant.markers, instant.failed_legs)
            return self._drawing.render(
                height, width, _CAMERA, scene_callback=lambda _, scene: self._camera.aim(scene, frame), **kwargs
            )

        return opengl.call(render)

    def close(self) -> None:
        """Free the model."""
        opengl.call(self._drawing.free)


def _color_texture(model, name: str, color: Sequence[float]) -> None:
    """Give a texture another mean color (3,), 0 to 1; its parts keep their contrast."""
    texture = model.texture(name)
    first = texture.adr[0]
    count = texture.height[0] * texture.width[0] * texture.nchannel[0]
    pixels = model.tex_data[first : first + count].reshape(-1, texture.nchannel[0])
    factors = 255.0 * np.array(color) / pixels.mean(axis=0)
    pixels[:] = np.clip(pixels * factors, 0.0, 255.0).round()


def _set_light(model, look: Look, height: float) -> None:
    """Set direction and color of the sun, and the color of shade, in a model of a creature of a height, m."""
    direction = np.array(look.sun) / np.linalg.norm(look.sun)
    sun = model.light("sun").id
    model.light_dir[sun] = direction
    model.light_dir0[sun] = direction
    model.light_poscom0[sun] = -_SUN_DISTANCE * height * direction
    model.light_diffuse[sun] = look.sunlight
    model.vis.headlight.ambient[:] = look.shade


def _fit_tiles(model, way: float) -> None:
    """Make pairs of tiles of a level ground fit into the way, m, so that they lie as before at its end.

    A plane spans two units of its texture's coordinates, so that a pair of tiles is 2 / repeats long.
    """
    material = model.material("ground").id
    repeats = model.mat_texrepeat[material, 0]
    pairs = max(1, round(0.5 * way * repeats))
    model.mat_texrepeat[material] = 2.0 * pairs / way
