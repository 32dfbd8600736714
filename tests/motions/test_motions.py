"""Motions as values: made, mirrored, sampled at other rates, saved and read."""

import numpy as np
import pytest
from refusals import refused

from arc_suite import motions, registry, rotations
from arc_suite.models.posture import find_rest_pose
from arc_suite.motions import motion_text

TICK = registry.body_of("tick")
QUEEN = registry.body_of("queen")


def walk(body=TICK, frames=41, rate=60.0, turn=0.0, loops=True):
    """A body whose joints swing once while its torso goes ahead and turns."""
    cycle = np.linspace(0.0, 1.0, frames)
    height = body.torso.standing_height
    shares = np.linspace(0.2, 1.0, len(body.joint_names))
    headings = turn * cycle
    quaternions = np.stack([np.cos(headings / 2), 0 * cycle, 0 * cycle, np.sin(headings / 2)], -1)
    steps = rotations.to_heading_frame(np.tile((0.5 * height / frames, 0.0), (frames - 1, 1)), -headings[:-1])
    ground = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    positions = np.concatenate([ground, np.full((frames, 1), height)], -1)
    angles = 0.1 * np.sin(2 * np.pi * cycle)[:, None] * shares
    return motions.make(body, "walk", rate, loops, positions, quaternions, angles)


def test_make_puts_the_start_above_the_origin():
    motion = walk()
    moved = motions.make(
        TICK, "walk", 60.0, True, motion.positions + (3.0, -2.0, 0.0), -motion.quaternions, motion.angles
    )
    for before, after in zip(motion, moved, strict=True):
        assert np.all(before == after) or np.allclose(before, after, atol=1e-12)
    turned = motions.make(
        TICK,
        "walk",
        60.0,
        True,
        np.concatenate([rotations.to_heading_frame(motion.positions[:, :2], -1.0), motion.positions[:, 2:]], -1),
        rotations.turn_about_z(motion.quaternions, np.full(motion.frames, 1.0)),
        motion.angles,
    )
    np.testing.assert_allclose(turned.positions, motion.positions, atol=1e-12)
    np.testing.assert_allclose(turned.soles, motion.soles, atol=1e-12)


def test_soles_at_rest_are_on_the_ground():
    rest = find_rest_pose(TICK)
    height = TICK.torso.standing_height
    angles = np.tile(rest.legs.by_joint(rest.joint_angles), (2, 1))
    place = (0.0, 0.0, rest.ride_height * height)
    motion = motions.make(TICK, "stand", 60.0, True, [place] * 2, [(1, 0, 0, 0)] * 2, angles)
    np.testing.assert_allclose(motion.soles[0], motion.rest_soles, atol=1e-4)
    np.testing.assert_allclose(motion.rest_soles[:, 2], 0.0, atol=1e-3)
    assert motion.rest_height == pytest.approx(rest.ride_height, abs=1e-3)
    assert motion.planted.all()


def test_soles_of_a_tilted_torso_agree_with_the_simulation():
    import mujoco

    from arc_suite.models.standing import compile_body

    angles = 0.1 * np.random.default_rng(1).normal(size=(2, len(TICK.joint_names)))
    quaternion = np.array((1.0, 0.1, 0.2, 0.0))
    motion = motions.make(TICK, "tilt", 60.0, False, [(0, 0, 0.3)] * 2, [quaternion] * 2, angles)
    model = compile_body(TICK)
    data = mujoco.MjData(model)
    data.qpos[:] = [*motion.positions[0], *motion.quaternions[0], *motion.angles[0]]
    mujoco.mj_kinematics(model, data)
    centers = np.array([data.body(name).xpos for name in TICK.foot_names])
    soles = centers - [(0.0, 0.0, leg.foot.radius) for leg in TICK.legs]
    np.testing.assert_allclose(motion.soles[0] * motion.standing_height, soles, atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_loop_goes_on_over_the_ground(turn):
    motion = walk(turn=turn)
    last = motion.frames - 1
    np.testing.assert_allclose(motion.displacement[2], turn, atol=1e-12)
    longer = motions.repeat(motion, -last, 3 * last + 1)
    np.testing.assert_allclose(longer.positions[last : 2 * last + 1], motion.positions, atol=1e-12)
    steps = np.linalg.norm(np.diff(longer.positions, axis=0), axis=-1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-9)
    np.testing.assert_allclose(np.diff(np.unwrap(rotations.yaw(longer.quaternions))), turn / last, atol=1e-12)
    ahead = motions.make(TICK, "walk", 60.0, False, longer.positions, longer.quaternions, longer.angles)
    start = longer._replace(loops=False)
    distances = np.linalg.norm(start.soles - start.positions[:, None] / start.standing_height, axis=-1)
    np.testing.assert_allclose(
        distances, np.linalg.norm(ahead.soles - ahead.positions[:, None] / ahead.standing_height, axis=-1), atol=1e-9
    )


def test_resampled_sine():
    motion = walk()
    other = motions.resample(motion, 97.0)
    assert other.frames == round(motion.seconds * 97.0) + 1
    cycle = np.linspace(0.0, 1.0, other.frames)
    np.testing.assert_allclose(other.angles[:, -1], 0.1 * np.sin(2 * np.pi * cycle), atol=2e-5)
    np.testing.assert_allclose(other.positions[-1], motion.positions[-1], atol=1e-12)
    np.testing.assert_allclose(motions.resample(motion, 60.0).angles, motion.angles, atol=1e-15)


def turn_over(axis, cycles=1):
    """A loop whose torso turns over once, about its axis, ahead (0) or to the left (1)."""
    turns = 2.0 * np.pi * np.linspace(0.0, cycles, 60 * cycles + 1)
    quaternions = np.zeros((len(turns), 4))
    quaternions[:, 0] = np.cos(turns / 2)
    quaternions[:, 1 + axis] = np.sin(turns / 2)
    positions = np.tile((0.0, 0.0, 1.0), (len(turns), 1))
    return motions.make(TICK, "roll", 60.0, True, positions, quaternions, np.zeros((len(turns), len(TICK.joint_names))))


@pytest.mark.parametrize("axis", [0, 1])
def test_a_loop_that_turns_over_goes_on(axis):
    motion = turn_over(axis)
    longer = motions.repeat(motion, -60, 181)
    assert (longer.quaternions[1:] * longer.quaternions[:-1]).sum(axis=-1).min() > 0.99
    np.testing.assert_array_equal(longer.quaternions[60:120], motion.quaternions[:-1])
    np.testing.assert_allclose(longer.quaternions[60:181], turn_over(axis, 2).quaternions, atol=1e-12)
    for rate in (120.0, 50.0):
        copy = motions.resample(motion, rate)
        halves = np.pi * np.linspace(0.0, 1.0, copy.frames)
        expected = np.zeros((copy.frames, 4))
        expected[:, 0] = np.cos(halves)
        expected[:, 1 + axis] = np.sin(halves)
        cosines = abs((copy.quaternions * expected).sum(axis=-1)).clip(0.0, 1.0)
        assert np.degrees(2.0 * np.arccos(cosines)).max() < 0.01


@pytest.mark.parametrize("lean", [0.0, 0.02, -0.02])
@pytest.mark.parametrize("turn", [0.0, 1.0, -5.0])
def test_a_somersault_is_no_turn(lean, turn):
    """Where the forward axis passes the vertical, yaw jumps by half a turn, to either side."""
    somersault = turn_over(1)
    share = np.linspace(0.0, 1.0, somersault.frames)
    leaning = rotations.product(np.array((np.cos(lean / 2), np.sin(lean / 2), 0.0, 0.0)), somersault.quaternions)
    turning = rotations.turn_about_z(leaning, turn * share)
    motion = motions.make(TICK, "flip", 60.0, True, somersault.positions, turning, somersault.angles)
    np.testing.assert_allclose(motion.displacement, (0.0, 0.0, turn), atol=1e-9)


def test_no_frames_and_no_rate_are_one_line():
    for stop in (0, -1):
        for loops in (True, False):
            with refused(f"stop: expected an integer from 1, got {stop}"):
                motions.repeat(walk(loops=loops), 0, stop)
    for rate in (0.0, -5.0):
        with refused(f"rate: expected a finite number above 0, got {rate}"):
            motions.resample(walk(), rate)


def test_velocities():
    motion = walk(turn=0.7)
    speeds = motions.velocities(motion)
    cycle = np.linspace(0.0, 1.0, motion.frames)
    expected = 0.1 * 2 * np.pi * np.cos(2 * np.pi * cycle) / motion.seconds
    np.testing.assert_allclose(speeds.joints[:, -1], expected, rtol=0.01, atol=1e-3)
    np.testing.assert_allclose(speeds.angular, np.tile((0.0, 0.0, 0.7 / motion.seconds), (motion.frames, 1)), atol=1e-9)
    np.testing.assert_allclose(speeds.linear[0], speeds.linear[0] * (1, 1, 0), atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(speeds.linear, axis=-1), np.linalg.norm(motion.positions[1, :2]) * 60.0, rtol=1e-3
    )


LEVEL = np.tile((1.0, 0.0, 0.0, 0.0), (3, 1))
NOT_OF_THE_BODY = {
    "few joints": ({"angles": np.zeros((3, 17))}, "angles: expected numbers of shape (3, 18), got (3, 17)"),
    "many joints": ({"angles": np.zeros((3, 19))}, "angles: expected numbers of shape (3, 18), got (3, 19)"),
    "other frames": ({"angles": np.zeros((2, 18))}, "angles: expected numbers of shape (3, 18), got (2, 18)"),
    "on the ground": ({"positions": np.zeros((3, 2))}, "positions: expected numbers of shape (3, 3), got (3, 2)"),
    "a list": ({"positions": np.zeros(3)}, "positions: expected numbers of shape (3, 3), got (3,)"),
    "a number": ({"positions": 0.0}, "positions: expected numbers of shape (3,), got ()"),
    "fewer turns": ({"quaternions": LEVEL[:1]}, "quaternions: expected numbers of shape (3, 4), got (1, 4)"),
    "no frames": (
        {"positions": np.zeros((0, 3)), "quaternions": LEVEL[:0], "angles": np.zeros((0, 18))},
        "frames: expected from 2 to 65536, got 0",
    ),
    "no name": ({"name": ""}, "name: expected printable names of 1 to 200 characters, got ''"),
    "lines": ({"name": "a\nb"}, r"name: expected printable names of 1 to 200 characters, got 'a\nb'"),
    "no text": ({"name": 3}, "name: expected printable names of 1 to 200 characters, got 3"),
    "loops of a count": ({"loops": 1}, "loops: expected true or false, got 1"),
}


@pytest.mark.parametrize("kind", NOT_OF_THE_BODY)
def test_make_refuses_what_is_no_motion_of_the_body(kind):
    change, line = NOT_OF_THE_BODY[kind]
    fields = {"name": "stand", "frame_rate": 60.0, "loops": False}
    fields |= {"positions": np.zeros((3, 3)), "quaternions": LEVEL, "angles": np.zeros((3, 18))}
    with refused(line):
        motions.make(TICK, **fields | change)


def test_a_name_has_at_most_200_characters(tmp_path):
    motions.save(walk()._replace(name="x" * 200), tmp_path / "walk.npz")
    assert motions.load(tmp_path / "walk.npz").name == "x" * 200
    with refused("name: expected printable names of 1 to 200 characters, got 'xxx", begins=True):
        motions.save(walk()._replace(name="x" * 201), tmp_path / "long.npz")


@pytest.mark.parametrize("change", [{"name": ""}, {"loops": 1}, {"angles": np.zeros((41, 3))}])
def test_what_no_file_may_hold_is_not_written(change, tmp_path):
    motion = walk()._replace(**change)
    for write in (lambda: motions.save(motion, tmp_path / "walk.npz"), lambda: motion_text.to_text(motion)):
        with pytest.raises(ValueError, match=f"^{next(iter(change))}: expected "):
            write()
    assert not list(tmp_path.iterdir())


def test_numbers_of_numpy_are_as_good_as_those_of_python():
    motion = walk()
    text = motion_text.to_text(motion)
    height, rate = np.float64(motion.standing_height), np.float32(motion.frame_rate)
    fields = {"loops": np.bool_(True), "standing_height": height, "frame_rate": rate}
    assert motion_text.to_text(motion._replace(**fields)) == text
    made = motions.make(TICK, "walk", np.int64(60), np.bool_(True), motion.positions, motion.quaternions, motion.angles)
    assert made.loops is True and motion_text.to_text(made) == text


def test_a_motion_of_a_text_cannot_be_changed():
    text = motion_text.to_text(walk())
    motion = motion_text.from_text(text)
    for name in ("positions", "quaternions", "angles", "planted", "soles", "rest_soles"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(motion, name)[0] = 0
    assert motions.digest(motion_text.from_text(text)) == motions.digest(walk())


def test_mirror_is_its_own_inverse_and_mirrors_soles():
    motion = walk(turn=0.3)
    image = motions.mirror(motion, TICK)
    again = motions.make(TICK, "walk", 60.0, True, image.positions, image.quaternions, image.angles)
    np.testing.assert_allclose(image.soles, again.soles, atol=1e-9)
    for before, after in zip(motion, motions.mirror(image, TICK), strict=True):
        assert np.array_equal(before, after)
    assert image.displacement[2] == pytest.approx(-0.3)


def test_saved_motion_is_bit_equal(tmp_path):
    motion = walk()
    motions.save(motion, tmp_path / "walk.npz")
    loaded = motions.load(tmp_path / "walk.npz")
    for before, after in zip(motion, loaded, strict=True):
        assert np.array_equal(before, after)
    assert motions.digest(loaded) == motions.digest(motion)
    assert motions.digest(motion._replace(loops=False)) != motions.digest(motion)
    assert motions.digest(motion._replace(angles=motion.angles + 1e-12)) != motions.digest(motion)


def test_digest_is_stable():
    """The same on every machine and in every version."""
    zeros = np.zeros((2, 2))
    motion = motions.Motion(
        "stand",
        "tick",
        0.5,
        ("hip", "knee"),
        ("left", "right"),
        60.0,
        True,
        zeros[:, :1] + (0.0, 0.0, 0.5),
        zeros[:, :1] + (1.0, 0.0, 0.0, 0.0),
        zeros,
        zeros == 0,
        np.zeros((2, 2, 3)),
        np.zeros((2, 3)),
        1.0,
    )
    assert motions.digest(motion)[:16] == "cf4cbc6194c99254"


def test_motion_of_another_body_is_one_line():
    with pytest.raises(
        ValueError, match="motion 'walk' is of 'tick': expected a standing height of 0.75 m, got 0.18 m;"
    ):
        motions.check_body(walk(), QUEEN)
    with pytest.raises(
        ValueError, match="expected 12 joints, got 18; `arc-suite motion FILE --robot leaper -o OUT.npz`"
    ):
        motions.check_body(walk(), registry.body_of("leaper"))
    with pytest.raises(ValueError, match="expected joint l1_hip, got tail; `arc-suite motion"):
        motions.check_body(walk()._replace(joint_names=("tail", *TICK.joint_names[1:])), TICK)


def change(**fields):
    return lambda arrays: arrays | fields


HOSTILE = {
    "NaN": (
        lambda a: a | {"angles": np.where(np.arange(len(a["angles"]))[:, None] == 7, np.nan, a["angles"])},
        "angles: expected finite numbers in frame 7",
    ),
    "infinity": (change(positions=np.full((41, 3), np.inf)), "positions: expected finite numbers in frame 0"),
    "a far place": (change(positions=np.full((41, 3), 1e300)), "positions: expected numbers up to 100000, got 1e.300"),
    "other joints": (change(joint_names=np.array(["a", "b"])), r"angles: expected numbers of shape \(41, 2\)"),
    "names twice": (change(leg_names=np.array(["a"] * 6)), "leg_names: expected each name once"),
    "names of control characters": (change(body=np.array("a\x1b[2J")), "body: expected printable names"),
    "no rate": (change(frame_rate=np.array(0.0)), "frame_rate: expected a number from 1 to 1000, got 0.0"),
    "no numbers": (change(angles=np.array("a")), "angles: expected numbers, got <U1"),
    "quaternions of length 2": (change(quaternions=np.full((41, 4), 1.0)), "quaternions: expected unit quaternions"),
    "an open loop": (
        lambda a: a | {"angles": a["angles"] + np.linspace(0, 1, 41)[:, None]},
        "loops: expected the last frame to be the first one: joints differ by 1 rad",
    ),
    "one frame": (change(positions=np.zeros((1, 3))), "frames: expected from 2 to 65536, got 1"),
    "another format": (change(format=np.array("arc_suite motion 9")), "expected 'arc_suite motion 1', got"),
    "nothing": (lambda a: {}, "expected 'arc_suite motion 1', got 'no motion'"),
    "a pickle": (change(body=np.array([{}], object)), "expected numbers or texts, got a pickle"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_file_is_one_line(kind, tmp_path):
    damage, message = HOSTILE[kind]
    path = tmp_path / "walk.npz"
    motions.save(walk(), path)
    arrays = damage(dict(np.load(path)))
    np.savez(path, allow_pickle=True, **arrays)
    with pytest.raises(ValueError, match=message) as error:
        motions.load(path)
    assert str(error.value).startswith(f"{path}: ") and "\n" not in str(error.value)


def test_billion_frames_are_refused_before_memory_is_taken(tmp_path):
    """A header may claim any shape."""
    import io
    import zipfile

    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**9, 3)})
    with zipfile.ZipFile(tmp_path / "walk.npz", "w") as archive:
        archive.writestr("positions.npy", header.getvalue() + bytes(24))
    with pytest.raises(ValueError, match="its header claims float64 of shape"):
        motions.load(tmp_path / "walk.npz")


def test_missing_file_and_extension(tmp_path):
    with pytest.raises(OSError, match="cannot read .*: no such file"):
        motions.load(tmp_path / "walk.npz")
    with pytest.raises(ValueError, match="unknown extension '.txt'"):
        motions.save(walk(), tmp_path / "walk.txt")
