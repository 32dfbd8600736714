"""Print a body as an MJCF model that plain MuJoCo loads.

The body is a robot of the suite, a spec file, or one made to order:

  arc-suite build_model --robot queen --output queen.xml
  arc-suite build_model --legs 6 --links 3 > walker.xml
  arc-suite build_model --legs 5 --layout radial --scale 2 --json --output starfish.json
  arc-suite build_model --seed 7 --summary --render random.png
  arc-suite build_model --robot varied:7 --summary
  arc-suite build_model --spec spider --summary
  arc-suite build_model --robot tick --task stairs --set difficulty=1 --output stairs.xml
  arc-suite build_model --robot tick --no_arena --output tick.xml
  arc-suite build_model --legs 8 --torso box --head round --tail long --json --output brute.json
  arc-suite build_model --legs 6 --no_ornaments --json --output plain.json
"""

import contextlib
from pathlib import Path

import imageio.v3 as imageio
from absl import flags

from arc_suite import checks, files, models, registry
from arc_suite.arenas import FLAT, Arena
from arc_suite.bodies import generator, shaping, torsos
from arc_suite.bodies.families import sound_body
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    DEFAULT_LINKS,
    adjust_body,
    custom_body,
    define_body,
    define_task,
    refuse_flags,
    task_from_flags,
)
from arc_suite.cli.summary import body_summary
from arc_suite.envs.setup import Setup
from arc_suite.models.standing import standing_qpos
from arc_suite.robots import ROBOTS, spec_files
from arc_suite.robots.spec import Body
from arc_suite.simulation.physics import Physics

FLAGS = flags.FLAGS
define_body(robot=None)
define_task()
flags.DEFINE_integer("seed", None, "A random body; with --legs or --links, of that many.", lower_bound=0)
flags.DEFINE_enum(
    "layout",
    None,
    list(generator.LAYOUTS),
    "Pairs, left and right, or legs all around; with --legs or --seed. [default: pairs for an even number, or random]",
)
flags.DEFINE_float("scale", None, "Multiply all lengths by this and size the body anew.", *generator.SCALE_RANGE)
flags.DEFINE_enum(
    "torso",
    torsos.UNCHANGED,
    [torsos.UNCHANGED, *torsos.PARTS["torso"]],
    "Form of the torso, of a body with a plain torso.",
)
flags.DEFINE_enum(
    "head",
    torsos.UNCHANGED,
    [torsos.UNCHANGED, *torsos.PARTS["head"]],
    "Form of the head, of a body with a plain torso.",
)
flags.DEFINE_enum(
    "tail",
    torsos.UNCHANGED,
    [torsos.UNCHANGED, *torsos.PARTS["tail"]],
    "Form of the tail, of a body with a plain torso.",
)
flags.DEFINE_string("name", None, "Name of the body, of letters a to z, digits and underscores.")
flags.DEFINE_bool("json", False, "Write the spec instead of the model.")
flags.DEFINE_bool("visuals", False, "Add decorations without mass or contacts.")
flags.DEFINE_bool("no_ornaments", False, "Leave out eyes, tails, shells and the like, which are drawn on the torso.")
flags.DEFINE_bool("no_arena", False, "Leave floor and free joint to the scene that takes the model.")
flags.DEFINE_string(
    "output",
    None,
    "File to write. [default: standard output, unless --summary or --render is given]",
    short_name="o",
)
flags.DEFINE_bool("summary", False, "Print the body's size, mass, gait and the like.")
flags.DEFINE_string("render", None, "File to write a picture of the standing body to.")


def main() -> None:
    """Build the body and write it."""
    if FLAGS.render is not None:
        checks.extension(FLAGS.render, [".png"])
    _check_flags()
    output_path = _output_from_flags()
    body = _body_from_flags()
    arena = _arena_from_flags(body)
    with contextlib.ExitStack() as stack:
        if output_path is not None:
            output = stack.enter_context(files.writing(output_path))
            output.write_text(_text(body, arena), encoding="utf-8")
        elif not FLAGS.summary and FLAGS.render is None:
            print(_text(body, arena), end="")
        if FLAGS.render is not None:
            picture_path = stack.enter_context(files.writing(FLAGS.render))
            physics = Physics.from_body(body, arena)
            physics.data.qpos[:] = standing_qpos(physics.model.ptr)
            physics.forward()
            imageio.imwrite(picture_path, physics.render(camera_id="portrait", quality="still"))
        if FLAGS.summary:
            print(body_summary(body))
    for path in (output_path, FLAGS.render):
        if path is not None:
            print(f"wrote {path}")


def _check_flags() -> None:
    """Raise ValueError for a flag that has no effect with the others."""
    writes_text = FLAGS.output is not None or not (FLAGS.summary or FLAGS.render is not None)
    if not writes_text:
        refuse_flags(("json", "visuals", "no_arena"), "goes with --output, as no model is written")
        if FLAGS.render is None:
            refuse_flags(("task", "set", "arena"), "goes with --output or --render, as no model is written")
    if not (FLAGS.json or FLAGS.visuals or FLAGS.render is not None):
        refuse_flags(("no_ornaments",), "goes with --json, --visuals or --render, as other models have no ornaments")
    if FLAGS.json:
        refuse_flags(("visuals", "no_arena"), "goes without --json, as a spec has no decorations and no arena")
        if FLAGS.render is None:
            refuse_flags(("task", "set", "arena"), "goes without --json, as a spec has no arena")


def _output_from_flags() -> Path | None:
    """Return the file to write, by default with the extension of its content; None for standard output."""
    if FLAGS.output is None:
        return None
    path = Path(FLAGS.output)
    extension = ".json" if FLAGS.json else ".xml"
    if not path.suffix and not path.exists():  # a pipe or a device keeps its name
        return path.with_suffix(extension)
    if not FLAGS.json and path.suffix.lower() == ".json":
        raise ValueError(f"--output={path}: a model is .xml; --json writes the spec")
    if FLAGS.json and path.suffix.lower() == ".xml":
        raise ValueError(f"--output={path}: a spec is .json; without --json the model is written")
    if path.suffix:
        outputs.check_extension(path, [extension])
    return path


def _body_from_flags() -> Body:
    """Return the body that flags name or describe.

    Raises:
        ValueError: no such body, or flags that do not go together.
    """
    sources = [name for name in ("robot", "spec", "legs", "seed") if FLAGS[name].value is not None]
    if sources not in (["robot"], ["spec"], ["legs"], ["seed"], ["legs", "seed"]):
        source_flags = " and ".join(f"--{name}" for name in sources) or "none"
        raise ValueError(f"expected one of --robot, --spec, --legs and --seed (or the last two), got {source_flags}")
    if sources in (["robot"], ["spec"]):
        for name in ("links", "layout"):
            if FLAGS[name].value is not None:
                raise ValueError(f"--{name}={FLAGS[name].value}: goes with --legs or --seed, not with --{sources[0]}")
        body = custom_body() or adjust_body(registry.body_of(FLAGS.robot))
    elif "seed" in sources:
        body = adjust_body(sound_body(FLAGS.seed, FLAGS.legs, FLAGS.links, FLAGS.layout))
    else:
        links = DEFAULT_LINKS if FLAGS.links is None else FLAGS.links
        body = adjust_body(generator.generate(FLAGS.legs, links, FLAGS.layout))
    if FLAGS.scale is not None:
        body = generator.scaled(body, FLAGS.scale)
    body = shaping.shaped(body, **{part: FLAGS[part].value for part in torsos.PARTS})
    if FLAGS.no_ornaments:
        body = body.replace(ornaments=False)
    if FLAGS.name is None:
        return body
    if FLAGS.name in ROBOTS:
        raise ValueError(f"--name={FLAGS.name}: it is a robot of the suite, whose numbers go with its name")
    return body.replace(name=FLAGS.name)


def _arena_from_flags(body: Body) -> Arena:
    """Return the arena of the task that flags name; the floor if they name none."""
    if not any(FLAGS[name].present for name in ("task", "set", "arena")):
        return FLAT
    if FLAGS.no_arena:
        raise ValueError("--no_arena: goes without --task, --set and --arena, which bring an arena")
    task, settings = task_from_flags()
    setup = Setup.of(body, task, settings)
    arena = setup.definition.scene.arena
    _check_settings_shape_arena(setup, arena)
    return arena


def _check_settings_shape_arena(setup: Setup, arena: Arena) -> None:
    """Raise ValueError for a setting that the model does not show.

    The model has the settings of the task's ground, and every other setting without which the arena is another one.
    """
    ground = getattr(setup.kind, "ground", None)
    names_of_ground = ("arena", *getattr(ground, "settings", ()))
    for name in setup.task_kwargs:
        if name in names_of_ground:
            continue
        arena_without = setup.with_settings({}, dropped=[name]).definition.scene.arena
        if arena_without == arena:
            raise ValueError(f"--set {name}: a model holds body and ground, and this setting changes neither")


def _text(body: Body, arena: Arena) -> str:
    """Return the spec of a body as JSON, or its model as MJCF."""
    if FLAGS.json:
        return spec_files.body_to_json(body)
    return models.text(body, None if FLAGS.no_arena else arena, decorated=FLAGS.visuals)
