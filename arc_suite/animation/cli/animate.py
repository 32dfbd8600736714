"""Make animation clips for game engines (.glb), films and sheets of sprites of one.

  arc-suite animate --robot queen --output queen.glb
  arc-suite animate --robot leaper --clips walk,stop,idle --root_motion moving --output leaper.glb
  arc-suite animate --legs 8 --links 3 --rig nodes --clips all --output spider.glb
  arc-suite animate --policy runs/queen-steer-dagger-0 --output queen.glb
  arc-suite animate --robot queen --clips walk --turntable --transparent --output queen.webp
  arc-suite animate --spec spider --clips walk --fps 12 --size 128 --directions 8 --output sprites.png

Metrics go to .clips.json. One policy makes all clips, each under a command of its own. Loops begin at the same phase
of the gait and hold the same number of cycles. start and stop connect idle and walk. tuned and refined are presets of
the four robots' demonstrators, with a gait of their own. A clip that cannot be made is left out with a line. A film
(.mp4, .gif, .webp) shows one clip, in place and as long as it lasts, so that it plays forever. A sheet (.png) has a row
of frames for each direction.
"""

import functools
import math
from pathlib import Path

from absl import flags

from arc_suite import checks, files
from arc_suite.animation import clips as export
from arc_suite.animation.clips import filming
from arc_suite.cli.flags import check_extension, define_walk, only_setup, policy_name
from arc_suite.cli.program import VERSION, progress
from arc_suite.envs.setup import Setup
from arc_suite.models.visuals.scene import MAX_HEIGHT
from arc_suite.simulation import films

_COLUMNS = ("clip", "seconds", "frames", "cycles", "forward m/s", "left m/s", "turn deg/s", "seam deg")
_FILMS = (".mp4", ".gif", ".webp")
_CLEAR = (".webp", ".png")  # with an alpha
_OWN = {  # flags that are for some files alone
    **dict.fromkeys(("rig", "root_motion", "triangles", "uv", "reduce"), (".glb",)),
    **{"transparent": _CLEAR, "turntable": _FILMS, "directions": (".png",), "size": (*_FILMS, ".png")},
}
_WIDEST = 16384  # pixels of a sheet
_CONVERTED = (".fbx", ".bvh", ".blend")  # what tools/to_fbx.py writes

FLAGS = flags.FLAGS
define_walk(task="steer")
flags.DEFINE_list(
    "clips", list(export.DEFAULT), f"Which, with commas between them: {', '.join(export.CLIPS)}; or {export.ALL}."
)
flags.DEFINE_float("fps", export.FPS, "Frames a second.", 1.0, 1000.0)
flags.DEFINE_string("rig", "skin", f"{' or '.join(export.RIGS)}: bones and one mesh, or rigid parts.")
flags.DEFINE_string(
    "root_motion", "both", "moving: the root goes as the body walks; in_place: it stays; both: each clip twice."
)
flags.DEFINE_bool("straight", False, "Loops that do not turn go exactly where they are to, and do not veer.")
flags.DEFINE_bool("plant", False, "Feet in stance stay where they are, by inverse kinematics, and do not slide.")
flags.DEFINE_integer("triangles", None, "At most so many, for creatures far away: 3000 fits most bodies.", 1)
flags.DEFINE_bool("uv", False, "Faces have places in a texture, to be painted.")
flags.DEFINE_bool("reduce", False, "Leave out keys that lines between others replace within 0.1 degrees.")
flags.DEFINE_integer("size", 480, "Of films: width and height, in pixels.", 16, MAX_HEIGHT)
flags.DEFINE_bool("transparent", False, "Of films and sheets, .webp or .png: the body alone.")
flags.DEFINE_bool("turntable", False, "Of films: the body turns once while its clip is repeated.")
flags.DEFINE_integer("directions", 8, "Of sheets: rows; the first goes to the right, the next to its left.", 1, 64)
flags.DEFINE_string("output", None, "File to write, .glb, .mp4, .gif, .webp or .png. Required.", short_name="o")


def main() -> None:
    """Record and write what the extension asks for."""
    checks.name(FLAGS.rig, export.RIGS, "rig")
    checks.name(FLAGS.root_motion, export.ROOT_MOTIONS, "root_motion")
    setup = only_setup()
    if not FLAGS.output:
        raise ValueError("no file to write; say --output=FILE.glb")
    if (extension := Path(FLAGS.output).suffix.lower()) in _CONVERTED:
        raise ValueError(
            f"{FLAGS.output}: this program writes .glb; tools/to_fbx.py makes {extension} of it, by Blender"
        )
    extension = checks.extension(FLAGS.output, [".glb", *_FILMS, ".png"])
    check_extension(extension, _OWN)
    if extension == ".glb":
        write_file(setup)
    else:
        write_pictures(setup, extension)


def write_file(setup: Setup) -> None:
    """Write clips and their metrics, and print a row for each clip."""
    sidecar = Path(FLAGS.output).with_suffix(".clips.json")
    names = list(export.CLIPS) if FLAGS.clips == [export.ALL] else FLAGS.clips
    with files.writing(FLAGS.output) as temporary, files.writing_json(sidecar) as metrics:
        clips = recorded(setup, names)
        look = FLAGS.triangles, FLAGS.uv, FLAGS.reduce
        temporary.write_bytes(export.glb(setup.body, clips, FLAGS.rig, FLAGS.root_motion, VERSION, *look))
        metrics |= export.sidecar(setup.body, clips, FLAGS.root_motion)
    print_table(clips)
    print(f"wrote {FLAGS.output} and {sidecar}")


def write_pictures(setup: Setup, extension: str) -> None:
    """Write a film or a sheet of one clip."""
    if len(FLAGS.clips) != 1 or FLAGS.clips == [export.ALL]:
        raise ValueError(f"--clips={','.join(FLAGS.clips)}: expected one clip for {extension}")
    films.check_fps(FLAGS.fps, extension)
    with files.writing(FLAGS.output) as temporary:
        (clip,) = recorded(setup, FLAGS.clips)
        if extension == ".png":
            if (width := FLAGS.size * len(clip.times)) > _WIDEST:
                raise ValueError(f"the sheet is {width} pixels wide, more than {_WIDEST}; lower --fps or --size")
            sheet = filming.sheet(setup.body, clip, FLAGS.size, FLAGS.directions, FLAGS.transparent)
            films.write_png(temporary, [sheet], 0.0)
        else:
            frames = filming.loop(setup.body, clip, FLAGS.size, FLAGS.transparent, FLAGS.turntable)
            films.WRITERS[extension](temporary, progress(frames, "rendering", leave=False), clip.motion.step)
    print(f"wrote {FLAGS.output}")


def recorded(setup: Setup, names: list[str]) -> list[export.Clip]:
    """Return the clips that the flags ask for."""
    recording = functools.partial(progress, desc="recording", unit="clip", leave=False)
    policy = policy_name(FLAGS.policy), FLAGS.preset
    return export.clips(setup, names, *policy, FLAGS.fps, recording, FLAGS.straight, FLAGS.plant)


def print_table(clips: list[export.Clip]) -> None:
    """Print a row for each clip."""
    line = "{:<20}" + " {:>11}" * (len(_COLUMNS) - 1)
    print(line.format(*_COLUMNS))
    for clip in clips:
        forward, left, turning = clip.motion.twist + 0.0
        cells = [f"{forward:.3f}", f"{left:.3f}", f"{math.degrees(turning):.1f}"]
        seam = f"{math.degrees(clip.motion.seam):.3f}" if clip.cycles else "-"
        print(line.format(clip.name, f"{clip.motion.seconds:.3f}", len(clip.times), clip.cycles, *cells, seam))
