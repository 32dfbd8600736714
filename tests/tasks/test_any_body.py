"""Any body walks: the task is fitted to it and a demonstrator needs no tuning."""

import math

import mujoco
import numpy as np
import pytest
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite import models, policies, rotations
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.models.standing import measure_standing
from arc_suite.models.stride import fitted_gait
from arc_suite.robots import ROBOTS, gaits, spec_files
from arc_suite.robots.spec_files import body_to_json, load_body
from arc_suite.tasks.walk import Walk

EXAMPLES = list(spec_files.EXAMPLES.values())
BODY = generator.generate(6, 3)


def unit(body):
    """sqrt(g h), the speed that speeds are measured in."""
    return math.sqrt(9.81 * body.torso.standing_height)


def track(body, seconds, demonstrator=None, **kwargs):
    """Positions (n, 2) of the torso from control step to control step; the body must not fall."""
    kwargs = {"time_limit": seconds, "random": 0, "joint_noise": 0.0, "base_noise": 0.0} | kwargs
    environment = arc_suite.load(body, "walk", kwargs)
    demonstrator = demonstrator or Demonstrator(body, "medium")
    step, positions = environment.reset(), [environment.physics.position()[:2].copy()]
    while not step.last():
        step = environment.step(demonstrator(step))
        positions.append(environment.physics.position()[:2].copy())
    assert step.discount == 1.0
    return np.array(positions)


def speed(body, seconds=8.0, demonstrator=None, **kwargs):
    """Mean forward speed in sqrt(g h) over the second half of a walk."""
    positions = track(body, seconds, demonstrator, **kwargs)
    half = len(positions) // 2
    return (positions[-1, 0] - positions[half, 0]) / (seconds * (1.0 - half / (len(positions) - 1))) / unit(body)


@pytest.mark.parametrize("path", tiers(EXAMPLES, lambda path: path.stem == "crab"), ids=lambda path: path.stem)
def test_examples_walk(path):
    body = load_body(path)
    seconds = 25.0 / math.sqrt(9.81 / body.torso.standing_height)
    positions = track(body, seconds, joint_noise=0.05)
    forward, sideways = positions[-1] - positions[0]
    assert forward > 0.1 * unit(body) * seconds
    assert abs(sideways) < 0.2 * forward


@pytest.mark.parametrize("seed", tiers(range(6), lambda seed: seed < 1))
def test_random_bodies_walk(seed):
    body = generator.random_body(seed)
    assert speed(body, joint_noise=0.05, random=seed) > 0.1


def test_the_gait_makes_the_walk():
    in_phase = Demonstrator(arc_suite.load(BODY, "walk", {"duty_factor": 0.6, "phase_offsets": 0.0}), "medium")
    assert speed(BODY, demonstrator=in_phase) < 0.1
    assert speed(BODY) > 0.17


@pytest.mark.slow
def test_speed_has_one_knob_that_goes_both_ways():
    speeds = [speed(BODY, demonstrator=Demonstrator(BODY, froude)) for froude in (-0.25, 0.1, 0.2, 0.3)]
    assert speeds[0] < -0.15
    assert 0.05 < speeds[1] < speeds[2] - 0.05 < speeds[3] - 0.1
    presets = [speed(BODY, demonstrator=Demonstrator(BODY, preset)) for preset in ("slow", "medium", "fast")]
    assert presets == sorted(presets)


@pytest.mark.slow
def test_mirrored_bodies_walk_mirrored_tracks():
    body = generator.random_body(6)  # unequal, and drifting to a side
    gait = arc_suite.load(body, "walk").task.settings.parameters
    gait = {"duty_factor": gait.duty_factor, "phase_offsets": gait.phase_offsets}
    positions = track(body, 6.0)
    mirrored = track(body.mirrored(), 6.0, Demonstrator(arc_suite.load(body.mirrored(), "walk", gait), "medium"))
    assert np.ptp(positions[:, 1]) > 1e-3 * body.torso.standing_height
    np.testing.assert_allclose(mirrored * (1.0, -1.0), positions, atol=1e-6)


@pytest.mark.parametrize("robot", ["queen", "tick"])
def test_knees_that_bend_one_way_only_hold_no_hip_up(robot):
    body = generator.scaled(ROBOTS[robot], 0.5)
    assert any(0.0 in joint.range_deg for leg in body.legs for joint in leg.joints)
    assert speed(body, seconds=20.0 * math.sqrt(body.torso.standing_height / 9.81)) > 0.1  # it was 0


@pytest.mark.long
@pytest.mark.parametrize("scale", [0.05, 12.5, 50.0])  # 2 cm, 5 m and 20 m high
def test_bodies_of_one_shape_start_and_walk_alike_with_the_noise_of_the_task(scale):
    expected, found = (measures_of(generator.scaled(BODY, factor)) for factor in (1.0, scale))
    assert np.ptp(expected["tilts"]) > 1e-4
    np.testing.assert_allclose(found["tilts"], expected["tilts"], rtol=1e-6)
    np.testing.assert_allclose(found["clearances"], expected["clearances"], atol=1e-6)
    np.testing.assert_allclose(found["shares"], expected["shares"], atol=0.03)
    np.testing.assert_array_equal(found["falls"], expected["falls"])


def measures_of(body):
    """Episodes of 160 control steps of a body in the task as it is: starts and walks, in units without dimension."""
    found = {name: [] for name in ("tilts", "clearances", "shares", "falls")}
    environment, policy = arc_suite.load(body, "walk", {"random": 0}), Demonstrator(body, "medium")
    height, feet = body.torso.standing_height, list(body.foot_names)
    for _ in range(4):
        step, steps = environment.reset(), 0
        found["tilts"].append(math.acos(rotations.upright(environment.physics.position()[3:7])))
        lowest = min(environment.physics.named.data.xpos[name, "z"] for name in feet)
        found["clearances"].append((lowest - body.legs[0].foot.radius) / height)
        while steps < 160 and not step.last():
            step, steps = environment.step(policy(step)), steps + 1
        found["shares"].append(environment.task.progress["speed"] / environment.task.definition.target_velocity)
        found["falls"].append(step.last())
    return found


@pytest.mark.long
@pytest.mark.parametrize(("task", "preset", "apart"), [("steer", "steered", 0.02), ("navigate", "planned", 0.05)])
def test_bodies_of_one_shape_earn_alike(task, preset, apart):
    """Costs, commands and contact forces have no scale."""
    returns, goals = [], []
    for scale in (0.1, 1.0, 10.0):
        body = generator.scaled(BODY, scale)
        environment = arc_suite.load(body, task, {"random": 2, "base_noise": 0.0})
        policy, step, total = Demonstrator(body, preset), environment.reset(), 0.0
        for _ in range(250):
            step = environment.step(policy(step))
            total += step.reward
        returns.append(total), goals.append(environment.task.progress.get("goals"))
    assert returns == pytest.approx([returns[1]] * 3, rel=apart)
    assert goals == [goals[0]] * 3 and goals[0] != 0.0


def test_an_episode_has_a_thousand_steps_whatever_the_size():
    for scale in (0.15, 1.0, 7.3):
        environment = arc_suite.load(generator.scaled(BODY, scale), "walk")
        environment.reset()
        action = np.zeros(environment.action_spec().shape)
        environment._step_count = 997
        lasts = [environment.step(action).last() for _ in range(3)]
        assert lasts == [False, False, True]


def test_a_domain_is_a_name_a_body_or_a_file(tmp_path):
    path = tmp_path / "body.json"
    path.write_text(body_to_json(BODY))
    for domain in (BODY, path, str(path)):
        environment = arc_suite.load(domain, "walk", {"random": 3})
        step = environment.reset()
        assert environment.task.body == BODY
        size = sum(np.size(block) for block in step.observation.values())
        assert size == 13 + 2 * 18 + 6 * 25


def test_settings_are_fitted_by_the_documented_formulas():
    body = generator.scaled(BODY, 2.0)  # 0.8 m high
    settings = Walk.settings_for(body, {})
    parameters, weights, noise = settings.parameters, settings.weights, settings.noise
    assert parameters.target_velocity == pytest.approx(0.2 * math.sqrt(9.81 * 0.8))
    assert settings.velocity_band == pytest.approx(0.75 * parameters.target_velocity)
    assert parameters.gait_frequency == pytest.approx(0.27 * math.sqrt(9.81 / 0.8))
    assert parameters.stance_threshold == pytest.approx(0.048 + 0.04 * 0.8)
    assert settings.healthy_range == pytest.approx((0.32, 1.44))
    assert parameters.duty_factor == 0.65
    expected = 2.0 * math.pi * np.array(gaits.metachronal(body, 0.65).offsets)
    assert parameters.phase_offsets == pytest.approx(expected)
    speed, rate = math.sqrt(9.81 * 0.8), math.sqrt(9.81 / 0.8)
    assert noise == pytest.approx((0.05 * 0.8, 0.02, 0.01 * speed, 0.004 * rate, 0.1, 0.02 * rate))
    assert weights == Walk.settings_for(ROBOTS["queen"], {}).weights
    changed = Walk.settings_for(
        body, {"target_velocity": 1.0, "healthy_range": (0.1, 2.0), "weights": {"control": -1.0}}
    )
    assert changed.parameters.target_velocity == 1.0
    assert changed.healthy_range == (0.1, 2.0)
    assert changed.weights["control"] == -1.0


def test_numbers_go_by_the_name_of_a_body_that_has_the_joints():
    queen = ROBOTS["queen"]
    heavier = queen.replace(density=10.001)
    for given, published in zip(
        Walk.settings_for(heavier, {}).parameters, Walk.settings_for(queen, {}).parameters, strict=True
    ):
        np.testing.assert_array_equal(given, published)
    renamed = heavier.replace(name="heavier")
    assert Walk.settings_for(renamed, {}).parameters.target_velocity == pytest.approx(0.2 * unit(queen))
    for body, got in ((BODY, "18"), (generator.generate(4, 3), "12 with other names")):
        line = "walk: expected a body named 'bastion' to have the 12 joints of bastion, got"
        with refused(f"{line} {got}; give it another name"):
            Walk.settings_for(body.replace(name="bastion"), {})


def test_four_legs_trot_and_others_walk_in_waves():
    quadruped = fitted_gait(generator.generate(4, 3))
    assert quadruped == (0.65, (0.0, 0.5, 0.5, 0.0))
    assert fitted_gait(generator.generate(4, 2, "radial")) == (0.65, (0.0, 0.5, 0.0, 0.5))
    assert fitted_gait(BODY) == gaits.metachronal(BODY, 0.65)
    assert fitted_gait(generator.generate(5, 2)).duty_factor == 0.65


@pytest.mark.slow
def test_64_legs_load():
    left = generator.generate(6, 4).legs[0]
    legs = [left.replace(name=f"l{i}", mount=(3.0 - 0.19 * i, 0.1, 0.0)) for i in range(32)]
    body = BODY.replace(name="centipede", legs=(*legs, *(leg.mirrored(f"r{leg.name[1:]}") for leg in legs)))
    environment = arc_suite.load(body, "walk")
    Demonstrator(body, "medium")
    assert environment.task.definition.size == 13 + 2 * 256 + 6 * 321
    assert body.ranks == (*range(32), *range(32))


def test_what_a_demonstrator_cannot_do_is_one_line():
    with refused("froude: expected 0.001 or more, forwards or backwards, got 0.0"):
        Demonstrator(BODY, 0.0)
    with refused("froude: expected a number from -1 to 1, got nan"):
        Demonstrator(BODY, math.nan)
    assert policies.policy("zero", BODY).act({}, np.zeros(1)).shape == (1, 18)


@pytest.mark.parametrize("seed", tiers(range(100, 110), lambda seed: seed < 103))
def test_random_actions_upset_no_body(seed):
    body = generator.random_body(seed)
    model = mujoco.MjModel.from_xml_string(models.assemble(body).to_xml_string())
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    while data.time < 0.5:
        data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
        mujoco.mj_step(model, data, 25)
    assert not any(warning.number for warning in data.warning)
    assert np.isfinite(data.qpos).all()


def test_one_link_legs_are_built_and_stand():
    body = generator.generate(6, 1)
    assert measure_standing(body).margin > 0.08 * body.torso.standing_height
    track(body, 4.0)  # no promise that it walks
