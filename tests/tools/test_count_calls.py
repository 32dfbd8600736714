"""The Python calls of a step, which are the same on every machine, do not grow."""

import count_calls
import pytest


@pytest.mark.parametrize(("task", "most"), [("walk", 51), ("roam", 125)])
def test_a_step_makes_few_calls(task, most):
    calls = count_calls.counted(task)
    assert calls.total() / 100 <= most, calls.most_common(10)
