"""Train PPO of stable-baselines3 as RL Baselines3 Zoo does for MuJoCo's Ant, and judge it with arc-suite evaluate.

    python examples/training/sb3_ppo.py --robot tick --task steer
    arc-suite render --policy runs/sb3-ppo-tick-steer/1001472.zip -o tick.mp4

The hyperparameters are the library's defaults, with observations and rewards normalized. The folder holds a zip, its
statistics of VecNormalize and the evaluation (.json) of every checkpoint, and curve.png.
"""

import argparse
import pathlib

import gymnasium
import judging
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import arc_suite  # noqa: F401 (registers the ids)
from arc_suite.envs import sb3

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--steps", type=int, default=1_000_000)
parser.add_argument("--checkpoints", type=int, default=3)
parser.add_argument("--episodes", type=int, default=10, help="of an evaluation")
parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
parser.add_argument("--output", type=pathlib.Path, help="folder [default: runs/sb3-ppo-ROBOT-TASK]")
args = parser.parse_args()
folder = args.output or pathlib.Path(f"runs/sb3-ppo-{args.robot}-{args.task}")
folder.mkdir(parents=True, exist_ok=True)

vector = gymnasium.make_vec(f"arc_suite/{args.robot}-{args.task}-v0", num_envs=1, autoreset_mode="SameStep")
environments = VecNormalize(sb3.VecEnv(vector))
agent = PPO("MlpPolicy", environments, n_steps=min(2048, args.steps), device="cpu", seed=args.seed)
for _ in range(args.checkpoints):
    agent.learn(args.steps // args.checkpoints, reset_num_timesteps=False)
    checkpoint = folder / f"{agent.num_timesteps}.zip"
    agent.save(checkpoint)
    environments.save(checkpoint.with_name(f"{checkpoint.stem}_vecnormalize.pkl"))
    judging.evaluate(checkpoint, args.robot, args.task, args.episodes)
judging.plot(folder, args.robot, args.task)
