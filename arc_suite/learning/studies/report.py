"""Reports of studies: Markdown and curves, of published tables alone."""

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
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
        **({"Probability of improvement": [_IMPROVEMENT, compared]} if (compared := _improvements(groups)) else {}),
        **({"Phases": [_PHASES, _phases(groups)]} if any(len(each.phases) for each in found) else {}),
        "Style": [_STYLE, _style(groups)],
        **({"Claims of the paper": [claims.TEXT, claims.checked(found)]} if any(map(claims.is_papers, found)) else {}),
    }
    with files.writing(published / CURVES) as temporary:
        _curves(groups, demonstrators).savefig(temporary)
    with files.writing(published / REPORT) as temporary:
        temporary.write_text(_page(sections), encoding="utf-8")
    leaderboard.write(published.parent, published.name, _rows(published.name, groups, demonstrators))
    return published / REPORT


_CURVES = (
    "Interquartile mean over seeds with its 95 % bootstrap interval; of a single seed the mean. Dashed: standing "
    "still and demonstrators. Dotted: the paper's returns at the last step, from 50,000 on."
)
_FINALS = (
    "Mean of the latest evaluation, ten seeded episodes, and standard deviation over seeds; interquartile mean with "
    "95 % bootstrap interval over seeds. A single seed has neither. Score: (return - standing still) / (best "
    "demonstrator - standing still). The paper's returns are at equal steps, read off its curves within about 30. "
    "Then come standing still and the demonstrators, with the standard deviation over episodes."
)
_EFFICIENCY = (
    "Environment steps and minutes of one core until an evaluation has the score 0.5, and the return 3,500; a dash if "
    "it has not. Area is the mean return over all evaluations so far."
)
_IMPROVEMENT = (
    "Probability that an algorithm has a higher return than that of the column, with 95 % bootstrap interval, over "
    "the places in which both have several seeds, at the latest step that both have reached."
)
_PHASES = (
    "Updates of the critics alone in a stabilisation phase, for runs with published phases: those of `speq` and "
    "`speq_o2o` have the full length, the others may end early."
)
_STYLE = (
    "Mean size over ten episodes of the latest policy of each seed; `pydoc arc_suite.style.metrics` explains each. "
    "Heading and drift are relative to the x axis, which is not the direction of a command that turns."
)


def _page(sections: Mapping[str, Sequence[str]]) -> str:
    texts = [("#" if not place else "##") + f" {title}" for place, title in enumerate(sections)]
    parts = itertools.chain.from_iterable(zip(texts, ("\n\n".join(body) for body in sections.values()), strict=True))
    return "\n\n".join(parts) + "\n"


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
        drawn[place] = {}
        for kind, seeds in kinds.items():
            count = min(len(each.steps) for each in seeds)
            returns = np.array([each.returns.mean(axis=1)[:count] for each in seeds])
            drawn[place][kind] = plots.Curve(_algorithm(seeds[0].run), seeds[0].steps[:count], returns)
        names, ends = zip(*((each.algorithm, each.steps[-1]) for each in drawn[place].values()), strict=True)
        finals[place] = evaluation.published_returns(seeds[0].run.configuration.setup, names, max(ends))
    lines = {p: {_policy(n): v.mean() for n, v in every.items()} for p, every in demonstrators.items()}
    return plots.study(drawn, lines, finals)


def _algorithm(run: Run) -> str:
    return run.configuration.algorithm


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


def _expert(run: Run) -> float | None:
    """Return the return of the paper's demonstrator in a run's place; None if the paper has none."""
    return evaluation.expert_return(run.configuration.setup)


def _paper(result: RunResult, steps: int) -> str:
    """The paper's return after as many steps; a dash where its curves have none."""
    setup = result.run.configuration.setup
    found = published.at(setup.body.name, _algorithm(result.run), steps) if claims.is_papers(result) else None
    return "-" if found is None else f"{found:.0f}"


def _finals(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            run, values = seeds[0].run, results.scores(seeds)
            steps, score = min(each.steps[-1] for each in seeds), _score(values, place, demonstrators)
            cells = (place, kind, f"{steps:,}", str(len(seeds)), _mean(values), score, _iqm(values))
            lines.append((*cells, _paper(seeds[0], steps), results.notes(seeds)))
        expert = _expert(run)
        for name, totals in demonstrators.get(place, {}).items():
            own = f"{expert:.0f}" if name == "medium" and expert else "-"
            score = _score(totals, place, demonstrators)
            lines.append((place, _policy(name), "-", "-", _mean(totals), score, "-", own, "-"))
    heads = ("robot, task", "algorithm", "steps", "seeds", "return", "score", "IQM [95 %]")
    return table((*heads, "paper, equal steps", "notes"), lines)


def _efficiency(groups: Groups, demonstrators) -> str:
    lines = []
    for place, kinds in groups.items():
        half = anchors.of_returns(demonstrators[place]).at(0.5) if place in demonstrators else np.inf
        for kind, seeds in kinds.items():
            cells = []
            for threshold in (half, 3500.0):
                steps, seconds = results.until(seeds, threshold)
                cells += [f"{steps:,.0f}", f"{seconds / 60.0:.1f}"] if np.isfinite(steps) else ["-", "-"]
            area = np.mean([each.returns.mean() for each in seeds])
            lines.append((place, kind, *cells, f"{area:.1f}"))
    heads = ("robot, task", "algorithm", "steps to score .5", "CPU min", "steps to 3,500", "CPU min", "area")
    return table(heads, lines)


def _improvements(groups: Groups) -> str | None:
    """The table of all kinds that can be compared; None without any."""
    names = list(dict.fromkeys(kind for kinds in groups.values() for kind in kinds))
    found = {pair: results.improvement(groups, *pair) for pair in itertools.permutations(names, 2)}
    found = {pair: each for pair, each in found.items() if each is not None}
    names = [name for name in names if any(name in pair for pair in found)]
    if not names:
        return None

    def cell(pair):
        return "{:.2f} [{:.2f}, {:.2f}]".format(found[pair][0], *found[pair][1]) if pair in found else "-"

    return table(("more than", *names), [(x, *(cell((x, y)) for y in names)) for x in names])


def _phases(groups: Groups) -> str:
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            updates = np.concatenate([each.phases for each in seeds])
            if len(updates):
                figures = (updates.mean(), updates.min(), updates.max())
                lines.append((place, kind, str(len(updates)), *(f"{figure:,.0f}" for figure in figures)))
    return table(("robot, task", "algorithm", "phases", "mean", "least", "most"), lines)


def _style(groups: Groups) -> str:
    names = list(dict.fromkeys(name for kinds in groups.values() for s in kinds.values() for name in s[0].style))
    lines = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            cells = [_size(name, seeds) for name in names]
            lines.append((place, kind, *cells))
    return table(("robot, task", "algorithm", *(name.replace("_", " ") for name in names)), lines)


def _size(name: str, seeds: Sequence[RunResult]) -> str:
    size = np.mean([results.size(each.style.get(name, np.empty(0))) for each in seeds])
    return "-" if np.isnan(size) else f"{size:.3f}"


def _rows(name: str, groups: Groups, demonstrators) -> list[dict[str, str]]:
    """Return the rows of a study in the leaderboard, by `leaderboard.HEADS`."""
    rows = []
    for seeds in (seeds for kinds in groups.values() for seeds in kinds.values()):
        run, values = seeds[0].run, results.scores(seeds)
        figure = next(iter(seeds[0].progress))
        own = f"{figure} {np.mean([np.mean(each.progress[figure]) for each in seeds]):.3f}"
        style = [_size(metric, seeds) for metric in ("gait_compliance", "heading_error", "torso_pitch")]
        cells = {
            "robot, task": run.place,
            "algorithm": run.kind,
            "phases, updates": _phase_length(run),
            "prior data, episodes": f"{run.prior.preset}, {run.prior.episodes:,}" if run.prior else "-",
            "seeds": str(len(seeds)),
            "return": f"{values.mean():.1f}",
            "score": _score(values, run.place, demonstrators),
            "IQM [95 %]": _iqm(values),
            "metric": own,
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


def _phase_length(run: Run) -> str:
    """The most updates of a stabilisation phase."""
    length = getattr(run.configuration.hyperparameters, "phase_updates", 0)
    return f"{length:,}" if length else "-"


def _identity(run: Run) -> str:
    """A hash of the configuration without its seed: runs that differ in nothing else have the same."""
    fields = {name: value for name, value in run.configuration.to_dict().items() if name != "seed"}
    return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()[:12]
