"""The benchmark: scores of runs on its divisions, see `divisions`, and of policies of other libraries.

studies/scores.csv holds a row for each run, by `write`. The table of all learners is made from this file alone.
"""

import contextlib
import difflib
import itertools
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite import checks, evaluation, files, policies, style
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, provenance
from arc_suite.learning.studies import csv_files, results
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS, TURNING
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.text_tables import table
from arc_suite.policies import Policy, frozen, named, network, other_libraries, separate
from arc_suite.policies.frozen import Frozen

SCORES = "scores.csv"
CLIP = (-0.5, 1.2)  # bounds of the score of a run
MAX_OVERRUN = 1.05  # largest share of the steps of a division that a run may make, as slices end a little later
HALF = 0.5  # score until which CPU time is counted
STYLE = ("gait_compliance", "heading_error")
STYLE_HEADS = ("gait compliance", "heading error, rad")
NOT_RUN = "not run"
_LEARNER_PATTERN = re.compile(r"[\w.-]+")
MAKE = "make"  # function of a module that makes a policy
ENDINGS = (*other_libraries.READERS, network.EXTENSION, named.PYTHON_EXTENSION)
# Robot, task and seed by the name of a policy in a folder.
NAMES = {
    f"{robot}-{task}-{seed}{ending}": (robot, task, seed)
    for (robot, task), seed, ending in itertools.product(PLACES, range(SEEDS), ("", *ENDINGS))
}


class RunScore(NamedTuple):
    """Result of a run; a line of `SCORES`.

    Attributes:
        robot, task: names of the robot and the task.
        seed: seed of the run.
        result: mean return of the protocol's episodes.
        score: score of the result, clipped to `CLIP`.
        minutes: CPU time until an evaluation had the score `HALF`; infinite if none had, NaN if unknown.
        gait_compliance: mean over ten episodes.
        heading_error: mean size over ten episodes, rad; NaN for tasks of `TURNING`.
        notes: reasons why the score is not comparable with others; empty without any.
        model_sha256: hash of the model in which the run learned, or in which a policy was judged; empty if unknown.
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
    model_sha256: str = ""


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
    configuration = result.run.configuration
    if result.steps[-1] > MAX_OVERRUN * configuration.steps:
        raise ValueError(
            f"run {result.run.name}: expected about {configuration.steps:,} environment steps, made "
            f"{result.steps[-1]:,}; its learner must yield a slice at the latest where the next evaluation is due"
        )
    setup = configuration.setup
    curve_scores = anchors.anchors(setup, result.curve_seeds).score(result.returns.mean(axis=1))
    reaching = np.flatnonzero(curve_scores >= HALF)
    minutes = result.cpu[reaching[0]] / 60.0 if reaching.size else np.inf
    notes = "; ".join(result.notes)
    score = anchors.anchors(setup, result.seeds).score(result.final)
    run_score = _run_score(setup, configuration.seed, result.final, score, minutes, result.style, notes)
    return run_score._replace(model_sha256=result.model_sha256)


def _run_score(
    setup: Setup,
    seed: int,
    mean_return: float,
    score: float,
    minutes: float,
    metrics: Mapping[str, np.ndarray],
    notes: str,
) -> RunScore:
    """Return the score of a run in the model that the code makes now.

    Args:
        setup: setup of the run.
        seed: seed of the run.
        mean_return: mean return of the protocol's episodes.
        score: score of this return.
        minutes: CPU time until the score `HALF`.
        metrics: metrics of style by name, each (episodes,).
        notes: notes on the score.
    """
    return RunScore(
        robot=setup.name,
        task=setup.kind.name,
        seed=seed,
        result=float(mean_return),
        score=float(np.clip(score, *CLIP)),
        minutes=float(minutes),
        gait_compliance=results.mean_size(metrics["gait_compliance"]),
        heading_error=np.nan if setup.kind.name in TURNING else results.mean_size(metrics["heading_error"]),
        notes=notes,
        model_sha256=results.hash_model(setup),
    )


def score_policies(folder: Path, progress: Callable) -> list[RunScore]:
    """Play the protocol's episodes by the policies of a folder, and return their scores.

    An entry of the folder is a policy if it has an ending of `ENDINGS` or a name of `NAMES`, or is the folder of a
    run. Weights, statistics, notes, and names that begin with `.` or `_` are skipped.

    Args:
        folder: folder of policies named `ROBOT-TASK-SEED`. A policy is a zip of stable-baselines3, a policy file
            (.npz), a module with a function `MAKE` (see `policies.policy`), or the folder of a run.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError: no policy in the folder, another name, two policies of a place and seed, or one that does not fit.
        OSError: a file cannot be read.
    """
    paths_by_run = _find_policies(folder)
    with contextlib.ExitStack() as stack:
        has_module = any(path.suffix == named.PYTHON_EXTENSION for path in paths_by_run.values())
        frozen_folder = stack.enter_context(frozen.freeze(folder)) if has_module else None
        bar = progress(paths_by_run.items(), desc=str(folder), unit="policy", leave=False)
        return [_score_policy(path, Setup.of(*place), seed, frozen_folder) for (*place, seed), path in bar]


def _find_policies(folder: Path) -> dict[tuple[str, str, int], Path]:
    """Return the paths of the policies in a folder by robot, task and seed, in the order of their names."""
    paths_by_run: dict[tuple[str, str, int], Path] = {}
    with files.reading(folder):
        paths = sorted(filter(_is_policy, folder.iterdir()))
    for path in paths:
        if path.name not in NAMES:
            (nearest_name,) = difflib.get_close_matches(path.name, NAMES, n=1, cutoff=0.0)
            expected = f"ROBOT-TASK-SEED of a place and a seed from 0 to {SEEDS - 1}"
            raise ValueError(f"{path}: expected {expected}, such as {nearest_name}")
        run = NAMES[path.name]
        if run in paths_by_run:
            raise ValueError(f"{path}: expected one policy of this place and seed, got {paths_by_run[run].name}, too")
        paths_by_run[run] = path
    if not paths_by_run:
        raise ValueError(f"{folder}: expected policies named ROBOT-TASK-SEED, such as tick-walk-0.zip, got none")
    return paths_by_run


def _is_policy(path: Path) -> bool:
    is_skipped = path.name[0] in "._"
    return not is_skipped and (path.suffix in ENDINGS or path.name in NAMES or policies.is_file(os.fspath(path)))


def _score_policy(path: Path, setup: Setup, seed: int, frozen_folder: Frozen | None) -> RunScore:
    """Play the protocol's episodes by a policy, and return its score.

    Args:
        path: path of the policy.
        setup: setup of its place.
        seed: seed of its training.
        frozen_folder: copy of its folder, which a module needs.
    """
    name = f"{path}:{MAKE}" if path.suffix == named.PYTHON_EXTENSION else str(path)
    training_seeds = provenance.training_seeds(name, range(evaluation.EPISODES))
    notes = provenance.UNKNOWN if training_seeds is None else ""

    # The first episodes are recorded, as their style is measured.
    seeds = range(evaluation.EPISODES)
    with contextlib.closing(setup.load()) as environment, _acting(path, setup, 1, frozen_folder) as policy:
        tracks = [style.record(environment, policy, episode) for episode in seeds[: evaluation.CURVE_EPISODES]]
    returns = [track.rewards.sum() for track in tracks]
    further_seeds = seeds[evaluation.CURVE_EPISODES :]
    if further_seeds:
        environments = setup.make_vec(len(further_seeds), autoreset_mode=AutoresetMode.DISABLED)
        acting = _acting(path, setup, len(further_seeds), frozen_folder)
        with contextlib.closing(environments), acting as policy:
            episodes = evaluation.episodes_in_batch(environments, policy, further_seeds)
        returns += [episode.total for episode in episodes]

    episode_metrics = [style.measure(track) for track in tracks]
    metrics = {metric: np.array([values[metric].value for values in episode_metrics]) for metric in STYLE}
    score = anchors.anchors(setup, range(evaluation.EPISODES)).score(np.mean(returns))
    return _run_score(setup, seed, float(np.mean(returns)), score, np.nan, metrics, notes)


@contextlib.contextmanager
def _acting(path: Path, setup: Setup, num_envs: int, frozen_folder: Frozen | None) -> Iterator[Policy]:
    """Make the policy of a file; a module acts in a process of its own, from the copy of its folder."""
    if path.suffix != named.PYTHON_EXTENSION:
        yield policies.policy(path, setup.body, num_envs=num_envs, task=setup.definition)
        return
    module = frozen_folder.path / path.name
    sizes = setup.definition.sizes
    policy = separate.Separate(module, MAKE, setup.body.name, num_envs, sizes, f"policy {path}")
    with contextlib.closing(policy):
        yield policy


def check_name(name: str) -> None:
    """Check the name of a learner.

    Raises:
        ValueError: it has other characters than letters, digits, `_`, `-` and `.`.
    """
    if not _LEARNER_PATTERN.fullmatch(name):
        raise ValueError(f"--name={name}: expected letters, digits, _, - and .")


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
        division, learner, robot, task, seed, *cells, notes, model_sha256 = row.values()
        checks.name(division, DIVISIONS, "division")
        score = RunScore(robot, task, int(seed), *map(float, cells), notes, model_sha256)
        if np.isinf((score.result, score.score)).any():
            raise ValueError(f"{studies / SCORES}: expected finite returns and scores, got {', '.join(cells)[:100]}")
        scores_by_learner.setdefault((division, learner), []).append(score)
    return scores_by_learner


def text(studies: Path) -> str:
    """Return the table of the benchmark in Markdown: all learners in a folder of studies, by division and score.

    Raises:
        ValueError: no scores, or a damaged table of them.
        OSError: the table cannot be read.
    """
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
    mean = f"{np.mean([score.score for score in scores]):z.2f}"
    by_seed = sorted(scores, key=lambda score: score.seed)
    return f"{mean} ({', '.join(f'{score.score:z.2f}' for score in by_seed)})" if len(scores) > 1 else mean


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
    models = [(Setup.of(*place), score.model_sha256) for place, scores in groups.items() for score in scores]
    notes += results.note_earlier_models(models)
    return "; ".join(dict.fromkeys(notes)) or "-"
