"""`arc-suite build_model` and the bodies it makes to order."""

import imageio.v3 as imageio
import imports
import mujoco
import numpy as np
import programs
import pytest
from dm_control import mjcf
from saved_models import saved, without_keyframe

from arc_suite import models, registry
from arc_suite.arenas import FLAT
from arc_suite.bodies import generator
from arc_suite.bodies.families import sound_body
from arc_suite.bodies.shaping import shaped
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import EXAMPLES, load_body
from arc_suite.simulation.physics import Physics

ROBOT_WORDS = ", ".join(registry.robot_words())
SOURCES = "expected one of --robot, --spec, --legs and --seed (or the last two)"


def build_model(*arguments):
    return programs.arc_suite("build_model", *arguments)


def compiled(body, decorated=False):
    return mjcf.Physics.from_mjcf_model(models.assemble(body, decorated=decorated)).model.ptr


def test_three_links_are_the_default():
    assert build_model("--legs=4").stdout == build_model("--legs=4", "--links=3").stdout


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_dumps_and_reloads_bit_for_bit(robot, tmp_path):
    path = tmp_path / "robot.xml"
    assert programs.passed(build_model("--robot", robot, "--output", path)) == f"wrote {path}\n"
    assert saved(without_keyframe(path.read_text())) == saved(compiled(ROBOTS[robot]))
    assert [entry.name for entry in tmp_path.iterdir()] == ["robot.xml"]


def test_visuals_dump_and_reload_bit_for_bit():
    model = without_keyframe(programs.passed(build_model("--robot", "queen", "--visuals")))
    assert saved(model) == saved(compiled(ROBOTS["queen"], decorated=True))
    assert saved(model) != saved(compiled(ROBOTS["queen"]))


@pytest.mark.parametrize(
    ("arguments", "body"),
    [
        (["--legs=6", "--links=3"], generator.generate(6, 3)),
        (["--legs=5", "--links=2"], generator.generate(5, 2)),
        (["--legs=6", "--layout=radial", "--scale=2.5"], generator.scaled(generator.generate(6, 3, "radial"), 2.5)),
        (["--seed=11"], sound_body(11)),
        (["--seed=11", "--legs=4", "--links=1"], sound_body(11, 4, 1)),
        (["--spec", EXAMPLES["spider"]], load_body("spider")),
        (["--robot", EXAMPLES["spider"], "--length=upper=1.2"], shaped(load_body("spider"), links={"upper": 1.2})),
        (["--legs=6", "--head=round", "--tail=long"], shaped(generator.generate(6, 3), head="round", tail="long")),
        (["--robot=tick", "--scale=2", "--name=flea"], generator.scaled(ROBOTS["tick"], 2.0).replace(name="flea")),
    ],
)
def test_a_body_made_to_order_dumps_and_reloads_bit_for_bit(arguments, body):
    assert saved(without_keyframe(programs.passed(build_model(*arguments)))) == saved(compiled(body))


def test_without_arena_a_scene_of_dm_control_takes_it(tmp_path):
    path = tmp_path / "tick.xml"
    programs.passed(build_model("--robot=tick", "--no_arena", "--visuals", "--output", path))
    scene = mjcf.RootElement("scene")
    scene.worldbody.add("geom", type="plane", size=(1.0, 1.0, 0.1))
    scene.attach(mjcf.from_path(path)).add("freejoint")
    assert mjcf.Physics.from_mjcf_model(scene).model.nu == len(ROBOTS["tick"].joint_names)


def test_json_is_the_spec_and_builds_the_same_model(tmp_path):
    path = tmp_path / "body.json"
    assert programs.passed(build_model("--seed=5", "--json", "--output", path)) == f"wrote {path}\n"
    assert load_body(path) == sound_body(5)
    assert build_model("--spec", path).stdout == build_model("--seed=5").stdout
    assert build_model("--spec", path, "--json").stdout == path.read_text()


def test_summary_prints_the_figures_alone():
    lines = build_model("--robot=queen", "--summary").stdout.splitlines()
    figures = "; ".join(": ".join(part.strip() for part in line.split("  ", 1)) for line in lines)
    assert figures == (
        "name: queen; legs: 6; links: 3 actuated a leg; degrees of freedom: 18 + 6; mass: 12.09 kg; "
        "standing height: 0.75 m; observation: 199 numbers; stability margin: 0.67 m (0.89 of the height); "
        "control step: 0.05 s; target velocity: 0.5 m/s; gait: 1.5 Hz, duty factor 0.60"
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--legs=3"],
            "flag --legs=3: expected an integer in the range [4, 12]; a body of 3 legs is a spec, --spec=FILE",
        ),
        (["--legs=6", "--links=0"], "flag --links=0: expected an integer in the range [1, 4]"),
        (
            ["--robot=quen"],
            f"unknown robot 'quen'; did you mean 'queen'? (there are: {ROBOT_WORDS}, module:name to import it)",
        ),
        (["--robot=varied:0-1"], "robot 'varied:0-1': expected one body, got several"),
        (["--robot=queen", "--links=2"], "--links=2: goes with --legs or --seed, not with --robot"),
        ([], f"{SOURCES}, got none"),
        (["--robot=queen", "--legs=6"], f"{SOURCES}, got --robot and --legs"),
        (["--robot=queen", "--spec=a.json"], f"{SOURCES}, got --robot and --spec"),
        (["--legs=6", "--scale=0"], "flag --scale=0: expected a number in the range [0.01, 100.0]"),
        (["--legs=6", "--scale=nan"], "scale: expected a number from 0.01 to 100, got nan"),
        (["--seed=-1"], "flag --seed=-1: expected a non-negative integer"),
        (["--legs=5", "--layout=pairs"], "layout: expected radial for an odd number of legs, got 'pairs' for 5"),
        (
            ["--robot=tick", "--task=stairs", "--no_arena"],
            "--no_arena: goes without --task, --set and --arena, which bring an arena",
        ),
        (["--legs=5", "--layout=row"], "flag --layout=row: expected pairs or radial"),
        (["--legs=4", "--render=x.txt"], "unknown extension '.txt' (there are: .png)"),
        (["--legs=4", "--render=x"], "x: expected a name that ends in .png"),
        (["--legs=4", "--output=x.json"], "--output=x.json: a model is .xml; --json writes the spec"),
        (
            ["--legs=4", "--name=Flea"],
            "Body.name: expected 1 to 32 characters out of [a-z0-9_], got 'Flea'; did you mean 'flea'?",
        ),
        (["--legs=4", "--name=tick"], "--name=tick: it is a robot of the suite, whose numbers go with its name"),
        (["--spec=missing.json"], "cannot read missing.json: no such file or directory"),
    ],
)
def test_bad_arguments_are_one_line(arguments, message):
    programs.refused(build_model(*arguments), f"arc-suite build_model: {message}\n")


def test_a_name_without_an_extension_gets_that_of_what_is_written(tmp_path):
    for flags, name in (((), "walker.xml"), (("--json",), "walker.json")):
        done = build_model("--legs=4", *flags, "--output", tmp_path / "walker")
        assert programs.passed(done) == f"wrote {tmp_path / name}\n"
        assert (tmp_path / name).stat().st_size > 1000


def test_a_path_that_cannot_be_written_is_one_line_and_leaves_no_file(tmp_path):
    (tmp_path / "file").write_text("kept")
    for path, reason in (
        (tmp_path / "missing" / "a.xml", "no such file or directory"),
        (tmp_path / "file" / "a.xml", "not a directory"),
        (tmp_path, "is a directory"),
    ):
        line = f"arc-suite build_model: cannot write {path}: {reason}\n"
        programs.refused(build_model("--robot=tick", "--output", path), line)
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.slow
def test_a_task_brings_its_ground(tmp_path):
    path = tmp_path / "stairs.xml"
    programs.passed(build_model("--robot=tick", "--task=stairs", "--set=difficulty=1", f"--output={path}"))
    model = mujoco.MjModel.from_xml_path(str(path))
    assert {"floor_0", "floor_10"} <= {model.geom(index).name for index in range(model.ngeom)}
    rough = mujoco.MjModel.from_xml_string(build_model("--robot=tick", "--task=rough").stdout)
    assert rough.nhfield == 1 and rough.hfield_data.max() == 1.0
    wrong = build_model("--robot=tick", "--task=stairs", "--set=difficulty=2")
    programs.refused(wrong, "arc-suite build_model: difficulty: expected a number from 0 to 1, got 2\n")


@pytest.mark.slow
def test_the_picture_of_an_imported_robot_shows_it_as_it_stands(tmp_path):
    """Its joints are not at zero as it stands, and the camera frames it as it stands."""
    programs.passed(
        programs.arc_suite("build_model", "--spec", str(imports.FILES / "go2_like.xml"), "--render=a.png", cwd=tmp_path)
    )
    physics = Physics.from_body(imports.quadruped(), FLAT)
    physics.reset(keyframe_id=0)
    standing_picture = physics.render(camera_id="portrait", quality="still")
    picture = imageio.imread(tmp_path / "a.png")
    assert np.abs(picture - standing_picture.astype(float)).mean() < 1.0  # of 255; processes draw edges differently
    physics.reset()
    picture_at_zero = physics.render(camera_id="portrait", quality="still")
    assert np.abs(picture - picture_at_zero.astype(float)).mean() > 5.0
    physics.free()
