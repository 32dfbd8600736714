"""Clips in pictures: frames of a loop in place, on a turntable, sheets of sprites in several directions."""

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.clips import Clip
from arc_suite.models.outline import geom_corners
from arc_suite.models.standing import standing_qpos
from arc_suite.models.swinging import rest_turns
from arc_suite.models.visuals.scene import MAX_HEIGHT
from arc_suite.robots.spec import Body
from arc_suite.simulation import opengl, pictures
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import readings

_FREE_CAMERA = -1  # MuJoCo's number of the camera without a name
_AZIMUTH = 90.0  # degrees: a body with heading 0 goes to the right in the picture
_ELEVATION = -20.0  # degrees: the camera looks down
_MARGIN = 1.03  # times the distance at which the body fills the picture
_WIDE = 1.25  # times the median distance of the clips of a sheet: a clip that needs more makes all others small
_EXTENTS_TO_CAMERA = 1.5  # distance of MuJoCo's free camera, in extents of the scene
_PLAIN_GROUND = (0.36, 0.40, 0.45, 1.0)  # RGBA; a grid would stand still under a body that walks in place
_NO_GROUND = (0.0, 0.0, 0.0, 0.0)
_TURN_SECONDS = 6.0  # s, about what a turn on the turntable takes
# A transparent picture is drawn with many pixels for each of its own: the share that shows the body is the alpha.
_TRANSPARENT_QUALITY = pictures.QUALITIES["still"]
_OPAQUE_QUALITY = pictures.QUALITIES["film"]


class Sheet(NamedTuple):
    """A sheet of sprites.

    Attributes:
        picture: (height, width, 3 or 4) uint8, of square cells: a row for each direction of a clip, a column for each
            frame.
        cell_size: width and height of a cell, pixels.
        ground_line: where the ground below the torso is in each cell, pixels from its top.
        pixels_per_meter: scale of the body at the vertical axis below the torso; each sheet has its own.
    """

    picture: np.ndarray
    cell_size: int
    ground_line: float
    pixels_per_meter: float


class _Pose(NamedTuple):
    """Positions (nq,) of a body, and turns (bones, 4) of its bones of ornaments."""

    qpos: np.ndarray
    swings: np.ndarray


class _Stage(NamedTuple):
    """A model to draw.

    Attributes:
        drawing: with the free camera on all of the body.
        ground_line: where the ground below the torso is in a picture, as a share of its height from the top.
        view_height: height that a picture shows at the vertical axis of the body, m.
        distances: least distance of the camera, m, at which each clip is in view.
    """

    drawing: pictures.Decorated
    ground_line: float
    view_height: float
    distances: Sequence[float]


def film_pictures(
    body: Body, clip: Clip, size: int, transparent: bool = False, turntable: bool = False
) -> Iterator[np.ndarray]:
    """Yield the pictures of a film that plays forever, one for each frame of the clip.

    Args:
        body: body of the clip.
        clip: clip to show; its root stays.
        size: size of the square pictures, pixels.
        transparent: whether all but the body is left out.
        turntable: whether the body turns once while the clip is repeated.

    Yields:
        (size, size, 3 or 4) uint8; the last value is the alpha of a transparent picture.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    picture_count = count_film_pictures(clip, turntable)
    frames = np.arange(picture_count) % count_frames(clip)
    turn = 2.0 * np.pi if turntable else 0.0
    headings = np.linspace(0.0, turn, picture_count, endpoint=False)
    poses = _list_poses(body, clip, frames, headings)
    stage = opengl.call(lambda: _prepare_stage(body, [poses[: count_frames(clip)]], transparent))
    yield from _render(stage, poses, size, transparent)


def count_film_pictures(clip: Clip, turntable: bool = False) -> int:
    """Return the number of pictures of a film; see `film_pictures`."""
    repetitions = 1
    if turntable:
        repetitions = max(1, round(_TURN_SECONDS / clip.motion.seconds))
    return repetitions * count_frames(clip)


def sprite_sheet(body: Body, clips: Sequence[Clip], size: int, directions: int, transparent: bool = False) -> Sheet:
    """Return a sheet in which a clip has a row for each direction and a column for each frame.

    The first row goes to the right in the picture; each next one is turned further to the left. All clips have one
    scale. Cells after the last frame of a clip are empty. Other arguments are those of `film_pictures`. Warns of clips
    that move so far aside that the body is small in all cells.

    Args:
        body: body of the clips.
        clips: clips to show.
        size: size of a square, pixels.
        directions: how many.
        transparent: whether all but the body is left out.
    """
    headings = 2.0 * np.pi * np.arange(directions) / directions
    frames_of_clips = [np.arange(count_frames(clip)) for clip in clips]
    poses = []
    poses_of_clips = []
    for clip, frames in zip(clips, frames_of_clips, strict=True):
        poses += _list_poses(body, clip, np.tile(frames, directions), np.repeat(headings, len(frames)))
        poses_of_clips.append(_list_poses(body, clip, frames, np.zeros(len(frames))))
    stage = opengl.call(lambda: _prepare_stage(body, poses_of_clips, transparent))
    _warn_of_wide_clips(clips, stage.distances)
    squares = list(_render(stage, poses, size, transparent))
    columns = max(map(len, frames_of_clips))
    empty_square = np.broadcast_to(squares[0][-1, 0], squares[0].shape)  # of the ground, below the horizon
    rows = []
    first = 0
    for frames in frames_of_clips:
        for _ in headings:
            row = squares[first : first + len(frames)]
            first += len(frames)
            rows.append(np.concatenate(row + [empty_square] * (columns - len(row)), axis=1))
    return Sheet(np.concatenate(rows), size, size * stage.ground_line, size / stage.view_height)


def _warn_of_wide_clips(clips: Sequence[Clip], distances: Sequence[float]) -> None:
    """Warn of clips that need so much more room than most that the body is small in all cells."""
    median = np.median(distances)
    wide_names = [clip.name for clip, distance in zip(clips, distances, strict=True) if distance > _WIDE * median]
    if wide_names:
        usual_distance = max(distance for distance in distances if distance <= _WIDE * median)
        gain = max(distances) / usual_distance
        line = f"need more room than the others: in a sheet without them the body is {gain:.1f} times as large"
        warnings.warn(f"clips {', '.join(wide_names)} {line}", stacklevel=3)


def count_frames(clip: Clip) -> int:
    """Return the number of different frames of a clip; the last one of a loop is the first one again."""
    if clip.loops:
        return len(clip.times) - 1
    return len(clip.times)


def _list_poses(body: Body, clip: Clip, frames, headings) -> list[_Pose]:
    """Return poses for frames (n,) of a clip under headings (n,), rad, with the root at 0."""
    motion_in_place = clip.motion._replace(root=np.zeros_like(clip.motion.root))
    poses = motion_in_place.poses()[frames]
    poses[:, :2] = rotations.to_heading_frame(poses[:, :2], -headings)
    poses[:, 3:7] = rotations.turn_about_z(poses[:, 3:7], headings)
    model = compile_model(body)
    positions = readings.positions(poses, readings.layout(model, body), standing_qpos(model))
    swings = rest_turns(body, len(clip.times)) if clip.swings is None else clip.swings
    return [_Pose(qpos, swings[frame]) for qpos, frame in zip(positions, frames, strict=True)]


def _render(stage: _Stage, poses: Sequence[_Pose], size: int, transparent: bool) -> Iterator[np.ndarray]:
    """Yield pictures (size, size, channels) of poses, and free the stage."""
    try:
        for pose in poses:
            yield opengl.call(lambda pose=pose: _render_pose(stage, pose, size, transparent))
    finally:
        opengl.call(stage.drawing.free)


def _prepare_stage(body: Body, poses_of_clips: Sequence[Sequence[_Pose]], transparent: bool) -> _Stage:
    """Return a model to draw, with the free camera on all of the body in all poses of clips."""
    if transparent:
        drawing = pictures.Decorated.from_body(body, quality=_TRANSPARENT_QUALITY, ground=_NO_GROUND)
    else:
        drawing = pictures.Decorated.from_body(body, quality=_OPAQUE_QUALITY, ground=_PLAIN_GROUND)
    model = drawing.model.ptr
    outlines = [_measure_outline(drawing, poses) for poses in poses_of_clips]
    height = max(heights.max() for _, heights in outlines)
    camera = model.vis.global_
    camera.azimuth = _AZIMUTH
    camera.elevation = _ELEVATION
    model.stat.center[:] = 0.0, 0.0, 0.5 * height
    half_view = math.radians(0.5 * camera.fovy)
    distances = [_find_distance(radii, heights - 0.5 * height, half_view) for radii, heights in outlines]
    distance = _MARGIN * max(distances)
    model.vis.map.shadowclip *= model.stat.extent * _EXTENTS_TO_CAMERA / distance
    model.stat.extent = distance / _EXTENTS_TO_CAMERA
    # The ground is half a height below the point that the camera looks at.
    depth = distance - 0.5 * height * math.sin(math.radians(_ELEVATION))
    drop = 0.5 * height * math.cos(math.radians(_ELEVATION))
    return _Stage(
        drawing,
        ground_line=0.5 + 0.5 * drop / (depth * math.tan(half_view)),
        view_height=2.0 * distance * math.tan(half_view),
        distances=distances,
    )


def _measure_outline(drawing: pictures.Decorated, poses: Sequence[_Pose]) -> tuple[np.ndarray, np.ndarray]:
    """Return distances from the vertical axis and heights, (n,) m, of the corners of boxes around geoms in poses."""
    model = drawing.model.ptr
    is_body_geom = model.geom_bodyid > 0
    points_of_poses = []
    for pose in poses:
        drawing.pose(pose.qpos, swings=pose.swings)
        points_of_poses.append(geom_corners(model, drawing.data)[is_body_geom])
    points = np.concatenate(points_of_poses).reshape(-1, 3)
    return np.linalg.norm(points[:, :2], axis=-1), points[:, 2]


def _find_distance(radii: np.ndarray, heights: np.ndarray, half_view: float) -> float:
    """Return the least distance of a camera, m, that sees points in whichever direction the body turns.

    A point that turns about the vertical axis has a largest distance from the camera's plane and from each edge of the
    picture: it is in view if its offset is at most tan(half_view) times its depth.

    Args:
        radii: (n,) distances of the points from the vertical axis, m.
        heights: (n,) heights of the points over the point that the camera looks at, m.
        half_view: half of the field of view, rad.
    """
    slope = 1.0 / math.tan(half_view)
    sine = math.sin(math.radians(-_ELEVATION))
    cosine = math.cos(math.radians(-_ELEVATION))
    to_sides = heights * sine + radii * math.hypot(cosine, slope)
    to_top = heights * (sine + slope * cosine) + radii * abs(cosine - slope * sine)
    to_bottom = heights * (sine - slope * cosine) + radii * abs(cosine + slope * sine)
    return float(np.concatenate([to_sides, to_top, to_bottom]).max())


def _render_pose(stage: _Stage, pose: _Pose, size: int, transparent: bool) -> np.ndarray:
    """Return a picture (size, size, 3 or 4), drawn larger and reduced."""
    drawing = stage.drawing
    drawing.pose(pose.qpos, swings=pose.swings)
    quality = _TRANSPARENT_QUALITY if transparent else _OPAQUE_QUALITY
    scale = min(quality.scale, pictures.MAX_SCALE * MAX_HEIGHT // size)  # pixels drawn, for each of the picture
    colors = drawing.render(scale * size, scale * size, _FREE_CAMERA)
    if not transparent:
        return pictures.shrink(colors, scale)
    geoms = drawing.render(scale * size, scale * size, _FREE_CAMERA, segmentation=True)[..., :1]  # -1 where none is
    shows_body = (geoms >= 0) & (drawing.model.ptr.geom_bodyid[geoms] > 0)
    alpha = pictures.shrink(np.uint8(255) * shows_body, scale)
    premultiplied = pictures.shrink(colors * shows_body, scale)
    straight_colors = premultiplied * (255.0 / np.maximum(alpha, 1))
    return np.concatenate([straight_colors.clip(0.0, 255.0).round().astype(np.uint8), alpha], axis=-1)
