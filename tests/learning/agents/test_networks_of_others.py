"""Networks that another package registers: the guide's learns, and what is none is refused."""

import re

import pytest

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

import programs
from conftest import learning
from interpreters import ROOT
from refusals import refused

from arc_suite import registry
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import architectures
from arc_suite.learning.agents.architectures import Perceptron
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.policies import network

GUIDE = (ROOT / "docs" / "doors.md").read_text()
(DEEPENING,) = (text for text in re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL) if "class Deep" in text)
TRAIN, EVALUATE, AGAIN = re.findall(r"^arc-suite .*(?:deep\b|deepening).*$", GUIDE, re.MULTILINE)
SHORT = ("--hp=num_envs=4", "--hp=horizon=16", "--hp=minibatch=32", "--steps=128", "--evaluate_every=64")


@pytest.fixture
def networks(monkeypatch):
    """Return the table of networks of other packages, empty for the test."""
    monkeypatch.setitem(registry.ADDITIONS, "network", {})
    return registry.ADDITIONS["network"]


@pytest.mark.release
def test_guide(tmp_path):
    """A network of another package learns, plays without its package, and is learned from again."""
    (tmp_path / "deepening.py").write_text(DEEPENING)
    run = lambda command, *flags: programs.run(*command.split(), *flags, cwd=tmp_path)  # noqa: E731
    done = run(TRAIN, *SHORT, "--set=time_limit=1")
    assert done.returncode == 0 and "runs/deep: finished, return " in done.stdout, done.stderr
    assert sum(node.operator == "Linear" for node in network.load(tmp_path / "runs" / "deep").graph.nodes) == 5
    done = run(AGAIN)
    assert done.returncode == 0 and "runs/again: finished, return " in done.stdout, done.stderr
    first, again = ((tmp_path / "runs" / name / "evaluations.csv").read_bytes() for name in ("deep", "again"))
    assert first == again
    start = ("--algorithm=finetune", "--hp=start=runs/deep", "--hp=value_warm_up=0", "--set=time_limit=1")
    done = run(TRAIN.replace("runs/deep", "runs/tuned"), *SHORT, *start)
    assert done.returncode == 0 and "runs/tuned: finished, return " in done.stdout, done.stderr
    to_perceptron = TRAIN.replace("runs/deep", "runs/other").replace("network=deepening:deep", "network=perceptron")
    done = run(to_perceptron, *SHORT, *start)
    assert done.stderr == "arc-suite train: runs/deep: expected the 6 arrays of a perceptron, got 10\n"
    (tmp_path / "deepening.py").unlink()
    assert "\ntick " in programs.passed(run(EVALUATE, "--episodes=1"))


def test_a_function_that_makes_no_architecture_is_one_line(networks):
    networks.update(mine=lambda task, critic_blocks, symmetric: 3, lost="nowhere:Deep.of", half=Half.of)
    task = Setup.of("tick").definition
    with refused("network 'mine': has no symmetric and no size and no action_inputs and ", begins=True):
        architectures.of(task, "mine")
    with refused("network 'lost': cannot import 'nowhere:Deep.of': No module named 'nowhere'; start ", begins=True):
        architectures.of(task, "lost")
    names = "(there are: perceptron, legs, mine, lost, half, module:name to import it)"
    with refused(f"unknown network 'lost_'; did you mean 'lost'? {names}"):
        architectures.of(task, "lost_")


def test_networks_of_equal_sizes_are_different_values(networks):
    """JAX compiles once for equal ones."""
    networks.update(half=Half.of)
    task = Setup.of("tick").definition
    half, whole = architectures.of(task, "half"), architectures.of(task)
    assert half != whole and half == architectures.of(task, "half")


def test_mirrored_copies_fill_a_minibatch(networks, tmp_path):
    """Transitions are doubled for a network that does not treat left and right alike, such as that of a package."""
    networks.update(half=Half.of)
    changes = {"network": "half", "num_envs": 2, "horizon": 4, "minibatch": 16, "hidden": 8}
    agent = learning("ppo", changes, tmp_path, Setup.of("tick"), steps=8, evaluate_every=8)
    assert int(agent.advance().checkpoint["state/moments/0/count"]) == agent.hp.epochs


def test_names_of_the_suite_stay_its_own(networks):
    networks.update(legs=Half.of)
    with refused("network 'legs': the suite has one of this name, and __main__ registers another"):
        Configuration.of(Setup.of("tick"), "ppo", {"network": "legs"})


class Half(Perceptron):
    """Perceptrons with half of the actions."""

    def actions(self, parameters, views):
        """Return half of the actions."""
        return 0.5 * super().actions(parameters, views)
