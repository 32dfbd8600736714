"""Train PPO of stable-baselines3 as RL Baselines3 Zoo does for MuJoCo's Ant, and judge it with arc-suite evaluate.

    python examples/training/sb3_ppo.py --robot tick --task steer
    arc-suite render --policy runs/sb3-ppo-tick-steer/1001472.zip -o tick.mp4

The hyperparameters are the library's defaults, with one environment and observations and rewards normalized: the set
of Ant-v4 in https://github.com/DLR-RM/rl-baselines3-zoo/blob/master/hyperparams/ppo.yml. The folder holds a zip, its
statistics of VecNormalize and the evaluation (.json) of every checkpoint, and curve.png.
"""

import sb3_run
from stable_baselines3 import PPO

args = sb3_run.parse_arguments(__doc__, steps=1_000_000, folder="runs/sb3-ppo-{robot}-{task}")
environments = sb3_run.make_environments(args, num_envs=1)
agent = PPO("MlpPolicy", environments, n_steps=min(2048, args.steps), device="cpu", seed=args.seed)
sb3_run.train(agent, environments, args)
