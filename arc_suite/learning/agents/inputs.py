"""Inputs of networks: observations, normalized; privileged blocks of critics; and mirrored transitions."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.replay import Transitions
from arc_suite.policies.graph import Graph
from arc_suite.policies.tracing import perceptron, traced
from arc_suite.robots import mirror
from arc_suite.tasks import Task, blocks, mirrors, privileged
from arc_suite.tasks.mirrors import Mirror, Symmetry


def symmetry(task: Task, critic_blocks: Iterable[str] = ()) -> Symmetry | None:
    """Return the mirror maps of a task, with privileged blocks after its observation; None where there are none."""
    try:
        own = task.symmetry
        image = mirror.image(task.scene.body)
        more = [task.privileged_blocks[name].map(image) for name in critic_blocks]
    except ValueError:
        return None
    return own._replace(observation=mirrors.joined([own.observation, *more]))


def privileged_columns(task: Task, critic_blocks: Sequence[str]) -> np.ndarray:
    """Return the places of blocks in the privileged observation of a task.

    Raises:
        ValueError: the task has no such block.
    """
    there = blocks.places(privileged.sizes(task))
    names = checks.names("critic_blocks", critic_blocks, there, "block")
    return np.concatenate([np.arange(there[name].start, there[name].stop) for name in names])


class Inputs(NamedTuple):
    """How networks see the observations of a task.

    Attributes:
        size: of an observation.
        moments: of observations, which normalize them; None for raw numbers.
        symmetry: mirror maps of the task; None for no mirrored transitions.
    """

    size: int
    moments: Moments | None
    symmetry: Symmetry | None

    @classmethod
    def of(cls, task: Task, normalize: bool, symmetry_augmentation: bool) -> Self:
        """Return the inputs before the first observation.

        Args:
            task: whose observations they are.
            normalize: whether running moments normalize the inputs.
            symmetry_augmentation: whether to mirror transitions, if the task is symmetric.
        """
        return cls(
            task.size, Moments.none(task.size) if normalize else None, symmetry(task) if symmetry_augmentation else None
        )

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return the inputs for observations, both (..., size)."""
        return observations if self.moments is None else self.moments.normalizer()(observations)

    def after(self, observations: np.ndarray) -> Self:
        """Return the inputs with more observations (..., size), and their mirror images, in the moments."""
        if self.moments is None:
            return self
        moments = self.moments.after(observations)
        if self.symmetry is not None:
            moments = moments.after(self.symmetry.observation(observations))
        return self._replace(moments=moments)

    def of_batch(self, batch: Transitions) -> Transitions:
        """Return a batch of transitions with inputs in place of observations, every other transition mirrored."""
        seen = {name: getattr(batch, name) for name in ("observations", "next_observations")}
        if self.symmetry is not None:
            mirror_observation, mirror_action = self.symmetry
            seen = {name: _every_other(mirror_observation, observations) for name, observations in seen.items()}
            batch = batch._replace(actions=_every_other(mirror_action, batch.actions))
        return batch._replace(**{name: self(observations) for name, observations in seen.items()})

    def exported(self, layers: Sequence[Mapping]) -> Graph:
        """Return the policy, from the layers of an actor that takes inputs."""
        return traced(lambda x: perceptron(self(x), layers).node("Tanh"), self.size)


def _every_other(mirrored: Mirror, vectors: np.ndarray) -> np.ndarray:
    """Return a copy of vectors (batch, ...), every other one mirrored."""
    vectors = vectors.copy()
    vectors[1::2] = mirrored(vectors[1::2])
    return vectors
