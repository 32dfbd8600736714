"""The benchmark: scores of runs on its divisions, see `divisions`, and of policies of other libraries.

studies/scores.csv holds a row for each run, by `write`. The table of all learners is made from this file alone.
"""

import itertools
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, evaluation, parsers, usage
from arc_suite.envs.setup import Setup
from arc_suite.learning.studies import csv_files, results
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS, TURNING, place_setup
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.tables import Run
from arc_suite.learning.studies.text_tables import score_of_seeds, table

SCORES = "scores.csv"
MAX_OVERRUN = 1.05  # largest share of the steps of a division that a run may make, as slices end a little later
HALF = 0.5  # score until which CPU time is counted
STYLE = ("gait_compliance", "heading_error")
STYLE_HEADS = ("gait compliance", "heading error, rad")
NOT_RUN = "not run"
_LEARNER_PATTERN = re.compile(r"[\w.-]+")


class RunScore(NamedTuple):
    """Result of a run; a line of `SCORES`.

    Attributes:
        robot, task: names of the robot and the task.
        seed: seed of the run.
        result: mean return of the episodes that judge it.
        score: score of the result.
        minutes: CPU time until an evaluation had the score `HALF`; infinite if none had, NaN if unknown.
        gait_compliance: mean over ten episodes.
        heading_error: mean size over ten episodes, rad; NaN for tasks of `TURNING`.
        policy_sha256: hash of the judged policy; empty for a run from before, which was judged on seeds 0 to 99.
        first_seed: seed of the first episode that judges it.
        notes: reasons why the score is not comparable with others; empty without any.
        physics_sha256: hash of the model in which the run learned, or in which a policy was judged; empty if unknown.
        task_kwargs: settings of the task as JSON; empty for those of the place.
    """

    robot: str
    task: str
    seed: int
    result: float
    score: float
    minutes: float
    gait_compliance: float
    heading_error: float
    policy_sha256: str = ""
    first_seed: int = 0
    notes: str = ""
    physics_sha256: str = ""
    task_kwargs: str = ""

    @property
    def setup(self) -> Setup:
        """Setup of the run."""
        if self.task_kwargs:
            return Setup.of(self.robot, self.task, json.loads(self.task_kwargs))
        return place_setup(self.robot, self.task)

    @property
    def policy_name(self) -> str:
        """Name under which the episodes of a policy of others are published."""
        return f"{self.robot}-{self.task}-{self.seed}"


COLUMNS = ("division", "learner", *RunScore._fields)  # columns of `SCORES`
Groups = Mapping[tuple[str, str], Sequence[RunScore]]  # scores by robot and task


def score_results(run_results: Iterable[RunResult]) -> list[RunScore]:
    """Return the scores of the runs that are finished."""
    return [_score_result(result) for result in run_results if result.steps[-1] >= result.run.configuration.steps]


def _score_result(result: RunResult) -> RunScore:
    """Return the score of a finished run.

    Raises:
        ValueError: the run has made more environment steps than its division gives.
    """
    check_budget(result.run, int(result.steps[-1]))
    setup = result.run.configuration.setup
    scale = results.anchors_of(result, result.curve_seeds)
    half = np.inf if scale is None else scale.at(HALF)
    reaching = np.flatnonzero(result.returns.mean(axis=1) >= half)
    minutes = result.cpu[reaching[0]] / 60.0 if reaching.size else np.inf
    return RunScore(
        robot=setup.name,
        task=setup.kind.name,
        seed=result.run.configuration.seed,
        result=result.final,
        score=results.score_of(result),
        minutes=float(minutes),
        **style_fields(setup, result.style),
        policy_sha256=result.policy_sha256,
        first_seed=result.seeds[0] if len(result.seeds) else 0,
        notes="; ".join(result.notes),
        physics_sha256=result.physics_sha256,
        task_kwargs=settings_cell(setup),
    )


def check_budget(run: Run, steps: int) -> None:
    """Check the steps of a run against those of its division.

    Raises:
        ValueError: they are more than `MAX_OVERRUN` allows.
    """
    expected_steps = run.configuration.steps
    max_steps = int(MAX_OVERRUN * expected_steps)
    if steps > max_steps:
        cure = "yield a slice at the latest at context.next_evaluation; steps of context.count_steps count, too"
        again = f"then remove the folder {run.name} of the runs, and train again"
        raise ValueError(
            f"run {run.name}: expected {expected_steps:,} steps, at most {max_steps:,}, made {steps:,}; {cure}; {again}"
        )


def settings_cell(setup: Setup) -> str:
    """Return the settings of a setup's task as JSON."""
    return json.dumps(dict(setup.task_kwargs))


def style_fields(setup: Setup, metrics: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return the fields of a score that tell the style, given metrics by name, each (episodes,)."""
    turns = setup.kind.name in TURNING
    return {
        "gait_compliance": results.mean_size(metrics["gait_compliance"]),
        "heading_error": np.nan if turns else results.mean_size(metrics["heading_error"]),
    }


def check_name(name: str) -> None:
    """Check the name of a learner.

    Raises:
        ValueError: it has other characters than letters, digits, `_`, `-` and `.`.
    """
    if not _LEARNER_PATTERN.fullmatch(name):
        raise ValueError(f"name {name}: expected letters, digits, _, - and .")


def write(studies: Path, division: str, learner: str, scores: Iterable[RunScore]) -> None:
    """Replace the scores of a learner in a division.

    Args:
        studies: folder of the table of scores.
        division: name of the division.
        learner: name of the learner.
        scores: scores of its runs.

    Raises:
        ValueError: a damaged table of scores.
        OSError: the table cannot be written.
    """
    path = studies / SCORES
    key = {"division": division, "learner": learner}
    rows: list[Mapping[str, object]] = [row for row in csv_files.read(path, COLUMNS) if not key.items() <= row.items()]
    rows += [key | score._asdict() for score in scores]
    csv_files.write(path, COLUMNS, rows)


def read(studies: Path) -> dict[tuple[str, str], list[RunScore]]:
    """Return the scores in a folder of studies by division and learner.

    Raises:
        ValueError: a damaged table.
        OSError: the table cannot be read.
    """
    scores_by_learner: dict[tuple[str, str], list[RunScore]] = {}
    for row in csv_files.read(studies / SCORES, COLUMNS):
        with parsers.guard(f"{studies / SCORES}"):
            division = checks.name(row.pop("division"), DIVISIONS, "division")
            learner = row.pop("learner")
            cells = {name: kind(row[name]) for name, kind in RunScore.__annotations__.items()}
        score = RunScore(**cells)
        if np.isinf((score.result, score.score)).any():
            what = f"got {score.result} and {score.score}"
            raise ValueError(f"{studies / SCORES}: expected finite returns and scores, {what}")
        scores_by_learner.setdefault((division, learner), []).append(score)
    return scores_by_learner


def check_tables(studies: Path) -> None:
    """Check the tables from which the scores in a folder of studies come, where it has them.

    Raises:
        ValueError: a damaged table, or a source that its division does not give.
        OSError: a table cannot be read.
    """
    for (division, learner), scores in read(studies).items():
        published = studies / f"{division}-{learner}"
        if (published / results.RUNS).exists():
            results.check_tables(published, declared_source(division, scores))
        elif (published / results.FINALS).exists():
            read_finals(published, scores)


def declared_source(division: str, scores: Sequence[RunScore]) -> str:
    """Return what an algorithm declares that it learns from: by the notes of its scores, as the division or unknown."""
    is_declared = bool(scores) and not any(results.UNKNOWN_SOURCE in score.notes for score in scores)
    return DIVISIONS[division].source if is_declared else usage.UNKNOWN


def read_finals(published: Path, scores: Sequence[RunScore]) -> Mapping[str, Sequence[Mapping[str, str]]]:
    """Return the episodes that judge policies of others, by name of the policy, from the folder of their table.

    Raises:
        ValueError: a damaged table, or one without the episodes of a policy.
        OSError: the table cannot be read.
    """
    lines_by_policy = results.read_episodes(published, results.FINALS)
    with parsers.guard(f"{published / results.FINALS}: damaged"):
        for score in scores:
            results.check_finals(score.policy_name, lines_by_policy[score.policy_name], score.policy_sha256)
    return lines_by_policy


def text(studies: Path) -> str:
    """Return the table of the benchmark in Markdown: all learners in a folder of studies, by division and score.

    Raises:
        ValueError: no scores, a damaged table of them, or as `check_tables`.
        OSError: a table cannot be read.
    """
    check_tables(studies)
    lines = []
    for (division, learner), scores in read(studies).items():
        groups = group_by_place(scores)
        has_all_places = all(groups.values())
        mean, _ = total(groups)
        # By division, then complete learners first, then by falling total.
        sort_key = (tuple(DIVISIONS).index(division), not has_all_places, -mean)
        lines.append((sort_key, [division, learner, *_result_cells(groups)]))
    if not lines:
        raise ValueError(f"{studies}: no scores of the benchmark; run a division, or name another folder by --results")
    lines.sort()
    heads = ["division", "learner", "seeds", "total [95 %]", "lowest place", "CPU min to .5", *STYLE_HEADS]
    place_heads = [f"{robot} {task}" for robot, task in PLACES]
    return table([*heads, *place_heads, "notes"], [cells for _, cells in lines])


def total(groups: Groups) -> tuple[float, tuple[float, float]]:
    """Return the mean over places with scores of the mean score within a place, and its interval."""
    return evaluation.mean_and_interval([[score.score for score in scores] for scores in groups.values() if scores])


def group_by_place(scores: Sequence[RunScore]) -> Groups:
    """Return scores by place, for all `PLACES`; empty where there are none."""
    groups: dict[tuple[str, str], list[RunScore]] = {place: [] for place in PLACES}
    for score in scores:
        place = (score.robot, score.task)
        if place in groups:
            groups[place].append(score)
    return groups


def _result_cells(groups: Groups) -> list[str]:
    """Return the cells of a learner. Every place weighs the same, however many seeds it has."""
    nonempty_groups = {place: scores for place, scores in groups.items() if scores}
    seed_counts = [len(scores) for scores in nonempty_groups.values()]
    fewest_seeds = min(seed_counts)
    most_seeds = max(seed_counts)
    seeds = f"{fewest_seeds}" if fewest_seeds == most_seeds else f"{fewest_seeds} to {most_seeds}"
    if len(nonempty_groups) == len(groups):
        total_cell = _total_text(groups)
    else:
        total_cell = f"{len(nonempty_groups)} of {len(groups)} places"

    mean_scores = {}
    median_minutes = []
    for place, scores in nonempty_groups.items():
        mean_scores[place] = float(np.mean([score.score for score in scores]))
        median_minutes.append(np.median([score.minutes for score in scores]))
    lowest_place = min(mean_scores, key=mean_scores.__getitem__)
    minutes = float(np.median(median_minutes))
    return [
        seeds,
        total_cell,
        f"{' '.join(lowest_place)} {mean_scores[lowest_place]:z.2f}",
        f"{minutes:.1f}" if np.isfinite(minutes) else "-",
        *(f"{_mean_style(name, nonempty_groups):.3f}" for name in STYLE),
        *(_place_text(scores) for scores in groups.values()),
        _notes_text(groups),
    ]


def _total_text(groups: Groups) -> str:
    """Return the total as text, and its interval if all places have enough seeds."""
    mean, (low, high) = total(groups)
    return f"{mean:.3f} [{low:.3f}, {high:.3f}]" if np.isfinite(low) else f"{mean:.3f}"


def _place_text(scores: Sequence[RunScore]) -> str:
    """Return the mean score in a place as text, and the score of each seed if there are several."""
    if not scores:
        return NOT_RUN
    by_seed = sorted(scores, key=lambda score: score.seed)
    return score_of_seeds([score.score for score in by_seed])


def _mean_style(name: str, groups: Groups) -> float:
    """Return the mean over places of the mean size of a metric of style."""
    sizes = []
    for scores in groups.values():
        values = np.array([getattr(score, name) for score in scores])
        sizes.append(results.mean_size(values))
    return results.mean_size(np.array(sizes))


def _notes_text(groups: Groups) -> str:
    """Return the reasons why the total is not comparable with others; a dash without any."""
    notes = []
    places_with_few_seeds = sum(len(scores) < SEEDS for scores in groups.values())
    if places_with_few_seeds:
        notes.append(f"{places_with_few_seeds} of {len(groups)} places have fewer than {SEEDS} seeds")
    for scores in groups.values():
        for score in scores:
            notes += [note for note in score.notes.split("; ") if note]
        notes += results.note_same_policy(score.policy_sha256 for score in scores)
    all_scores = itertools.chain(*groups.values())
    notes += results.note_earlier_models((score.setup, score.physics_sha256) for score in all_scores)
    return "; ".join(dict.fromkeys(notes)) or "-"
