"""CMA-ES (Hansen, "The CMA evolution strategy: a tutorial", 2016) over the numbers of a demonstrator.

A candidate's fitness is its mean reward over a few seeded episodes, which are new in each
generation and the same for all of its candidates, less a penalty for a style that is worse than
that of the preset from which the search sets out.
"""

from typing import NamedTuple

import numpy as np

from arc_suite.cpg.presets import TUNINGS, Preset
from arc_suite.robots import ROBOTS
from arc_suite.tuning.judge import STYLE, Judge, Score
from arc_suite.tuning.space import Space

SPREAD = 0.5  # of the first generation, in scales of the numbers
LEADS = 20  # of all legs over the clock, tried beforehand

_EXCESS = 1.5  # reward that a cost of style twice as large takes
_MARGIN = 0.03  # by which style is to be better, as it is judged by few episodes


class Generation(NamedTuple):
    """What a generation came to.

    Attributes:
        fitness: of its candidates.
        reward: mean over the episodes of the fittest.
        falls: share of all episodes.
        style: the fittest's costs of style as shares of the origin's, in the order of `judge.STYLE`.
    """

    fitness: list[float]
    reward: float
    falls: float
    style: list[float]


class Search:
    """A search about a robot's preset `medium`, by generations.

    It is determined by its arguments and the fitness of its generations, so that one that was
    broken off goes on where it was told of these.

    Attributes:
        reward: mean reward of `medium`.
        candidates: how many a generation has.
    """

    def __init__(self, robot: str, seed: int, episodes: int, steps: int):
        """Judges `medium`, with leads over its clock too; the best one is where the search sets out.

        Args:
            robot: one that has presets.
            seed: of the search and its episodes.
            episodes: by which a candidate is judged.
            steps: control steps of each.

        Raises:
            ImportError: no package `cma`.
        """
        import cma  # of the extra "tune"

        body, medium = ROBOTS[robot], TUNINGS[robot]["medium"]
        self._space, self._seed, self._episodes = Space(body, medium), seed, episodes
        leads = [lead / LEADS for lead in range(LEADS)]
        judge = Judge(body, 1 + LEADS, episodes, steps)
        score = judge([medium, *(self._space.preset(self._space.vector(lead)) for lead in leads)], seed)
        judge.close()
        self.reward, *by_lead = score.rewards.mean(axis=-1).tolist()
        self._style = _style(score)[0]
        self._origin = self._space.vector(leads[np.argmax(by_lead)])
        self._scale = np.array([number.scale for number in self._space.ranges()])
        options = {"randn": np.random.RandomState(seed).randn, "seed": np.nan, "verbose": -9}
        self._strategy = cma.CMAEvolutionStrategy(np.zeros_like(self._origin), SPREAD, options)
        self.candidates = self._strategy.popsize
        self._judge = Judge(body, self.candidates, episodes, steps)
        self._generations = 0

    def step(self, fitness: list[float] | None = None) -> Generation | None:
        """Goes on by a generation.

        Args:
            fitness: of its candidates, if they have been judged before.

        Returns:
            What it came to; None with `fitness`.
        """
        solutions = self._strategy.ask()
        generation = None
        if fitness is None:
            generation = self._judged([self._space.preset(self._vector(solution)) for solution in solutions])
            fitness = generation.fitness
        self._strategy.tell(solutions, [-value for value in fitness])
        self._generations += 1
        return generation

    def result(self) -> Preset:
        """What the search believes to be best: the mean of its distribution, rounded."""
        return self._space.preset(self._space.rounded(self._vector(self._strategy.mean)))

    def _vector(self, solution) -> np.ndarray:
        return self._origin + self._scale * solution

    def _judged(self, presets) -> Generation:
        score = self._judge(presets, self._seed + (1 + self._generations) * self._episodes)
        rewards, style = score.rewards.mean(axis=-1), _style(score) / self._style
        fitness = rewards - _EXCESS * (style - (1.0 - _MARGIN)).clip(0.0).sum(axis=-1)
        best = fitness.argmax()
        return Generation(fitness.tolist(), float(rewards[best]), float(score.falls.mean()), style[best].tolist())


def _style(score: Score) -> np.ndarray:
    """Costs of style, means over episodes, (presets, costs)."""
    return np.stack([score.style[name].mean(axis=-1) for name in STYLE], axis=-1)
