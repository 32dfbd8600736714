"""Proximal policy optimization in a vector environment, or in worlds on a GPU.

With symmetry augmentation each transition of a symmetric body yields a second, mirrored one (`arc_suite.symmetry`),
unless the network treats left and right alike.
A time limit bootstraps: the episode is worth the value of its last observation. Environments start at different
ages, so their time limits fall on different steps. A step that begins another command bootstraps from the observation
before it (`VectorEnv.resampled`).
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

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
from arc_suite.policies.network import Network


def learn(hp: ProximalPolicy, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: no policy to start from, where the hyperparameters need one, or a policy of another robot or
            task, or with other layers.
        OSError: no such file.
        Diverged: an action is not finite.
    """
    if hp.value_warm_up and not hp.start:
        raise ValueError("start: expected the folder of a run whose policy is where learning starts, got none")
    seed, collector = context.seed, _environments(hp, context)
    task, architecture = collector.task, collector.architecture
    augmented = hp.symmetry_augmentation and not architecture.symmetric
    symmetry = critic_blocks.mirror_maps(task, hp.critic_blocks) if augmented else None
    moments, policy = Moments.empty(architecture.inputs), None
    normalize = architecture.normalize(moments)
    if hp.start and context.checkpoint is None:
        (mean, factor, limit), policy = _read(hp, context, task, architecture)
        more = normalize.mean[len(mean) :], normalize.factor[len(mean) :]  # of privileged blocks, in units of about 1
        normalize = Normalizer(np.append(mean, more[0]), np.append(factor, more[1]), limit)
    state = ppo.begin(hp, architecture, generator(seed, "networks", 0), policy)
    iterations = 0

    if (saved := context.checkpoint) is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            moments = Moments(*(saved[f"moments/{name}"] for name in Moments._fields))
            normalize = Normalizer(*map(np.asarray, networks.restore_tree("normalizer", tuple(normalize), saved)))
            iterations = int(saved["iterations"])
            collector.restore(saved)

    while True:
        # Schedules over the length of the run.
        step = iterations * hp.num_envs * hp.horizon
        done = min(step / context.steps, 1.0)
        std = hp.initial_std * (hp.final_std / hp.initial_std) ** done
        desired_kl = hp.initial_desired_kl * (hp.final_desired_kl / hp.initial_desired_kl) ** done
        with_policy = iterations * hp.horizon >= hp.value_warm_up

        # Act for the horizon.
        rollout = collector.roll_out(state.policy, normalize, std, iterations, step)

        # Learn from it, in epochs of minibatches.
        batch = batch_of(hp, architecture, rollout, state.values, normalize, symmetry)
        count = len(batch.returns)
        random = generator(seed, "orders", iterations)
        orders = np.concatenate([random.permutation(count) for _ in range(hp.epochs)])
        orders = orders.reshape(hp.epochs, count)[:, : count // hp.minibatch * hp.minibatch].reshape(-1, hp.minibatch)
        schedules = np.float32(std), np.float32(desired_kl)
        state, kl, value_loss = ppo.update(hp, architecture, state, batch, orders, schedules, with_policy)
        iterations += 1

        # Update the normalizer.
        if not hp.start and done < hp.normalize_until:
            moments = moments.with_vectors(architecture.seen(rollout["observations"]))
            if symmetry is not None:
                moments = moments.with_vectors(architecture.seen(symmetry.observation(rollout["observations"])))
            normalize = architecture.normalize(moments)

        metrics = {"reward": rollout["rewards"].mean(), "falls": rollout["terminated"].sum(), "std": std}
        metrics |= {"kl": kl, "policy_rate": state.rate, "value_loss": value_loss}
        metrics = {name: float(metric) for name, metric in metrics.items()}
        graph = architectures.policy_graph(architecture, normalize, state.policy)
        checkpoint = {
            **networks.flatten_tree("state", state),
            **networks.flatten_tree("moments", moments),
            **networks.flatten_tree("normalizer", tuple(normalize)),
            "iterations": np.array(iterations),
            **collector.arrays(),
        }
        yield Slice(iterations * hp.num_envs * hp.horizon, metrics, graph, checkpoint)


def _environments(hp: ProximalPolicy, context: RunContext):
    if context.setup.several and hp.network != "legs":
        raise ValueError(f"network: expected legs with several bodies, got {hp.network}")
    if hp.critic_blocks and context.setup.several:
        raise ValueError(f"critic_blocks: expected none with several bodies, got {', '.join(hp.critic_blocks)}")
    if hp.simulation == "mujoco":
        return collecting.EnvironmentRollouts(hp, context)
    from arc_suite.learning.agents import world_rollouts  # needs the extra `gpu`

    return world_rollouts.WorldRollouts(hp, context)


def batch_of(
    hp: ProximalPolicy, architecture: Architecture, rollout: Mapping[str, Any], values, normalize: Normalizer, symmetry
) -> ppo.Horizon:
    """Return the batch of a rollout: with advantages and returns, and mirrored transitions at its end."""
    size, numpy = rollout["observations"].shape[-1], rollout["observations"].__array_namespace__()
    observations = normalize(rollout["observations"])
    here = numpy.asarray(ppo.predict_values(architecture, values, observations))
    after = normalize(rollout["next_observations"])
    there = numpy.asarray(ppo.predict_values(architecture, values, after))
    rewards = (1.0 - hp.discount) * rollout["rewards"]
    advantages = ppo.estimate_advantages(hp, rewards, here, there, rollout["terminated"], rollout["ended"])
    returns = (advantages + here).ravel()
    advantages = ((advantages - advantages.mean()) / (advantages.std() + 1e-8)).ravel()
    observations = observations.reshape(-1, size)
    actions, means = (rollout[name].reshape(len(returns), -1) for name in ("actions", "means"))
    if symmetry is not None:
        mirror, mirror_action = symmetry
        mirrored = normalize(mirror(rollout["observations"]).reshape(-1, size))
        observations = numpy.concatenate([observations, mirrored])
        # The mirrored action is as probable as the action was. Under the policy's own mean for the mirrored
        # observation, where the policy is not symmetric, its probability would be almost 0 and its gradient huge.
        actions, means = (numpy.concatenate([each, mirror_action(each)]) for each in (actions, means))
        advantages, returns = numpy.tile(advantages, 2), numpy.tile(returns, 2)
    arrays = (observations, actions, means, advantages, returns)
    return ppo.Horizon(*(jnp.asarray(array, jnp.float32) for array in arrays))


def _read(hp: ProximalPolicy, context: RunContext, task, architecture: Architecture) -> tuple[Normalizer, tuple]:
    """The normalizer and the network of the policy that learning starts from."""
    several, path = context.setup.several, hp.start
    found = universal.load(path) if several else policies.policy(Path(path), context.setup.body, task=task)
    if not isinstance(found, Network):
        raise ValueError(f"{hp.start}: expected a policy of dagger, bc or ppo")
    for name in {**found.blocks, **task.sizes}:
        there, here = (blocks.get(name, 0) for blocks in (found.blocks, task.sizes))
        if there != here:
            other = f"a policy of {found.setup.kind.name} for other observations than those of {task.name}"
            raise ValueError(f"{hp.start}: {other}: {name} has {there} numbers, and not {here}")
    try:
        normalize, policy = architectures.read_policy_graph(architecture, found.graph)
    except ValueError as error:
        raise ValueError(f"{hp.start}: expected {error}, {hp.network}") from None
    shapes = [leaf.shape for leaf in jax.tree.leaves(policy)]
    expected = [leaf.shape for leaf in jax.tree.leaves(architecture.drawn(np.random.default_rng(0), hp.hidden))]
    if len(shapes) != len(expected):
        raise ValueError(f"{hp.start}: expected the {len(expected)} arrays of a {hp.network}, got {len(shapes)}")
    if shapes != expected:
        raise ValueError(f"{hp.start}: expected {hp.hidden} hidden units, got {shapes[0][0]}")  # of the first bias
    return normalize, policy
