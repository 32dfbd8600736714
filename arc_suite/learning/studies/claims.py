"""Claims of the paper, checked on its own curves and on results of studies at equal steps."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import evaluation
from arc_suite.envs.setup import Setup
from arc_suite.evaluation.published import CURVES as PAPER
from arc_suite.evaluation.published import STEPS, at
from arc_suite.learning.studies import results
from arc_suite.learning.studies.leaderboard import table
from arc_suite.learning.studies.results import RunResult

ONLINE = ("sac", "speq", "sope_eo")
WITH_PRIOR = ("sacfd", "speq_o2o", "sope")
COMPETITIVE = 100.0  # of return: within it of the best online algorithm the paper calls SAC competitive

_Of = Callable[[str, str], float | None]  # robot and algorithm -> a figure; None where there is none


class Claim(NamedTuple):
    """A claim of the paper.

    Attributes:
        text: in short.
        compared: of a robot and the metrics of algorithms, the margin, which is above zero if the claim holds; None
            if a metric is missing.
        figure: the metric of a result.
        in_paper: whether the paper's returns decide the claim, too.
    """

    text: str
    compared: Callable[[str, _Of], float | None]
    figure: Callable[[RunResult], float]
    in_paper: bool = False


def _difference(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else first - second


def _least(values: Sequence[float | None]) -> float | None:
    return None if None in values else min(values)


def _metric(name: str) -> Callable[[RunResult], float]:
    """The mean size of a metric of style over the episodes in which it is finite; NaN where there is none."""
    return lambda result: results.size(result.style.get(name, np.empty(0)))


def _final(result: RunResult) -> float:
    return result.final


def _of_all(names: Sequence[str]) -> Callable[[str, _Of], float | None]:
    """The least lead of some algorithms over the paper's demonstrator."""
    return lambda robot, of: _least(
        [_difference(of(robot, n), evaluation.expert_return(Setup.of(robot))) for n in names]
    )


def _pairs(robot: str, of: _Of) -> float | None:
    pairs = zip(WITH_PRIOR, ONLINE, strict=True)
    return _least([_difference(of(robot, with_prior), of(robot, online)) for with_prior, online in pairs])


def _most(name: str) -> Callable[[str, _Of], float | None]:
    """The least lead of an algorithm over the other five."""
    others = [other for other in (*ONLINE, *WITH_PRIOR) if other != name]
    return lambda robot, of: _least([_difference(of(robot, name), of(robot, other)) for other in others])


def _best_online(robot: str, of: _Of) -> float | None:
    """The lead of SOPE-EO over the other two, on Tick of SPEQ."""
    best = "speq" if robot == "tick" else "sope_eo"
    return _least([_difference(of(robot, best), of(robot, other)) for other in ONLINE if other != best])


def _sac_lags(robot: str, of: _Of) -> float | None:
    """By how much more than `COMPETITIVE` SAC stays below the best online algorithm; on Queen, by how much less."""
    figures = [of(robot, name) for name in ONLINE]
    if None in figures:
        return None
    lag = max(figures) - figures[0] - COMPETITIVE
    return -lag if robot == "queen" else lag


CLAIMS = (
    Claim("all online algorithms surpass the demonstrator", _of_all(ONLINE), _final, True),
    Claim("SOPE-EO is the best online algorithm, on Tick SPEQ", _best_online, _final, True),
    Claim("SAC is competitive on Queen alone", _sac_lags, _final, True),
    Claim("with prior data all start higher", _pairs, lambda result: float(result.returns[0].mean())),
    Claim("with prior data all end higher than without", _pairs, _final, True),
    Claim("SAC walks sideways: the largest heading error, rad", _most("sac"), _metric("heading_error")),
    Claim("SPEQ pitches forwards: the largest pitch, rad", _most("speq"), _metric("torso_pitch")),
    Claim("SOPE looks best: the most gait compliance", _most("sope"), _metric("gait_compliance")),
)

TEXT = (
    "Margin of each claim, in its own unit: it holds above zero. The paper's margin is from its returns after as many "
    "steps, if they decide the claim. Ours are from finished runs alone."
)


def checked(found: Sequence[RunResult]) -> str:
    """Return a table of the margins of all claims in Markdown."""
    own = [each for each in found if is_papers(each) and each.steps[-1] >= each.run.configuration.steps]
    steps = min((each.run.configuration.steps for each in own), default=STEPS[-1])
    lines = []
    for claim in CLAIMS:

        def measured(robot, name, claim=claim):
            figures = [claim.figure(each) for each in own if _robot_and_algorithm(each) == (robot, name)]
            return float(np.mean(figures)) if figures else None

        told = {robot: claim.compared(robot, lambda r, n: at(r, n, steps)) for robot in PAPER}
        paper = told if claim.in_paper else {}
        ours = {robot: claim.compared(robot, measured) for robot in PAPER}
        lines.append((claim.text, _leads(paper), _verdict(paper), _leads(ours), _verdict(ours)))
    return table(("claim", "paper's margin", "holds there", "ours", "holds here"), lines)


def _robot_and_algorithm(result: RunResult) -> tuple[str, str]:
    return result.run.configuration.setup.body.name, result.run.configuration.algorithm


def is_papers(result: RunResult) -> bool:
    """Return whether the paper's curves have a run."""
    setup, algorithm = result.run.configuration.setup, result.run.configuration.algorithm
    plain = setup.kind.name == "walk" and not setup.task_kwargs and not result.run.label
    return plain and algorithm in PAPER.get(setup.body.name, {})


def _leads(figures: Mapping[str, float | None]) -> str:
    known = {robot: figure for robot, figure in figures.items() if figure is not None}
    return ", ".join(f"{robot} {figure:+.4g}" for robot, figure in known.items()) or "-"


def _verdict(figures: Mapping[str, float | None]) -> str:
    known = [figure > 0.0 for figure in figures.values() if figure is not None]
    return f"{sum(known)} of {len(known)} robots" if known else "not measured"
