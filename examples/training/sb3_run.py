"""What the scripts of stable-baselines3 share: flags, environments, and training with checkpoints that are judged."""

import argparse
import pathlib

import gymnasium
import judging
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

import arc_suite  # noqa: F401 (registers the ids)
from arc_suite.envs import sb3


def parse_arguments(description: str, steps: int, folder: str) -> argparse.Namespace:
    """Return the arguments of the command line, with the folder of the output.

    Args:
        description: text of `--help`.
        steps: environment steps by default.
        folder: folder by default, which may contain {robot} and {task}.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    parser.add_argument("--steps", type=int, default=steps)
    parser.add_argument("--checkpoints", type=int, default=3)
    parser.add_argument("--episodes", type=int, default=10, help="of an evaluation")
    parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
    default_folder = folder.format(robot="ROBOT", task="TASK")
    parser.add_argument("--output", type=pathlib.Path, help=f"folder [default: {default_folder}]")
    args = parser.parse_args()
    args.output = args.output or pathlib.Path(folder.format(robot=args.robot, task=args.task))
    return args


def make_environments(args: argparse.Namespace, num_envs: int, **options) -> VecNormalize:
    """Return environments whose observations and rewards are normalized; for the options see `VecNormalize`."""
    vector = gymnasium.make_vec(f"arc_suite/{args.robot}-{args.task}-v0", num_envs=num_envs, autoreset_mode="SameStep")
    return VecNormalize(sb3.VecEnv(vector), **options)


def train(agent: BaseAlgorithm, environments: VecNormalize, args: argparse.Namespace) -> None:
    """Train, save and judge checkpoints, and plot their returns."""
    args.output.mkdir(parents=True, exist_ok=True)
    for _ in range(args.checkpoints):
        agent.learn(args.steps // args.checkpoints, reset_num_timesteps=False)
        checkpoint = args.output / f"{agent.num_timesteps}.zip"
        agent.save(checkpoint)
        environments.save(checkpoint.with_name(f"{checkpoint.stem}_vecnormalize.pkl"))
        judging.evaluate(checkpoint, args.robot, args.task, args.episodes)
    judging.plot(args.output, args.robot, args.task)
