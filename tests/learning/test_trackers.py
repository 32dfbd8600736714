"""What Weights & Biases is given, with a small module in its place."""

import sys
import types

import pytest
import tiny_studies  # noqa: F401 (the module of an algorithm that needs NumPy alone)

from arc_suite.envs.setup import Setup
from arc_suite.learning import trackers
from arc_suite.learning.agents.configuration import Configuration


class Board(types.ModuleType):
    """In place of wandb and its runs."""

    def __init__(self):
        super().__init__("wandb")
        self.calls = []

    def init(self, **settings):
        self.calls.append(settings)
        return self

    def define_metric(self, name, step_metric):
        self.calls.append((name, step_metric))

    def log(self, metrics):
        self.calls.append(metrics)

    def finish(self):
        self.calls.append("finish")


@pytest.fixture
def run():
    return Configuration.of(Setup.of("tick"), "tiny_studies:climb", steps=20)


def test_metrics_go_to_weights_and_biases_from_the_first_on(run, tmp_path, monkeypatch):
    board = Board()
    monkeypatch.setitem(sys.modules, "wandb", board)
    monkeypatch.setenv("WANDB_PROJECT", "legs")
    with trackers.open_wandb(run, tmp_path) as listen:
        assert board.calls == []  # a refused run makes none
        listen(64, {"return": 3.0})
        listen(128, {"loss": 0.5})
    settings, *calls = board.calls
    assert calls == [("*", "step"), {"step": 64, "return": 3.0}, {"step": 128, "loss": 0.5}, "finish"]
    assert settings["project"] == "legs" and settings["name"] == tmp_path.name and settings["resume"] == "allow"
    assert settings["config"]["algorithm"] == "tiny_studies:climb" and "body_sha256" in settings["config"]
    with trackers.open_wandb(run, tmp_path) as listen:
        listen(192, {"loss": 0.4})
    assert board.calls[len(calls) + 1]["id"] == settings["id"]  # goes on with the same run


def test_without_the_package_one_line_says_what_to_install(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "wandb", None)
    tracker = trackers.open_wandb(run, tmp_path)
    with pytest.raises(ValueError, match="^--wandb needs wandb: pip install wandb"), tracker:
        pass
