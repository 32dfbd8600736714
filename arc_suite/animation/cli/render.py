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
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    check_flags_suit_file,
    define_walk,
    policy_name,
    preset_from_flags,
    setups_from_flags,
)
from arc_suite.cli.program import progress
from arc_suite.models.builder import CAMERAS
from arc_suite.models.visuals.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.policies import Policy, alone, policy
from arc_suite.simulation import films

_DEFAULT_STEPS = {".png": 60, ".mp4": 200, ".gif": 80, ".webp": 80, ".html": 400}  # control steps
_DEFAULT_SIZES = {".png": (640, 480), ".mp4": (640, 480), ".gif": (240, 180), ".webp": (480, 360)}  # pixels
_VIEW_EXTENSIONS = (".png", *films.FILM_EXTENSIONS)  # a page has a camera and a size of its own
_EXTENSIONS_OF_FLAG = {  # flags for some files only
    "fps": films.FILM_EXTENSIONS,
    "loop": films.FILM_EXTENSIONS,
    "camera": _VIEW_EXTENSIONS,
    "width": _VIEW_EXTENSIONS,
    "height": _VIEW_EXTENSIONS,
}
_CYCLE_VIEWS = 6  # of a picture of one gait cycle
_CYCLE_COLUMNS = 3
_SETTLING_STEPS = 60  # control steps, after which the gait does not depend on the start of the episode

FLAGS = flags.FLAGS
define_walk(more=", or all of them side by side")
flags.DEFINE_integer(
    "seed", 0, "Seed of the start of the episode and of the random policy.", lower_bound=0, upper_bound=2**32 - 1
)
flags.DEFINE_string(
    "camera",
    None,
    "tracking (side, from afar), portrait (front and side), profile (side, a little from the front) or eye (what is "
    "ahead of the torso). [default: profile, of several robots portrait]",
)
flags.DEFINE_integer(
    "width",
    None,
    "Of a view, in pixels. [default: 640, in a GIF 240, in a WebP 480]",
    lower_bound=16,
    upper_bound=MAX_WIDTH,
)
flags.DEFINE_integer(
    "height",
    None,
    "Of a view, in pixels. [default: 480, in a GIF 180, in a WebP 360]",
    lower_bound=16,
    upper_bound=MAX_HEIGHT,
)
flags.DEFINE_integer(
    "steps",
    None,
    "Control steps, of 0.05 s for the four robots: the length of a film, or how long to walk before a picture. "
    "[default: 200, in a GIF or WebP 80, on a page 400, before a picture 60]",
    lower_bound=0,
)
flags.DEFINE_float(
    "fps",
    None,
    "Frames a second of a film. [default: one a control step, of 50 a second]",
    lower_bound=1.0,
    upper_bound=1000.0,
)
flags.DEFINE_bool("loop", False, "Of films: the walk has settled, and holds the whole gait cycles nearest to --steps.")
flags.DEFINE_string("output", None, "File to write: .png, .mp4, .gif, .webp or .html. Required.", short_name="o")


def main() -> None:
    """Play the episodes, write the file and print the returns."""
    setups = setups_from_flags()
    default_camera = "profile" if len(setups) == 1 else "portrait"
    camera = checks.name(default_camera if FLAGS.camera is None else FLAGS.camera, CAMERAS, "camera")
    preset = preset_from_flags()
    environments = {name: setup.load(FLAGS.seed) for name, setup in setups.items()}
    policies = {
        name: policy(policy_name(FLAGS.policy), setup.body, preset, task=environments[name].task.definition)
        for name, setup in setups.items()
    }
    if not FLAGS.output:
        raise ValueError("no file to write; say --output=FILE.png, .mp4, .gif, .webp or .html")
    extension = outputs.check_extension(FLAGS.output, _DEFAULT_STEPS)
    steps = _DEFAULT_STEPS[extension] if FLAGS.steps is None else FLAGS.steps
    if steps < 1 and extension != ".png":
        raise ValueError(f"--steps={steps}: expected 1 or more for a film or a page")
    check_flags_suit_file(extension, _EXTENSIONS_OF_FLAG)
    films.check_fps(FLAGS.fps or 0.0, extension)

    with files.writing(FLAGS.output) as temporary:
        if extension == ".html":
            write_page(temporary, environments, policies, steps)
        else:
            write_views(temporary, extension, environments, policies, camera, steps)
    print(f"wrote {FLAGS.output}")


def write_page(path: Path, environments: Mapping, policies: Mapping[str, Policy], steps: int) -> None:
    """Record an episode of each policy, and write the page that plays them side by side."""
    pages.viewer_script()  # raises an error now if there is no viewer
    tracks = {}
    for name, walker_policy in progress(policies.items(), "walking", leave=False):
        tracks[name] = style.record(environments[name], walker_policy, FLAGS.seed, steps)
    path.write_text(pages.page(tracks), encoding="utf-8")
    for name, track in tracks.items():
        print(f"{name}: return {track.rewards.sum():.1f} in {len(track.times)} steps")


def write_views(
    path: Path, extension: str, environments: Mapping, policies: Mapping[str, Policy], camera: str, steps: int
) -> None:
    """Play an episode of each policy, and write what cameras see as a picture or a film."""
    default_width, default_height = _DEFAULT_SIZES[extension]
    size = (FLAGS.width or default_width, FLAGS.height or default_height)
    is_picture = extension == ".png"
    quality = "still" if is_picture else "film"
    with contextlib.ExitStack() as stack:
        footages = []
        for name, walker_policy in policies.items():
            act = alone(walker_policy, FLAGS.seed)  # a function of a `TimeStep`
            footage = films.Footage(name, environments[name], act, camera, size, quality)
            stack.callback(footage.close)
            footages.append(footage)
        footages[0].view()  # raises an error now if there is no OpenGL
        if is_picture:
            frames = picture_frames(footages, steps)
            frame_seconds = 0.0
        else:
            frames, frame_seconds = film_frames(footages, steps)
        films.WRITERS[extension](path, frames, frame_seconds)
        for footage in footages:
            print(f"{footage.robot}: return {footage.episode_return:.1f} in {footage.steps} steps")


def picture_frames(footages: list[films.Footage], steps: int) -> Iterator[np.ndarray]:
    """Yield one picture after some control steps: a gait cycle of one demonstrator, or else a moment."""
    for _ in progress(range(steps), "walking", leave=False):
        for footage in footages:
            footage.step()
    has_gait_clock = footages[0].advance > 0.0
    if len(footages) == 1 and FLAGS.policy == "cpg" and has_gait_clock:
        views = progress(films.cycle(footages[0], _CYCLE_VIEWS), "rendering", _CYCLE_VIEWS, leave=False)
        yield films.grid(list(views), _CYCLE_COLUMNS)
    else:
        yield join_views(footages, [footage.view() for footage in footages])


def film_frames(footages: list[films.Footage], steps: int) -> tuple[Iterator[np.ndarray], float]:
    """Return the frames until all episodes have ended, and the seconds of each frame."""
    control_timestep = footages[0].control_timestep
    film_seconds = steps * control_timestep
    frame_seconds = 1.0 / FLAGS.fps if FLAGS.fps else films.frame_seconds(control_timestep)
    if FLAGS.loop:
        film_seconds = settle_gait(footages, steps)
        frame_seconds = film_seconds / max(1, round(film_seconds / frame_seconds))
    views_of_frames = progress(
        films.frames(footages, film_seconds, frame_seconds),
        "rendering",
        round(film_seconds / frame_seconds),
        leave=False,
    )
    return (join_views(footages, views) for views in views_of_frames), frame_seconds


def settle_gait(footages: list[films.Footage], steps: int) -> float:
    """Walk until the gait has settled, and return how long whole gait cycles last, s.

    Args:
        footages: one of them.
        steps: control steps, to which the whole cycles are the nearest.

    Raises:
        ValueError: several creatures, whose cycles differ, or no gait clock.
    """
    if len(footages) > 1:
        raise ValueError(f"--loop: expected one creature, got {len(footages)}, whose gait cycles differ")
    (footage,) = footages
    for _ in range(_SETTLING_STEPS):
        footage.step()
    if footage.ended:
        raise ValueError(f"--loop: {footage.robot} falls in this task")
    cycles_per_step = footage.advance
    if not cycles_per_step:
        raise ValueError(f"--loop: {footage.robot} has no clock of a gait in this task")
    cycles = max(1, round(steps * cycles_per_step))
    return cycles / cycles_per_step * footage.control_timestep


def join_views(footages: list[films.Footage], views: list[np.ndarray]) -> np.ndarray:
    """Return the views of all cameras as one, two side by side, with names if there are several."""
    if len(footages) == 1:
        return views[0]
    captioned_views = [
        films.add_caption(view, footage.robot.capitalize()) for view, footage in zip(views, footages, strict=True)
    ]
    return films.grid(captioned_views, columns=2)
