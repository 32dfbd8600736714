"""`arc-suite check` tells what is wrong with a body in a spec file."""

import json
import re
from pathlib import Path

import imports
import programs
import pytest

from arc_suite.bodies import generator
from arc_suite.evaluation import cures
from arc_suite.models import standing
from arc_suite.models.sizing import size_body
from arc_suite.robots import spec_files
from arc_suite.robots.spec import Ballast
from arc_suite.tasks import TASKS

TASK_NAMES = f"(there are: {', '.join(TASKS)}, module:name to import it)"
ROOT = Path(__file__).parents[2]


def check(*arguments):
    return programs.arc_suite("check", *arguments)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "body.json"


def write(path, **torso):
    """Write the spec of a body 0.4 m high, with some fields of its torso changed; None removes one."""
    spec = json.loads(spec_files.body_to_json(generator.generate(6, 3)))
    spec["torso"] = {name: value for name, value in (spec["torso"] | torso).items() if value is not None}
    path.write_text(json.dumps(spec))


def test_a_sound_body_is_said_to_be_one(path):
    write(path, standing_height=None)
    assert programs.passed(check(path)) == f"{path}: walker_6x3 stands and can take steps\n"


def test_a_standing_height_that_does_not_fit_is_told_with_one_that_does(path):
    write(path, standing_height=1.2)
    done, flaw = check(path), "feet hang 0.8 m above the floor: standing_height 0.4 fits"
    assert (done.returncode, done.stdout, done.stderr) == (1, f"{path}: {flaw}\n", "")
    summary = programs.arc_suite("build_model", "--spec", path, "--summary").stdout
    assert summary.splitlines()[-1].split(maxsplit=1) == ["flaw", flaw]


def test_motors_for_heavy_ballast_are_told(path):
    body = generator.generate(6, 3)
    for mass, is_told in ((1.0, False), (100.0, True), (5000.0, True)):
        iron = Ballast(name="iron", shape="sphere", size=(0.05,), mass=mass)
        laden_body = body.replace(ballast=(iron,))
        spec_files.save_body(laden_body, path)
        _, *notes = programs.passed(check(path)).splitlines()
        torque = max(joint.torque for joint in size_body(laden_body).joints)
        ratio = round(mass / standing.measure_standing(body).mass)
        note = f"its ballast of {mass:g} kg weighs {ratio} times the rest: the suite chooses motors of up to "
        assert [line.removeprefix(f"{path}: {note}") for line in notes] == [
            f"{float(f'{torque:.3g}'):g} N m for it; a gear in the spec sets others"
        ] * is_told
    spec_files.save_body(size_body(body).replace(ballast=laden_body.ballast), path)
    assert "N m that hold the body up" in check(path).stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "expected a spec file or --task; see --help"),
        (("--task=wlak",), f"unknown task 'wlak'; did you mean 'walk'? {TASK_NAMES}"),
        (("--task=walk", "--walk"), "--walk: expected a spec file, got --task"),
        (("--task=walk", "--tasks"), "--tasks: expected a spec file, got --task"),
        (("missing.json",), "cannot read missing.json: no such file or directory"),
    ],
)
def test_bad_arguments_are_one_line(arguments, message):
    programs.refused(check(*arguments), f"arc-suite check: {message}\n")


def test_a_file_that_holds_no_body_is_one_line(path):
    write(path, standing_height=-1)
    line = "torso.standing_height: expected a number from 1e-06 to 100, got -1"
    programs.refused(check(path), f"arc-suite check: {path}: {line}\n")
    line = "expected a body in JSON, got XML; the name of an MJCF file ends in .xml, that of a URDF file in .urdf"
    for text in ("<mujoco/>", '\n<?xml version="1.0"?>\n<robot name="a"/>'):
        path.write_text(text)
        programs.refused(check(path), f"arc-suite check: {path}: {line}\n")


@pytest.mark.slow
def test_a_task_that_rounds_otherwise_alone_is_told_by_its_term(tmp_path):
    (tmp_path / "squaring.py").write_text(
        "import arc_suite\nfrom arc_suite.tasks.walk import Walk\n\n"
        "class Squaring(Walk):\n    name = 'squaring'\n\n"
        "    def terms(self, memory, readings):\n"
        "        return super().terms(memory, readings) | {'forward': memory.forward_velocity**2}\n\n"
        "arc_suite.register(module=__name__, tasks=(Squaring,))\n"
    )
    done = programs.arc_suite("check", "--task=squaring:squaring", "--robot=tick", cwd=tmp_path)
    assert done.returncode == 1 and done.stdout.startswith("tick, squaring: a batch of environments differs from one")
    assert done.stdout.endswith(": term forward\n")


def _quadruped(**joint):
    """A spec of the size of a Go2, of 15 kg, with fields of its joints."""

    def leg(name, x, y):
        parts = (
            ("hip", [1, 0, 0], [0, 0.0955 if y > 0 else -0.0955, 0], 0.04, 48),
            ("thigh", [0, 1, 0], [-0.14, 0, -0.16], 0.025, 60),
            ("calf", [0, 1, 0], [0.14, 0, -0.16], 0.02, 60),
        )
        links = [
            {"name": name, "end": end, "radius": radius}
            | {"joint": {"name": name, "axis": axis, "range_deg": [-reach, reach], **joint}}
            for name, axis, end, radius, reach in parts
        ]
        return {"name": name, "mount": [x, y, 0.0], "links": links, "foot": {"radius": 0.022}}

    solid = {"name": "base", "shape": "box", "size": [0.19, 0.047, 0.057]}
    legs = [
        leg(f"{end}{side}", x, y) for end, x in (("f", 0.19), ("r", -0.19)) for side, y in (("l", 0.05), ("r", -0.05))
    ]
    return json.dumps({"name": "quadruped", "density": 700.0, "torso": {"solids": [solid]}, "legs": legs})


@pytest.mark.slow
def test_a_body_that_falls_is_told_what_to_leave_out(path):
    path.write_text(_quadruped(motor={"gear": 198.0}, armature=0.01, damping=0.1))
    done = check("--walk", path)
    stands, *_, falls = done.stdout.splitlines()
    assert (done.returncode, stands) == (1, f"{path}: quadruped stands and can take steps")
    found = re.fullmatch(
        rf"{path}: with medium, quadruped falls after (\d+) control steps; leave out (.*) of its joints: "
        r"then medium walks 100 control steps at [\d.]+ m/s \([\d.]+ of the target 0\.37\)",
        falls,
    )
    assert int(found[1]) < 100 and set(found[2].split(" and ")) <= {"motor", "damping", "armature"}


def test_a_walk_is_judged_by_its_share_of_the_target_speed():
    done = check("--walk", "spider")
    line = r"spider: walks 100 control steps at 0\.\d\d m/s \((0\.9|1\.[0-3])\d of the target 0\.31\) by straight"
    assert done.returncode == 0 and re.fullmatch(line, done.stdout.splitlines()[1])


@pytest.mark.slow
def test_a_slow_body_is_told_what_to_leave_out(path):
    spec = json.loads(spec_files.body_to_json(spec_files.load_body("spider")))
    for leg in spec["legs"]:
        for link in leg["links"]:
            link["joint"]["damping"] = 0.5
    path.write_text(json.dumps(spec))
    done = check("--walk", path)
    walks = r"walks 100 control steps at -?0\.\d\d m/s \({} of the target 0\.31\)"
    slow, fast = walks.format(r"-?0\.[0-6]\d"), walks.format(r"(0\.9|1\.[0-3])\d")
    line = rf"{path}: with medium, spider is slow: it {slow}; leave out damping of its joints: then medium {fast}"
    assert done.returncode == 1 and re.fullmatch(line, done.stdout.splitlines()[-1])


def test_a_weak_body_is_told_and_walked_all_the_same(path):
    spec = json.loads(spec_files.body_to_json(spec_files.load_body("spider")))
    for leg in spec["legs"]:
        leg["links"][0]["joint"]["motor"] = {"gear": 0.01}
    path.write_text(json.dumps(spec))
    done = check("--walk", path)
    weak, *walks = done.stdout.splitlines()
    assert done.returncode == 1
    assert re.fullmatch(
        rf"{path}: weak: reaches about 0\.\d of the target speed, as the motor of \w+ lacks .*: gear .* fits", weak
    )
    for line, preset in zip(walks, ("straight", "medium"), strict=True):
        assert re.match(rf"{path}: with {preset}, spider is slow: it walks 100 control steps at .*\)", line)


def test_a_body_that_drags_its_torso_is_told(path):
    spec = json.loads(spec_files.body_to_json(spec_files.load_body("spider")))
    (chassis,) = spec["torso"]["solids"]
    chassis["size"][2] = 1.01 * 0.25  # of the standing height
    path.write_text(json.dumps(spec))
    done = check("--walk", path)
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1].startswith(
        f"{path}: with medium, spider drags its torso: it walks 100 control steps at "
    )


def test_another_demonstrator_walks_where_the_default_one_falls(path):
    robot = imports.FILES / "go2_like.xml"
    program_of_specs = ("build_model", "--spec", robot, "--length", "link3=1.4", "--json", "-o", path)
    assert programs.arc_suite(*program_of_specs, cwd=path.parent).returncode == 0
    done = check("--walk", path)
    falls, walks = done.stdout.splitlines()[1:]
    assert done.returncode == 0
    assert re.fullmatch(rf"{path}: with straight, quadruped_15_kg_shaped falls after \d+ control steps", falls)
    assert re.fullmatch(rf"{path}: walks 1000 control steps at 0\.3\d m/s \(1\.\d\d of .*\) by medium", walks)


def test_imported_robots_walk_for_20_seconds_and_get_no_advice():
    robot = imports.FILES / "go2_like.xml"
    done = check("--walk", robot)
    walks = r"walks 1000 control steps at 0\.\d\d m/s \((0\.[89]|1\.[01])\d of the target 0\.34\) by straight"
    assert done.returncode == 0 and re.fullmatch(f"{robot}: {walks}", done.stdout.splitlines()[1])


def test_weak_motors_of_an_imported_robot_are_told_with_torques_that_fit(path):
    """The motors can hold the robot, and are too weak to walk it."""
    spec_files.save_body(cures.multiply_motors(imports.quadruped(), 0.22), path)
    done = check("--walk", path)
    assert done.returncode == 1
    stands, first, second = done.stdout.splitlines()
    assert stands == f"{path}: quadruped_15_kg stands and can take steps"
    slow = r"quadruped_15_kg (is slow: it walks .*\)|falls after \d+ control steps)"
    assert re.fullmatch(rf"{path}: with straight, {slow}", first)
    cure = (
        r"with (1\.25|1\.5|2|3) times the torques and gains of its motors \([\d.]+ to [\d.]+ N m\) medium walks 1000 .*"
    )
    assert re.fullmatch(rf"{path}: with medium, {slow}; its motors are weak, as {cure}", second), second


def test_low_gains_of_an_imported_robot_are_told_before_its_torques(path):
    spec_files.save_body(cures.multiply_gains(imports.quadruped(), 0.1), path)
    done = check("--walk", path)
    assert done.returncode == 1
    cure = r"with (1\.25|1\.5|2|3|5) times its stiffness and damping \(up to [\d.]+ N m/rad\) and the same torques"
    line = rf"{path}: with medium, quadruped_15_kg .*; its gains are low, as {cure} medium walks 1000 control steps .*"
    assert re.fullmatch(line, done.stdout.splitlines()[-1]), done.stdout


def test_motors_that_do_not_hold_an_imported_robot_are_named_and_an_armature_is_not(path):
    spec_files.save_body(cures.multiply_motors(imports.quadruped(), 0.15), path)
    done = check(path)
    assert done.returncode == 1
    (line,) = done.stdout.splitlines()
    problem = r"sinks as it stands: 2 motors give their largest torque all the time \(RL_calf_joint, RR_calf_joint\)"
    cure = r"1\.25 times their torque holds it, 8\.5\d N m"
    assert re.fullmatch(rf"{path}: quadruped_15_kg {problem}; {cure}", line), line
    spec_files.save_body(cures.multiply_motors(imports.quadruped(), 0.15 * 1.25), path)
    assert check(path).returncode == 0


@pytest.mark.release
def test_every_task_is_walked_by_the_preset_that_suits_it():
    done = check("--tasks", "spider")
    assert done.returncode == 0  # its progress is told every half minute
    lines = done.stdout.splitlines()
    assert lines[0] == "spider: spider stands and can take steps"
    metric = r"(\d\.\d\d m/s|tracking \d\.\d\d of 1|\d\.\d\d goals an episode|joints off by \d\.\d\d rad)"
    for line, task in zip(lines[1:], TASKS, strict=True):
        text = "[0-4] of 4 got up" if task == "recover" else f"{metric}, [0-4] of 4 without a fall"
        assert re.fullmatch(rf"spider: {task} by \w+: {text}", line), line
    assert "spider: shoved by braced: tracking" in lines[10]
