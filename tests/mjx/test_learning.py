"""PPO in worlds of MJX."""

import contextlib
import pathlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import evaluation
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import collecting, critic_blocks, on_policy, world_rollouts
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.training import train
from arc_suite.policies import policy
from arc_suite.tasks import command

SMALL = {"num_envs": 4, "horizon": 4, "minibatch": 8, "epochs": 2, "hidden": 16}


def leaves(tree):
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])


def test_a_rollout_of_jax_gives_the_update_of_numpy():
    """The same transitions, once as NumPy's arrays and once as JAX's: batch, update and moments."""
    run = Configuration.of(Setup.of("leaper"), "ppo", SMALL)
    hp, context = run.hyperparameters, run.context(pathlib.Path())
    environments = collecting.EnvironmentRollouts(hp, context)
    task, architecture = environments.task, environments.architecture
    state = ppo.begin(hp, architecture, np.random.default_rng(0))
    normalize = Moments.empty(task.size).with_vectors(environments.observation).normalizer()
    rollout = environments.roll_out(state.policy, normalize, 0.3, 0, 0)
    orders = np.random.default_rng(0).permutation(32)[None, :8]
    found = []
    for transitions in (rollout, {name: jnp.asarray(array) for name, array in rollout.items()}):
        batch = on_policy.batch_of(
            hp, architecture, transitions, state.values, normalize, critic_blocks.mirror_maps(task)
        )
        begun = ppo.begin(hp, architecture, np.random.default_rng(0))
        updated, *_ = ppo.update(hp, architecture, begun, batch, orders, (np.float32(0.3), np.float32(0.01)), True)
        moments = Moments.empty(task.size).with_vectors(transitions["observations"])
        found.append((leaves(updated), leaves(moments)))
    assert_allclose(found[1][0], found[0][0], atol=1e-5)
    assert_allclose(found[1][1], found[0][1], rtol=1e-4, atol=1e-5)


def test_a_new_command_cuts_the_returns(monkeypatch):
    """As in `collecting.EnvironmentRollouts`: the step that begins it has the observation before it as the next one."""
    monkeypatch.setattr(command, "SHORTEST", 3)
    monkeypatch.setattr(command, "LONGEST", 6)
    run = Configuration.of(Setup.of("leaper", "steer"), "ppo", SMALL | {"horizon": 12, "simulation": "mjx"})
    hp, context = run.hyperparameters, run.context(pathlib.Path())
    collector = world_rollouts.WorldRollouts(hp, context)
    state = ppo.begin(hp, collector.architecture, np.random.default_rng(0))
    normalize = Moments.empty(collector.task.size).normalizer()
    rollout = jax.tree.map(np.asarray, collector.roll_out(state.policy, normalize, 0.01, 0, 0))
    here, there = (
        collector.task.split(rollout[name])["command"][..., :3] for name in ("observations", "next_observations")
    )
    new = (here[1:] != here[:-1]).any(axis=-1)
    drawn = new & ~rollout["terminated"][:-1]
    assert drawn.sum() > 4 and rollout["ended"][:-1][drawn].all()
    assert_array_equal(there, here)
    before, after = (rollout[name][:-1] for name in ("observations", "next_observations"))
    assert_array_equal(before[drawn], after[drawn])
    moving = ~new & here[:-1].any(axis=-1)  # a stop may follow a stop, and is another command, too
    assert not rollout["ended"][:-1][moving].any()
    assert (before[moving] != after[moving]).any(axis=-1).all()


def test_a_run_resumes_bit_exactly_and_its_policy_acts_everywhere(tmp_path):
    setup = Setup.of("leaper", "walk", {"time_limit": 0.5})
    more = {"simulation": "mjx", "critic_blocks": ["velocity"]}
    run = Configuration.of(setup, "ppo", SMALL | more, steps=48, evaluate_every=48)
    assert train(run, tmp_path / "whole")
    assert not train(run, tmp_path / "parts", minutes=1e-9)  # stops before the first slice
    slices = on_policy.learn(run.hyperparameters, run.context(tmp_path))
    first = next(slices)
    assert_array_equal(first.step, 16)
    context = run.context(tmp_path, checkpoint=first.checkpoint)
    resumed = on_policy.learn(run.hyperparameters, context)
    for _ in range(2):
        ours, theirs = next(slices), next(resumed)
        assert ours.checkpoint.keys() == theirs.checkpoint.keys()
        for name, array in ours.checkpoint.items():
            assert_array_equal(theirs.checkpoint[name], array)
    made = policy(tmp_path / "whole", "leaper")
    with contextlib.closing(setup.make_vec(2, autoreset_mode="Disabled")) as environment:
        assert all(np.isfinite(each.total) for each in evaluation.episodes_in_batch(environment, made, range(2)))


@pytest.mark.release
def test_it_learns(tmp_path):
    """30,000 steps of Tick earn more than standing still."""
    run = Configuration.of(
        Setup.of("tick"),
        "ppo",
        {"simulation": "mjx", "num_envs": 16, "horizon": 32, "minibatch": 512},
        steps=30_000,
        evaluate_every=30_000,
    )
    returns = []
    train(run, tmp_path / "run", on_metrics=lambda step, metrics: returns.append(metrics.get("return", 0.0)))
    with contextlib.closing(run.setup.make_vec(1, autoreset_mode="Disabled")) as environment:
        (still,) = evaluation.episodes_in_batch(environment, policy("zero", "tick"), range(1))
    assert max(returns) > still.total
