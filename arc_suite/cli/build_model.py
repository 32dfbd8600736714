"""Prints a body as an MJCF model that plain MuJoCo loads: a robot of the suite, a spec file, or one made to order.

python tools/build_model.py --robot queen --output queen.xml
python tools/build_model.py --legs 6 --links 3 > walker.xml
python tools/build_model.py --legs 5 --layout radial --scale 2 --json --output starfish.json
python tools/build_model.py --seed 7 --summary --render random.png
python tools/build_model.py --spec examples/spider.json --summary
"""

import contextlib

import imageio.v3 as imageio
from absl import flags

from arc_suite import files, models
from arc_suite.cli import body_flags, program
from arc_suite.cli.summary import summary
from arc_suite.robots import ROBOTS, generator, spec_files
from arc_suite.robots.spec import Body
from arc_suite.simulation.physics import Physics

_ROBOT = flags.DEFINE_enum("robot", None, list(ROBOTS), "A robot of the suite.")
_SEED = flags.DEFINE_integer("seed", None, "A random body, of so many --legs if given.", lower_bound=0)
_LAYOUT = flags.DEFINE_enum(
    "layout",
    None,
    list(generator.LAYOUTS),
    "Mirrored pairs, or legs all around; with --legs or --seed. [default: pairs for an even number, or random]",
)
_SCALE = flags.DEFINE_float("scale", None, "Multiplies all lengths and sizes the body anew.", *generator.SCALE)
_JSON = flags.DEFINE_bool("json", False, "Write the spec in place of the model.")
_LOOKS = flags.DEFINE_bool("looks", False, "Add decorations, which weigh nothing and touch nothing.")
_OUTPUT = flags.DEFINE_string(
    "output", None, "Write to this file. [default: standard output, but for --summary or --render]"
)
_SUMMARY = flags.DEFINE_bool("summary", False, "Print the body's figures.")
_RENDER = flags.DEFINE_string("render", None, "Write a picture of the standing body to this file.")


def _body() -> Body:
    sources = [flag.name for flag in (_ROBOT, body_flags.SPEC, body_flags.LEGS, _SEED) if flag.value is not None]
    if sources not in (["robot"], ["spec"], ["legs"], ["seed"], ["legs", "seed"]):
        given = " and ".join(f"--{name}" for name in sources) or "none"
        raise ValueError(f"expected one of --robot, --spec, --legs and --seed (or the last two), got {given}")
    if sources in (["robot"], ["spec"]):
        for flag in (body_flags.LINKS, _LAYOUT):
            if flag.value is not None:
                raise ValueError(f"--{flag.name}={flag.value}: goes with --legs or --seed, not with --{sources[0]}")
        body = ROBOTS[_ROBOT.value] if _ROBOT.value else body_flags.made()
    elif "seed" in sources:
        body = generator.random_body(_SEED.value, body_flags.LEGS.value, body_flags.LINKS.value, _LAYOUT.value)
    else:
        links = 3 if body_flags.LINKS.value is None else body_flags.LINKS.value
        body = generator.generate(body_flags.LEGS.value, links, _LAYOUT.value)
    return body if _SCALE.value is None else generator.scaled(body, _SCALE.value)


def _text(body: Body) -> str:
    if _JSON.value:
        return spec_files.body_to_json(body)
    return models.assemble(body, decorated=_LOOKS.value).to_xml_string()


def main() -> None:
    """Builds the body and writes what is asked for."""
    body = _body()
    with contextlib.ExitStack() as stack:
        if _OUTPUT.value is not None:
            stack.enter_context(files.writing(_OUTPUT.value)).write_text(_text(body))
        elif not _SUMMARY.value and _RENDER.value is None:
            print(_text(body), end="")
        if _RENDER.value is not None:
            path = stack.enter_context(files.writing(_RENDER.value))
            physics = Physics.from_body(body)
            physics.forward()
            imageio.imwrite(path, physics.render(camera_id="portrait"))
        if _SUMMARY.value:
            print(summary(body))


if __name__ == "__main__":
    program.run(main)
