"""Read a motion from a file, check it, and make it one of any body.

  arc-suite motion attack.npz --robot spider -o spider_attack.npz
  arc-suite motion queen.glb --clip walk --robot queen -o walk.npz
  arc-suite motion queen.glb --clip walk --of queen --robot spider -o spider_walk.npz
  arc-suite motion dance.csv --fps 30 --robot go2.xml -o dance.npz

A file is a motion (.npz), as `arc-suite animate` writes; a .glb or .bvh with the bones of `arc-suite animate`, also
after work in Blender; or a table of frames (.csv, .npz) with a column for each joint. A line each tells what was
changed: turns off the hinges, ends of loops, joints beyond their range. Without -o the file is only checked.

A motion of another body comes by the paths of its feet in standing heights. Steps of a loop follow the gait of the new
body. In other motions feet follow those in the same place; feet without a partner stay planted.
"""

import numpy as np
from absl import flags

from arc_suite import checks, files, motions, registry
from arc_suite.cli.flags import check_flags_suit_file, define_body, only_body, refuse_flags
from arc_suite.motions import motion_files, reading

FLAGS = flags.FLAGS
define_body()
flags.DEFINE_string("of", None, "Body of the file: a robot, or a file of one. [default: that of --robot]")
flags.DEFINE_string("clip", None, "Animation of a .glb with several.")
flags.DEFINE_bool("loop", None, "Whether the motion repeats. [default: what the file says]")
flags.DEFINE_float("fps", None, "Frames a second of a table that does not say them.", 1.0, 1000.0)
flags.DEFINE_string("output", None, "File to write, .npz. [default: none]", short_name="o")

_BODY_FLAGS = ("robot", "spec", "legs")


def main(file: str | None = None) -> None:
    """Read the motion, make it one of the body, write it, and print a line for each thing that was changed."""
    if file is None:
        raise ValueError("expected a file of a motion; see --help")
    extension = reading.check_extension(file)
    check_flags_suit_file(extension, reading.OPTIONS)
    if FLAGS.output is not None:
        checks.extension(FLAGS.output, [motion_files.EXTENSION])
        files.check_target(FLAGS.output)
    if reading.holds_motion(file):
        refuse_flags(("loop", "fps"), f"goes with a table, and {file} is a motion")
        refuse_flags(("of",), f"goes with files of other tools, and {file} names its body")
    names_body = any(FLAGS[name].present for name in _BODY_FLAGS)
    body = only_body()
    source_body = body if FLAGS.of is None else registry.body_of(FLAGS.of)
    motion, notes = reading.read(file, source_body, reading.Options(FLAGS.clip, FLAGS.loop, FLAGS.fps))
    print(f"{file}: {motion.name} of {motion.body}, {motion.frames} frames, {describe(motion)}")
    if names_body and not motions.fits(motion, body):
        motion, changes = motions.retarget(motion, body)
        notes += [f"now of {motion.body}, {describe(motion)}", *changes]
    if motions.fits(motion, body):
        notes += reading.describe_limits(motion, body)
    for note in notes:
        print(f"  {note}")
    if FLAGS.output is not None:
        with files.writing(FLAGS.output) as temporary:
            motions.save(motion, temporary)
        print(f"wrote {FLAGS.output}")


def describe(motion: motions.Motion) -> str:
    """Return a phrase for the duration of a motion, and for the speed of a loop."""
    if not motion.loops:
        return f"lasts {motion.seconds:.3f} s"
    speed = np.linalg.norm(motion.displacement[:2]) / motion.seconds
    return f"a loop of {motion.seconds:.3f} s at {speed:.3f} m/s"
