"""tools/build_model.py and the bodies it makes to order."""

import math
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from arc_suite import models
from arc_suite.physics import Physics
from arc_suite.robots import ROBOTS, generator
from arc_suite.spec import SpecError

TOOL = Path(__file__).parent.parent / "tools" / "build_model.py"


def build_model(*arguments):
    return subprocess.run([sys.executable, TOOL, *map(str, arguments)], capture_output=True, text=True)


def saved(model):
    """Everything there is in a compiled model, names included, as bytes."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def compiled(body, decorated=False):
    return mjcf.Physics.from_mjcf_model(models.assemble(body, decorated)).model.ptr


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_dumps_and_reloads_bit_for_bit(robot, tmp_path):
    path = tmp_path / "robot.xml"
    done = build_model("--robot", robot, "--output", path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    reloaded = mujoco.MjModel.from_xml_path(str(path))
    assert saved(reloaded) == saved(compiled(ROBOTS[robot]))
    assert saved(reloaded) == saved(Physics.from_body(ROBOTS[robot]).model.ptr)
    assert [entry.name for entry in tmp_path.iterdir()] == ["robot.xml"]


def test_looks_dump_and_reload_bit_for_bit():
    done = build_model("--robot", "queen", "--looks")
    assert (done.returncode, done.stderr) == (0, "")
    reloaded = mujoco.MjModel.from_xml_string(done.stdout)
    assert saved(reloaded) == saved(compiled(ROBOTS["queen"], decorated=True))
    assert saved(reloaded) != saved(compiled(ROBOTS["queen"]))


def test_bit_equality_would_notice_one_bit():
    model = compiled(ROBOTS["tick"])
    before = saved(model)
    model.dof_damping[7] = np.nextafter(model.dof_damping[7], 2.0)
    assert saved(model) != before


@pytest.mark.parametrize(
    ("legs", "links", "arguments"), [(6, 3, ["--legs=6", "--links=3"]), (5, 2, ["--legs=5", "--links=2"])]
)
def test_a_body_made_to_order_dumps_and_reloads_bit_for_bit(legs, links, arguments):
    done = build_model(*arguments)
    assert (done.returncode, done.stderr) == (0, "")
    assert saved(mujoco.MjModel.from_xml_string(done.stdout)) == saved(compiled(generator.generate(legs, links)))


def test_three_links_are_the_default():
    assert build_model("--legs=4").stdout == build_model("--legs=4", "--links=3").stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--legs=3"], "flag --legs=3: 3 is not an integer in the range [4, 12]"),
        (["--legs=13"], "flag --legs=13: 13 is not an integer in the range [4, 12]"),
        (["--legs=six"], "flag --legs=six: invalid literal for int() with base 10: 'six'"),
        (["--legs=6", "--links=0"], "flag --links=0: 0 is not an integer in the range [1, 4]"),
        (["--legs=6", "--links=5"], "flag --links=5: 5 is not an integer in the range [1, 4]"),
        (["--robot=quen"], "flag --robot=quen: value should be one of <queen|bastion|tick|leaper>"),
        (["--robot=queen", "--links=2"], "--links=2: goes with --legs, not with --robot"),
        ([], "flags robot=None, legs=None: Exactly one of (robot, legs) must have a value other than None."),
        (
            ["--robot=queen", "--legs=6"],
            "flags robot=queen, legs=6: Exactly one of (robot, legs) must have a value other than None.",
        ),
        (["queen"], "flags robot=None, legs=None: Exactly one of (robot, legs) must have a value other than None."),
    ],
)
def test_bad_arguments_are_one_line(arguments, message):
    done = build_model(*arguments)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"build_model.py: {message}\n")


def test_a_path_that_cannot_be_written_is_one_line_and_leaves_no_file(tmp_path):
    (tmp_path / "file").write_text("kept")
    for path, reason in (
        (tmp_path / "missing" / "a.xml", "no such file or directory"),
        (tmp_path / "file" / "a.xml", "not a directory"),
        (tmp_path, "is a directory"),
    ):
        done = build_model("--robot=tick", "--output", path)
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr == f"build_model.py: cannot write {path}: {reason}\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize("legs", range(4, 13))
@pytest.mark.parametrize("links", range(1, 5))
def test_bodies_made_to_order_stand_on_all_feet(legs, links):
    body = generator.generate(legs, links)
    model = compiled(body)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert body.name == f"walker_{legs}x{links}"
    assert len(body.legs) == legs
    assert model.nu == legs * links
    assert model.nbody - 2 == legs * (links + 1)
    feet = {name: data.body(name).xpos for name in body.foot_names}
    bottoms = [feet[name][2] - model.geom(name).size[0] for name in body.foot_names]
    assert bottoms == pytest.approx([0.0] * legs, abs=1e-12)
    for leg, name in zip(body.legs, body.foot_names, strict=True):
        assert feet[name] - data.body("torso").xpos == pytest.approx(leg.foot_position, abs=1e-12)
    # every foot has its mirror image, and no two feet stand on one spot
    points = np.array(list(feet.values()))
    for mirrored in points * (1.0, -1.0, 1.0):
        assert np.linalg.norm(points - mirrored, axis=1).min() < 1e-12
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1) + np.eye(legs)
    assert apart.min() > 0.1
    # nothing but the feet reaches the floor
    data.qpos[2] -= 1e-6
    mujoco.mj_forward(model, data)
    pairs = [{model.geom(i).name for i in contact.geom} for contact in data.contact if contact.dist < 0.0]
    assert sorted(map(sorted, pairs)) == sorted(sorted(("floor", name)) for name in body.foot_names)


def test_even_counts_stand_in_mirrored_pairs_and_odd_ones_around():
    pairs = generator.generate(8, 3)
    assert [leg.name for leg in pairs.legs] == ["l1", "l2", "l3", "l4", "r1", "r2", "r3", "r4"]
    assert pairs.ranks == (0, 1, 2, 3) * 2
    for left, right in zip(pairs.legs[:4], pairs.legs[4:], strict=True):
        assert left.mirrored(right.name) == right
        assert left.side == "left"
    ring = generator.generate(5, 2)
    assert [leg.name for leg in ring.legs] == ["leg1", "leg2", "leg3", "leg4", "leg5"]
    headings = [math.degrees(math.atan2(leg.foot_position[1], leg.foot_position[0])) for leg in ring.legs]
    assert headings == pytest.approx([0.0, 72.0, 144.0, -144.0, -72.0], abs=1e-9)


@pytest.mark.parametrize(
    ("legs", "links", "message"),
    [
        (3, 3, "legs: expected a whole number from 4 to 12, got 3"),
        (6.0, 3, "legs: expected a whole number from 4 to 12, got 6.0"),
        (True, 3, "legs: expected a whole number from 4 to 12, got True"),
        (6, 0, "links: expected a whole number from 1 to 4, got 0"),
        (6, None, "links: expected a whole number from 1 to 4, got None"),
    ],
)
def test_a_count_out_of_range_is_named(legs, links, message):
    with pytest.raises(SpecError) as error:
        generator.generate(legs, links)
    assert str(error.value) == message
