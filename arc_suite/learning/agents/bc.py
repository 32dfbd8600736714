"""Behavior cloning of a dataset: the simplest baseline of offline learning.

No environment step is made: the steps of a run are updates of the network. They reduce the squared distance from the
dataset's actions.
"""

import contextlib
from collections.abc import Iterator

import numpy as np

from arc_suite.learning.agents import architectures, dagger, networks, priors
from arc_suite.learning.agents.architectures import Perceptron
from arc_suite.learning.agents.hyperparameters import BehaviorCloning
from arc_suite.learning.agents.learner import RunContext, Slice, generator, restoring
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.replay import Replay

UPDATES_PER_SLICE = 500

_TRANSITIONS_PER_READ = 4096


def learn(hp: BehaviorCloning, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: no dataset, or one that does not fit.
    """
    priors.check_prior(context.prior, True)
    with contextlib.closing(context.environment()) as environment:
        task = environment.task.definition
    replay = priors.open_replay(context, task)
    normalize = _observation_moments(replay, task.size).normalizer()
    architecture = Perceptron.of(task)
    state = dagger.begin(architecture.draw_policy(generator(context.seed, "networks", 0), hp.hidden))
    step = 0  # updates so far

    saved = context.checkpoint
    if saved is not None:
        with restoring():
            state = networks.restore_tree("state", state, saved)
            step = int(saved["step"])

    while True:
        slice_end = min(context.next_evaluation(step), (step // UPDATES_PER_SLICE + 1) * UPDATES_PER_SLICE)
        errors = []  # of each call of `dagger.fit`
        while step < slice_end:
            updates = min(dagger.UPDATES_PER_CALL, slice_end - step)
            random = generator(context.seed, "update", step)
            batch = replay.transitions_at(random.integers(len(replay), size=updates * hp.batch))
            progress = (step + np.arange(updates)) / context.steps
            rates = hp.learning_rate * (1.0 - progress)
            state, error = dagger.fit(
                architecture,
                state,
                observations=normalize(batch.observations),
                labels=batch.actions,
                batches=np.arange(updates * hp.batch).reshape(updates, hp.batch),
                rates=rates.astype(np.float32),
            )
            errors.append(float(error))
            step += updates
            context.count_steps(updates)
        checkpoint = {**networks.flatten_tree("state", state), "step": np.array(step)}
        graph = architectures.policy_graph(architecture, normalize, state.layers)
        yield Slice({"error": float(np.mean(errors))}, graph, checkpoint)


def _observation_moments(replay: Replay, size: int) -> Moments:
    """Return the moments of all observations (size,) of a dataset."""
    moments = Moments.empty(size)
    for first in range(0, len(replay), _TRANSITIONS_PER_READ):
        indices = np.arange(first, min(first + _TRANSITIONS_PER_READ, len(replay)))
        moments = moments.with_vectors(replay.transitions_at(indices).observations)
    return moments
