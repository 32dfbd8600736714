"""Make animation clips (.glb) or sprites, and of one clip a motion or a film.

  arc-suite animate --robot queen --output queen.glb
  arc-suite animate --robot leaper --clips walk,stop,idle --root_motion moving --output leaper.glb
  arc-suite animate --legs 8 --links 3 --rig nodes --clips all --output spider.glb
  arc-suite animate --robot tick --clips attack --output attack.npz
  arc-suite animate --policy runs/queen-steer-dagger-0 --output queen.glb
  arc-suite animate --robot queen --clips walk --turntable --transparent --output queen.webp
  arc-suite animate --spec spider --clips walk,idle --fps 12 --size 128 --directions 8 --output sprites.png

Metrics go to .clips.json. One policy makes all clips, each under a command of its own. Loops begin at the same phase
of the gait and hold the same number of cycles. start and stop connect idle and walk. tuned and refined are presets of
the four robots' demonstrators, with a gait of their own. A clip that cannot be made is left out with a line. A motion
(.npz) is what `arc-suite motion` and tasks read; --clips takes motions, too. A film (.mp4, .gif, .webp) shows one clip,
in place and as long as it lasts, so that it plays forever. A sheet (.png) has a row of frames for each direction of
a clip; its cells, rates and ground line go to .sprites.json, as Aseprite writes them.
"""

import math

from absl import flags

from arc_suite.animation import clips as catalog
from arc_suite.animation.clips import clip_files, metadata, swaying
from arc_suite.cli.flags import define_walk, only_setup, policy_name, preset_from_flags
from arc_suite.cli.program import progress

_COLUMNS = ("clip", "seconds", "frames", "cycles", "forward m/s", "left m/s", "turn deg/s", "seam deg")

FLAGS = flags.FLAGS
define_walk(task="steer")
flags.DEFINE_list(
    "clips",
    list(catalog.DEFAULT),
    f"Which, with commas between them: {', '.join(catalog.CLIPS)}; module:name of one that another package has; "
    f"a motion of the body, .npz; or {catalog.ALL}.",
)
flags.DEFINE_float("fps", catalog.FPS, "Frames a second.", lower_bound=1.0, upper_bound=1000.0)
flags.DEFINE_string("rig", "skin", f"{' or '.join(catalog.RIGS)}: bones and one mesh, or rigid parts.")
flags.DEFINE_string(
    "root_motion", "both", "moving: the root goes as the body walks; in_place: it stays; both: each clip twice."
)
flags.DEFINE_bool("straight", False, "Loops that do not turn, starts and stops go where they are to, and do not veer.")
flags.DEFINE_bool("plant", False, "Feet in stance stay where they are, by inverse kinematics, and do not slide.")
flags.DEFINE_string(
    "weight",
    "1",
    "How much the torso sinks, rolls and pitches in walks, starts and stops: 0 for not at all, to "
    f"{swaying.MAX_WEIGHT:g}; or {', '.join(swaying.CHARACTERS)}.",
)
flags.DEFINE_integer(
    "triangles",
    None,
    "At most so many, for creatures far away: 3000 fits most bodies.",
    *clip_files.OPTION_BOUNDS["triangles"],
)
flags.DEFINE_bool("uv", False, "Faces have places in a texture, to be painted.")
flags.DEFINE_bool("reduce", False, "Leave out keys that lines between others replace within 0.1 degrees.")
flags.DEFINE_integer(
    "size", clip_files.DEFAULT_SIZE, "Of films: width and height, in pixels.", *clip_files.OPTION_BOUNDS["size"]
)
flags.DEFINE_bool("transparent", False, "Of films and sheets, .webp or .png: the body alone.")
flags.DEFINE_bool("turntable", False, "Of films: the body turns once while its clip is repeated.")
flags.DEFINE_integer(
    "directions",
    clip_files.DEFAULT_DIRECTIONS,
    "Of sheets: rows; the first goes to the right, the next to its left.",
    *clip_files.OPTION_BOUNDS["directions"],
)
flags.DEFINE_string("output", None, "File to write, .glb, .npz, .mp4, .gif, .webp or .png. Required.", short_name="o")


def main() -> None:
    """Record clips, write the file, and print a row for each clip of a .glb."""
    setup = only_setup()
    if not FLAGS.output:
        raise ValueError("no file to write; say --output=FILE.glb")
    # Files of other kinds have other options: only those that flags name are passed on.
    options = {name: FLAGS[name].value for name in clip_files.OPTION_EXTENSIONS if FLAGS[name].present}
    clips = clip_files.animate(
        setup.body,
        FLAGS.output,
        FLAGS.clips,
        task=setup.task,
        task_kwargs=setup.task_kwargs,
        policy=policy_name(FLAGS.policy),
        preset=preset_from_flags(),
        fps=FLAGS.fps,
        straight=FLAGS.straight,
        plant=FLAGS.plant,
        weight=_parse_weight(FLAGS.weight),
        progress=progress,
        **options,
    )
    if FLAGS.output.lower().endswith(clip_files.GLB_EXTENSION):
        print_table(clips)
        for line in filter(None, map(metadata.describe_odd_steps, clips)):
            print(line)
    metrics = clip_files.metrics_file(FLAGS.output)
    print(f"wrote {FLAGS.output}" if metrics is None else f"wrote {FLAGS.output} and {metrics}")


def _parse_weight(text: str) -> float | str:
    """Return the number of a text, or the text, which may be a name."""
    try:
        return float(text)
    except ValueError:
        return text


def print_table(clips: list[catalog.Clip]) -> None:
    """Print a row for each clip.

    The seam is the largest difference of poses where the end of a loop was made to meet its start.
    """
    line = "{:<20}" + " {:>11}" * (len(_COLUMNS) - 1)
    print(line.format(*_COLUMNS))
    for clip in clips:
        forward, left, turning = clip.motion.twist + 0.0  # m/s and rad/s; + 0.0 makes -0 a 0
        row = (
            clip.name,
            f"{clip.motion.seconds:.3f}",
            len(clip.times),
            clip.cycles,
            f"{forward:.3f}",
            f"{left:.3f}",
            f"{math.degrees(turning):.1f}",
            f"{math.degrees(clip.motion.seam):.3f}" if clip.cycles else "-",
        )
        print(line.format(*row))
