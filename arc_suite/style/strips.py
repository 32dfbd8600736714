"""Strips of frames: one gait cycle at equal phases, by which policies are compared by eye."""

from pathlib import Path

import numpy as np
from PIL import Image

from arc_suite import evaluation
from arc_suite.policies import Policy

FRAMES = 6
SETTLED = 4  # cycles before the one that is shown
WIDTH, HEIGHT, GAP = 168, 126, 4  # pixels of a frame, and between two
CAMERA = "profile"  # goes along and does not turn with the body, so that who walks sideways is seen to

_WHITE = 255
_COLOURS = 64


def ticks(frequency: float, control_timestep: float, length: int, count: int = FRAMES) -> np.ndarray:
    """Return the control steps after which the frames of a strip are taken.

    They are the nearest to equal phases of one gait cycle, from phase 0 on: the cycle after `SETTLED` others, or
    in a shorter episode the latest of which all frames are there.

    Args:
        frequency: of the gait, Hz.
        control_timestep: s.
        length: control steps of the episode.
        count: of frames.

    Returns:
        (count,) integers; some are beyond the episode's end where it is shorter than a cycle.
    """
    steps = 1.0 / (frequency * control_timestep)  # of a cycle
    found = (np.arange(SETTLED + 1)[:, None] + np.arange(count) / count) * steps
    found = np.round(found).astype(int)
    return found[max(0, int((found[:, -1] <= length).sum()) - 1)]


def strip(environment, policy: Policy, seed: int = 0) -> np.ndarray | None:
    """Return a picture of one gait cycle in an episode: `FRAMES` views side by side.

    Args:
        environment: of `arc_suite.load`.
        policy: made for one row.
        seed: of the episode's start.

    Returns:
        (height, width, 3) uint8, white where the episode has ended before; None for a task without a gait.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """

    def view():
        return environment.physics.render(HEIGHT, WIDTH, CAMERA)

    task, dt = environment.task.definition, environment.control_timestep()
    if task.parameters is None or task.parameters.gait_frequency <= 0.0:
        return None
    frequency = task.parameters.gait_frequency
    environment.reset(seed)
    white = np.full_like(view(), _WHITE)  # finds out at once whether there is OpenGL
    longest = int(ticks(frequency, dt, np.inf)[-1])
    length = sum(1 for _ in evaluation.rollout(environment, policy, seed, longest)) - 1
    wanted = ticks(frequency, dt, length).tolist()
    played = enumerate(evaluation.rollout(environment, policy, seed, wanted[-1]))
    views = {tick: view() for tick, _ in played if tick in wanted}
    frames = [np.pad(views.get(tick, white), ((0, 0), (0, GAP), (0, 0)), constant_values=_WHITE) for tick in wanted]
    return np.concatenate(frames, axis=1)[:, :-GAP]


def write(path: Path, picture: np.ndarray) -> None:
    """Write a strip as a PNG of few colours, a quarter as large as one of all."""
    # Of Pillow's methods the octree is the one that keeps small bright spots: eyes and glows.
    few = Image.fromarray(picture).quantize(_COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    few.save(path, format="PNG", optimize=True)
