"""Calls of compiled functions, which a learner leaves to whoever drives it.

A learner that has `calls` yields each and takes the answer, so that one text of it serves a run alone (`alone`) and
many runs whose calls of equal shape are made in one program (`arc_suite.agents.together`). Nothing here needs JAX.
"""

from collections.abc import Callable, Generator
from typing import Any, NamedTuple

from arc_suite.agents.learner import Learner


class Call(NamedTuple):
    """A call of a pure function.

    Attributes:
        function: jitted, of `*static, *given`.
        static: hashable arguments that are compiled in.
        given: pytrees of arrays.
    """

    function: Callable
    static: tuple
    given: tuple


def alone(work: Generator[Call, Any, Any]) -> Any:
    """Make the calls that a generator yields one by one, and return what it returns."""
    answer = None
    while True:
        try:
            call = work.send(answer)
        except StopIteration as end:
            return end.value
        answer = call.function(*call.static, *call.given)


def advancing(learner: Learner, limit: int) -> Generator[Call, Any, Any]:
    """Yield the calls of a slice of a learner, if it shows any, and return the slice's figures."""
    if hasattr(learner, "calls"):
        return (yield from learner.calls(limit))
    return learner.advance(limit)
