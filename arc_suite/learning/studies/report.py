"""Reports of studies: Markdown and curves, of published tables alone."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files
from arc_suite.evaluation import anchors, published
from arc_suite.learning.studies import claims, leaderboard, results
from arc_suite.learning.studies.leaderboard import table
from arc_suite.learning.studies.results import Groups, RunResult
from arc_suite.learning.studies.tables import Run, Study

REPORT, CURVES = "README.md", "curves.png"


def write(name: str, study: Study, published: Path) -> Path:
    """Write the report of a study into the folder of its tables, and the leaderboard one folder above.

    Args:
        name: of the study.
        study: its title and runs.
        published: folder of its tables.

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
        **({"Claims of the paper": [claims.TEXT, claims.checked(found)]} if any(map(claims.is_papers, found)) else {}),
    }
    with files.writing(published / CURVES) as temporary:
        _curves(groups, demonstrators).savefig(temporary)
    files.write(published / REPORT, _page(sections))
    leaderboard.write(published.parent, published.name, _rows(published.name, groups, demonstrators))
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


def _page(sections: Mapping[str, Sequence[str]]) -> str:
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
    return plots.study(drawn, lines, finals)


def _kinds(groups: Groups) -> Iterator[tuple[str, str, Sequence[RunResult]]]:
    """Yield place, kind and results of each kind of run."""
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            yield place, kind, seeds


def _policy(name: str) -> str:
    """The name of an anchor for people."""
    return "standing still" if name == anchors.ZERO else f"demonstrator {name}"


def _mean(values: np.ndarray) -> str:
    return f"{values.mean():.1f}" + (f" +- {values.std():.1f}" if len(values) > 1 else "")


def _iqm(values: np.ndarray) -> str:
    if len(values) == 1:
        return "-"
    middle, (low, high) = evaluation.iqm_and_interval([values])
    return f"{middle:.1f} [{low:.1f}, {high:.1f}]"


def _score(values: np.ndarray, place: str, demonstrators) -> str:
    """The score of mean returns, a dash without anchors."""
    found = anchors.of_returns(demonstrators[place]).score(values.mean()) if place in demonstrators else np.nan
    return f"{found:z.2f}" if np.isfinite(found) else "-"


def _paper(result: RunResult, steps: int) -> str:
    """The paper's return after as many steps; a dash where its curves have none."""
    run = result.run.configuration
    found = published.at(run.setup.body.name, run.algorithm, steps) if claims.is_papers(result) else None
    return "-" if found is None else f"{found:.0f}"


def _finals(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            steps, values = min(each.steps[-1] for each in seeds), results.scores(seeds)
            score = _score(values, place, demonstrators)
            cells = (place, kind, f"{steps:,}", str(len(seeds)), _mean(values), score, _iqm(values))
            lines.append((*cells, _paper(seeds[0], steps), results.notes(seeds)))
        expert = evaluation.expert_return(seeds[0].run.configuration.setup)
        for name, totals in demonstrators.get(place, {}).items():
            own = f"{expert:.0f}" if name == "medium" and expert else "-"
            score = _score(totals, place, demonstrators)
            note = "".join(results.few_episodes(totals)) or "-"
            lines.append((place, _policy(name), "-", "-", _mean(totals), score, "-", own, note))
    heads = ("robot, task", "algorithm", "steps", "seeds", "return", "score", "IQM [95 %]")
    return table((*heads, "paper, equal steps", "notes"), lines)


def _efficiency(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kind, seeds in _kinds(groups):
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
    for place, kind, seeds in _kinds(groups):
        updates = np.concatenate([each.phases for each in seeds])
        if len(updates):
            numbers = (len(updates), updates.mean(), updates.min(), updates.max())
            lines.append((place, kind, *(f"{number:,.0f}" for number in numbers)))
    return table(("robot, task", "algorithm", "phases", "mean", "least", "most"), lines)


def _style(groups: Groups) -> str:
    names = list(dict.fromkeys(name for _, _, seeds in _kinds(groups) for name in seeds[0].style))
    lines = [(place, kind, *(_size(name, seeds) for name in names)) for place, kind, seeds in _kinds(groups)]
    return table(("robot, task", "algorithm", *(name.replace("_", " ") for name in names)), lines)


def _size(name: str, seeds: Sequence[RunResult]) -> str:
    size = np.mean([results.size(each.style.get(name, np.empty(0))) for each in seeds])
    return "-" if np.isnan(size) else f"{size:.3f}"


def _rows(name: str, groups: Groups, demonstrators) -> list[dict[str, str]]:
    """Return the rows of a study in the leaderboard, by `leaderboard.HEADS`."""
    rows = []
    for _, _, seeds in _kinds(groups):
        run, values = seeds[0].run, results.scores(seeds)
        length = getattr(run.configuration.hyperparameters, "phase_updates", 0)
        own = next(iter(seeds[0].progress))
        style = [_size(metric, seeds) for metric in ("gait_compliance", "heading_error", "torso_pitch")]
        cells = {
            "robot, task": run.place,
            "algorithm": run.kind,
            "phases, updates": f"{length:,}" if length else "-",
            "prior data, episodes": f"{run.prior.preset}, {run.prior.episodes:,}" if run.prior else "-",
            "seeds": str(len(seeds)),
            "return": f"{values.mean():.1f}",
            "score": _score(values, run.place, demonstrators),
            "IQM [95 %]": _iqm(values),
            "metric": f"{own} {np.mean([np.mean(each.progress[own]) for each in seeds]):.3f}",
            **dict(zip(leaderboard.STYLE, style, strict=True)),
            "steps": f"{min(each.steps[-1] for each in seeds):,} of {run.configuration.steps:,}",
            "CPU min": f"{np.mean([each.cpu[-1] for each in seeds]) / 60.0:.1f}",
            "notes": results.notes(seeds),
            "study": name,
            "command of seed 0": f"`{run.configuration.command}`",
            "configuration": _identity(run),
        }
        rows.append(cells)
    return rows


def _identity(run: Run) -> str:
    """A hash of the configuration without its seed: runs that differ in nothing else have the same."""
    fields = {name: value for name, value in run.configuration.to_dict().items() if name != "seed"}
    return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()[:12]
