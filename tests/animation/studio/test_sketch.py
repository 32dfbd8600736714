"""What the widgets say: the body, task and policy that it makes, and lines that make the same; no viser."""

import dataclasses
import math
import re
import shlex

import ground_files
import imports
import programs
import pytest
from numpy.testing import assert_array_equal
from refusals import refused

from arc_suite import moved, registry
from arc_suite.animation.studio import copy_lines, states, texts
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import open_creature
from arc_suite.animation.studio.effects import idle_fields
from arc_suite.animation.studio.sketch import FILE, RANDOM, Sketch
from arc_suite.animation.studio.states import VisitorCommand
from arc_suite.bodies import generator, shaping
from arc_suite.bodies.families import sound_body
from arc_suite.bodies.shaping import Shape
from arc_suite.models.soundness import flaws
from arc_suite.policies import alone
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_from_json, body_to_json, load_body

HIGH = generator.generate(6, 3)
HIGH = HIGH.replace(torso=HIGH.torso.replace(standing_height=0.5))

SKETCHES = {
    "legs": Sketch(legs=6, links=2),
    "layout": Sketch(legs=6, layout="radial", gait="wave"),
    "shaped": Sketch(legs=6, scale=2.0, fan=5.0, lengths=(("lower", 1.3), ("upper", 1.0)), speed=0.8),
    "dragged": Sketch(legs=6, links=2, ends=(("l1_lower", (0.0, 0.3, -0.3)), ("r9_lower", (1.0, 0.0, 0.0)))),
    "robot": Sketch(source="queen", ground="bumps", kicks=0.5, task="walk", preset="tuned"),
    "shaped robot": Sketch(source="tick", width=1.2, palette="#3A5F2B,#d8c48a"),
    "example": Sketch(source="spider", task="stairs", settings='{"difficulty": 0.5}'),
    "random": Sketch(source=RANDOM, seed=7, policy="zero", palette="7"),
    "file": Sketch(source=FILE, file=body_to_json(HIGH)),
    "shaped file": Sketch(source=FILE, file=body_to_json(HIGH), scale=2.0),
    "without ornaments": Sketch(legs=4, palette="moss", no_ornaments=True),
}


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("legs", generator.generate(6, 2)),
        ("layout", generator.generate(6, 3, "radial")),
        ("robot", ROBOTS["queen"]),
        ("example", load_body("spider")),
        ("random", sound_body(7).replace(palette=7)),
        ("file", HIGH),
        ("without ornaments", generator.generate(4, 3).replace(palette="moss", ornaments=False)),
    ],
)
def test_the_body(name, body):
    assert sketches.make_body(SKETCHES[name]) == body


def test_settings_of_the_task():
    assert sketches.make_setup(SKETCHES["legs"]).task_kwargs == {}
    assert sketches.make_setup(SKETCHES["robot"]).task_kwargs == {"arena": "bumps", "kicks": 0.5}
    assert sketches.make_setup(SKETCHES["layout"]).task_kwargs == {"gait": "wave"}
    own = sketches.make_setup(dataclasses.replace(SKETCHES["shaped"], speed=1.0)).definition.parameters
    settings = sketches.make_setup(SKETCHES["shaped"]).task_kwargs
    assert settings["target_velocity"] == pytest.approx(0.8 * own.target_velocity, rel=1e-3)
    assert settings["gait_frequency"] == pytest.approx(0.91 * own.gait_frequency, rel=1e-3)  # between slow and walk
    assert settings["duty_factor"] == pytest.approx(own.duty_factor + 0.025, rel=1e-3)
    trained = dataclasses.replace(SKETCHES["shaped"], policy="zero")
    assert list(sketches.make_setup(trained).task_kwargs) == ["target_velocity"]
    # A task with a ground of its own ignores the ground; settings of the field come before those of sliders.
    sketch = dataclasses.replace(SKETCHES["example"], ground="bumps")
    assert sketches.make_setup(sketch).task_kwargs == {"difficulty": 0.5}
    sketch = Sketch(kicks=0.5, settings='{"kicks": 1.0, "friction": 0.5}')
    assert sketches.make_setup(sketch).task_kwargs == {"kicks": 1.0, "friction": 0.5}


def test_a_link_of_one_leg_and_of_the_leg_across():
    """Lengths and dragged ends hold in the body's own proportions, and the way back leaves nothing."""
    sketch = Sketch(legs=6, links=2, scale=2.0, lengths=(("lower", 1.5),))
    own = {part: end for part, end in shaping.link_ends(sketches.source_body(sketch)).items() if "lower" in part}
    longer = sketches.set_length_factor(sketch, "l1_lower", 1.2, True)
    assert sketches.length_factor(longer, "r1_lower") == pytest.approx(1.2, rel=1e-3)
    assert sketches.length_factor(longer, "l2_lower") == 1.0 and sketches.length_factor(longer, "lower") == 1.5
    assert sketches.set_length_factor(longer, "r1_lower", 1.0, True) == sketch
    (alone,) = sketches.set_length_factor(sketch, "l1_lower", 1.2, False).ends
    assert alone[0] == "l1_lower"
    moved = sketches.drag_end(sketch, "r1_lower", (0.3, 0.6, 0.0), True)
    x, y, z = own["l1_lower"]
    assert dict(moved.ends)["l1_lower"] == pytest.approx((x + 0.1, y - 0.2, z), rel=1e-3)
    assert dict(moved.ends)["r1_lower"] == pytest.approx((x + 0.1, -y + 0.2, z), rel=1e-3)
    ends = shaping.link_ends(sketches.make_body(moved))
    assert ends["l1_lower"] == pytest.approx([3.0 * (x + 0.1), 3.0 * (y - 0.2), 3.0 * z], rel=1e-3)
    assert ends["l2_lower"] == pytest.approx([3.0 * number for number in own["l2_lower"]])


def test_a_dragged_end_follows_the_hand_though_one_link_ends_with_the_name_of_another():
    text = body_to_json(ROBOTS["tick"]).replace('"upper"', '"upper_arm"').replace('"lower"', '"arm"')
    sketch = sketches.set_length_factor(sketches.open_file(Sketch(), text), "arm", 2.0, symmetric=True)
    moved = sketches.drag_end(sketch, "l1_upper_arm", (0.01, 0.0, 0.0), symmetric=False)
    before, after = (shaping.link_ends(sketches.make_body(each))["l1_upper_arm"] for each in (sketch, moved))
    assert [end - start for start, end in zip(before, after, strict=True)] == pytest.approx([0.01, 0.0, 0.0], abs=1e-6)


def test_links_change_while_other_widgets_make_no_body():
    """A page shows and changes lengths of the creature that walks on."""
    odd = Sketch(legs=5, links=2, layout="pairs")
    longer = sketches.set_length_factor(odd, "lower", 1.2, True)
    assert (sketches.length_factor(odd, "lower"), sketches.length_factor(longer, "lower")) == (1.0, 1.2)
    assert sketches.drag_end(odd, "l1_lower", (0.1, 0.0, 0.0), True) == odd


def test_factors_of_links_that_the_body_lacks_are_ignored():
    sketch = Sketch(legs=6, links=2, lengths=(("middle", 1.5), ("lower", 1.0)))
    assert sketches.make_body(sketch) == generator.generate(6, 2)


@pytest.mark.parametrize("sketch", SKETCHES.values(), ids=SKETCHES)
def test_python_lines_make_the_same(sketch, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    body = sketches.make_body(sketch)
    (tmp_path / copy_lines.spec_file_name(body)).write_text(body_to_json(body))
    made = {}
    lines = copy_lines.python_lines(sketch)
    imported = re.findall(r"^from (\S+) import (.+)$", lines, re.MULTILINE)
    paths = {f"{package}.{name}" for package, names in imported for name in names.split(", ")}
    assert not paths & moved.MOVED.keys()
    exec(lines, made)
    assert made["body"] == body
    assert made["environment"].task_kwargs == sketches.make_setup(sketch).task_kwargs
    creature = open_creature(sketch)
    act = alone(made["policy"])
    timestep = creature.environment.reset()
    for _ in range(60):  # a swing of a foot
        action = act(timestep)
        assert_array_equal(action, creature.act(timestep))
        timestep = creature.environment.step(action)


@pytest.mark.slow
@pytest.mark.parametrize("sketch", [SKETCHES["legs"], SKETCHES["shaped"], SKETCHES["robot"]], ids=lambda s: s.source)
def test_the_command_line_is_understood(sketch, tmp_path):
    """The window of `view` needs a display; `evaluate` takes the same flags."""
    body = sketches.make_body(sketch)
    (tmp_path / copy_lines.spec_file_name(body)).write_text(body_to_json(body))
    program, view, *flags = shlex.split(copy_lines.command_line(sketch))
    assert (program, view) == ("arc-suite", "view")
    done = programs.arc_suite("evaluate", *flags, "--episodes=1", "--set=time_limit=0.5", cwd=tmp_path)
    assert body.name in programs.passed(done)


def test_command_lines():
    assert copy_lines.command_line(SKETCHES["legs"]) == "arc-suite view --legs 6 --links 2 --task directed"
    assert copy_lines.command_line(SKETCHES["layout"]).startswith(
        "arc-suite view --spec walker_6x3.json --task directed"
    )
    assert copy_lines.command_line(SKETCHES["robot"]) == (
        "arc-suite view --robot queen --task walk --set=arena=bumps --set=kicks=0.5 --preset tuned"
    )
    assert "--spec spider" in copy_lines.command_line(SKETCHES["example"])
    assert "--spec tick_shaped.json" in copy_lines.command_line(SKETCHES["shaped robot"])
    assert copy_lines.command_line(SKETCHES["random"]).endswith("--spec random_7.json --task directed --policy zero")
    note = "Save the spec first: these lines read random_7.json."
    assert note in texts.lines_to_copy(SKETCHES["random"])
    assert "Save the spec first" not in texts.lines_to_copy(SKETCHES["robot"])


def test_ground_of_a_file_stays_with_the_sketch(tmp_path):
    word = ground_files.write_png(tmp_path / "hill.png")
    sketch = dataclasses.replace(SKETCHES["robot"], ground=word, ground_file=registry.arena_word(word))
    (tmp_path / "hill.png").unlink()
    creature = open_creature(sketch)
    arena = creature.environment.task.definition.scene.arena
    assert not arena.is_level and arena.map.name == "hill"
    assert f"--set=arena={word} " in copy_lines.command_line(sketch)
    assert f"'arena': {word!r}" in copy_lines.python_lines(sketch)
    state = states.PageState(sketch)
    assert states.from_json(states.to_json(state)).sketch == sketch


@pytest.mark.parametrize("name", ["legs", "robot", "example"])
def test_a_creature_walks(name):
    creature = open_creature(SKETCHES[name])
    timestep = creature.environment.reset()
    for _ in range(5):
        timestep = creature.environment.step(creature.act(timestep))
    assert not timestep.last() and creature.environment.task.definition.step_limit == float("inf")


def test_what_check_says_can_be_applied():
    """The body that mends the flaw comes as a file, and what the creature does stays."""
    sketch = dataclasses.replace(SKETCHES["file"], gait="ripple", kicks=0.2, scale=1.5)
    creature = open_creature(dataclasses.replace(sketch, scale=1.0))
    (flaw,) = creature.flaws
    assert flaw.text == "feet hang 0.1 m above the floor: standing_height 0.4 fits"
    mended = sketches.open_body(sketch, flaw.cure)
    assert (mended.source, mended.gait, mended.kicks, mended.scale) == (FILE, "ripple", 0.2, 1.0)
    assert sketches.make_body(mended).torso.standing_height == 0.4 and flaws(sketches.make_body(mended)) == []


def test_legs_that_overlap_are_moved_apart():
    sketch = Sketch(legs=12, links=3, layout="pairs")
    (flaw,) = open_creature(sketch).flaws
    assert re.fullmatch(
        r"[lr]\d+_\w+ and [lr]\d+_\w+ overlap by .* m in a stride: legs mounted .* as far out fit", flaw.text
    )
    assert open_creature(sketches.open_body(sketch, flaw.cure)).flaws == ()


@pytest.mark.parametrize(
    ("sketch", "message"),
    [
        (Sketch(legs=5, layout="pairs"), "layout: expected radial for an odd number of legs, got 'pairs' for 5"),
        (Sketch(gait="trot"), "gait 'trot' does not fit walker_8x3 with its 8 legs (fit: tripod, tetrapod, ripple, "),
        (
            Sketch(settings="friction=1"),
            'settings: expected a JSON object, such as {"friction": 0.5}; line 1, column 1',
        ),
        (Sketch(settings="[1]"), "settings: expected a mapping of names to values, got [1]"),
        (Sketch(settings='{"random": 1}'), "setting 'random': expected none, as every episode has a seed, got 1"),
        (Sketch(settings='{"arena": "os:path"}'), ""),
        (Sketch(settings='{"arena": "antigravity:x"}'), "arena 'antigravity:x': files import nothing"),
        (Sketch(ground="a.png"), "unknown arena ''"),
        (
            Sketch(ground="a.png", ground_file="/etc/hill.png"),
            "arena '/etc/hill.png': what is stored cannot name a file",
        ),
        (Sketch(ground="a.png", ground_file="{}"), "arena: expected a name, a file or ground as JSON"),
        (Sketch(palette="mos"), "unknown palette 'mos'; did you mean 'moss'?"),
        (Sketch(source="spidre"), "unknown source 'spidre'; did you mean 'spider'?"),
        (Sketch(source=FILE, file="{}"), "name: missing; a Body needs it"),
        (Sketch(task="walk", preset="balanced"), "unknown preset 'balanced'"),
        (
            Sketch(task="walk", preset="antigravity:x"),
            "law 'antigravity:x': files import nothing; import 'antigravity'",
        ),
        (Sketch(preset="sighted"), "observation: expected a block scan, as the task rough has (--task rough)"),
        (Sketch(policy="ppo"), "policy ppo: none for walker_8x3-directed"),
    ],
)
def test_a_bad_combination_is_one_line(sketch, message):
    with refused(message, begins=True):
        open_creature(sketch)


def test_an_imported_robot_has_sliders_of_its_size_and_its_links():
    """They change the robot as `--length` of programs does, are saved and read back, and others are hidden."""
    robot = imports.quadruped()
    sketch = sketches.open_body(Sketch(task="steer"), robot)
    creature = open_creature(sketch)
    idle = idle_fields(creature, VisitorCommand())
    assert idle & {*Shape._fields[:-2], "lengths"} == {"length", "width", "thickness", "fan", "torso", "head", "tail"}
    assert creature.parts_with_lengths == tuple(shaping.link_ends(robot))
    longer = sketches.set_length_factor(sketch, "link3", 1.2, symmetric=True)
    longer = dataclasses.replace(sketches.set_length_factor(longer, "l1_link2", 0.9, symmetric=True), scale=2.0)
    assert {part for part, _ in longer.ends} == {"l1_link2", "r1_link2"}
    body = open_creature(longer).setup.body
    assert body.name == "quadruped_15_kg_shaped" and body_from_json(body_to_json(body)) == body
    lengths = {part: math.hypot(*end) for part, end in shaping.link_ends(body).items()}
    for part, end in shaping.link_ends(robot).items():
        factor = {"link3": 2.4}.get(part[3:], 1.8 if part in ("l1_link2", "r1_link2") else 2.0)
        assert lengths[part] == pytest.approx(factor * math.hypot(*end), rel=1e-4)
    assert states.from_json(states.to_json(states.PageState(longer))).sketch == longer


def test_sliders_of_an_imported_robot_are_the_flags_of_programs(tmp_path):
    path, made = imports.FILES / "go2_like.xml", tmp_path / "longer.json"
    flags = ("--length=link3=1.2", "--scale=2", "--json", f"--output={made}")
    done = programs.arc_suite("build_model", f"--spec={path}", *flags)
    assert done.returncode == 0, done.stderr
    sketch = sketches.set_length_factor(sketches.open_body(Sketch(), imports.quadruped()), "link3", 1.2, True)
    body = sketches.make_body(dataclasses.replace(sketch, scale=2.0))
    assert load_body(str(made)).replace(name=body.name) == body
