"""Motions from BVH and from tables of frames."""

import drawn_motions
import imports
import numpy as np
import pytest
from refusals import refused

from arc_suite import motions, registry, rotations
from arc_suite.animation.clips.creatures import glb
from arc_suite.models.standing import compile_body, standing_qpos
from arc_suite.motions import reading, skeletons
from arc_suite.tasks import readings

TICK = registry.body_of("tick")
NEAR = 1e-5


@pytest.fixture(scope="module")
def raised():
    return drawn_motions.raise_leg(TICK, 0)


@pytest.mark.parametrize("axes", ["y up", "z up"])
def test_bvh(axes, raised, tmp_path):
    to_file = skeletons.FROM_Y_UP.T
    if axes == "z up":  # -y ahead, as in Blender
        to_file = np.array(((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    path = tmp_path / "raise.bvh"
    path.write_text(drawn_motions.to_bvh(TICK, raised, to_file))
    motion, notes = reading.read(path, TICK)
    assert (motion.name, motion.frames, motion.loops, notes) == ("raise", raised.frames, False, [])
    np.testing.assert_allclose(motion.angles, raised.angles, atol=NEAR)
    np.testing.assert_allclose(motion.soles, raised.soles, atol=NEAR)


BVH_DAMAGES = {
    "Frames: 41": ("Frames: 1000000000", "Frames: expected an integer from 2 to 65536"),
    "JOINT": ("KNOT", "unknown word 'KNOT'"),
    "Frame Time: 0.050000000": ("Frame Time: nan", "number: expected a finite number, got nan"),
    "MOTION": ("MOVES", "expected HIERARCHY and MOTION"),
    "Zrotation": ("Wrotation", "'W' is missing"),
    "CHANNELS 3": ("CHANNELS 9", "CHANNELS: expected an integer from 0 to 6"),
    "HIERARCHY": ("}", "pop from an empty list|pop from empty list"),
    "torso": ("trunk", "bones: expected those of tick, and there is no torso"),
}


@pytest.mark.parametrize("old", BVH_DAMAGES)
def test_damaged_bvh_is_one_line(old, raised, tmp_path):
    new, message = BVH_DAMAGES[old]
    path = tmp_path / "raise.bvh"
    text = drawn_motions.to_bvh(TICK, raised)
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=message) as error:
        reading.read(path, TICK)
    assert str(error.value).startswith(f"{path}: ") and "\n" not in str(error.value)


def test_a_bone_may_be_called_motion(raised, tmp_path):
    path = tmp_path / "raise.bvh"
    end = TICK.part_names[-1]
    text = drawn_motions.to_bvh(TICK, raised)
    extra = "JOINT {0}\n{{ OFFSET 0 0 0 CHANNELS 0 JOINT {1} {{ OFFSET 0 0 0 CHANNELS 0 }} }}\n"
    for names in (("LOCOMOTION", "MOTION_2"), ("MOTION", "ROOT_MOTION")):
        old = f"JOINT {end}\n"
        assert text.count(old) == 1
        path.write_text(text.replace(old, extra.format(*names) + old))
        motion, notes = reading.read(path, TICK)
        assert notes == []
        np.testing.assert_allclose(motion.angles, raised.angles, atol=NEAR)


# Loops.


def rise(height):
    """A body that stands in a loop while its torso rises, by standing heights, and an end that is open by as much."""
    frames = 41
    level = np.tile((1.0, 0.0, 0.0, 0.0), (frames, 1))
    rising = np.linspace(1.0, 1.0 + height, frames)[:, None] * (0.0, 0.0, TICK.torso.standing_height)
    return motions.make(TICK, "rise", 20.0, False, rising, level, np.zeros((frames, len(TICK.joint_names))))


def write_arrays(path, motion):
    np.savez(
        path,
        fps=motion.frame_rate,
        joint_pos=motion.angles,
        body_pos_w=motion.positions[:, None],
        body_quat_w=motion.quaternions[:, None],
    )


WRITERS = {
    "csv": lambda path, motion: path.write_text(drawn_motions.to_csv(TICK, motion)),
    "bvh": lambda path, motion: path.write_text(drawn_motions.to_bvh(TICK, motion)),
    "glb": lambda path, motion: path.write_bytes(
        glb(TICK, [drawn_motions.clip_of(TICK, motion)], root_motion="moving")
    ),
    "npz": write_arrays,
}


@pytest.mark.parametrize("extension", WRITERS)
def test_a_loop_whose_height_is_open_is_one_line(extension, tmp_path):
    path = tmp_path / f"rise.{extension}"
    options = reading.Options(loop=True, fps=20.0 if extension == "csv" else None)
    WRITERS[extension](path, rise(0.5))
    with pytest.raises(ValueError, match="loops: expected the last frame to be .*, its height by 0.5 standing heights"):
        reading.read(path, TICK, options)
    WRITERS[extension](path, rise(0.02))
    motion, notes = reading.read(path, TICK, options)
    assert notes == ["the loop was open by 0.02 standing heights of the torso, which its end takes up"]
    heights = motion.positions[:, 2] / TICK.torso.standing_height
    np.testing.assert_allclose(heights[[0, -1]], 1.0, atol=NEAR)
    assert heights.max() == pytest.approx(1.015, abs=1e-3)


def test_a_table_says_how_far_its_loop_was_open(tmp_path):
    path = tmp_path / "walk.csv"
    steps = drawn_motions.step_loop(TICK)
    angles = steps.angles + np.linspace(0.0, 0.03, steps.frames)[:, None]
    path.write_text(drawn_motions.to_csv(TICK, steps._replace(angles=angles)))
    motion, notes = reading.read(path, TICK, reading.Options(fps=20.0, loop=True))
    assert notes == ["the loop was open by 1.7 degrees, which its end takes up"]
    np.testing.assert_allclose(motion.angles[-1], motion.angles[0], atol=NEAR)


# Tables.

QUADRUPED = imports.quadruped()


def qpos_of(body, motion):
    """Positions of the robot's own file (frames, nq), and the indices of the body's joints in them."""
    model = compile_body(body)
    layout = readings.layout(model, body)
    poses = np.concatenate([motion.positions, motion.quaternions, motion.angles], axis=-1)
    return readings.positions(poses, layout, standing_qpos(model)), layout.joint_angles


@pytest.fixture(scope="module", params=["at the root", "elsewhere"])
def robot(request, tmp_path_factory):
    """An imported robot, whose trunk may be elsewhere than its root body."""
    if request.param == "at the root":
        return QUADRUPED
    return registry.body_of(str(imports.move_root(tmp_path_factory.mktemp("robot"), "go2_like.xml", (0.1, 0.0, 0.4))))


def assert_same(motion, expected):
    np.testing.assert_allclose(motion.angles, expected.angles, atol=NEAR)
    np.testing.assert_allclose(motion.positions, expected.positions, atol=NEAR)
    np.testing.assert_allclose(motion.soles, expected.soles, atol=NEAR)
    assert motion.frame_rate == pytest.approx(expected.frame_rate)


def test_csv_of_a_robot(robot, tmp_path):
    """The root and the angles are those of its file: home angles are not 0."""
    steps = drawn_motions.step_loop(robot)
    qpos, joints = qpos_of(robot, steps)
    path = tmp_path / "steps.csv"
    names = ["x", "y", "z", "qw", "qx", "qy", "qz", *robot.joint_names]
    own_names = [*names[:7], *[joint.alias for joint in robot.joints]]
    table = np.concatenate([qpos[:, :7], qpos[:, joints]], axis=-1)
    order = np.random.default_rng(1).permutation(len(names))
    lines = [",".join(np.array(names)[order]), *[",".join(map(repr, row[order].tolist())) for row in table]]
    path.write_text("\n".join(lines))
    with pytest.raises(ValueError, match="steps.csv: fps: expected frames a second, as the file does not say them"):
        reading.read(path, robot)
    motion, _ = reading.read(path, robot, reading.Options(fps=20.0, loop=True))
    assert motion.loops and motion.name == "steps"
    assert_same(motion, steps)
    timed = [f"time,{lines[0]}", *[f"{0.05 * index:.3f},{line}" for index, line in enumerate(lines[1:])]]
    path.write_text("\n".join(timed))
    assert_same(reading.read(path, robot)[0], steps)
    # Names of the robot's file.
    path.write_text(path.read_text().replace(",".join(np.array(names)[order]), ",".join(np.array(own_names)[order])))
    assert_same(reading.read(path, robot)[0], steps)
    # Without names: w of the quaternion is last.
    columns = [*range(3), 4, 5, 6, 3, *range(7, len(names))]
    path.write_text("\n".join(",".join(map(repr, row[columns].tolist())) for row in table))
    assert_same(reading.read(path, robot, reading.Options(fps=20.0))[0], steps)


def test_arrays_of_a_robot(robot, tmp_path):
    steps = drawn_motions.step_loop(robot)
    qpos, joints = qpos_of(robot, steps)
    arrays = {
        "fps": np.array([20]),
        "joint_pos": qpos[:, joints],
        "body_pos_w": np.tile(qpos[:, None, :3], (1, 13, 1)),
        "body_quat_w": np.tile(qpos[:, None, 3:7], (1, 13, 1)),
    }
    np.savez(tmp_path / "steps.npz", **arrays)
    assert_same(reading.read(tmp_path / "steps.npz", robot)[0], steps)
    own_names = np.array([joint.alias for joint in robot.joints])
    order = np.random.default_rng(1).permutation(len(own_names))
    mixed = arrays | {"joint_pos": arrays["joint_pos"][:, order], "joint_names": own_names[order]}
    np.savez(tmp_path / "steps.npz", **mixed)
    assert_same(reading.read(tmp_path / "steps.npz", robot)[0], steps)
    np.savez(tmp_path / "steps.npz", **arrays, joint_names=np.array(["a"] * 12))
    with pytest.raises(ValueError, match="columns: expected those of .*, and there is no l1_joint1"):
        reading.read(tmp_path / "steps.npz", robot)


GOOD = ",".join(["x", "y", "z", "qw", "qx", "qy", "qz", *TICK.joint_names])
LINE = ",".join(["0", "0", "0.2", "1", "0", "0", "0", *["0.1"] * len(TICK.joint_names)])
BAD_TABLES = {
    "\n".join([GOOD, LINE, LINE.replace(",0.1", ",nan")]): "expected finite numbers in frame 1",
    "\n".join([GOOD, LINE, LINE[:-4]]): "line 3: expected 25 numbers, got 24",
    "\n".join([GOOD.replace("l1_", "a1_"), LINE, LINE]): "columns: expected those of tick, and there is no l1_",
    "\n".join([f"{GOOD},tail", f"{LINE},0", f"{LINE},0"]): "columns: 'tail' is no joint of tick",
    "\n".join([GOOD, LINE, LINE.replace("1,0,0,0", "0,0,0,0")]): "quaternions: expected finite ones above 0 in frame 1",
    "\n".join([GOOD, LINE, LINE.replace(",0.1", ",hip")]): "could not convert string to float: 'hip'",
    "\n".join([GOOD, LINE]): "frames: expected from 2 to 65536, got 1",
    "": "expected from 2 to 65536 frames, got 0 lines",
    "\n".join(["1"] * 70_000): "expected from 2 to 65536 frames, got 70000 lines",
    "\n".join([",".join("1" * 2000)] * 3): "expected at most 1024 columns, got 2000",
    "\n".join([f"time,{GOOD}", f"1,{LINE}", f"0,{LINE}"]): "time: expected numbers that grow",
}


@pytest.mark.parametrize("index", range(len(BAD_TABLES)))
def test_damaged_table_is_one_line(index, tmp_path):
    text, message = list(BAD_TABLES.items())[index]
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as error:
        reading.read(path, TICK, reading.Options(fps=30.0))
    assert str(error.value).startswith(f"{path}: ") and "\n" not in str(error.value)


def test_signs_of_quaternions_do_not_matter_at_uneven_times(tmp_path):
    """q and -q are one orientation; a line between them passes through 0."""
    times = np.array((0.0, 0.1, 0.25, 0.3, 0.45, 0.5))
    turns = np.linspace(0.0, 0.5, 6)
    table = np.zeros((6, 7))
    table[:, 2] = 0.2
    table[:, 3] = np.cos(turns / 2)
    table[:, 6] = np.sin(turns / 2)
    copies = []
    for signs in (np.ones(6), np.array((1, 1, -1, -1, 1, 1)), -np.ones(6)):
        table[:, 3:] *= signs[:, None]
        rows = np.concatenate([times[:, None], table, np.zeros((6, len(TICK.joint_names)))], axis=-1)
        path = tmp_path / "turn.csv"
        path.write_text("\n".join([f"time,{GOOD}", *[",".join(map(repr, row)) for row in rows.tolist()]]))
        copies.append(reading.read(path, TICK)[0])
    expected = np.interp(np.linspace(0.0, 0.5, 6), times, turns)
    np.testing.assert_allclose(rotations.yaw(copies[0].quaternions), expected, atol=1e-4)
    for copy in copies[1:]:
        np.testing.assert_array_equal(copy.quaternions, copies[0].quaternions)


def test_a_rate_beside_that_of_the_file_is_one_line(raised, tmp_path):
    path = tmp_path / "raise.csv"
    lines = drawn_motions.to_csv(TICK, raised).splitlines()
    path.write_text(
        "\n".join([f"time,{lines[0]}", *[f"{0.05 * frame},{line}" for frame, line in enumerate(lines[1:])]])
    )
    write_arrays(tmp_path / "raise.npz", raised)
    for name in ("raise.csv", "raise.npz"):
        assert reading.read(tmp_path / name, TICK)[0].frame_rate == pytest.approx(20.0)
        with refused(f"{tmp_path / name}: fps: the file says 20 frames a second; leave fps out"):
            reading.read(tmp_path / name, TICK, reading.Options(fps=100.0))


def test_an_option_without_effect_is_one_line(raised, tmp_path):
    motions.save(raised, tmp_path / "raise.npz")
    (tmp_path / "raise.bvh").write_text(drawn_motions.to_bvh(TICK, raised))
    for name, kind, options in (
        ("raise.npz", "a motion", {"loop": True}),
        ("raise.npz", "a motion", {"fps": 30.0}),
        ("raise.bvh", "a .bvh", {"fps": 30.0}),
        ("raise.bvh", "a .bvh", {"clip": "raise"}),
    ):
        (option,) = options
        with refused(f"{tmp_path / name}: {option}: it has no effect on {kind}; leave it out"):
            reading.read(tmp_path / name, TICK, reading.Options(**options))


def test_files_of_other_kinds_and_bodies(raised, tmp_path):
    with pytest.raises(ValueError, match="unknown extension '.fbx'"):
        reading.read(tmp_path / "a.fbx", TICK)
    with pytest.raises(OSError, match="cannot read"):
        reading.read(tmp_path / "a.csv", TICK)
    motions.save(raised, tmp_path / "raise.npz")
    motion, _ = reading.read(tmp_path / "raise.npz")
    assert motion.body == "tick" and not reading.describe_limits(motion, TICK)
    beyond = motion._replace(angles=motion.angles + 2.0)
    assert reading.describe_limits(beyond, TICK)[0].startswith(f"{TICK.joint_names[0]} turns ")
