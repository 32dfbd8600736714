"""Render a walk as a picture (.png), film (.mp4, .gif, .webp) or page (.html).

  arc-suite render --robot queen --policy cpg --output queen.png
  arc-suite render --robot all --output robots.mp4
  arc-suite render --legs 8 --links 4 --output walker.gif
  arc-suite render --robot tick --set gait=ripple --output ripple.mp4
  arc-suite render --robot leaper --fps 60 --loop --output leaper.webp
  arc-suite render --robot queen --preset tuned --output walk.html

A PNG of one robot under the demonstrator shows one cycle of its gait; any other PNG, and one after
--steps=0, shows one moment. A film plays in real time. With --loop it
holds whole cycles of a gait that has settled. A page plays in any browser, with a camera to
turn, foot contacts and rewards; several robots walk side by side. The program prints each robot's return up
to then, and the file it wrote. No display is needed.
"""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from absl import flags

from arc_suite import checks, files, style
from arc_suite.animation import pages
from arc_suite.cli.flags import check_flags_suit_file, define_walk, policy_name, setups_from_flags
from arc_suite.cli.program import progress
from arc_suite.models.builder import CAMERAS
from arc_suite.models.visuals.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.policies import Policy, alone, policy
from arc_suite.simulation import films

_STEPS = {".png": 60, ".mp4": 200, ".gif": 80, ".webp": 80, ".html": 400}
_SIZES = {".png": (640, 480), ".mp4": (640, 480), ".gif": (240, 180), ".webp": (480, 360)}
_FILMS = (".mp4", ".gif", ".webp")
_OWN = {"fps": _FILMS, "loop": _FILMS}  # flags that are for some files alone
_CYCLE_VIEWS, _CYCLE_COLUMNS = 6, 3
_SETTLE = 60  # control steps, after which the start of an episode is forgotten

FLAGS = flags.FLAGS
define_walk(more=", or all of them side by side")
flags.DEFINE_integer("seed", 0, "Seed of the start of the episode and of the random policy.", 0, 2**32 - 1)
flags.DEFINE_string("camera", None, f"{', '.join(CAMERAS)}. [default: profile, of several robots portrait]")
flags.DEFINE_integer("width", None, "Of a view, in pixels. [default: 640, in a GIF 240, in a WebP 480]", 16, MAX_WIDTH)
flags.DEFINE_integer(
    "height", None, "Of a view, in pixels. [default: 480, in a GIF 180, in a WebP 360]", 16, MAX_HEIGHT
)
flags.DEFINE_integer(
    "steps",
    None,
    "Control steps, of 0.05 s for the four robots: the length of a film, or how long to walk before a picture. "
    "[default: 200, in a GIF or WebP 80, on a page 400, before a picture 60]",
    lower_bound=0,
)
flags.DEFINE_float("fps", None, "Frames a second of a film. [default: one a control step, of 50 a second]", 1.0, 1000.0)
flags.DEFINE_bool("loop", False, "Of films: the walk has settled, and holds the whole gait cycles nearest to --steps.")
flags.DEFINE_string("output", None, "File to write: .png, .mp4, .gif, .webp or .html. Required.", short_name="o")


def main() -> None:
    """Play the episodes, write the file and print the returns."""
    walkers = setups_from_flags()
    usual = "profile" if len(walkers) == 1 else "portrait"
    camera = checks.name(usual if FLAGS.camera is None else FLAGS.camera, CAMERAS, "camera")
    environments = {name: setup.load(FLAGS.seed) for name, setup in walkers.items()}
    policies = {
        name: policy(policy_name(FLAGS.policy), setup.body, FLAGS.preset, task=environments[name].task.definition)
        for name, setup in walkers.items()
    }
    if not FLAGS.output:
        raise ValueError("no file to write; say --output=FILE.png, .mp4, .gif, .webp or .html")
    extension = checks.extension(FLAGS.output, _STEPS)
    steps = _STEPS[extension] if FLAGS.steps is None else FLAGS.steps
    if steps < 1 and extension != ".png":
        raise ValueError(f"--steps={steps}: expected 1 or more for a film or a page")
    check_flags_suit_file(extension, _OWN)
    films.check_fps(FLAGS.fps or 0.0, extension)

    with files.writing(FLAGS.output) as temporary, contextlib.ExitStack() as stack:
        if extension == ".html":
            write_page(temporary, environments, policies, steps)
        else:
            size = (FLAGS.width or _SIZES[extension][0], FLAGS.height or _SIZES[extension][1])
            footages, quality = [], "still" if extension == ".png" else "film"
            for name, walker in policies.items():
                walk = alone(walker, FLAGS.seed)
                footages.append(films.Footage(name, environments[name], walk, camera, size, quality))
                stack.callback(footages[-1].close)
            footages[0].view()  # finds out at once whether there is OpenGL
            frames, frame = (still(footages, steps), 0.0) if extension == ".png" else film(footages, steps)
            films.WRITERS[extension](temporary, frames, frame)
            for footage in footages:
                print(f"{footage.robot}: return {footage.earned:.1f} in {footage.steps} steps")
    print(f"wrote {FLAGS.output}")


def write_page(path: Path, environments: Mapping, policies: Mapping[str, Policy], steps: int) -> None:
    """Record an episode of each policy and write the page that plays them side by side."""
    pages.viewer_script()  # finds out at once whether there is one
    tracks = {}
    for name, walker in progress(policies.items(), "walking", leave=False):
        tracks[name] = style.record(environments[name], walker, FLAGS.seed, steps)
    path.write_text(pages.page(tracks), encoding="utf-8")
    for name, track in tracks.items():
        print(f"{name}: return {track.rewards.sum():.1f} in {len(track.times)} steps")


def still(footages: list[films.Footage], steps: int) -> Iterator[np.ndarray]:
    """Yield one picture after so many steps: a gait cycle of a lone demonstrator, else a moment."""
    for _ in progress(range(steps), "walking", leave=False):
        for footage in footages:
            footage.step()
    if len(footages) == 1 and FLAGS.policy == "cpg" and footages[0].advance:
        views = progress(films.cycle(footages[0], _CYCLE_VIEWS), "rendering", _CYCLE_VIEWS, leave=False)
        yield films.grid(list(views), _CYCLE_COLUMNS)
    else:
        yield panel(footages, [footage.view() for footage in footages])


def film(footages: list[films.Footage], steps: int) -> tuple[Iterator[np.ndarray], float]:
    """Return the frames until all episodes have ended, and the seconds of each."""
    step = footages[0].control_timestep
    seconds, frame = steps * step, 1.0 / FLAGS.fps if FLAGS.fps else films.frame_seconds(step)
    if FLAGS.loop:
        seconds = settled(footages, steps)
        frame = seconds / max(1, round(seconds / frame))
    views = progress(films.frames(footages, seconds, frame), "rendering", round(seconds / frame), leave=False)
    return (panel(footages, each) for each in views), frame


def settled(footages: list[films.Footage], steps: int) -> float:
    """Walk until the gait has settled, and return how long its whole cycles nearest to a number of steps last, s.

    Raises:
        ValueError: several creatures, whose cycles differ, or no clock of a gait.
    """
    if len(footages) > 1:
        raise ValueError(f"--loop: expected one creature, got {len(footages)}, whose gait cycles differ")
    (footage,) = footages
    for _ in range(_SETTLE):
        footage.step()
    if footage.ended or not footage.advance:
        raise ValueError(
            f"--loop: {footage.robot} {'falls' if footage.ended else 'has no clock of a gait'} in this task"
        )
    return max(1, round(steps * footage.advance)) / footage.advance * footage.control_timestep


def panel(footages: list[films.Footage], views: list[np.ndarray]) -> np.ndarray:
    """Return what all cameras see, two side by side, with names where there are several."""
    if len(footages) == 1:
        return views[0]
    named = zip(views, footages, strict=True)
    return films.grid([films.captioned(view, footage.robot.capitalize()) for view, footage in named], 2)
