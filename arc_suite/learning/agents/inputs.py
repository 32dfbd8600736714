"""Inputs of networks: numbers of the observation without some blocks, normalised; and mirrored transitions."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite.learning.agents.normaliser import Moments, Normalizer
from arc_suite.learning.agents.replay import Transitions
from arc_suite.policies.graph import Graph
from arc_suite.policies.tracing import perceptron, traced
from arc_suite.tasks import Task
from arc_suite.tasks.mirrors import Mirror, Symmetry


def symmetry(task: Task) -> Symmetry | None:
    """Return the mirror maps of a task; None where there are none."""
    try:
        return task.symmetry
    except ValueError:
        return None


class Inputs(NamedTuple):
    """How networks see the observations of a task.

    Attributes:
        size: of an observation.
        columns: (inputs,) indices of the numbers that networks see.
        moments: of these numbers, which normalise them; None for raw numbers.
        symmetry: mirror maps of the task; None for no mirrored transitions.
    """

    size: int
    columns: np.ndarray
    moments: Moments | None
    symmetry: Symmetry | None

    @classmethod
    def of(cls, task: Task, exclude_blocks: Iterable[str], normalize: bool, mirror: bool) -> Self:
        """Return the inputs before the first observation.

        Args:
            task: whose observations they are.
            exclude_blocks: names of blocks that networks do not see; a task may lack them.
            normalize: whether running moments normalise the inputs.
            mirror: whether to mirror transitions, if the task is symmetric.

        Raises:
            ValueError: no block is left.
        """
        seen = np.concatenate([np.full(size, name not in exclude_blocks) for name, size in task.sizes.items()])
        if not seen.any():
            raise ValueError(f"exclude_blocks: expected to leave a block, got all of them: {', '.join(task.sizes)}")
        columns = np.flatnonzero(seen)
        moments = Moments.none(len(columns)) if normalize else None
        return cls(task.size, columns, moments, symmetry(task) if mirror else None)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return the inputs (..., inputs) for observations (..., size)."""
        found = observations[..., self.columns]
        return found if self.moments is None else self.moments.normalizer()(found)

    def after(self, observations: np.ndarray) -> Self:
        """Return the inputs with more observations (..., size), and their mirror images, in the moments."""
        if self.moments is None:
            return self
        moments = self.moments.after(observations[..., self.columns])
        if self.symmetry is not None:
            moments = moments.after(self.symmetry.observation(observations)[..., self.columns])
        return self._replace(moments=moments)

    def of_batch(self, batch: Transitions) -> Transitions:
        """Return a batch of transitions with inputs in place of observations, every other transition mirrored."""
        seen = {name: getattr(batch, name) for name in ("observations", "next_observations")}
        if self.symmetry is not None:
            mirror, mirror_action = self.symmetry
            seen = {name: _every_other(mirror, observations) for name, observations in seen.items()}
            batch = batch._replace(actions=_every_other(mirror_action, batch.actions))
        return batch._replace(**{name: self(observations) for name, observations in seen.items()})

    def exported(self, layers: Sequence[Mapping]) -> Graph:
        """Return the policy of whole observations, from the layers of an actor that takes inputs."""
        first, *others = layers
        layers = {**first, "weight": self._whole(first["weight"])}, *others

        def normalize(x):
            if self.moments is None:
                return x
            mean, factor, limit = self.moments.normalizer()
            return Normalizer(self._whole(mean), self._whole(factor), limit)(x)

        return traced(lambda x: perceptron(normalize(x), layers).node("Tanh"), self.size)

    def _whole(self, array: np.ndarray) -> np.ndarray:
        """Return an array (inputs, ...) as one (size, ...), 0 for numbers that networks do not see."""
        whole = np.zeros((self.size, *array.shape[1:]), np.float32)
        whole[self.columns] = array
        return whole


def _every_other(mirror: Mirror, vectors: np.ndarray) -> np.ndarray:
    """Return a copy of vectors (batch, ...), every other one mirrored."""
    vectors = vectors.copy()
    vectors[1::2] = mirror(vectors[1::2])
    return vectors
