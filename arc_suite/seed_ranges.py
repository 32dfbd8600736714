"""Seeds of episodes by purpose, so that no policy is judged on episodes that it learned from.

0 to 9,999          evaluation
10,000 to 99,999    collecting of datasets
from 100,000        learning: runs of algorithms, and searches for demonstrators
"""

from collections.abc import Iterable, Sequence

EVALUATION = range(10_000)
COLLECTING = range(10_000, 100_000)
LEARNING = range(100_000, 1 << 32)

Ranges = tuple[range, ...]
_OF_ONE = 100_000  # seeds of a run or a search


def of_run(seed: int) -> range:
    """Return the seeds of the episodes of a run or a search, apart from those of its other seeds."""
    return range(_OF_ONE * (1 + seed), _OF_ONE * (2 + seed))


def common_seeds(ranges: Iterable[range], played: range) -> range:
    """Return the seeds that the first range to have any of those played has in common with them; empty for none."""
    shared = (range(max(each.start, played.start), min(each.stop, played.stop)) for each in ranges)
    return next(filter(None, shared), range(0))


def to_json(ranges: Ranges | None) -> list[list[int]] | None:
    """Return the first and the last seed of each range; None for unknown ones."""
    return None if ranges is None else [[each.start, each.stop - 1] for each in ranges]


def from_json(pairs: Iterable[Sequence[int]] | None) -> Ranges | None:
    """Return the ranges of `to_json`.

    Raises:
        TypeError, ValueError: none.
    """
    return None if pairs is None else tuple(range(first, last + 1) for first, last in pairs)
