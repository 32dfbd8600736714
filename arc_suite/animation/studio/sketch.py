"""What the widgets say, as one value, and the body, task and lines of text that it makes."""

import dataclasses
import functools
import json
import math
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from arc_suite import checks, registry
from arc_suite.bodies import families, generator
from arc_suite.bodies.shaping import Shape, link_ends, link_names, shaped
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS, palettes
from arc_suite.robots.spec import Body, Leg, Vector
from arc_suite.robots.spec_files import EXAMPLES, body_from_json, body_to_json

LEGS, RANDOM, FILE = "legs and links", "random", "file"
_DOING = ("task", "gait", "speed", "ground", "kicks", "settings", "policy", "preset")  # fields that are not the body's
_SAME = 3e-5  # of the lengths of two vectors, by which they may differ: ends are rounded
DEFAULT_CHOICE = "own"  # the gait, layout or preset that the body or task has by itself


@dataclasses.dataclass(frozen=True)
class Sketch:
    """A creature and what it does.

    Attributes:
        source: of the body: `LEGS`, `RANDOM`, the name of a robot or an example, or `FILE`.
        legs: number of legs, of `LEGS`.
        links: actuated links a leg, of `LEGS`.
        layout: pairs, radial or `OWN`, of `LEGS`.
        seed: of `RANDOM`.
        file: the text of a spec file, of `FILE`.
        scale, length, width, thickness, fan: see `shaping.Shape`.
        lengths: factors of links, pairs of a name and a number; those of links that the body lacks are ignored.
        ends: see `shaping.Shape`, pairs of a part's name and an end; those of parts that the body lacks are ignored.
        palette: of colors, a name of `spec.PALETTES`, a seed in digits, or `OWN`.
        task: name of the task.
        gait: name of the gait, or `OWN`.
        speed: target velocity, as a multiple of the body's own.
        ground: name of an arena; ignored by a task that has its own.
        kicks: see `modifiers.Kicks`.
        settings: further settings of the task, as the text of a JSON object.
        policy: see `policies.policy`.
        preset: of the demonstrator, or `OWN`.
    """

    source: str = LEGS
    legs: int = 8
    links: int = 3
    layout: str = DEFAULT_CHOICE
    seed: int = 0
    file: str = ""
    scale: float = 1.0
    length: float = 1.0
    width: float = 1.0
    thickness: float = 1.0
    fan: float = 0.0
    lengths: tuple[tuple[str, float], ...] = ()
    ends: tuple[tuple[str, Vector], ...] = ()
    palette: str = DEFAULT_CHOICE
    task: str = "directed"
    gait: str = DEFAULT_CHOICE
    speed: float = 1.0
    ground: str = "flat"
    kicks: float = 0.0
    settings: str = "{}"
    policy: str = "cpg"
    preset: str = DEFAULT_CHOICE


def sources() -> list[str]:
    """Return the names of sources that the page lists."""
    return [LEGS, RANDOM, *ROBOTS, *EXAMPLES]


def source_body(sketch: Sketch) -> Body:
    """Return the body before its proportions change.

    Raises:
        ValueError: an unknown source, a value out of range, or a file that holds no body.
    """
    return _source_body(sketch.source, sketch.legs, sketch.links, _given(sketch.layout), sketch.seed, sketch.file)


@functools.lru_cache(maxsize=8)
def _source_body(source: str, legs: int, links: int, layout: str | None, seed: int, file: str) -> Body:
    if source == LEGS:
        return generator.generate(legs, links, layout)
    if source == RANDOM:
        return families.sound_body(seed)
    if source == FILE:
        return body_from_json(file)
    return registry.body_of(checks.name(source, sources(), "source", suggestions=(FILE,)))


def make_body(sketch: Sketch) -> Body:
    """Return the body.

    Raises:
        ValueError: as `source_body`, proportions out of range, or an unknown palette.
    """
    made = source_body(sketch)
    made = shaped(made, **_shape(sketch, made))
    return made if sketch.palette == DEFAULT_CHOICE else made.replace(palette=palettes.parse(sketch.palette))


def settings_field(sketch: Sketch) -> Mapping[str, Any]:
    """Return the further settings of the task.

    Raises:
        ValueError: the field holds no JSON object.
    """
    try:
        return checks.mapping("settings", json.loads(sketch.settings.strip() or "{}"))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f'settings: expected a JSON object, such as {{"friction": 0.5}}: {error}') from None


def make_settings(sketch: Sketch, made: Body) -> dict[str, Any]:
    """Return the settings of the task, `task_kwargs` of `arc_suite.load`; those of the field come before the sliders'.

    Raises:
        ValueError: the field holds no JSON object, a gait that does not fit, or an arena that is not registered.
    """
    given, kind = settings_field(sketch), registry.task_of(sketch.task)
    found: dict[str, Any] = {} if sketch.gait == DEFAULT_CHOICE else {"gait": sketch.gait}
    if sketch.speed != 1.0:
        own = getattr(kind.settings_for(made, found), "parameters", None)
        if own is None:
            expected = f"expected 1 for the task {sketch.task}, which prescribes none"
            raise ValueError(f"speed: {expected}, got {sketch.speed:g}")
        found["target_velocity"] = float(f"{sketch.speed * own.target_velocity:.4g}")
    if sketch.ground != "flat" and not kind.own_arena:
        found["arena"] = sketch.ground
    if sketch.kicks:
        found["kicks"] = sketch.kicks
    found |= given
    registry.check_stored_settings(found)  # a visitor of the page imports nothing
    return found


def make_setup(sketch: Sketch) -> Setup:
    """Return body, task and settings.

    Raises:
        ValueError: a name or a value that does not fit.
    """
    made = make_body(sketch)
    return Setup.of(made, sketch.task, make_settings(sketch, made))


def chosen_preset(sketch: Sketch) -> str | None:
    """Return the demonstrator's preset; None for the one that suits the task and the body.

    Raises:
        NotImported: the preset's module has not been imported yet: a visitor of the page imports nothing.
    """
    given = _given(sketch.preset)
    return given and registry.refuse_import("law", given)


def file_name(made: Body) -> str:
    """Return the name of a body's spec file."""
    return f"{made.name}.json"


def python_lines(sketch: Sketch) -> str:
    """Return Python that opens the same environment and policy; a body from a file is read from `file_name`."""
    made, models, robots = source_body(sketch), [], []
    if sketch.source == LEGS:
        layout = "" if sketch.layout == DEFAULT_CHOICE else f', "{sketch.layout}"'
        robots, code = ["generator"], f"generator.generate({sketch.legs}, {sketch.links}{layout})"
    elif sketch.source == RANDOM:
        models, code = ["families"], f"families.sound_body({sketch.seed})"
    elif sketch.source in ROBOTS:
        robots, code = ["ROBOTS"], f'ROBOTS["{sketch.source}"]'
    else:
        name = file_name(made) if sketch.source == FILE else sketch.source
        robots, code = ["spec_files"], f'spec_files.load_body("{name}")'
    if shape := _shape(sketch, made):
        changes = ", ".join(f"{name}={value!r}" for name, value in shape.items())
        robots, code = [*robots, "shaping"], f"shaping.shaped({code}, {changes})"
    if sketch.palette != DEFAULT_CHOICE:
        code = f"{code}.replace(palette={palettes.parse(sketch.palette)!r})"
    options = make_settings(sketch, make_body(sketch))
    packages = (("arc_suite", ["policies"]), ("arc_suite.models", models), ("arc_suite.robots", robots))
    imports = "".join(f"from {package} import {', '.join(names)}\n" for package, names in packages if names)
    preset = chosen_preset(sketch)
    return (
        f"import arc_suite\n{imports}\n"
        f"body = {code}\n"
        f'environment = arc_suite.load(body, "{sketch.task}"{f", {options!r}" if options else ""})\n'
        f"policy = policies.policy({sketch.policy!r}, body, {preset!r}, task=environment.task.definition)\n"
    )


def open_file(sketch: Sketch, text: str) -> Sketch:
    """Return the sketch with the body of a spec file's text, in its own proportions."""
    as_it_is: dict[str, Any]
    as_it_is = {field.name: field.default for field in dataclasses.fields(Sketch) if field.name not in _DOING}
    return dataclasses.replace(sketch, **as_it_is | {"source": FILE, "file": text})


def apply_cure(sketch: Sketch, cure: Body) -> Sketch:
    """Return the sketch with another body, as a file in its own proportions."""
    return open_file(sketch, body_to_json(cure))


def length_factor(sketch: Sketch, link: str) -> float:
    """Return the length of a link as a multiple of the body's own.

    Args:
        sketch: of the body.
        link: name of a link of all legs, or of the part that it is of one leg.
    """
    own = _own_ends(sketch)
    if link not in own:
        return dict(sketch.lengths).get(link, 1.0)
    return math.hypot(*dict(sketch.ends).get(link, own[link])) / math.hypot(*own[link])


def set_length_factor(sketch: Sketch, link: str, factor: float, symmetric: bool) -> Sketch:
    """Return the sketch with another length of a link, as `length` returns it; `symmetric` as for `moved`."""
    own = _own_ends(sketch)
    if link in own:
        ratio, end = factor / length_factor(sketch, link), dict(sketch.ends).get(link, own[link])
        return set_end(sketch, link, tuple(ratio * number for number in end), symmetric)
    lengths = dict(sketch.lengths) | {link: factor}
    return dataclasses.replace(sketch, lengths=tuple((name, each) for name, each in lengths.items() if each != 1.0))


def drag_end(sketch: Sketch, part: str, by: Sequence[float], symmetric: bool) -> Sketch:
    """Return the sketch with the end of a link of one leg moved in its frame, m as the body is; see `moved`."""
    own = _own_ends(sketch)
    if part not in own:
        return sketch
    factor = sketch.scale * next((each for name, each in sketch.lengths if part.endswith(f"_{name}")), 1.0)
    end = dict(sketch.ends).get(part, own[part])
    return set_end(sketch, part, tuple(old + new / factor for old, new in zip(end, by, strict=True)), symmetric)


def set_end(sketch: Sketch, part: str, end: Vector, symmetric: bool) -> Sketch:
    """Return the sketch with another end of a link of one leg.

    Args:
        sketch: to change.
        part: name of the link's part, which the body may lack.
        end: (3,) in the frame of the link, before proportions change, m.
        symmetric: whether the leg across the body's plane of symmetry gets the mirrored end, if there is one.
    """
    made, (x, y, z) = source_body(sketch), (float(f"{number:.5g}") for number in end)
    own, across = link_ends(made), _across(made, part) if symmetric else None
    ends = dict(sketch.ends) | {part: (x, y, z)} | ({across: (x, -y, z)} if across else {})
    changed = tuple((name, each) for name, each in ends.items() if not _near(each, own.get(name, each[:0])))
    return dataclasses.replace(sketch, ends=changed)


def _own_ends(sketch: Sketch) -> Mapping[str, Vector]:
    """The ends of links before proportions change; none of a sketch that makes no body, while widgets change it."""
    try:
        return link_ends(source_body(sketch))
    except ValueError:
        return {}


def _across(made: Body, part: str) -> str | None:
    """The name of the part in the leg that mirrors a part's leg; None without one."""
    for leg in made.legs:
        if part in leg.part_names:
            reflected = [(x, -y, z) for x, y, z in leg.points]
            others = (other for other in made.legs if other is not leg and len(other.points) == len(reflected))
            return next(
                (other.part_names[leg.part_names.index(part)] for other in others if _alike(other, reflected)), None
            )
    return None


def _alike(leg: Leg, points: list[Vector]) -> bool:
    return all(_near(mine, other) for mine, other in zip(leg.points, points, strict=True))


def _near(one: Vector, other: Vector) -> bool:
    return len(one) == len(other) and math.dist(one, other) <= _SAME * math.hypot(*one, *other)


def command_line(sketch: Sketch) -> str:
    """Return the command that shows the same in a window; a body of its own is read from its saved spec."""
    made = make_body(sketch)
    unchanged = made == source_body(sketch)
    if sketch.source in ROBOTS and unchanged:
        chosen = ["--robot", sketch.source]
    elif sketch.source in EXAMPLES and unchanged:
        chosen = ["--spec", sketch.source]
    elif sketch.source == LEGS and made == generator.generate(sketch.legs, sketch.links):
        chosen = ["--legs", str(sketch.legs), "--links", str(sketch.links)]
    else:
        chosen = ["--spec", file_name(made)]
    options = [f"--set={name}={_flag(value)}" for name, value in make_settings(sketch, made).items()]
    policy = [] if sketch.policy == "cpg" else ["--policy", sketch.policy]
    given = [] if sketch.preset == DEFAULT_CHOICE else ["--preset", sketch.preset]
    return shlex.join(["arc-suite", "view", *chosen, "--task", sketch.task, *options, *policy, *given])


def _flag(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _given(choice: str) -> str | None:
    return None if choice == DEFAULT_CHOICE else choice


def _shape(sketch: Sketch, made: Body) -> dict[str, Any]:
    """The changes of proportions of a body, without those that change nothing."""
    shape = {name: getattr(sketch, name) for name in Shape._fields if name not in ("links", "ends")}
    names = link_names(made)
    shape["links"] = {name: factor for name, factor in sketch.lengths if factor != 1.0 and name in names}
    shape["ends"] = {name: end for name, end in sketch.ends if name in link_ends(made)}
    return {name: value for name, value in shape.items() if value != getattr(Shape(), name)}
