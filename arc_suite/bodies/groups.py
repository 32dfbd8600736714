"""Batches of environments of different bodies: which environments share one, and how infos of batches are joined."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite.bodies import padding
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
        self._padding = padding.privileged_padding(members[0].task)  # the same for all members, as their layouts are
        super().__init__(None, task_name, len(members), **options)

    def _privileged_vectors(self) -> np.ndarray:
        return padding.spread(self._padding, super()._privileged_vectors())

    def _prepare_tasks(self):
        tasks = [member.task for member in self._members]
        models = [member.model for member in self._members]
        have_one_body = all(task is tasks[0] for task in tasks)
        return tasks, models[0] if have_one_body else models


class Place(NamedTuple):
    """A group, with the indices of its environments among all, and the tokens of these."""

    group: Group
    indices: np.ndarray
    tokens: Tokens


def group_by_batch(members: Sequence[Member]) -> list[list[int]]:
    """Return the indices of environments that share a batch, for each batch."""
    groups: dict[Any, list[int]] = {}
    keys: dict[int, Any] = {}  # of batches, by id of the task
    for index, (task, model) in enumerate(members):
        if id(task) not in keys:
            kind = stacked.kind(task)
            # A task that cannot be stacked shares a batch with nothing except itself.
            keys[id(task)] = id(task) if kind is None else (kind, layout(model))
        groups.setdefault(keys[id(task)], []).append(index)
    return list(groups.values())


def scatter(info: dict, group_info: Mapping[str, Any], indices: np.ndarray, count: int) -> None:
    """Put the info of a group of environments into that of all.

    Args:
        info: info of all environments, which is changed.
        group_info: info of the group.
        indices: indices of the group's environments among all.
        count: number of all environments.
    """
    for name, value in group_info.items():
        if isinstance(value, dict):
            scatter(info.setdefault(name, {}), value, indices, count)
            continue
        if name not in info:
            if value.dtype == object:
                info[name] = np.full(count, None, object)
            else:
                info[name] = np.zeros((count, *value.shape[1:]), value.dtype)
        info[name][indices] = value
