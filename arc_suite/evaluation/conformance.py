"""Conformance of a task: a batch of environments computes bit for bit what each of them computes alone."""

import numpy as np

from arc_suite.envs import trees
from arc_suite.envs.setup import Setup
from arc_suite.tasks import Task, terms

STEPS = 200  # control steps
_ENVIRONMENTS = 64  # enough that functions which round scalars and arrays differently show it


def difference(setup: Setup, steps: int = STEPS) -> str | None:
    """Step a vector environment with random actions, and compute every step of every environment once more alone.

    Args:
        setup: any.
        steps: control steps, over as many episodes as they fill.

    Returns:
        The first difference: the step, and the names of the terms, metrics and blocks of the observation that
        differ. None where there is none.
    """
    environments = setup.make_vec(_ENVIRONMENTS, seed=0)
    task, random = environments.task.definition, np.random.RandomState(0)
    environments.reset()
    try:
        for step in range(1, steps + 1):
            actions = random.uniform(-1.0, 1.0, environments.action_space.shape)
            before, stepping = environments._memory, np.flatnonzero(~environments._ended).tolist()
            environments.step(actions)
            together = _told(task, environments._memory, task.read(environments.batch.data))
            for index in stepping:
                memory = trees.entry(before, index)
                readings = task.read(environments.batch.part(index))
                alone = _told(task, task.after(task.before(memory, actions[index])[0], readings), readings)
                different = [name for name in alone if not np.array_equal(alone[name], together[name][index])]
                if different:
                    return f"step {step}: {', '.join(different)}"
    finally:
        environments.close()
    return None


def _told(task: Task, memory, readings) -> dict[str, np.ndarray]:
    """Everything that a task tells of a step, by name."""
    blocks = {f"block {name}": block for name, block in task.observe(memory, readings).items()}
    metrics = {f"metric {name}": np.asarray(metric) for name, metric in task.progress(memory).items()}
    raw = task.terms(memory, readings)
    _, reward = terms.reward(raw, task.settings.weights, task.cost_limit)
    found = {f"term {name}": np.asarray(term) for name, term in raw.items()}
    resampled = np.broadcast_to(task.resampled(memory), np.shape(reward))
    return found | metrics | blocks | {"resampled": resampled, "reward": reward}
