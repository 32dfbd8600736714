"""Renders a robot that walks: a picture (.png) or a film (.mp4, .gif).

  python tools/render.py --robot queen --policy cpg --output queen.png
  python tools/render.py --robot all --output robots.mp4
  python tools/render.py --legs 8 --links 4 --output walker.gif

A PNG of one robot under the demonstrator shows one cycle of its gait; any other PNG shows one
moment. It prints each robot's return up to then, and the file it wrote. No display is needed.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from absl import flags
from tqdm import tqdm

from arc_suite import checks, files
from arc_suite.cli import body_flags, films, program
from arc_suite.cpg import PRESETS
from arc_suite.models.builder import CAMERAS
from arc_suite.models.looks.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.policies import POLICIES, PRESET_HELP
from arc_suite.robots import ROBOTS

_STEPS = {".png": 60, ".mp4": 200, ".gif": 80}
_SIZES = {".png": (640, 480), ".mp4": (640, 480), ".gif": (240, 180)}
_CYCLE_VIEWS, _CYCLE_COLUMNS = 6, 3

ROBOT = flags.DEFINE_string("robot", "queen", f"Who walks: {', '.join(ROBOTS)}, or all of them side by side.")
POLICY = flags.DEFINE_string("policy", "cpg", f"Who steers: {', '.join(POLICIES)}.")
PRESET = flags.DEFINE_string("preset", "medium", PRESET_HELP)
SEED = flags.DEFINE_integer("seed", 0, "Of the start of the episode and of the random policy.", 0, 2**32 - 1)
CAMERA = flags.DEFINE_string(
    "camera", None, f"Where to look from: {', '.join(CAMERAS)}; by default profile, for several robots portrait."
)
WIDTH = flags.DEFINE_integer(
    "width", None, "Of one view in pixels; by default 640, in a GIF 240.", lower_bound=16, upper_bound=MAX_WIDTH
)
HEIGHT = flags.DEFINE_integer(
    "height", None, "Of one view in pixels; by default 480, in a GIF 180.", lower_bound=16, upper_bound=MAX_HEIGHT
)
STEPS = flags.DEFINE_integer(
    "steps",
    None,
    "Control steps of 0.05 s: the length of a film (by default 200, in a GIF 80), or how long to walk before "
    "a picture (60).",
    lower_bound=0,
)
OUTPUT = flags.DEFINE_string("output", None, "The file to write: .png, .mp4 or .gif. Required.")


def main():
    robots = list(body_flags.bodies(ROBOT).values())
    camera = CAMERA.value or ("profile" if len(robots) == 1 else "portrait")
    for value, valid, kind in (
        (POLICY.value, POLICIES, "policy"),
        (PRESET.value, PRESETS, "preset"),
        (camera, CAMERAS, "camera"),
    ):
        checks.name(value, valid, kind)
    if not OUTPUT.value:
        raise ValueError("no file to write; say --output=FILE.png, .mp4 or .gif")
    extension = checks.name(Path(OUTPUT.value).suffix.lower(), films.WRITERS, "extension")
    steps = _STEPS[extension] if STEPS.value is None else STEPS.value
    size = (WIDTH.value or _SIZES[extension][0], HEIGHT.value or _SIZES[extension][1])

    with files.writing(OUTPUT.value) as temporary, contextlib.ExitStack() as stack:
        takes = [films.Take(robot, POLICY.value, PRESET.value, SEED.value, camera, size) for robot in robots]
        for take in takes:
            stack.callback(take.close)
        takes[0].view()  # finds out at once whether there is OpenGL
        frames = still(takes, steps) if extension == ".png" else film(takes, steps)
        films.WRITERS[extension](temporary, frames)
    for take in takes:
        print(f"{take.robot}: return {take.earned:.1f} in {take.steps} steps")
    print(f"wrote {OUTPUT.value}")


def still(takes: list[films.Take], steps: int) -> Iterator[np.ndarray]:
    """One picture after so many steps: a gait cycle of a lone demonstrator, else a moment."""
    for _ in tqdm(range(steps), "walking", leave=False):
        for take in takes:
            take.step()
    if len(takes) == 1 and POLICY.value == "cpg":
        views = tqdm(films.cycle(takes[0], _CYCLE_VIEWS), "rendering", _CYCLE_VIEWS, leave=False)
        yield films.grid(list(views), _CYCLE_COLUMNS)
    else:
        yield panel(takes)


def film(takes: list[films.Take], steps: int) -> Iterator[np.ndarray]:
    """A frame for each control step, until all episodes have ended."""
    for _ in tqdm(range(steps), "rendering", leave=False):
        for take in takes:
            take.step()
        yield panel(takes)
        if all(take.ended for take in takes):
            return


def panel(takes: list[films.Take]) -> np.ndarray:
    """What all cameras see, two side by side, with names where there are several."""
    if len(takes) == 1:
        return takes[0].view()
    return films.grid([films.captioned(take.view(), take.robot.capitalize()) for take in takes], 2)


if __name__ == "__main__":
    program.run(main)
