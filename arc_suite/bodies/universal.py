"""Policies of any body: a network that was trained with many bodies, acting for one of them."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite.bodies import tokens
from arc_suite.bodies.descriptions import body_description
from arc_suite.bodies.tokens import Tokens
from arc_suite.cpg.law import Clocked, proprioception, read_blocks, torques
from arc_suite.envs.setup import Setup
from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import measure_standing
from arc_suite.policies import network
from arc_suite.policies.graph import Graph
from arc_suite.policies.network import PACKAGED, Network
from arc_suite.policies.tracing import apply_graph, traced
from arc_suite.tasks import Task

NAME = "universal"  # of the policies in the package


def load(name: str | os.PathLike[str], task: Task | None = None) -> Network:
    """Return a policy of many bodies: `universal`, which comes with the package, a policy file, or that of a run.

    Args:
        name: name of the policy.
        task: task in which `universal` acts: it follows a command where the task has one. None for walk.

    Raises:
        ValueError: a damaged file, a policy of one body, or one of other observations.
        OSError: the file cannot be read.
    """
    if name == NAME:
        follows_command = task is not None and "command" in task.blocks
        training_task = "steer" if follows_command else "walk"
        policy = network.load(PACKAGED / f"{NAME}-{training_task}{network.EXTENSION}")
    else:
        policy = network.load(name)
    if not policy.setup.several:
        raise ValueError(f"policy {name}: expected one of many bodies, got one of {policy.setup.body.name}")
    _check_inputs(policy)
    return policy


def _check_inputs(trained: Network) -> None:
    """Raise ValueError for a policy whose observations are those of another version."""
    size = sum(tokens.FLAT_SIZES.values())
    if trained.size != size:
        raise ValueError(f"policy of {trained.setup}: expected {size} observations, got {trained.size}; train it again")


class Universal:
    """A policy of many bodies, for one body in a task. It gives positions or torques, as the task takes them.

    Torques are those of motors that hold the positions with the body's own gains, as with `actions="position"`.

    Attributes:
        network: network of many bodies.
        task: task that it acts in.
        tokens: tokens that the network sees, of one environment.
        descriptions: descriptions of the legs (1, 12, 41) and of the torso (1, 10).
        reach: (joints,) angles that an action of 1 asks for, rad.
        gains: stiffness (joints,), action per rad, and damping (joints,), action per rad/s, of position control.
    """

    def __init__(self, trained: Network, task: Task):
        """Describe the body of a task to a network of many bodies.

        Raises:
            ValueError: a body with more than 12 legs or 4 joints a leg, a task that prescribes no gait or lacks a block
                that the network needs, or a network of other observations.
        """
        _check_inputs(trained)
        body = task.scene.body
        description = body_description(task)
        self.network = trained
        self.task = task
        self.descriptions = (description.legs[None], description.torso[None])
        self.reach = description.reach[description.mask]
        self.tokens = Tokens.of([task])
        self.gains = position_gains(size_body(body), measure_standing(body).inertias)
        self._positions = traced(self._trace_positions, task.size)

    @property
    def graph(self) -> Graph:
        """The graph of actions (num_envs, joints) for observations (num_envs, size) of the task."""
        self.network.note_use()
        if self.task.actions == "position":
            return self._positions
        return traced(self._trace_torques, self.task.size)

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray | None = None) -> np.ndarray:
        """Return the actions (num_envs, joints) of a control step; see `Policy.act`.

        Raises:
            ValueError: an observation of another body, or without a block of the task; or a run learns that declares no
                policy as its source.
        """
        self.network.note_use()
        joint_count = len(self.reach)
        part_count = len(self.task.scene.body.part_names)
        blocks = read_blocks(observation, self.task.sizes, joint_count, part_count)
        vectors = np.concatenate(list(blocks.values()), axis=-1, dtype=np.float32)
        positions = self._positions(vectors).astype(float)
        if self.task.actions == "position":
            return positions
        _, angles, velocities = proprioception(read_blocks(observation, Clocked.reads, joint_count))
        stiffness, damping = self.gains
        return torques(self.reach * positions, angles, velocities, stiffness, damping)

    def _trace_positions(self, vectors: Any) -> Any:
        """Write the nodes of positions (1, joints) for a traced observation (1, size)."""
        leg_descriptions, torso_description = self.descriptions
        token_blocks = self.tokens.make_tokens(self.tokens.gather_inputs(vectors))
        flat: Any = tokens.flatten_tokens(token_blocks, leg_descriptions, torso_description)
        return self.tokens.body_actions(apply_graph(self.network.graph, flat))  # type: ignore[arg-type]

    def _trace_torques(self, vectors: Any) -> Any:
        """Write the nodes of torques (1, joints) for a traced observation (1, size)."""
        inputs = self.tokens.split_inputs(self.tokens.gather_inputs(vectors))
        angles = self.tokens.body_actions(inputs.joint_angles)
        velocities = self.tokens.body_actions(inputs.joint_velocities)
        stiffness, damping = self.gains
        return torques(self.reach * self._trace_positions(vectors), angles, velocities, stiffness, damping)


def for_body(trained: Network, setup: Setup) -> Network:
    """Return a policy of many bodies as a policy of one body in a task.

    Raises:
        ValueError: as `Universal`.
    """
    policy = Universal(trained, setup.definition)
    return type(trained)(policy.graph, setup, dict(policy.task.sizes))  # a stored network remains one
