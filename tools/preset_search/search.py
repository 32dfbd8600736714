"""Searches by CMA-ES (Hansen, "The CMA evolution strategy: a tutorial", 2016) over the parameters of a demonstrator.

A candidate's fitness is its mean reward over a few seeded episodes, which are new in each
generation and the same for all of its candidates, less two penalties: for a style that is worse
than that of the preset `medium`, in the same episodes, and for tipping over in hard starts, those
of many that throw this preset about most.
"""

import contextlib
from typing import NamedTuple

import numpy as np

from arc_suite import seed_ranges
from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from preset_search.evaluator import STYLE, Evaluator, PresetScore
from preset_search.space import SPACES, round_vector

SPREAD = 0.5  # standard deviation of the first generation, in scales of the parameters
HARD = 8  # starts in which candidates are evaluated

_STYLE_PENALTY = 1.5  # reward, for a cost of style twice as large as that of medium
_STYLE_MARGIN = 0.03  # share by which style must be better, as few episodes estimate it
_TIPPING_PENALTY = 1.0  # reward, for a fall in all hard starts

_START_STEPS = 40  # control steps of a hard start, after which a robot stands or lies


class Generation(NamedTuple):
    """The result of a generation.

    Attributes:
        fitness: fitness of its candidates.
        reward: mean over the episodes of the fittest.
        tipping: tipping of the fittest in the hard starts; see `PresetScore`.
        style: the fittest's costs of style as shares of medium's, in the order of `evaluator.STYLE`.
    """

    fitness: list[float]
    reward: float
    tipping: float
    style: list[float]


class Search:
    """A search around a robot's preset, by generations.

    It is determined by its arguments and the fitness of its generations, so that one that was
    broken off resumes from the fitness of its past generations.

    Attributes:
        reward: mean reward of `medium`.
        candidates: how many a generation has.
    """

    def __init__(self, setup: Setup, seed: int, episodes: int, steps: int, starts: int, space: str = "law"):
        """Evaluate `medium` and the possible starting points; the search starts from the best.

        Args:
            setup: a robot that has presets, in a task.
            seed: seed of the search and its episodes.
            episodes: episodes by which a candidate is evaluated.
            steps: control steps of each.
            starts: starts to choose the hard ones from, at least `HARD`; 0 for none.
            space: space of searched parameters, a name of `space.SPACES`.

        Raises:
            ImportError: no package `cma`.
            ValueError: a task without the terms of style.
        """
        import cma  # of the extra `dev`

        presets_of_robot = PRESETS[setup.body.name]
        kind = SPACES[space]
        self._medium = presets_of_robot["medium"]
        self._space = kind.space(setup.body, presets_of_robot[kind.preset])
        self._episodes = episodes
        self._first = seed_ranges.of_run(seed).start
        self._starts = range(self._first, self._first + starts)
        origins = self._space.origins()
        presets = [self._medium, *map(self._space.preset, origins)]
        score = _evaluate_once(setup, presets, range(self._first, self._first + episodes), steps, kind.skipped)
        self.reward, *origin_rewards = score.rewards.mean(axis=-1).tolist()
        self._origin = origins[np.argmax(origin_rewards)]
        self._scale = np.array([number.scale for number in self._space.ranges()])
        options = {"randn": np.random.RandomState(seed).randn, "seed": np.nan, "verbose": -9}
        if kind.candidates is not None:
            options["popsize"] = kind.candidates
        self._strategy = cma.CMAEvolutionStrategy(np.zeros_like(self._origin), SPREAD, options)
        self.candidates = self._strategy.popsize
        self._evaluator = Evaluator(setup, self.candidates + 1, episodes, steps, kind.skipped)
        self._evaluator_of_starts = None
        if starts:
            tipping = _evaluate_once(setup, [self._medium], self._starts, _START_STEPS).tipping[0]
            self._hard = [self._starts[index] for index in np.argsort(tipping, stable=True)[-HARD:]]
            self._evaluator_of_starts = Evaluator(setup, self.candidates, HARD, _START_STEPS)
        self._generations = 0

    def step(self, fitness: list[float] | None = None) -> Generation | None:
        """Go on by a generation.

        Args:
            fitness: fitness of its candidates, if they have been evaluated before.

        Returns:
            The result of the generation; None with `fitness`.
        """
        solutions = self._strategy.ask()
        generation = None
        if fitness is None:
            presets = [self._space.preset(self._vector(solution)) for solution in solutions]
            generation = self._evaluate_generation(presets)
            fitness = generation.fitness
        self._strategy.tell(solutions, [-value for value in fitness])
        self._generations += 1
        return generation

    def result(self) -> Preset:
        """Return the mean of the distribution of the search, rounded: its estimate of the best preset."""
        return self._space.preset(round_vector(self._vector(self._strategy.mean), self._space.ranges()))

    def _vector(self, solution) -> np.ndarray:
        return self._origin + self._scale * solution

    def _evaluate_generation(self, presets) -> Generation:
        first = self._starts.stop + self._generations * self._episodes
        score = self._evaluator([*presets, self._medium], range(first, first + self._episodes))
        tipping = np.zeros(len(presets))
        if self._evaluator_of_starts:
            tipping = self._evaluator_of_starts(presets, self._hard).tipping.mean(axis=-1)
        rewards = score.rewards[:-1].mean(axis=-1)
        costs = np.stack([score.style[name].mean(axis=-1) for name in STYLE], axis=-1)
        style = costs[:-1] / costs[-1]  # the last row is that of medium
        excess = (style - (1.0 - _STYLE_MARGIN)).clip(0.0).sum(axis=-1)
        fitness = rewards - _STYLE_PENALTY * excess - _TIPPING_PENALTY * tipping
        best = fitness.argmax()
        return Generation(fitness.tolist(), float(rewards[best]), float(tipping[best]), style[best].tolist())


def _evaluate_once(setup: Setup, presets, seeds, steps: int, skipped: int = 0) -> PresetScore:
    with contextlib.closing(Evaluator(setup, len(presets), len(seeds), steps, skipped)) as evaluator:
        return evaluator(presets, seeds)
