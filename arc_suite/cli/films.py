"""Episodes in pictures: single views, one gait cycle at a glance, films."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from arc_suite.policies import policy
from arc_suite.registry import load
from arc_suite.robots.spec import Body

FRAMES_PER_SECOND = 20  # one for each control step: real time


class Take:
    """One robot in one episode under a policy, and a camera on it.

    Attributes:
        robot: its name.
        earned: sum of the rewards so far.
        steps: control steps so far.
        ended: whether the episode is over; stepping on changes nothing then.
    """

    def __init__(self, robot: Body, policy_name: str, preset: str, seed: int, camera: str, size: tuple[int, int]):
        """Starts the episode.

        Args:
            robot: a robot, or any other body.
            policy_name: cpg, zero or random.
            preset: of the demonstrator, one of `cpg.PRESETS`.
            seed: of the episode and of the random policy.
            camera: one of `builder.CAMERAS`.
            size: width and height of a view in pixels.
        """
        self.robot = robot.name
        self.earned = 0.0
        self.steps = 0
        self._act = policy(policy_name, robot, preset, seed)
        self._environment = load(robot, "walk", {"random": seed})
        self._time_step = self._environment.reset()
        self._camera, self._size = camera, size

    @property
    def ended(self) -> bool:
        return self._time_step.last()

    @property
    def phase(self) -> float:
        """Of the gait clock, in cycles from 0 to 1."""
        sine, cosine = self._time_step.observation["gait_clock"]
        return float(np.arctan2(sine, cosine) / (2.0 * np.pi) % 1.0)

    @property
    def steps_per_cycle(self) -> float:
        """Control steps in a cycle of the gait clock."""
        frequency = self._environment.task.settings.parameters.gait_frequency
        return 1.0 / (frequency * self._environment.control_timestep())

    def step(self) -> None:
        """Advances by one control step."""
        if not self.ended:
            self._time_step = self._environment.step(self._act(self._time_step))
            self.earned += self._time_step.reward
            self.steps += 1

    def view(self) -> np.ndarray:
        """What the camera sees: (height, width, 3) uint8."""
        width, height = self._size
        return self._environment.physics.render(height, width, self._camera)

    def close(self) -> None:
        """Frees the simulation and its OpenGL context."""
        self._environment.close()


def cycle(take: Take, count: int) -> Iterator[np.ndarray]:
    """Shows the next whole gait cycle in so many views, captioned with the gait clock's phase."""
    while not take.ended and take.phase * take.steps_per_cycle >= 1.0:
        take.step()
    start = take.steps
    for i in range(count):
        while not take.ended and take.steps < start + round(i * take.steps_per_cycle / count):
            take.step()
        yield captioned(take.view(), f"phase {take.phase:.2f}")


def captioned(picture: np.ndarray, text: str) -> np.ndarray:
    """The picture with a text in its lower left corner."""
    image = Image.fromarray(picture)
    size = max(11, image.height // 22)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(image).text((size, image.height - size), text, (235, 240, 245), font, anchor="ls")
    return np.asarray(image)


def grid(pictures: Sequence[np.ndarray], columns: int) -> np.ndarray:
    """Pictures of one size, row by row; they must fill the last row."""
    rows = [np.concatenate(pictures[i : i + columns], axis=1) for i in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)


def write_png(path: Path, frames: Iterable[np.ndarray]) -> None:
    """Writes the only frame."""
    (frame,) = frames
    Image.fromarray(frame).save(path, optimize=True)


def write_mp4(path: Path, frames: Iterable[np.ndarray]) -> None:
    """Writes a film that any browser plays: H.264, yuv420p, which needs even width and height."""
    with imageio.get_writer(
        path,
        format="FFMPEG",
        fps=FRAMES_PER_SECOND,
        codec="libx264",
        pixelformat="yuv420p",
        quality=8,
        macro_block_size=2,
        output_params=["-movflags", "+faststart"],
    ) as writer:
        for frame in frames:
            writer.append_data(frame)


def write_gif(path: Path, frames: Iterable[np.ndarray]) -> None:
    """Writes a film that plays forever; one palette for all frames, undithered, keeps it small and calm."""
    frames = list(frames)
    sample = Image.fromarray(np.concatenate(frames[:: -(-len(frames) // _GIF_SAMPLES)]))
    # Of Pillow's methods the octree is the one that keeps small bright spots: eyes and glows.
    palette = sample.quantize(_GIF_COLOURS, Image.Quantize.FASTOCTREE)
    first, *others = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first.save(path, save_all=True, append_images=others, duration=1000 // FRAMES_PER_SECOND, loop=0)


_GIF_COLOURS = 128
_GIF_SAMPLES = 4  # frames that the palette is made from
WRITERS = {".png": write_png, ".mp4": write_mp4, ".gif": write_gif}
