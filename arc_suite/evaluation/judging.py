"""The episodes that judge a final policy: seeds and ground follow from its content, so that nobody has seen them.

A policy is judged once, when its training has ended. Its curve, `--until_score` and the choice of a checkpoint have
`seed_ranges.VALIDATION`. A policy that differs in one bit gets other episodes. So saving a policy again and again
until its episodes are lucky gains about one standard error of the mean.

`judging.csv` holds the anchors of scores at the benchmark's places, a line for each ground or share of the seeds,
written by `python tools/judge_anchors.py`.
"""

import csv
import functools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import parsers, seed_ranges
from arc_suite.envs.setup import Setup
from arc_suite.evaluation.protocol import EPISODES

TABLE = Path(__file__).with_name("judging.csv")
BLIND = "blind"  # the packaged policy of `steer`, which sees no ground
ANCHOR_SEEDS = seed_ranges.JUDGING[:1000]  # of the anchors of scores, and of policies without files
GROUNDS = 8  # of the anchors; an equal share of the seeds on each


class Part(NamedTuple):
    """Episodes of a policy on one ground; a line of `TABLE`.

    Attributes:
        place: text of the setup, without the ground's seed.
        policy: `zero`, a preset of the demonstrator, or `BLIND`.
        ground: seed of the ground; empty where no ground is random.
        first_seed: seed of the first episode.
        seeds: how many there are.
        mean: mean return.
        deviation: standard deviation of the returns.
    """

    place: str
    policy: str
    ground: str
    first_seed: int
    seeds: int
    mean: float
    deviation: float


class Level(NamedTuple):
    """Mean return of a policy that is an anchor.

    Attributes:
        mean: over all episodes.
        error: its standard error.
        seeds: how many episodes there are.
    """

    mean: float
    error: float
    seeds: int


def seeds_of(sha256: str | None) -> range:
    """Return the seeds of the episodes that judge a policy.

    Args:
        sha256: hash of its content; None for a policy without files.
    """
    if sha256 is None:
        return ANCHOR_SEEDS[:EPISODES]
    first_seeds = range(ANCHOR_SEEDS.stop, seed_ranges.JUDGING.stop - EPISODES)
    first = first_seeds[int(sha256, 16) % len(first_seeds)]
    return range(first, first + EPISODES)


def on_ground(setup: Setup, seed: int) -> Setup:
    """Return the setup with this seed of its random ground; a setup without random ground as it is."""
    ground = getattr(setup.kind, "ground", None)
    if ground is None or "terrain_seed" not in ground.settings:
        return setup
    return setup.with_settings({"terrain_seed": seed})


def setup_of(setup: Setup, seeds: range) -> Setup:
    """Return the setup of the episodes that judge a policy: the first seed is that of the ground."""
    return on_ground(setup, seeds.start)


def level_of(parts: Sequence[Part]) -> Level:
    """Return the mean return over all parts; on several grounds, the error is that of the mean over grounds."""
    seeds = np.array([part.seeds for part in parts])
    means = np.array([part.mean for part in parts])
    deviations = np.array([part.deviation for part in parts])
    mean = float(np.average(means, weights=seeds))
    has_grounds = bool(parts[0].ground) and len(parts) > 1
    if has_grounds:
        error = means.std(ddof=1) / np.sqrt(len(parts))
    else:
        error = np.sqrt(np.average(deviations**2 + (means - mean) ** 2, weights=seeds) / seeds.sum())
    return Level(mean, float(error), int(seeds.sum()))


def read(path: Path) -> list[Part]:
    """Return the lines of a table of anchors; none where there is no file.

    Raises:
        ValueError: a damaged table.
    """
    if not path.exists():
        return []
    with parsers.guard(f"{path}: no table of anchors"), path.open(encoding="utf-8", newline="") as file:
        return [
            Part(place, policy, ground, int(first_seed), int(seeds), float(mean), float(deviation))
            for place, policy, ground, first_seed, seeds, mean, deviation in map(dict.values, csv.DictReader(file))
        ]


def write(path: Path, parts: Iterable[Part]) -> None:
    """Write a table of anchors."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Part._fields)
        writer.writerows(parts)


def levels(setup: Setup) -> Mapping[str, Level] | None:
    """Return the committed anchors of a setup by policy: standing still, the demonstrator, and maybe `BLIND`.

    None unless the first two are there. The seed of the setup's ground does not count.
    """
    levels_by_policy = _table().get(str(setup.with_settings({}, dropped=["terrain_seed"])), {})
    policies_that_see = levels_by_policy.keys() - {BLIND}
    return levels_by_policy if len(policies_that_see) == 2 else None  # while the table is measured, one may be missing


@functools.cache
def _table() -> dict[str, dict[str, Level]]:
    parts_by_policy: dict[tuple[str, str], list[Part]] = {}
    for part in read(TABLE):
        parts_by_policy.setdefault((part.place, part.policy), []).append(part)
    levels_by_place: dict[str, dict[str, Level]] = {}
    for (place, policy), parts in parts_by_policy.items():
        levels_by_place.setdefault(place, {})[policy] = level_of(parts)
    return levels_by_place
