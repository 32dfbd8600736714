"""Episodes in pictures: single views, one gait cycle at a glance, films."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO

import imageio.v2 as imageio
import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from arc_suite import versions
from arc_suite.models.builder import EYE
from arc_suite.simulation.episode_loop import play_episode

_ROUNDING = 1e-6  # control steps
_SHORTEST_FRAME = 0.02  # s; players show the frames of a GIF that ask for less at a pace of their own


class Footage:
    """One robot in one episode under a policy, and a camera on it.

    Attributes:
        robot: its name.
        earned: sum of the rewards so far.
        steps: control steps so far.
        advance: cycles that the gait clock made in the latest step; 0 before the first, or without a gait clock.
    """

    def __init__(
        self, robot: str, environment, policy: Callable, camera: str, size: tuple[int, int], quality: str = "film"
    ):
        """Start the episode.

        Args:
            robot: its name.
            environment: of `arc_suite.load`; the take closes it.
            policy: maps a `TimeStep` to an action.
            camera: one of `builder.CAMERAS`.
            size: width and height of a view in pixels.
            quality: of views; see `pictures.QUALITIES`. The eye has its own.
        """
        self.robot = robot
        self.earned = 0.0
        self.steps = 0
        self.advance = 0.0
        self._environment = environment
        self._episode = play_episode(environment, policy)
        self._time_step = next(self._episode)
        self._before = self._state()
        self._camera, self._size, self._quality = camera, size, None if camera == EYE else quality

    @property
    def ended(self) -> bool:
        """Whether the episode is over; stepping on changes nothing then."""
        return self._time_step.last()

    @property
    def phase(self) -> float:
        """Phase of the gait clock, in cycles from 0 to 1; 0 in a task that has none."""
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
        before, self._before = self.phase, self._state()
        self._time_step = next(self._episode)
        self.advance = (self.phase - before) % 1.0
        self.earned += self._time_step.reward
        self.steps += 1

    def view(self, share: float = 1.0) -> np.ndarray:
        """Return what the camera sees.

        Args:
            share: of the latest control step that is over; the pose between its ends is a cubic through both.

        Returns:
            (height, width, 3) uint8.
        """
        (width, height), physics = self._size, self._environment.physics
        qpos = physics.data.qpos if share == 1.0 else self.between(share)
        return physics.render(height, width, self._camera, quality=self._quality, qpos=qpos)

    def at(self, time: float) -> np.ndarray:
        """Step on until a time of the episode, s, and return what the camera sees then."""
        steps = time / self.control_timestep
        while not self.ended and self.steps < steps - _ROUNDING:
            self.step()
        share = 1.0 - (self.steps - steps)
        return self.view(share if _ROUNDING < share < 1.0 - _ROUNDING else 1.0)

    def _state(self) -> tuple[np.ndarray, np.ndarray]:
        data = self._environment.physics.data
        return data.qpos.copy(), data.qvel.copy()

    def between(self, share: float) -> np.ndarray:
        """Return positions (nq,) at a share of the latest control step: Hermite's cubic, by velocities at its ends."""
        (start, velocity), (end, last) = self._before, self._state()
        model, way = self._environment.physics.model.ptr, np.empty_like(velocity)
        mujoco.mj_differentiatePos(model, way, 1.0, start, end)
        rest, step = 1.0 - share, self.control_timestep
        way *= share**2 * (1.0 + 2.0 * rest)
        way += step * share * rest * (rest * velocity - share * last)
        qpos = start.copy()
        mujoco.mj_integratePos(model, qpos, way, 1.0)
        return qpos

    def close(self) -> None:
        """Free the simulation and its OpenGL context."""
        self._environment.close()


def cycle(footage: Footage, count: int) -> Iterator[np.ndarray]:
    """Yield views of the next whole gait cycle, evenly spaced, captioned with the gait clock's phase.

    Args:
        footage: whose gait clock advanced in the latest step.
        count: of views.
    """
    while not footage.ended and not (footage.phase + 0.5 * footage.advance) % 1.0 < footage.advance:
        footage.step()
    start = footage.steps
    for i in range(count):
        while not footage.ended and footage.steps < start + round(i / (count * footage.advance)):
            footage.step()
        yield captioned(footage.view(), f"phase {footage.phase:.2f}")


def frames(footages: Sequence[Footage], seconds: float, frame: float) -> Iterator[list[np.ndarray]]:
    """Yield views of several episodes at equal times until all have ended.

    Args:
        footages: of the episodes.
        seconds: of the film.
        frame: seconds that a frame lasts; the last one shows the end.
    """
    start = footages[0].steps * footages[0].control_timestep
    for number in range(1, math.ceil(seconds / frame - _ROUNDING) + 1):
        yield [footage.at(start + min(number * frame, seconds)) for footage in footages]
        if all(footage.ended for footage in footages):
            return


def frame_seconds(control_timestep: float) -> float:
    """Return how long a frame of a film lasts, s: whole control steps, of a pace that players keep."""
    return control_timestep * math.ceil(_SHORTEST_FRAME / control_timestep)


def check_fps(fps: float, extension: str) -> None:
    """Check that players show so many frames a second of a film.

    Raises:
        ValueError: more than those of a GIF.
    """
    if extension == ".gif" and fps * _SHORTEST_FRAME > 1.0:
        raise ValueError(f"fps: expected at most {1.0 / _SHORTEST_FRAME:g} for a GIF, got {fps:g}")


def captioned(picture: np.ndarray, text: str, size: int | None = None) -> np.ndarray:
    """Return the picture with a text in its lower left corner, of a size in pixels that by default suits its height."""
    image = Image.fromarray(picture)
    size = size or max(11, image.height // 22)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(image).text((size, image.height - size), text, (235, 240, 245), font, anchor="ls")
    return np.asarray(image)


def grid(pictures: Sequence[np.ndarray], columns: int) -> np.ndarray:
    """Return pictures of one size side by side, row by row; black fills the last row."""
    pictures = [*pictures, *(-len(pictures) % columns * [np.zeros_like(pictures[0])])]
    rows = [np.concatenate(pictures[i : i + columns], axis=1) for i in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)


def write_png(path: Path, frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write the only frame, however many seconds it stands for."""
    (frame,) = frames
    Image.fromarray(frame).save(path, optimize=True)


def write_mp4(path: Path, frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write a film that any browser plays: H.264, yuv420p, which needs even width and height.

    Args:
        path: of the file.
        frames: (height, width, 3) uint8.
        seconds: that a frame lasts.

    Raises:
        ValueError: imageio-ffmpeg is not installed.
    """
    with versions.require_extra("MP4 needs imageio-ffmpeg", "video"):
        import imageio_ffmpeg  # noqa: F401
    with imageio.get_writer(
        path,
        format="FFMPEG",
        fps=1.0 / seconds,
        codec="libx264",
        pixelformat="yuv420p",
        quality=8,
        macro_block_size=2,
        output_params=["-movflags", "+faststart"],
    ) as writer:
        for frame in frames:
            writer.append_data(frame)  # type: ignore[attr-defined]  # imageio names the base of writers and readers


def write_gif(path: Path | IO[bytes], frames: Iterable[np.ndarray], seconds: float) -> None:
    """Write a film that plays forever; one palette for all frames, undithered, keeps it small and calm.

    Args:
        path: of the file, or an open one.
        frames: (height, width, 3) uint8.
        seconds: that a frame lasts; the format counts in hundredths, so single frames are off by less than one.
    """
    frames = list(frames)
    sample = Image.fromarray(np.concatenate(frames[:: -(-len(frames) // _GIF_SAMPLES)]))
    # Of Pillow's methods the octree is the one that keeps small bright spots: eyes and glows.
    palette = sample.quantize(_GIF_COLORS, Image.Quantize.FASTOCTREE)
    first, *others = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    durations = _durations(len(frames), seconds, 10)
    first.save(path, "GIF", save_all=True, append_images=others, duration=durations, loop=0)


def write_webp(path: Path | IO[bytes], frames: Iterable[np.ndarray], seconds: float, quality: int = 50) -> None:
    """Write a film that plays forever, in full colors; arguments as of `write_gif`, and Pillow's `quality`.

    The encoder's best method takes twenty times as long for a size that is at most 5 % smaller.
    """
    first, *others = map(Image.fromarray, frames)
    durations = _durations(1 + len(others), seconds, 1)
    first.save(
        path, "WEBP", save_all=True, append_images=others, duration=durations, loop=0, quality=quality, method=_METHOD
    )


def _durations(count: int, seconds: float, unit: int) -> list[int]:
    """How long each frame lasts, ms, in a format that counts in a unit, ms; their sum is off by less than one."""
    ends = [round(1000.0 * seconds * frame / unit) for frame in range(count + 1)]
    return [unit * (end - start) for start, end in itertools.pairwise(ends)]


_METHOD = 4  # of WebP's encoder
_GIF_COLORS = 128
_GIF_SAMPLES = 4  # frames that the palette is made from
WRITERS = {".png": write_png, ".mp4": write_mp4, ".gif": write_gif, ".webp": write_webp}
