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
COMPETITIVE = 100.0  # of return: within it of the best online algorithm the paper calls SAC competitive

_Of = Callable[[str, str], float]  # robot and algorithm -> a metric; NaN where there is none


class Claim(NamedTuple):
    """A claim of the paper.

    Attributes:
        text: in short.
        compared: of a robot and the metrics of algorithms, the margin, which is above zero if the claim holds; NaN if
            a metric is missing.
        metric: of a result; None for the return, by which the paper's curves decide the claim, too.
    """

    text: str
    compared: Callable[[str, _Of], float]
    metric: Callable[[RunResult], float] | None = None


def _style(name: str) -> Callable[[RunResult], float]:
    """The mean size of a metric of style over the episodes in which it is finite; NaN where there is none."""
    return lambda result: results.size(result.style.get(name, np.empty(0)))


def _surpass(robot: str, of: _Of) -> float:
    """The least lead of the online algorithms over the paper's demonstrator."""
    return np.min([of(robot, name) for name in ONLINE]) - evaluation.expert_return(Setup.of(robot))


def _pairs(robot: str, of: _Of) -> float:
    """The least lead that prior data give."""
    return np.min([of(robot, prior) - of(robot, online) for prior, online in zip(WITH_PRIOR, ONLINE, strict=True)])


def _most(name: str, names: Sequence[str] = (*ONLINE, *WITH_PRIOR)) -> Callable[[str, _Of], float]:
    """The least lead of an algorithm over others."""
    return lambda robot, of: of(robot, name) - np.max([of(robot, other) for other in names if other != name])


def _best_online(robot: str, of: _Of) -> float:
    """The lead of SOPE-EO over the other two, on Tick of SPEQ."""
    return _most("speq" if robot == "tick" else "sope_eo", ONLINE)(robot, of)


def _sac_lags(robot: str, of: _Of) -> float:
    """By how much more than `COMPETITIVE` SAC stays below the best online algorithm; on Queen, by how much less."""
    lag = np.max([of(robot, name) for name in ONLINE]) - of(robot, "sac") - COMPETITIVE
    return -lag if robot == "queen" else lag


CLAIMS = (
    Claim("all online algorithms surpass the demonstrator", _surpass),
    Claim("SOPE-EO is the best online algorithm, on Tick SPEQ", _best_online),
    Claim("SAC is competitive on Queen alone", _sac_lags),
    Claim("with prior data all start higher", _pairs, lambda result: float(result.returns[0].mean())),
    Claim("with prior data all end higher than without", _pairs),
    Claim("SAC walks sideways: the largest heading error, rad", _most("sac"), _style("heading_error")),
    Claim("SPEQ pitches forwards: the largest pitch, rad", _most("speq"), _style("torso_pitch")),
    Claim("SOPE looks best: the most gait compliance", _most("sope"), _style("gait_compliance")),
)

_TEXT = (
    "Margin of each claim, in its own unit: it holds above zero. The paper's margin is from its returns after as many "
    "steps, if they decide the claim. Ours are from finished runs alone."
)


def sections(found: Sequence[RunResult]) -> report.Sections:
    """Return the section of the claims for a report; none without a run that the paper's curves have."""
    return {"Claims of the paper": [_TEXT, checked(found)]} if any(map(results.is_in_paper, found)) else {}


def checked(found: Sequence[RunResult]) -> str:
    """Return a table of the margins of all claims in Markdown."""
    own = [each for each in found if results.is_in_paper(each) and each.steps[-1] >= each.run.configuration.steps]
    steps = min((each.run.configuration.steps for each in own), default=STEPS[-1])
    lines = []

    def told(robot, name):
        found = at(robot, name, steps)
        return np.nan if found is None else found

    for claim in CLAIMS:
        metrics: dict[tuple[str, str], list[float]] = {}
        for each in own:
            configuration = each.run.configuration
            metric = each.final if claim.metric is None else claim.metric(each)
            metrics.setdefault((configuration.setup.body.name, configuration.algorithm), []).append(metric)
        means = {key: float(np.mean(values)) for key, values in metrics.items()}
        ours = {robot: claim.compared(robot, lambda *key, means=means: means.get(key, np.nan)) for robot in PAPER}
        paper = {robot: claim.compared(robot, told) for robot in PAPER if claim.metric is None}
        lines.append((claim.text, _leads(paper), _verdict(paper), _leads(ours), _verdict(ours)))
    return table(("claim", "paper's margin", "holds there", "ours", "holds here"), lines)


def next_to_the_papers(studies: Iterable[Sequence[RunResult]], steps: int) -> str:
    """Return a table in Markdown of returns after environment steps, ours / those of the paper's curves.

    Args:
        studies: results of each study; where several have an algorithm and a robot, the first counts.
        steps: of the runs; a cell tells where they are fewer, and where hyperparameters are not the published ones.
    """
    cells: dict[tuple[str, str], str] = {}
    for found in studies:
        own: dict[tuple[str, str], list[RunResult]] = {}
        for each in filter(results.is_in_paper, found):
            own.setdefault((each.run.configuration.algorithm, each.run.configuration.setup.body.name), []).append(each)
        cells = {key: _after(runs, steps) for key, runs in own.items()} | cells
    robots = tuple(PAPER)
    told = {(name, robot): at(robot, name, steps) for name in (*ONLINE, *WITH_PRIOR) for robot in robots}
    lines = [
        (name, *(f"{cells.get((name, robot), 'not run')} / {told[name, robot]:.0f}" for robot in robots))
        for name in (*ONLINE, *WITH_PRIOR)
    ]
    return table(("algorithm", *robots), lines)


def _after(runs: Sequence[RunResult], steps: int) -> str:
    """The mean return of runs after as many steps, or after what they have."""
    last = min(int(each.steps[each.steps <= steps].max()) for each in runs)
    mean = np.mean([each.returns[each.steps == last].mean() for each in runs])
    run = runs[0].run.configuration
    published = ALGORITHMS[run.algorithm].hyperparameters
    notes = [f"at {last:,}"] * (last < steps) + ["short phases"] * (run.hyperparameters != published)
    return f"{mean:.0f}" + f" ({', '.join(notes)})" * bool(notes)


def _leads(margins: Mapping[str, float]) -> str:
    return ", ".join(f"{robot} {margin:+.4g}" for robot, margin in margins.items() if np.isfinite(margin)) or "-"


def _verdict(margins: Mapping[str, float]) -> str:
    known = [margin > 0.0 for margin in margins.values() if np.isfinite(margin)]
    return f"{sum(known)} of {len(known)} robots" if known else "not measured"
