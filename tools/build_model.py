"""Prints a body as an MJCF model that plain MuJoCo loads: one of the suite's robots, or one made to order.

python tools/build_model.py --robot queen --output queen.xml
python tools/build_model.py --legs 6 --links 3 > walker.xml
"""

from absl import flags

from arc_suite import commands, models
from arc_suite.robots import ROBOTS, generator
from arc_suite.spec import Body

_ROBOT = flags.DEFINE_enum("robot", None, list(ROBOTS), "A robot of the suite.")
_LEGS = flags.DEFINE_integer(
    "legs",
    None,
    "Makes a body with so many legs: mirrored pairs for an even number, a ring for an odd one.",
    *generator.LEGS,
)
_LINKS = flags.DEFINE_integer("links", None, "Actuated links of each leg; with --legs. [default: 3]", *generator.LINKS)
_LOOKS = flags.DEFINE_bool("looks", False, "Add decorations, which weigh nothing and touch nothing.")
_OUTPUT = flags.DEFINE_string("output", None, "Write to this file instead of standard output.")

flags.mark_flags_as_mutual_exclusive(["robot", "legs"], required=True)


def _body() -> Body:
    if _ROBOT.value is None:
        return generator.generate(_LEGS.value, 3 if _LINKS.value is None else _LINKS.value)
    if _LINKS.value is not None:
        raise ValueError(f"--links={_LINKS.value}: goes with --legs, not with --robot")
    return ROBOTS[_ROBOT.value]


def main() -> None:
    """Builds the model and writes it."""
    xml = models.assemble(_body(), decorated=_LOOKS.value).to_xml_string()
    if _OUTPUT.value is None:
        print(xml, end="")
    else:
        with commands.writing(_OUTPUT.value) as path:
            path.write_text(xml)


if __name__ == "__main__":
    commands.run(main)
