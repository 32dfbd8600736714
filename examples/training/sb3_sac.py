"""Train SAC of stable-baselines3 in 32 environments, judge its checkpoints with arc-suite evaluate, and plot them.

    python examples/training/sb3_sac.py --robot tick
    arc-suite render --policy runs/sb3-sac-tick/150048.zip -o tick.mp4

The folder holds a zip, its statistics of VecNormalize and the evaluation (.json) of every checkpoint, and curve.png.
The hyperparameters are those of the suite's own `sac_parallel`, where SAC has them.
"""

import argparse
import pathlib

import gymnasium
import judging
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecNormalize

import arc_suite  # noqa: F401 (registers the ids)
from arc_suite.envs import sb3

ENVS, GAMMA = 32, 0.97

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--steps", type=int, default=150_000)
parser.add_argument("--checkpoints", type=int, default=3)
parser.add_argument("--episodes", type=int, default=10, help="of an evaluation")
parser.add_argument("--seed", type=int, default=100_000, help="evaluation plays seeds below 10,000")
parser.add_argument("--output", type=pathlib.Path, help="folder [default: runs/sb3-sac-ROBOT]")
args = parser.parse_args()
folder = args.output or pathlib.Path(f"runs/sb3-sac-{args.robot}")
folder.mkdir(parents=True, exist_ok=True)

vector = gymnasium.make_vec(f"arc_suite/{args.robot}-{args.task}-v0", num_envs=ENVS, autoreset_mode="SameStep")
environments = VecNormalize(sb3.VecEnv(vector), gamma=GAMMA)
agent = SAC(
    "MlpPolicy",
    environments,
    learning_rate=5e-4,
    gamma=GAMMA,
    tau=0.01,
    n_steps=3,
    train_freq=1,
    gradient_steps=12,
    learning_starts=640,
    ent_coef="auto_0.003",
    target_entropy=-0.6 * vector.single_action_space.shape[0],
    buffer_size=200_000,
    policy_kwargs={"net_arch": [256, 256]},
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
