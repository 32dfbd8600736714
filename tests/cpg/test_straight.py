"""The demonstrator that walks straight ahead by feedback."""

import numpy as np
import pytest

from arc_suite import registry, rotations
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv

TIPPING = "varied:12014"  # four legs; by an open loop it walks at .55 of the target velocity, aside by .2


def _walk(body, preset: str, task_kwargs, steps=200) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean velocity (2,), in target velocities, and the yaw, rad, of a torso after a second of a walk."""
    environments = VectorEnv(body, "walk", 1, task_kwargs=task_kwargs)
    policy = Demonstrator(environments, preset)
    observations, _ = environments.reset(seed=7)
    positions = []
    for _ in range(steps):
        observations, _, terminated, *_ = environments.step(policy.act(environments.task.split(observations)))
        assert not terminated.any()
        positions.append(environments.batch.data.qpos[0, :2].copy())
    task = environments.task.definition
    seconds = 0.5 * steps * task.scene.control_timestep
    velocity = (positions[-1] - positions[steps // 2]) / seconds
    return velocity / abs(task.target_velocity), rotations.yaw(environments.batch.data.qpos[:, 3:7])[0]


def test_four_legs_reach_their_speed_and_keep_their_course():
    body = registry.body_of(TIPPING)
    velocity, yaw = _walk(body, "straight", {})
    assert velocity == pytest.approx((1.0, 0.0), abs=0.06)
    assert abs(yaw) < 0.1
    open_loop, _ = _walk(body, "medium", {})
    assert open_loop[0] < 0.8


def test_a_negative_target_velocity_is_backwards():
    body = registry.body_of("varied:7")
    target = Setup.of(body, "walk").definition.target_velocity
    velocity, _ = _walk(body, "straight", {"target_velocity": -target})
    assert velocity == pytest.approx((-1.0, 0.0), abs=0.06)


@pytest.mark.parametrize("yaw", [0.4, -0.4])
def test_a_torso_that_has_turned_turns_back(yaw):
    body = registry.body_of("tick")
    environments = VectorEnv(body, "walk", 1)
    straight = law(environments.task.definition, presets_of(body)["straight"])
    turns = []
    for heading in (0.0, yaw):
        observations, _ = environments.reset(seed=1)
        blocks = {name: block.astype(float) for name, block in environments.task.split(observations).items()}
        turn = np.array((np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)))
        blocks["posture"][:, 1:5] = rotations.product(turn, blocks["posture"][:, 1:5])
        state, _ = straight(straight.initial(1), blocks)
        turns.append(state.steps.command[0, 2])
    assert (turns[1] - turns[0]) * yaw < 0.0
