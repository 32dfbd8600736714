"""Teachers: the demonstrators of a batch of environments, one fitted to each body."""

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from arc_suite.bodies import BodiesEnv
from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies.named import policy
from arc_suite.policies.protocol import Positioned
from arc_suite.tasks import Task

PREFIX = "teacher/"  # of the names in a snapshot


class Teacher:
    """A policy: a demonstrator for each body of some environments, fitted to its task.

    Different bodies have no common observation, so that it reads those of the bodies from their environments.
    """

    def __init__(self, environment: VectorEnv | BodiesEnv, preset: str = ""):
        """Fit the demonstrators.

        Args:
            environment: of one body or of several.
            preset: of the demonstrators; "" for the one that suits each body and the task.

        Raises:
            ValueError: a body has no such preset.
        """
        self._bodies: BodiesEnv | None = None
        tasks: Sequence[Task]
        if isinstance(environment, BodiesEnv):
            self._bodies, tasks = environment, environment.tasks
        else:
            tasks = [environment.task.definition] * environment.num_envs
        self._mask = None if self._bodies is None else self._bodies.description.mask.reshape(len(tasks), -1)
        indices: dict[int, list[int]] = {}
        for index, task in enumerate(tasks):
            indices.setdefault(id(task), []).append(index)
        self._members = []
        for places in indices.values():
            task = tasks[places[0]]
            name = preset or suited_preset(task)
            demonstrator = policy("cpg", task.scene.body, name, len(places), task=task)
            remembering = cast(Demonstrator | Positioned, demonstrator)  # never several, as the preset is one
            self._members.append((task, np.array(places), remembering))

    def reset(self, indices: Sequence[int], seeds: Sequence[int] = ()) -> None:
        """Start episodes in some environments; demonstrators are the same in all episodes."""
        for _, places, demonstrator in self._members:
            starts = np.flatnonzero(np.isin(places, indices)).tolist()
            demonstrator.reset(starts, [0] * len(starts))

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the demonstrators' actions (num_envs, joints) of a control step; see `Policy.act`."""
        if self._bodies is None:
            (_, _, demonstrator), *_ = self._members
            return demonstrator.act(observation, rewards)
        own, actions = self._bodies.own_observations(), np.zeros((len(rewards), self._mask.shape[1]))
        for task, places, demonstrator in self._members:
            blocks = task.split(np.stack([own[place] for place in places]))
            joints = np.flatnonzero(self._mask[places[0]])
            actions[places[:, None], joints] = demonstrator.act(blocks, rewards[places])
        return actions

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return what the demonstrators remember, arrays by name."""
        found = enumerate(demonstrator.snapshot() for _, _, demonstrator in self._members)
        return {f"{PREFIX}{number}/{name}": array for number, arrays in found for name, array in arrays.items()}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from a snapshot.

        Raises:
            KeyError: an array is missing.
        """
        for number, (_, _, demonstrator) in enumerate(self._members):
            prefix = f"{PREFIX}{number}/"
            own = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
            demonstrator.restore(own)
