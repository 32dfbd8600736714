"""The table of algorithms: numbers alone, which need no JAX."""

import dataclasses
import subprocess
import sys

import pytest

from arc_suite.agents import algorithms
from arc_suite.agents.algorithms import ALGORITHMS, Algorithm, algorithm
from arc_suite.agents.hyperparameters import SoftActorCritic

PAPER = {
    # prior data, transitions of an update, the most updates of a phase, early stop, dropout
    "sac": ("none", 256, 0, "none", 0.0),
    "speq": ("none", 256, 75_000, "none", 0.01),
    "sope_eo": ("none", 256, 75_000, "published", 0.01),
    "sacfd": ("fenced", 256, 0, "none", 0.0),
    "speq_o2o": ("beside", 512, 75_000, "none", 0.01),
    "sope": ("beside", 512, 75_000, "published", 0.01),
}


@pytest.mark.parametrize("name", PAPER)
def test_rows_of_the_paper(name):
    row = ALGORITHMS[name].row
    size = row.batch * (2 if row.prior == "beside" else 1)
    assert (row.prior, size, row.phase_updates, row.early_stop, row.dropout) == PAPER[name]
    common = {"hidden": 256, "learning_rate": 3e-4, "discount": 0.99, "averaging": 0.005, "capacity": 1_000_000}
    common |= {"random_steps": 5000, "phase_every": 10_000, "held_out": 0.1, "check_every": 1000, "patience": 10_000}
    assert {key: getattr(row, key) for key in common} == common
    assert ALGORITHMS[name].evaluate_every == 10_000


def test_rows_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        ALGORITHMS["sac"].row.batch = 3


def test_numbers_of_a_row_can_be_changed():
    changed = algorithm("sope").with_row({"phase_updates": 7500, "early_stop": "sign_safe", "dropout": 0})
    row = ALGORITHMS["sope"].row
    assert changed.row == dataclasses.replace(row, phase_updates=7500, early_stop="sign_safe", dropout=0)
    assert ALGORITHMS["sope"].row is row


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"phase_update": 3}, r"^unknown number of the row 'phase_update'; did you mean 'phase_updates'\? "),
        ({"phase_updates": "many"}, r"^row phase_updates: expected int like 75000, got 'many'$"),
        ({"phase_updates": 1.5}, r"^row phase_updates: expected int like 75000, got 1\.5$"),
        ({"dropout": True}, r"^row dropout: expected float like 0\.01, got True$"),
        ({"dropout": 2}, r"^dropout: expected a number from 0 to 0\.9, got 2$"),
        ({"batch": 0}, r"^batch: expected an integer from 1, got 0$"),
        ({"early_stop": "safe"}, r"^unknown early_stop 'safe'"),
    ],
)
def test_changes_that_do_not_fit(changes, line):
    with pytest.raises(ValueError, match=line):
        algorithm("sope").with_row(changes)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("sop", r"^unknown algorithm 'sop'; did you mean 'sope'\? \(there are: sac, "),
        ("nowhere:ROW", r"^algorithm 'nowhere:ROW': No module named 'nowhere'$"),
        ("json:loads", r"^algorithm 'json:loads': expected an Algorithm, got function$"),
    ],
)
def test_unknown_algorithms(name, line):
    with pytest.raises(ValueError, match=line):
        algorithm(name)


def test_without_jax_is_one_line():
    row = SoftActorCritic()
    with pytest.raises(ValueError, match=r"^training needs JAX: pip install 'arc_suite\[agents\]' \(No module named"):
        _ = Algorithm("arc_suite.agents.nowhere", row, "").module


def test_what_a_learner_of_others_needs_is_named():
    with pytest.raises(ValueError, match=r"^learner others: No module named 'others'$"):
        _ = Algorithm("others", SoftActorCritic(), "").module


def test_the_policy_acts_before_the_buffer_is_full():
    with pytest.raises(ValueError, match=r"^capacity: expected more than random_steps, 5000, after which the policy "):
        SoftActorCritic(capacity=5000)
    assert SoftActorCritic(capacity=5000, prior="fenced").capacity == 5000, "prior data count too"


def test_the_table_needs_no_jax():
    code = "import sys; from arc_suite.agents import algorithms, training; print('jax' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_every_algorithm_has_a_line():
    for name, each in algorithms.ALGORITHMS.items():
        assert each.summary and "\n" not in each.summary, name
