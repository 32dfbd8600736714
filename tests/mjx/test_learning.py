"""PPO in worlds of MJX."""

import contextlib
import os
import pathlib
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import evaluation, files, usage
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import collecting, device_learner, learner, on_policy, run_folder, world_rollouts
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.training import train, train_in_one_program
from arc_suite.policies import policy
from arc_suite.tasks import command

SMALL = {"num_envs": 4, "horizon": 4, "minibatch": 8, "epochs": 2, "hidden": 16}
SHORT = {"time_limit": 0.5}  # s: episodes of 10 steps


def leaves(tree):
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])


@pytest.mark.parametrize(
    "changes",
    [{}, {"network": "perceptron"}, {"network": "perceptron", "critic_blocks": ["velocity"]}],
    ids=["legs", "mirrored", "critic_blocks"],
)
def test_the_device_learns_from_transitions_what_the_host_does(changes):
    """From the same transitions and orders: batch, update, moments and normalizer."""
    run = Configuration.of(Setup.of("leaper"), "ppo", SMALL | changes)
    hp, context = run.hyperparameters, run.context(pathlib.Path())
    environments = collecting.EnvironmentRollouts(hp, context)
    task, architecture = environments.task, environments.architecture
    symmetry = on_policy.mirror_maps(hp, task, architecture)
    assert (symmetry is not None) == ("network" in changes)
    _, empty, _ = on_policy.begin(hp, context, task, architecture)
    normalize = architecture.normalize(
        empty.with_vectors(architecture.moment_vectors(environments.observation)),
    )
    rollout = environments.roll_out(ppo.begin(hp, architecture, np.random.default_rng(0)).policy, normalize, 0.3, 0, 0)
    count = 16 if symmetry is None else 32
    orders = np.random.default_rng(0).permutation(count)[None, :8]

    def learn(rollout, moments, normalize):
        state = ppo.begin(hp, architecture, np.random.default_rng(0))
        batch = on_policy.batch_of(hp, architecture, rollout, state.values, normalize, symmetry)
        numbers = (np.float32(0.3), np.float32(0.01))
        state, *_ = ppo.update(hp, architecture, state, batch, orders, numbers, True)
        moments = on_policy.update_moments(architecture, symmetry, moments, rollout["observations"])
        return batch, state, moments, architecture.normalize(moments)

    on_host = learn(rollout, empty, normalize)
    on_device = jax.jit(learn)(*jax.tree.map(jnp.asarray, (rollout, empty, normalize)))
    assert len(on_host[0].returns) == count
    for host_part, device_part in zip(on_host, on_device, strict=True):
        assert_allclose(leaves(device_part), leaves(host_part), rtol=1e-4, atol=1e-5)
    assert_allclose(leaves(on_device[1]), leaves(on_host[1]), atol=1e-5)


def test_a_new_command_cuts_the_returns(monkeypatch):
    """As in `collecting.EnvironmentRollouts`: the step that begins it has the observation before it as the next one."""
    monkeypatch.setattr(command, "SHORTEST", 3)
    monkeypatch.setattr(command, "LONGEST", 6)
    changes = {"horizon": 12, "simulation": "mjx", "network": "perceptron"}
    run = Configuration.of(Setup.of("leaper", "steer"), "ppo", SMALL | changes)
    hp, context = run.hyperparameters, run.context(pathlib.Path())
    rollouts = world_rollouts.WorldRollouts(hp, [context])
    state = ppo.begin(hp, rollouts.architecture, np.random.default_rng(0))
    normalize = Moments.empty(rollouts.task.size).normalizer()
    worlds = jax.tree.map(lambda array: array[0], rollouts.begin())
    _, rollout = jax.jit(rollouts.roll_out)(worlds, state.policy, normalize, 0.01, jax.random.key(0))
    rollout = jax.tree.map(np.asarray, rollout)
    here, there = (
        rollouts.task.split(rollout[name])["command"][..., :3] for name in ("observations", "next_observations")
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


def test_a_world_that_diverges_has_the_observation_before_as_the_next_one():
    """The one after is 0, of which a network of values knows nothing."""
    run = Configuration.of(Setup.of("leaper"), "ppo", SMALL | {"horizon": 1, "minibatch": 4, "simulation": "mjx"})
    rollouts = world_rollouts.WorldRollouts(run.hyperparameters, [run.context(pathlib.Path())])
    state = ppo.begin(run.hyperparameters, rollouts.architecture, np.random.default_rng(0))
    normalize = rollouts.architecture.normalize(Moments.empty(rollouts.architecture.inputs))
    worlds = jax.tree.map(lambda array: array[0], rollouts.begin())
    data = worlds.state.data
    qvel = data.qvel.at[1, 0].set(1e11)
    worlds = worlds._replace(state=worlds.state.replace(data=data.replace(qvel=qvel)))
    _, rollout = jax.jit(rollouts.roll_out)(worlds, state.policy, normalize, 0.01, jax.random.key(0))
    rollout = {name: np.asarray(array)[0] for name, array in rollout.items()}
    assert rollout["ended"][1] and not rollout["terminated"][1] and rollout["rewards"][1] == 0.0
    is_same = (rollout["next_observations"] == rollout["observations"]).all(axis=-1)
    assert_array_equal(is_same, [False, True, False, False])


def contents(folder):
    """The content of a run's tables and checkpoint, without times."""
    texts = {name: (folder / f"{name}.csv").read_text() for name in ("training", "evaluations")}
    with np.load(folder / run_folder.CHECKPOINT) as stored:
        return texts, {name: stored[name] for name in stored.files if name != "progress"}


def check_same(found, expected):
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        assert_array_equal(found[name], array, err_msg=name)


def stop_after_slice(run, folder):
    steps = []
    assert not train(run, folder, on_metrics=lambda step, metrics: steps.append(step), stop=lambda: bool(steps))


def test_a_run_resumes_bit_exactly_and_its_policy_acts_everywhere(tmp_path, monkeypatch):
    """After each chunk, also while policies are evaluated beside it."""
    monkeypatch.setattr(device_learner, "CHUNK", 2)
    setup = Setup.of("leaper", "walk", SHORT)
    more = {"simulation": "mjx", "critic_blocks": ["velocity"]}
    run = Configuration.of(setup, "ppo", SMALL | more, steps=112, evaluate_every=48)
    assert train(run, tmp_path / "whole")
    whole_texts, whole_arrays = contents(tmp_path / "whole")
    assert run_folder.table(tmp_path / "whole", "evaluations")["step"].tolist() == [48] * 10 + [96] * 10 + [112] * 10
    assert run_folder.table(tmp_path / "whole", "training")["step"].tolist() == [32, 48, 80, 96, 112]

    parts = tmp_path / "parts"
    assert not train(run, parts, minutes=1e-9)  # stops before the first slice
    for iterations, pending in ((2, []), (3, [48])):
        stop_after_slice(run, parts)
        assert int(contents(parts)[1]["iterations"]) == iterations
        assert run_folder.read_progress(parts)["pending"] == pending
    assert train(run, parts)
    texts, arrays = contents(parts)
    assert texts == whole_texts
    check_same(arrays, whole_arrays)
    made = policy(tmp_path / "whole", "leaper")
    with contextlib.closing(setup.make_vec(2, autoreset_mode="Disabled")) as environment:
        assert all(np.isfinite(each.total) for each in evaluation.episodes_in_batch(environment, made, range(2)))


def test_chunks_of_any_length_give_the_same_bits(tmp_path, monkeypatch):
    run = Configuration.of(Setup.of("leaper", "walk", SHORT), "ppo", SMALL | {"simulation": "mjx"}, steps=64)
    latest = []
    for chunk in (4, 3):
        monkeypatch.setattr(device_learner, "CHUNK", chunk)
        with usage.record(usage.Usage("ppo")) as used:
            *_, last = device_learner.learn(run.hyperparameters, run.context(tmp_path))
        assert used.steps == 64
        latest.append(last)
    check_same(*(each.checkpoint for each in latest))


@pytest.mark.long
def test_seeds_in_one_program_are_those_alone(tmp_path):
    """In their own folders, from which each goes on alone or with the others, to the same bits."""
    setup = Setup.of("leaper", "walk", SHORT)
    runs = [
        Configuration.of(setup, "ppo", SMALL | {"simulation": "mjx"}, seed, steps=32, evaluate_every=16)
        for seed in (0, 3)
    ]
    latest = []
    for name, groups in {"alone": [[run] for run in runs], "mapped": [runs]}.items():
        for group in groups:
            assert train_in_one_program(group, [tmp_path / name / run.name for run in group])
        latest.append([contents(tmp_path / name / run.name) for run in runs])
    for (_, alone), (_, mapped) in zip(*latest, strict=True):
        assert mapped.keys() == alone.keys()
        for name, array in alone.items():
            assert_allclose(mapped[name], array, rtol=1e-4, atol=1e-5, err_msg=name)
    (_, first), (_, second) = latest[1]
    assert any((first[name] != second[name]).any() for name in first if name.startswith("state/policy"))
    (tmp_path / "parts").mkdir()
    folders = [tmp_path / "parts" / run.name for run in runs]
    assert not train_in_one_program(runs, folders, stop=lambda: True)
    assert train_in_one_program(runs, folders)
    for folder, (texts, arrays) in zip(folders, latest[1], strict=True):
        assert contents(folder)[0] == texts
        check_same(contents(folder)[1], arrays)


@pytest.mark.long
def test_two_devices_are_one(tmp_path):
    """Each simulates half of the worlds; the other process finds two devices on this processor."""
    run = Configuration.of(Setup.of("leaper", "walk", SHORT), "ppo", SMALL | {"simulation": "mjx"}, steps=32)
    *_, latest = device_learner.learn(run.hyperparameters, run.context(tmp_path))
    with files.writing_json(tmp_path / "config.json") as file:
        file.update(run.to_dict())
    flag = "--xla_force_host_platform_device_count=2"
    surroundings = os.environ | {"XLA_FLAGS": f"{os.environ['XLA_FLAGS']} {flag}"}
    subprocess.run([sys.executable, "-c", _LEARN, tmp_path], check=True, env=surroundings)
    with np.load(tmp_path / "two.npz") as two:
        assert int(two["devices"]) == 2
        for name, array in latest.checkpoint.items():
            assert_allclose(two[name], array, rtol=1e-4, atol=1e-5, err_msg=name)


_LEARN = """
import pathlib
import sys
import jax
import numpy as np
from arc_suite.learning.agents import configuration, device_learner
folder = pathlib.Path(sys.argv[1])
run = configuration.read(folder / "config.json")
*_, latest = device_learner.learn(run.hyperparameters, run.context(folder))
np.savez(folder / "two.npz", devices=len(jax.devices()), **latest.checkpoint)
"""


def test_a_policy_is_finetuned_once_values_have_learned(tmp_path, monkeypatch):
    """Its network stays as it is until then, as on the host, and its normalizer for ever."""
    setup = Setup.of("leaper", "walk", SHORT)
    changes = {"num_envs": 4, "round": 10, "left_out": 0, "hidden": 16, "batch": 64}
    assert train(Configuration.of(setup, "dagger", changes, steps=80, evaluate_every=80), tmp_path / "start")
    more = {"simulation": "mjx", "start": str(tmp_path / "start"), "value_warm_up": 8}
    del (hyperparameters := dict(SMALL))["hidden"]
    run = Configuration.of(setup, "finetune", hyperparameters | more, steps=64, evaluate_every=64)
    slices = list(device_learner.learn(run.hyperparameters, run.context(tmp_path)))
    assert [int(each.checkpoint["iterations"]) for each in slices] == [2, 4]
    warm, tuned = (each.checkpoint for each in slices)
    begun = on_policy.begin(run.hyperparameters, run.context(tmp_path), *task_and_architecture(run)).arrays()
    for name, array in begun.items():
        if name.startswith(("state/policy", "normalizer")):
            assert_array_equal(warm[name], array, err_msg=name)
    assert any((warm[name] != tuned[name]).any() for name in begun if name.startswith("state/policy"))
    assert all((warm[name] == tuned[name]).all() for name in begun if name.startswith("normalizer"))
    assert any((warm[name] != begun[name]).any() for name in begun if name.startswith("state/values"))


def task_and_architecture(run):
    rollouts = world_rollouts.WorldRollouts(run.hyperparameters, [run.context(pathlib.Path())])
    return rollouts.task, rollouts.architecture


def test_an_action_that_is_not_finite_ends_the_run(tmp_path):
    run = Configuration.of(Setup.of("leaper", "walk", SHORT), "ppo", SMALL | {"simulation": "mjx"}, steps=64)
    context = run.context(tmp_path)
    first = next(device_learner.learn(run.hyperparameters, context._replace(evaluate_every=16)))
    broken = dict(first.checkpoint) | {"normalizer/0": np.full_like(first.checkpoint["normalizer/0"], np.nan)}
    with pytest.raises(learner.Diverged, match=r"an action is not finite at step 16;"):
        next(device_learner.learn(run.hyperparameters, context._replace(checkpoint=broken)))


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
