"""Privileged observations: their values, and how many bodies share one layout."""

import gymnasium
import imports
import numpy as np
import pytest
from episodes import begun, load
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import rotations
from arc_suite.bodies import BodiesEnv, padding
from arc_suite.envs.gym import Env
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, privileged
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers import Kicks, Motors, Pushes
from arc_suite.tasks.modifiers.motors import FAILS_FROM
from arc_suite.tasks.parts import Joints, Legs, Scalar
from arc_suite.tasks.suite import Steer

DRAWN = {"friction": (0.5, 1.0), "mass": (0.8, 1.2), "payload": (0.1, 0.3), "center_of_mass": 0.1}
DRAWN |= {"joint_offset": 0.05, "joint_strength": (0.5, 1.0), "motor_strength": 0.8, "armature": (0.8, 1.2)}


def test_velocity_and_ground_are_those_of_the_simulation_without_scale():
    environment = begun("leaper", "stairs", observation_noise=1.0)
    physics, arena, height = environment.physics, environment.task.scene.arena, 0.5
    physics.data.qpos[0] += 6.0  # onto the stairs
    physics.data.qpos[3:7] = rotations.turn_about_z(physics.data.qpos[3:7].copy(), 1.0)
    physics.data.qvel[:6] = (0.3, -0.2, 0.1, 1.0, 2.0, 3.0)
    physics.forward()
    found, torso = environment.task.privileged, physics.data.qpos[:3]
    along = rotations.to_heading_frame(np.array((0.3, -0.2)), rotations.yaw(physics.data.qpos[3:7]))
    unit, rate = (9.81 * height) ** 0.5, (9.81 / height) ** 0.5
    assert_allclose(found["velocity"], [*(along / unit), 0.1 / unit, 1.0 / rate, 2.0 / rate, 3.0 / rate], rtol=1e-12)
    feet = np.array([physics.named.data.xpos[name] for name in environment.task.body.foot_names])
    ground = np.array([arena.height(*foot[:2]) for foot in feet])
    assert len(set(ground.tolist())) > 1
    assert_allclose(found["ground"], (ground - torso[2]) / height + 1.0, atol=1e-12)


@pytest.mark.parametrize("task", ["walk", "navigate"])
def test_what_an_episode_draws_is_there(task):
    environment = load("leaper", task, **DRAWN)
    plain = environment.physics.model.ptr
    friction, mass, armature = plain.pair_friction.copy(), plain.body_mass.copy(), plain.dof_armature.copy()
    environment.reset()
    found, model = environment.task.privileged, environment.physics.model.ptr
    torso, own = model.body("torso").id, plain.body_rootid == plain.body("torso").id  # pillars are no parts of it
    assert_allclose(model.pair_friction, found["friction"][0] * friction)
    assert_allclose(np.delete(model.body_mass, torso), found["mass"][0] * np.delete(mass, torso))
    assert model.body_mass[own].sum() == pytest.approx((1 + found["payload"][0]) * found["mass"][0] * mass[own].sum())
    assert_allclose(model.dof_armature, found["armature"][0] * armature)
    assert (found["strength"] < 0.8).all() and len(set(found["strength"])) == 12
    assert (abs(found["joint_offset"]) <= 0.05).all() and (abs(found["center_of_mass"]) <= 0.1).all()
    assert_array_equal(found["gains"], 1.0)


def changed(model):
    """Fields with half of the friction, a third more mass and so on, and with a load beside the torso's middle."""
    multiples = {"pair_friction": 0.5, "dof_armature": 2.0, "body_mass": 1.5, "actuator_gear": 0.25}
    fields = {name: multiple * getattr(model, name) for name, multiple in multiples.items()}
    fields["body_mass"][1] += 1.5 * 0.3 * model.body_mass.sum()
    return fields | {"body_ipos": model.body_ipos + np.eye(len(model.body_ipos))[:, 1:2] * (0.0, 0.02, 0.0)}


def test_what_is_changed_for_good_takes_the_place_of_what_is_drawn():
    settings = {"payload": (0.1, 0.3), "joint_strength": (0.5, 1.0), "friction": (0.7, 1.0), "mass": (0.7, 1.0)}
    options = {"domain_name": "leaper", "task_name": "walk", "task_kwargs": settings, "privileged": True}
    single, vector = Env(**options), VectorEnv(num_envs=2, **options)
    fields = changed(load("leaper", "walk").physics.model.ptr)
    drawn, _ = single.reset(seed=1)[1], vector.reset(seed=0)
    single.change_model(fields)
    vector.change_model(fields, np.array([False, True]))
    layout, found = privileged.sizes(vector.task.definition), vector.task.privileged
    own = {"friction": 0.5, "armature": 2.0, "mass": 1.5}
    for name, value in own.items():
        assert_allclose(found[name][1], value, rtol=1e-12)
    assert_allclose(found["payload"][1], (0.3, 0.0, 0.04, 0.0), atol=1e-12)
    assert_allclose(found["center_of_mass"][1], (0.0, 0.04, 0.0), atol=1e-12)
    drawn = privileged.split(layout, drawn["privileged"])
    assert_allclose(found["strength"][1], 0.25 * drawn["strength"], rtol=1e-6)
    assert found["friction"][0] > 0.7 and found["mass"][0] < 1.0 and found["payload"][0, 0] < 0.3
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (3, 12)):
        one, other = single.step(action)[-1], vector.step(np.stack([action] * 2))[-1]
        assert_array_equal(one["privileged"], other["privileged"][1])
    assert_array_equal(single.reset(seed=3)[1]["privileged"], vector.reset(seed=[2, 3])[1]["privileged"][1])
    assert single.reset()[1]["privileged"][layout["velocity"] + layout["ground"]] == 0.5


def test_gains_of_servos_that_are_changed_are_there():
    environment = begun(imports.quadruped(), "walk", gains=(0.5, 0.5), actions="position")
    model = environment.physics.model.ptr
    environment.change_model({"actuator_biasprm": 3.0 * model.actuator_biasprm, "jnt_actfrcrange": 0.0})
    assert_allclose(environment.task.privileged["gains"], (0.5, 1.5), rtol=1e-12)
    assert_array_equal(environment.task.privileged["strength"], 0.0)


def test_kicks_forces_and_failures_are_there_in_the_step_in_which_they_act():
    environment = begun("tick", "walk", kicks=1.0, force=0.4, actuator_failure=2)
    height, task = ROBOTS["tick"].torso.standing_height, environment.task.definition
    kicks, pushes, motors = (task.state(environment.task.memory, kind) for kind in (Kicks, Pushes, Motors))
    first = int(kicks.steps[0])
    assert not environment.task.privileged["kick"].any()
    for step in range(1, max(first, FAILS_FROM, int(pushes.first[0])) + 1):
        environment.step(np.zeros(18))
        found, heading = environment.task.privileged, rotations.yaw(environment.physics.data.qpos[3:7])
        kick = kicks.kicks[0] / (9.81 * height) ** 0.5 if step == first else np.zeros(2)
        assert_allclose(found["kick"], rotations.to_heading_frame(kick, heading), atol=1e-12)
        force = environment.physics.data.xfrc_applied[1, :2] / task.modifier(Pushes).weight
        assert_allclose(found["force"], rotations.to_heading_frame(force, heading), atol=1e-12)
        assert_array_equal(found["strength"] == 0.0, motors.failing & (step > FAILS_FROM))
    assert found["force"].any() or found["kick"].any()


def test_infos_have_none_by_default():
    for environment in (Env("tick", "walk"), VectorEnv("tick", "walk", 2), BodiesEnv("walk", 2, "tick")):
        _, info = environment.reset(seed=0)
        *_, after = environment.step(environment.action_space.sample())
        assert "privileged" not in info and "privileged" not in after


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_different_bodies_have_one_padded_layout(mode):
    settings, ends = {"time_limit": 0.3, "kicks": 1.0}, 0
    bodies = ["varied:0", "varied:1", "leaper"]
    mixed = BodiesEnv("steer", 3, bodies, autoreset_mode=mode, task_kwargs=settings, privileged=True)
    options = {"autoreset_mode": mode, "task_kwargs": {**settings, "actions": "position"}, "privileged": True}
    alone = [VectorEnv(body, "steer", 1, **options) for body in mixed.bodies]
    infos = mixed.reset(seed=4)[1], [each.reset(seed=4 + index)[1] for index, each in enumerate(alone)]
    width = sum(padding.privileged_sizes(mixed.tasks[0]).values())
    for _ in range(8):
        together, own = infos
        assert together["privileged"].shape == (3, width) and together["privileged"].dtype == np.float32
        for index, info in enumerate(own):
            task = mixed.tasks[index]
            assert_array_equal(
                together["privileged"][index], padding.spread(padding.privileged_padding(task), info["privileged"])[0]
            )
            blocks = privileged.split(padding.privileged_sizes(task), together["privileged"][index])
            legs = len(task.scene.body.legs)
            assert blocks["ground"][:legs].all() and not blocks["ground"][legs:].any()
            assert (blocks["strength"] > 0.0).sum() == len(task.scene.body.joint_names)
            if "final_info" in info:
                last = together["final_info"]["privileged"][index]
                assert_array_equal(
                    last, padding.spread(padding.privileged_padding(task), info["final_info"]["privileged"])[0]
                )
                assert (last != together["privileged"][index]).any()
                ends += 1
        infos = (
            mixed.step(np.zeros((3, 12, 4)))[-1],
            [each.step(np.zeros(each.action_space.shape))[-1] for each in alone],
        )
    assert (ends > 0) == (mode == "SameStep")


class Loaded(Steer):
    """Steer, with a privileged block of another package: the load of each foot and of each joint."""

    name = "loaded"

    @property
    def privileged_blocks(self):
        body = self.scene.body
        return {**super().privileged_blocks, "load": Block((Legs(body), Scalar(), Joints(body)))}

    def privileged(self, memory, data):
        body = self.scene.body
        numbers = np.concatenate([np.full(len(body.legs), 2.0), [3.0], np.full(len(body.joint_names), 4.0)])
        load = np.broadcast_to(numbers, (*data.qpos.shape[:-1], len(numbers)))
        return {**super().privileged(memory, data), "load": load}


def test_a_block_of_another_package_is_padded_by_its_parts(monkeypatch):
    """Bodies of four and six legs have one layout."""
    monkeypatch.setitem(TASKS, "loaded", Loaded)
    mixed = BodiesEnv("loaded", 2, ["leaper", "queen"], privileged=True)
    _, info = mixed.reset(seed=0)
    blocks = privileged.split(padding.privileged_sizes(mixed.tasks[0]), info["privileged"])
    assert blocks["load"].shape == (2, 12 + 1 + 48)
    for numbers, body in zip(blocks["load"], mixed.bodies, strict=True):
        legs, joints = len(body.legs), len(body.joint_names)
        assert_array_equal(numbers[:12], [2.0] * legs + [0.0] * (12 - legs))
        assert numbers[12] == 3.0 and (numbers[13:] == 4.0).sum() == joints and set(numbers[13:]) == {0.0, 4.0}
        assert_array_equal(numbers[13 : 13 + 4], [4.0] * (joints // legs) + [0.0] * (4 - joints // legs))


def test_vector_environments_of_gymnasium_batch_them():
    make = lambda: gymnasium.make("arc_suite/tick-walk-v0", privileged=True)  # noqa: E731
    theirs, ours = gymnasium.vector.SyncVectorEnv([make] * 2), VectorEnv("tick", "walk", 2, privileged=True)
    one, other = theirs.reset(seed=0)[1], ours.reset(seed=0)[1]
    for _ in range(3):
        for name in ("privileged", "_privileged"):
            assert_array_equal(one[name], other[name])
        one, other = (each.step(np.zeros((2, 18), np.float32))[-1] for each in (theirs, ours))
