"""Modifiers of tasks: what each changes, and that a vector environment equals single ones bit by bit."""

import copy
import itertools
import math
import pathlib
import pickle
import re
import types
from typing import ClassVar, NamedTuple

import gaitless
import gymnasium
import imports
import numpy as np
import pytest
import twins
from episodes import assert_same_steps, begun, flat, load, random_actions
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from tiers import never, tiers, turn

import arc_suite
from arc_suite import policies, rotations
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.models.outline import torso_box
from arc_suite.models.sizing import GRAVITY
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import load_body
from arc_suite.tasks import TASKS, modified_task, modifiers, noise
from arc_suite.tasks.modifiers import (
    MODIFIERS,
    Control,
    Delay,
    Kicks,
    Masses,
    Motors,
    Pushes,
    Sensors,
    draws,
    kicks,
    motors,
    pushes,
)
from arc_suite.tasks.scene import CHANGEABLE

SPIDER = load_body("spider")
BODIES = {**ROBOTS, "spider": SPIDER}
EACH = {
    "kicks": {"kicks": 1.5},
    "motor_strength": {"motor_strength": (0.5, 1.0)},
    "actuator_failure": {"actuator_failure": True},
    "friction": {"friction": (0.2, 1.0)},
    "mass": {"mass": (0.7, 2.0)},
    "observation_noise": {"observation_noise": 1.0},
    "delay": {"delay": (0, 3)},
    "actions": {"actions": "position"},
    "exclude_blocks": {"exclude_blocks": ("contact_forces",)},
    "sensors_only": {"sensors_only": True},
    "payload": {"payload": (0.1, 0.4)},
    "center_of_mass": {"center_of_mass": 0.1},
    "joint_offset": {"joint_offset": 0.05},
    "joint_strength": {"joint_strength": (0.5, 1.0)},
    "gains": {"gains": (0.7, 1.3), "actions": "position"},
    "armature": {"armature": (0.8, 1.5)},
    "force": {"force": 0.3},
    "history": {"history": 2},
}
ALL = {name: value for setting in EACH.values() for name, value in setting.items()}
CASES = EACH | {"all": ALL}


_TASKS = [*itertools.product(EACH, ["walk", "steer"]), *itertools.product(["all"], TASKS)]


def state(environment, kind):
    """The state of the modifier of a class."""
    return environment.task.definition.state(environment.task.memory, kind)


def settings_of(environment):
    """The values of the settings of all modifiers."""
    changes = environment.task.definition.changes
    return {name: getattr(change, name) for change in changes for name in change.defaults}


def test_every_modifier_is_tried():
    assert set(EACH) == set(MODIFIERS)


# All at once in the fast tests, each by itself, on bodies in turn, in the slow ones.
@pytest.mark.parametrize(
    ("case", "task_name", "body"),
    tiers(
        [(*case, body) for case in _TASKS for body in BODIES],
        check=lambda case, task, body: (case, task) in (("all", "walk"), ("all", "steer")),
        test=lambda case, task, body: turn(body, BODIES, _TASKS.index((case, task))),
    ),
)
def test_a_modified_task_conforms(case, task_name, body):
    settings, excluded = CASES[case], "contact_forces"
    if task_name == "mimic" and "exclude_blocks" in settings:
        excluded = "motion"  # it observes no contact forces
        settings = settings | {"exclude_blocks": (excluded,)}
    one, two = load(BODIES[body], task_name, **settings), load(BODIES[body], task_name, **settings)
    plain = load(BODIES[body], task_name)
    timestep, _ = one.reset(), plain.reset()
    blocks = {name: (size,) for name, size in one.task.sizes.items()}
    assert {name: block.shape for name, block in timestep.observation.items()} == blocks
    changed = {excluded: ("exclude_blocks", "all"), "history": ("history", "all")}
    assert set(plain.task.definition.blocks) ^ set(blocks) == {n for n, cases in changed.items() if case in cases}
    assert one.action_spec() == plain.action_spec()
    assert_array_equal(flat(timestep), flat(two.reset()))
    assert_same_steps(one, two, random_actions(one, 3))
    assert_same_steps(one, copy.deepcopy(one), random_actions(one, 2, seed=1))
    assert one.task.progress.keys() == plain.task.progress.keys() | {"fell"}
    definition = one.task.definition
    assert (definition.name, definition.version) == (task_name, plain.task.definition.version)


@pytest.mark.parametrize("task_name", ["walk", "steer", "stairs", "shoved"])
@pytest.mark.parametrize("body", tiers(BODIES, lambda body: body == "spider"))
def test_modifiers_that_change_nothing_change_no_bit(task_name, body):
    """And what they draw, they draw after all that the task draws."""
    own = {"kicks": 0.0, "actuator_failure": False}
    neutral = {"motor_strength": 1, "friction": 1.0, "mass": [1, 1], "observation_noise": 0, "delay": 0}
    neutral |= {"payload": 0, "center_of_mass": 0, "joint_offset": 0, "joint_strength": 1, "gains": 1, "armature": 1}
    neutral |= {"force": 0, "history": 0, "sensors_only": False}
    plain = load(BODIES[body], task_name, **(own if TASKS[task_name].modifiers else {}))
    one = load(BODIES[body], task_name, **neutral, **own, exclude_blocks=(), actions="torque")
    assert_array_equal(flat(one.reset()), flat(plain.reset()))
    assert_same_steps(one, plain, random_actions(one, 10))


MODIFIED = [*((case, "steer", 2) for case in EACH), ("all", "walk", 1), *(("all", task, 3) for task in TASKS)]


@pytest.mark.parametrize(
    ("case", "task_name", "threads", "body"),
    tiers(
        [(*case, body) for case in MODIFIED for body in BODIES],
        never,
        lambda case, task, threads, body: (
            (case, task) in [*itertools.product(["all"], ["walk", "stairs", "navigate"]), ("kicks", "steer")]
            and turn(body, BODIES, MODIFIED.index((case, task, threads)))
        ),
    ),
)
def test_an_environment_is_bit_equal_to_a_single_environment(case, task_name, threads, body):
    """Over three episodes with kicks and limping, a snapshot and a pickle, among others."""
    length = 50 * prepare_task(BODIES[body], "walk")[0].scene.control_timestep
    settings = CASES[case] | {"time_limit": length}
    names = {"domain_name": BODIES[body], "task_name": task_name, "task_kwargs": settings}
    envs = VectorEnv(num_envs=3, num_threads=threads, **names)
    single = gymnasium.make("arc_suite/queen-walk-v0", **names)
    assert_array_equal(envs.reset(seed=40)[0][1], single.reset(seed=41)[0])
    random, ended, episodes, step = np.random.RandomState(0), False, 0, 0
    while episodes < 3:
        step += 1
        action = random.uniform(-0.4, 0.4, envs.single_action_space.shape).astype(np.float32)
        if step == 20:
            envs.reset(seed=9, options={"reset_mask": np.array([True, False, False])})
        if step == 30:
            again = VectorEnv(num_envs=3, num_threads=threads, **names)
            again.restore(envs.snapshot())
            envs.close()
            envs = again
        if step == 45:
            envs, single = pickle.loads(pickle.dumps(envs)), copy.deepcopy(single)
        ended = twins.step(envs, single, action, ended)
        episodes += ended


GOLDEN = [87, 108, 65, 107, 63, 0.9295281911731215, 0.26258377004339706, 0.7507627278607257, 0.25489406250513713]
GOLDEN += [0.8512945862882053, 1.776380432471899, 5.786773079359972, 2.7227691187924683, 2.6311292476041475]
GOLDEN += [5, 0.47232399628840227, 0.8414767148983973, 0.13111064234791392, 0.3087336572978354, 1988554376]


def test_the_draws_are_these_in_this_order():
    drawn = draws.draw_from_stream(np.random.RandomState(7), 6)
    first = [*np.diff(drawn.kick_steps, prepend=0)[:5], *drawn.kick_sizes[:5], *drawn.kick_directions[:4]]
    last = [drawn.failing_leg, drawn.motor_strength, drawn.friction, drawn.mass, drawn.delay, drawn.noise_key]
    assert len(first + last) == 20
    assert_allclose(first + last, GOLDEN, rtol=1e-15)


def test_later_draws_are_uniform_and_take_nothing_from_the_stream():
    drawn = np.array([np.hstack(draws.draw_by_key(key, 12)) for key in np.arange(4000) * 1_000_003 % 2**32])
    assert drawn.shape == (4000, 10 + 4 * 25 + 2 * 12)
    assert drawn.min() >= 0.0 and drawn.max() < 1.0
    assert_allclose(drawn.mean(axis=0), 0.5, atol=0.02)  # four standard deviations
    assert abs(np.corrcoef(drawn.T) - np.eye(134)).max() < 0.08
    assert draws.draw_by_key(7, 12).payload_place.tolist() == draws.draw_by_key(7, 18).payload_place.tolist()


def drawn_over(episodes, **settings):
    """Yields the environment at the start of many episodes."""
    environment = load("leaper", **settings)
    for _ in range(episodes):
        environment.reset()
        yield environment


def tensor(model, part):
    """The inertia of a part about its center of mass, in its frame."""
    axes = rotations.matrix(model.body_iquat[part])
    return axes * model.body_inertia[part] @ axes.T


def test_a_payload_is_as_if_a_small_ball_had_been_welded_on():
    plain = load("leaper").physics.model.ptr
    torso, total, height = plain.body("torso").id, plain.body_mass.sum(), 0.5
    shares, places = [], []
    for environment in drawn_over(40, payload=(0.1, 0.5)):
        model, (share, *place) = environment.physics.model.ptr, state(environment, Masses).payload
        place, old = height * np.array(place), plain.body_ipos[torso]
        load_mass = model.body_mass[torso] - plain.body_mass[torso]
        assert load_mass == pytest.approx(share * total)
        middle = (plain.body_mass[torso] * old + load_mass * place) / model.body_mass[torso]
        assert_allclose(model.body_ipos[torso], middle, atol=1e-12)
        expected = tensor(plain, torso)
        for mass, apart in ((plain.body_mass[torso], old - middle), (load_mass, place - middle)):
            expected = expected + mass * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        assert_allclose(tensor(model, torso), expected, atol=1e-12)
        assert_array_equal(np.delete(model.body_mass, torso), np.delete(plain.body_mass, torso))
        data = environment.physics.data.ptr
        offset = data.xmat[torso].reshape(3, 3) @ model.body_ipos[torso]
        assert_allclose(data.xipos[torso] - data.xpos[torso], offset, atol=1e-12)
        shares.append(share), places.append(place)
    assert 0.1 <= min(shares) < 0.2 and 0.4 < max(shares) <= 0.5
    low, high = torso_box(ROBOTS["leaper"])
    assert (np.min(places, axis=0) >= low).all() and (np.max(places, axis=0) <= high).all()
    assert (np.ptp(places, axis=0) > 0.7 * (high - low)).all()


def test_each_episode_has_a_center_of_mass_an_armature_and_strengths_of_its_own():
    plain = load("leaper").physics.model.ptr
    torso, found = plain.body("torso").id, []
    settings = {"center_of_mass": 0.1, "armature": (0.5, 2.0), "joint_strength": (0.4, 0.8), "motor_strength": 0.5}
    for environment in drawn_over(40, **settings):
        model, own = environment.physics.model.ptr, state(environment, Motors)
        moved = model.body_ipos - plain.body_ipos
        assert not np.delete(moved, torso, axis=0).any()
        armature = model.dof_armature[6:] / plain.dof_armature[6:]
        assert_allclose(armature, armature[0], rtol=1e-12)
        assert_array_equal(model.body_inertia, plain.body_inertia)
        assert_array_equal(own.strength, 0.5 * own.joint_strength)
        found.append((*moved[torso] / 0.05, armature[0], *own.strength))
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    bounds = np.array([(-1.0, 1.0)] * 3 + [(0.5, 2.0)] + [(0.2, 0.4)] * 12).T
    width = bounds[1] - bounds[0]
    assert (low >= bounds[0] - 1e-9).all() and (high <= bounds[1] + 1e-9).all()
    assert (high - low > 0.8 * width).all()


@pytest.mark.parametrize("body", ["tick", imports.quadruped()], ids=["torques", "servos"])
def test_joints_hold_where_their_displaced_sensors_say_so(body):
    environment = begun(body, "walk", joint_offset=0.1, actions="position", joint_angle_noise=0.0)
    offsets = state(environment, Sensors).joint_offset
    action = np.zeros(len(offsets))
    assert 0.05 < abs(offsets).max() <= 0.1
    for _ in range(60):
        timestep = environment.step(action)
        true = environment.task.definition.read(environment.physics.data.ptr).joint_angles
        assert_allclose(timestep.observation["posture"][5:], true + offsets, atol=1e-12)
    seen = timestep.observation["posture"][5:]  # but for joints at their limits
    assert np.quantile(abs(seen), 0.8) < 0.02, "it thinks that it stands"


def test_a_stiffer_control_pulls_harder():
    for body, strength in (("leaper", 1.0), (imports.quadruped(), 1.0)):
        plain, other = (begun(body, "walk", actions="position", gains=gains) for gains in (1.0, 2.0))
        torques = []
        for environment in (plain, other):
            environment.step(np.full(12, 0.02))
            environment.physics.data.qvel[:] = 0.0
            environment.physics.data.qpos[:] = environment.task.definition.scene.standing
            task = environment.task.definition
            ready = task.begin(environment.task.memory, task.read(environment.physics.data.ptr))
            _, inputs = task.before(ready, np.full(12, strength * 0.01))
            environment.physics.data.ctrl[:] = inputs.ctrl
            environment.physics.forward()
            torques.append(environment.physics.data.qfrc_actuator[6:].copy())
        assert_allclose(torques[1], 2.0 * torques[0], rtol=1e-9)


def test_a_force_pushes_the_torso_for_its_time_and_begins_again():
    environment = begun("tick", "walk", force=0.5, time_limit=math.inf)
    task, memory, seen = environment.task.definition, environment.task.memory, {}
    schedule = state(environment, Pushes)
    period = schedule.first[-1] + pushes.MAX_PUSH_STEPS
    for step in range(1, 2 * int(period) + 1):
        memory, inputs = task.before(memory, np.zeros(18))
        assert inputs.kick is None and inputs.force.shape == (3,) and not inputs.force[2]
        if inputs.force.any():
            seen[step] = inputs.force[:2]
    due = [step for start, end in zip(schedule.first, schedule.last, strict=True) for step in range(start, end + 1)]
    assert list(seen) == [*due, *(step + period for step in due)]
    assert {int(length) for length in schedule.last - schedule.first} == {0, 1, 2, 3}
    pauses = np.diff(schedule.first, prepend=0)
    assert 40 <= pauses.min() < 50 and 100 < pauses.max() <= 120
    sizes = np.hypot(*schedule.forces.T) / task.modifier(Pushes).weight
    assert sizes.min() > 0.0 and 0.4 < sizes.max() < 0.5
    for _ in range(due[0]):
        environment.step(np.zeros(18))
    applied = environment.physics.data.xfrc_applied
    assert_array_equal(applied[1], [*schedule.forces[0], 0.0, 0.0, 0.0, 0.0])
    assert not np.delete(applied, 1, axis=0).any()
    (arrow,) = kick_arrows(environment)
    way, push = (arrow.end - arrow.start)[:2], seen[due[0]]
    assert_allclose(way / np.hypot(*way), push / np.hypot(*push))
    environment.reset()
    assert not applied.any()


def test_kicks_change_the_velocity_of_the_torso_when_they_are_due_and_begin_again():
    environment = begun("tick", "walk", kicks=1.5, time_limit=math.inf)
    task, memory, seen = environment.task.definition, environment.task.memory, {}
    schedule = state(environment, Kicks)
    for step in range(1, int(schedule.steps[-1]) + 200):
        memory, inputs = task.before(memory, np.zeros(18))
        assert inputs.kick.shape == (24,) and not inputs.kick[2:].any()
        if inputs.kick.any():
            seen[step] = inputs.kick[:2]
    period = schedule.steps[-1]
    due = [*schedule.steps, *(period + schedule.steps[: len(seen) - 25])]
    assert len(seen) > 25 and list(seen) == due
    assert_array_equal(list(seen.values())[:25], schedule.kicks)
    assert_array_equal(list(seen.values())[25:], schedule.kicks[: len(seen) - 25])
    sizes = np.hypot(*schedule.kicks.T) / math.sqrt(GRAVITY * ROBOTS["tick"].torso.standing_height)
    assert sizes.min() > 0.0 and sizes.max() < 1.5
    stronger = begun("tick", "walk", kicks=3.0)
    assert_allclose(state(stronger, Kicks).kicks, 2.0 * schedule.kicks, rtol=1e-15)


def test_a_kick_is_on_the_torso_before_the_first_substep(monkeypatch):
    environment = begun("queen", "walk", kicks=1.5)
    physics, changes = environment.physics, []
    advance = physics.step

    def watched(nstep):
        changes.append(physics.velocity() - after)
        advance(nstep)

    monkeypatch.setattr(physics, "step", watched)
    first = state(environment, Kicks).steps[0]
    for _ in range(first):
        after = physics.velocity().copy()
        environment.step(np.zeros(18))
    assert not np.any(changes[:-1])
    assert_allclose(changes[-1], [*state(environment, Kicks).kicks[0], *np.zeros(22)], atol=1e-15)


@pytest.mark.parametrize("leg", [True, 0, 4])
def test_a_limp_leg_has_no_motors_from_step_40_on(leg):
    environment = begun("queen", "walk", actuator_failure=leg)
    names = ROBOTS["queen"].joint_names
    action = np.linspace(0.1, 0.2, 18)
    for step in range(60):
        environment.step(action)
        ctrl = environment.physics.data.ctrl
        failing = state(environment, Motors).failing
        assert_array_equal(ctrl, np.where(failing & (step >= 40), 0.0, action))
    limp = np.flatnonzero(state(environment, Motors).failing)
    assert len({names[index].rpartition("_")[0] for index in limp}) == 1 and len(limp) == 3
    if leg is not True:
        assert_array_equal(limp, [3 * leg, 3 * leg + 1, 3 * leg + 2])
    assert environment.task.terms["control"] == (action**2).sum(), "the reward sees what was asked"


def test_a_numpy_boolean_chooses_a_random_leg():
    settings = Motors.defaults | {"actuator_failure": np.True_}
    assert Motors.of(settings, ROBOTS["tick"], {}).actuator_failure is True
    settings["actuator_failure"] = np.False_
    assert Motors.of(settings, ROBOTS["tick"], {}).actuator_failure is False


def test_each_episode_draws_a_leg_a_strength_a_friction_and_a_delay_of_its_own():
    ranges = {"motor_strength": (0.5, 1.0), "friction": (0.2, 1.0), "mass": (0.8, 2.0)}
    environment = load("leaper", actuator_failure=True, delay=(1, 3), **ranges)
    compiled = environment.physics.model.ptr
    friction, mass = compiled.pair_friction.copy(), compiled.body_mass.copy()
    drawn = []
    for _ in range(60):
        environment.reset()
        model = environment.physics.model.ptr
        own, delay = state(environment, Motors), state(environment, Delay).delay
        slide, weight = model.pair_friction / friction, (model.body_mass[1:] / mass[1:])
        for values in (slide, weight, own.strength):
            assert_allclose(values, values.flat[0], rtol=1e-12)
        drawn.append((own.failing.argmax(), delay, own.strength[0], slide[0, 0], weight[0]))
    legs, delays, *found = zip(*drawn, strict=True)
    assert set(legs) == {0, 3, 6, 9} and set(delays) == {1, 2, 3}
    for values, (low, high) in zip(found, ranges.values(), strict=True):
        width = high - low
        assert low <= min(values) < low + 0.15 * width and high - 0.15 * width < max(values) <= high


def test_motors_that_are_weak_give_their_share():
    environment = begun("leaper", "walk", motor_strength=0.25)
    environment.step(np.full(12, 0.8))
    assert_array_equal(environment.physics.data.ctrl, 0.2)
    assert environment.task.terms["control"] == pytest.approx(12 * 0.64)


def test_a_heavier_body_is_as_if_it_had_been_compiled_so():
    """Masses, inertias and what MuJoCo derives from them; and the next reset begins from the body as it was."""
    body = ROBOTS["queen"]
    environment = begun("queen", "walk", mass=2.0)
    model = environment.physics.model.ptr
    plain = load("queen", "walk").physics.model.ptr
    assert_allclose(model.body_subtreemass, 2.0 * plain.body_subtreemass)
    assert_allclose(model.dof_M0 - model.dof_armature, 2.0 * (plain.dof_M0 - plain.dof_armature), rtol=1e-9)
    assert model.body_invweight0[1, 0] < 0.6 * plain.body_invweight0[1, 0]
    environment.physics.reset()
    for field in ("body_mass", "body_inertia", "body_subtreemass", "dof_M0", "dof_invweight0", "body_invweight0"):
        assert_array_equal(getattr(model, field), getattr(plain, field), err_msg=field)
    assert body == environment.task.body


@pytest.mark.parametrize("arena", ["flat", "bumps"])
def test_what_slides_slides_further_with_less_friction(arena):
    """Whether contacts are listed or not."""
    gone = {}
    for friction in (0.01, 1.0):
        environment = begun("queen", "walk", friction=friction, arena=arena)
        environment.physics.data.qvel[0] = 1.0
        for _ in range(10):
            environment.step(np.zeros(18))
        gone[friction] = environment.physics.position()[0]
    assert gone[0.01] > gone[1.0] + 0.1


@pytest.mark.parametrize("delay", [1, 4])
def test_actions_arrive_late(delay):
    environment = begun("tick", "walk", delay=delay)
    for step in range(10):
        environment.step(np.full(18, 0.01 * (step + 1)))
        assert_array_equal(environment.physics.data.ctrl, 0.01 * max(0, step + 1 - delay))


def test_positions_are_held():
    """Action 0 stands; others move the joints where they say, and the reward sees the torques."""
    environment = begun("queen", "walk", actions="position")
    for _ in range(30):
        timestep = environment.step(np.zeros(18))
    assert abs(timestep.observation["posture"][5:]).max() < 0.1
    hips = np.array([name.endswith("hip") for name in ROBOTS["queen"].joint_names])
    for _ in range(30):
        timestep = environment.step(np.where(hips, 0.5, 0.0))
    assert_allclose(timestep.observation["posture"][5:][hips], math.radians(15.0), atol=0.08)
    ctrl = environment.physics.data.ctrl
    assert environment.task.terms["control"] == pytest.approx((ctrl**2).sum())


def test_torques_have_positions_that_give_them():
    task, random = load("leaper", "walk", actions="position").task.definition, np.random.RandomState(0)
    angles, speeds, torques = (scale * random.uniform(-1, 1, (50, 12)) for scale in (0.5, 1.0, 1.0))
    control = task.modifier(Control)
    held = types.SimpleNamespace(angles=angles, speeds=speeds, gains=np.ones(2))
    action = control.positions(torques, angles, speeds)
    reached = abs(action) < 1.0
    assert reached.mean() > 0.5
    assert_allclose(control.torques(held, action)[reached], torques[reached], atol=1e-9)


def test_noise_is_uniform_and_depends_on_all_that_it_counts():
    keys = np.random.RandomState(0).randint(2**32, size=(40, 1), dtype=np.uint32)
    drawn = np.stack([noise.noise(keys, np.full((40, 1), step, np.uint32), 50) for step in range(50)])
    assert drawn.shape == (50, 40, 50) and drawn.min() >= -1.0 and drawn.max() < 1.0
    counts = np.histogram(drawn, 20, (-1.0, 1.0))[0]
    assert ((counts - 5000) ** 2 / 5000).sum() < 43.8, "chi squared with 19 degrees of freedom, 1 in 1000"
    for axis in range(3):
        lines = np.moveaxis(drawn, axis, 0).reshape(drawn.shape[axis], -1)
        for lag in (1, 2, 7):
            assert abs((lines[lag:] * lines[:-lag]).mean() * 3.0) < 0.012
    # As MurmurHash3's own finalizer computes.
    scrambled = noise.scramble(np.array([0, 1, 0xDEADBEEF], np.uint32))
    assert_array_equal(scrambled, [0, 0x514E28B7, 0x0DE5C6A9])


def test_noise_is_on_what_is_measured_and_on_nothing_else():
    noisy, plain = load("queen", "steer", observation_noise=1.0), load("queen", "steer")
    once, other = noisy.reset(), plain.reset()
    errors = []
    for action in random_actions(noisy, 40):
        assert_array_equal(once.observation["gait_clock"], other.observation["gait_clock"])
        assert_array_equal(once.observation["command"], other.observation["command"])
        errors.append({name: once.observation[name] - block for name, block in other.observation.items()})
        once, other = noisy.step(action), plain.step(action)
        assert once.reward == other.reward
    widths = {name: block.widths for name, block in plain.task.definition.blocks.items() if block.noise is not None}
    assert set(widths) == {"posture", "velocities", "contact_forces", "scan"} & set(plain.task.definition.blocks)
    for name, width in widths.items():
        error = np.array([step[name] for step in errors]) / width
        assert 0.9 < abs(error).max() <= 1.0
        assert error.std() == pytest.approx(3**-0.5, rel=0.05) and abs(error.mean()) < 0.05


def test_noise_of_the_scan_is_set_by_its_name():
    """To legged_gym's 0.1 m for a body of half a meter, 0.2 h."""
    noisy, plain = load("leaper", "rough", observation_noise={"scan": 2.0}).reset(), load("leaper", "rough").reset()
    errors = {name: noisy.observation[name] - block for name, block in plain.observation.items()}
    assert 0.18 < abs(errors.pop("scan")).max() <= 0.2
    assert not np.concatenate(list(errors.values())).any()


def test_noise_of_one_block_is_the_same_whatever_else_is_observed():
    alone = load("queen", "walk", observation_noise={"velocities": 2.0}, exclude_blocks="posture")
    both = load("queen", "walk", observation_noise={"velocities": 2.0, "contact_forces": 1.0})
    plain = load("queen", "walk")
    once, other, clean = alone.reset().observation, both.reset().observation, plain.reset().observation
    assert_array_equal(once["velocities"], other["velocities"])
    assert (once["velocities"] != clean["velocities"]).all()
    assert_array_equal(once["contact_forces"], clean["contact_forces"])
    assert_array_equal(other["posture"], clean["posture"])


def test_a_task_that_prescribes_no_gait_takes_modifiers():
    settings = ALL | {"exclude_blocks": "posture", "observation_noise": {"velocities": 1.0}, "time_limit": 2.0}
    with gaitless.registered():
        names = {"domain_name": "tick", "task_name": "stay", "task_kwargs": settings}
        envs, single = VectorEnv(num_envs=3, **names), gymnasium.make("arc_suite/queen-walk-v0", **names)
        envs.reset(seed=3), single.reset(seed=4)
        for action in np.random.RandomState(0).uniform(-0.3, 0.3, (30, 18)):
            assert not twins.step(envs, single, action, False)
        assert single.unwrapped.task.progress["fell"] == 0.0


def test_named_environments_are_steer_with_modifiers_that_callers_can_change():
    for name, settings in (("shoved", {"kicks": 1.5}), ("limp", {"actuator_failure": True})):
        named, spelled = load("tick", name), load("tick", "steer", **settings)
        assert_array_equal(flat(named.reset()), flat(spelled.reset()))
        assert settings_of(named) == settings_of(spelled)
    definition = load("tick", "shoved", kicks=0.5, delay=1).task.definition
    assert (definition.modifier(Kicks).kicks, definition.modifier(Delay).delay) == (0.5, (1, 1))


NUMBER, OR_TWO = "expected a number from 0 to 100", "or two of them, the lower first"
LEG = "expected true, false or the index of a leg, 0 to 5"
BLOCKS = ("posture", "velocities", "contact_forces", "gait_clock")
LISTED = ", ".join(BLOCKS)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"kick": 1.0}, "unknown setting of walk 'kick'; did you mean 'kicks'? (there are: "),
        ({"kicks": -1.0}, f"kicks: {NUMBER}, got -1.0"),
        ({"kicks": True}, f"kicks: {NUMBER}, got True"),
        ({"actuator_failure": 6}, f"actuator_failure: {LEG}, got 6"),
        ({"actuator_failure": -1}, f"actuator_failure: {LEG}, got -1"),
        ({"actuator_failure": "left"}, f"actuator_failure: {LEG}, got 'left'"),
        ({"motor_strength": -0.1}, f"motor_strength: expected a number from 0 to 1, {OR_TWO}, got"),
        ({"friction": (1.0, 0.5)}, f"friction: {NUMBER}, {OR_TWO}, got"),
        ({"friction": (1, 2, 3)}, f"friction: {NUMBER}, {OR_TWO}, got (1, 2"),
        ({"mass": 0}, f"mass: expected a number from 0.01 to 100, {OR_TWO}, got 0"),
        ({"mass": math.nan}, f"mass: expected a number from 0.01 to 100, {OR_TWO}, got nan"),
        ({"observation_noise": -1}, "observation_noise: expected a number from 0 to 100, got -1"),
        ({"observation_noise": {"postur": 1}}, "unknown block of observation_noise 'postur'; did you mean 'posture'?"),
        (
            {"observation_noise": {"scann": 1}},
            "unknown block of observation_noise 'scann' (there are: posture, velocities, ",
        ),
        ({"payload": -1}, f"payload: expected a number from 0 to 10, {OR_TWO}, got -1"),
        ({"center_of_mass": (0, 1)}, "center_of_mass: expected a number from 0 to 1, got (0, 1)"),
        ({"gains": 2.0}, "gains: torques have none, expected actions='position', got 2.0"),
        ({"delay": 1.5}, "delay: expected an integer from 0 to 100, got 1.5"),
        ({"delay": (3, 1)}, "delay: expected an integer from 3 to 100, got 1"),
        ({"actions": "velocity"}, "unknown actions 'velocity' (there are: torque, position)"),
        (
            {"exclude_blocks": ("scan",)},
            "unknown block of exclude_blocks 'scan' (there are: posture, velocities, contact_forces,",
        ),
        ({"exclude_blocks": 3}, "exclude_blocks: expected names of blocks, got 3"),
        ({"exclude_blocks": BLOCKS}, f"exclude_blocks: expected to leave a block, got all of them: {LISTED}"),
    ],
)
def test_a_wrong_modifier_is_one_line(settings, message):
    for use in (arc_suite.load, lambda body, task, kwargs: VectorEnv(body, task, 2, task_kwargs=kwargs)):
        with refused(message, begins=True):
            use("tick", "walk", settings)
    with pytest.raises(ValueError, match="^unknown modifier 'kick'; did you mean 'kicks'"):
        modified_task.add_modifiers(prepare_task("tick", "walk")[0], {"kick": 1.0})


class Scaled(NamedTuple("Scaled", [("scaling", float)]), modifiers.Modifier):
    """Multiplies actions."""

    __slots__ = ()
    defaults: ClassVar = {"zscaling": 1.0}
    bounds: ClassVar = {"zscaling": (0.0, 2.0)}

    @classmethod
    def of(cls, settings, body, blocks):
        return cls(cls.check_number("zscaling", settings))

    def act(self, state, action, elapsed):
        return state, action * self.scaling


class Shifted(NamedTuple("Shifted", [("shift", float)]), modifiers.Modifier):
    """Adds to actions."""

    __slots__ = ()
    defaults: ClassVar = {"ashift": 0.0}
    bounds: ClassVar = {"ashift": (0.0, 2.0)}

    @classmethod
    def of(cls, settings, body, blocks):
        return cls(cls.check_number("ashift", settings))

    def act(self, state, action, elapsed):
        return state, action + self.shift


def test_modifiers_of_other_packages_act_in_the_order_of_registration(monkeypatch):
    for modifier in (Scaled, Shifted):
        for name in modifier.defaults:
            monkeypatch.setitem(modifiers.MODIFIERS, name, modifier)
    settings = {"zscaling": 0.5, "ashift": 0.4}
    turned_round = dict(reversed(settings.items()))
    setup = Setup.of("tick", "walk", settings)
    for environment in (
        arc_suite.load("tick", "walk", settings),
        arc_suite.load("tick", "walk", turned_round),
        setup.load(),
    ):
        changes = environment.task.definition.changes
        assert [type(change) for change in changes][-2:] == [Scaled, Shifted]


GUIDE = (pathlib.Path(__file__).parents[2] / "docs" / "modifiers.md").read_text()


def test_the_guide_runs():
    there = {}
    for block in re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL):
        exec(compile(block, "modifiers.md", "exec"), there)
    there["environment"].reset()
    there["environments"].reset(seed=0)
    there["environments"].close()


def kick_arrows(environment):
    return [mark for mark in environment.task.markers(environment.physics) if mark.color[1] < 0.2]


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_a_kick_is_a_red_arrow_against_the_torso_while_it_acts(task):
    environment = begun("tick", task, kicks=1.5)
    schedule = state(environment, Kicks)
    first, kick = schedule.steps[0], schedule.kicks[0]
    shown = []
    for _ in range(first + kicks.ARROW_STEPS + 5):
        environment.step(np.zeros(18))
        shown.append(kick_arrows(environment))
        if len(shown) == first:
            (arrow,), torso = shown[-1], environment.physics.data.qpos[:3].copy()
            assert arrow.shape == "arrow" and arrow.color[0] > 0.8
            way, off = arrow.end - arrow.start, torso - arrow.end
            assert_allclose(way[:2] / np.hypot(*way[:2]), kick / np.hypot(*kick))
            assert_allclose(off[:2] / np.hypot(*off[:2]), kick / np.hypot(*kick))  # it points at the torso
            height = environment.task.body.torso.standing_height
            assert np.linalg.norm(way) == pytest.approx(height * np.hypot(*kick) / math.sqrt(GRAVITY * height))
    assert [len(arrows) for arrows in shown] == [0] * (first - 1) + [1] * kicks.ARROW_STEPS + [0] * 6


def test_a_leg_whose_motors_have_failed_is_dark():
    environment = begun("tick", "limp")
    before = environment.physics.render(60, 80, "profile")
    assert environment.task.failed_legs() == ()
    for _ in range(motors.FAILS_FROM + 1):
        environment.step(np.zeros(18))
    (leg,) = environment.task.failed_legs()
    failing = state(environment, Motors).failing
    names = [name for name, fails in zip(environment.task.body.joint_names, failing, strict=True) if fails]
    assert names and all(name.startswith(leg) for name in names)
    assert not np.array_equal(environment.physics.render(60, 80, "profile"), before)
    environment.physics.failed_legs, lit = None, environment.physics.render(60, 80)
    assert not np.array_equal(environment.physics.render(60, 80), lit)


def test_a_history_holds_earlier_observations_and_the_actions_after_them():
    settings = {"history": 2, "exclude_blocks": "contact_forces", "observation_noise": 1.0, "delay": 2}
    env = VectorEnv("tick", "steer", 3, 1, task_kwargs=settings)
    (observation, _), actions = env.reset(seed=0), np.random.default_rng(0).uniform(-1.0, 1.0, (4, 3, 18))
    sizes = env.task.sizes
    size = sizes["posture"] + sizes["velocities"]
    assert sizes["history"] == 2 * (size + 18) and list(sizes) == [
        "posture",
        "velocities",
        "gait_clock",
        "command",
        "history",
    ]
    seen = [observation[:, :size]]
    entries = observation[:, -sizes["history"] :].reshape(3, 2, size + 18)
    assert_array_equal(entries[..., :size], np.stack([seen[0]] * 2, axis=1), err_msg="the start repeats")
    assert not entries[..., size:].any()
    for step, action in enumerate(actions):
        observation, *_ = env.step(action)
        entries = observation[:, -sizes["history"] :].reshape(3, 2, size + 18)
        for place, before in enumerate(range(step, max(step - 2, -1), -1)):
            assert_array_equal(entries[:, place, :size], seen[before], err_msg="with its noise")
            assert_allclose(entries[:, place, size:], actions[before], atol=1e-7, err_msg="as it was sent")
        seen.append(observation[:, :size])


UNSENSED = {"posture": slice(0, 1), "velocities": slice(0, 3), "contact_forces": slice(None), "command": slice(3, 6)}


@pytest.mark.parametrize("task_name", ["walk", "steer", "rough"])
def test_sensors_only_shows_what_sensors_give(task_name):
    settings = {"observation_noise": 1.0, "history": 2}
    full = arc_suite.load("tick", task_name, {"random": 0, **settings})
    one = arc_suite.load("tick", task_name, {"random": 0, "sensors_only": True, **settings})
    walk = policies.policy("cpg", "tick", task=full.task.definition)
    act = policies.alone(walk)
    timestep, sensed = full.reset(), one.reset()
    size = 5 + 18 + 6 + 18 + 18  # posture, velocities and the action of each step
    for _ in range(20):
        expected = {name: block.copy() for name, block in timestep.observation.items()}
        for name, part in UNSENSED.items():
            if name in expected:
                assert name == "command" or expected[name][part].any()
                expected[name][part] = 0.0
        past = expected["history"].reshape(2, size)
        past[:, [0, 23, 24, 25]] = 0.0
        for name, block in sensed.observation.items():
            assert_array_equal(block, expected[name].ravel(), err_msg=name)
        mask = modified_task.sensed_mask(one.task.definition)
        assert_array_equal(np.where(mask, flat(timestep), 0.0), flat(sensed))
        action = act(timestep)
        timestep, sensed = full.step(action), one.step(action)
        assert timestep.reward == sensed.reward


@pytest.mark.parametrize("preset", [None, "medium", "slow"])
def test_demonstrators_read_more_than_sensors_give(preset):
    for task_name in ("walk", "steer"):
        task, _ = prepare_task("tick", task_name, {"sensors_only": True})
        with pytest.raises(
            ValueError, match=r"^sensors_only: expected False, as demonstrators read .*; dagger imitates one"
        ):
            policies.policy("cpg", "tick", preset, task=task)


@pytest.mark.parametrize("name", [name for kind in modifiers.SUITE_MODIFIERS for name in kind.defaults])
def test_a_default_leaves_the_first_episode_of_a_seed_as_it_is(name):
    default = modifiers.MODIFIERS[name].defaults[name]
    if name == "actions":
        default = "torque"
    plain = arc_suite.load("tick", "steer", {"random": 3})
    modified = arc_suite.load("tick", "steer", {"random": 3, name: default})
    stronger = arc_suite.load("tick", "steer", {"random": 3, "kicks": 1.5, "time_limit": 1.0})
    starts = [environment.reset().observation["posture"] for environment in (plain, modified, stronger)]
    np.testing.assert_array_equal(starts[0], starts[1])
    np.testing.assert_array_equal(starts[0], starts[2])
    for action in np.random.default_rng(0).uniform(-0.5, 0.5, (20, 18)):
        one, other = plain.step(action), modified.step(action)
        assert one.reward == other.reward
        for block, expected in one.observation.items():
            np.testing.assert_array_equal(other.observation[block], expected)
    # Modifiers draw from the stream: from the second episode on, those of all strengths start alike, and no others.
    starts = [environment.reset().observation["posture"] for environment in (plain, modified, stronger)]
    assert not np.array_equal(starts[0], starts[1])
    np.testing.assert_array_equal(starts[1], starts[2])


def edit_torso(model, torso):
    """Write into one row of each field that modifiers may write, as users do; return the rows by name."""
    rows = {}
    for name in CHANGEABLE:
        values, row = getattr(model, name), torso if name.startswith("body_") else 0
        if len(values):
            values[row] = (0.6, 0.0, 0.0, 0.8) if name == "body_iquat" else 1.5 * values[row] + 0.01
            rows[name] = (row, values[row].copy())
    return rows


@pytest.mark.parametrize("setting", [*EACH, "all"])
def test_own_edits_of_the_model_stay_in_their_rows_whatever_modifiers_write(setting):
    """Edits before the first episode, and those within one; in pickles, copies and snapshots, too."""
    body, settings = imports.quadruped(), CASES[setting] | {"random": 3}
    edited, twin = (arc_suite.load(body, "walk", settings) for _ in range(2))
    torso = twin.task.definition.scene.layout.torso
    rows = edit_torso(edited.physics.model, torso)
    written = {}
    for episode in range(3):
        again, restored = pickle.loads(pickle.dumps(edited)), arc_suite.load(body, "walk", settings)
        if episode:
            restored.restore(edited.snapshot())
        for environment in (edited, twin, again, restored):
            environment.reset()
        drawn = twin.task.definition.start(np.random.RandomState(0), twin.task.definition.first()).model
        for environment in (edited, again, restored) if episode else (edited, again):
            for name, (row, values) in rows.items():
                found = getattr(environment.physics.model, name)
                if environment is not restored or name in drawn:  # a snapshot holds the fields that are written
                    assert_array_equal(found[row], values, name)
                others = np.arange(len(found)) != row
                assert_array_equal(found[others], getattr(twin.physics.model, name)[others], name)
        written = {name: drawn[name] for name in drawn}
        if episode == 1:
            edited.physics.model.body_mass[torso] = 0.5
            rows["body_mass"] = (torso, np.float64(0.5))
    if setting == "all":
        assert set(written) == set(CHANGEABLE) - {"actuator_gear"}
    vector = VectorEnv(body, "walk", 1, task_kwargs=settings | {"random": 3})
    vector.reset(seed=3)
    with pytest.raises(ValueError, match="read-only"):
        vector.batch.models[0].body_mass[torso] = 0.5
