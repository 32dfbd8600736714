"""Proximal policy optimization in a vector environment; `device_learner` is that in worlds on a GPU.

With symmetry augmentation each transition of a symmetric body yields a second, mirrored one (`arc_suite.symmetry`),
unless the network treats left and right alike.

At a time limit, the value of the last observation stands for the rewards that would have followed. Environments start
at different ages, so their time limits fall on different steps. Where a step begins another command, the value of the
observation before it stands for what follows (`VectorEnv.resampled`).
"""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite import policies
from arc_suite.bodies import universal
from arc_suite.learning.agents import architectures, collecting, critic_blocks, learner, networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.architectures import Architecture
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import RunContext, Slice, generator
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.policies.graph import Graph
from arc_suite.policies.network import Network
from arc_suite.tasks import Task
from arc_suite.tasks.mirrors import Symmetry

_TINY_STD = 1e-8  # added to the standard deviation of advantages, which may be 0


class Schedules(NamedTuple):
    """What depends on how much of the schedule is done.

    Attributes:
        std: standard deviation of actions.
        desired_kl: desired Kullback-Leibler divergence of an iteration's policy from the last.
        learns_policy: whether the policy learns; before, only values are learned.
        updates_normalizer: whether the normalizer of observations is updated.
    """

    std: float
    desired_kl: float
    learns_policy: bool
    updates_normalizer: bool

    @classmethod
    def of(cls, hp: ProximalPolicy, steps: int, iterations: int) -> Self:
        """Return the schedules of an iteration.

        Args:
            hp: hyperparameters.
            steps: environment steps of the whole run.
            iterations: number of iterations before it.
        """
        progress = min(iterations * hp.num_envs * hp.horizon / max(steps, hp.schedule_steps), 1.0)
        return cls(
            std=hp.initial_std * (hp.final_std / hp.initial_std) ** progress,
            desired_kl=hp.initial_desired_kl * (hp.final_desired_kl / hp.initial_desired_kl) ** progress,
            learns_policy=iterations * hp.horizon >= hp.value_warm_up,
            updates_normalizer=not hp.start and progress < hp.normalize_until,
        )


class LearnerState(NamedTuple):
    """What an iteration changes, except the environments.

    Attributes:
        state: networks and their optimizers.
        moments: moments of observations.
        normalize: normalizer of observations.
    """

    state: ppo.PpoState
    moments: Moments
    normalize: Normalizer

    def arrays(self) -> dict[str, Any]:
        """Return the arrays of a checkpoint by name, as they are."""
        parts = {"state": self.state, "moments": self.moments, "normalizer": tuple(self.normalize)}
        return networks.name_leaves(parts)


def learn(hp: ProximalPolicy, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: no policy to start from, where the hyperparameters need one, or a policy of another robot or
            task, or with other layers.
        OSError: no such file.
        Diverged: an action is not finite.
    """
    check(hp, context)
    collector = collecting.EnvironmentRollouts(hp, context)
    task = collector.task
    architecture = collector.architecture
    symmetry = mirror_maps(hp, task, architecture)
    state, moments, normalize = begin(hp, context, task, architecture)
    iterations = 0

    saved = context.checkpoint
    if saved is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            moments = Moments(*(saved[f"moments/{name}"] for name in Moments._fields))
            normalize = Normalizer(*map(np.asarray, networks.restore_tree("normalizer", tuple(normalize), saved)))
            iterations = int(saved["iterations"])
            collector.restore(saved)

    while True:
        step = iterations * hp.num_envs * hp.horizon
        schedules = Schedules.of(hp, context.steps, iterations)

        # Act for the horizon.
        rollout = collector.roll_out(state.policy, normalize, schedules.std, iterations, step)
        metrics = collector.reward_style(rollout, iterations)

        # Learn from it, in epochs of minibatches.
        batch = batch_of(hp, architecture, rollout, state.values, normalize, symmetry)
        orders = _draw_orders(hp, generator(context.seed, "orders", iterations), len(batch.returns))
        std_and_kl = (np.float32(schedules.std), np.float32(schedules.desired_kl))
        state, kl, value_loss = ppo.update(hp, architecture, state, batch, orders, std_and_kl, schedules.learns_policy)
        iterations += 1

        if schedules.updates_normalizer:
            moments = update_moments(architecture, symmetry, moments, rollout["observations"])
            normalize = architecture.normalize(moments)

        metrics |= {
            "falls": float(rollout["terminated"].sum()),
            "std": float(schedules.std),
            "kl": float(kl),
            "policy_rate": float(state.rate),
            "value_loss": float(value_loss),
        }
        graph = architectures.policy_graph(architecture, normalize, state.policy)
        arrays = jax.tree.map(np.asarray, LearnerState(state, moments, normalize).arrays())
        checkpoint = {**arrays, "iterations": np.array(iterations), **collector.arrays()}
        yield Slice(metrics, graph, checkpoint)


def begin(hp: ProximalPolicy, context: RunContext, task: Task, architecture: Architecture) -> LearnerState:
    """Return what learning begins with: drawn networks, or those of the policy that it starts from."""
    moments = Moments.empty(architecture.inputs)
    normalize = architecture.normalize(moments)
    policy = None
    if hp.start and context.checkpoint is None:
        start_normalizer, policy = _read_start(hp, context, task, architecture)
        normalize = _extend_normalizer(start_normalizer, normalize)
    state = ppo.begin(hp, architecture, generator(context.seed, "networks", 0), policy)
    return LearnerState(state, moments, normalize)


def mirror_maps(hp: ProximalPolicy, task: Task, architecture: Architecture) -> Symmetry | None:
    """Return the mirror maps that double the transitions of a horizon; None if they stay as they are.

    Raises:
        ValueError: these transitions do not fill a minibatch.
    """
    symmetry = None
    if hp.symmetry_augmentation and not architecture.symmetric:
        symmetry = critic_blocks.mirror_maps(task, hp.critic_blocks)
    hp.check_minibatch(has_copies=symmetry is not None)
    return symmetry


def update_moments(architecture: Architecture, symmetry: Symmetry | None, moments: Moments, observations) -> Moments:
    """Return moments with the observations (horizon, num_envs, ...) of a rollout, and maybe mirrored ones."""
    moments = moments.with_vectors(architecture.moment_vectors(observations))
    if symmetry is not None:
        moments = moments.with_vectors(architecture.moment_vectors(symmetry.observation(observations)))
    return moments


def check(hp: ProximalPolicy, context: RunContext) -> None:
    """Raise ValueError for hyperparameters that do not fit each other, or several bodies."""
    if hp.value_warm_up and not hp.start:
        raise ValueError("start: expected the folder of a run whose policy is where learning starts, got none")
    if hp.style and hp.simulation != "mujoco":
        raise ValueError(f"simulation: expected mujoco with a style, got {hp.simulation}")
    if not context.setup.several:
        return
    if hp.style:
        raise ValueError("style: expected none with several bodies, as a motion is of one")
    if hp.network != "legs":
        raise ValueError(f"network: expected legs with several bodies, got {hp.network}")
    if hp.critic_blocks:
        raise ValueError(f"critic_blocks: expected none with several bodies, got {', '.join(hp.critic_blocks)}")
    if hp.simulation != "mujoco":
        raise ValueError(f"simulation: expected mujoco with several bodies, got {hp.simulation}")


def _draw_orders(hp: ProximalPolicy, random: np.random.Generator, count: int) -> np.ndarray:
    """Draw the indices (updates, minibatch) of transitions.

    An epoch is a permutation of all `count` transitions, without the rest that fills no minibatch.
    """
    permutations = np.stack([random.permutation(count) for _ in range(hp.epochs)])
    transitions_of_epoch = count // hp.minibatch * hp.minibatch  # in complete minibatches
    return permutations[:, :transitions_of_epoch].reshape(-1, hp.minibatch)


def batch_of(
    hp: ProximalPolicy, architecture: Architecture, rollout: Mapping[str, Any], values, normalize: Normalizer, symmetry
) -> ppo.Horizon:
    """Return the transitions of a rollout as a batch, with advantages and returns.

    Args:
        hp: hyperparameters.
        architecture: architecture of the networks.
        rollout: arrays (horizon, num_envs, ...), as a collector returns them.
        values: parameters of the value network.
        normalize: normalizer of observations.
        symmetry: mirror maps of observations and actions; the batch has mirrored transitions at its end. None for no
            mirrored transitions.
    """
    size = rollout["observations"].shape[-1]
    xp = rollout["observations"].__array_namespace__()
    observations = normalize(rollout["observations"])
    values_before = xp.asarray(ppo.predict_values(architecture, values, observations))
    next_observations = normalize(rollout["next_observations"])
    values_after = xp.asarray(ppo.predict_values(architecture, values, next_observations))
    rewards = (1.0 - hp.discount) * rollout["rewards"]  # so that returns are about as large as rewards
    raw_advantages = ppo.estimate_advantages(
        hp, rewards, values_before, values_after, rollout["terminated"], rollout["ended"]
    )
    returns = (raw_advantages + values_before).ravel()
    advantages = ((raw_advantages - raw_advantages.mean()) / (raw_advantages.std() + _TINY_STD)).ravel()
    observations = observations.reshape(-1, size)
    actions = rollout["actions"].reshape(len(returns), -1)
    means = rollout["means"].reshape(len(returns), -1)
    if symmetry is not None:
        mirror_observation, mirror_action = symmetry
        mirrored_observations = normalize(mirror_observation(rollout["observations"]).reshape(-1, size))
        observations = xp.concatenate([observations, mirrored_observations])
        # The mean is mirrored, too: the mirrored action is as probable as the action was. A policy without symmetry
        # may have another mean for the mirrored observation. With it the probability could be almost 0, and the
        # gradient huge.
        actions = xp.concatenate([actions, mirror_action(actions)])
        means = xp.concatenate([means, mirror_action(means)])
        advantages = xp.tile(advantages, 2)
        returns = xp.tile(returns, 2)
    return ppo.Horizon(
        observations=jnp.asarray(observations, jnp.float32),
        actions=jnp.asarray(actions, jnp.float32),
        means=jnp.asarray(means, jnp.float32),
        advantages=jnp.asarray(advantages, jnp.float32),
        returns=jnp.asarray(returns, jnp.float32),
    )


def _read_start(hp: ProximalPolicy, context: RunContext, task, architecture: Architecture) -> tuple[Normalizer, tuple]:
    """Return the normalizer and the network of the policy that learning starts from."""
    if context.setup.several:
        start_policy = universal.load(hp.start)
    else:
        start_policy = policies.policy(Path(hp.start), context.setup.body, task=task)
    if not isinstance(start_policy, Network):
        raise ValueError(f"{hp.start}: expected a policy of dagger, bc or ppo")
    all_names = {**start_policy.blocks, **task.sizes}  # a dictionary, for the order of its keys
    for name in all_names:
        policy_size = start_policy.blocks.get(name, 0)
        task_size = task.sizes.get(name, 0)
        if policy_size != task_size:
            kind = start_policy.setup.kind.name
            raise ValueError(
                f"{hp.start}: a policy of {kind} for other observations than those of {task.name}: "
                f"{name} has {policy_size} numbers, and not {task_size}"
            )
    normalize, policy = _read_graph(hp, context, task, architecture, start_policy.graph)
    expected_policy = architecture.draw_policy(np.random.default_rng(0), hp.hidden)
    shapes = [leaf.shape for leaf in jax.tree.leaves(policy)]
    expected_shapes = [leaf.shape for leaf in jax.tree.leaves(expected_policy)]
    if len(shapes) != len(expected_shapes):
        raise ValueError(f"{hp.start}: expected the {len(expected_shapes)} arrays of a {hp.network}, got {len(shapes)}")
    if shapes != expected_shapes:
        first_bias_shape = shapes[0]  # leaves of a layer are ordered by name: bias, then weight
        raise ValueError(f"{hp.start}: expected {hp.hidden} hidden units, got {first_bias_shape[0]}")
    return normalize, policy


def _read_graph(
    hp: ProximalPolicy, context: RunContext, task, architecture: Architecture, graph: Graph
) -> tuple[Normalizer, tuple]:
    """Return the normalizer and the network of the graph of the policy that learning starts from."""
    try:
        return architectures.read_policy_graph(architecture, graph)
    except ValueError as error:
        line = f"{hp.start}: expected {error}, {hp.network}"
    if not context.setup.several:
        other_architecture = architectures.of(task, hp.network, hp.critic_blocks, not hp.symmetry_augmentation)
        with contextlib.suppress(ValueError):
            architectures.read_policy_graph(other_architecture, graph)
            cure = f"symmetry_augmentation={str(not hp.symmetry_augmentation).lower()}"
            line = f"{hp.start}: a policy of {cure}; add --hp {cure}"
    raise ValueError(line)


def _extend_normalizer(start: Normalizer, fresh: Normalizer) -> Normalizer:
    """Return the normalizer of a start policy, extended by the privileged numbers that critics see.

    These follow the numbers of the observation. They are of the order of 1, and keep mean and factor of the fresh
    normalizer.
    """
    size = len(start.mean)
    mean = np.append(start.mean, fresh.mean[size:])
    factor = np.append(start.factor, fresh.factor[size:])
    return Normalizer(mean, factor, start.limit)
