"""Train SAC of stable-baselines3 in 32 environments, judge its checkpoints with arc-suite evaluate, and plot them.

    python examples/training/sb3_sac.py --robot tick
    arc-suite render --policy runs/sb3-sac-tick-walk/150048.zip -o tick.mp4

The folder holds a zip, its statistics of VecNormalize and the evaluation (.json) of every checkpoint, and curve.png.
The hyperparameters are those of the suite's own `sac_parallel`, where SAC has them.
"""

import sb3_run
from stable_baselines3 import SAC

ENVS, GAMMA = 32, 0.97

args = sb3_run.parse_arguments(__doc__, steps=150_000, folder="runs/sb3-sac-{robot}-{task}")
environments = sb3_run.make_environments(args, ENVS, gamma=GAMMA)
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
    target_entropy=-0.6 * environments.action_space.shape[0],
    buffer_size=200_000,
    policy_kwargs={"net_arch": [256, 256]},
    device="cpu",
    seed=args.seed,
)
sb3_run.train(agent, environments, args)
