"""Policies of any body: a network that was trained with many bodies, acting for one of them."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite.bodies import tokens
from arc_suite.bodies.tokens import Tokens
from arc_suite.cpg.law import Clocked, proprioception, read_blocks, torques
from arc_suite.envs.setup import Setup
from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import measure_standing
from arc_suite.policies import network
from arc_suite.policies.graph import Graph
from arc_suite.policies.network import PACKAGED, Network
from arc_suite.policies.tracing import repeated, traced
from arc_suite.tasks import Task

NAME = "universal"  # of the policies that come with the package


def load(name: str | os.PathLike, task: Task | None = None) -> Network:
    """Return a policy of many bodies: `universal`, which comes with the package, a policy file, or that of a run.

    Args:
        name: of the policy.
        task: in which `universal` acts: it follows a command where the task has one. None for walk.

    Raises:
        ValueError: a damaged file, or a policy of one body.
        OSError: the file cannot be read.
    """
    trained_in = "steer" if task is not None and "command" in task.blocks else "walk"
    packaged = PACKAGED / f"{NAME}-{trained_in}{network.EXTENSION}"
    made = network.load(packaged if name == NAME else name)
    if not made.setup.several:
        raise ValueError(f"policy {name}: expected one of many bodies, got one of {made.setup.body.name}")
    return made


class Universal:
    """A policy of many bodies, for one body in a task. It gives positions or torques, as the task takes them.

    Torques are those of motors that hold the positions with the body's own gains, as with `actions="position"`.

    Attributes:
        network: of many bodies.
        task: that it acts in.
        tokens: that the network sees, of one environment.
        descriptions: of the legs (1, 12, 41) and of the torso (1, 10).
        reach: (joints,) angles that an action of 1 asks for, rad.
        gains: stiffness (joints,), action per rad, and damping (joints,), action per rad/s, of position control.
    """

    def __init__(self, trained: Network, task: Task):
        """Describe the body of a task to a network of many bodies.

        Raises:
            ValueError: a body with more than 12 legs or 4 joints a leg, or a task that prescribes no gait or lacks
                a block that the network needs.
        """
        self.network, self.task = trained, task
        described, body = tokens.body_description(task), task.scene.body
        self.descriptions = described.legs[None], described.torso[None]
        self.reach = described.reach[described.mask]
        self.tokens = Tokens.of([task])
        self.gains = position_gains(size_body(body), measure_standing(body).inertias)
        self._positions = traced(self._traced, task.size)

    @property
    def graph(self) -> Graph:
        """What gives the actions (num_envs, joints) for observations (num_envs, size) of the task."""
        return self._positions if self.task.actions == "position" else traced(self._traced_torques, self.task.size)

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray | None = None) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Raises:
            ValueError: an observation of another body, or without a block of the task.
        """
        blocks = read_blocks(observation, self.task.sizes, len(self.reach), len(self.task.scene.body.part_names))
        vectors = np.concatenate(list(blocks.values()), axis=-1, dtype=np.float32)
        positions = self._positions(vectors).astype(float)
        if self.task.actions == "position":
            return positions
        _, angles, speeds = proprioception(read_blocks(observation, Clocked.reads, len(self.reach)))
        return torques(self.reach * positions, angles, speeds, *self.gains)

    def _traced(self, vectors: Any) -> Any:
        """Write the nodes of positions (1, joints) for a traced observation (1, size)."""
        seen = self.tokens.make_tokens(self.tokens.gather_inputs(vectors))
        flat: Any = tokens.flatten_tokens(seen, *self.descriptions)
        return self.tokens.body_actions(repeated(self.network.graph, flat))  # type: ignore[arg-type]

    def _traced_torques(self, vectors: Any) -> Any:
        """Write the nodes of torques (1, joints) for a traced observation (1, size)."""
        _, _, *proprioceived, _, _, _ = self.tokens.split_inputs(self.tokens.gather_inputs(vectors))
        angles, speeds = map(self.tokens.body_actions, proprioceived)
        return torques(self.reach * self._traced(vectors), angles, speeds, *self.gains)


def for_body(trained: Network, setup: Setup) -> Network:
    """Return a policy of many bodies as a policy of one body in a task.

    Raises:
        ValueError: as `Universal`.
    """
    made = Universal(trained, setup.definition)
    return Network(made.graph, setup, dict(made.task.sizes))
