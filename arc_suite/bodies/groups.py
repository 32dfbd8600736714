"""Batches of environments of different bodies: which share one, and what they return of their environments."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite.bodies import tokens
from arc_suite.bodies.tokens import Tokens
from arc_suite.envs import stacked
from arc_suite.envs.vector import VectorEnv
from arc_suite.simulation.batch import layout
from arc_suite.tasks import Task


class Member(NamedTuple):
    """The task of an environment, and the model of its simulation."""

    task: Task
    model: mujoco.MjModel


class Group(VectorEnv):
    """Environments in one batch: of one body, or of bodies whose models have one layout and whose tasks can be stacked.

    Each is bit-equal to an environment of its body in a `VectorEnv`.
    """

    def __init__(self, members: Sequence[Member], task_name: str, **options):
        """Allocate an environment for each member; for the options see `VectorEnv`."""
        self._members = members
        self._padding = tokens.privileged_padding(members[0].task)  # the same for all, whose layout is one
        super().__init__(None, task_name, len(members), **options)

    def _privileged_vectors(self) -> np.ndarray:
        return tokens.spread(self._padding, super()._privileged_vectors())

    def _prepare_tasks(self):
        tasks, models = zip(*self._members, strict=True)
        return list(tasks), models[0] if all(task is tasks[0] for task in tasks) else list(models)


class Place(NamedTuple):
    """A group, with the indices of its environments among all, and the tokens of these."""

    group: Group
    indices: np.ndarray
    tokens: Tokens


def group_by_batch(members: Sequence[Member]) -> list[list[int]]:
    """Indices of environments that share a batch."""
    groups: dict[Any, list[int]] = {}
    keys: dict[int, Any] = {}
    for index, (task, model) in enumerate(members):
        if id(task) not in keys:
            kind = stacked.kind(task)
            keys[id(task)] = id(task) if kind is None else (kind, layout(model))
        groups.setdefault(keys[id(task)], []).append(index)
    return list(groups.values())


def scatter(info: dict, own: Mapping[str, Any], indices: np.ndarray, count: int) -> None:
    """Put the info of some environments into that of all."""
    for name, value in own.items():
        if isinstance(value, dict):
            scatter(info.setdefault(name, {}), value, indices, count)
            continue
        if name not in info:
            shape = (count, *value.shape[1:])
            info[name] = np.full(count, None, object) if value.dtype == object else np.zeros(shape, value.dtype)
        info[name][indices] = value
