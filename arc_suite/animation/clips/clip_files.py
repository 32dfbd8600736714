"""Files of clips: a glTF file with its metrics, a film, or a sheet of sprites."""

import contextlib
import functools
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from arc_suite import checks, files, versions
from arc_suite.animation.clips import catalog, filming
from arc_suite.animation.clips.catalog import ALL, DEFAULT
from arc_suite.animation.clips.clips import FPS, Clip
from arc_suite.animation.clips.clips import clips as recorded
from arc_suite.animation.clips.creatures import RIGS, glb
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, sidecar
from arc_suite.envs.setup import Setup
from arc_suite.models.visuals.scene import MAX_HEIGHT
from arc_suite.robots.spec import Body
from arc_suite.simulation import films

FILM_EXTENSIONS = (".mp4", ".gif", ".webp")
EXTENSIONS = (".glb", *FILM_EXTENSIONS, ".png")
_CLEAR = (".webp", ".png")  # with an alpha
# The extensions of each option that suits some files alone.
OPTION_EXTENSIONS = {
    **dict.fromkeys(("rig", "root_motion", "triangles", "uv", "reduce"), (".glb",)),
    **{
        "transparent": _CLEAR,
        "turntable": FILM_EXTENSIONS,
        "directions": (".png",),
        "size": (*FILM_EXTENSIONS, ".png"),
    },
}
OPTION_BOUNDS = {"size": (16, MAX_HEIGHT), "directions": (1, 64), "triangles": (1, None)}
DEFAULT_SIZE, DEFAULT_DIRECTIONS = 480, 8
_WIDEST = 16384  # pixels of a sheet
_CONVERTED = (".fbx", ".bvh", ".blend")  # what tools/to_fbx.py writes


def animate(
    robot: str | Body,
    path: str | os.PathLike,
    clips: str | Sequence[str] = DEFAULT,
    *,
    task: str = "steer",
    task_kwargs: Mapping[str, Any] | None = None,
    policy: str = "cpg",
    preset: str | None = None,
    fps: float = FPS,
    straight: bool = False,
    plant: bool = False,
    progress: Callable = tqdm,
    **options,
) -> list[Clip]:
    """Write animation clips of a body, as `arc-suite animate` does, and return them.

    The extension of the path says what is written: `.glb`, with metrics in `.clips.json`; one clip as a film, `.mp4`,
    `.gif` or `.webp`; or one as a sheet of sprites, `.png`.

    Args:
        robot, task, task_kwargs: see `arc_suite.load`.
        path: of the file.
        clips: names of `CLIPS`, or `module:name` of clips of other packages, one or several; or "all".
        policy, preset, fps, straight, plant: see `clips.clips`.
        progress: wraps what takes long, as `tqdm` does.
        options: of a `.glb`, `rig`, `root_motion`, `triangles`, `uv` and `reduce`, see `creatures.glb`; of pictures,
            `size` in pixels, `transparent`, `turntable` of a film and `directions` of a sheet, see `filming`.

    Raises:
        ValueError: an option that does not suit the file, or as `clips.clips`.
        OSError: a file that cannot be read or written.
        RenderingUnavailable: pictures, and no OpenGL here.
    """
    setup = Setup.of(robot, task, task_kwargs)
    names = [clips] if isinstance(clips, str) else list(clips)
    path = Path(path)
    extension = _checked(path, names, fps, options)
    recording = functools.partial(progress, desc="recording", unit="clip", leave=False)
    with contextlib.ExitStack() as stack:
        temporary = stack.enter_context(files.writing(path))
        metrics = stack.enter_context(files.writing_json(metrics_file(path) if extension == ".glb" else None))
        names = catalog.clip_names() if names == [ALL] else names
        made = recorded(setup, names, policy, preset, fps, recording, straight, plant)
        if extension == ".glb":
            metrics |= _write_glb(temporary, setup.body, made, **options)
        else:
            _write_pictures(temporary, extension, setup.body, made[0], progress, **options)
    return made


def metrics_file(path: str | os.PathLike) -> Path:
    """Return the file next to a glTF file that holds the metrics of its clips."""
    return Path(path).with_suffix(".clips.json")


def _checked(path: Path, names: Sequence[str], fps: float, options: Mapping[str, Any]) -> str:
    """Return the extension of a file to write; a ValueError says what does not suit it."""
    if (extension := path.suffix.lower()) in _CONVERTED:
        raise ValueError(f"{path}: clips are written as .glb; tools/to_fbx.py makes {extension} of it, by Blender")
    extension = checks.extension(path, EXTENSIONS)
    for name in options:
        fitting = OPTION_EXTENSIONS[checks.name(name, OPTION_EXTENSIONS, "option of clips")]
        if extension not in fitting:
            raise ValueError(f"{name}: it is for {', '.join(fitting)}, not for {extension}")
    if extension != ".glb" and (len(names) != 1 or names == [ALL]):
        raise ValueError(f"clips: expected one for {extension}, got {', '.join(names)}")
    films.check_fps(fps, extension)
    for name in OPTION_BOUNDS.keys() & options.keys():
        if options[name] is not None:
            checks.integer(name, options[name], *OPTION_BOUNDS[name])
    checks.name(options.get("rig", RIGS[0]), RIGS, "rig")
    checks.name(options.get("root_motion", "both"), ROOT_MOTIONS, "root_motion")
    return extension


def _write_glb(
    path: Path,
    body: Body,
    clips: Sequence[Clip],
    rig: str = "skin",
    root_motion: str = "both",
    triangles: int | None = None,
    uv: bool = False,
    reduce: bool = False,
) -> dict[str, Any]:
    """Write a glTF file and return its metrics."""
    generator = f"arc_suite {versions.version_of('arc_suite')}"
    path.write_bytes(glb(body, clips, rig, root_motion, generator, triangles, uv, reduce))
    return sidecar(body, clips, root_motion)


def _write_pictures(
    path: Path,
    extension: str,
    body: Body,
    clip: Clip,
    progress: Callable,
    size: int = DEFAULT_SIZE,
    transparent: bool = False,
    turntable: bool = False,
    directions: int = DEFAULT_DIRECTIONS,
) -> None:
    """Write a film or a sheet of a clip."""
    if extension != ".png":
        frames = filming.film_pictures(body, clip, size, transparent, turntable)
        frames = progress(frames, "rendering", filming.count_film_pictures(clip, turntable), leave=False)
        films.WRITERS[extension](path, frames, clip.motion.time_step)
        return
    if (width := size * len(clip.times)) > _WIDEST:
        raise ValueError(f"the sheet is {width} pixels wide, more than {_WIDEST}; lower fps or size")
    films.write_png(path, [filming.sprite_sheet(body, clip, size, directions, transparent)], 0.0)
