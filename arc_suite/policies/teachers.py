"""Teachers: the demonstrators of a batch of environments, which label what its environments observe."""

from collections.abc import Mapping

import numpy as np

from arc_suite.cpg import suited_preset
from arc_suite.envs.flat_bodies import FlatBodies
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies.named import policy


class Teacher:
    """A demonstrator for each body of some environments, fitted to its task."""

    def __init__(self, environment: VectorEnv | FlatBodies, preset: str = ""):
        """Fit the demonstrators.

        Args:
            environment: of one body or of several.
            preset: of the demonstrators; "" for the one that suits each body and the task.

        Raises:
            ValueError: a body has no such preset.
        """
        self._bodies = environment.unwrapped if isinstance(environment, FlatBodies) else None
        tasks = [environment.task.definition] * environment.num_envs if self._bodies is None else self._bodies.tasks
        self._size, self._mask = environment.single_action_space.shape[0], None
        if self._bodies is not None:
            self._mask = self._bodies.description.mask.reshape(len(tasks), -1)
        indices: dict[int, list[int]] = {}
        for index, task in enumerate(tasks):
            indices.setdefault(id(task), []).append(index)
        self._members = []
        for places in indices.values():
            task = tasks[places[0]]
            name = preset or suited_preset(task)
            demonstrator = policy("cpg", task.scene.body, name, len(places), task=task)
            self._members.append((task, np.array(places), demonstrator))

    def labels(self, observations: np.ndarray, ages: np.ndarray) -> np.ndarray:
        """Return the demonstrators' actions (num_envs, joints) for the latest observations of the environments.

        Args:
            observations: (num_envs, size)
            ages: (num_envs,) control steps since the start of the episode; an episode of the demonstrator begins
                at 0.
        """
        own = observations if self._bodies is None else self._bodies.own_observations()
        labels = np.zeros((len(observations), self._size))
        for task, places, demonstrator in self._members:
            starts = np.flatnonzero(ages[places] == 0).tolist()
            demonstrator.reset(starts, [0] * len(starts))  # demonstrators are the same in all episodes
            blocks = task.split(np.stack([own[place] for place in places]))
            actions = demonstrator.act(blocks, np.zeros(len(places)))
            if self._mask is None:
                labels[places] = actions
            else:
                labels[places[:, None], np.flatnonzero(self._mask[places[0]])] = actions
        return labels

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return what the demonstrators remember, arrays by name."""
        found = enumerate(demonstrator.snapshot() for _, _, demonstrator in self._members)
        return {f"teacher/{number}/{name}": array for number, arrays in found for name, array in arrays.items()}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from a snapshot.

        Raises:
            KeyError: an array is missing.
        """
        for number, (_, _, demonstrator) in enumerate(self._members):
            prefix = f"teacher/{number}/"
            own = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
            demonstrator.restore(own)
