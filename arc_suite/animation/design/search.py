"""MAP-Elites (Mouret and Clune, "Illuminating search spaces by mapping elites", 2015): the best body of every cell.

The best body of a cell is its elite. Bodies come in batches. A batch depends only on the seed, its number and the
bodies before it. So a search does not depend on the number of processes, and an interrupted search resumes from the
outcomes in its journal.

New genes are those of an elite, moved at random and along the line to another elite (Vassiliades and Mouret,
"Discovering the elite hypervolume by leveraging interspecies correlation", 2018). Better elites become parents more
often, as a search has few bodies for a cell.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.genes import Genes, body_within_budget
from arc_suite.animation.design.trials import Outcome, Trial, WalkMeans, goal_of
from arc_suite.robots.spec import Body

BATCH_SIZE = 20  # bodies
RANDOM_BODIES = 40  # bodies of random genes, with which a search begins by default
ISOTROPIC_DEVIATION = 0.15  # of a gene's random move, a share of its range
LINE_DEVIATION = 0.2  # of the move along the line to another elite, a share of the distance
PARENT_BIAS = 3.0  # exponent; the rank of a parent is the number of parents, times a uniform number to this power
REDRAW_PROBABILITY = 0.05  # that a gene is random, and not that of a parent, so that counts change too


class Candidate(NamedTuple):
    """A body that was evaluated.

    Attributes:
        genes: (n,) from 0 to 1.
        cell: cell of the map; None for genes that make no body.
        outcome: outcome of the body.
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
    def from_json(cls, candidates: Sequence[Sequence]) -> "Candidates":
        """Return a batch from lists as JSON holds them."""
        return cls([_candidate_from_json(*fields) for fields in candidates])


def _candidate_from_json(genes: Sequence[float], cell: Sequence[int] | None, outcome: Sequence) -> Candidate:
    reason, first, second = outcome
    return Candidate(
        genes=tuple(genes),
        cell=tuple(cell) if cell else None,
        outcome=Outcome(
            reason=reason,
            first=WalkMeans(*first) if first else None,
            second=WalkMeans(*second) if second else None,
        ),
    )


class Search:
    """A search for the best body of every cell.

    Attributes:
        genes: their names.
        candidates: all bodies, in order.
        elites: by cell, the index of the best body in `candidates`.
    """

    def __init__(
        self, space: Genes, cell_map: Map, trial: Trial, seed: int, stem: str, random_bodies: int = RANDOM_BODIES
    ):
        """Start a search.

        Args:
            space: genes.
            cell_map: with the cells to fill.
            trial: trial by which bodies are evaluated.
            seed: seed of the genes.
            stem: first part of the names of bodies, `<stem>_<index>`.
            random_bodies: number of bodies of random genes, with which the search begins.
        """
        self.genes = space.names
        self._space = space
        self._cell_map = cell_map
        self._trial = trial
        self._goal = goal_of(trial.goal)
        self._seed = seed
        self._stem = stem
        self._random_bodies = random_bodies
        self.candidates: list[Candidate] = []
        self.elites: dict[tuple[int, ...], int] = {}

    def evaluate_batch(self, evaluate_all: Callable[[Iterable[tuple]], Iterable[Outcome]]) -> Candidates:
        """Evaluate the next batch of bodies, add it and return it.

        Args:
            evaluate_all: maps tuples of arguments of `trials.evaluate` to outcomes, in order.
        """
        genes = self._next_genes()
        jobs = []
        cells = []
        for index, body_genes in enumerate(genes):
            body = self.body(body_genes, len(self.candidates) + index)
            cell = None if isinstance(body, str) else self._cell_map.cell(body)
            cells.append(cell)
            jobs.append((self._trial, body, self._elite_value(cell)))
        outcomes = evaluate_all(jobs)
        batch = Candidates(
            [
                Candidate(tuple(body_genes), cell, outcome)
                for body_genes, cell, outcome in zip(genes.tolist(), cells, outcomes, strict=True)
            ]
        )
        self.add(batch)
        return batch

    def add(self, batch: Candidates) -> None:
        """Add evaluated bodies: a body whose second evaluation exceeds that of its cell's elite becomes the elite."""
        for candidate in batch.candidates:
            may_be_elite = not candidate.outcome.reason and candidate.outcome.second is not None
            if may_be_elite and self._goal.value(candidate.outcome.second) > self._elite_value(candidate.cell):
                self.elites[candidate.cell] = len(self.candidates)
            self.candidates.append(candidate)

    def middle_body(self) -> Body | str:
        """Return the body in the middle of all ranges, or the reason why there is none."""
        return self.body([0.5] * len(self._space.names), 0)

    def body(self, genes: Sequence[float], index: int) -> Body | str:
        """Return the body of genes, named by its index, or the reason why genes make no body."""
        try:
            return body_within_budget(self._trial.budget, self._space, np.array(genes), f"{self._stem}_{index}")
        except ValueError as error:
            return f"no body: {error}"

    def _next_genes(self) -> np.ndarray:
        """Return the genes (BATCH_SIZE, n) of the next batch, rounded as files hold them."""
        rng = np.random.default_rng((self._seed, len(self.candidates)))
        random_genes = rng.uniform(size=(BATCH_SIZE, len(self._space.names)))
        best_cells = sorted(self.elites, key=self._elite_value, reverse=True)
        parents = np.array([self.candidates[self.elites[cell]].genes for cell in best_cells])  # the best first
        if len(self.candidates) < self._random_bodies or not len(parents):
            return random_genes.round(6)
        parent_ranks = len(parents) * rng.uniform(size=(2, BATCH_SIZE)) ** PARENT_BIAS
        first_parents, second_parents = parents[parent_ranks.astype(int)]
        genes = first_parents + ISOTROPIC_DEVIATION * rng.standard_normal(random_genes.shape)
        line_moves = LINE_DEVIATION * rng.standard_normal((BATCH_SIZE, 1))
        genes += line_moves * (second_parents - first_parents)
        is_redrawn = rng.uniform(size=genes.shape) < REDRAW_PROBABILITY
        return np.where(is_redrawn, random_genes, genes.clip(0.0, 1.0)).round(6)

    def _elite_value(self, cell: tuple[int, ...] | None) -> float:
        """Return the value of a cell's elite, see `Goal.value`; -inf without an elite."""
        if cell not in self.elites:
            return -np.inf
        elite = self.candidates[self.elites[cell]]
        return self._goal.value(elite.outcome.second)
