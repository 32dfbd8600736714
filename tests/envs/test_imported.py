"""Imported bodies are opened, stepped, disturbed, stored and mirrored as any body is."""

import copy
import json
import pickle

import imports
import mujoco
import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite.bodies import BodiesEnv, shaping
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import suited_presets
from arc_suite.envs.gym import Env
from arc_suite.envs.prepare import prepare_task, symmetry
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.models import source
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import SpecError
from arc_suite.tasks import TASKS

QUADRUPED, HEXAPOD = imports.quadruped(), imports.hexapod()
BODIES = {"quadruped": QUADRUPED, "hexapod": HEXAPOD}


@pytest.fixture(params=BODIES.values(), ids=BODIES)
def body(request):
    return request.param


def environment(body, task="walk", **settings):
    opened = arc_suite.load(body, task, {"random": 0, **settings})
    opened.reset()
    return opened


def walked(body, preset, task, command=None, seconds=8.0, **settings):
    """The shares of the target speed ahead and aside, and whether the body fell."""
    opened = arc_suite.load(body, task, {"random": 0, "time_limit": seconds, **settings})
    demonstrator, step, data = Demonstrator(opened, preset), opened.reset(), opened.physics.data
    if command is not None:
        opened.command("command", command)
    start = data.qpos[:2].copy()
    while not step.last():
        step = opened.step(demonstrator(step))
    definition = opened.task.definition
    target = definition.target_velocity or definition.context.units[0]
    return (data.qpos[:2] - start) / (seconds * target), step.discount == 0.0


def test_medium_walks_at_the_target_speed(body):
    (ahead, aside), fell = walked(body, "medium", "walk")
    assert not fell
    assert 0.8 < ahead < 1.25
    assert abs(aside) < 0.3


def test_steered_follows_a_command(body):
    (ahead, _), fell = walked(body, "steered", "steer", (0.0, 0.0, 0.0), 2.0)
    assert not fell
    assert abs(ahead) < 0.1
    for preset in ("steered", "reactive", "surefooted"):
        opened = arc_suite.load(body, "steer", {"random": 0, "time_limit": 6.0})
        demonstrator, step = Demonstrator(opened, preset), opened.reset()
        opened.command("command", (0.0, 0.0, 1.0))
        while not step.last():
            step = opened.step(demonstrator(step))
        motion = opened.task.memory.core.motion
        assert step.discount != 0.0
        assert motion[2] == pytest.approx(1.0, abs=0.4)


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
def test_every_task_opens_and_steps(body, task):
    settings = {"difficulty": 0.33} if task in ("rough", "slopes", "stairs", "gaps", "course") else {}
    opened = environment(body, task, time_limit=0.6, **settings)
    definition = opened.task.definition
    preset = "steered" if "command" in definition.blocks else (suited_presets(definition) or [None])[0]
    act = Demonstrator(opened, preset) if preset else lambda _: np.zeros(len(body.joint_names))
    step = opened.reset()
    while not step.last():
        step = opened.step(act(step))
    assert np.isfinite(step.reward)


def test_angles_are_those_from_the_standing_pose(body):
    opened = environment(body, joint_angle_noise=0.0)
    blocks = opened.task.definition.copy_blocks(opened.task.get_observation(opened.physics))
    np.testing.assert_allclose(blocks["posture"][5:], 0.0, atol=1e-12)
    home = source.angles_at_home(body)
    found = [opened.physics.model.ptr.joint(name).qposadr[0] for name in body.joint_names]
    np.testing.assert_allclose(opened.physics.data.qpos[found], [home[name] for name in body.joint_names], atol=1e-12)


def test_an_action_of_0_stands_and_of_1_is_the_farther_limit(body):
    opened = environment(body)
    for _ in range(50):
        opened.step(np.zeros(len(body.joint_names)))
    assert opened.physics.data.qpos[2] == pytest.approx(body.torso.standing_height, rel=0.05)
    model, data = opened.physics.model.ptr, mujoco.MjData(opened.physics.model.ptr)
    joint = body.legs[0].joints[-1]
    data.qpos[:] = opened.task.definition.scene.standing
    index = body.joint_names.index(body.legs[0].full_name(joint))
    data.ctrl[index] = 0.1
    mujoco.mj_forward(model, data)
    reach = max(map(abs, np.radians(joint.range_deg)))
    force = joint.servo.stiffness * 0.1 * reach
    if joint.servo.drag is not None:  # torques that fall with speed are at most the stall torque
        force = min(force, joint.servo.stall_torque)
    assert data.actuator_force[index] == pytest.approx(force, rel=1e-6)


DISTURBED = {"kicks": 1.0, "motor_strength": (0.5, 1.0), "actuator_failure": True, "payload": (0.1, 0.4)}
DISTURBED |= {"center_of_mass": 0.1, "joint_offset": 0.05, "joint_strength": (0.5, 1.0), "gains": (0.8, 1.2)}
DISTURBED |= {"armature": (0.8, 1.5), "force": 0.3}


@pytest.mark.parametrize("settings", [{}, DISTURBED])
def test_a_vector_is_as_many_environments(body, settings):
    vector = VectorEnv(body, "walk", 3, 2, task_kwargs=settings)
    singles = [Env(body, "walk", settings) for _ in range(3)]
    observations, _ = vector.reset(seed=5)
    for index, single in enumerate(singles):
        np.testing.assert_array_equal(observations[index], single.reset(seed=5 + index)[0])
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (20, *vector.action_space.shape)).astype(np.float32)
    stored = None
    for count, action in enumerate(actions):
        observations, rewards, *_ = vector.step(action)
        for index, single in enumerate(singles):
            observation, reward, *_ = single.step(action[index])
            np.testing.assert_array_equal(observations[index], observation)
            assert rewards[index] == reward
        if count == 9:
            stored = vector.snapshot(), observations, pickle.loads(pickle.dumps(vector)), copy.deepcopy(singles[0])
    snapshot, _, pickled, single = stored
    vector.restore(snapshot)
    for action in actions[10:]:
        again, *_ = vector.step(action)
        np.testing.assert_array_equal(again, pickled.step(action)[0])
        np.testing.assert_array_equal(again[0], single.step(action[0])[0])


def test_different_bodies_share_environments_with_imported_ones():
    mixed = BodiesEnv("steer", 4, [QUADRUPED, "queen", HEXAPOD, QUADRUPED])
    mixed.reset(seed=0)
    alone = VectorEnv(QUADRUPED, "steer", 1)
    alone.reset(seed=3)
    actions = np.random.default_rng(1).uniform(-0.2, 0.2, (10, 4, 12, 4)).astype(np.float32)
    for action in actions:
        mixed.step(action)
        alone.step(action[3:, : len(QUADRUPED.legs), :3].reshape(1, -1))
    np.testing.assert_array_equal(mixed.own_observations()[3], alone._observation[0])


def torques(opened):
    scene = opened.task.definition.scene
    return opened.physics.data.qfrc_actuator[scene.layout.joint_velocities].copy()


def test_weak_servos_give_their_share():
    strong, weak = environment(QUADRUPED), environment(QUADRUPED, motor_strength=0.5)
    for opened in (strong, weak):
        physics = opened.physics
        opened.step(np.zeros(12))
        physics.data.qpos[:] = strong.task.definition.scene.standing
        physics.data.qpos[7:] += 0.05
        physics.data.qvel[:] = 0.1
        mujoco.mj_forward(physics.model.ptr, physics.data.ptr)
    np.testing.assert_allclose(torques(weak), 0.5 * torques(strong), rtol=1e-9)
    for opened in (strong, weak):
        opened.physics.data.qpos[7:] += 2.0
        mujoco.mj_forward(opened.physics.model.ptr, opened.physics.data.ptr)
    limits = strong.task.definition.scene.layout.limits
    np.testing.assert_allclose(abs(torques(strong)), limits)
    np.testing.assert_allclose(abs(torques(weak)), 0.5 * limits)


@pytest.mark.parametrize("body", [QUADRUPED, imports.with_arm()], ids=["no arm", "an arm"])
def test_a_failed_leg_hangs(body):
    opened = environment(body, actuator_failure=0)
    assert opened.action_spec().shape == (12,)  # held joints take no actions
    for count in range(60):
        opened.step(np.full(12, 0.1))
        assert (torques(opened)[:3] == 0.0).all() == (count >= 40)
        assert (torques(opened)[3:] != 0.0).all()
    assert not opened.physics.data.ctrl[24:].any()


def test_late_actions_arrive_at_servos():
    late, prompt = environment(QUADRUPED, delay=3), environment(QUADRUPED)
    actions = np.random.default_rng(0).uniform(-0.2, 0.2, (8, 12))
    for count, action in enumerate(actions):
        late.step(action)
        prompt.step(actions[max(count - 3, 0)] if count >= 3 else np.zeros(12))
        np.testing.assert_array_equal(late.physics.data.qpos, prompt.physics.data.qpos)


def test_energy_is_the_work_of_the_servos():
    opened, work = environment(QUADRUPED), 0.0
    weight = measure_standing(QUADRUPED).mass * 9.81
    angles = opened.task.definition.read(opened.physics.data.ptr).joint_angles.copy()
    for action in np.random.default_rng(0).uniform(-0.2, 0.2, (20, 12)):
        opened.step(action)
        now = opened.task.definition.read(opened.physics.data.ptr).joint_angles.copy()
        work += (torques(opened) * (now - angles)).clip(0.0).sum() / weight
        angles = now
    assert opened.task.memory.energy.total == pytest.approx(work, rel=1e-9)


def test_mirrored_actions_mirror_the_walk(body):
    maps, opened = symmetry(body, "walk"), environment(body, joint_angle_noise=0.0, position_noise=0.0)
    action = np.random.default_rng(0).uniform(-0.1, 0.1, len(body.joint_names))
    qpos = opened.task.definition.scene.standing
    seen = []
    for each in (action, maps.action(action)):
        opened.physics.data.qpos[:], opened.physics.data.qvel[:] = qpos, 0.0
        for _ in range(5):
            step = opened.step(each)
        seen.append(opened.task.definition.vector(step.observation))
    parts = slice(0, 5 + len(action))
    np.testing.assert_allclose(maps.observation(seen[0])[parts], seen[1][parts], atol=0.02)


def test_settings_that_servos_cannot_have_are_refused():
    has = "quadruped_15_kg has servos"
    with refused(f"actions: {has}, which take positions, expected position, got torque"):
        arc_suite.load(QUADRUPED, "walk", {"actions": "torque"})
    with refused(f"preset: gives torques, and {has}, expected one such as medium or steered"):
        Demonstrator(QUADRUPED, PRESETS["leaper"]["medium"])
    expected = "expected the default in a body with a source, which has its motors and weights"
    with refused(f"Body(quadruped_15_kg).agility: {expected}", SpecError):
        QUADRUPED.replace(agility=2.0)
    expected = "expected the default in a body with a source, which has the looks of its file"
    with refused(f"Body(quadruped_15_kg).ornaments: {expected}", SpecError):
        QUADRUPED.replace(ornaments=False)
    with refused("length: quadruped_15_kg was imported, and keeps its torso; scale, links, ends change"):
        shaping.shaped(QUADRUPED, length=2.0)


def test_positions_are_what_servos_take_anyway():
    default, given = (environment(QUADRUPED, **settings) for settings in ({}, {"actions": "position"}))
    action = np.full(12, 0.1)
    np.testing.assert_array_equal(
        default.step(action).observation["posture"], given.step(action).observation["posture"]
    )


def test_a_setup_keeps_the_source(body):
    setup = Setup.of(body, "walk")
    again = Setup.from_dict(json.loads(json.dumps(setup.to_dict())))
    assert again.body == body


def test_tasks_are_prepared_with_the_substeps_of_the_file(body):
    task, model = prepare_task(body, "walk")
    assert model.opt.timestep * task.scene.substeps == pytest.approx(0.02)
    assert task.actions == "position"
