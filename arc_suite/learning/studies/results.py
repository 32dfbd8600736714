"""Results of studies: the published tables of their runs, and statistics over them."""

import dataclasses
import functools
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import evaluation, parsers, usage
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging, provenance
from arc_suite.evaluation.anchors import Anchors
from arc_suite.evaluation.judging import Level
from arc_suite.evaluation.published import CURVES
from arc_suite.learning.agents.configuration import CONFIGURATION_FIELDS, PROVENANCE_FIELDS, TRAINING_SEEDS
from arc_suite.learning.finals import are_of
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.tables import Run
from arc_suite.seed_ranges import EVALUATION, Ranges, common_seeds, from_json
from arc_suite.simulation.model_hash import PHYSICS

# Files of a study's tables.
RUNS = "runs.csv"
EVALUATIONS = "evaluations.csv"  # a line for each episode
FINALS = "finals.csv"  # a line for each episode that judges a final policy, with the hash of the policy
DEMONSTRATORS = "demonstrators.csv"

SOURCES = "sources"  # column of the table of runs
# Columns of the table of runs: the configuration, the updates of stabilization phases by environment step, and what the
# run has used (`usage.Usage`), which is empty for runs from before.
RUN_COLUMNS = ("run", "kind", *CONFIGURATION_FIELDS, *PROVENANCE_FIELDS, "phases", *usage.STEP_COUNTS, SOURCES)
TIMES = ("wall_seconds", "cpu_seconds")  # from the start of the run to the end of an evaluation
STYLE = "style_"  # prefix of the columns with metrics of style, which the latest evaluation has
_NOT_METRICS = (
    "run",
    "step",
    "policy_sha256",
    "seed",
    "return",
    "length",
    *TIMES,
)  # columns of an episode without a metric

# Notes on a final return.
SHARED_SEEDS = "data share seeds with evaluation"
TEN_EPISODES = "ten episodes"
# Of runs of earlier versions, whose commands give other returns now.
SEEN_SEEDS = "judged on seeds from 0 on"
NOT_JUDGED = "not judged"
EASIER_GROUND = "easier ground"
OTHER_SETTINGS = "other settings of the task"
EARLIER_MODEL = "earlier model"
UNKNOWN_SOURCE = "source unknown"
SAME_POLICY = "seeds with one policy"


class RunResult(NamedTuple):
    """Result of a run.

    Attributes:
        run: the run; a run from before may have other settings of the task than the study has now.
        steps: (evaluations,) environment steps before each evaluation.
        returns: (evaluations, episodes) returns of the learning curve.
        finals: (episodes,) returns of the latest policy, in the episodes that judge it if it is judged.
        progress: metrics of the task in the latest evaluation by name, each (episodes,).
        cpu: (evaluations,) s of CPU time before the end of each evaluation.
        style: metrics of style of the latest policy by name, each (episodes,).
        phases: (phases,) updates of each stabilization phase; empty if they are not published.
        training_seeds: seeds of the episodes that the run learned from; None if they are unknown.
        seeds: seeds of the episodes of `finals`; empty if they are unknown.
        physics_sha256: hash of the model in which the run learned; empty if it is unknown.
        curve_seeds: seeds of the episodes of `returns`; empty if they are unknown.
        policy_sha256: hash of the judged policy; empty if it is not judged.
        other_settings: whether the task had other settings than the study has now.
        sources: what the run has learned from in addition to its own steps; empty if it is unknown.
    """

    run: Run
    steps: np.ndarray
    returns: np.ndarray
    finals: np.ndarray
    progress: dict[str, np.ndarray]
    cpu: np.ndarray
    style: dict[str, np.ndarray]
    phases: np.ndarray
    training_seeds: Ranges | None = ()
    seeds: Sequence[int] = ()
    physics_sha256: str = ""
    curve_seeds: Sequence[int] = ()
    policy_sha256: str = ""
    other_settings: bool = False
    sources: Sequence[str] = ()

    @property
    def final(self) -> float:
        """Mean return of the latest policy."""
        return float(self.finals.mean())

    @property
    def notes(self) -> tuple[str, ...]:
        """Reasons why the final return is not comparable with others."""
        reasons = list(note_few_episodes(self.finals))
        if not self.policy_sha256:
            reasons.append(SEEN_SEEDS if anchors.are_of_before(self.seeds) else NOT_JUDGED)
        if self.other_settings:
            reasons.append(OTHER_SETTINGS if self.run.configuration.setup.task_kwargs else EASIER_GROUND)
        declared_source = self.run.configuration.definition.source
        if declared_source == usage.UNKNOWN:
            reasons.append(UNKNOWN_SOURCE)
        reasons += [f"has used {source}" for source in self.sources if source != declared_source]
        if self.training_seeds is None:
            reasons.append(provenance.UNKNOWN)
        elif common_seeds(self.training_seeds, EVALUATION):
            reasons.append(SHARED_SEEDS)
        return tuple(reasons)


Groups = Mapping[str, Mapping[str, Sequence[RunResult]]]  # results by place and kind


def read_results(runs: Sequence[Run], published: Path) -> list[RunResult]:
    """Return the results of the published runs among the runs of a study.

    Args:
        runs: runs of the study.
        published: folder of the study's tables.

    Raises:
        ValueError: a damaged table.
        OSError: a table cannot be read.
    """
    tables = _read_tables(published)
    study_results = []
    for run in runs:
        if run.name in tables.episodes:
            _check_run(published, tables, run.name, run.configuration.definition.source)
            study_results.append(_result(run, published, tables))
    return study_results


def check_tables(published: Path, source: str = usage.UNKNOWN) -> None:
    """Check the tables of a study: counts of episodes, steps, seeds of the episodes that judge policies, and sources.

    Args:
        published: folder of the study's tables.
        source: what its algorithms declare that they learn from; unknown to allow all sources.

    Raises:
        ValueError: a damaged table, which the line begins with.
        OSError: a table cannot be read.
    """
    tables = _read_tables(published)
    for name in tables.episodes:
        _check_run(published, tables, name, source)


class _Tables(NamedTuple):
    """Tables of a study.

    Attributes:
        episodes: rows of the evaluations by run.
        finals: rows of the episodes that judge the latest policies by run; without runs from before or unfinished ones.
        run_rows: row of each run by its name.
    """

    episodes: Mapping[str, Sequence[Mapping[str, str]]]
    finals: Mapping[str, Sequence[Mapping[str, str]]]
    run_rows: Mapping[str, Mapping[str, str]]


def _read_tables(published: Path) -> _Tables:
    """Return the tables in the folder of a study."""
    run_rows = {row["run"]: row for row in csv_files.read(published / RUNS, RUN_COLUMNS)}
    return _Tables(read_episodes(published), read_episodes(published, FINALS), run_rows)


def _check_run(published: Path, tables: _Tables, name: str, source: str) -> None:
    """Check the rows of a run; see `check_tables`."""
    with parsers.guard(f"{published / EVALUATIONS}: damaged"):
        evaluations = _group_by_step(tables.episodes[name])
        _check_counts(name, [len(evaluation_rows) for evaluation_rows in evaluations])
        last_step = int(evaluations[-1][0]["step"])
    with parsers.guard(f"{published / RUNS}: damaged"):
        _check_steps(name, tables.run_rows[name], last_step)
        _check_sources(name, tables.run_rows[name], source)
    if name in tables.finals:
        finals = tables.finals[name]
        with parsers.guard(f"{published / FINALS}: damaged"):
            check_finals(name, finals, finals[0]["policy_sha256"])


def read_episodes(published: Path, table: str = EVALUATIONS) -> dict[str, list[dict[str, str]]]:
    """Return the rows of a table of episodes by run, without the columns that a row leaves empty."""
    rows_by_run: dict[str, list[dict[str, str]]] = {}
    for row in csv_files.read(published / table):
        cells = {column: text for column, text in row.items() if text}
        rows_by_run.setdefault(row["run"], []).append(cells)
    return rows_by_run


def _result(run: Run, published: Path, tables: _Tables) -> RunResult:
    """Return the result of a run from its rows in the tables of a folder."""
    evaluations = _group_by_step(tables.episodes[run.name])
    latest = evaluations[-1]
    judged = tables.finals.get(run.name, latest)
    judged_table = FINALS if run.name in tables.finals else EVALUATIONS

    def curve_column(name: str) -> np.ndarray:
        """Return a column of the episodes of the curve, (evaluations, episodes)."""
        first_episodes = [evaluation_rows[: evaluation.CURVE_EPISODES] for evaluation_rows in evaluations]
        return np.array([[row[name] for row in rows] for rows in first_episodes], float)

    with parsers.guard(f"{published / EVALUATIONS}: damaged"):
        curve_values = {
            "steps": curve_column("step")[:, 0].astype(int),
            "returns": curve_column("return"),
            "cpu": curve_column("cpu_seconds")[:, 0],
            "style": _read_style(latest),
            "curve_seeds": [int(row["seed"]) for row in latest[: evaluation.CURVE_EPISODES]],
        }
    with parsers.guard(f"{published / judged_table}: damaged"):
        judged_values = {
            "finals": np.array([row["return"] for row in judged], float),
            "progress": _read_metrics(judged),
            "seeds": [int(row["seed"]) for row in judged],
            "policy_sha256": judged[0].get("policy_sha256", ""),
        }
    with parsers.guard(f"{published / RUNS}: damaged"):
        run_row = tables.run_rows[run.name]
        published_run = _with_settings(run, run_row["task_kwargs"])
        updates_by_step = json.loads(run_row["phases"] or "{}")
        run_values = {
            "run": published_run,
            "phases": np.array(list(updates_by_step.values())),
            "training_seeds": from_json(json.loads(run_row[TRAINING_SEEDS] or "null")),
            "physics_sha256": run_row[PHYSICS],
            "other_settings": published_run != run,
            "sources": json.loads(run_row[SOURCES] or "[]"),
        }
    return RunResult(**curve_values, **judged_values, **run_values)


def _read_metrics(episodes: Sequence[Mapping[str, str]]) -> dict[str, np.ndarray]:
    """Return the metrics of the task by name, each (episodes,)."""
    names = [name for name in episodes[0] if name not in _NOT_METRICS and not name.startswith(STYLE)]
    return {name: np.array([row[name] for row in episodes], float) for name in names}


def _read_style(episodes: Sequence[Mapping[str, str]]) -> dict[str, np.ndarray]:
    """Return the metrics of style by name, each of the episodes that have it."""
    columns = [column for column in episodes[0] if column.startswith(STYLE)]
    return {
        column.removeprefix(STYLE): np.array([row[column] for row in episodes if column in row], float)
        for column in columns
    }


def _group_by_step(episodes: Sequence[Mapping[str, str]]) -> list[list[Mapping[str, str]]]:
    """Return the rows of each evaluation."""
    episodes_by_step: dict[str, list[Mapping[str, str]]] = {}
    for episode in episodes:
        episodes_by_step.setdefault(episode["step"], []).append(episode)
    return list(episodes_by_step.values())


def _with_settings(run: Run, settings_text: str) -> Run:
    """Return a run with the settings of the task in a cell of the table of runs; unchanged for an empty cell."""
    setup = run.configuration.setup
    if not settings_text or json.loads(settings_text) == setup.task_kwargs:
        return run
    published_setup = Setup.of(setup.domain, setup.task, json.loads(settings_text))
    return run._replace(configuration=dataclasses.replace(run.configuration, setup=published_setup))


def _check_counts(name: str, counts: Sequence[int]) -> None:
    """Check how many episodes each evaluation of a run has: those of the curve, and in the latest maybe all."""
    few = evaluation.CURVE_EPISODES
    earlier_are_right = all(count == few for count in counts[:-1])
    if not earlier_are_right or counts[-1] not in (few, evaluation.EPISODES):
        raise ValueError(f"{name}: expected {few} episodes of a step, got {counts}")


def _check_steps(name: str, run_row: Mapping[str, str], last_step: int) -> None:
    """Check that a run's count of steps in the table of runs, if it has one, is the step of its latest evaluation."""
    counts = [int(run_row[column]) for column in usage.STEP_COUNTS if run_row[column]]
    if counts and sum(counts) != last_step:
        raise ValueError(f"{name}: expected the {last_step:,} steps of {EVALUATIONS}, got {sum(counts):,}")


def _check_sources(name: str, run_row: Mapping[str, str], source: str) -> None:
    """Check that a run has used no other source than its algorithm declares; one that is unknown allows all."""
    other_sources = [used for used in json.loads(run_row[SOURCES] or "[]") if used != source]
    if source != usage.UNKNOWN and other_sources:
        expected = "no source" if source == usage.NOTHING else f"no source but {source}"
        raise ValueError(f"{name}: expected {expected}, got {', '.join(other_sources)}")


def check_finals(name: str, finals: Sequence[Mapping[str, str]], sha256: str) -> None:
    """Check that the episodes that judge a policy are those that follow from its hash.

    Raises:
        ValueError: they are not.
    """
    if not are_of(finals, sha256):
        expected_seeds = judging.seeds_of(sha256)
        expected = f"{len(expected_seeds)} episodes from seed {expected_seeds.start} on, which follow from the hash"
        raise ValueError(f"{name}: expected {expected} of one policy")


def read_demonstrators(published: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the returns of standing still and of demonstrators, (episodes,), by place (`Run.place`) and policy."""
    path = published / DEMONSTRATORS
    return anchors.read(path) if path.exists() else {}


def group_by_place(results: Sequence[RunResult]) -> Groups:
    """Return results by place and kind, with the results of all seeds in each."""
    groups: dict[str, dict[str, list[RunResult]]] = {}
    for result in results:
        kinds = groups.setdefault(result.run.place, {})
        kinds.setdefault(result.run.kind, []).append(result)
    return groups


Demonstrators = Mapping[str, Mapping[str, np.ndarray]]  # see `read_demonstrators`


def score_of(result: RunResult, demonstrators: Demonstrators | None = None) -> float:
    """Return the score of the latest policy of a run; NaN without anchors.

    Args:
        result: result of the run.
        demonstrators: returns that the study has measured, for places without committed anchors; None for none.
    """
    scale = anchors_of(result, result.seeds, demonstrators)
    return np.nan if scale is None else float(scale.score(result.final))


def anchors_of(result: RunResult, seeds: Sequence[int], demonstrators: Demonstrators | None = None) -> Anchors | None:
    """Return the anchors for episodes of a result; None where none are known; see `levels_of`."""
    levels = levels_of(result, seeds, demonstrators)
    return None if levels is None else anchors.of_levels(levels)


def levels_of(
    result: RunResult, seeds: Sequence[int], demonstrators: Demonstrators | None = None
) -> Mapping[str, Level] | None:
    """Return the mean returns of the policies that are anchors for episodes of a result; None where none are known.

    They are the committed ones, see `anchors.committed_levels`, or else those of the study.

    Args:
        result: result of a run.
        seeds: seeds of the episodes.
        demonstrators: returns that the study has measured; None for none.
    """
    levels = anchors.committed_levels(result.run.configuration.setup, seeds)
    if levels is not None:
        return levels
    returns_by_policy = (demonstrators or {}).get(result.run.place)
    return None if returns_by_policy is None else anchors.levels_of_returns(returns_by_policy, seeds)


def is_in_paper(result: RunResult) -> bool:
    """Return whether the paper's curves have a run."""
    setup = result.run.configuration.setup
    algorithm = result.run.configuration.algorithm
    is_default_walk = setup.kind.name == "walk" and not setup.task_kwargs and not result.run.label
    return is_default_walk and algorithm in CURVES.get(setup.name, {})


def note_few_episodes(returns: np.ndarray) -> tuple[str, ...]:
    """Return a note if there are fewer returns (episodes,) than a final policy has; none otherwise."""
    return (TEN_EPISODES,) if len(returns) < evaluation.EPISODES else ()


def note_earlier_models(models: Iterable[tuple[Setup, str]]) -> tuple[str, ...]:
    """Return a note if runs learned in another model than the code makes now; none otherwise.

    Args:
        models: setup of each run, and the hash of its model; empty if it is unknown.
    """
    are_earlier = [model not in ("", hash_physics(setup)) for setup, model in models]
    if not any(are_earlier):
        return ()
    return (EARLIER_MODEL if all(are_earlier) else f"{EARLIER_MODEL}: {sum(are_earlier)} of {len(are_earlier)} runs",)


def note_same_policy(hashes: Iterable[str]) -> tuple[str, ...]:
    """Return a note if seeds of one place have one policy; none otherwise.

    Args:
        hashes: hash of the policy of each seed; empty if it is unknown.
    """
    known_hashes = [sha256 for sha256 in hashes if sha256]
    return (SAME_POLICY,) if len(set(known_hashes)) < len(known_hashes) else ()


@functools.cache
def hash_physics(setup: Setup) -> str:
    """Return the hash of the model of a setup, as the code makes it now; empty for several bodies."""
    return "" if setup.several else setup.physics_sha256


def join_notes(seeds: Sequence[RunResult]) -> str:
    """Return the notes of all results without repetitions; a dash without any."""
    notes = [note for result in seeds for note in result.notes]
    notes += note_earlier_models((result.run.configuration.setup, result.physics_sha256) for result in seeds)
    notes += note_same_policy(result.policy_sha256 for result in seeds)
    return "; ".join(dict.fromkeys(notes)) or "-"


def final_returns(seeds: Sequence[RunResult]) -> np.ndarray:
    """Return the mean return of the latest policy of each seed, (seeds,)."""
    return np.array([result.final for result in seeds])


def curve(seeds: Sequence[RunResult]) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (points,) of the evaluations that all seeds have, and the mean returns (seeds, points)."""
    steps = functools.reduce(np.intersect1d, (result.steps for result in seeds))
    return steps, np.array([result.returns.mean(axis=1)[np.isin(result.steps, steps)] for result in seeds])


def mean_size(values: np.ndarray) -> float:
    """Return the mean absolute value of the finite values; NaN without any."""
    sizes = np.abs(values[np.isfinite(values)])
    return float(sizes.mean()) if sizes.size else np.nan


def cost_of_return(seeds: Sequence[RunResult], threshold: float) -> tuple[float, float]:
    """Return the environment steps and the s of CPU time until an evaluation has a mean return of `threshold`.

    Returns:
        Means over the seeds; infinite if a seed has not reached it.
    """
    costs = []
    for result in seeds:
        reaching = np.flatnonzero(result.returns.mean(axis=1) >= threshold)
        if reaching.size:
            first = reaching[0]
            costs.append((result.steps[first], result.cpu[first]))
        else:
            costs.append((np.inf, np.inf))
    steps, seconds = np.mean(costs, axis=0)
    return float(steps), float(seconds)
