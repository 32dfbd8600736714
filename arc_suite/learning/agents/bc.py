"""Behavior cloning of a dataset: the simplest baseline of offline learning.

No environment step is made: the steps of a run are updates of the network, towards the least squared distance from
the dataset's actions.
"""

import contextlib
from collections.abc import Iterator

import numpy as np

from arc_suite.learning.agents import architectures, dagger, networks, priors
from arc_suite.learning.agents.architectures import Perceptron
from arc_suite.learning.agents.hyperparameters import BehaviorCloning
from arc_suite.learning.agents.learner import RunContext, Slice, generator, restoring
from arc_suite.learning.agents.normalizer import Moments

UPDATES_PER_SLICE = 500  # updates

_CHUNK = 4096  # observations that are normalized at a time


def learn(hp: BehaviorCloning, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: no dataset, or one that does not fit.
    """
    priors.check_prior_is_named(context.prior, True)
    with contextlib.closing(context.environment()) as environment:
        task = environment.task.definition
    data = priors.open_replay(context, task)
    moments = Moments.empty(task.size)
    for first in range(0, len(data), _CHUNK):
        moments = moments.with_vectors(
            data.transitions_at(np.arange(first, min(first + _CHUNK, len(data)))).observations
        )
    normalize = moments.normalizer()
    architecture = Perceptron.of(task)
    state = dagger.begin(architecture.drawn(generator(context.seed, "networks", 0), hp.hidden))
    step = 0

    if (saved := context.checkpoint) is not None:
        with restoring():
            state, step = networks.restore_tree("state", state, saved), int(saved["step"])

    while True:
        errors, end = [], min(context.next_evaluation(step), (step // UPDATES_PER_SLICE + 1) * UPDATES_PER_SLICE)
        while step < end:
            updates = min(dagger.UPDATES_PER_CALL, end - step)
            random = generator(context.seed, "update", step)
            batch = data.transitions_at(random.integers(len(data), size=updates * hp.batch))
            rates = hp.learning_rate * (1.0 - (step + np.arange(updates)) / context.steps)
            known, orders = (normalize(batch.observations), batch.actions), np.arange(updates * hp.batch)
            orders = orders.reshape(updates, hp.batch)
            state, error = dagger.fit(architecture, state, *known, orders, rates.astype(np.float32))
            errors.append(float(error))
            step += updates
        checkpoint = {**networks.flatten_tree("state", state), "step": np.array(step)}
        graph = architectures.policy_graph(architecture, normalize, state.layers)
        yield Slice(step, {"error": float(np.mean(errors))}, graph, checkpoint)
