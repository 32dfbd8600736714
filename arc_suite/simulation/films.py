"""Episodes in pictures: single views, one gait cycle at a glance, films."""

import contextlib
import errno
import fractions
import itertools
import math
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from arc_suite import versions
from arc_suite.models.builder import EYE
from arc_suite.models.swinging import Swinging, list_bones
from arc_suite.simulation.episode_loop import play_episode

_TOLERANCE = 1e-6  # control steps, of times
_MIN_FRAME_SECONDS = 0.02  # players change the pace of a GIF with shorter frames
_MP4_CRF = 10  # constant rate factor of the encoder, 0 to 51; the lower, the better
_WEBP_METHOD = 4  # of the encoder, 0 to 6
_BOX_HEADER = 16  # bytes at the beginning of a box of MP4: size, kind, and the size once more where it is long
_MIN_BOX = 8  # bytes
_CAPTION_COLOR = (235, 240, 245)
_CAPTION_SCALE = 4  # pixels drawn for each of a caption along its sides
_EMPTY_COLOR = (92, 102, 115)  # that of plain ground
_PNG_COLORS = 256  # of a picture with a palette; the format has no more
_GIF_COLORS = 128
_GIF_SAMPLES = 4  # frames from which the palette is made


class Footage:
    """One robot in one episode under a policy, and a camera on it.

    Attributes:
        robot: its name.
        episode_return: sum of the rewards so far.
        steps: control steps so far.
        advance: advance of the gait clock in the latest step, cycles; 0 before the first step, or without a gait clock.
    """

    def __init__(
        self, robot: str, environment, policy: Callable, camera: str, size: tuple[int, int], quality: str = "film"
    ):
        """Start the episode.

        Args:
            robot: its name.
            environment: environment of `arc_suite.load`; `close` closes it.
            policy: maps a `TimeStep` to an action.
            camera: one of `builder.CAMERAS`.
            size: width and height of a view in pixels.
            quality: quality of views; see `pictures.QUALITIES`. The camera `eye` has another quality.
        """
        self.robot = robot
        self.episode_return = 0.0
        self.steps = 0
        self.advance = 0.0
        self._environment = environment
        self._episode = play_episode(environment, policy)
        self._time_step = next(self._episode)
        self._state_before = self._state()  # at the start of the latest step
        self._swinging = Swinging(list_bones(environment.physics.body))
        self._camera = camera
        self._size = size
        self._quality = None if camera == EYE else quality

    @property
    def ended(self) -> bool:
        """Whether the episode is over; further steps change nothing."""
        return self._time_step.last()

    @property
    def phase(self) -> float:
        """Phase of the gait clock, in cycles from 0 to 1; 0 in a task without a gait clock."""
        sine, cosine = self._time_step.observation.get("gait_clock", (0.0, 1.0))
        return float(np.arctan2(sine, cosine) / (2.0 * np.pi) % 1.0)

    @property
    def control_timestep(self) -> float:
        """Seconds in a control step."""
        return self._environment.control_timestep()

    def step(self) -> None:
        """Advance by one control step."""
        if self.ended:
            return
        self._follow_ornaments(self.steps, self._environment.physics.data.qpos)
        phase_before = self.phase
        self._state_before = self._state()
        self._time_step = next(self._episode)
        self.advance = (self.phase - phase_before) % 1.0
        self.episode_return += self._time_step.reward
        self.steps += 1

    def view(self, share: float = 1.0) -> np.ndarray:
        """Return the picture (height, width, 3) uint8 of the camera.

        Args:
            share: share of the latest control step, at which the pose is interpolated; 1 for its end.
        """
        width, height = self._size
        physics = self._environment.physics
        qpos = physics.data.qpos if share == 1.0 else self.interpolate(share)
        swings = self._follow_ornaments(self.steps - 1.0 + share, qpos)
        return physics.render(height, width, self._camera, quality=self._quality, qpos=qpos, swings=swings)

    def at(self, time: float) -> np.ndarray:
        """Step until a time of the episode, s, and return the picture at that time."""
        steps = time / self.control_timestep
        while not self.ended and self.steps < steps - _TOLERANCE:
            self.step()
        share = 1.0 - (self.steps - steps)
        is_between_steps = _TOLERANCE < share < 1.0 - _TOLERANCE
        return self.view(share if is_between_steps else 1.0)

    def _follow_ornaments(self, steps: float, qpos: np.ndarray) -> list[np.ndarray]:
        """Return how bones of ornaments are turned in the torso's frame, (4,) each, as they follow the torso.

        Args:
            steps: control steps since the start of the episode; not fewer than in the last call.
            qpos: (nq,) positions of the simulation at that time.
        """
        arena = self._environment.physics.arena
        return self._swinging.follow(steps * self.control_timestep, qpos[:7], arena)

    def _state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return qpos (nq,) and qvel (nv,)."""
        data = self._environment.physics.data
        return data.qpos.copy(), data.qvel.copy()

    def interpolate(self, share: float) -> np.ndarray:
        """Return positions (nq,) at a share of the latest control step."""
        model = self._environment.physics.model.ptr
        return interpolate(model, self._state_before, self._state(), share, self.control_timestep)

    def close(self) -> None:
        """Free the simulation and its OpenGL context."""
        self._environment.close()


def interpolate(
    model: mujoco.MjModel,
    before: tuple[np.ndarray, np.ndarray],
    after: tuple[np.ndarray, np.ndarray],
    share: float,
    seconds: float,
) -> np.ndarray:
    """Return positions (nq,) between two states: Hermite's cubic, by the velocities at its ends.

    Args:
        model: model of both.
        before: positions (nq,) and velocities (nv,).
        after: the same, later.
        share: share of the time between them, 0 to 1.
        seconds: time between them.
    """
    start, start_velocity = before
    end, end_velocity = after
    displacement = np.empty_like(start_velocity)
    mujoco.mj_differentiatePos(model, displacement, 1.0, start, end)
    remaining = 1.0 - share
    displacement *= share**2 * (1.0 + 2.0 * remaining)
    tangents = remaining * start_velocity - share * end_velocity
    displacement += seconds * share * remaining * tangents
    qpos = start.copy()
    mujoco.mj_integratePos(model, qpos, displacement, 1.0)
    return qpos


def cycle(footage: Footage, count: int) -> Iterator[np.ndarray]:
    """Yield views of the next whole gait cycle, evenly spaced, captioned with the gait clock's phase.

    Args:
        footage: an episode whose gait clock advanced in the latest step; it rests where a command stops the body.
        count: number of views.
    """
    advance = footage.advance
    while not footage.ended and footage.advance and not _is_nearest_to_start_of_cycle(footage):
        footage.step()
    start = footage.steps
    for number in range(count):
        while not footage.ended and footage.steps < start + round(number / (count * advance)):
            footage.step()
        yield add_caption(footage.view(), f"phase {footage.phase:.2f}")


def _is_nearest_to_start_of_cycle(footage: Footage) -> bool:
    return (footage.phase + 0.5 * footage.advance) % 1.0 < footage.advance


def frames(footages: Sequence[Footage], seconds: float, frame: float) -> Iterator[list[np.ndarray]]:
    """Yield views of several episodes at equal times until all have ended.

    Args:
        footages: footages of the episodes.
        seconds: duration of the film.
        frame: duration of a frame, s; the last one shows the end.
    """
    start = footages[0].steps * footages[0].control_timestep
    for number in range(1, math.ceil(seconds / frame - _TOLERANCE) + 1):
        yield [footage.at(start + min(number * frame, seconds)) for footage in footages]
        if all(footage.ended for footage in footages):
            return


def frame_seconds(control_timestep: float) -> float:
    """Return the duration of a frame of a film, s: a whole number of control steps, not shorter than players show."""
    return control_timestep * math.ceil(_MIN_FRAME_SECONDS / control_timestep)


def check_fps(fps: float, extension: str) -> None:
    """Check that players show a film at so many frames a second.

    Raises:
        ValueError: they do not, as it is a GIF with too many.
    """
    if extension == ".gif" and fps * _MIN_FRAME_SECONDS > 1.0:
        raise ValueError(f"fps: expected at most {1.0 / _MIN_FRAME_SECONDS:g} for a GIF, got {fps:g}")


def add_caption(picture: np.ndarray, text: str, size: int | None = None) -> np.ndarray:
    """Return the picture with a text in its lower left corner, of a size in pixels, by default by its height."""
    image = Image.fromarray(picture)
    if size is None:
        size = max(11, image.height // 22)
    # Letters of a few pixels would stand at whole pixels, some too close together: they are drawn larger.
    letters = Image.new("L", (_CAPTION_SCALE * image.width, _CAPTION_SCALE * image.height))
    font = ImageFont.load_default(_CAPTION_SCALE * size)
    corner = (_CAPTION_SCALE * size, letters.height - _CAPTION_SCALE * size)
    ImageDraw.Draw(letters).text(corner, text, 255, font, anchor="ls")
    image.paste(_CAPTION_COLOR, mask=letters.resize(image.size, Image.Resampling.BOX))
    return np.asarray(image)


def empty_cell(shape: tuple[int, ...]) -> np.ndarray:
    """Return a picture (height, width, 3) of a plain color, for a cell of a grid that shows nothing."""
    return np.full(shape, _EMPTY_COLOR, np.uint8)


def grid(pictures: Sequence[np.ndarray], columns: int) -> np.ndarray:
    """Return pictures of one size side by side, row by row; a plain color fills the last row."""
    empty_cells = -len(pictures) % columns
    cells = [*pictures, *empty_cells * [empty_cell(pictures[0].shape)]]
    rows = [np.concatenate(cells[first : first + columns], axis=1) for first in range(0, len(cells), columns)]
    return np.concatenate(rows, axis=0)


def write_png(path: Path, frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write the only frame; the duration has no effect."""
    (frame,) = frames
    Image.fromarray(frame).save(path, optimize=True)


def write_small_png(path: Path, picture: Image.Image, dithers: bool = False) -> None:
    """Write a picture with a palette of its own: about half the size.

    Args:
        path: path of the file.
        picture: picture of any colors.
        dithers: whether dots mix colors of the palette, as a rendered picture needs; a plot has few colors.
    """
    colors = picture.convert("RGB")
    palette = colors.quantize(_PNG_COLORS, Image.Quantize.MEDIANCUT, kmeans=1)
    dither = Image.Dither.FLOYDSTEINBERG if dithers else Image.Dither.NONE
    colors.quantize(palette=palette, dither=dither).save(path, "PNG", optimize=True)


def write_mp4(path: Path, frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write a film that any browser plays: H.264, yuv420p, which needs even width and height.

    Args:
        path: path of the file.
        frames: (height, width, 3) uint8.
        seconds: duration of a frame.

    Raises:
        ValueError: imageio-ffmpeg is not installed.
        OSError: ffmpeg cannot write the file.
    """
    with versions.require_extra("MP4 needs imageio-ffmpeg", "video"):
        import imageio_ffmpeg
    frames = iter(frames)
    first_frame = next(frames)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), *_encoder_arguments(first_frame.shape, seconds), str(path)]
    # In a session of its own, Ctrl-C in the terminal does not reach ffmpeg, which would write half a film.
    encoder = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        with contextlib.suppress(BrokenPipeError):  # ffmpeg has ended early
            for frame in itertools.chain([first_frame], frames):
                encoder.stdin.write(frame.tobytes())
            encoder.stdin.close()
        encoder.wait()
    finally:
        encoder.kill()  # where an exception has left it running
        encoder.wait()
        with contextlib.suppress(BrokenPipeError):
            encoder.stdin.close()
    if encoder.returncode:
        raise OSError(errno.EIO, "ffmpeg has not written all of it")
    _check_mp4(path)


def _check_mp4(path: Path) -> None:
    """Raise OSError for a film without its end, as ffmpeg leaves one where the disk is full, and says nothing.

    The file is a row of boxes: each begins with its size, bytes, and its kind. `moov` holds the places of the frames.
    """
    file_size = path.stat().st_size
    kinds = []
    place = 0
    with path.open("rb") as file:
        while place < file_size:
            file.seek(place)
            header = file.read(_BOX_HEADER)
            size = int.from_bytes(header[:4], "big")
            if size == 1:  # the size follows as a long number
                size = int.from_bytes(header[8:], "big")
            if size < _MIN_BOX:
                break
            kinds.append(header[4:8])
            place += size
    if place != file_size or not {b"moov", b"mdat"} <= set(kinds):
        raise OSError(errno.EIO, "ffmpeg has not written all of it")


def _encoder_arguments(shape: Sequence[int], seconds: float) -> list[str]:
    """Return the arguments with which ffmpeg reads raw frames (height, width, 3) and encodes them."""
    height, width, _ = shape
    fps = fractions.Fraction(1.0 / seconds).limit_denominator()
    even_size = f"scale={width + width % 2}:{height + height % 2}"
    arguments = f"""
        -y -v error -f rawvideo -vcodec rawvideo -s {width}x{height} -pix_fmt rgb24 -r {fps} -i - -an
        -vcodec libx264 -pix_fmt yuv420p -crf {_MP4_CRF} -vf {even_size} -movflags +faststart
        """
    return arguments.split()


def write_gif(path: Path | IO[bytes], frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write a film that repeats; one palette for all frames, without dithering, keeps it small and steady.

    Args:
        path: path of the file, or an open one.
        frames: (height, width, 3) uint8.
        seconds: duration of a frame. The format counts in hundredths of a second, to which frames are rounded.
    """
    frames = list(frames)
    samples = frames[:: math.ceil(len(frames) / _GIF_SAMPLES)]
    # Of Pillow's methods, the octree alone keeps small bright spots, such as eyes and glows.
    palette = Image.fromarray(np.concatenate(samples)).quantize(_GIF_COLORS, Image.Quantize.FASTOCTREE)
    images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    min_duration = round(1000.0 * _MIN_FRAME_SECONDS)  # ms: rounding alone would make some frames shorter
    durations = [max(duration, min_duration) for duration in _durations(len(frames), seconds, unit=10)]
    images[0].save(path, "GIF", save_all=True, append_images=images[1:], duration=durations, loop=0)


def write_webp(path: Path | IO[bytes], frames: Iterable[np.ndarray], seconds: float, quality: int = 50) -> None:
    """Write a film that repeats, in full colors; arguments as of `write_gif`, and Pillow's `quality`.

    The encoder's best method takes twenty times as long for a size that is at most 5 % smaller.
    """
    images = list(map(Image.fromarray, frames))
    images[0].save(
        path,
        "WEBP",
        save_all=True,
        append_images=images[1:],
        duration=_durations(len(images), seconds, unit=1),
        loop=0,
        quality=quality,
        method=_WEBP_METHOD,
    )


def _durations(count: int, seconds: float, unit: int) -> list[int]:
    """Return the duration of each frame, ms, in multiples of a unit, ms; the error of their sum is less than a unit."""
    ends = [round(1000.0 * seconds * frame / unit) for frame in range(count + 1)]
    return [unit * (end - start) for start, end in itertools.pairwise(ends)]


FILM_WRITERS = {".mp4": write_mp4, ".gif": write_gif, ".webp": write_webp}
FILM_EXTENSIONS = tuple(FILM_WRITERS)
WRITERS = {".png": write_png, **FILM_WRITERS}
