"""Checks the Gymnasium environments with stable-baselines3: its own checker, and a short SAC run.

    python tools/check_sb3.py --steps 500

Prints a line for each id and exits with status 1 if a check fails or the checker warns.
"""

import time
import warnings

import gymnasium
import numpy as np
from absl import flags
from stable_baselines3 import SAC
from stable_baselines3.common.env_checker import check_env

import arc_suite
from arc_suite import registry
from arc_suite.cli import program

_STEPS = flags.DEFINE_integer("steps", 500, "Environment steps of the SAC run.", lower_bound=200)
_ROBOT = flags.DEFINE_enum("robot", "queen", list(arc_suite.TASKS_BY_DOMAIN), "Who learns in the SAC run.")

_LEARNING_STARTS = 100


def check(env_id: str) -> str:
    """Runs stable-baselines3's checker on an id; returns its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(gymnasium.make(env_id), warn=True)
    return "; ".join(str(warning.message) for warning in caught)


def train(env_id: str) -> str:
    """Trains SAC for some steps; returns what is wrong with the outcome."""
    env = gymnasium.make(env_id)
    agent = SAC("MlpPolicy", env, learning_starts=_LEARNING_STARTS, seed=0, device="cpu")
    agent.learn(_STEPS.value)
    action, _ = agent.predict(env.reset(seed=0)[0], deterministic=True)
    learned = agent.num_timesteps >= _STEPS.value and np.isfinite(action).all() and action in env.action_space
    return "" if learned else f"after {agent.num_timesteps} steps the action is {action}"


def main() -> int:
    """Prints a line for each check; returns the exit status."""
    ids = [registry.env_id(robot, registry.task_of(task)) for robot, task in arc_suite.ALL_TASKS]
    jobs = [("check_env", check, env_id) for env_id in ids]
    jobs.append((f"SAC {_STEPS.value} steps", train, f"arc_suite/{_ROBOT.value}-walk-v0"))
    failed = False
    for name, job, env_id in jobs:
        start = time.perf_counter()
        try:
            problem = job(env_id)
        except Exception as error:  # the checker asserts, and an environment may raise anything
            problem = f"{type(error).__name__}: {error}"
        failed |= bool(problem)
        print(f"{env_id:28}{name:18}{time.perf_counter() - start:6.1f} s  {problem or 'ok'}", flush=True)
    return int(failed)


if __name__ == "__main__":
    program.run(main)
