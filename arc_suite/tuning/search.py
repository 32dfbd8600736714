"""Searches by CMA-ES (Hansen, "The CMA evolution strategy: a tutorial", 2016) over the numbers of a demonstrator.

A candidate's fitness is its mean reward over a few seeded episodes, which are new in each
generation and the same for all of its candidates, less two penalties: for a style that is worse
than that of the preset `medium`, in the same episodes, and for tipping over in hard starts, those
of many that throw this preset about most.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.presets import PRESETS
from arc_suite.robots import ROBOTS
from arc_suite.tuning.judge import STYLE, Judge, Score
from arc_suite.tuning.space import SPACES

SPREAD = 0.5  # of the first generation, in scales of the numbers
HARD = 8  # starts that candidates are tried in

_EXCESS = 1.5  # reward that a cost of style twice as large takes
_MARGIN = 0.03  # by which style is to be better, as it is judged by few episodes
_TIPPING = 1.0  # reward that falling in all hard starts takes

_START_STEPS = 40  # control steps of these, after which a robot stands or lies
_SEEDS = 100_000  # of a search; those below are left for judging what it finds


class Generation(NamedTuple):
    """What a generation came to.

    Attributes:
        fitness: of its candidates.
        reward: mean over the episodes of the fittest.
        tipping: of the fittest in the hard starts; see `Score`.
        style: the fittest's costs of style as shares of medium's, in the order of `judge.STYLE`.
    """

    fitness: list[float]
    reward: float
    tipping: float
    style: list[float]


class Search:
    """A search about a robot's preset, by generations.

    It is determined by its arguments and the fitness of its generations, so that one that was
    broken off goes on where it was told of these.

    Attributes:
        reward: mean reward of `medium`.
        candidates: how many a generation has.
    """

    def __init__(
        self,
        robot: str,
        seed: int,
        episodes: int,
        steps: int,
        starts: int,
        numbers: str = "law",
        task: str = "walk",
        task_kwargs: Mapping[str, Any] | None = None,
    ):
        """Judge `medium` and where the search may set out; it does from the best.

        Args:
            robot: one that has presets.
            seed: of the search and its episodes.
            episodes: by which a candidate is judged.
            steps: control steps of each.
            starts: of which the hard ones are taken, at least `HARD`; 0 for none.
            numbers: that are searched, a name of `space.SPACES`.
            task: name of the task.
            task_kwargs: its settings, as in `arc_suite.load`.

        Raises:
            ImportError: no package `cma`.
            ValueError: a task without the terms of style; one line.
        """
        import cma  # of the extra "tune"

        body, self._medium, kind = ROBOTS[robot], PRESETS[robot]["medium"], SPACES[numbers]
        self._space, self._episodes = kind.space(body, PRESETS[robot][kind.preset]), episodes
        self._first = _SEEDS * (1 + seed)
        self._starts = range(self._first, self._first + starts)
        origins = self._space.origins()
        presets = [self._medium, *map(self._space.preset, origins)]
        play = {"task": task, "task_kwargs": task_kwargs}
        walk = play | {"skipped": kind.skipped}
        score = _judged(body, presets, range(self._first, self._first + episodes), steps, walk)
        self.reward, *by_origin = score.rewards.mean(axis=-1).tolist()
        self._origin = origins[np.argmax(by_origin)]
        self._scale = np.array([number.scale for number in self._space.ranges()])
        options = {"randn": np.random.RandomState(seed).randn, "seed": np.nan, "verbose": -9}
        options |= {} if kind.candidates is None else {"popsize": kind.candidates}
        self._strategy = cma.CMAEvolutionStrategy(np.zeros_like(self._origin), SPREAD, options)
        self.candidates = self._strategy.popsize
        self._judge, self._judge_of_starts = Judge(body, self.candidates + 1, episodes, steps, **walk), None
        if starts:
            tipping = _judged(body, [self._medium], self._starts, _START_STEPS, play).tipping[0]
            self._hard = [self._starts[index] for index in np.argsort(tipping, stable=True)[-HARD:]]
            self._judge_of_starts = Judge(body, self.candidates, HARD, _START_STEPS, **play)
        self._generations = 0

    def step(self, fitness: list[float] | None = None) -> Generation | None:
        """Go on by a generation.

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
        """Return what the search believes to be best: the mean of its distribution, rounded."""
        return self._space.preset(self._space.rounded(self._vector(self._strategy.mean)))

    def _vector(self, solution) -> np.ndarray:
        return self._origin + self._scale * solution

    def _judged(self, presets) -> Generation:
        first = self._starts.stop + self._generations * self._episodes
        score = self._judge([*presets, self._medium], range(first, first + self._episodes))
        tipping = np.zeros(len(presets))
        if self._judge_of_starts:
            tipping = self._judge_of_starts(presets, self._hard).tipping.mean(axis=-1)
        rewards = score.rewards[:-1].mean(axis=-1)
        costs = np.stack([score.style[name].mean(axis=-1) for name in STYLE], axis=-1)
        style = costs[:-1] / costs[-1]
        fitness = rewards - _EXCESS * (style - (1.0 - _MARGIN)).clip(0.0).sum(axis=-1) - _TIPPING * tipping
        best = fitness.argmax()
        return Generation(fitness.tolist(), float(rewards[best]), float(tipping[best]), style[best].tolist())


def _judged(body, presets, seeds, steps, play: Mapping[str, Any]) -> Score:
    judge = Judge(body, len(presets), len(seeds), steps, **play)
    score = judge(presets, seeds)
    judge.close()
    return score
