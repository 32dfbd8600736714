"""Numbers of Python calls, which are the same on every machine, do not grow."""

import count_calls
import interpreters
import pytest

# To open a generated body, which is drawn again where its legs meet as they step: a third of the calls.
MOST_CALLS = 8400


@pytest.mark.parametrize(("task", "most"), [("walk", 53), ("roam", 143)])
def test_a_step_makes_few_calls(task, most):
    calls = count_calls.calls_of_steps(task)
    assert calls.total() / count_calls.STEPS <= most, calls.most_common(10)


def test_a_generated_body_opens_with_few_calls():
    """In a process of its own, in which no body was sized before."""
    script = "import count_calls; print(count_calls.calls_of_opening('varied:7').total())"
    (total,) = interpreters.printed(script, folder=interpreters.ROOT / "tools")
    assert 1000 < int(total) <= MOST_CALLS


def test_functions_are_counted_by_file_and_name():
    assert count_calls.calls_of_steps("walk")["/envs/dm.py: TaskRun.before_step"] == count_calls.STEPS
