"""MAP-Elites (Mouret and Clune, "Illuminating search spaces by mapping elites", 2015): the best body of every cell.

Bodies come in batches, and a batch depends on the seed, its number and the bodies before it alone. So a search does not
depend on how many processes judge, and one that was broken off resumes from the judgements that it has made. New genes
are those of an elite, moved at random and along the line to another elite (Vassiliades and Mouret, "Discovering the
elite hypervolume by leveraging interspecies correlation", 2018).
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.design.axes import Map
from arc_suite.design.genes import Genes, within
from arc_suite.design.judging import GOALS, Judgement, Trial, Walk
from arc_suite.robots.spec import Body

BATCH = 20
RANDOM = 40  # bodies of random genes, with which a search begins
ISOTROPIC, LINE = 0.05, 0.2  # standard deviations of the moves, shares of a gene's range and of the distance
REDRAWN = 0.05  # probability that a gene is drawn anew, by which counts change too


class Judged(NamedTuple):
    """A body that was judged.

    Attributes:
        genes: (n,) from 0 to 1.
        cell: of the map; None for genes that make no body.
        judgement: of the body.
    """

    genes: tuple[float, ...]
    cell: tuple[int, ...] | None
    judgement: Judgement


class Batch(NamedTuple):
    """Bodies that were judged together.

    Attributes:
        judged: the bodies.
    """

    judged: Sequence[Judged]

    @classmethod
    def restored(cls, judged: Sequence[Sequence]) -> "Batch":
        """Return a batch from lists as JSON holds them."""
        return cls([Judged(tuple(genes), cell and tuple(cell), _judgement(*rest)) for genes, cell, rest in judged])


def _judgement(reason: str, first: Sequence | None, second: Sequence | None) -> Judgement:
    return Judgement(reason, first and Walk(*first), second and Walk(*second))


class Search:
    """A search for the best body of every cell.

    Attributes:
        genes: their names.
        judged: all bodies, in order.
        elites: by cell, the index of the best in `judged`.
    """

    def __init__(self, space: Genes, cells: Map, trial: Trial, seed: int, stem: str):
        """Start a search.

        Args:
            space: of genes.
            cells: that are to be filled.
            trial: by which bodies are judged.
            seed: of the genes.
            stem: of the names of bodies, `<stem>_<index>`.
        """
        self.genes = space.names
        self._space, self._cells, self._trial, self._seed, self._stem = space, cells, trial, seed, stem
        self.judged: list[Judged] = []
        self.elites: dict[tuple[int, ...], int] = {}

    def batch(self, judge: Callable[[Iterable[tuple]], Iterable[Judgement]]) -> Batch:
        """Judge the next batch of bodies, add and return it.

        Args:
            judge: maps arguments of `judging.judge` to judgements, in order.
        """
        genes = self._genes()
        bodies = [self.body(numbers, len(self.judged) + index) for index, numbers in enumerate(genes)]
        cells = [None if isinstance(body, str) else self._cells.cell(body) for body in bodies]
        judgements = judge([(self._trial, body, self._value(cell)) for body, cell in zip(bodies, cells, strict=True)])
        found = Batch([Judged(*each) for each in zip(map(tuple, genes.tolist()), cells, judgements, strict=True)])
        self.add(found)
        return found

    def add(self, batch: Batch) -> None:
        """Add judged bodies: one whose second judgement is above that of its cell's elite takes the elite's place."""
        for one in batch.judged:
            walk = None if one.judgement.reason else one.judgement.second
            if walk is not None and GOALS[self._trial.goal].value(walk) > self._value(one.cell):
                self.elites[one.cell] = len(self.judged)
            self.judged.append(one)

    def middle(self) -> Body | str:
        """Return the body in the middle of all ranges, or the reason why there is none."""
        return self.body([0.5] * len(self._space.names), 0)

    def body(self, genes: Sequence[float], index: int) -> Body | str:
        """Return the body of genes, named by its index; where they make none, the reason."""
        try:
            return within(self._trial.budget, self._space, np.array(genes), f"{self._stem}_{index}")
        except ValueError as error:
            return f"no body: {error}"

    def _genes(self) -> np.ndarray:
        """Return the genes (BATCH, n) of the next batch, rounded as files hold them."""
        random = np.random.default_rng((self._seed, len(self.judged)))
        drawn = random.uniform(size=(BATCH, len(self._space.names)))
        parents = [self.judged[index].genes for index in self.elites.values()]
        if len(self.judged) >= RANDOM and parents:
            first, second = np.array(parents)[random.integers(len(parents), size=(2, BATCH))]
            moved = first + ISOTROPIC * random.standard_normal(drawn.shape)
            moved += LINE * random.standard_normal((BATCH, 1)) * (second - first)
            drawn = np.where(random.uniform(size=drawn.shape) < REDRAWN, drawn, moved.clip(0.0, 1.0))
        return drawn.round(6)

    def _value(self, cell: tuple[int, ...] | None) -> float:
        """Return the figure of a cell's elite as a number to be raised."""
        if cell not in self.elites:
            return -np.inf
        return GOALS[self._trial.goal].value(self.judged[self.elites[cell]].judgement.second)
