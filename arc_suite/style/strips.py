"""Strips of frames: one gait cycle at equal phases, to compare policies by eye."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from arc_suite import evaluation
from arc_suite.policies import Policy

FRAMES = 6
SETTLED = 4  # cycles before the one that is shown
WIDTH, HEIGHT, GAP = 168, 126, 4  # pixels of a frame, and between two
CAMERA = "profile"  # follows the body without turning, so that walking sideways shows

_AHEAD = (1.0, 0.0, 0.0)  # the command, in units of the body's own speed
_WHITE = 255
_COLOURS = 64


def ticks(frequency: float, control_timestep: float, length: float, count: int = FRAMES) -> np.ndarray:
    """Return the ticks of the gait clock, one a control step, at which the frames of a strip are taken.

    They are the nearest to equal phases of one gait cycle, from phase 0 on: the cycle after `SETTLED` others, or
    in a shorter episode the latest whole one.

    Args:
        frequency: of the gait, Hz.
        control_timestep: s.
        length: ticks of the episode.
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

    In a task with a command, the command is straight ahead.

    Args:
        environment: of `arc_suite.load`.
        policy: made for one environment.
        seed: of the episode's start.

    Returns:
        (height, width, 3) uint8, white where the episode has ended before; None for a task without a gait.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """

    def view():
        return environment.physics.render(HEIGHT, WIDTH, CAMERA, quality="still")

    parameters, control_timestep = environment.task.definition.parameters, environment.control_timestep()
    if parameters is None or parameters.gait_frequency <= 0.0:
        return None
    environment.reset(seed)
    white = np.full_like(view(), _WHITE)  # finds out at once whether there is OpenGL
    longest = ticks(parameters.gait_frequency, control_timestep, np.inf)[-1]
    reached = list(_played(environment, policy, seed, longest))
    wanted = ticks(parameters.gait_frequency, control_timestep, reached[-1])
    steps = np.searchsorted(reached, wanted).tolist()
    played = enumerate(_played(environment, policy, seed, steps[-1]))
    views = {step: view() for step, _ in played if step in steps}
    frames = [np.pad(views.get(step, white), ((0, 0), (0, GAP), (0, 0)), constant_values=_WHITE) for step in steps]
    return np.concatenate(frames, axis=1)[:, :-GAP]


def _played(environment, policy: Policy, seed: int, steps: int) -> Iterator[int]:
    """Play an episode, and yield by how many ticks the gait's clock has advanced; at a stop it rests."""
    task, ticks, phase = environment.task.definition, 0, None
    commanded = task.commands.get("command") == len(_AHEAD)
    for timestep in evaluation.rollout(environment, policy, seed, steps):
        if commanded and timestep.first():
            environment.command("command", _AHEAD)
        now = task.phase(environment.task.memory)
        ticks += phase is not None and now != phase
        phase = now
        yield ticks


def write(path: Path, picture: np.ndarray) -> None:
    """Write a strip as a PNG of few colours, a quarter as large as one of all."""
    # Of Pillow's methods the octree is the one that keeps small bright spots: eyes and glows.
    few = Image.fromarray(picture).quantize(_COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    few.save(path, format="PNG", optimize=True)
