"""The table of algorithms, which needs no JAX."""

import dataclasses

import interpreters
import programs
import pytest

from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.algorithms import ALGORITHMS, algorithm
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.hyperparameters import SoftActorCritic

PAPER = {
    # prior data, transitions of an update, the most updates of a phase, early stop, dropout
    "sac": ("none", 256, 0, "none", 0.0),
    "speq": ("none", 256, 75_000, "none", 0.01),
    "sope_eo": ("none", 256, 75_000, "published", 0.01),
    "sacfd": ("protected", 256, 0, "none", 0.0),
    "speq_o2o": ("symmetric_sampling", 512, 75_000, "none", 0.01),
    "sope": ("symmetric_sampling", 512, 75_000, "published", 0.01),
}


@pytest.mark.parametrize("name", PAPER)
def test_algorithms_of_the_paper(name):
    hp = ALGORITHMS[name].hyperparameters
    size = hp.batch * (2 if hp.prior == "symmetric_sampling" else 1)
    assert (hp.prior, size, hp.phase_updates, hp.early_stop, hp.dropout) == PAPER[name]
    common = {"hidden": 256, "learning_rate": 3e-4, "discount": 0.99, "tau": 0.005, "buffer_size": 1_000_000}
    common |= {"start_steps": 5000, "phase_every": 10_000, "held_out": 0.1, "check_every": 1000, "patience": 10_000}
    assert {key: getattr(hp, key) for key in common} == common
    assert ALGORITHMS[name].evaluate_every == 10_000


def test_hyperparameters_can_be_changed():
    changes = {"phase_updates": 7500, "early_stop": "sign_safe", "dropout": 0}
    before = ALGORITHMS["sope"].hyperparameters
    assert algorithm("sope").with_hyperparameters(changes).hyperparameters == dataclasses.replace(before, **changes)
    assert ALGORITHMS["sope"].hyperparameters is before
    with pytest.raises(dataclasses.FrozenInstanceError):
        before.batch = 3


@pytest.mark.parametrize(
    ("name", "task", "steps"),
    [
        ("ppo", "walk", 1_000_000),
        ("ppo", "steer", 1_000_000),
        ("ppo", "rough", 3_000_000),
        ("ppo", "navigate", 3_000_000),
        ("sac_parallel", "rough", 100_000),
    ],
)
def test_the_default_length_of_a_run_follows_from_its_task(name, task, steps):
    assert Configuration.of(Setup.of("tick", task), name).steps == steps
    assert Configuration.of(Setup.of("tick", task), name, steps=5000).steps == 5000


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"phase_update": 3}, r"^unknown hyperparameter 'phase_update'; did you mean 'phase_updates'\? "),
        ({"phase_updates": "many"}, r"^hyperparameter phase_updates: expected int like 75000, got 'many'$"),
        ({"phase_updates": 1.5}, r"^hyperparameter phase_updates: expected int like 75000, got 1\.5$"),
        ({"dropout": True}, r"^hyperparameter dropout: expected float like 0\.01, got True$"),
        ({"dropout": 2}, r"^dropout: expected a number from 0 to 0\.9, got 2$"),
        ({"discount": 1}, r"^discount: expected a number between 0 and 1, got 1$"),
        ({"discount": 99}, r"^discount: expected a number between 0 and 1, got 99$"),
        ({"held_out": 1}, r"^held_out: expected a number between 0 and 1, got 1$"),
        ({"improvement": 1.0}, r"^improvement: expected a number between 0 and 1, got 1\.0$"),
        ({"learning_rate": 0}, r"^learning_rate: expected a number between 0 and 1, got 0$"),
        ({"tau": 0}, r"^tau: expected a number from 1e-06 to 1, got 0$"),
        ({"batch": 0}, r"^batch: expected an integer from 1 to 16777216, got 0$"),
        ({"early_stop": "safe"}, r"^unknown early_stop 'safe'"),
    ],
)
def test_changes_that_do_not_fit(changes, line):
    with pytest.raises(ValueError, match=line):
        algorithm("sope").with_hyperparameters(changes)


def test_a_rule_that_ends_phases_needs_phases():
    """Learners without them would learn the same with each rule."""
    line = r"^early_stop: expected none without phases, phase_updates=0, got sign_safe$"
    for name in ("sac", "sac_parallel"):
        with pytest.raises(ValueError, match=line):
            algorithm(name).with_hyperparameters({"early_stop": "sign_safe"})
    with pytest.raises(ValueError, match=line.replace("sign_safe", "published")):
        algorithm("sope").with_hyperparameters({"phase_updates": 0})
    assert algorithm("sope").with_hyperparameters({"phase_updates": 0, "early_stop": "none"})
    assert algorithm("sac").with_hyperparameters({"phase_updates": 10, "early_stop": "sign_safe"})


@pytest.mark.parametrize("changes", [{"discount": 1}, {"clip": 0.0}, {"policy_rate": 1}, {"value_rate": 0}])
def test_ppo_takes_no_whole_number_for_a_share(changes):
    with pytest.raises(ValueError, match=rf"^{next(iter(changes))}: expected a number between 0 and 1, got [01]"):
        algorithm("ppo").with_hyperparameters(changes)
    assert algorithm("ppo").with_hyperparameters({"gae_lambda": 1, "normalize_until": 0})


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("sop", r"^unknown algorithm 'sop'; did you mean 'sope'\? \(there are: sac, "),
        (
            "nowhere:search",
            r"^algorithm 'search': cannot import nowhere: No module named 'nowhere'; start in the fol",
        ),
        ("json:loads", r"^algorithm 'loads': json registers no such algorithm by arc_suite.register$"),
        ("json:ppo", r"^algorithm 'json:ppo': ppo is the suite's own, expected without a module$"),
    ],
)
def test_unknown_algorithms(name, line):
    with pytest.raises(ValueError, match=line):
        algorithm(name)


def test_without_jax_is_one_line(tmp_path):
    done = programs.without("jax", tmp_path, "train", "--robot=tick", f"--output={tmp_path / 'run'}")
    programs.refused(done, f"arc-suite train: training needs JAX: {programs.install('learn')} (")
    assert not (tmp_path / "run").exists()


def test_the_policy_acts_before_the_buffer_is_full():
    with pytest.raises(ValueError, match="^buffer_size: expected more than start_steps, 5000, after which the policy "):
        SoftActorCritic(buffer_size=5000)
    assert SoftActorCritic(buffer_size=5000, prior="protected").buffer_size == 5000, "prior data count too"


def test_the_table_needs_no_jax():
    code = "import sys; from arc_suite.learning.agents import algorithms, training; print('jax' in sys.modules)"
    assert interpreters.printed(code) == ["False"]


def test_every_algorithm_has_a_line():
    for name, each in algorithms.ALGORITHMS.items():
        assert each.summary and "\n" not in each.summary, name
