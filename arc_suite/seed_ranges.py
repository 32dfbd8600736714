"""Seeds of episodes by purpose, so that no policy is evaluated on episodes that it learned from.

0 to 9,999                  evaluation; from 9,000 on validation, while a policy learns
10,000 to 99,999            collecting of datasets
100,000 to 4,099,999,999    learning: runs of algorithms, and searches for demonstrators
from 4,100,000,000          judging of final policies, see `evaluation.judging`
"""

from collections.abc import Iterable, Sequence

EVALUATION = range(10_000)
VALIDATION = range(9_000, 10_000)  # a part of those of evaluation
COLLECTING = range(10_000, 100_000)
LEARNING = range(100_000, 4_100_000_000)
JUDGING = range(4_100_000_000, 1 << 32)

Ranges = tuple[range, ...]
_SEEDS_OF_A_RUN = 100_000  # of a search, too


def of_run(seed: int) -> range:
    """Return the seeds of the episodes of a run or a search; runs of different seeds share none."""
    return range(_SEEDS_OF_A_RUN * (1 + seed), _SEEDS_OF_A_RUN * (2 + seed))


def common_seeds(ranges: Iterable[range], seeds: range) -> range:
    """Return the seeds that are in both `seeds` and the first of the ranges to overlap it; empty if none does."""
    for candidate in ranges:
        overlap = range(max(candidate.start, seeds.start), min(candidate.stop, seeds.stop))
        if overlap:
            return overlap
    return range(0)


def to_json(ranges: Ranges | None) -> list[list[int]] | None:
    """Return the first and the last seed of each range; None for unknown ranges, which are None."""
    if ranges is None:
        return None
    return [[seeds.start, seeds.stop - 1] for seeds in ranges]


def from_json(pairs: Iterable[Sequence[int]] | None) -> Ranges | None:
    """Return the ranges of the first and last seeds that `to_json` has returned.

    Raises:
        TypeError, ValueError: `pairs` is something else.
    """
    if pairs is None:
        return None
    return tuple(range(first, last + 1) for first, last in pairs)
