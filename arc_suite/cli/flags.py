"""Flags by which a tool takes any body: a robot of the suite, a spec file, or one made to order."""

from absl import flags

from arc_suite import checks
from arc_suite.robots import ROBOTS, generator, spec_files
from arc_suite.robots.spec import Body

SPEC = flags.DEFINE_string("spec", None, "A body from this JSON file, in place of a robot.")
LEGS = flags.DEFINE_integer("legs", None, "A body with so many legs, in place of a robot.", *generator.LEGS)
LINKS = flags.DEFINE_integer(
    "links", None, "Actuated links of each leg of a body made to order. [default: 3]", *generator.LINKS
)


def made() -> Body | None:
    """The body that --spec or --legs ask for, or None.

    Raises:
        ValueError: both are given, or --links without --legs, or no body in the file; one line.
        OSError: the file cannot be read; one line.
    """
    if SPEC.value is not None and LEGS.value is not None:
        raise ValueError("expected one of --spec and --legs, got both")
    if LINKS.value is not None and LEGS.value is None:
        raise ValueError(f"--links={LINKS.value}: goes with --legs")
    if SPEC.value is not None:
        return spec_files.load_body(SPEC.value)
    return LEGS.value and generator.generate(LEGS.value, 3 if LINKS.value is None else LINKS.value)


def bodies(robot: flags.FlagHolder) -> dict[str, Body]:
    """Bodies by name: the one made, or those that a tool's flag --robot names, which may be "all".

    Raises:
        ValueError: as `made`, or an unknown robot, or a robot beside a body; one line.
        OSError: as `made`.
    """
    body = made()
    if body is None:
        name = checks.name(robot.value, [*ROBOTS, "all"], "robot")
        return dict(ROBOTS) if name == "all" else {name: ROBOTS[name]}
    if robot.present:
        raise ValueError(f"--robot={robot.value}: expected no robot beside --spec or --legs")
    return {body.name: body}
