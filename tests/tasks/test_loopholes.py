"""Rewards without loopholes: to follow the command is what pays, and to stay alive pays from the first step."""

import numpy as np
import pytest
from tiers import never, tiers

from arc_suite import evaluation, policies
from arc_suite.cpg.selection import suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.models.standing import standing
from arc_suite.robots import ROBOTS

SECONDS, COUNT = 8.0, 4  # of an episode, and how many
LANES = ("rough", "slopes", "stairs", "gaps", "course")
GROUNDS = [(robot, task) for robot in ROBOTS for task in ("steer", "roam", *LANES)]
EVERY = [*GROUNDS, *((robot, "navigate") for robot in ROBOTS)]
SAMPLE = {("queen", "navigate"), ("tick", "steer")}

# Ways to seem busy: commands (forward, left, turning) that a demonstrator follows in place of the task's.
BUSY = {
    "march": (0.02, 0.0, 0.0),
    "spin": (0.0, 0.0, 1.0),
    "drift": (0.0, 1.0, 0.0),
    "back away": (-1.0, 0.0, 0.0),
    "circle": (0.5, 0.0, 0.5),
}
METRICS = {"navigate": "goals", "steer": "tracking", "roam": "tracking"}  # else distance


class Busy:
    """The demonstrator `steered` with a command of its own."""

    def __init__(self, robot, task, command):
        self._policy = policies.policy("cpg", robot, ("steered",), task=task, num_envs=COUNT)
        self._command, self.reset = command, self._policy.reset

    def act(self, observation, rewards):
        command = observation["command"].copy()
        command[:, :3] = self._command
        return self._policy.act({**observation, "command": command}, rewards)


class Swaying:
    """Feet that stay down, and a torso that sways toward the goal slowly and back fast; actions are positions."""

    def __init__(self, task, share, forth, back):
        pose, self._step = standing(task.scene.body), 0
        self._legs = [np.linalg.pinv(jacobian)[:, :2] for jacobian in pose.jacobians]
        self._width, self._forth, self._back, self._reach = share * pose.height, forth, back, task.reach

    def reset(self, indices, seeds):
        pass

    def act(self, observation, rewards):
        step, self._step = self._step % (self._forth + self._back), self._step + 1
        phase = min(step / self._forth, 1.0 - (step - self._forth) / self._back)
        way = -self._width * (2.0 * phase - 1.0) * observation["goal"][:, :2]
        return np.concatenate([way @ leg.T for leg in self._legs], axis=-1) / self._reach


def opened(robot, task, **settings):
    settings = {"time_limit": SECONDS, **settings}
    return Setup.of(robot, task, settings).make_vec(COUNT, autoreset_mode="Disabled")


def earned(environment, policy):
    """The mean return and the mean metrics of some episodes."""
    episodes = evaluation.episodes_in_batch(environment, policy, range(COUNT))
    metrics = {name: np.mean([each.progress[name] for each in episodes]) for name in episodes[0].progress}
    return np.mean([each.total for each in episodes]), metrics


def standing_still(robot, task, **settings):
    environment = opened(robot, task, **settings)
    return earned(environment, policies.policy("zero", robot, task=environment.task.definition, num_envs=COUNT))[0]


@pytest.mark.parametrize(("robot", "task"), tiers(GROUNDS, lambda robot, task: task in ("steer", "stairs")))
def test_random_actions_earn_while_the_body_is_alive(robot, task):
    environment = opened(robot, task)
    policy = policies.policy("random", robot, task=environment.task.definition, num_envs=COUNT)
    episodes = evaluation.episodes_in_batch(environment, policy, range(COUNT))
    assert sum(each.total for each in episodes) >= 0.3 * sum(each.length for each in episodes)


@pytest.mark.parametrize(("robot", "task"), tiers(EVERY, never, lambda *case: case in SAMPLE))
def test_busy_bodies_earn_little(robot, task):
    environment, metric = opened(robot, task), METRICS.get(task, "distance")
    definition, still = environment.task.definition, standing_still(robot, task)
    suited = policies.policy("cpg", robot, (suited_preset(definition),), task=definition, num_envs=COUNT)
    best, well = earned(environment, suited)
    for name, command in BUSY.items():
        total, metrics = earned(environment, Busy(robot, definition, command))
        if metrics[metric] < 0.25 * well[metric]:
            assert total <= max(still + 0.5 * (best - still), still + 0.1 * definition.step_limit), name


@pytest.mark.parametrize("robot", tiers(ROBOTS, "queen".__eq__))
@pytest.mark.parametrize(("share", "forth", "back"), [(0.25, 16, 4), (0.45, 30, 3), (0.5, 24, 2)])
def test_swaying_earns_no_more_than_its_way(robot, share, forth, back):
    environment = opened(robot, "navigate", actions="position")
    definition = environment.task.definition
    total, metrics = earned(environment, Swaying(definition, share, forth, back))
    gain = total - standing_still(robot, "navigate", actions="position") - 10.0 * metrics["goals"]
    assert gain <= (2.5 * metrics["tracking"] + 0.1) * definition.step_limit
