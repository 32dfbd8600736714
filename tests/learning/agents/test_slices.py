"""What a learner yields, and the definition of its algorithm, are refused in one line where they do not fit."""

import dataclasses

import numpy as np
import pytest
from refusals import refused

from arc_suite.learning.agents import algorithms, slices
from arc_suite.learning.agents.learner import Slice
from arc_suite.policies.tracing import traced

POLICY = traced(lambda x: x.node("Tanh"), 3)
FITTING = Slice({"loss": 1.0}, POLICY, {"number": np.array(1)})


@dataclasses.dataclass(frozen=True)
class Nothing:
    """No hyperparameters."""


@pytest.mark.parametrize(
    ("yielded", "message"),
    [
        (tuple(FITTING), "expected a Slice in each yield, got a tuple"),
        (FITTING._replace(metrics=3.0), "Slice.metrics: expected a dictionary, got 3.0"),
        (FITTING._replace(metrics={"loss": "low"}), "Slice.metrics['loss']: expected a number, got 'low'"),
        (
            FITTING._replace(metrics={"loss": np.ones(2)}),
            "Slice.metrics['loss']: expected a number, got array([1., 1.])",
        ),
        (
            FITTING._replace(policy=len),
            "Slice.policy: expected a Graph, such as policies.tracing.traced returns, got <",
        ),
        (
            FITTING._replace(policy="policy.pt"),
            "Slice.policy: expected a Graph, such as policies.tracing.traced returns",
        ),
        (FITTING._replace(checkpoint=None), "Slice.checkpoint: expected a dictionary of arrays, got None"),
        (FITTING._replace(checkpoint={"number": 1}), "Slice.checkpoint['number']: expected an array, got 1"),
        (
            FITTING._replace(checkpoint={"table": np.array([{"a": 1}])}),
            "Slice.checkpoint['table']: expected an array, got array([{'a': 1}], dtype=object)",
        ),
    ],
)
def test_a_slice_that_does_not_fit_is_told(yielded, message):
    with refused(f"algorithm mine: learn: {message}", begins=True):
        slices.next_slice("mine", iter([yielded]), 0, 100)


def test_a_slice_that_fits_is_returned():
    for fitting in (FITTING, FITTING._replace(metrics=None), FITTING._replace(metrics={"loss": np.float32(1.0)})):
        assert slices.next_slice("mine", iter([fitting]), 0, 100) is fitting


def test_a_learner_that_ends_early_or_yields_nothing_is_told():
    with refused("algorithm mine: learn: expected slices until step 100, got no more after step 40"):
        slices.next_slice("mine", iter([]), 40, 100)
    with refused("algorithm mine: learn: expected a generator, which yields each Slice, got a Slice"):
        slices.check_generator("mine", FITTING)
    with refused("algorithm mine: learn: expected a generator, which yields each Slice, got None"):
        slices.check_generator("mine", None)
    generator = (number for number in (1, 2))
    assert slices.check_generator("mine", generator) is generator


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"source": "none"}, "unknown source of an algorithm 'none' (there are: nothing, prior data, "),
        ({"source": "a demonstrater"}, "unknown source of an algorithm 'a demonstrater'; did you mean 'a demons"),
        (
            {"hyperparameters": {"rate": 0.1}},
            "algorithm 'mine': hyperparameters: expected a value of a frozen dataclass, got {'rate': 0.1}",
        ),
        (
            {"hyperparameters": Nothing},
            "algorithm 'mine': hyperparameters: expected a value of a frozen dataclass, got",
        ),
    ],
)
def test_an_algorithm_that_does_not_fit_is_told(monkeypatch, changes, message):
    definition = algorithms.Algorithm(len, Nothing(), "learns nothing")._replace(**changes)
    monkeypatch.setitem(algorithms.ALGORITHMS, "mine", definition)
    with refused(message, begins=True):
        algorithms.algorithm("mine")
