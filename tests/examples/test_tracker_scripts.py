"""The script that hands metrics to MLflow, with a small module in its place, and the sweep."""

import contextlib
import pathlib
import runpy
import sys
import types

import pytest
import tiny_studies  # noqa: F401 (the module of an algorithm that needs NumPy alone)

pytest.importorskip("minari", reason="of the extra `learn`")

from arc_suite.learning.agents import run_folder

SCRIPTS = pathlib.Path(__file__).parents[2] / "examples" / "training"


class Tracker(types.ModuleType):
    """In place of `mlflow`: what it was given."""

    def __init__(self, name):
        super().__init__(name)
        self.logged, self.files = [], []

    def start_run(self, run_name):
        return contextlib.nullcontext(self)

    def set_experiment(self, name):
        pass

    def log_params(self, params):
        self.params = params

    def log_metrics(self, metrics, step):
        self.logged.append({"step": step, **metrics})

    def log_artifact(self, path, **settings):
        self.files.append(path)


def test_a_tracker_has_what_the_tables_have(monkeypatch, tmp_path):
    tracker = Tracker("mlflow")
    monkeypatch.setitem(sys.modules, "mlflow", tracker)
    arguments = ["--algorithm=tiny_studies:climb", "--steps=20", f"--output={tmp_path}"]
    monkeypatch.setattr(sys, "argv", ["mlflow_run.py", *arguments])
    runpy.run_path(str(SCRIPTS / "mlflow_run.py"), run_name="__main__")
    (last,) = (line for line in tracker.logged if "return" in line)
    assert last["return"] == pytest.approx(run_folder.table(tmp_path, "evaluations")["return"].mean())
    learned = [line for line in tracker.logged if "return" not in line]
    training = run_folder.table(tmp_path, "training")
    assert [line["earned"] for line in learned] == training["earned"].tolist()
    assert tracker.files == [str(tmp_path / "policy.npz")]


@pytest.mark.long
def test_a_sweep_goes_on(monkeypatch, tmp_path, capsys):
    pytest.importorskip("jax", reason="of the extra learn: make check-agents")
    optuna = pytest.importorskip("optuna", reason="make check-agents")
    monkeypatch.chdir(tmp_path)
    arguments = ["--trials=1", "--steps=2048", "--evaluate_every=2048", "--minutes=1"]
    monkeypatch.setattr(sys, "argv", ["optuna_sweep.py", *arguments])
    for _ in range(2):
        runpy.run_path(str(SCRIPTS / "optuna_sweep.py"), run_name="__main__")
    folder = tmp_path / "runs" / "sweep-tick-walk"
    study = optuna.load_study(study_name=folder.name, storage=f"sqlite:///{folder / 'sweep.db'}")
    assert len(study.trials) == 2 and f"best return {study.best_value:.1f}: " in capsys.readouterr().out
    for trial in study.trials:
        assert trial.value == run_folder.table(folder / str(trial.number), "evaluations")["return"].mean()
