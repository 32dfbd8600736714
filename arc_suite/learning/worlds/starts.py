"""Tables of starts: the episodes of the first seeds of a task, drawn on the host for batches on a GPU."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees
from arc_suite.envs.vector import VectorEnv

MAX_STARTS = 16_384
_SEEDS_PER_BATCH = 256  # seeds that are drawn together; more would take much memory, as each may have its own model

# Fields of `MjModel` that `mj_setConst` derives from those that an episode changes, and that simulations read.
_DERIVED_FIELDS = ("body_subtreemass", "body_invweight0", "dof_invweight0")


class Starts(NamedTuple):
    """How the episodes of consecutive seeds start; a leading axis for the seeds.

    Attributes:
        qpos: (seeds, nq) positions.
        qvel: (seeds, nv) velocities.
        mocap_pos: (seeds, nmocap, 3) m, of obstacles.
        memory: memory of the task, from which the first step starts.
        observation: (seeds, size) float32.
        model: fields of the model that differ from seed to seed, by name.
        privileged: (seeds, size) float32, the privileged observation; None where it is not asked for.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    mocap_pos: np.ndarray
    memory: Any
    observation: np.ndarray
    model: dict[str, np.ndarray]
    privileged: np.ndarray | None


def draw_starts(
    domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None, count: int, seed: int, privileged: bool
) -> Starts:
    """Draw the starts of consecutive seeds.

    Args:
        domain_name: as in `arc_suite.load`.
        task_name: as in `arc_suite.load`.
        task_kwargs: as in `arc_suite.load`.
        count: number of seeds.
        seed: the first seed.
        privileged: whether starts have the privileged observation.

    Raises:
        ValueError: as `arc_suite.load`, or a count out of range.
    """
    checks.integer("num_starts", count, 1, MAX_STARTS)
    num_envs = min(count, _SEEDS_PER_BATCH)
    environments = VectorEnv(domain_name, task_name, num_envs, task_kwargs=task_kwargs, privileged=privileged)
    batch = environments.batch
    parts = []
    for first in range(0, count, _SEEDS_PER_BATCH):
        observation, info = environments.reset(seed=seed + first)
        changed_fields = [*batch.changed, *_DERIVED_FIELDS] if batch.changed else []
        part = Starts(
            qpos=batch.data.qpos.copy(),
            qvel=batch.data.qvel.copy(),
            mocap_pos=batch.mocap_pos.copy(),
            memory=environments._memory,
            observation=observation,
            model={name: np.stack([getattr(model, name) for model in batch.models]) for name in changed_fields},
            privileged=info.get("privileged"),
        )
        parts.append(part)
    environments.close()

    def concatenate(*arrays):
        return np.concatenate(arrays)[:count]  # the last batch may have more seeds

    model = {name: concatenate(*(part.model[name] for part in parts)) for name in parts[0].model}
    table = trees.map_leaves(concatenate, *(part._replace(model=None) for part in parts))
    return table._replace(model=model)
