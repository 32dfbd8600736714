"""Train by the suite's own learners, with metrics in MLflow: its local files, or the server of MLFLOW_TRACKING_URI.

pip install -e '.[learn]' mlflow==3.17.2
python examples/training/mlflow_run.py --robot tick
mlflow ui
"""

import argparse
import pathlib

import mlflow

from arc_suite import learning

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--algorithm", default="ppo")
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--steps", type=int, help="[default: the algorithm's]")
parser.add_argument("--minutes", type=float, help="of CPU time")
parser.add_argument("--output", type=pathlib.Path, help="folder [default: runs/ROBOT-TASK-ALGORITHM-SEED]")
args = parser.parse_args()
own = {"robot": args.robot, "task": args.task, "algorithm": args.algorithm, "seed": args.seed}
name = "-".join(map(str, own.values()))
folder = args.output or pathlib.Path("runs", name)

mlflow.set_experiment("arc_suite")
with mlflow.start_run(run_name=name):
    mlflow.log_params(own)
    learning.train(
        **own,
        steps=args.steps,
        minutes=args.minutes,
        folder=folder,
        on_metrics=lambda step, metrics: mlflow.log_metrics({key: float(metrics[key]) for key in metrics}, step=step),
    )
    mlflow.log_artifact(str(folder / "policy.npz"))
