"""Teachers: the demonstrators of a batch of environments, one fitted to each body."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from arc_suite.bodies import BodiesEnv
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import memoryless_preset
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies.named import policy
from arc_suite.tasks import Task

PREFIX = "teacher/"  # prefix of the names in a snapshot


class _Group(NamedTuple):
    """Environments of one task, and their demonstrator.

    Attributes:
        task: task.
        indices: (group,) indices of the environments.
        demonstrator: policy of these environments.
    """

    task: Task
    indices: np.ndarray
    demonstrator: Demonstrator


class Teacher:
    """A policy of a batch of environments: each body has its own demonstrator, fitted to its task.

    Different bodies have no common observation. With several bodies the teacher reads the observations of the bodies
    from the environment.
    """

    def __init__(self, environment: VectorEnv | BodiesEnv, preset: str = ""):
        """Fit the demonstrators.

        Args:
            environment: environments of one body or of several.
            preset: preset of the demonstrators; "" for the one that suits each body and the task, without an
                integral, see `memoryless_preset`.

        Raises:
            ValueError: a body has no such preset.
        """
        tasks: Sequence[Task]
        self._bodies: BodiesEnv | None  # None for one body
        if isinstance(environment, BodiesEnv):
            self._bodies = environment
            tasks = environment.tasks
            self._has_joint = environment.description.mask.reshape(len(tasks), -1)  # (num_envs, joints)
        else:
            self._bodies = None
            tasks = [environment.task.definition] * environment.num_envs
        indices_by_task: dict[int, list[int]] = {}
        for index, task in enumerate(tasks):
            indices_by_task.setdefault(id(task), []).append(index)
        self._groups = []
        for indices in indices_by_task.values():
            task = tasks[indices[0]]
            name = preset or memoryless_preset(task)
            demonstrator = policy("cpg", task.scene.body, name, len(indices), task=task)
            # One preset gives one demonstrator, which has snapshots.
            group = _Group(task, np.array(indices), cast(Demonstrator, demonstrator))
            self._groups.append(group)

    def reset(self, indices: Sequence[int], seeds: Sequence[int] = ()) -> None:
        """Start episodes in some environments; demonstrators are the same in all episodes."""
        for group in self._groups:
            starts = np.flatnonzero(np.isin(group.indices, indices)).tolist()
            group.demonstrator.reset(starts, [0] * len(starts))

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the demonstrators' actions (num_envs, joints) of a control step; see `Policy.act`."""
        if self._bodies is None:
            return self._groups[0].demonstrator.act(observation, rewards)
        observations = self._bodies.own_observations()  # of each environment, in the layout of its body
        actions = np.zeros((len(rewards), self._has_joint.shape[1]))
        for task, indices, demonstrator in self._groups:
            blocks = task.split(np.stack([observations[index] for index in indices]))
            joints = np.flatnonzero(self._has_joint[indices[0]])
            actions[indices[:, None], joints] = demonstrator.act(blocks, rewards[indices])
        return actions

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the memory of the demonstrators, arrays by name."""
        arrays = {}
        for number, group in enumerate(self._groups):
            for name, array in group.demonstrator.snapshot().items():
                arrays[f"{PREFIX}{number}/{name}"] = array
        return arrays

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue from a snapshot.

        Raises:
            KeyError: an array is missing.
        """
        for number, group in enumerate(self._groups):
            prefix = f"{PREFIX}{number}/"
            memory = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
            group.demonstrator.restore(memory)
