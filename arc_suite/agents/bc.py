"""Learns to act as a dataset does: behaviour cloning, the simplest baseline of offline learning.

No environment step is made: the steps of a run are updates of the network, towards the least squared distance
from the dataset's actions.
"""

import contextlib
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.agents import dagger, networks, priors
from arc_suite.agents.hyperparameters import Cloning
from arc_suite.agents.learner import Stage, generator
from arc_suite.agents.normaliser import Moments
from arc_suite.policies.network import Layer, forward

SLICE = 500  # updates

_ROWS = 4096  # observations that are normalised at a time


def begin(row: Cloning, stage: Stage) -> "Cloner":
    """Return the learner; see `arc_suite.agents`.

    Raises:
        ValueError: no dataset, or one that does not fit; one line.
    """
    if stage.prior is None:
        raise ValueError("prior: the algorithm takes prior data, the id of a dataset, got None")
    return Cloner(row, stage)


class Cloner:
    """A learner from a dataset alone."""

    def __init__(self, row: Cloning, stage: Stage):
        """Draw the network and measure the dataset's observations.

        Raises:
            ValueError: a dataset that does not fit; one line.
        """
        self._row, self._stage, self.step = row, stage, 0
        with contextlib.closing(stage.environment()) as environment:
            task = environment.task
        self._data = priors.mapped(stage, task)
        sizes = (task.size, row.hidden, row.hidden, len(stage.body.joint_names))
        layers = networks.mlp(generator(stage.seed, "networks", 0), sizes, "orthogonal", gain=2**0.5)
        self._state = jax.tree.map(jnp.asarray, dagger.State(layers, optax.scale_by_adam().init(layers)))
        moments = Moments.none(task.size)
        for first in range(0, len(self._data), _ROWS):
            indices = np.arange(first, min(first + _ROWS, len(self._data)))
            moments = moments.after(self._data.at(indices).observations)
        self._normaliser = moments.layer()

    def advance(self, limit: int) -> Mapping[str, float]:
        """Make updates, with a rate that falls to 0 at the end of the run; see `Learner`."""
        row, errors = self._row, []
        until = min(limit, (self.step // SLICE + 1) * SLICE)
        while self.step < until:
            updates = min(dagger.CHUNK, until - self.step)
            random = generator(self._stage.seed, "update", self.step)
            batch = self._data.at(random.integers(len(self._data), size=updates * row.batch))
            rates = row.learning_rate * (1.0 - (self.step + np.arange(updates)) / self._stage.steps)
            self._state, error = dagger.fit(
                self._state,
                forward([self._normaliser], batch.observations),
                batch.actions,
                np.arange(updates * row.batch).reshape(updates, row.batch),
                rates.astype(np.float32),
            )
            errors.append(float(error))
            self.step += updates
        return {"error": float(np.mean(errors))}

    def policy(self) -> tuple[Layer, ...]:
        """Return the layers of the network."""
        return self._normaliser, *networks.exported(self._state.layers, dagger.ACTIVATION), Layer("clip")

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that it goes on from, beside the dataset."""
        return {**networks.named("state", self._state), "step": np.array(self.step)}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned."""
        self._state, self.step = networks.restored("state", self._state, arrays), int(arrays["step"])
