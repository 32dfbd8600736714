"""The same bits everywhere: `python tests/determinism.py` prints a digest of 500 steps of each robot.

Once as a single environment and once as a row among others, for each number of threads given.
"""

import hashlib
import sys

import gymnasium
import numpy as np

import arc_suite

STEPS = 500
ROW, SEED = 1, 40  # the row that is looked at, and its seed


def actions(robot: str) -> np.ndarray:
    """Strong enough to fall now and then: (steps, motors) float32."""
    size = arc_suite.load(robot, "walk").action_spec().shape
    return np.random.RandomState(1).uniform(-1.0, 1.0, (STEPS, *size)).astype(np.float32)


def single(robot: str) -> str:
    """The sha256 of observations and rewards of a single environment that is reset when an episode ends."""
    env = gymnasium.make(f"arc_suite/{robot}-walk-v0")
    digest = hashlib.sha256(env.reset(seed=SEED)[0].tobytes())
    ended = False
    for action in actions(robot):
        if ended:  # as rows of a vector environment do
            observation, reward, ended = env.reset()[0], 0.0, False
        else:
            observation, reward, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
        digest.update(observation.tobytes() + np.float64(reward).tobytes())
    return digest.hexdigest()


def row(robot: str, threads: int) -> str:
    """The same of one of three rows."""
    envs = gymnasium.make_vec(f"arc_suite/{robot}-walk-v0", num_envs=3, num_threads=threads)
    digest = hashlib.sha256(envs.reset(seed=SEED - ROW)[0][ROW].tobytes())
    for action in actions(robot):
        observations, rewards, *_ = envs.step(np.stack([action] * 3))
        digest.update(observations[ROW].tobytes() + np.float64(rewards[ROW]).tobytes())
    envs.close()
    return digest.hexdigest()


def main() -> None:
    """Prints a line for each robot and way."""
    threads = [int(argument) for argument in sys.argv[1:]] or [1, 2, 8]
    for robot in arc_suite.TASKS_BY_DOMAIN:
        print(robot, "single", single(robot))
        for count in threads:
            print(robot, f"row on {count} threads", row(robot, count))


if __name__ == "__main__":
    main()
