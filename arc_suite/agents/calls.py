"""Calls of compiled functions, which a learner leaves to whoever drives it.

A learner that has `calls` yields each and takes the answer, so that the same code serves a run alone (`alone`) and
many runs whose calls of equal shape are made in one program (`arc_suite.agents.together`). Nothing here needs JAX.
"""

import contextlib
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
    """Make the calls that a generator yields one by one, and return what it returns.

    Where a call raises, the generator is closed, and what it holds open with it.
    """
    answer = None
    with contextlib.closing(work):
        while True:
            try:
                call = work.send(answer)
            except StopIteration as end:
                return end.value
            answer = call.function(*call.static, *call.given)


def advancing(learner: Learner, limit: int) -> Generator[Call, Any, Any]:
    """Yield the calls of a slice of a learner that has `calls`, none of any other; return the slice's figures."""
    if hasattr(learner, "calls"):
        return (yield from learner.calls(limit))
    return learner.advance(limit)
