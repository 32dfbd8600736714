"""Claims of the paper, checked on its own curves and on results of studies at equal steps."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import evaluation
from arc_suite.envs.setup import Setup
from arc_suite.evaluation.published import CURVES as PAPER
from arc_suite.evaluation.published import STEPS, at
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.learning.studies import report, results
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.text_tables import table

ONLINE = ("sac", "speq", "sope_eo")
WITH_PRIOR = ("sacfd", "speq_o2o", "sope")
MAX_COMPETITIVE_LAG = 100.0  # of return: the paper calls SAC competitive within it of the best online algorithm

_MetricOf = Callable[[str, str], float]  # returns the metric of a robot and an algorithm; NaN where there is none


class Claim(NamedTuple):
    """A claim of the paper.

    Attributes:
        text: in short.
        margin: margin of a robot, from the metrics of algorithms. It is above zero if the claim holds, and NaN if a
            metric is missing.
        metric: metric of a result; None for the return. The paper's curves have returns alone.
    """

    text: str
    margin: Callable[[str, _MetricOf], float]
    metric: Callable[[RunResult], float] | None = None


def _style_metric(name: str) -> Callable[[RunResult], float]:
    """Return a function: the mean size of a metric of style over episodes in which it is finite, or else NaN."""
    return lambda result: results.mean_size(result.style.get(name, np.empty(0)))


def _initial_return(result: RunResult) -> float:
    """Return the mean return of the first evaluation."""
    return float(result.returns[0].mean())


def _lead_over_demonstrator(robot: str, metric_of: _MetricOf) -> float:
    """Return the least lead of the online algorithms over the paper's demonstrator."""
    return np.min([metric_of(robot, name) for name in ONLINE]) - evaluation.paper_return(Setup.of(robot))


def _lead_by_prior_data(robot: str, metric_of: _MetricOf) -> float:
    """Return the least lead of algorithms with prior data over the same ones without."""
    pairs = zip(WITH_PRIOR, ONLINE, strict=True)
    return np.min([metric_of(robot, with_prior) - metric_of(robot, online) for with_prior, online in pairs])


def _lead_of(name: str, names: Sequence[str] = (*ONLINE, *WITH_PRIOR)) -> Callable[[str, _MetricOf], float]:
    """Return a function: the least lead of an algorithm over the other ones."""

    def lead(robot: str, metric_of: _MetricOf) -> float:
        rivals = [metric_of(robot, rival) for rival in names if rival != name]
        return metric_of(robot, name) - np.max(rivals)

    return lead


def _lead_of_best_online(robot: str, metric_of: _MetricOf) -> float:
    """Return the lead of SOPE-EO over the other two online algorithms; on Tick, that of SPEQ."""
    name = "speq" if robot == "tick" else "sope_eo"
    return _lead_of(name, ONLINE)(robot, metric_of)


def _sac_lag(robot: str, metric_of: _MetricOf) -> float:
    """Return by how much SAC misses `MAX_COMPETITIVE_LAG`; on Queen, by how much it stays within."""
    best = np.max([metric_of(robot, name) for name in ONLINE])
    excess = best - metric_of(robot, "sac") - MAX_COMPETITIVE_LAG
    return -excess if robot == "queen" else excess


CLAIMS = (
    Claim("all online algorithms surpass the demonstrator", _lead_over_demonstrator),
    Claim("SOPE-EO is the best online algorithm, on Tick SPEQ", _lead_of_best_online),
    Claim("SAC is competitive on Queen alone", _sac_lag),
    Claim("with prior data all start higher", _lead_by_prior_data, _initial_return),
    Claim("with prior data all end higher than without", _lead_by_prior_data),
    Claim("SAC walks sideways: the largest heading error, rad", _lead_of("sac"), _style_metric("heading_error")),
    Claim("SPEQ pitches forwards: the largest pitch, rad", _lead_of("speq"), _style_metric("torso_pitch")),
    Claim("SOPE looks best: the most gait compliance", _lead_of("sope"), _style_metric("gait_compliance")),
)

_TEXT = (
    "Margin of each claim, in its own unit: it holds above zero. The paper's margin is from its returns after as many "
    "steps, if they decide the claim. Ours are from finished runs alone."
)


def sections(run_results: Sequence[RunResult]) -> report.Sections:
    """Return the section of the claims for a report; none without a run that the paper's curves have."""
    if not any(map(results.is_in_paper, run_results)):
        return {}
    return {"Claims of the paper": [_TEXT, margin_table(run_results)]}


def margin_table(run_results: Sequence[RunResult]) -> str:
    """Return a table of the margins of all claims in Markdown."""
    finished = [result for result in run_results if results.is_in_paper(result) and _is_finished(result)]
    steps = min((result.run.configuration.steps for result in finished), default=STEPS[-1])

    def published_return(robot: str, algorithm: str) -> float:
        value = at(robot, algorithm, steps)
        return np.nan if value is None else value

    lines = []
    for claim in CLAIMS:
        our_metrics = _mean_metrics(claim, finished)

        def our_metric(robot: str, algorithm: str, means: Mapping = our_metrics) -> float:
            return means.get((robot, algorithm), np.nan)

        our_margins = {robot: claim.margin(robot, our_metric) for robot in PAPER}
        paper_margins = {robot: claim.margin(robot, published_return) for robot in PAPER if claim.metric is None}
        paper_cells = (_margin_text(paper_margins), _verdict(paper_margins))
        our_cells = (_margin_text(our_margins), _verdict(our_margins))
        lines.append((claim.text, *paper_cells, *our_cells))
    return table(("claim", "paper's margin", "holds there", "ours", "holds here"), lines)


def _is_finished(result: RunResult) -> bool:
    return result.steps[-1] >= result.run.configuration.steps


def _mean_metrics(claim: Claim, run_results: Iterable[RunResult]) -> dict[tuple[str, str], float]:
    """Return the mean metric of a claim over seeds, by robot and algorithm."""
    metrics: dict[tuple[str, str], list[float]] = {}
    for result in run_results:
        configuration = result.run.configuration
        metric = result.final if claim.metric is None else claim.metric(result)
        metrics.setdefault((configuration.setup.body.name, configuration.algorithm), []).append(metric)
    return {key: float(np.mean(values)) for key, values in metrics.items()}


def next_to_the_papers(studies: Iterable[Sequence[RunResult]], steps: int) -> str:
    """Return a table in Markdown of returns after environment steps, ours / those of the paper's curves.

    Args:
        studies: results of each study; where several have an algorithm and a robot, the first counts.
        steps: environment steps of the runs; a cell tells if they are fewer, and if hyperparameters are not the
            published ones.
    """
    our_cells: dict[tuple[str, str], str] = {}
    for run_results in studies:
        runs_by_place: dict[tuple[str, str], list[RunResult]] = {}
        for result in filter(results.is_in_paper, run_results):
            configuration = result.run.configuration
            runs_by_place.setdefault((configuration.algorithm, configuration.setup.body.name), []).append(result)
        for key, runs in runs_by_place.items():
            our_cells.setdefault(key, _return_text(runs, steps))
    lines = []
    for algorithm in (*ONLINE, *WITH_PRIOR):
        cells = [
            f"{our_cells.get((algorithm, robot), 'not run')} / {at(robot, algorithm, steps):.0f}" for robot in PAPER
        ]
        lines.append((algorithm, *cells))
    return table(("algorithm", *PAPER), lines)


def _return_text(runs: Sequence[RunResult], steps: int) -> str:
    """Return the mean return of runs after so many steps, or after the most that all have, with notes."""
    last_step = min(int(result.steps[result.steps <= steps].max()) for result in runs)
    mean = np.mean([result.returns[result.steps == last_step].mean() for result in runs])
    configuration = runs[0].run.configuration
    notes = []
    if last_step < steps:
        notes.append(f"at {last_step:,}")
    if configuration.hyperparameters != ALGORITHMS[configuration.algorithm].hyperparameters:
        notes.append("short phases")
    return f"{mean:.0f} ({', '.join(notes)})" if notes else f"{mean:.0f}"


def _margin_text(margins: Mapping[str, float]) -> str:
    return ", ".join(f"{robot} {margin:+.4g}" for robot, margin in margins.items() if np.isfinite(margin)) or "-"


def _verdict(margins: Mapping[str, float]) -> str:
    verdicts = [margin > 0.0 for margin in margins.values() if np.isfinite(margin)]
    return f"{sum(verdicts)} of {len(verdicts)} robots" if verdicts else "not measured"
