"""Train SAC of SBX, stable-baselines3 in JAX, judge it with arc-suite evaluate, and plot it over the paper's returns.

    cd examples/training
    python sbx_sac.py --robot tick --steps 100000
    arc-suite evaluate --robot tick --policy sbx_sac:make

The file of SBX holds networks of JAX, which arc-suite does not read; `make` is the function that makes a policy of it.
It reads the .sbx of the module's name next to it. A folder of the benchmark takes each .zip for one of
stable-baselines3.
"""

import argparse
import functools
import pathlib

import gymnasium
import numpy as np
from sbx import SAC

import arc_suite  # noqa: F401 (registers the ids)
from arc_suite.envs import sb3

ENVS = 16


def make(robot):
    """Return the function from a time step to the deterministic action."""
    agent = _load()

    def act(timestep):
        observation = np.concatenate(list(timestep.observation.values()), dtype=np.float32)
        return agent.predict(observation, deterministic=True)[0]

    return act


@functools.cache
def _load() -> SAC:
    return SAC.load(pathlib.Path(__file__).with_suffix(".sbx"))


def main():
    """Train and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
    parser.add_argument("--output", type=pathlib.Path, default="sbx_sac.sbx")
    args = parser.parse_args()
    vector = gymnasium.make_vec(f"arc_suite/{args.robot}-{args.task}-v0", num_envs=ENVS, autoreset_mode="SameStep")
    # As many updates as environment steps, as in the paper's SAC.
    agent = SAC("MlpPolicy", sb3.VecEnv(vector), gradient_steps=ENVS, learning_starts=1000, seed=args.seed)
    agent.learn(args.steps)
    agent.save(args.output)


if __name__ == "__main__":
    main()
