"""Mimic: the start in a motion, its cycles, its mirror image, its errors, and settings that hold motions."""

import numpy as np
import pytest
from episodes import flat
from numpy.testing import assert_allclose
from refusals import refused

import arc_suite
from arc_suite import motions, rotations
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.models.kinematics import Legs
from arc_suite.motions import motion_text
from arc_suite.motions.motion import find_soles
from arc_suite.robots import ROBOTS

TICK = ROBOTS["tick"]
STILL = {"base_noise": 0.0, "joint_noise": 0.0}
RATE = 30.0  # Hz


def nod(name="nod", turn=0.0, body=TICK):
    """Return a motion of a second: two joints bend and the torso sinks and turns; it ends with its first pose."""
    times = np.linspace(0.0, 1.0, 31)
    bend = np.sin(np.pi * times) ** 2
    angles = np.zeros((31, len(body.joint_names)))
    angles[:, 1] = 0.4 * bend
    angles[:, 4] = -0.3 * bend
    height = body.torso.standing_height
    positions = np.stack([0.0 * times, 0.0 * times, height * (1.0 - 0.1 * bend)], axis=-1)
    quaternions = rotations.turn_about_z(np.tile((1.0, 0.0, 0.0, 0.0), (31, 1)), turn * times)
    return motions.make(body, name, RATE, False, positions, quaternions, angles)


def opened(motion="walk", **settings):
    """Return an environment at its first time step, and that time step."""
    words = motion if isinstance(motion, str) else [motion_text.to_text(item) for item in motion]
    environment = arc_suite.load("tick", "mimic", {"random": 3, "motion": words, **STILL, **settings})
    return environment, environment.reset()


def memory_of(environment):
    """Return the memory of the task, without that of its modifiers."""
    return environment.task.memory.task


@pytest.mark.parametrize("motion", ["walk", [nod()]])
def test_a_body_starts_in_its_motion_and_moves_as_it_does(motion):
    environment, _ = opened(motion)
    errors = memory_of(environment).errors
    assert_allclose([errors.pose, errors.speed, errors.angles, errors.distance, errors.attitude], 0.0, atol=1e-9)
    assert errors.feet < 1e-3  # feet are measured a substep before


def test_speeds_are_those_between_control_steps():
    """A motion that stops within a frame starts no body at a speed that motors cannot stop in a control step."""
    motion = nod()
    angles = motion.angles.copy()
    angles[:, 1] = np.linspace(0.0, 3.0, 31).clip(0.0, 1.5)  # rad: 3 rad/s, then rest
    environment, _ = opened([motion._replace(angles=angles)])
    tables = environment.task.definition.unwrapped.tables
    corner = int(np.argmax(tables.angles[:, 1] > 1.5 - 1e-9))
    assert tables.velocities[corner, 7] == pytest.approx(1.5, abs=0.05)


def test_a_cycle_begins_at_the_place_of_the_body():
    environment, _ = opened()
    count = int(environment.task.definition.unwrapped.tables.counts[0])
    act = Demonstrator(environment)
    timestep = environment.reset()
    origins = []
    for _ in range(2 * count):
        before = memory_of(environment)
        timestep = environment.step(act(timestep))
        after = memory_of(environment)
        if after.tick == 0:
            assert before.tick == count - 1
            place = [*environment.physics.data.qpos[:2], rotations.yaw(environment.physics.data.qpos[3:7])]
            assert_allclose(after.origin, place, atol=1e-12)
            origins.append(after.origin)
        else:
            assert (after.origin == before.origin).all()
    assert len(origins) == 2
    assert origins[1][0] - origins[0][0] > 0.1  # m: it walks


def test_a_motion_that_does_not_loop_returns_to_its_first_pose_and_goes_on_where_it_ended():
    environment, _ = opened([nod(turn=0.5)])
    tables = environment.task.definition.unwrapped.tables
    count = int(tables.counts[0])
    seconds = count * environment.task.definition.scene.control_timestep
    assert abs(seconds - 1.5) < 0.03
    assert_allclose(tables.angles[count], tables.angles[0], atol=1e-12)
    assert_allclose(tables.places[count], [0.0, 0.0, 0.5], atol=1e-9)
    half = int(round(count / 3.0))
    assert abs(tables.angles[half, 1] - 0.4) < 0.02


def test_the_mirror_image_of_a_state_follows_the_mirror_image_of_its_motion():
    environment, _ = opened([nod(turn=0.5)])
    task = environment.task.definition.unwrapped
    tables = task.tables
    observations = []
    for side in (0, 1):
        memory = memory_of(environment)._replace(tick=7, side=side)
        index = 7 + side * tables.mirror_offset
        data = environment.physics.data
        data.qpos[:3] = [*tables.places[index, :2], tables.heights[index]]
        data.qpos[3:7] = tables.quaternions[index]
        data.qpos[7:] = tables.angles[index]
        data.qvel[:] = tables.velocities[index]
        environment.physics.forward()
        observations.append(np.concatenate(list(task.observe(memory, task.read(data)).values())))
    image = task.symmetry.observation(observations[0])
    assert_allclose(image, observations[1], atol=1e-6)
    assert np.abs(observations[0] - observations[1]).max() > 0.1


def test_an_episode_follows_one_of_several_motions_and_says_which():
    names = set()
    environment, _ = opened([nod("one"), nod("two", turn=0.5)])
    for _ in range(8):
        timestep = environment.reset()
        shown = timestep.observation["motion"][3:]
        assert shown.sum() == 1.0
        assert shown.argmax() == memory_of(environment).motion
        names.add(int(shown.argmax()))
    assert names == {0, 1}


@pytest.mark.parametrize("motion", ["walk", [nod()]])
def test_tracked_follows_within_the_motors_reach(motion):
    environment, timestep = opened(motion)
    act = Demonstrator(environment)
    for _ in range(60):
        timestep = environment.step(act(timestep))
    assert not timestep.last()
    assert environment.task.progress["joint_error"] < 0.05


@pytest.mark.parametrize(("robot", "largest_error"), [("tick", 0.015), ("queen", 0.015)])
def test_a_body_at_rest_is_as_high_as_a_motion_at_rest(robot, largest_error):
    """Feet in contact are higher than the ground by the margin of contacts: 0.055 standing heights of Tick."""
    body = ROBOTS[robot]
    frames = 31
    quaternions = np.tile((1.0, 0.0, 0.0, 0.0), (frames, 1))
    angles = np.zeros((frames, len(body.joint_names)))
    soles = find_soles(Legs.of(body), np.zeros((frames, 3)), quaternions, angles)
    positions = np.tile((0.0, 0.0, -soles[0, :, 2].max()), (frames, 1))
    rest = motions.make(body, "rest", RATE, True, positions, quaternions, angles)
    settings = {"random": 3, "motion": [motion_text.to_text(rest)], **STILL}
    environment = arc_suite.load(robot, "mimic", settings)
    environment.reset()
    tables = environment.task.definition.unwrapped.tables
    for _ in range(60):
        environment.step(np.zeros(angles.shape[1]))
    miss = environment.physics.data.qpos[2] - tables.heights[0]
    assert abs(miss) < largest_error * body.torso.standing_height
    assert tables.planted.all()


def test_an_action_of_zero_holds_the_next_pose():
    errors = {}
    for actions in ("position", "torque"):
        environment, _ = opened([nod()], actions=actions)
        task = environment.task.definition.unwrapped
        for _ in range(8):
            center = task.position_center(memory_of(environment))
            environment.step(np.zeros(18))
        errors[actions] = np.abs(environment.physics.data.qpos[7:] - center)[[1, 4]].max()
    assert errors["position"] < 0.03
    assert errors["torque"] > 0.3


def test_both_sides_are_drawn():
    environment, _ = opened([nod(turn=0.5)], both_sides=True)
    assert {float(environment.reset().observation["motion"][2]) for _ in range(8)} == {-1.0, 1.0}


def test_far_from_its_motion_an_episode_ends():
    environment, timestep = opened(actions="torque")
    for _ in range(200):
        if timestep.last():
            break
        timestep = environment.step(np.zeros(18))
    assert timestep.last() and timestep.discount == 0.0
    assert environment.task.progress["fell"]


@pytest.mark.parametrize("name", ["nod.npz", "NOD.NPZ"])
def test_settings_hold_the_motion_of_a_file(name, tmp_path):
    path = tmp_path / name
    motions.save(nod(), path)
    setup = Setup.of("tick", "mimic", {"motion": str(path)})
    assert Setup.of("tick", "mimic", {"motion": path}) == setup
    (motion,) = arc_suite.load("tick", "mimic", {"motion": path}).task.definition.settings.motions
    assert motion_text.to_text(motion) == motion_text.to_text(nod())
    path.unlink()
    assert str(setup) == 'tick, mimic, {"motion": "nod"}'
    again = Setup.from_dict(setup.to_dict())
    assert again == setup
    first = setup.load(seed=1).reset()
    np.testing.assert_array_equal(flat(first), flat(again.load(seed=1).reset()))
    with refused("motion '/tmp/other.npz': what is stored cannot name a file"):
        Setup.from_dict({**setup.to_dict(), "task_kwargs": {"motion": "/tmp/other.npz"}})


def test_motions_that_do_not_fit_are_refused_in_one_line(tmp_path):
    text = motion_text.to_text(nod())
    with refused("motion 'nod' is of 'tick': expected 12 joints, got 18", begins=True):
        arc_suite.load("leaper", "mimic", {"motion": text})
    with refused("motion 'nod' is of 'tick': expected a standing height of 0.75 m, got 0.18 m", begins=True):
        arc_suite.load("queen", "mimic", {"motion": text})
    for motion, message in (
        ([], "motion: expected a motion, or a list of up to 64, got []"),
        ([3], "motion: expected the path of a file .npz or a motion as text, got 3"),
        ([["a.npz"]], "motion: expected the path of a file .npz or a motion as text, got ['a.npz']"),
        ("trot", "motion: expected the path of a file .npz or a motion as text, got 'trot'"),
        (None, "motion: expected a motion, or a list of up to 64, got None"),
        ("{", "motion: expected a name, a file or a motion as text: "),
        (text.replace('"frames": 31', '"frames": 1000000000'), "motion: expected a name, a file or a motion as text: "),
        (text.replace('"frames": 31', '"frames": 30'), "motion: expected a name, a file or a motion as text: "),
        (text.replace('"loops": false', '"loops": NaN'), "motion: expected a name, a file or a motion as text: "),
        (text.replace('"standing_height"', '"height"'), "motion: expected a name, a file or a motion as text: "),
        (text.replace("tick", "tick\\n"), "motion: expected a name, a file or a motion as text: "),
    ):
        with refused(message, begins=True):
            arc_suite.load("tick", "mimic", {"motion": motion})
    with refused(f"cannot read {tmp_path / 'none.npz'}: no such file or directory", OSError):
        arc_suite.load("tick", "mimic", {"motion": str(tmp_path / "none.npz")})


def test_a_text_is_the_motion_to_the_bit():
    motion = nod(turn=0.5)
    again = motion_text.from_text(motion_text.to_text(motion))
    assert motions.digest(again) == motions.digest(motion)


def test_pictures_show_the_motions_pose_beside_the_body():
    environment, _ = opened([nod()])
    torso, *links = environment.task.markers(environment.physics)
    assert len(links) == sum(len(leg.links) for leg in TICK.legs)
    position = environment.physics.data.qpos[:3]
    assert 0.5 * (torso.start + torso.end)[1] - position[1] > TICK.torso.standing_height
    ends = {tuple(np.round(link.end - torso.start, 6)) for link in links}
    feet = environment.physics.named.data.xpos[list(TICK.foot_names)] - position
    for foot in feet:
        distances = [np.linalg.norm(np.array(end)[:2] - foot[:2]) for end in ends]
        assert min(distances) < 0.02 * TICK.torso.standing_height
