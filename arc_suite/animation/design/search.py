"""MAP-Elites (Mouret and Clune, "Illuminating search spaces by mapping elites", 2015): the best body of every cell.

Bodies come in batches, and a batch depends on the seed, its number and the bodies before it alone. So a search does not
depend on the number of processes, and one that was broken off resumes from the outcomes in its journal. New genes are
those of an elite, moved at random and along the line to another elite (Vassiliades and Mouret, "Discovering the elite
hypervolume by leveraging interspecies correlation", 2018). Better elites are chosen more often, as a search has few
bodies for a cell.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.genes import Genes, body_within_budget
from arc_suite.animation.design.trials import GOALS, Outcome, Trial, WalkMeans
from arc_suite.robots.spec import Body

BATCH_SIZE = 20
RANDOM_BODIES = 40  # bodies of random genes, with which a search begins if not said otherwise
ISOTROPIC_DEVIATION, LINE_DEVIATION = (
    0.15,
    0.2,
)  # standard deviations of the moves, shares of a gene's range and of the distance
PARENT_BIAS = 3.0  # towards good elites: the rank of a parent, by their number, is a uniform number to this power
REDRAW_PROBABILITY = 0.05  # probability that a gene is drawn anew, by which counts change too


class Candidate(NamedTuple):
    """A body that was evaluated.

    Attributes:
        genes: (n,) from 0 to 1.
        cell: of the map; None for genes that make no body.
        outcome: of the body.
    """

    genes: tuple[float, ...]
    cell: tuple[int, ...] | None
    outcome: Outcome


class Candidates(NamedTuple):
    """Bodies that were evaluated together.

    Attributes:
        candidates: the bodies.
    """

    candidates: Sequence[Candidate]

    @classmethod
    def restored(cls, candidates: Sequence[Sequence]) -> "Candidates":
        """Return a batch from lists as JSON holds them."""
        return cls([Candidate(tuple(genes), cell and tuple(cell), _outcome(*rest)) for genes, cell, rest in candidates])


def _outcome(reason: str, first: Sequence | None, second: Sequence | None) -> Outcome:
    return Outcome(reason, WalkMeans(*first) if first else None, WalkMeans(*second) if second else None)


class Search:
    """A search for the best body of every cell.

    Attributes:
        genes: their names.
        candidates: all bodies, in order.
        elites: by cell, the index of the best in `candidates`.
    """

    def __init__(self, space: Genes, cells: Map, trial: Trial, seed: int, stem: str, random: int = RANDOM_BODIES):
        """Start a search.

        Args:
            space: of genes.
            cells: that are to be filled.
            trial: by which bodies are evaluated.
            seed: of the genes.
            stem: of the names of bodies, `<stem>_<index>`.
            random: bodies of random genes, with which the search begins.
        """
        self.genes = space.names
        self._space, self._cells, self._trial, self._seed, self._stem = space, cells, trial, seed, stem
        self._random = random
        self.candidates: list[Candidate] = []
        self.elites: dict[tuple[int, ...], int] = {}

    def batch(self, evaluated: Callable[[Iterable[tuple]], Iterable[Outcome]]) -> Candidates:
        """Evaluate the next batch of bodies, add and return it.

        Args:
            evaluated: maps arguments of `trials.evaluate` to outcomes, in order.
        """
        genes = self._genes()
        bodies = [self.body(numbers, len(self.candidates) + index) for index, numbers in enumerate(genes)]
        cells = [None if isinstance(body, str) else self._cells.cell(body) for body in bodies]
        outcomes = evaluated([(self._trial, body, self._value(cell)) for body, cell in zip(bodies, cells, strict=True)])
        found = Candidates([Candidate(*each) for each in zip(map(tuple, genes.tolist()), cells, outcomes, strict=True)])
        self.add(found)
        return found

    def add(self, batch: Candidates) -> None:
        """Add evaluated bodies: one whose second evaluation exceeds that of its cell's elite takes its place."""
        for one in batch.candidates:
            walk = None if one.outcome.reason else one.outcome.second
            if walk is not None and GOALS[self._trial.goal].value(walk) > self._value(one.cell):
                self.elites[one.cell] = len(self.candidates)
            self.candidates.append(one)

    def middle(self) -> Body | str:
        """Return the body in the middle of all ranges, or the reason why there is none."""
        return self.body([0.5] * len(self._space.names), 0)

    def body(self, genes: Sequence[float], index: int) -> Body | str:
        """Return the body of genes, named by its index; where they make none, the reason."""
        try:
            return body_within_budget(self._trial.budget, self._space, np.array(genes), f"{self._stem}_{index}")
        except ValueError as error:
            return f"no body: {error}"

    def _genes(self) -> np.ndarray:
        """Return the genes (BATCH, n) of the next batch, rounded as files hold them."""
        random = np.random.default_rng((self._seed, len(self.candidates)))
        drawn = random.uniform(size=(BATCH_SIZE, len(self._space.names)))
        best = sorted(self.elites, key=self._value, reverse=True)
        parents = [self.candidates[self.elites[cell]].genes for cell in best]
        if len(self.candidates) >= self._random and parents:
            ranks = len(parents) * random.uniform(size=(2, BATCH_SIZE)) ** PARENT_BIAS
            first, second = np.array(parents)[ranks.astype(int)]
            moved = first + ISOTROPIC_DEVIATION * random.standard_normal(drawn.shape)
            moved += LINE_DEVIATION * random.standard_normal((BATCH_SIZE, 1)) * (second - first)
            drawn = np.where(random.uniform(size=drawn.shape) < REDRAW_PROBABILITY, drawn, moved.clip(0.0, 1.0))
        return drawn.round(6)

    def _value(self, cell: tuple[int, ...] | None) -> float:
        """Return the metric of a cell's elite as a number to be raised."""
        if cell not in self.elites:
            return -np.inf
        return GOALS[self._trial.goal].value(self.candidates[self.elites[cell]].outcome.second)
