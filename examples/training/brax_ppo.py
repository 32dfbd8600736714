"""Brax's PPO in worlds of MJX, by the wrapper of MuJoCo Playground.

pip install -e '.[gpu]' playground==0.2.0 brax==0.14.2
python examples/training/brax_ppo.py --robot queen --worlds 4096 --steps 50000000
"""

import argparse

import jax
import jax.numpy as jnp

# Brax 0.14.2 calls a function that JAX 0.10 has removed.
jax.device_put_replicated = lambda tree, devices: jax.tree.map(lambda leaf: jnp.stack([leaf] * len(devices)), tree)

from brax.training.agents.ppo import train as ppo  # noqa: E402
from mujoco_playground import wrapper  # noqa: E402

from arc_suite.learning.worlds import mjx  # noqa: E402


def main():
    """Train, and print the reward of each evaluation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="queen")
    parser.add_argument("--task", default="walk")
    parser.add_argument("--worlds", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=50_000_000)
    parser.add_argument("--unroll", type=int, default=16, help="control steps of each world between updates")
    parser.add_argument("--evaluations", type=int, default=10)
    parser.add_argument("--episode_length", type=int, default=1000)
    given = parser.parse_args()

    env = mjx.load(given.robot, given.task, num_envs=given.worlds)
    ppo.train(
        environment=env,
        wrap_env_fn=wrapper.wrap_for_brax_training,
        num_timesteps=given.steps,
        num_evals=given.evaluations,
        episode_length=given.episode_length,
        num_envs=given.worlds,
        num_eval_envs=min(given.worlds, 128),
        unroll_length=given.unroll,
        num_minibatches=min(given.worlds, 32),
        batch_size=max(given.worlds // 32, 1),
        num_updates_per_batch=4,
        discounting=0.97,
        learning_rate=3e-4,
        normalize_observations=True,
        progress_fn=lambda step, metrics: print(step, float(metrics["eval/episode_reward"])),
    )


if __name__ == "__main__":
    main()
