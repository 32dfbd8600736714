"""The benchmark: scores of runs on its divisions, see `divisions`, and of policies of other libraries.

studies/scores.csv holds a row for each run, by `write`. The table of all learners is made from this file alone.
"""

import difflib
import itertools
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, evaluation, files, policies, style
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, provenance
from arc_suite.learning.studies import csv_files, results
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS, TURNING
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.text_tables import table
from arc_suite.policies import named, network, other_libraries

SCORES = "scores.csv"
CLIP = (-0.5, 1.2)  # of the score of a run
HALF = 0.5  # score up to which minutes of the processor are counted
STYLE, STYLE_HEADS = ("gait_compliance", "heading_error"), ("gait compliance", "heading error, rad")
NOT_RUN = "not run"
_LEARNER = re.compile(r"[\w.-]+")  # names of learners
MAKE = "make"  # function of a module that makes a policy
ENDINGS = (*other_libraries.READERS, network.EXTENSION, named.MODULE)
# Robot, task and seed by the names that policies of a folder can have.
NAMES = {
    f"{robot}-{task}-{seed}{ending}": (robot, task, seed)
    for (robot, task), seed, ending in itertools.product(PLACES, range(SEEDS), ("", *ENDINGS))
}


class RunScore(NamedTuple):
    """Result of a run; a line of `SCORES`.

    Attributes:
        robot, task, seed: of the run.
        result: mean return of the protocol's episodes.
        score: of it, clipped to `CLIP`.
        minutes: of the processor until an evaluation had the score `HALF`; infinite if none had, NaN if unknown.
        gait_compliance: mean over ten episodes.
        heading_error: mean size over ten episodes, rad; NaN for tasks of `TURNING`.
        notes: what the score must not be compared with others for; empty for nothing.
    """

    robot: str
    task: str
    seed: int
    result: float
    score: float
    minutes: float
    gait_compliance: float
    heading_error: float
    notes: str = ""


COLUMNS = ("division", "learner", *RunScore._fields)  # of `SCORES`
Groups = Mapping[tuple[str, str], Sequence[RunScore]]  # scores by robot and task


def of_results(found: Iterable[RunResult]) -> list[RunScore]:
    """Return the scores of the runs that are finished."""
    return [_of_result(each) for each in found if each.steps[-1] >= each.run.configuration.steps]


def _of_result(found: RunResult) -> RunScore:
    setup = found.run.configuration.setup
    scale = anchors.anchors(setup)
    enough = np.flatnonzero(scale.score(found.returns.mean(axis=1)) >= HALF)
    minutes = found.cpu[enough[0]] / 60.0 if enough.size else np.inf
    notes = "; ".join(found.notes)
    return _score(setup, found.run.configuration.seed, found.final, minutes, found.style, scale, notes)


def _score(setup: Setup, seed: int, result: float, minutes: float, measured, scale, notes: str) -> RunScore:
    clipped = float(np.clip(scale.score(result), *CLIP))
    compliance, error = (results.size(measured[each]) for each in STYLE)
    if setup.kind.name in TURNING:
        error = np.nan
    where = setup.body.name, setup.kind.name, seed
    return RunScore(*where, float(result), clipped, float(minutes), compliance, error, notes)


def of_policies(folder: Path, progress: Callable) -> list[RunScore]:
    """Play the protocol's episodes by the policies of a folder, and return their scores.

    What has an ending of `ENDINGS` or a name of `NAMES` is a policy, and the folder of a run. Weights, statistics and
    notes are none, nor are names that begin with `.` or `_`.

    Args:
        folder: of policies named `ROBOT-TASK-SEED`: a zip of stable-baselines3, a policy file (.npz), a module with a
            function `MAKE`, see `policies.policy`, or the folder of a run.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError: no policy in the folder, another name, two policies of a place and seed, or one that does not fit.
        OSError: a file cannot be read.
    """
    found = _by_name(folder)
    return [
        _of_policy(path, Setup.of(robot, task), seed)
        for (robot, task, seed), path in progress(found.items(), desc=str(folder), unit="policy", leave=False)
    ]


def _by_name(folder: Path) -> dict[tuple[str, str, int], Path]:
    """Return the policies of a folder by robot, task and seed, in the order of their names."""
    found: dict[tuple[str, str, int], Path] = {}
    with files.reading(folder):
        paths = sorted(filter(_is_policy, folder.iterdir()))
    for path in paths:
        if path.name not in NAMES:
            (near,) = difflib.get_close_matches(path.name, NAMES, n=1, cutoff=0.0)
            expected = f"ROBOT-TASK-SEED of a place and a seed from 0 to {SEEDS - 1}"
            raise ValueError(f"{path}: expected {expected}, such as {near}")
        if other := found.get(NAMES[path.name]):
            raise ValueError(f"{path}: expected one policy of this place and seed, got {other.name}, too")
        found[NAMES[path.name]] = path
    if not found:
        raise ValueError(f"{folder}: expected policies named ROBOT-TASK-SEED, such as tick-walk-0.zip, got none")
    return found


def _is_policy(path: Path) -> bool:
    return path.name[0] not in "._" and (
        path.suffix in ENDINGS or path.name in NAMES or policies.is_file(os.fspath(path))
    )


def _of_policy(path: Path, setup: Setup, seed: int) -> RunScore:
    environment = setup.load()
    name = f"{path}:{MAKE}" if path.suffix == named.MODULE else path
    known = provenance.training_seeds(str(name), range(evaluation.EPISODES)) is not None
    policy = policies.policy(name, setup.body, task=environment.task.definition)
    tracks = [style.record(environment, policy, seed) for seed in range(evaluation.CURVE_EPISODES)]
    others = evaluation.episodes(environment, policy, range(evaluation.CURVE_EPISODES, evaluation.EPISODES))
    every = [style.measure(track) for track in tracks]
    measured = {each: np.array([metrics[each].value for metrics in every]) for each in STYLE}
    result = np.mean([*(track.rewards.sum() for track in tracks), *(each.total for each in others)])
    notes = "" if known else provenance.UNKNOWN
    return _score(setup, seed, result, np.nan, measured, anchors.anchors(setup), notes)


def checked_name(name: str) -> str:
    """Return the name of a learner.

    Raises:
        ValueError: it has other characters than letters, digits, `_`, `-` and `.`.
    """
    if not _LEARNER.fullmatch(name):
        raise ValueError(f"--name={name}: expected letters, digits, _, - and .")
    return name


def write(studies: Path, division: str, learner: str, scores: Iterable[RunScore]) -> None:
    """Replace the scores of a learner in a division.

    Raises:
        ValueError: a damaged table of scores.
        OSError: it cannot be written.
    """
    owner = {"division": division, "learner": learner}
    others = [row for row in csv_files.read(studies / SCORES, COLUMNS) if not owner.items() <= row.items()]
    csv_files.write(studies / SCORES, COLUMNS, [*others, *(owner | each._asdict() for each in scores)])


def read(studies: Path) -> dict[tuple[str, str], list[RunScore]]:
    """Return the scores in a folder of studies by division and learner.

    Raises:
        ValueError: a damaged table.
        OSError: it cannot be read.
    """
    found: dict[tuple[str, str], list[RunScore]] = {}
    for row in csv_files.read(studies / SCORES, COLUMNS):
        division, learner, robot, task, seed, *numbers, notes = row.values()
        checks.name(division, DIVISIONS, "division")
        found.setdefault((division, learner), []).append(RunScore(robot, task, int(seed), *map(float, numbers), notes))
    return found


def text(studies: Path) -> str:
    """Return the table of the benchmark in Markdown: all learners in a folder of studies, by division and score.

    Raises:
        ValueError: no scores, or a damaged table of them.
        OSError: the table cannot be read.
    """
    lines = []
    for (division, learner), scores in read(studies).items():
        groups = by_place(scores)
        order = tuple(DIVISIONS).index(division), not all(groups.values()), -total(groups)[0]
        lines.append((*order, division, learner, *_cells(groups)))
    if not lines:
        raise ValueError(f"{studies}: no scores of the benchmark; run a division, or name another folder by --results")
    heads = ["division", "learner", "seeds", "total [95 %]", "lowest place", "CPU min to .5", *STYLE_HEADS]
    return table([*heads, *map(" ".join, PLACES), "notes"], [line[3:] for line in sorted(lines)])


def total(groups: Groups) -> tuple[float, tuple[float, float]]:
    """Return the mean over places of the mean score within a place, of those that have any, and its interval."""
    return evaluation.mean_and_interval([[each.score for each in group] for group in groups.values() if group])


def by_place(scores: Sequence[RunScore]) -> Groups:
    """Scores by place, of all `PLACES`; empty where there are none."""
    return {where: [each for each in scores if (each.robot, each.task) == where] for where in PLACES}


def _cells(groups: Groups) -> list[str]:
    """Cells of a learner. Every place weighs the same, however many seeds it has."""
    run = {where: group for where, group in groups.items() if group}
    seeds = [len(group) for group in run.values()]
    few, many = min(seeds), max(seeds)
    means = {where: float(np.mean([each.score for each in group])) for where, group in run.items()}
    lowest = min(means, key=means.__getitem__)
    minutes = float(np.median([np.median([each.minutes for each in group]) for group in run.values()]))
    return [
        f"{few}" if few == many else f"{few} to {many}",
        _total(groups, few) if len(run) == len(groups) else f"{len(run)} of {len(groups)} places",
        f"{' '.join(lowest)} {means[lowest]:z.2f}",
        f"{minutes:.1f}" if np.isfinite(minutes) else "-",
        *(f"{_mean_size(name, run):.3f}" for name in STYLE),
        *(f"{means[where]:z.2f}" if where in means else NOT_RUN for where in groups),
        _notes(groups),
    ]


def _total(groups: Groups, seeds: int) -> str:
    """The total, and its interval over two seeds or more."""
    mean, (low, high) = total(groups)
    return f"{mean:.3f}" + (f" [{low:.3f}, {high:.3f}]" if seeds > 1 else "")


def _mean_size(name: str, run: Groups) -> float:
    """Mean over places of the mean size of a metric of style."""
    return results.size(np.array([results.size(np.array([getattr(e, name) for e in group])) for group in run.values()]))


def _notes(groups: Groups) -> str:
    """What the total must not be compared with others for; a dash for nothing."""
    short = sum(len(group) < SEEDS for group in groups.values())
    found = [f"{short} of {len(groups)} places have fewer than {SEEDS} seeds"] * bool(short)
    found += [note for group in groups.values() for each in group for note in each.notes.split("; ") if note]
    return "; ".join(dict.fromkeys(found)) or "-"
