"""Clips in pictures: frames of a loop in place, on a turntable, sheets of sprites in several directions."""

import math
from collections.abc import Iterator

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.clips import Clip
from arc_suite.models.standing import stood
from arc_suite.models.visuals.scene import MAX_HEIGHT
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl, pictures
from arc_suite.simulation.model import compiled
from arc_suite.tasks import readings

_FREE = -1  # the camera without a name
_LOOKS, _DOWN = 90.0, -20.0  # degrees: a body that is not turned goes to the right in the picture, seen from above
_MARGIN = 1.0  # around the body
_EXTENTS = 1.5  # of the scene, from which the free camera looks
_PLAIN = (0.36, 0.40, 0.45, 1.0)  # a ground without a grid, which would stand still under a body that walks in place
_NONE = (0.0, 0.0, 0.0, 0.0)
_AROUND = 6.0  # s, about what a turn on the turntable takes
_SOLID = pictures.QUALITIES["still"]  # of many pixels, body or not, whose mean is an alpha
_GROUNDED = pictures.QUALITIES["film"]


def film_pictures(
    body: Body, clip: Clip, size: int, transparent: bool = False, turntable: bool = False, heading: float = 0.0
) -> Iterator[np.ndarray]:
    """Yield the pictures of a film that plays forever, one for each frame of the clip.

    Args:
        body: of the clip.
        clip: to show; its root stays.
        size: of the square pictures, pixels.
        transparent: whether all but the body is left out.
        turntable: whether the body turns once while the clip is repeated.
        heading: of the body, rad; at 0 it goes to the right, at -pi / 2 towards the viewer.

    Yields:
        (size, size, 3 or 4) uint8; the last value is the alpha of a transparent picture.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    total = count_film_pictures(clip, turntable)
    headings = heading + np.linspace(0.0, 2.0 * np.pi * turntable, total, endpoint=False)
    yield from _views(body, clip, np.arange(total) % _count(clip), headings, size, transparent)


def count_film_pictures(clip: Clip, turntable: bool = False) -> int:
    """Return the number of pictures of a film; see `film_pictures`."""
    rounds = max(1, round(_AROUND / clip.motion.seconds)) if turntable else 1
    return rounds * _count(clip)


def sprite_sheet(body: Body, clip: Clip, size: int, directions: int, transparent: bool = False) -> np.ndarray:
    """Return one picture with a row for each direction and a column for each frame of the clip.

    The first row goes to the right in the picture; each next one is turned further to the left. Other arguments are
    those of `loop`.

    Args:
        body: of the clip.
        clip: to show.
        size: of a square, pixels.
        directions: how many.
        transparent: whether all but the body is left out.
    """
    count = _count(clip)
    headings = np.repeat(2.0 * np.pi * np.arange(directions) / directions, count)
    views = list(_views(body, clip, np.tile(np.arange(count), directions), headings, size, transparent))
    return np.concatenate([np.concatenate(views[i : i + count], axis=1) for i in range(0, len(views), count)])


def _count(clip: Clip) -> int:
    """Return the frames of a clip, without that which is the first one again."""
    return len(clip.times) - clip.loops


def _views(body: Body, clip: Clip, frames, headings, size: int, transparent: bool) -> Iterator[np.ndarray]:
    """Yield pictures (size, size, channels) of frames (n,) under headings (n,), rad."""
    poses = clip.motion._replace(root=0.0 * clip.motion.root).poses()[frames]
    poses[:, :2] = rotations.to_heading_frame(poses[:, :2], -headings)
    poses[:, 3:7] = rotations.turn_about_z(poses[:, 3:7], headings)
    model = compiled(body)
    positions = readings.positions(poses, readings.layout(model, body), stood(model))
    stage = opengl.call(lambda: _stage(body, positions[: _count(clip)], transparent))
    try:
        for qpos in positions:
            yield opengl.call(lambda qpos=qpos: _view(stage, qpos, size, transparent))
    finally:
        opengl.call(stage.free)


def _stage(body: Body, positions: np.ndarray, transparent: bool) -> pictures.Decorated:
    """Return a model to draw, with the free camera on all of it in all positions (n, nq)."""
    quality, ground = (_SOLID, _NONE) if transparent else (_GROUNDED, _PLAIN)
    stage = pictures.Decorated.from_body(body, quality=quality, ground=ground)
    model, around, above = stage.model.ptr, 0.0, 0.0
    own = model.geom_bodyid > 0
    for qpos in positions:
        stage.pose(qpos)
        places, radii = stage.data.geom_xpos[own], model.geom_rbound[own]
        around = max(around, (np.linalg.norm(places[:, :2], axis=-1) + radii).max())
        above = max(above, (places[:, 2] + radii).max())
    view, half = model.vis.global_, 0.5 * above
    view.azimuth, view.elevation = _LOOKS, _DOWN
    model.stat.center[:] = 0.0, 0.0, half
    distance = _MARGIN * math.hypot(around, half) / math.sin(math.radians(0.5 * view.fovy))
    model.vis.map.shadowclip *= model.stat.extent * _EXTENTS / distance
    model.stat.extent = distance / _EXTENTS
    return stage


def _view(stage: pictures.Decorated, qpos: np.ndarray, size: int, transparent: bool) -> np.ndarray:
    stage.pose(qpos)
    scale = min((_SOLID if transparent else _GROUNDED).scale, pictures.LARGEST * MAX_HEIGHT // size)

    def drawn(**kwargs):
        return stage.render(scale * size, scale * size, _FREE, **kwargs)

    colors = drawn()
    if not transparent:
        return pictures.smaller(colors, scale)
    parts = drawn(segmentation=True)[..., :1]
    solid = (parts >= 0) & (stage.model.ptr.geom_bodyid[parts] > 0)
    alpha = pictures.smaller(np.uint8(255) * solid, scale)
    shade = pictures.smaller(colors * solid, scale) * (255.0 / np.maximum(alpha, 1))
    return np.concatenate([shade.clip(0.0, 255.0).round().astype(np.uint8), alpha], axis=-1)
