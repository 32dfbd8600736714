"""A sketch: the values of the widgets for body and task. Functions make the body and the task of it."""

import dataclasses
import functools
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from arc_suite import checks, parsers, registry
from arc_suite.bodies import families, generator
from arc_suite.bodies.shaping import Shape, link_ends, link_names, shaped
from arc_suite.bodies.torsos import UNCHANGED
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS, gaits, palettes
from arc_suite.robots.spec import Body, Leg, Vector
from arc_suite.robots.spec_files import EXAMPLES, body_from_json, body_to_json

LEGS = "legs and links"  # source: a body of the generator
RANDOM = "random"  # source: a random body
FILE = "file"  # source: the text of a spec file
DEFAULT_CHOICE = UNCHANGED  # leaves the gait, layout, preset, palette or a part of the torso to the body or the task

# Fields that are not about the body.
_TASK_FIELDS = ("task", "gait", "speed", "ground", "ground_file", "kicks", "settings", "policy", "preset")
_MAX_END_DIFFERENCE = 3e-5  # share of two vectors' lengths; equal ends differ as much, as they are rounded


@dataclasses.dataclass(frozen=True)
class Sketch:
    """A creature and what it does.

    Attributes:
        source: source of the body: `LEGS`, `RANDOM`, the name of a robot or an example, or `FILE`.
        legs: number of legs, for the source `LEGS`.
        links: actuated links of each leg, for the source `LEGS`.
        layout: pairs, radial or `DEFAULT_CHOICE`, for the source `LEGS`.
        seed: for the source `RANDOM`.
        file: the text of a spec file, for the source `FILE`.
        scale, length, width, thickness, fan, torso, head, tail: see `shaping.Shape`.
        lengths: pairs of a link's name and the factor of its length. Links that the body lacks are ignored.
        ends: pairs of a part's name and the link's end, see `shaping.Shape`. Parts that the body lacks are ignored.
        palette: as `palettes.parse` takes it, or `DEFAULT_CHOICE`.
        no_ornaments: whether the body has no ornaments, see `Body.ornaments`; an imported body has none.
        task: name of the task.
        gait: name of the gait, or `DEFAULT_CHOICE`.
        speed: target velocity, as a multiple of the body's own; demonstrators go in a gait that suits it.
        ground: name of an arena, or a file with ground and its scale; ignored by a task that has its own.
        ground_file: ground of the file as text, see `arenas.ground_text`; no file is read.
        kicks: see `modifiers.Kicks`.
        settings: further settings of the task, as the text of a JSON object.
        policy: see `policies.policy`.
        preset: name of the demonstrator's preset, or `DEFAULT_CHOICE`.
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
    torso: str = DEFAULT_CHOICE
    head: str = DEFAULT_CHOICE
    tail: str = DEFAULT_CHOICE
    lengths: tuple[tuple[str, float], ...] = ()
    ends: tuple[tuple[str, Vector], ...] = ()
    palette: str = DEFAULT_CHOICE
    no_ornaments: bool = False
    task: str = "directed"
    gait: str = DEFAULT_CHOICE
    speed: float = 1.0
    ground: str = "flat"
    ground_file: str = ""
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
    layout = None if sketch.layout == DEFAULT_CHOICE else sketch.layout
    return _source_body(sketch.source, sketch.legs, sketch.links, layout, sketch.seed, sketch.file)


@functools.lru_cache(maxsize=8)
def _source_body(source: str, legs: int, links: int, layout: str | None, seed: int, file: str) -> Body:
    if source == LEGS:
        return generator.generate(legs, links, layout)
    if source == RANDOM:
        return families.sound_body(seed)
    if source == FILE:
        return body_from_json(file)
    name = checks.name(source, sources(), "source", suggestions=(FILE,))  # raises a ValueError for other names
    return registry.body_of(name)


def make_body(sketch: Sketch) -> Body:
    """Return the body in the proportions and colors of a sketch.

    Raises:
        ValueError: as `source_body`, proportions out of range, or an unknown palette.
    """
    original_body = source_body(sketch)
    shaped_body = shaped(original_body, **shape_changes(sketch, original_body))
    return shaped_body.replace(**visual_changes(sketch, original_body))


def visual_changes(sketch: Sketch, original_body: Body) -> dict[str, Any]:
    """Return the fields of a body about its looks that a sketch sets."""
    changes: dict[str, Any] = {}
    if sketch.palette != DEFAULT_CHOICE:
        changes["palette"] = palettes.parse(sketch.palette)
    if sketch.no_ornaments and not original_body.source:
        changes["ornaments"] = False
    return changes


def settings_field(sketch: Sketch) -> Mapping[str, Any]:
    """Return the settings of the task that the text field holds.

    Raises:
        ValueError: the field holds no JSON object.
    """
    try:
        return checks.mapping("settings", json.loads(sketch.settings.strip() or "{}"))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(
            f'settings: expected a JSON object, such as {{"friction": 0.5}}; {parsers.describe(error)}'
        ) from None


def make_settings(sketch: Sketch, body: Body) -> dict[str, Any]:
    """Return all settings of the task, as `task_kwargs` of `arc_suite.load`.

    Settings of the text field replace those of other widgets.

    Raises:
        ValueError: the field holds no JSON object, a gait that does not fit, or an arena that is not registered.
    """
    typed_settings = settings_field(sketch)
    task_class = registry.task_of(sketch.task)
    settings: dict[str, Any] = {}
    if sketch.gait != DEFAULT_CHOICE:
        settings["gait"] = sketch.gait
    if sketch.speed != 1.0:
        parameters = getattr(task_class.settings_for(body, settings), "parameters", None)
        if parameters is None:
            expected = f"expected 1 for the task {sketch.task}, which prescribes none"
            raise ValueError(f"speed: {expected}, got {sketch.speed:g}")
        settings["target_velocity"] = _round(sketch.speed * parameters.target_velocity)
        if sketch.policy == "cpg":  # a trained policy keeps the gait of its training
            pace = gaits.pace_at(sketch.speed)
            settings["gait_frequency"] = _round(pace.tempo * parameters.gait_frequency)
            settings["duty_factor"] = _round(parameters.duty_factor + pace.duty_change)
    if sketch.ground != "flat" and not task_class.own_arena:
        settings["arena"] = sketch.ground if registry.names_arena(sketch.ground) else sketch.ground_file
    if sketch.kicks:
        settings["kicks"] = sketch.kicks
    settings |= typed_settings
    registry.check_stored_settings(settings)  # a visitor of the page imports nothing
    return settings


def _round(number: float) -> float:
    """Return a number to four digits, which is short in lines to copy."""
    return float(f"{number:.4g}")


def make_setup(sketch: Sketch) -> Setup:
    """Return body, task and settings.

    Raises:
        ValueError: a name or a value that does not fit.
    """
    body = make_body(sketch)
    return Setup.of(body, sketch.task, make_settings(sketch, body))


def chosen_preset(sketch: Sketch) -> str | None:
    """Return the demonstrator's preset; None for the one that suits the task and the body, and for other policies.

    Raises:
        NotImported: the preset's module has not been imported yet. A visitor of the page imports nothing.
    """
    if sketch.preset == DEFAULT_CHOICE or sketch.policy != "cpg":
        return None
    return registry.refuse_import("law", sketch.preset)  # a law of another package has a preset of its name


def open_file(sketch: Sketch, text: str) -> Sketch:
    """Return the sketch with the body of a spec file, in the file's proportions.

    Args:
        sketch: sketch whose task and policy stay.
        text: text of the spec file.
    """
    return dataclasses.replace(original_shape(sketch), source=FILE, file=text)


def original_shape(sketch: Sketch) -> Sketch:
    """Return the sketch with the first body in its own proportions; task and policy stay."""
    body_fields: dict[str, Any]
    body_fields = {field.name: field.default for field in dataclasses.fields(Sketch) if field.name not in _TASK_FIELDS}
    return dataclasses.replace(sketch, **body_fields)


def open_body(sketch: Sketch, body: Body) -> Sketch:
    """Return the sketch with another body, as a file in the proportions of that body."""
    return open_file(sketch, body_to_json(body))


def length_factor(sketch: Sketch, link: str) -> float:
    """Return the length of a link as a multiple of its length in the source body.

    Args:
        sketch: sketch of the body.
        link: name of a link in all legs, or name of its part in one leg.
    """
    original_ends = _original_ends(sketch)
    if link not in original_ends:
        return dict(sketch.lengths).get(link, 1.0)
    end = dict(sketch.ends).get(link, original_ends[link])
    return math.hypot(*end) / math.hypot(*original_ends[link])


def set_length_factor(sketch: Sketch, link: str, factor: float, symmetric: bool) -> Sketch:
    """Return the sketch with another length of a link.

    Args:
        sketch: sketch to change.
        link: as for `length_factor`.
        factor: factor that `length_factor` returns for the new sketch.
        symmetric: as for `set_end`.
    """
    original_ends = _original_ends(sketch)
    if link in original_ends:
        ratio = factor / length_factor(sketch, link)
        end = dict(sketch.ends).get(link, original_ends[link])
        return set_end(sketch, link, tuple(ratio * coordinate for coordinate in end), symmetric)
    factors = dict(sketch.lengths) | {link: factor}
    changed_lengths = tuple((name, number) for name, number in factors.items() if number != 1.0)
    return dataclasses.replace(sketch, lengths=changed_lengths)


def drag_end(sketch: Sketch, part: str, shift: Sequence[float], symmetric: bool) -> Sketch:
    """Return the sketch with a shifted end of a link of one leg.

    Args:
        sketch: sketch to change.
        part: name of the link's part; the sketch stays as it is if the body lacks it.
        shift: (3,) in the frame of the link, m, in the body's present proportions.
        symmetric: as for `set_end`.
    """
    original_ends = _original_ends(sketch)
    if part not in original_ends:
        return sketch
    link_of_part = {leg.full_name(link): link.name for leg in source_body(sketch).legs for link in leg.links}
    factor = sketch.scale * dict(sketch.lengths).get(link_of_part[part], 1.0)
    end = dict(sketch.ends).get(part, original_ends[part])
    shifted_end = tuple(coordinate + change / factor for coordinate, change in zip(end, shift, strict=True))
    return set_end(sketch, part, shifted_end, symmetric)


def set_end(sketch: Sketch, part: str, end: Vector, symmetric: bool) -> Sketch:
    """Return the sketch with another end of a link of one leg.

    Args:
        sketch: sketch to change.
        part: name of the link's part, which the body may lack.
        end: (3,) in the frame of the link, before proportions change, m.
        symmetric: whether the leg on the other side of the body gets the mirrored end, if there is such a leg.
    """
    original_body = source_body(sketch)
    original_ends = link_ends(original_body)
    x, y, z = (float(f"{coordinate:.5g}") for coordinate in end)
    ends = dict(sketch.ends)
    ends[part] = (x, y, z)
    if symmetric:
        opposite_part = _opposite_part(original_body, part)
        if opposite_part is not None:
            ends[opposite_part] = (x, -y, z)
    changed_ends = tuple(
        (name, point)
        for name, point in ends.items()
        if name not in original_ends or not _are_close(point, original_ends[name])
    )
    return dataclasses.replace(sketch, ends=changed_ends)


def _original_ends(sketch: Sketch) -> Mapping[str, Vector]:
    """Return the ends of links before proportions change, by part.

    The mapping is empty while widgets hold values that make no body.
    """
    try:
        return link_ends(source_body(sketch))
    except ValueError:
        return {}


def _opposite_part(body: Body, part: str) -> str | None:
    """Return the name of the same part in the mirrored leg on the other side; None without such a leg."""
    for leg in body.legs:
        if part in leg.part_names:
            mirrored_points = tuple((x, -y, z) for x, y, z in leg.points)
            opposite_leg = _find_leg(body, mirrored_points, except_for=leg)
            return None if opposite_leg is None else opposite_leg.part_names[leg.part_names.index(part)]
    return None


def _find_leg(body: Body, points: tuple[Vector, ...], except_for: Leg) -> Leg | None:
    """Return the first leg whose joints and foot are at points, m."""
    for leg in body.legs:
        if leg is except_for or len(leg.points) != len(points):
            continue
        if all(_are_close(leg_point, point) for leg_point, point in zip(leg.points, points, strict=True)):
            return leg
    return None


def _are_close(first: Vector, second: Vector) -> bool:
    return math.dist(first, second) <= _MAX_END_DIFFERENCE * math.hypot(*first, *second)


def shape_changes(sketch: Sketch, body: Body) -> dict[str, Any]:
    """Return the fields of `shaping.Shape` in which the proportions of a sketch differ from those of its source.

    Args:
        sketch: with proportions.
        body: body of the source.
    """
    shape: dict[str, Any] = {name: getattr(sketch, name) for name in Shape._fields if name not in ("links", "ends")}
    links = link_names(body)
    parts = link_ends(body).keys()
    shape["links"] = {name: factor for name, factor in sketch.lengths if factor != 1.0 and name in links}
    shape["ends"] = {name: end for name, end in sketch.ends if name in parts}
    unchanged_shape = Shape()
    return {name: value for name, value in shape.items() if value != getattr(unchanged_shape, name)}
