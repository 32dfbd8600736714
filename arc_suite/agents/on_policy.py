"""Learns by proximal policy optimisation from the rows of a vector environment.

Every body that is its own mirror image learns from the mirror image of each step too, from which
rewards are the same (`arc_suite.symmetry`). Values of what an episode would have earned after its time
limit are learned as if it went on. Time limits of the rows fall on different steps.
"""

import math
from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from arc_suite import policies
from arc_suite.agents import networks, normaliser
from arc_suite.agents import proximal_policy as ppo
from arc_suite.agents.hyperparameters import ProximalPolicy
from arc_suite.agents.learner import Diverged, Stage, environment_arrays, generator, restore_environment
from arc_suite.agents.normaliser import Moments
from arc_suite.policies import network
from arc_suite.policies.network import Layer


def begin(row: ProximalPolicy, stage: Stage) -> "OnPolicy":
    """Return the learner; see `arc_suite.agents`.

    Raises:
        ValueError: a row that starts from a policy, and none is given, or one that does not fit; one line.
    """
    if row.warm_up and not row.start:
        raise ValueError("start: expected the folder of a run whose policy is where learning starts, got none")
    return OnPolicy(row, stage)


class OnPolicy:
    """A learner that acts in rows, and learns from what it did since its last updates."""

    def __init__(self, row: ProximalPolicy, stage: Stage):
        """Draw the networks, or read the policy to start from, and begin the first episodes.

        Raises:
            ValueError: a policy of another robot or task, or no network of two hidden layers; one line.
            OSError: no such file; one line.
        """
        self._row, self._stage = row, stage
        self._environment = stage.environment(row.rows)
        task = self._environment.task
        joints = self._environment.single_action_space.shape[0]
        self._symmetry = _symmetry(task) if row.mirrored else None
        self._moments, policy = Moments.none(task.size), None
        self._normaliser = self._moments.layer()
        if row.start and not stage.resumed:
            self._normaliser, policy = _read(row, stage, task)
        self._state = ppo.begin(row, generator(stage.seed, "networks", 0), task.size, joints, policy)
        self._iterations = 0
        self._observation, _ = self._environment.reset()
        if math.isfinite(task.step_limit):
            begun = np.arange(row.rows) * int(task.step_limit) // row.rows
            self._environment.restore(self._environment.snapshot() | {"steps": begun})

    @property
    def step(self) -> int:
        """Environment steps that are done with."""
        return self._iterations * self._row.rows * self._row.horizon

    def advance(self, limit: int) -> Mapping[str, float]:
        """Act for the horizon, and learn from it; see `Learner`."""
        row, stage = self._row, self._stage
        done = min(self.step / stage.steps, 1.0)
        std = row.first_std * (row.last_std / row.first_std) ** done
        wanted = row.first_divergence * (row.last_divergence / row.first_divergence) ** done
        warming_up = self._iterations * row.horizon < row.warm_up
        seen, earned = self._acted(std)
        batch = self._batch(seen)
        count = len(batch.returns)
        random = generator(stage.seed, "orders", self._iterations)
        orders = np.concatenate([random.permutation(count) for _ in range(row.epochs)])
        used = count // row.minibatch * row.minibatch
        orders = orders.reshape(row.epochs, count)[:, :used].reshape(-1, row.minibatch)
        numbers = (np.float32(std), np.float32(wanted))
        self._state, divergence, loss = ppo.update(row, self._state, batch, orders, numbers, not warming_up)
        self._iterations += 1
        if not row.start and done < row.normalising:
            self._normalise(seen["observations"])
        return {
            **earned,
            "std": std,
            "divergence": float(divergence),
            "policy_rate": float(self._state.rate),
            "value_loss": float(loss),
        }

    def policy(self) -> tuple[Layer, ...]:
        """Return the layers of the mean action."""
        return self._normaliser, *networks.exported(self._state.policy, ppo.ACTIVATION), Layer("clip")

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that it goes on from."""
        return {
            **networks.named("state", self._state),
            **networks.named("moments", self._moments),
            **normaliser.stored(self._normaliser),
            "iterations": np.array(self._iterations),
            **environment_arrays(self._environment),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned."""
        self._state = networks.restored("state", self._state, arrays)
        self._moments = Moments(*(arrays[f"moments/{name}"] for name in Moments._fields))
        self._normaliser = normaliser.restored(arrays)
        self._iterations = int(arrays["iterations"])
        self._observation = restore_environment(self._environment, arrays)

    def _acted(self, std: float) -> tuple[dict[str, np.ndarray], dict[str, float]]:
        """Act in all rows for the horizon; return what was seen, (horizon, rows, ...) by name, and figures."""
        row, environment = self._row, self._environment
        noise = generator(self._stage.seed, "noise", self._iterations)
        seen = {
            name: [] for name in ("observations", "actions", "means", "rewards", "terminated", "ended", "following")
        }
        for _ in range(row.horizon):
            observation = self._observation
            mean = np.asarray(ppo.mean_action(self._state.policy, self._normalised(observation)))
            if not np.isfinite(mean).all():
                raise Diverged(f"the learner diverged: an action is not finite at step {self.step}")
            action = mean + np.float32(std) * noise.standard_normal(mean.shape, np.float32)
            self._observation, rewards, terminated, truncated, info = environment.step(action)
            ended = terminated | truncated
            following = self._observation.copy()
            for place in np.flatnonzero(ended):
                following[place] = info["final_obs"][place]
            values = (observation, action, mean, rewards, terminated, ended, following)
            for array, value in zip(seen.values(), values, strict=True):
                array.append(value)
        seen = {name: np.stack(arrays) for name, arrays in seen.items()}
        return seen, {"reward": float(seen["rewards"].mean()), "falls": float(seen["terminated"].sum())}

    def _batch(self, seen: Mapping[str, np.ndarray]) -> ppo.Batch:
        """What updates learn from: advantages and returns beside it, and all of it in the mirror."""
        row, size = self._row, seen["observations"].shape[-1]
        observations = self._normalised(seen["observations"])
        values = np.asarray(ppo.value(self._state.values, observations))
        following = np.asarray(ppo.value(self._state.values, self._normalised(seen["following"])))
        rewards = (1.0 - row.discount) * seen["rewards"]
        advantages = ppo.advantages(row, rewards, values, following, seen["terminated"], seen["ended"])
        returns = (advantages + values).ravel()
        advantages = ((advantages - advantages.mean()) / (advantages.std() + 1e-8)).ravel()
        observations = observations.reshape(-1, size)
        actions, means = (seen[name].reshape(len(returns), -1) for name in ("actions", "means"))
        if self._symmetry is not None:
            mirror, mirror_action = self._symmetry
            image = self._normalised(mirror(seen["observations"]).reshape(-1, size))
            observations = np.concatenate([observations, image])
            # The image of an action is as probable as the action was. By the policy's own mean for the image, where
            # it is not symmetric, the action would be all but impossible, and what is learned of it huge.
            actions, means = (np.concatenate([each, mirror_action(each)]) for each in (actions, means))
            advantages, returns = np.tile(advantages, 2), np.tile(returns, 2)
        arrays = (observations, actions, means, advantages, returns)
        return ppo.Batch(*(jnp.asarray(array, jnp.float32) for array in arrays))

    def _normalised(self, observations: np.ndarray) -> np.ndarray:
        return network.forward([self._normaliser], observations)

    def _normalise(self, observations: np.ndarray) -> None:
        self._moments = self._moments.after(observations)
        if self._symmetry is not None:
            self._moments = self._moments.after(self._symmetry.observation(observations))
        self._normaliser = self._moments.layer()


def _symmetry(task):
    """The mirror maps of a task; None where there are none."""
    try:
        return task.symmetry
    except ValueError:
        return None


def _read(row: ProximalPolicy, stage: Stage, task) -> tuple[Layer, tuple]:
    """The normaliser and the network of the policy that learning starts from."""
    found = policies.policy(Path(row.start), stage.body, task=task)
    kinds = [layer.kind for layer in getattr(found, "layers", ())]
    if kinds != ["normalise", "linear", "elu", "linear", "elu", "linear", "clip"]:
        raise ValueError(f"{row.start}: expected a policy of imitation or ppo, with two hidden layers")
    for name in {**found.blocks, **task.blocks}:
        there, here = (blocks.get(name, 0) for blocks in (found.blocks, task.blocks))
        if there != here:
            other = f"a policy of {found.task} for other observations than those of {task.name}"
            raise ValueError(f"{row.start}: {other}: {name} has {there} numbers, and not {here}")
    linear = [layer.arrays for layer in found.layers if layer.kind == "linear"]
    if linear[0][0].shape[1] != row.hidden or linear[1][0].shape[1] != row.hidden:
        raise ValueError(f"{row.start}: expected {row.hidden} hidden units, got {linear[0][0].shape[1]}")
    return found.layers[0], tuple({"weight": weight, "bias": bias} for weight, bias in linear)
