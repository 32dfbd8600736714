"""Inputs of the networks of soft actor-critic: observations, normalized; as legs see them; and mirrored transitions."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite.learning.agents import critic_blocks, leg_networks
from arc_suite.learning.agents.leg_networks import Legs
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.replay import Transitions
from arc_suite.policies.graph import Graph
from arc_suite.policies.tracing import perceptron, traced
from arc_suite.tasks import Task
from arc_suite.tasks.mirrors import Mirror, Symmetry


class NetworkInputs(NamedTuple):
    """How networks see the observations of a task, and what they do.

    Attributes:
        observed: size of an observation.
        size: of what a network sees, of a leg if legs share it.
        joints: shape of what it does: (joints,), or (legs, joints of a leg).
        moments: of what it sees, which normalize it; None for raw numbers.
        symmetry: mirror maps of the task; None for no mirrored transitions.
        legs: what legs see and do, if they share a network.
    """

    observed: int
    size: int
    joints: tuple[int, ...]
    moments: Moments | None
    symmetry: Symmetry | None
    legs: Legs | None = None

    @classmethod
    def of(cls, task: Task, normalize: bool, symmetry_augmentation: bool, network: str = "perceptron") -> Self:
        """Return the inputs before the first observation.

        Args:
            task: whose observations they are.
            normalize: whether running moments normalize the inputs.
            symmetry_augmentation: whether left and right are alike, if the task is symmetric: transitions are
                mirrored, unless the network of legs treats both sides alike.
            network: "perceptron" or "legs".

        Raises:
            ValueError: legs with different numbers of joints cannot share a network.
        """
        size, joints, legs = task.size, (len(task.scene.body.joint_names),), None
        if network == "legs":
            legs = Legs.of(task, symmetric=symmetry_augmentation)
            size, joints = legs.features, (legs.legs, legs.views.most)
            if legs.joints < legs.legs * legs.views.most:
                raise ValueError("network: expected perceptron for legs with different numbers of joints, got legs")
        mirrored = symmetry_augmentation and not (legs and legs.symmetric)
        symmetry = critic_blocks.mirror_maps(task) if mirrored else None
        return cls(task.size, size, joints, Moments.empty(size) if normalize else None, symmetry, legs)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return what networks see (..., size), or (..., legs, size), of observations (..., observed)."""
        seen = self._seen(observations)
        seen = seen if self.moments is None else self.moments.normalizer()(seen)
        return seen if self.legs is None else seen * self.legs.scale

    def with_observations(self, observations: np.ndarray) -> Self:
        """Return the inputs with more observations (..., observed), and their mirror images, in the moments."""
        if self.moments is None:
            return self
        moments = self.moments.with_vectors(self._seen(observations))
        if self.symmetry is not None:
            moments = moments.with_vectors(self._seen(self.symmetry.observation(observations)))
        return self._replace(moments=moments)

    def transform_batch(self, batch: Transitions) -> Transitions:
        """Return a batch of transitions as networks see and do them, every other transition mirrored."""
        seen = {name: getattr(batch, name) for name in ("observations", "next_observations")}
        if self.symmetry is not None:
            mirror_observation, mirror_action = self.symmetry
            seen = {name: _every_other(mirror_observation, observations) for name, observations in seen.items()}
            batch = batch._replace(actions=_every_other(mirror_action, batch.actions))
        if self.legs is not None:
            batch = batch._replace(actions=self.legs.leg_actions(batch.actions))
        return batch._replace(**{name: self(observations) for name, observations in seen.items()})

    def body_actions(self, actions: np.ndarray) -> np.ndarray:
        """Return the actions (..., joints) of a body that are what a network does."""
        return actions if self.legs is None else self.legs.body_actions(actions)

    def policy_graph(self, layers: Sequence[Mapping]) -> Graph:
        """Return the policy, from the layers of an actor."""
        if self.legs is not None:
            return traced(
                lambda x: self.body_actions(leg_networks.trace_shared_layers(self(x), layers).node("Tanh")),
                self.observed,
            )
        return traced(lambda x: perceptron(self(x), layers).node("Tanh"), self.observed)

    def _seen(self, observations):
        return observations if self.legs is None else self.legs.seen(self.legs.viewed(observations))


def _every_other(mirrored: Mirror, vectors: np.ndarray) -> np.ndarray:
    """Return a copy of vectors (batch, ...), every other one mirrored."""
    vectors = vectors.copy()
    vectors[1::2] = mirrored(vectors[1::2])
    return vectors
