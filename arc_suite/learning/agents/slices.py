"""Checks of what a learner returns and yields, before a run relies on it."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from arc_suite import checks, usage
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.learner import RunContext, Slice
from arc_suite.policies.graph import Graph


def begin_learning(configuration: Configuration, context: RunContext) -> Any:
    """Call the learner of a run, and return its generator.

    Raises:
        ValueError: it returns none.
    """
    definition = configuration.definition
    with usage.run_learner(configuration.algorithm):
        slices = definition.learn(definition.hyperparameters, context)
    return check_generator(configuration.algorithm, slices)


def check_generator(algorithm: str, slices: Any) -> Any:
    """Return what a learner has returned if it is a generator.

    Args:
        algorithm: name of the algorithm, for errors.
        slices: any value, which is checked.

    Raises:
        ValueError: it is none.
    """
    if not hasattr(slices, "close") or not isinstance(slices, Iterator):
        raise ValueError(
            f"algorithm {algorithm}: learn: expected a generator, which yields each Slice, got {_describe(slices)}"
        )
    return slices


def next_slice(algorithm: str, slices: Iterator[Any], step: int, steps: int) -> Slice:
    """Return the next slice of a learner, after checks of its kinds.

    Args:
        algorithm: name of the algorithm, for errors.
        slices: generator of the learner.
        step: environment step of the run.
        steps: environment steps of the whole run.

    Raises:
        ValueError: the learner has ended, or yields something else.
    """
    with usage.run_learner(algorithm):
        learned_slice = next(slices, None)
    learner_name = f"algorithm {algorithm}: learn"
    if learned_slice is None:
        raise ValueError(f"{learner_name}: expected slices until step {steps}, got no more after step {step}")
    if not isinstance(learned_slice, Slice):
        raise ValueError(f"{learner_name}: expected a Slice in each yield, got {_describe(learned_slice)}")
    if not isinstance(learned_slice.metrics, Mapping | None):
        raise ValueError(
            f"{learner_name}: Slice.metrics: expected a dictionary, got {_describe(learned_slice.metrics)}"
        )
    for name, metric in (learned_slice.metrics or {}).items():
        if np.shape(metric) != () or not checks.is_numeric(metric):
            raise ValueError(
                f"{learner_name}: Slice.metrics[{name!r}]: expected a number, got {checks.preview(metric)}"
            )
    if not isinstance(learned_slice.policy, Graph):
        cure = "a Graph, such as policies.tracing.traced returns"
        raise ValueError(f"{learner_name}: Slice.policy: expected {cure}, got {_describe(learned_slice.policy)}")
    if not isinstance(learned_slice.checkpoint, Mapping):
        got = _describe(learned_slice.checkpoint)
        raise ValueError(f"{learner_name}: Slice.checkpoint: expected a dictionary of arrays, got {got}")
    for name, array in learned_slice.checkpoint.items():
        if getattr(getattr(array, "dtype", None), "kind", "O") == "O":
            raise ValueError(
                f"{learner_name}: Slice.checkpoint[{name!r}]: expected an array, got {checks.preview(array)}"
            )
    return learned_slice


def _describe(value: Any) -> str:
    """Return the beginning of a value's text; a class by its name, as texts of slices are long."""
    return f"a {type(value).__name__}" if isinstance(value, tuple) else checks.preview(value)
