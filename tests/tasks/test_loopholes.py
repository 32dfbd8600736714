"""Rewards without loopholes: to follow the command is what pays, and to stay alive pays from the first step."""

import numpy as np
import pytest
from exploits import FAILURE, METRICS, Disobedient, Exploit, Exploiting, earned, limits, opened
from tiers import never, tiers

from arc_suite import evaluation, policies
from arc_suite.robots import ROBOTS

SEEDS = (0, 1, 2, 3)
LANES = ("rough", "slopes", "stairs", "gaps", "course")
GROUNDS = [(robot, task) for robot in ROBOTS for task in ("steer", "directed", "roam", *LANES)]
EVERY = [*GROUNDS, *((robot, "navigate") for robot in ROBOTS)]

# Ways to seem busy: commands (forward, left, turning) that a demonstrator follows in place of the task's.
BUSY = {
    "march": (0.02, 0.0, 0.0),
    "spin": (0.0, 0.0, 1.0),
    "drift": (0.0, 1.0, 0.0),
    "back away": (-1.0, 0.0, 0.0),
    "circle": (0.5, 0.0, 0.5),
}


@pytest.mark.parametrize(("robot", "task"), tiers(GROUNDS, lambda robot, task: task in ("steer", "stairs")))
def test_random_actions_earn_while_the_body_is_alive(robot, task):
    environment = opened(robot, task, len(SEEDS))
    policy = policies.policy("random", robot, task=environment.task.definition, num_envs=len(SEEDS))
    episodes = evaluation.episodes_in_batch(environment, policy, SEEDS)
    assert sum(each.total for each in episodes) >= 0.3 * sum(each.length for each in episodes)


@pytest.mark.parametrize(("robot", "task"), tiers(EVERY, never, lambda *case: case == ("tick", "steer")))
def test_busy_bodies_earn_little(robot, task):
    exploits = [Exploit(*command, effort=1.0) for command in BUSY.values() for _ in SEEDS]
    environment = opened(robot, task, len(exploits), actions="position")
    totals, metrics = earned(environment, Exploiting(environment.task.definition, exploits), SEEDS * len(BUSY))
    limit, metric = limits(robot, task, SEEDS, actions="position"), METRICS.get(task, "distance")
    for name, total, reached in zip(
        BUSY, *(np.reshape(each, (len(BUSY), -1)).mean(axis=-1) for each in (totals, metrics[metric])), strict=True
    ):
        if reached < FAILURE * limit.metric:
            assert total <= limit.standing + limit.gain, name


def _told(blocks, **changes):
    """The blocks of a command, some of whose first numbers are those of another."""
    return {name: np.concatenate([told, blocks[name][:, told.shape[-1] :]], axis=-1) for name, told in changes.items()}


def _late(seen, steps=100):
    earlier = seen[max(0, len(seen) - 1 - steps)]
    return _told(seen[-1], command=earlier["command"][:, :3], pose=earlier["pose"])


# What a demonstrator is told in place of the task's direction, and most that it may earn of the demonstrator's gain.
DISOBEDIENT = {
    "no pose": (lambda seen: _told(seen[-1], pose=0.0 * seen[-1]["pose"]), 0.5),
    "another gait": (lambda seen: _told(seen[-1], gait=-seen[-1]["gait"][:, :-2]), 0.5),
    "late": (_late, 0.5),
    "stands": (lambda seen: _told(seen[-1], command=0.0 * seen[-1]["command"][:, :3]), 0.5),
    "away": (lambda seen: _told(seen[-1], command=-seen[-1]["command"][:, :3]), 0.5),
    # It obeys half of the time, and all of it where the command is a stop.
    "blinks": (lambda seen: _told(seen[-1], command=(len(seen) // 20 % 2) * seen[-1]["command"][:, :3]), 0.75),
}


@pytest.mark.parametrize(
    "robot",
    [pytest.param(robot, marks=pytest.mark.long if robot == "tick" else pytest.mark.release) for robot in ROBOTS],
)
def test_disobedience_earns_less_than_half(robot):
    environment = opened(robot, "directed", 2 * len(SEEDS))
    task, seeds = environment.task.definition, range(2 * len(SEEDS))
    limit = limits(robot, "directed", seeds)
    for name, (told, most) in DISOBEDIENT.items():
        total = earned(environment, Disobedient(task, told), seeds)[0].mean()
        assert total - limit.standing <= 2.0 * most * limit.gain, name


@pytest.mark.parametrize("robot", tiers(ROBOTS, "queen".__eq__))
@pytest.mark.parametrize(
    ("share", "forth", "back"), tiers([(0.25, 16, 4), (0.45, 30, 3), (0.5, 24, 2)], lambda *sway: sway[0] == 0.25)
)
def test_swaying_earns_no_more_than_its_distance(robot, share, forth, back):
    environment = opened(robot, "navigate", len(SEEDS), actions="position")
    sway = Exploit(ahead=share, period=forth + back, forth=forth / (forth + back))
    totals, metrics = earned(environment, Exploiting(environment.task.definition, [sway] * len(SEEDS)), SEEDS)
    still = limits(robot, "navigate", SEEDS, actions="position").standing
    gain = totals.mean() - still - 10.0 * metrics["goals"].mean()
    assert gain <= (2.5 * metrics["tracking"].mean() + 0.1) * environment.step_limit
