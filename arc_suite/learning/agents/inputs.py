"""Inputs of the networks of soft actor-critic: observations as legs see them, normalized; and mirrored transitions."""

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
    """How networks see the observations of a task, and how their outputs become actions.

    Attributes:
        observation_size: numbers of an observation.
        size: numbers of a network's input; of a leg's, if legs share the network.
        joints: shape of a network's output: (joints,), or (legs, joints of a leg).
        moments: moments of the inputs, which normalize them; None for no normalization.
        symmetry: mirror maps of the task; None for no mirrored transitions.
        legs: architecture of legs that share a network; None for a perceptron of the body.
    """

    observation_size: int
    size: int
    joints: tuple[int, ...]
    moments: Moments | None
    symmetry: Symmetry | None
    legs: Legs | None = None

    @classmethod
    def of(cls, task: Task, normalize: bool, symmetry_augmentation: bool, network: str = "perceptron") -> Self:
        """Return the inputs before the first observation.

        Args:
            task: task whose observations they are.
            normalize: whether running moments normalize the inputs.
            symmetry_augmentation: whether left and right are alike, if the task is symmetric: transitions are
                mirrored, unless the network of legs treats both sides alike.
            network: "perceptron" or "legs".

        Raises:
            ValueError: legs with different numbers of joints cannot share a network.
        """
        size = task.size
        joints = (len(task.scene.body.joint_names),)
        legs = None
        if network == "legs":
            legs = Legs.of(task, symmetric=symmetry_augmentation)
            joints_of_a_leg = legs.views.most
            size = legs.features
            joints = (legs.legs, joints_of_a_leg)
            if legs.joints < legs.legs * joints_of_a_leg:
                raise ValueError("network: expected perceptron for legs with different numbers of joints, got legs")
        is_network_symmetric = legs is not None and legs.symmetric
        symmetry = None
        if symmetry_augmentation and not is_network_symmetric:
            symmetry = critic_blocks.mirror_maps(task)
        moments = Moments.empty(size) if normalize else None
        return cls(task.size, size, joints, moments, symmetry, legs)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return the inputs of networks for observations (..., observation_size).

        Returns:
            (..., size); or (..., legs, size), if legs share the network.
        """
        views = self._view(observations)
        if self.moments is not None:
            normalize = self.moments.normalizer()
            views = normalize(views)
        return views if self.legs is None else views * self.legs.scale

    def with_observations(self, observations: np.ndarray) -> Self:
        """Return the inputs with more observations (..., observation_size) in the moments, mirrored ones too."""
        if self.moments is None:
            return self
        moments = self.moments.with_vectors(self._view(observations))
        if self.symmetry is not None:
            moments = moments.with_vectors(self._view(self.symmetry.observation(observations)))
        return self._replace(moments=moments)

    def transform_batch(self, batch: Transitions) -> Transitions:
        """Return a batch of transitions as inputs and outputs of networks; every other transition is mirrored."""
        observations = batch.observations
        actions = batch.actions
        next_observations = batch.next_observations
        if self.symmetry is not None:
            observations = _mirror_every_other(self.symmetry.observation, observations)
            actions = _mirror_every_other(self.symmetry.action, actions)
            next_observations = _mirror_every_other(self.symmetry.observation, next_observations)
        if self.legs is not None:
            actions = self.legs.leg_actions(actions)
        return batch._replace(
            observations=self(observations), actions=actions, next_observations=self(next_observations)
        )

    def body_actions(self, outputs: np.ndarray) -> np.ndarray:
        """Return the actions (..., joints) of the body for the outputs of a network."""
        return outputs if self.legs is None else self.legs.body_actions(outputs)

    def policy_graph(self, layers: Sequence[Mapping]) -> Graph:
        """Return the graph of a policy, from the layers of its network."""

        def trace_body(observation):
            return perceptron(self(observation), layers).node("Tanh")

        def trace_legs(observation):
            return self.body_actions(leg_networks.trace_shared_layers(self(observation), layers).node("Tanh"))

        return traced(trace_body if self.legs is None else trace_legs, self.observation_size)

    def _view(self, observations):
        """Return observations as networks see them, before normalization."""
        return observations if self.legs is None else self.legs.moment_vectors(self.legs.view(observations))


def _mirror_every_other(mirror: Mirror, vectors):
    """Return vectors (batch, size) of NumPy or JAX, every other one mirrored."""
    xp = vectors.__array_namespace__()
    is_mirrored = np.arange(len(vectors))[:, None] % 2 == 1
    return xp.where(is_mirrored, mirror(vectors), vectors)
