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

SLICE = 500  # updates

_CHUNK = 4096  # observations that are normalized at a time


def learn(hp: BehaviorCloning, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: no dataset, or one that does not fit.
    """
    priors.check(context.prior, True)
    with contextlib.closing(context.environment()) as environment:
        task = environment.task.definition
    data = priors.mapped(context, task)
    moments = Moments.none(task.size)
    for first in range(0, len(data), _CHUNK):
        moments = moments.after(data.at(np.arange(first, min(first + _CHUNK, len(data)))).observations)
    normalize = moments.normalizer()
    architecture = Perceptron.of(task)
    state = dagger.begin(architecture.drawn(generator(context.seed, "networks", 0), hp.hidden))
    step = 0

    if (saved := context.checkpoint) is not None:
        with restoring():
            state, step = networks.restored("state", state, saved), int(saved["step"])

    while True:
        errors, end = [], min(context.next_evaluation(step), (step // SLICE + 1) * SLICE)
        while step < end:
            updates = min(dagger.CHUNK, end - step)
            random = generator(context.seed, "update", step)
            batch = data.at(random.integers(len(data), size=updates * hp.batch))
            rates = hp.learning_rate * (1.0 - (step + np.arange(updates)) / context.steps)
            known, orders = (normalize(batch.observations), batch.actions), np.arange(updates * hp.batch)
            orders = orders.reshape(updates, hp.batch)
            state, error = dagger.fit(architecture, state, *known, orders, rates.astype(np.float32))
            errors.append(float(error))
            step += updates
        checkpoint = {**networks.named("state", state), "step": np.array(step)}
        graph = architectures.policy(architecture, normalize, state.layers)
        yield Slice(step, {"error": float(np.mean(errors))}, graph, checkpoint)
