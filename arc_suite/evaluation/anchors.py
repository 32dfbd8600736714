"""Anchors of a score: returns of standing still and of the best demonstrator with a robot, a task and settings.

`judging.csv` holds both for the places of the benchmark, over the seeds of `judging`. `anchors.csv` holds returns in
the episodes of seeds 0 to 99, for robots of the suite in tasks with default settings, written by
`python tools/results.py --anchors`. Other anchors are measured in ten episodes. Episodes run in a batch,
where policies observe float32 as learners do. `arc-suite evaluate` has float64, with which chaotic walks diverge:
over ten episodes, Leaper's `medium` has a return of 2619.8 here and of 2610.4 there.
"""

import contextlib
import csv
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import parsers, policies, registry
from arc_suite.cpg.selection import ignored_commands, law, preset_of, suited_preset, suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import judging, protocol
from arc_suite.evaluation.judging import Level
from arc_suite.robots import is_robot
from arc_suite.tasks import Task

TABLE = Path(__file__).with_name("anchors.csv")
HEADS = ("place", "policy", "seed", "return")
ZERO = "zero"  # the policy that stands still
_MIN_GAIN = 0.1  # of the return of standing still: by less a demonstrator that does not walk may earn more

Returns = Mapping[str, np.ndarray]  # (episodes,) by policy: `zero`, or a preset of the demonstrator


class Anchors(NamedTuple):
    """Returns that have the scores 0 and 1.

    Attributes:
        zero: mean return of standing still, score 0.
        demonstrator: mean return of the best demonstrator, score 1; None where the body has none.
        preset: name of the best demonstrator; None where the body has none.
        blind: mean return of a walker that sees no ground; None where nobody has measured it.
        errors: standard errors of `zero` and `demonstrator`; None if they are unknown.
    """

    zero: float
    demonstrator: float | None = None
    preset: str | None = None
    blind: float | None = None
    errors: tuple[float, float] | None = None

    def score(self, returns):
        """Return (return - standing still) / (best demonstrator - standing still), or NaN.

        It is NaN where returns have no scores, see `flaw`.

        Args:
            returns: (...) returns, or means of several.
        """
        if self.flaw:
            return np.full_like(returns, np.nan, dtype=float)
        return (np.asarray(returns, float) - self.zero) / (self.demonstrator - self.zero)

    def at(self, score: float) -> float:
        """Return the return of a score; infinite where returns have no scores."""
        if self.flaw:
            return np.inf
        return self.zero + score * (self.demonstrator - self.zero)

    @property
    def flaw(self) -> str:
        """Why returns have no scores: no demonstrator, or none that earns a tenth more than standing still; or ""."""
        if self.demonstrator is None:
            return "no demonstrator suits body and task"
        if self.demonstrator - self.zero <= _MIN_GAIN * abs(self.zero):
            returns = f"{self.demonstrator:.1f}, and standing still {self.zero:.1f}"
            return f"the best demonstrator, {self.preset}, earns {returns}"
        return ""


def of_returns(returns_by_policy: Returns, seeds: Sequence[int] = ()) -> Anchors:
    """Return the anchors of returns by policy; see `levels_of_returns`."""
    return of_levels(levels_of_returns(returns_by_policy, seeds))


def levels_of_returns(returns_by_policy: Returns, seeds: Sequence[int] = ()) -> dict[str, Level]:
    """Return the mean returns by policy, one of which is `zero`.

    Args:
        returns_by_policy: returns of the episodes from seed 0 on.
        seeds: seeds of the episodes that are scored, so that anchors are means over the same ones. Empty for means over
            all episodes, as where some policy has not played these seeds.
    """
    fewest_episodes = min(returns.size for returns in returns_by_policy.values())
    if len(seeds) and min(seeds) >= 0 and max(seeds) < fewest_episodes:
        returns_by_policy = {name: returns[list(seeds)] for name, returns in returns_by_policy.items()}
    levels = {}
    for name, returns in returns_by_policy.items():
        error = float(returns.std() / np.sqrt(returns.size))
        levels[name] = Level(float(returns.mean()), error, returns.size)
    return levels


def of_levels(levels: Mapping[str, Level]) -> Anchors:
    """Return the anchors of mean returns by policy: `zero`, demonstrators, and maybe `judging.BLIND`."""
    zero = levels[ZERO]
    blind = levels[judging.BLIND].mean if judging.BLIND in levels else None
    demonstrators = {name: level for name, level in levels.items() if name not in (ZERO, judging.BLIND)}
    if not demonstrators:
        return Anchors(zero.mean, blind=blind)
    preset = max(demonstrators, key=lambda name: demonstrators[name].mean)
    best = demonstrators[preset]
    return Anchors(zero.mean, best.mean, preset, blind, (zero.error, best.error))


def anchors(setup: Setup, seeds: Sequence[int] = ()) -> Anchors:
    """Return the anchors of a robot, a task and settings; those that are not committed are measured.

    Args:
        setup: robot, task and settings.
        seeds: seeds of the episodes that are scored, see `levels_of_returns`.

    Raises:
        ValueError: a setting of the task that does not fit, or episodes that need not end.
    """
    if setup.several:
        return _measure_several_bodies(setup)
    levels = committed_levels(setup, seeds)
    if levels is None:
        levels = levels_of_returns(measure_returns(setup), seeds)
    return of_levels(levels)


def committed_levels(setup: Setup, seeds: Sequence[int] = ()) -> Mapping[str, Level] | None:
    """Return the committed mean returns of the policies that are anchors; None if there are none.

    They come from `judging.csv` where it has the place, except for episodes of seeds 0 to 99: these are scored by the
    same episodes in `anchors.csv`.

    Args:
        setup: robot, task and settings.
        seeds: seeds of the episodes that are scored, see `levels_of_returns`.
    """
    if setup.several:
        return None
    returns_by_policy = committed_returns(setup)
    levels = judging.levels(setup)
    if levels is not None and (returns_by_policy is None or not are_of_before(seeds)):
        return levels
    return None if returns_by_policy is None else levels_of_returns(returns_by_policy, seeds)


def are_of_before(seeds: Sequence[int]) -> bool:
    """Return whether seeds are those with which earlier versions judged: 0 to 99, or some of them."""
    return len(seeds) > 0 and max(seeds) < protocol.EPISODES


@registry.cache_until_registration(maxsize=16)
def _measure_several_bodies(setup: Setup) -> Anchors:
    """Return the anchors of several bodies, each in one episode with the demonstrator that suits it."""
    zero = []
    demonstrators = []
    members = setup.members()
    seeds = range(protocol.CURVE_EPISODES)
    for seed in tqdm(seeds, desc=f"anchors of {setup}", unit="body", leave=False, disable=None):
        member = members[seed % len(members)]
        zero.append(play_returns(member, ZERO, range(seed, seed + 1)))
        demonstrators.append(play_returns(member, suited_preset(member.definition), range(seed, seed + 1)))
    return Anchors(float(np.mean(zero)), float(np.mean(demonstrators)), "of each body")


def committed_returns(setup: Setup) -> Returns | None:
    """Return the committed returns of standing still and of the best demonstrator; None if there are none."""
    if setup.task_kwargs or not is_robot(setup.body):
        return None
    return _table().get(str(setup))


@registry.cache_until_registration(maxsize=16)
def measure_returns(setup: Setup, episodes: int = protocol.CURVE_EPISODES, first_seed: int = 0) -> Returns:
    """Return the returns of standing still and of demonstrators that suit the task, from a seed on; see `anchors`.

    Demonstrators that refuse the body are left out.
    """
    returns_by_policy = {}
    seeds = range(first_seed, first_seed + episodes)
    names = (ZERO, *_presets_to_measure(setup.definition))
    for name in tqdm(names, desc=f"anchors of {setup}", unit="policy", leave=False, disable=None):
        try:
            returns_by_policy[name] = play_returns(setup, name, seeds)
        except ValueError:
            if name == ZERO:
                raise
            # Another preset may take a body that one preset refuses, such as one whose feet hang in the air.
    return returns_by_policy


def _presets_to_measure(task: Task) -> tuple[str, ...]:
    """Return the presets that suit a task and read all its commands, or where none does, all that suit it."""
    names = suited_presets(task)
    return tuple(name for name in names if _reads_all_commands(task, name)) or names


def _reads_all_commands(task: Task, name: str) -> bool:
    """Return whether a preset takes the body of a task and reads all that the task commands."""
    try:
        return not ignored_commands(task, law(task, preset_of(task.scene.body, name)))
    except ValueError:
        return False


def play_returns(setup: Setup, name: str, seeds: Sequence[int]) -> np.ndarray:
    """Return the returns (episodes,) of standing still, `zero`, or of a preset of the demonstrator.

    Raises:
        ValueError: as `policies.policy`.
    """
    return np.array([episode.total for episode in play_episodes(setup, name, seeds)])


def play_episodes(
    setup: Setup, name: str, seeds: Sequence[int], max_steps: int | None = None, watch: Callable | None = None
) -> list[protocol.EpisodeResult]:
    """Play episodes of standing still, `zero`, or of a preset of the demonstrator, all at once.

    Args:
        setup: setup of the episodes.
        name: `zero`, or the preset.
        seeds: seeds of the episodes.
        max_steps: control steps of an episode, at most; None for the limit of the task.
        watch: as of `protocol.episodes_in_batch`.

    Raises:
        ValueError: as `policies.policy`.
    """
    environment = setup.make_vec(
        len(seeds), num_threads=1, autoreset_mode=AutoresetMode.DISABLED, max_episode_steps=max_steps
    )
    policy_name = ZERO if name == ZERO else "cpg"
    presets = () if name == ZERO else name
    with contextlib.closing(environment):
        policy = policies.policy(policy_name, setup.body, presets, len(seeds), task=environment.task.definition)
        return protocol.episodes_in_batch(environment, policy, seeds, watch)


def read(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the returns in a table, (episodes,) each, by place and policy; a place is the text of a setup.

    Raises:
        ValueError: a damaged table.
    """
    returns: dict[str, dict[str, list[float]]] = {}
    with parsers.guard(f"{path}: no table of returns"), path.open(encoding="utf-8", newline="") as file:
        for line in csv.DictReader(file):
            returns.setdefault(line["place"], {}).setdefault(line["policy"], []).append(float(line["return"]))
    return {
        place_name: {policy: np.array(values) for policy, values in returns_by_policy.items()}
        for place_name, returns_by_policy in returns.items()
    }


def write(path: Path, table: Mapping[str, Returns]) -> None:
    """Write returns by place and policy as a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADS)
        for place_name, returns_by_policy in table.items():
            for policy, returns in returns_by_policy.items():
                for seed, value in enumerate(returns):
                    writer.writerow((place_name, policy, seed, repr(float(value))))


@functools.cache
def _table() -> dict[str, dict[str, np.ndarray]]:
    return read(TABLE)
