"""Search hyperparameters of `ppo` with Optuna: every trial has the same minutes of CPU time, and earns a return.

    pip install -e '.[learn]' optuna==5.0.0
    python examples/training/optuna_sweep.py --robot tick --trials 20 --minutes 2

The same command goes on with the sweep. Several processes may run it at once: they share runs/sweep-ROBOT-TASK.
"""

import argparse
import pathlib

import optuna

from arc_suite import learning

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--robot", default="tick")
parser.add_argument("--task", default="walk")
parser.add_argument("--trials", type=int, default=20)
parser.add_argument("--minutes", type=float, default=2.0, help="of CPU time of a trial")
parser.add_argument("--steps", type=int, default=250_000, help="of a trial, at most; schedules of ppo span them")
parser.add_argument("--evaluate_every", type=int, default=25_000, help="steps; a trial that is worse there is pruned")
args = parser.parse_args()
folder = pathlib.Path(f"runs/sweep-{args.robot}-{args.task}")
folder.mkdir(parents=True, exist_ok=True)


def objective(trial):
    """Return the last return of a run."""
    hyperparameters = {
        "value_rate": trial.suggest_float("value_rate", 1e-4, 2e-3, log=True),
        "discount": trial.suggest_float("discount", 0.94, 0.99),
        "hidden": trial.suggest_categorical("hidden", [64, 128, 256]),
    }
    returns = {}

    def on_metrics(step, metrics):
        if "return" in metrics:
            returns[step] = metrics["return"]
            trial.report(returns[step], step)
            if trial.should_prune():
                raise optuna.TrialPruned

    run = {name: getattr(args, name) for name in ("robot", "task", "steps", "evaluate_every", "minutes")}
    place = folder / str(trial.number)
    learning.train(**run, hyperparameters=hyperparameters, folder=place, on_metrics=on_metrics)
    return returns[max(returns)]


storage = f"sqlite:///{folder / 'sweep.db'}"
study = optuna.create_study(storage=storage, study_name=folder.name, direction="maximize", load_if_exists=True)
study.optimize(objective, n_trials=args.trials)
print(f"best return {study.best_value:.1f}: {study.best_params}")
