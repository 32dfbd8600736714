"""Start replay: a share of the training episodes repeats starts after which the body has fallen at once.

Such starts are rare. A policy that has met one seldom meets it again before it has forgotten it. The latest of them
are kept until an episode from the same start goes well, as levels are by the scores of Jiang et al., "Prioritized level
replay" (2021). A start is known by the seed of its episode.
"""

from typing import NamedTuple, Self

import numpy as np

EARLY = 100  # control steps; a fall before is one of the start
CAPACITY = 256  # starts that are kept
_EMPTY = -1  # in place of a seed


class StartReplay(NamedTuple):
    """Seeds of the present episodes, and of starts to repeat.

    Attributes:
        present: (num_envs,) seeds of the present episodes.
        fallen: (CAPACITY,) seeds of starts after which the body fell, -1 for none.
        steps: (num_envs,) control steps of the present episodes.
        begun: () number of seeds of the run that episodes have had.
        kept: () number of starts that have been kept so far; the next one takes the place of the oldest.
    """

    present: np.ndarray
    fallen: np.ndarray
    steps: np.ndarray
    begun: np.ndarray
    kept: np.ndarray

    @classmethod
    def begin(cls, seeds: range, num_envs: int) -> Self:
        """Return the state in which the first episodes have the first seeds of a run."""
        return cls(
            present=np.array(seeds[:num_envs]),
            fallen=np.full(CAPACITY, _EMPTY),
            steps=np.zeros(num_envs, int),
            begun=np.array(num_envs),
            kept=np.array(0),
        )

    def end_episodes(self, ended: np.ndarray, fell: np.ndarray) -> Self:
        """Return the state after episodes have ended: their starts are kept, or kept no longer.

        Args:
            ended: (num_envs,) whether an episode has ended.
            fell: (num_envs,) whether it has ended by a fall.
        """
        fallen = self.fallen.copy()
        kept = int(self.kept)
        for index in np.flatnonzero(ended):
            seed = self.present[index]
            if not (fell[index] and self.steps[index] <= EARLY):
                fallen[fallen == seed] = _EMPTY
            elif seed not in fallen:
                fallen[kept % CAPACITY] = seed
                kept += 1
        return self._replace(fallen=fallen, kept=np.array(kept))

    def begin_episodes(self, ended: np.ndarray, share: float, seeds: range, random: np.random.Generator) -> Self:
        """Return the state with the seeds of the next episodes.

        Args:
            ended: (num_envs,) environments that begin an episode.
            share: share of episodes that repeat a start, while there is one.
            seeds: all seeds of the run. They come in their order, and again after the last.
            random: generator of the draws.
        """
        present = self.present.copy()
        begun = int(self.begun)
        candidates = self.fallen[self.fallen != _EMPTY]
        for index in np.flatnonzero(ended):
            repeats = random.random() < share
            if repeats and len(candidates):
                present[index] = random.choice(candidates)
            else:
                present[index] = seeds[begun % len(seeds)]
                begun += 1
        return self._replace(present=present, steps=np.where(ended, 0, self.steps), begun=np.array(begun))
