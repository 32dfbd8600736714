"""The same bits everywhere: `python tests/determinism.py` prints digests of 500 steps of every robot and task.

One of the observations and one of the rewards, of a single environment and of one among others,
on each number of threads given (1, 2 and 8 by default); `--steps 100` is quicker, with digests of its own.
"""

import argparse
import hashlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import gymnasium
import numpy as np

import arc_suite
from arc_suite import registry

INDEX, SEED = 1, 40  # the environment that is looked at, and its seed

Step = tuple[np.ndarray, float | None]  # observation and reward; a reset of the environment has none


class Digests(NamedTuple):
    """The beginnings of two sha256."""

    observations: str
    rewards: str


def actions(robot: str, steps: int) -> np.ndarray:
    """Return actions (steps, motors) float32, strong enough to fall now and then."""
    motors = len(registry.body_of(robot).joint_names)
    return np.random.RandomState(1).uniform(-1.0, 1.0, (steps, motors)).astype(np.float32)


def digests(steps: Iterable[Step]) -> Digests:
    """Digest the steps of an environment."""
    observations, rewards = hashlib.sha256(), hashlib.sha256()
    for observation, reward in steps:
        observations.update(observation.tobytes())
        if reward is not None:
            rewards.update(np.float64(reward).tobytes())
    return Digests(observations.hexdigest()[:16], rewards.hexdigest()[:16])


def env_id(robot: str, task: str) -> str:
    """Return Gymnasium's id."""
    return registry.env_id(robot, registry.task_of(task))


def single(robot: str, task: str, steps: int) -> Iterator[Step]:
    """Step a single environment that is reset when an episode ends."""
    env = gymnasium.make(env_id(robot, task))
    yield env.reset(seed=SEED)[0], None
    ended = False
    for action in actions(robot, steps):
        if ended:  # as vector environments do
            observation, reward, ended = env.reset()[0], 0.0, False
        else:
            observation, reward, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
        yield observation, reward
    env.close()


def batched(robot: str, task: str, threads: int, steps: int) -> Iterator[Step]:
    """Step three environments, and show one of them."""
    envs = gymnasium.make_vec(env_id(robot, task), num_envs=3, num_threads=threads)
    yield envs.reset(seed=SEED - INDEX)[0][INDEX], None
    for action in actions(robot, steps):
        observations, rewards, *_ = envs.step(np.stack([action] * 3))
        yield observations[INDEX], rewards[INDEX]
    envs.close()


def main() -> None:
    """Prints a line for each robot, task and way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("threads", type=int, nargs="*", default=[1, 2, 8])
    parser.add_argument("--steps", type=int, default=500)
    given = parser.parse_args()
    print(f"{'robot':<10}{'task':<10}{'way':<18}{'observations':<18}rewards")
    for robot, task in arc_suite.ALL_TASKS:
        ways = {"single": single(robot, task, given.steps)}
        ways |= {f"batch, threads={count}": batched(robot, task, count, given.steps) for count in given.threads}
        for way, episode in ways.items():
            found = digests(episode)
            print(f"{robot:<10}{task:<10}{way:<18}{found.observations:<18}{found.rewards}", flush=True)


if __name__ == "__main__":
    main()
