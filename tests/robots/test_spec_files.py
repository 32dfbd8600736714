"""Bodies as JSON: lossless both ways, and what is malformed gets one line that names the field."""

import errno
import json
import math
import re
import tracemalloc
from pathlib import Path

import pytest
from refusals import refused

from arc_suite.bodies import generator
from arc_suite.models.sizing import size_body
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import SpecError
from arc_suite.robots.spec_files import EXAMPLES, MAX_BYTES, body_from_json, body_to_json, load_body, save_body

SOUND = json.loads(body_to_json(size_body(generator.generate(4, 2))))


@pytest.mark.parametrize(
    "body",
    [*ROBOTS.values(), generator.generate(12, 4), generator.random_body(3), size_body(generator.random_body(4))],
    ids=lambda body: body.name,
)
def test_bodies_survive_the_way_there_and_back(body, tmp_path):
    path = tmp_path / "body.json"
    save_body(body, path)
    assert load_body(path) == body
    assert load_body(str(path)) == body
    assert body_to_json(load_body(path)) == path.read_text()
    assert body_from_json(json.dumps(json.loads(path.read_text()))) == body


@pytest.mark.parametrize("path", EXAMPLES.values(), ids=EXAMPLES)
def test_examples_are_written_as_saved(path):
    body = load_body(path)
    assert body.name == path.stem
    assert body_to_json(body) == path.read_text()


def test_there_are_examples_of_every_kind():
    legs = {name: len(load_body(name).legs) for name in EXAMPLES}
    assert legs == {"crab": 8, "giant": 6, "hound": 4, "millipede": 12, "spider": 8, "starfish": 5}


def test_a_name_that_no_example_has_is_one_line_with_the_nearest(tmp_path, monkeypatch):
    line = f"unknown spec 'spidr'; did you mean 'spider'? (there are: {', '.join(EXAMPLES)}, FILE.json)"
    with pytest.raises(ValueError, match=f"^{re.escape(line)}$"):
        load_body("spidr")
    monkeypatch.chdir(tmp_path)
    save_body(ROBOTS["tick"], "spider")
    assert load_body("spider") == ROBOTS["tick"], "a file comes first"


def test_a_few_lines_are_a_body():
    text = """{
      "name": "stool",
      "torso": {"standing_height": 0.5, "solids": [{"name": "seat", "shape": "sphere", "size": [0.1]}]},
      "legs": [{"name": "a", "mount": [0.1, 0, 0], "foot": {"radius": 0.02}, "links": [
        {"name": "upper", "end": [0.2, 0, -0.48], "radius": 0.02,
         "joint": {"name": "hip", "axis": [0, 0, 1], "range_deg": [-20, 20]}}]}]}"""
    body = body_from_json(text)
    assert body.legs[0].links[0].joint.motor is None
    assert body.density == 10.0


def test_a_standing_height_that_is_left_out_puts_the_lowest_foot_on_the_floor():
    torso = {key: value for key, value in SOUND["torso"].items() if key != "standing_height"}
    for derived in (torso, torso | {"standing_height": None}):
        assert body_from_json(json.dumps(SOUND | {"torso": derived})) == body_from_json(json.dumps(SOUND))
    spider = load_body("spider")
    feet = [leg.foot.radius - leg.foot_position[2] for leg in spider.legs]
    opened = spider.replace(torso=spider.torso.replace(standing_height=None))
    assert opened.torso.standing_height == pytest.approx(max(feet), rel=1e-12)
    above = r"^torso: standing_height cannot be derived: feet end 0\.\d+ m above the torso's origin$"
    with pytest.raises(SpecError, match=above):
        body_from_json(changed(("torso",), torso).replace("-0.", "0."))


def changed(path, value):
    """The sound spec with one thing changed, deleted (`...`) or added."""
    spec = json.loads(json.dumps(SOUND))
    *way, last = path
    place = spec
    for key in way:
        place = place[key]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return json.dumps(spec)


HIP = ("legs", 1, "links", 0, "joint")
AT_HIP = "legs[1].links[0].joint"
SOLID, FOOT = ("torso", "solids", 0), ("legs", 3, "foot")
IN_SOLID = "name, shape, size, position, euler_deg"
THIN = "legs: r2_foot: expected a radius from 0.0009 at density 10, got "
PARALLEL = "camera.xyaxes: expected two directions that are not parallel, got "
SHAPES = "sphere, capsule, cylinder, ellipsoid, box"
IN_BODY = "(there are: name, torso, legs, camera, density, ballast, simulation, agility, palette, ornaments)"
IN_TORSO = "(there are: standing_height, solids)"
IN_LINK = "(there are: name, end, radius, joint)"
IN_JOINT = "(there are: name, axis, range_deg, armature, damping, friction_loss, motor)"
BRITISH = "colo" + "ur"
WEIGHT = "density of the body sets the weight of all parts, ballast adds some"


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("name",), "Großer Käfer", "name: expected 1 to 32 characters out of [a-z0-9_], got 'Großer Käfer'"),
        (("name",), ..., "name: missing; a Body needs it"),
        (("torso", "solids"), {}, "torso.solids: expected a list of Solids, got an object"),
        ((*SOLID, "shape"), "mesh", f"torso.solids[0].shape: expected one of {SHAPES}, got 'mesh'"),
        ((*SOLID, "file"), "a.stl", f"torso.solids[0]: unknown field 'file' (there are: {IN_SOLID})"),
        ((*HIP, "damping"), -1, f"{AT_HIP}.damping: expected a number from 0 to 1e+35, got -1"),
        ((*HIP, "motor"), 120, f"{AT_HIP}.motor: expected an object with the fields of a Motor, got a number"),
        ((*HIP, "motor", "gear"), math.inf, f"{AT_HIP}.motor.gear: expected a number from 1e-20 to 1e+30, got inf"),
        (("legs", 2, "mount"), "here", "legs[2].mount: expected 3 numbers, got 'here'"),
        (("legs", 2, "mount", 1), 10**400, "legs[2].mount: expected a number from -100 to 100, got inf"),
        (("legs", 2, "name"), "l1", "legs: the name 'l1' occurs twice"),
        (("legs", 2, "links"), [], "legs[2].links: expected 1 to 16 Links, got 0"),
        (("legs", 2, "links", 1), None, "legs[2].links[1]: expected an object with the fields of a Link, got null"),
        ((*FOOT, "radius"), True, "legs[3].foot.radius: expected a number from 1e-06 to 100, got True"),
        ((*FOOT, "radius"), 1e-5, f"{THIN}1e-05"),
        ((*FOOT, "radius"), 8e-4, f"{THIN}0.0008 (density 20 fits)"),
        (("simulation", "timestep"), 0.05, "simulation.contact_time: expected at least two timesteps, got 0.023094"),
        (("camera", "xyaxes"), [1, 0, 0.5, -0.5, 0, -0.25], f"{PARALLEL}(1.0, 0.0, 0.5, -0.5, 0.0, -0.25)"),
        (("camera", "xyaxes"), [0, 0, 0, 0, 1, 0], f"{PARALLEL}(0.0, 0.0, 0.0, 0.0, 1.0, 0.0)"),
        (("legs",), None, "legs: expected a list of Legs, got null"),
        (("include",), "a.xml", f"unknown field 'include' {IN_BODY}"),
        (("torso", "ballast"), [], f"torso: unknown field 'ballast'; it is a field of a Body {IN_TORSO}"),
        (("torso", "camera"), {}, f"torso: unknown field 'camera'; it is a field of a Body {IN_TORSO}"),
        (
            ("legs", 0, "radius"),
            1,
            "legs[0]: unknown field 'radius'; it is a field of a Link (there are: name, mount, links, foot, yaw_deg)",
        ),
        ((*HIP, "gear"), 1, f"{AT_HIP}: unknown field 'gear'; it is a field of a Motor {IN_JOINT}"),
        (("mass",), 1, f"unknown field 'mass'; {WEIGHT} {IN_BODY}"),
        (("torso", "mass"), 1, f"torso: unknown field 'mass'; {WEIGHT} {IN_TORSO}"),
        (("legs", 0, "links", 0, "weight"), 1, f"legs[0].links[0]: unknown field 'weight'; {WEIGHT} {IN_LINK}"),
        (("color",), "red", f"unknown field 'color'; did you mean 'palette'? {IN_BODY}"),
        ((BRITISH,), "red", f"unknown field '{BRITISH}'; did you mean 'palette'? {IN_BODY}"),
        (("colors",), ["red"], f"unknown field 'colors'; did you mean 'palette'? {IN_BODY}"),
        (("torso", "color"), "red", f"torso: unknown field 'color'; palette of the body has its colors {IN_TORSO}"),
        (
            ("gravity",),
            1,
            "unknown field 'gravity'; environment.change_model({'gravity': [0.0, 0.0, -1.62]}) sets it " + IN_BODY,
        ),
        (("terrain",), 1, f"unknown field 'terrain'; --arena or a task such as rough has the ground {IN_BODY}"),
        (("gait",), 1, f"unknown field 'gait'; it is a setting of tasks, --set gait=VALUE {IN_BODY}"),
        (("head",), "round", f"unknown field 'head'; docs/bodies.md: heads, tails and ballast {IN_BODY}"),
        (("height",), 1, f"unknown field 'height'; standing_height of the torso sets it {IN_BODY}"),
        (("motors",), 1, f"unknown field 'motors'; each joint has its motor {IN_BODY}"),
        (("ornaments",), [], "ornaments: expected true or false, got []"),
        (("camra",), 1, f"unknown field 'camra'; did you mean 'camera'? {IN_BODY}"),
    ],
)
def test_a_malformed_field_is_named_by_its_path(path, value, message):
    with refused(message, SpecError):
        body_from_json(changed(path, value))


def leaves(value, path=()):
    """Paths to everything in a spec that is no object."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from leaves(item, (*path, key))
    if path and not isinstance(value, dict):
        yield path


BAD = [None, "1", [], {}, True, math.nan, math.inf, -math.inf, 1e300, -1e300, "ä" * 40]


def bad_fields():
    """Texts of the sound spec in which one leaf is what it may not be, and the field's name."""
    for path in leaves(SOUND):
        for value in BAD:
            # what is left open, or a name that happens to be allowed, is no mistake
            if (value is None and path[-1] in ("standing_height", "armature", "damping")) or (
                value == "1" and path[-1] == "name"
            ):
                continue
            yield changed(path, value), next(key for key in reversed(path) if isinstance(key, str))


@pytest.mark.slow
def test_every_field_refuses_what_it_cannot_be():
    """All leaves of a spec x values that none of them may have: errors of one line."""
    count = 0
    for text, field in bad_fields():
        with pytest.raises(SpecError) as error:
            body_from_json(text)
        message = str(error.value)
        assert "\n" not in message
        assert len(message) < 250
        assert field in message
        count += 1
    assert count > 300


def test_refusing_keeps_no_memory():
    texts = [text for text, _ in bad_fields()][::60]
    tracemalloc.start()
    for text in texts:
        with pytest.raises(SpecError):
            body_from_json(text)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(texts) > 20
    assert kept < 5e5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a body in JSON, got an empty file"),
        (json.dumps(SOUND)[:-40], "expected a body in JSON; line 1, column "),
        ('{"a": 1, // 2', "expected a body in JSON; line 1, column 10: JSON has no comments"),
        ("// a body", "expected a body in JSON; line 1, column 1: JSON has no comments"),
        ('{"a": "b', "expected a body in JSON; line 1, column 7: unterminated string"),
        ("{'a': 1}", "expected a body in JSON; line 1, column 2: JSON has double quotes"),
        ('{"a": [1,,2]}', "expected a body in JSON; line 1, column 10: a comma too many"),
        ('{"a": True}', "expected a body in JSON; line 1, column 7: JSON has true, false and null"),
        ('{"a": [1,', "expected a body in JSON; line 1, column 10: the text ends before its last bracket"),
        ("[1, 2]", "expected an object with the fields of a Body, got a list"),
        ("7", "expected an object with the fields of a Body, got a number"),
        ("[" * 200_000, "expected a body in JSON, got too many brackets within brackets"),
        ('{"name": "a", "name": "b"}', "the key 'name' occurs twice in one object"),
        ('{"na\\nme": 1}', "unknown field 'na\\nme'; did you mean 'name'?"),
        (b"\xff\xfe\x00", "expected a body in JSON, got a file that is no text"),
        ('{"legs": ' + "1" * 10_000 + "}", "name: missing; a Body needs it"),
        ('{"' + "x" * 100_000 + '": 1}', f"unknown field '{'x' * 40}' (there are: "),
    ],
)
def test_what_is_no_body_is_one_line(text, message):
    with refused(message, SpecError, begins=True):
        body_from_json(text)


def test_files_that_hold_no_body_are_named(tmp_path):
    path = tmp_path / "body.json"
    path.write_text(changed(("density",), 0))
    with refused(f"{path}: density: expected a number from 1e-09 to 1e+09, got 0", SpecError):
        load_body(path)
    path.write_text(" " * (MAX_BYTES + 1))
    with refused(f"{path}: expected at most {MAX_BYTES} bytes", SpecError):
        load_body(path)
    folder = tmp_path / "folder"
    folder.mkdir()
    body_inside = f"is a directory; did you mean {path}?"
    cases = (
        (tmp_path / "none.json", "no such file or directory"),
        (folder, "is a directory"),
        (tmp_path, body_inside),
    )
    for missing, reason in cases:
        with refused(f"cannot read {missing}: {reason}", OSError):
            load_body(missing)


def test_a_million_legs_are_counted_not_built():
    with pytest.raises(SpecError, match=r"^legs\[0\]: expected an object with the fields of a Leg, got a number$"):
        body_from_json('{"name": "a", "torso": ' + json.dumps(SOUND["torso"]) + ', "legs": [' + "1," * 999_999 + "1]}")


def test_texts_with_brackets_come_back(tmp_path):
    """Lists of numbers are on one line, texts that look like such lists stay as they are."""
    text = "a [ 1  2 ] b, [  3 ]"
    body = generator.generate(4, 2)
    link = body.legs[0].links[0]
    aliased_link = link.replace(joint=link.joint.replace(alias=text))
    leg = body.legs[0].replace(links=(aliased_link, *body.legs[0].links[1:]))
    body = body.replace(name="aliased", legs=(leg, *body.legs[1:]))
    save_body(body, tmp_path / "body.json")
    assert load_body(tmp_path / "body.json") == body
    assert body.legs[0].joints[0].alias == text and '"mount": [0.' in (tmp_path / "body.json").read_text()


def test_a_file_that_cannot_be_written_completely_stays_as_it_is(tmp_path, monkeypatch):
    path = tmp_path / "body.json"
    save_body(ROBOTS["tick"], path)

    def write_half(self, text, **options):
        with self.open("w", encoding="utf-8") as file:
            file.write(text[: len(text) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", write_half)
    with refused(f"cannot write {path}: no space left on device", OSError):
        save_body(ROBOTS["queen"], path)
    assert load_body(path) == ROBOTS["tick"] and [entry.name for entry in tmp_path.iterdir()] == ["body.json"]
