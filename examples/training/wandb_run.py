"""Train by the suite's own learners, with metrics at Weights & Biases; without an account offline, into ./wandb.

    pip install -e '.[learn]' wandb==0.31.0
    python examples/training/wandb_run.py --robot tick --mode offline

The same command resumes a run that was interrupted, here and there.
"""

import argparse
import pathlib

import wandb

from arc_suite import learning

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--algorithm", default="ppo")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--steps", type=int, help="[default: the algorithm's]")
parser.add_argument("--minutes", type=float, help="of CPU time")
parser.add_argument("--mode", default="online", choices=["online", "offline"])
parser.add_argument("--output", type=pathlib.Path, help="folder [default: runs/ROBOT-TASK-ALGORITHM-SEED]")
args = parser.parse_args()
own = {"robot": args.robot, "task": args.task, "algorithm": args.algorithm, "seed": args.seed}
name = "-".join(map(str, own.values()))
folder = args.output or pathlib.Path("runs", name)

with wandb.init(project="arc_suite", name=name, id=name, resume="allow", config=own, mode=args.mode) as run:

    def on_metrics(step, metrics):
        run.log({"step": step, **metrics})

    run.define_metric("*", step_metric="step")  # a resumed run may repeat steps, which W&B's own counter refuses
    learning.train(**own, steps=args.steps, minutes=args.minutes, folder=folder, on_metrics=on_metrics)
    run.save(str(folder / "policy.npz"), base_path=str(folder), policy="now")
