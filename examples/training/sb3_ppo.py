"""Train PPO of stable-baselines3 in 64 environments, judge its checkpoints with arc-suite evaluate, and plot them.

    python examples/training/sb3_ppo.py --robot tick --steps 2000000
    arc-suite render --policy runs/sb3-ppo-tick/2007040.zip -o tick.mp4

The folder holds a zip, its statistics of VecNormalize and the evaluation (.json) of every checkpoint, and curve.png.
"""

import argparse
import pathlib

import gymnasium
import judging
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import arc_suite  # noqa: F401 (registers the ids)
from arc_suite.envs import sb3

ENVS, HORIZON = 64, 32

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--steps", type=int, default=1_000_000)
parser.add_argument("--checkpoints", type=int, default=10)
parser.add_argument("--episodes", type=int, default=10, help="of an evaluation")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--output", type=pathlib.Path, help="folder [default: runs/sb3-ppo-ROBOT]")
args = parser.parse_args()
folder = args.output or pathlib.Path(f"runs/sb3-ppo-{args.robot}")
folder.mkdir(parents=True, exist_ok=True)

vector = gymnasium.make_vec(f"arc_suite/{args.robot}-{args.task}-v0", num_envs=ENVS, autoreset_mode="SameStep")
environments = VecNormalize(sb3.VecEnv(vector), gamma=0.97)
agent = PPO(
    "MlpPolicy",
    environments,
    n_steps=HORIZON,
    batch_size=512,
    n_epochs=5,
    gamma=0.97,
    policy_kwargs={"net_arch": [256, 256], "log_std_init": -1.0},
    device="cpu",
    seed=args.seed,
)
for _ in range(args.checkpoints):
    agent.learn(args.steps // args.checkpoints, reset_num_timesteps=False)
    checkpoint = folder / f"{agent.num_timesteps}.zip"
    agent.save(checkpoint)
    environments.save(checkpoint.with_name(f"{checkpoint.stem}_vecnormalize.pkl"))
    judging.evaluate(checkpoint, args.robot, args.task, args.episodes)
judging.plot(folder, args.robot, args.task)
