"""Anchors of a score: what standing still and the best demonstrator earn with a robot, a task and settings.

`anchors.csv` holds both for robots of the suite in tasks with default settings: the returns of the protocol's episodes,
written by `python tools/results.py --anchors`. In places that it lacks they are measured, in ten episodes. Episodes run
in a batch, where policies observe float32 as learners do. `arc-suite evaluate` has float64, and chaotic walks diverge:
Leaper's `medium` earns 2619.8 here and 2610.4 there, over ten episodes.
"""

import contextlib
import csv
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import checks, policies
from arc_suite.cpg.selection import suited_preset, suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.robots import is_robot

TABLE = Path(__file__).with_name("anchors.csv")
HEADS = ("place", "policy", "seed", "return")
ZERO = "zero"  # the policy that stands still

Returns = Mapping[str, np.ndarray]  # (episodes,) by policy: `zero`, or a preset of the demonstrator


class Anchors(NamedTuple):
    """Returns between which a score lies.

    Attributes:
        zero: mean return of standing still, score 0.
        demonstrator: mean return of the best demonstrator, score 1; None where the body has none.
        preset: its name; None where the body has none.
    """

    zero: float
    demonstrator: float | None = None
    preset: str | None = None

    def score(self, returns):
        """Return (return - standing still) / (best demonstrator - standing still); NaN where that one earns no more.

        Args:
            returns: (...) returns, or means of several.
        """
        if self.demonstrator is None or self.demonstrator <= self.zero:
            return np.full_like(returns, np.nan, dtype=float)
        return (np.asarray(returns, float) - self.zero) / (self.demonstrator - self.zero)

    def at(self, score: float) -> float:
        """Return the return of a score; infinite where no return has one."""
        if self.demonstrator is None or self.demonstrator <= self.zero:
            return np.inf
        return self.zero + score * (self.demonstrator - self.zero)


def of_returns(played: Returns) -> Anchors:
    """Return the anchors of returns by policy, `zero` among them."""
    means = {name: float(returns.mean()) for name, returns in played.items()}
    zero = means.pop(ZERO)
    best = max(means, key=means.__getitem__, default=None)
    return Anchors(zero, None if best is None else means[best], best)


def anchors(setup: Setup) -> Anchors:
    """Return the anchors of a robot, a task and settings, measured where they are not committed.

    Raises:
        ValueError: a setting of the task that does not fit, or episodes that need not end.
    """
    if setup.several:
        return _of_several(setup)
    return of_returns(known(setup) or measured(setup))


@functools.lru_cache(maxsize=16)
def _of_several(setup: Setup) -> Anchors:
    """The anchors of bodies, each in an episode with its own suited demonstrator."""
    zero, demonstrators = [], []
    members = setup.members()
    for seed in tqdm(
        range(protocol.CURVE_EPISODES), desc=f"anchors of {setup}", unit="body", leave=False, disable=None
    ):
        member = members[seed % len(members)]
        zero.append(played(member, ZERO, range(seed, seed + 1)))
        demonstrators.append(played(member, suited_preset(member.definition), range(seed, seed + 1)))
    return Anchors(float(np.mean(zero)), float(np.mean(demonstrators)), "of each body")


def known(setup: Setup) -> Returns | None:
    """Return the committed returns of standing still and of the best demonstrator; None without any."""
    return _table().get(str(setup)) if is_robot(setup.body) and not setup.task_kwargs else None


@functools.lru_cache(maxsize=16)
def measured(setup: Setup, episodes: int = protocol.CURVE_EPISODES) -> Returns:
    """Return the returns of standing still and of all presets that suit the task, from seed 0 on; see `anchors`."""
    found = {}
    names = (ZERO, *suited_presets(setup.definition))
    for name in tqdm(names, desc=f"anchors of {setup}", unit="policy", leave=False, disable=None):
        try:
            found[name] = played(setup, name, range(episodes))
        except ValueError:
            if name == ZERO:
                raise
            # What one preset refuses, such as a body whose feet hang in the air, another one may take.
    return found


def played(setup: Setup, name: str, seeds: range) -> np.ndarray:
    """Return the returns (episodes,) of standing still, `zero`, or of a preset of the demonstrator.

    Raises:
        ValueError: as `policies.policy`.
    """
    environment = setup.make_vec(len(seeds), num_threads=1, autoreset_mode=AutoresetMode.DISABLED)
    chosen = (ZERO, ()) if name == ZERO else ("cpg", name)
    with contextlib.closing(environment):
        policy = policies.policy(chosen[0], setup.body, chosen[1], len(seeds), task=environment.task.definition)
        return np.array([each.total for each in protocol.episodes_in_batch(environment, policy, seeds)])


def read(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the returns in a table, each (episodes,), by place, which is the text of a setup, and by policy.

    Raises:
        ValueError: a damaged table.
    """
    found: dict[str, dict[str, list[float]]] = {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for line in csv.DictReader(file):
                found.setdefault(line["place"], {}).setdefault(line["policy"], []).append(float(line["return"]))
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise ValueError(f"{path}: no table of returns: {checks.quote(error)}") from None
    return {place: {name: np.array(values) for name, values in every.items()} for place, every in found.items()}


def write(path: Path, table: Mapping[str, Returns]) -> None:
    """Write returns by place and policy as a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(HEADS)
        for place, every in table.items():
            for name, returns in every.items():
                lines.writerows((place, name, seed, repr(float(total))) for seed, total in enumerate(returns))


@functools.cache
def _table() -> dict[str, dict[str, np.ndarray]]:
    return read(TABLE)
