"""Import a legged robot from MJCF or URDF, and print what it has become.

  arc-suite import go2.xml -o go2.json
  arc-suite import mini_cheetah.xml --home crouch --feet FL_foot,FR_foot,RL_foot,RR_foot -o cheetah.json
  arc-suite import spot.urdf --home "*_thigh=0.8,*_calf=-1.5" -o spot.json

The file that is written is a body with the physics of the robot's file, to the last bit: on the floor of the
suite, without contacts of the robot with itself. It needs no other file. A line each tells the legs, the
order of the joints, the standing pose, the limits of the motors, the joints' damping and friction, links without
a mass, what was repaired and what is left out.

Other programs, and `arc_suite.load`, take the robot's own file, too.
"""

import contextlib

from absl import flags

from arc_suite import files, registry
from arc_suite.cli import outputs
from arc_suite.importing import import_robot
from arc_suite.importing.facing import AXES
from arc_suite.importing.units import SCALE_RANGE
from arc_suite.robots.spec_files import body_to_json, check_kind, refuse_folder

FLAGS = flags.FLAGS
flags.DEFINE_string("output", None, "File to write the body to, in JSON. [default: none]", short_name="o")
flags.DEFINE_string(
    "home",
    None,
    "Keyframe of the file in which the robot stands, or angles of its joints, rad, other joints at zero: "
    "*_thigh=0.8,*_calf=-1.5. [default: a pose that stands]",
)
flags.DEFINE_list("feet", [], "Bodies or geoms at the ends of the legs. [default: those that reach lowest]")
flags.DEFINE_float(
    "armature",
    None,
    "Rotor inertia, kg m^2, of each joint for which the file has none. [default: a small one where joints buzz]",
    lower_bound=0.0,
)
flags.DEFINE_float(
    "stiffness",
    None,
    "Kp, N m/rad, of each joint for which the file has no gains. [default: sized by loads]",
    lower_bound=0.0,
)
flags.DEFINE_float(
    "damping",
    None,
    "Kd, N m s/rad, of each joint for which the file has no gains. [default: sized by inertias]",
    lower_bound=0.0,
)
flags.DEFINE_enum(
    "forward",
    None,
    list(AXES),
    "Axis of the file's torso that points ahead. [default: what names and hinges say, or x]",
)
flags.DEFINE_float("scale", 1.0, "Factor of all lengths: 0.01 for a file in cm.", *SCALE_RANGE)


def main(robot: str | None = None) -> None:
    """Import the robot, write the body, and print a line for each thing to know."""
    if robot is None:
        raise ValueError("expected a file in MJCF or URDF; see --help")
    if robot in registry.robot_words():
        raise ValueError(f"{robot} is a body of the suite: every program takes it as --robot={robot}")
    refuse_folder(robot)
    check_kind(robot)
    if not all(FLAGS.feet):
        raise ValueError(f"--feet={','.join(FLAGS.feet)}: expected names with commas between them")
    with contextlib.ExitStack() as stack:
        output_path = None
        if FLAGS.output is not None:
            outputs.check_extension(FLAGS.output, [".json"])
            output_path = stack.enter_context(files.writing(FLAGS.output))
        body, notes = import_robot(
            robot,
            FLAGS.home,
            FLAGS.feet,
            FLAGS.armature,
            FLAGS.forward,
            FLAGS.scale,
            FLAGS.stiffness,
            FLAGS.damping,
        )
        if output_path is not None:
            output_path.write_text(body_to_json(body), encoding="utf-8")
    print(f"{robot}: {body.name}")
    for note in notes:
        print(f"  {note}")
