"""Files of clips: a glTF file with its metrics, a motion, a film, or a sheet of sprites."""

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from arc_suite import checks, files, motions, versions
from arc_suite.animation.clips import catalog, filming, sprites
from arc_suite.animation.clips.catalog import ALL, DEFAULT
from arc_suite.animation.clips.clips import FPS, Clip
from arc_suite.animation.clips.clips import clips as make_clips
from arc_suite.animation.clips.creatures import RIGS, glb
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, sidecar
from arc_suite.animation.clips.motion_of_clip import clip_of_motion, motion_of_clip
from arc_suite.envs.setup import Setup
from arc_suite.models.visuals.scene import MAX_HEIGHT
from arc_suite.motions import motion_files
from arc_suite.motions.skeletons import clip_of_animation
from arc_suite.robots.spec import Body
from arc_suite.simulation import films

GLB_EXTENSION = ".glb"
SHEET_EXTENSION = ".png"
EXTENSIONS = (GLB_EXTENSION, motion_files.EXTENSION, *films.FILM_EXTENSIONS, SHEET_EXTENSION)

# The extensions of files that take an option.
OPTION_EXTENSIONS = {
    "rig": (GLB_EXTENSION,),
    "root_motion": (GLB_EXTENSION,),
    "triangles": (GLB_EXTENSION,),
    "uv": (GLB_EXTENSION,),
    "reduce": (GLB_EXTENSION,),
    "transparent": (".webp", SHEET_EXTENSION),  # formats that have an alpha channel
    "turntable": films.FILM_EXTENSIONS,
    "directions": (SHEET_EXTENSION,),
    "size": (*films.FILM_EXTENSIONS, SHEET_EXTENSION),
}
OPTION_BOUNDS = {"size": (16, MAX_HEIGHT), "directions": (1, 64), "triangles": (1, None)}  # least and greatest value
DEFAULT_SIZE = 480  # pixels, width and height of a picture
DEFAULT_DIRECTIONS = 8  # of a sheet

# Suffixes of the JSON files next to files. A spec of the same name, .json, stays as it is.
_METRICS_SUFFIXES = {GLB_EXTENSION: ".clips.json", SHEET_EXTENSION: ".sprites.json"}
_SEVERAL_CLIPS = (GLB_EXTENSION, SHEET_EXTENSION)  # files that hold them
_DEFAULTS_OF_RECORDINGS = {"weight": 1.0, "straight": False, "plant": False, "preset": None}
_MAX_SHEET_SIZE = 16384  # pixels, width and height
_BLENDER_EXTENSIONS = (".fbx", ".bvh", ".blend")  # of the files that tools/to_fbx.py writes


def animate(
    robot: str | Body,
    path: str | os.PathLike[str],
    clips: str | Sequence[str] = DEFAULT,
    *,
    task: str = "steer",
    task_kwargs: Mapping[str, Any] | None = None,
    policy: str = "cpg",
    preset: str | None = None,
    fps: float = FPS,
    straight: bool = False,
    plant: bool = False,
    weight: float | str = 1.0,
    progress: Callable[..., Any] = tqdm,
    **options: Any,
) -> list[Clip]:
    """Write animation clips of a body, as `arc-suite animate` does, and return them.

    The extension of the path says what is written: `.glb`, with metrics in `.clips.json`; one clip as a motion,
    `.npz`, see `arc_suite.motions`; one as a film, `.mp4`, `.gif` or `.webp`; or some as a sheet of sprites, `.png`,
    with its cells in `.sprites.json`, see `sprites.describe_sheet`.

    Args:
        robot, task, task_kwargs: see `arc_suite.load`.
        path: path of the file.
        clips: names of `CLIPS`, `module:name` of clips of other packages, or files of motions of the body, `.npz`,
            whose names their clips have; one or several; or "all".
        policy, preset, fps, straight, plant, weight: see `clips.clips`.
        progress: wraps what takes long, as `tqdm` does.
        options: options of a `.glb`, `rig`, `root_motion`, `triangles`, `uv` and `reduce`, see `creatures.glb`; of
            pictures, `size` in pixels, `transparent`, `turntable` of a film and `directions` of a sheet, see `filming`.
            A number may be None, for its default.

    Raises:
        ValueError: an option that does not suit the file or any of the clips, or as `clips.clips`.
        OSError: a file that cannot be read or written.
        RenderingUnavailable: pictures, and no OpenGL here.
    """
    setup = Setup.of(robot, task, task_kwargs)
    names = [clips] if isinstance(clips, str) else list(clips)
    path = Path(path)
    extension = _check_arguments(path, names, fps, options)
    options = {name: value for name, value in options.items() if value is not None}
    clip_options: dict[str, Any] = {"weight": weight, "straight": straight, "plant": plant}
    _refuse_idle_options(names, clip_options | {"preset": preset})
    recording_progress = functools.partial(progress, desc="recording", unit="clip", leave=False)
    with files.writing(path) as temporary, files.writing_json(metrics_file(path)) as metrics:
        names = catalog.clip_names() if names == [ALL] else names
        catalog_names = [name for name in names if not _is_motion(name)]
        made_clips = [_read_clip(setup.body, name, fps) for name in names if _is_motion(name)]
        left_out: dict[str, str] = {}
        if catalog_names or not names:
            arguments = (setup, catalog_names, policy, preset, fps, recording_progress)
            made_clips += make_clips(*arguments, left_out=left_out, **clip_options)
        _check_names(made_clips)
        if extension == GLB_EXTENSION:
            metrics |= _write_glb(temporary, setup.body, made_clips, clip_options, left_out, **options)
        elif extension == SHEET_EXTENSION:
            metrics |= _write_sheet(temporary, path.name, setup.body, made_clips, left_out, **options)
        else:
            _write_motion_or_film(temporary, extension, setup.body, made_clips[0], progress, **options)
    return made_clips


def _refuse_idle_options(names: Sequence[str], options: Mapping[str, Any]) -> None:
    """Raise a ValueError for the first option that has no effect on files of motions, if all names are such files."""
    if not names or not all(map(_is_motion, names)):
        return
    for option, value in options.items():
        if value != _DEFAULTS_OF_RECORDINGS[option]:
            raise ValueError(f"{option}: it has no effect on {names[0]}, a motion; leave it out")


def _write_motion_or_film(temporary: Path, extension: str, body: Body, clip: Clip, progress, **options) -> None:
    """Write a clip as a file that has no metrics."""
    if extension == motion_files.EXTENSION:
        motions.save(motion_of_clip(body, clip), temporary)
    else:
        _write_film(temporary, extension, body, clip, progress, **options)


def _is_motion(name: str) -> bool:
    return name.lower().endswith(motion_files.EXTENSION)


def _read_clip(body: Body, path: str, fps: float) -> Clip:
    """Return the motion of a file as a clip, with the name of the file: users edit and rename copies of one clip."""
    return clip_of_motion(body, motions.load(path), fps)._replace(name=clip_of_animation(Path(path).stem))


def _check_names(clips: Sequence[Clip]) -> None:
    """Check that clips have different names.

    Raises:
        ValueError: two have one name.
    """
    names = [clip.name for clip in clips]
    if len(set(names)) < len(names):
        cure = f"a clip of a motion has the name of its {motion_files.EXTENSION}: rename the file"
        raise ValueError(f"clips: expected each name once, got {', '.join(names)}; {cure}")


def metrics_file(path: str | os.PathLike) -> Path | None:
    """Return the file next to a glTF file or a sheet that says what is in it; None for files of other kinds."""
    path = Path(path)
    suffix = _METRICS_SUFFIXES.get(path.suffix.lower())
    return None if suffix is None else path.with_suffix(suffix)


def _check_arguments(path: Path, names: Sequence[str], fps: float, options: Mapping[str, Any]) -> str:
    """Return the extension of a file to write; a ValueError says which argument does not suit it."""
    suffix = path.suffix.lower()
    if suffix in _BLENDER_EXTENSIONS:
        raise ValueError(f"{path}: clips are written as .glb; tools/to_fbx.py makes {suffix} of it, by Blender")
    extension = checks.extension(path, EXTENSIONS)
    for option in options:
        checks.name(option, OPTION_EXTENSIONS, "option of clips")
        suitable = OPTION_EXTENSIONS[option]
        if extension not in suitable:
            raise ValueError(f"{option}: it is for {', '.join(suitable)}, not for {extension}")
    if extension not in _SEVERAL_CLIPS and (len(names) != 1 or names == [ALL]):
        raise ValueError(f"clips: expected one for {extension}, got {', '.join(names)}")
    if extension == motion_files.EXTENSION and not _is_motion(names[0]):
        catalog.check_is_motion(names[0])
    films.check_fps(fps, extension)
    for option in OPTION_BOUNDS.keys() & options.keys():
        if options[option] is not None:
            least, greatest = OPTION_BOUNDS[option]
            checks.integer(option, options[option], least, greatest)
    for option in ("uv", "reduce", "transparent", "turntable"):
        checks.boolean(option, options.get(option, False))
    checks.name(options.get("rig", RIGS[0]), RIGS, "rig")
    checks.name(options.get("root_motion", "both"), ROOT_MOTIONS, "root_motion")
    return extension


def _write_glb(
    path: Path,
    body: Body,
    clips: Sequence[Clip],
    clip_options: Mapping[str, Any],
    left_out: Mapping[str, str],
    rig: str = "skin",
    root_motion: str = "both",
    triangles: int | None = None,
    uv: bool = False,
    reduce: bool = False,
) -> dict[str, Any]:
    """Write a glTF file and return its metrics."""
    generator = f"arc_suite {versions.version_of('arc_suite')}"
    path.write_bytes(glb(body, clips, rig, root_motion, generator, triangles, uv, reduce))
    return sidecar(body, clips, root_motion, clip_options, left_out)


def _write_film(
    path: Path,
    extension: str,
    body: Body,
    clip: Clip,
    progress: Callable,
    size: int = DEFAULT_SIZE,
    transparent: bool = False,
    turntable: bool = False,
) -> None:
    """Write a film of a clip."""
    pictures = filming.film_pictures(body, clip, size, transparent, turntable)
    picture_count = filming.count_film_pictures(clip, turntable)
    pictures = progress(pictures, "rendering", picture_count, leave=False)
    films.WRITERS[extension](path, pictures, clip.motion.time_step)


def _write_sheet(
    path: Path,
    name: str,
    body: Body,
    clips: Sequence[Clip],
    left_out: Mapping[str, str],
    size: int = DEFAULT_SIZE,
    transparent: bool = False,
    directions: int = DEFAULT_DIRECTIONS,
) -> dict[str, Any]:
    """Write a sheet of sprites of clips, and return its description, given the name that the file will have."""
    width = size * max(map(filming.count_frames, clips))
    if width > _MAX_SHEET_SIZE:
        raise ValueError(f"the sheet is {width} pixels wide, more than {_MAX_SHEET_SIZE}; lower fps or size")
    height = size * directions * len(clips)
    if height > _MAX_SHEET_SIZE:
        raise ValueError(f"the sheet is {height} pixels high, more than {_MAX_SHEET_SIZE}; lower size or directions")
    sheet = filming.sprite_sheet(body, clips, size, directions, transparent)
    films.write_png(path, [sheet.picture], 0.0)
    return sprites.describe_sheet(name, clips, sheet, left_out)
