"""The rule of what counts as walking: speed as a share of the target, no fall, no dragging."""

import math

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite import evaluation
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import walking


def definition(task, **settings):
    return Setup.of("tick", task, settings).definition


@pytest.mark.parametrize("velocity", [0.3, -0.3])
def test_the_target_of_a_walk_is_along_x_whatever_the_heading(velocity):
    task = definition("walk", target_velocity=velocity)
    target = walking.target(task, {}, np.array((1.0, 2.0, 0.5)))
    assert target == pytest.approx((velocity * task.scene.control_timestep, 0.0))


def test_a_command_is_as_the_torso_heads_and_in_units_of_the_target_velocity():
    task = definition("steer", target_velocity=0.4)
    blocks = {"command": np.array((0.5, 0.25, 1.0, 9.0, 9.0, 9.0))}
    target = walking.target(task, blocks, np.array((1.0, 2.0, math.pi / 2.0))) / task.scene.control_timestep
    assert target == pytest.approx((-0.1, 0.2))
    with refused("task steer: expected one that observes a command or has a target velocity"):
        walking.target(task, {}, np.zeros(3))


def test_shares_are_those_of_the_target_path():
    targets = np.array([(0.0, 2.0)] * 3 + [(-1.0, 0.0)] * 2)
    assert walking.shares(targets, targets, 5) == (1.0, 0.0)
    assert walking.shares(targets, -0.5 * targets, 5) == (-0.5, 0.0)
    assert walking.shares(targets, targets, 10) == (0.5, 0.0), "a body that has fallen rests"
    left = targets[:, ::-1] * (-1.0, 1.0)
    assert walking.shares(targets, targets + 0.25 * left, 5) == (1.0, 0.25)
    assert walking.shares(0.0 * targets, targets, 5) == (1.0, 0.0), "all stops"


@pytest.mark.parametrize(
    ("motion", "reasons"),
    [
        ((0.7, 0.0), ()),
        ((1.4, 0.009), ()),
        ((0.69, 0.0), ("slow",)),
        ((-1.0, 0.0), ("slow",)),
        ((math.nan, 0.0), ("slow",)),
        ((1.0, 0.01), ("touch",)),
        ((0.9, 0.0, "fall"), ("fall",)),
        ((0.1, 0.5, "divergence"), ("divergence", "touch", "slow")),
    ],
)
def test_failures(motion, reasons):
    assert walking.failures(*motion) == reasons


def test_a_tilted_or_terminated_body_has_fallen():
    tilts = np.radians([0.0, 59.0, 61.0, 180.0])
    quaternions = np.stack([np.cos(tilts / 2.0), np.sin(tilts / 2.0), 0.0 * tilts, 0.0 * tilts], axis=-1)
    assert walking.has_fallen(np.zeros(4, bool), quaternions).tolist() == [False, False, True, True]
    assert walking.has_fallen(True, quaternions[0])


def test_a_demonstrator_is_seen_to_walk():
    environment = arc_suite.load("tick", "walk", {"time_limit": 6.0})
    watcher = walking.WalkWatcher(environment)
    episode = evaluation.run(environment, Demonstrator(environment, "medium"), 0, watchers=[watcher])
    verdict = watcher.verdict(episode.length)
    assert verdict.walks and not verdict.fell and verdict.touching == 0.0
    assert (watcher.ending, watcher.length) == (walking.TIME, 120)
    target = environment.task.definition.target_velocity
    assert verdict.speed * target == pytest.approx(episode.progress["speed"], rel=0.01)
    assert watcher.verdict(2 * episode.length).failures == ("slow",), "as if it had rested as long"


def test_steps_after_a_fall_do_not_count():
    environment = arc_suite.load("tick", "walk", {"time_limit": 4.0, "healthy_range": (0.0, 1.0)})
    watcher, data = walking.WalkWatcher(environment), environment.physics.data

    def capsize(timestep):
        if watcher.length == 20:
            data.qpos[2:7] = (0.5 * data.qpos[2], 0.0, 1.0, 0.0, 0.0)  # onto its back

    steps = evaluation.run(environment, Demonstrator(environment, "medium"), 0, watchers=[watcher, capsize]).length
    verdict = watcher.verdict(steps)
    assert (watcher.ending, watcher.length, steps) == (walking.FALL, 21, 80)
    assert verdict.fell and verdict.failures == ("fall", "slow")


def test_a_divergence_ends_a_walk():
    environment = arc_suite.load("tick", "walk")
    watcher = walking.WalkWatcher(environment)
    for timestep in evaluation.rollout(environment, Demonstrator(environment, "medium"), 0, max_steps=8):
        watcher(timestep)
    watcher.note_divergence()
    assert watcher.length == 9 and watcher.verdict(100).failures == ("divergence", "slow")
