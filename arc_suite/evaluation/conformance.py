"""Conformance of a task: a batch of environments computes bit for bit what each of them computes alone."""

import numpy as np

from arc_suite.envs import trees
from arc_suite.envs.setup import Setup
from arc_suite.tasks import Task, terms

STEPS = 200  # control steps
_NUM_ENVS = 64  # with fewer environments, functions may round scalars and arrays in the same way


def difference(setup: Setup, steps: int = STEPS) -> str | None:
    """Step a vector environment with random actions, and compute every step of every environment again alone.

    Args:
        setup: any.
        steps: control steps, over one or several episodes.

    Returns:
        The first difference: the step, and the names of the terms, metrics and blocks of the observation that
        differ. None if there is no difference.
    """
    environments = setup.make_vec(_NUM_ENVS, seed=0)
    task = environments.task.definition
    random = np.random.RandomState(0)
    environments.reset()
    try:
        for step in range(1, steps + 1):
            actions = random.uniform(-1.0, 1.0, environments.action_space.shape)
            memory_before = environments._memory
            indices = np.flatnonzero(~environments._ended).tolist()  # a step resets the others
            environments.step(actions)
            in_batch = _results(task, environments._memory, task.read(environments.batch.data))
            for index in indices:
                memory, _ = task.before(trees.entry(memory_before, index), actions[index])
                readings = task.read(environments.batch.part(index))
                alone = _results(task, task.after(memory, readings), readings)
                names = [name for name in alone if not np.array_equal(alone[name], in_batch[name][index])]
                if names:
                    return f"step {step}: {', '.join(names)}"
    finally:
        environments.close()
    return None


def _results(task: Task, memory, readings) -> dict[str, np.ndarray]:
    """Return all results of a task after a step, by name."""
    blocks = {f"block {name}": block for name, block in task.observe(memory, readings).items()}
    metrics = {f"metric {name}": np.asarray(metric) for name, metric in task.progress(memory).items()}
    raw = task.terms(memory, readings)
    _, reward = terms.reward(raw, task.settings.weights, task.cost_limit)
    raw_terms = {f"term {name}": np.asarray(term) for name, term in raw.items()}
    resampled = np.broadcast_to(task.resampled(memory), np.shape(reward))
    return raw_terms | metrics | blocks | {"resampled": resampled, "reward": reward}
