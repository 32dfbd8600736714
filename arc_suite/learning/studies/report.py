"""Reports of studies: Markdown and curves, of published tables alone."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files
from arc_suite.evaluation import anchors, published
from arc_suite.learning.studies import results
from arc_suite.learning.studies.results import Groups, RunResult
from arc_suite.learning.studies.tables import Study
from arc_suite.learning.studies.text_tables import table

REPORT, CURVES = "README.md", "curves.png"
Sections = Mapping[str, Sequence[str]]  # paragraphs of each section of a report, by its title


def write(name: str, study: Study, published: Path, further: Sections | None = None) -> Path:
    """Write the report of a study into the folder of its tables.

    Args:
        name: of the study.
        study: its title and runs.
        published: folder of its tables.
        further: sections that follow the report's own; None for none.

    Returns:
        The file of the report.

    Raises:
        ValueError: nothing is published, or a table is damaged.
        OSError: a file cannot be written.
    """
    found = results.results(study.runs, published)
    if not found:
        raise ValueError(f"{published}: holds no results of the study {name}")
    groups, demonstrators = results.grouped(found), results.demonstrators(published)
    sections = {
        f"Study {name}": [_title(study, found), _reached(found)],
        "Curves": [_CURVES, f"![Returns over environment steps]({CURVES})"],
        "Final returns": [_FINALS, _finals(groups, demonstrators)],
        "Sample efficiency": [_EFFICIENCY, _efficiency(groups, demonstrators)],
        **({"Phases": [_PHASES, _phases(groups)]} if any(len(each.phases) for each in found) else {}),
        "Style": [_STYLE, _style(groups)],
        **(further or {}),
    }
    with files.writing(published / CURVES) as temporary:
        _curves(groups, demonstrators).savefig(temporary)
    files.write(published / REPORT, _page(sections))
    return published / REPORT


_CURVES = (
    "Interquartile mean over seeds with its 95 % bootstrap interval; of a single seed the mean. Dashed: standing "
    "still and demonstrators. Dotted: the paper's returns at the last step, from 50,000 on."
)
_FINALS = (
    "Mean over 100 seeded episodes of the latest policy, unless noted, and standard deviation over seeds; "
    "interquartile mean with 95 % bootstrap interval over seeds. A single seed has neither. Score: (return - standing "
    "still) / (best demonstrator - standing still). The paper's returns are at equal steps, read off its curves "
    "within about 30. Then come standing still and the demonstrators, with the standard deviation over episodes."
)
_EFFICIENCY = (
    "Environment steps and minutes of one core until an evaluation has the score 0.5, and the return 3,500; a dash if "
    "it has not. Area is the mean return over all evaluations so far."
)
_PHASES = (
    "Updates of the critics alone in a stabilization phase, for runs with published phases: those of `speq` and "
    "`speq_o2o` have the full length, the others may end early."
)
_STYLE = (
    "Mean size over ten episodes of the latest policy of each seed; `pydoc arc_suite.style.metrics` explains each. "
    "Heading and drift are relative to the x axis, which is not the direction of a command that turns."
)


def _page(sections: Sections) -> str:
    text = "\n\n".join("\n\n".join([f"## {title}", *body]) for title, body in sections.items())
    return text[1:] + "\n"  # the first heading is that of the page


def _title(study: Study, found: Sequence[RunResult]) -> str:
    title = study.title[0].upper() + study.title[1:] + "."
    return title if len(found) == len(study.runs) else f"{title} Begun: {len(found)} of {len(study.runs)} runs."


def _reached(found: Sequence[RunResult]) -> str:
    lines = []
    for each in found:
        run, configuration = each.run, each.run.configuration
        reached = f"{each.steps[-1]:,} of {configuration.steps:,}"
        minutes, command = f"{each.cpu[-1] / 60.0:.1f}", f"`{configuration.command}`"
        lines.append((run.place, run.kind, str(configuration.seed), reached, minutes, command))
    return table(("robot, task", "algorithm", "seed", "steps", "CPU min", "command"), lines)


def _curves(groups: Groups, demonstrators):
    from arc_suite.learning.agents import plots  # needs matplotlib

    drawn, finals = {}, {}
    for place, kinds in groups.items():
        algorithms = {kind: seeds[0].run.configuration.algorithm for kind, seeds in kinds.items()}
        curves = {kind: plots.Curve(algorithms[kind], *results.curve(seeds)) for kind, seeds in kinds.items()}
        setup = next(iter(kinds.values()))[0].run.configuration.setup
        end = max(each.steps[-1] for each in curves.values())
        drawn[place], finals[place] = curves, evaluation.published_returns(setup, [*algorithms.values()], end)
    lines = {p: {_policy(n): v.mean() for n, v in every.items()} for p, every in demonstrators.items()}
    return plots.plot_study(drawn, lines, finals)


def by_kind(groups: Groups) -> Iterator[tuple[str, str, Sequence[RunResult]]]:
    """Yield the place, the kind and the results of each kind of run."""
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            yield place, kind, seeds


def _policy(name: str) -> str:
    """The name of an anchor for people."""
    return "standing still" if name == anchors.ZERO else f"demonstrator {name}"


def _mean(values: np.ndarray) -> str:
    return f"{values.mean():.1f}" + (f" +- {values.std():.1f}" if len(values) > 1 else "")


def iqm_text(values: np.ndarray) -> str:
    """Return the interquartile mean of returns (seeds,) with its interval as text; a dash for a single seed."""
    if len(values) == 1:
        return "-"
    middle, (low, high) = evaluation.iqm_and_interval([values])
    return f"{middle:.1f} [{low:.1f}, {high:.1f}]"


def score_text(values: np.ndarray, place: str, demonstrators) -> str:
    """Return the score of the mean of returns in a place as text; a dash without anchors.

    Args:
        values: returns.
        place: see `Run.place`.
        demonstrators: of the study; see `results.demonstrators`.
    """
    found = anchors.of_returns(demonstrators[place]).score(values.mean()) if place in demonstrators else np.nan
    return f"{found:z.2f}" if np.isfinite(found) else "-"


def _paper(result: RunResult, steps: int) -> str:
    """The paper's return after as many steps; a dash where its curves have none."""
    run = result.run.configuration
    found = published.at(run.setup.body.name, run.algorithm, steps) if results.is_in_paper(result) else None
    return "-" if found is None else f"{found:.0f}"


def _finals(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            steps, values = min(each.steps[-1] for each in seeds), results.scores(seeds)
            score = score_text(values, place, demonstrators)
            cells = (place, kind, f"{steps:,}", str(len(seeds)), _mean(values), score, iqm_text(values))
            lines.append((*cells, _paper(seeds[0], steps), results.notes(seeds)))
        expert = evaluation.expert_return(seeds[0].run.configuration.setup)
        for name, totals in demonstrators.get(place, {}).items():
            own = f"{expert:.0f}" if name == "medium" and expert else "-"
            score = score_text(totals, place, demonstrators)
            note = "".join(results.few_episodes(totals)) or "-"
            lines.append((place, _policy(name), "-", "-", _mean(totals), score, "-", own, note))
    heads = ("robot, task", "algorithm", "steps", "seeds", "return", "score", "IQM [95 %]")
    return table((*heads, "paper, equal steps", "notes"), lines)


def _efficiency(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kind, seeds in by_kind(groups):
        half, cells = anchors.of_returns(demonstrators[place]).at(0.5) if place in demonstrators else np.inf, []
        for threshold in (half, 3500.0):
            steps, seconds = results.until(seeds, threshold)
            cells += [f"{steps:,.0f}", f"{seconds / 60.0:.1f}"] if np.isfinite(steps) else ["-", "-"]
        area = np.mean([each.returns.mean() for each in seeds])
        lines.append((place, kind, *cells, f"{area:.1f}"))
    heads = ("robot, task", "algorithm", "steps to score .5", "CPU min", "steps to 3,500", "CPU min", "area")
    return table(heads, lines)


def _phases(groups: Groups) -> str:
    lines = []
    for place, kind, seeds in by_kind(groups):
        updates = np.concatenate([each.phases for each in seeds])
        if len(updates):
            numbers = (len(updates), updates.mean(), updates.min(), updates.max())
            lines.append((place, kind, *(f"{number:,.0f}" for number in numbers)))
    return table(("robot, task", "algorithm", "phases", "mean", "least", "most"), lines)


def _style(groups: Groups) -> str:
    names = list(dict.fromkeys(name for _, _, seeds in by_kind(groups) for name in seeds[0].style))
    lines = [(place, kind, *(style_text(name, seeds) for name in names)) for place, kind, seeds in by_kind(groups)]
    return table(("robot, task", "algorithm", *(name.replace("_", " ") for name in names)), lines)


def style_text(name: str, seeds: Sequence[RunResult]) -> str:
    """Return the mean size of a metric of style over seeds as text; a dash where none has it."""
    size = np.mean([results.size(each.style.get(name, np.empty(0))) for each in seeds])
    return "-" if np.isnan(size) else f"{size:.3f}"
