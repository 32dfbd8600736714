"""Reports of studies: Markdown and curves, of published tables alone."""

import io
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from arc_suite import evaluation, files
from arc_suite.evaluation import anchors, judging, published
from arc_suite.evaluation.judging import Level
from arc_suite.learning.studies import results
from arc_suite.learning.studies.results import Groups, RunResult
from arc_suite.learning.studies.tables import Study
from arc_suite.learning.studies.text_tables import table
from arc_suite.simulation import films

REPORT = "README.md"
CURVES = "curves.png"
OF_BENCHMARK = "of the benchmark"
Sections = Mapping[str, Sequence[str]]  # paragraphs of each section of a report, by its title


def write(name: str, study: Study, published: Path, further: Sections | None = None) -> Path:
    """Write the report of a study into the folder of its tables.

    Args:
        name: name of the study.
        study: study.
        published: folder of its tables.
        further: sections to append; None for none.

    Returns:
        The path of the report.

    Raises:
        ValueError: nothing is published, or a table is damaged.
        OSError: a file cannot be written.
    """
    study_results = results.read_results(study.runs, published)
    if not study_results:
        raise ValueError(f"{published}: holds no results of the study {name}")
    groups = results.group_by_place(study_results)
    demonstrators = results.read_demonstrators(published)
    sections: dict[str, Sequence[str]] = {
        f"Study {name}": [_title(study, study_results), _progress_table(study_results)],
        "Curves": [_describe_curves(groups), f"![Returns over environment steps]({CURVES})"],
        "Final returns": [_ABOUT_FINALS, _finals_table(groups, demonstrators)],
        "Sample efficiency": [_ABOUT_EFFICIENCY, _efficiency_table(groups, demonstrators)],
    }
    if any(len(result.phases) for result in study_results):
        sections["Phases"] = [_ABOUT_PHASES, _phases_table(groups)]
    sections["Style"] = [_ABOUT_STYLE, _style_table(groups)]
    sections.update(further or {})
    _write_plot(published / CURVES, _plot_curves(groups, demonstrators))
    files.write(published / REPORT, _join_sections(sections))
    return published / REPORT


# First paragraphs of the sections.
_ABOUT_CURVES = (
    "Mean over seeds, with its 95 % interval (Student's t) if there are three or more; it may leave the range of "
    "returns. Dashed: standing still and demonstrators."
)
_ABOUT_PAPER = " Dotted: the paper's returns at the last step, from 50,000 on."
_ABOUT_FINALS = (
    "Mean over 100 seeded episodes of the latest policy, unless noted. Over three seeds or more it has a 95 % interval "
    "(Student's t). Score: (return - standing still) / (best demonstrator - standing still), over the same episodes or "
    "as the benchmark judges. Earlier model: the body or the ground has changed since the run. Judged on seeds from 0 "
    "on: a run of an earlier version, whose command gives another return now. The paper's returns are "
    "at equal steps, read off its curves within about 30. Then come standing still and the demonstrators: mean +- "
    "standard error. Anchors have the scores 0 and 1, for runs of as many episodes as the note says."
)
_ABOUT_EFFICIENCY = (
    "Environment steps and minutes of one core until an evaluation has the score 0.5, and the return 3,500; a dash if "
    "it has not. Area is the mean return over all evaluations so far."
)
_ABOUT_PHASES = (
    "Updates of the critics alone in a stabilization phase, for runs with published phases: those of `speq` and "
    "`speq_o2o` have the full length, the others may end early."
)
_ABOUT_STYLE = (
    "Mean size over ten episodes of the latest policy of each seed; `pydoc arc_suite.style.metrics` explains each. "
    "Heading and drift are relative to the x axis, which is not the direction of a command that turns."
)


def _join_sections(sections: Sections) -> str:
    """Return the text of a page of sections; the first title is that of the page."""
    paragraphs = []
    for title, section_paragraphs in sections.items():
        heading = f"## {title}" if paragraphs else f"# {title}"
        paragraphs += [heading, *section_paragraphs]
    return "\n\n".join(paragraphs) + "\n"


def _title(study: Study, study_results: Sequence[RunResult]) -> str:
    """Return the title of a study as a sentence, and how many of its runs have begun unless all have."""
    title = study.title[0].upper() + study.title[1:] + "."
    if len(study_results) == len(study.runs):
        return title
    return f"{title} Begun: {len(study_results)} of {len(study.runs)} runs."


def _progress_table(study_results: Sequence[RunResult]) -> str:
    """Return the table of runs with their steps and CPU time."""
    lines = []
    for result in study_results:
        configuration = result.run.configuration
        cells = (
            result.run.place,
            result.run.kind,
            str(configuration.seed),
            f"{result.steps[-1]:,} of {configuration.steps:,}",
            f"{result.cpu[-1] / 60.0:.1f}",
            f"`{configuration.command}`",
        )
        lines.append(cells)
    return table(("robot, task", "algorithm", "seed", "steps", "CPU min", "command"), lines)


def _write_plot(path: Path, figure) -> None:
    """Write a figure as a small picture."""
    drawing = io.BytesIO()
    figure.savefig(drawing)
    with files.writing(path) as temporary:
        films.write_small_png(temporary, Image.open(drawing))


def _plot_curves(groups: Groups, demonstrators):
    """Return the figure of the learning curves, a panel for each place."""
    from arc_suite.learning.agents import plots  # needs matplotlib

    curves_by_place = {}
    paper_returns_by_place = {}
    levels_by_place = {}
    for place, kinds in groups.items():
        curves = {}
        for kind, seeds in kinds.items():
            steps, mean_returns = results.curve(seeds)
            if steps.size:
                curves[kind] = plots.Curve(seeds[0].run.configuration.algorithm, steps, mean_returns)
        if not curves:  # unfinished runs, whose evaluations have no step in common
            continue
        curves_by_place[place] = curves
        first_kind = next(iter(kinds.values()))
        setup = first_kind[0].run.configuration.setup
        algorithms = [curve.algorithm for curve in curves.values()]
        last_step = max(curve.steps[-1] for curve in curves.values())
        paper_returns_by_place[place] = evaluation.published_returns(setup, algorithms, last_step)
        levels = _shown_levels(first_kind[0], demonstrators)
        levels_by_place[place] = {_policy_label(name): level.mean for name, level in levels.items()}
    return plots.plot_study(curves_by_place, levels_by_place, paper_returns_by_place)


def _describe_curves(groups: Groups) -> str:
    """Return what the curves of a study show; the paper's returns only where a run has any."""
    has_paper_returns = any(_paper_return(seeds[0], max(seeds[0].steps)) != "-" for _, _, seeds in by_kind(groups))
    return _ABOUT_CURVES + _ABOUT_PAPER * has_paper_returns


def by_kind(groups: Groups) -> Iterator[tuple[str, str, Sequence[RunResult]]]:
    """Yield place, kind and results of each kind of run."""
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            yield place, kind, seeds


def _policy_label(name: str) -> str:
    """Return the label of standing still or of a demonstrator by the name of its policy."""
    labels = {anchors.ZERO: "standing still", judging.BLIND: "blind walker"}
    return labels.get(name, f"demonstrator {name}")


def interval_text(values: np.ndarray) -> str:
    """Return the interval of the mean of returns (seeds,) as text; a dash for too few seeds."""
    _, (low, high) = evaluation.mean_and_interval([values])
    return f"[{low:.1f}, {high:.1f}]" if np.isfinite(low) else "-"


def list_text(values: np.ndarray) -> str:
    """Return the returns (seeds,) as text."""
    return ", ".join(f"{value:.1f}" for value in values)


def score_text(seeds: Sequence[RunResult], demonstrators) -> str:
    """Return the mean score of the latest policies in a place as text; a dash without anchors.

    Args:
        seeds: results in a place.
        demonstrators: see `results.read_demonstrators`.
    """
    return _format_score(np.mean([results.score_of(result, demonstrators) for result in seeds]))


def _format_score(score: float) -> str:
    return f"{score:z.2f}" if np.isfinite(score) else "-"


def _paper_return(result: RunResult, steps: int) -> str:
    """Return the paper's return after a number of steps as text; a dash where its curves have none."""
    if not results.is_in_paper(result):
        return "-"
    configuration = result.run.configuration
    paper_return = published.at(configuration.setup.name, configuration.algorithm, steps)
    return "-" if paper_return is None else f"{paper_return:.0f}"


def _finals_table(groups: Groups, demonstrators) -> str:
    """Return the table of final returns: the runs of a place, then its anchors."""
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            steps = min(result.steps[-1] for result in seeds)
            final_returns = results.final_returns(seeds)
            run_cells = (
                place,
                kind,
                f"{steps:,}",
                str(len(seeds)),
                f"{final_returns.mean():.1f}",
                interval_text(final_returns),
                list_text(final_returns),
                score_text(seeds, demonstrators),
                _paper_return(seeds[0], steps),
                results.join_notes(seeds),
            )
            lines.append(run_cells)
        lines += _anchor_lines(list(itertools.chain(*kinds.values())), demonstrators)
    heads = ("robot, task", "algorithm", "steps", "seeds", "return", "95 %", "of each seed", "score")
    return table((*heads, "paper, equal steps", "notes"), lines)


def _anchor_lines(run_results: Sequence[RunResult], demonstrators) -> list[tuple[str, ...]]:
    """Return the lines of standing still and of demonstrators in the place of results.

    Results of other episodes have other anchors, with lines of their own.
    """
    lines_by_episodes = {}
    for result in run_results:
        episodes = OF_BENCHMARK if _has_levels_of_benchmark(result) else f"for {len(result.finals)} episodes"
        if episodes not in lines_by_episodes:
            lines_by_episodes[episodes] = _anchor_lines_of(result, episodes, demonstrators)
    return list(itertools.chain(*lines_by_episodes.values()))


def _has_levels_of_benchmark(result: RunResult) -> bool:
    """Return whether the anchors of a result are those over the seeds of `judging`."""
    levels = judging.levels(result.run.configuration.setup)
    return levels is not None and levels == results.levels_of(result, result.seeds)


def _anchor_lines_of(result: RunResult, episodes: str, demonstrators) -> list[tuple[str, ...]]:
    """Return the lines of standing still and of demonstrators for the episodes of a result.

    Args:
        result: result of a run.
        episodes: words for the episodes.
        demonstrators: see `results.read_demonstrators`.
    """
    levels = _shown_levels(result, demonstrators)
    scale = results.anchors_of(result, result.seeds, demonstrators)
    paper_return = evaluation.paper_return(result.run.configuration.setup)
    lines = []
    for name, level in levels.items():
        is_anchor = name in (anchors.ZERO, scale.preset)
        is_of_paper = name == "medium" and paper_return
        cells = (
            result.run.place,
            _policy_label(name),
            "-",
            "-",
            f"{level.mean:.1f} +- {level.error:.1f}",
            "-",
            "-",
            _format_score(scale.score(level.mean)),
            f"{paper_return:.0f}" if is_of_paper else "-",
            f"anchor {episodes}" if is_anchor else f"{level.seeds} episodes",
        )
        lines.append(cells)
    return lines


def _shown_levels(result: RunResult, demonstrators) -> Mapping[str, Level]:
    """Return the mean returns of standing still and of demonstrators for the episodes of a result, by policy.

    Those that score it come first, then those of further demonstrators that the study has measured.
    """
    levels = results.levels_of(result, result.seeds, demonstrators) or {}
    returns_by_policy = demonstrators.get(result.run.place)
    if returns_by_policy is None or _has_levels_of_benchmark(result):
        return levels
    study_levels = anchors.levels_of_returns(returns_by_policy, result.seeds)
    further_levels = {name: level for name, level in study_levels.items() if name not in levels}
    return {**levels, **further_levels}


def _efficiency_table(groups: Groups, demonstrators) -> str:
    """Return the table of steps and CPU time until two returns."""
    lines = []
    for place, kind, seeds in by_kind(groups):
        scale = results.anchors_of(seeds[0], seeds[0].curve_seeds, demonstrators)
        half_score = np.inf if scale is None else scale.at(0.5)
        cells = []
        for threshold in (half_score, 3500.0):
            steps, seconds = results.cost_of_return(seeds, threshold)
            cells += [f"{steps:,.0f}", f"{seconds / 60.0:.1f}"] if np.isfinite(steps) else ["-", "-"]
        area = np.mean([result.returns.mean() for result in seeds])
        lines.append((place, kind, *cells, f"{area:.1f}"))
    heads = ("robot, task", "algorithm", "steps to score .5", "CPU min", "steps to 3,500", "CPU min", "area")
    return table(heads, lines)


def _phases_table(groups: Groups) -> str:
    """Return the table of stabilization phases and their updates."""
    lines = []
    for place, kind, seeds in by_kind(groups):
        updates = np.concatenate([result.phases for result in seeds])
        if len(updates):
            numbers = (len(updates), updates.mean(), updates.min(), updates.max())
            lines.append((place, kind, *(f"{number:,.0f}" for number in numbers)))
    return table(("robot, task", "algorithm", "phases", "mean", "least", "most"), lines)


def _style_table(groups: Groups) -> str:
    """Return the table of metrics of style."""
    names = list(dict.fromkeys(name for _, _, seeds in by_kind(groups) for name in seeds[0].style))
    lines = []
    for place, kind, seeds in by_kind(groups):
        lines.append((place, kind, *(style_text(name, seeds) for name in names)))
    return table(("robot, task", "algorithm", *(name.replace("_", " ") for name in names)), lines)


def style_text(name: str, seeds: Sequence[RunResult]) -> str:
    """Return the mean size of a metric of style over seeds as text; a dash where none has it."""
    missing = np.empty(0)
    size = np.mean([results.mean_size(result.style.get(name, missing)) for result in seeds])
    return "-" if np.isnan(size) else f"{size:.3f}"
