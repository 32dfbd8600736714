"""Several runs of soft actor-critic in one program: each has the numbers of a run alone."""

import functools
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers
from tqdm import tqdm

jax = pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from conftest import SHORT, small

from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, mapped_updates, off_policy, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.off_policy_run import OffPolicyRun
from arc_suite.learning.agents.replay import Replay, Transitions
from arc_suite.learning.agents.training import group_by_program, train, train_in_one_program
from arc_suite.learning.studies import runner, tables

NAMES = [name for name, each in algorithms.ALGORITHMS.items() if isinstance(each.hyperparameters, SoftActorCritic)]
STEPS = 200
silent = functools.partial(tqdm, disable=True)
# Actions are uniform throughout, as a walk whose actions differ in the last digit is soon another one.
UNIFORM = {"start_steps": 2000}


def runs_of(name, seeds, prior, folder, **changes):
    """Hyperparameters and contexts of tiny runs of an algorithm."""
    takes_prior = algorithms.algorithm(name).hyperparameters.prior != "none"
    made = [
        Configuration.of(
            Setup.of("tick", "walk", SHORT),
            name,
            small(name, **changes),
            seed,
            steps=STEPS,
            evaluate_every=STEPS,
            prior=prior if takes_prior else None,
        )
        for seed in seeds
    ]
    return [run.hyperparameters for run in made], [run.context(folder / str(run.seed)) for run in made]


def latest_of(all_slices, count):
    """The latest slice of each run, once all have learned to the end."""
    latest = [None] * count
    for slices in all_slices:
        latest = [new or old for new, old in zip(slices, latest, strict=True)]
        if all(each is not None and each.metrics is not None for each in latest):
            return latest
    raise AssertionError("the learner has ended")


def check_close(found, expected, updates):
    """Arrays differ little for their size; single numbers may differ more, as Adam divides by small ones."""
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        difference = np.linalg.norm(np.subtract(found[name], array, dtype=float))
        assert difference <= 1e-5 * updates / STEPS * (1.0 + np.linalg.norm(np.asarray(array, float))), name


@pytest.mark.parametrize("name", tiers(NAMES, lambda name: name == "sac"))
def test_two_runs_in_one_program_are_those_alone(name, prior, tmp_path):
    """After 200 updates of the policy, and those of phases, which end at updates of their own."""
    changes = UNIFORM | ({"utd_ratio": 2} if name == "droq" else {})  # 20 updates of a step make much of rounding
    all_hp, contexts = runs_of(name, (0, 5), prior, tmp_path / "alone", **changes)
    alone = [latest_of(([each] for each in off_policy.learn(*run)), 1)[0] for run in zip(all_hp, contexts, strict=True)]
    all_hp, contexts = runs_of(name, (0, 5), prior, tmp_path / "mapped", **changes)
    mapped = latest_of(off_policy.learn_in_step(all_hp, contexts, mapped_updates.MappedUpdates), 2)
    assert not np.array_equal(alone[0].checkpoint["count"], alone[0].checkpoint["earned"])
    for one, other in zip(mapped, alone, strict=True):
        updates = int(other.checkpoint["count"][1])
        check_close(one.checkpoint, other.checkpoint, updates)
        assert_array_equal(one.checkpoint["count"], other.checkpoint["count"])
        assert one.metrics.keys() == other.metrics.keys()
        check_close(one.metrics, other.metrics, updates)


@pytest.mark.parametrize("n_step", [1, 3])
def test_the_device_has_the_transitions_of_replay_buffers(n_step, tmp_path):
    """Those from before and those of later steps, where a buffer has overwritten its first ones, too."""
    random = np.random.default_rng(0)
    buffers = [Replay(tmp_path / name, capacity=20, size=3, joints=2, slack=4, num_envs=2) for name in "ab"]
    hp = SoftActorCritic(n_step=n_step, num_envs=2, utd_ratio=1.0)
    table, next_observations, is_last = None, None, np.ones((2, 2), bool)
    for step in range(30):
        draws = [random.standard_normal((2, 2, size)).astype(np.float32) for size in (3, 2, 1, 3)]
        observations = draws[0] if is_last.any() else next_observations
        _, actions, rewards, next_observations = draws
        is_last = np.full((2, 2), step % 7 == 6)
        steps = Transitions(observations, actions, rewards[..., 0], np.ones((2, 2), np.float32), next_observations)
        if table is not None:
            slots = np.stack([buffer.next_slots_to_add() for buffer in buffers])
            table = mapped_updates._write(table, np.arange(2)[:, None], slots, steps, is_last)
        for index, buffer in enumerate(buffers):
            for environment in range(2):
                fields = [array[index, environment] for array in steps]
                buffer.add(*fields[:3], not fields[3], fields[4], is_last=bool(is_last[index, environment]))
        if step == 4:
            table = mapped_updates._make_table(buffers, np.float32)
    places = mapped_updates._places(buffers, buffers)
    for buffer, place in zip(buffers, places, strict=True):
        indices = np.arange(len(buffer))
        found = mapped_updates._take(hp, 2, table, mapped_updates.Place(*place), jax.numpy.asarray(indices))
        for array, expected in zip(found, buffer.transitions_at(indices, n_step, hp.discount), strict=True):
            assert_allclose(array, expected, rtol=1e-6)


@pytest.mark.parametrize(("gigabytes", "dtype"), [(1.0, np.float16), (100.0, np.float32)])
def test_observations_take_half_the_memory_where_there_is_little(gigabytes, dtype, tmp_path, monkeypatch):
    class Device:
        def memory_stats(self):
            return {"bytes_limit": int(gigabytes * 2**30)}

    class Buffer:
        slots, size = 1_000_000, 199

    monkeypatch.setattr(jax, "local_devices", lambda: [Device()])
    assert mapped_updates._observation_dtype([[Buffer()], []]) == dtype


def tables_and_arrays(folder):
    """Tables of a run's folder, and the arrays of its checkpoint."""
    texts = {name: (folder / f"{name}.csv").read_text() for name in ("training", "evaluations")}
    return texts, run_folder.read_arrays(folder)


@pytest.mark.long
def test_runs_in_one_program_resume(prior, tmp_path):
    """To the same bits, also in phases that have ended in one of them, in folders of runs alone."""
    fields = {"steps": STEPS, "evaluate_every": 100, "prior": prior}
    runs = [Configuration.of(Setup.of("tick", "walk", SHORT), "sope", small("sope"), seed, **fields) for seed in (0, 5)]

    def train_to_end(folder, stops=()):
        folders = [folder / run.name for run in runs]
        for stop_after in stops:
            answers = iter([False] * stop_after + [True])
            assert not train_in_one_program(runs, folders, silent, stop=functools.partial(next, answers))
        assert train_in_one_program(runs, folders, silent)
        return [tables_and_arrays(each) for each in folders]

    whole = train_to_end(tmp_path / "whole")
    parts = train_to_end(tmp_path / "parts", stops=(0, 2))
    for (whole_texts, whole_arrays), (texts, arrays) in zip(whole, parts, strict=True):
        assert texts == whole_texts
        assert arrays.keys() == whole_arrays.keys()
        for key, array in whole_arrays.items():
            assert_array_equal(arrays[key], array, err_msg=key)
    assert train(runs[0], tmp_path / "parts" / runs[0].name, progress=silent), "finished, as one alone would be"


def test_runs_that_have_made_other_numbers_of_steps_are_no_program(tmp_path):
    """Their updates differ; once each has a checkpoint of its own, they learn in two groups."""
    setup, fields = Setup.of("tick", "walk", SHORT), {"steps": STEPS, "evaluate_every": 100}
    runs = [Configuration.of(setup, "sac", small("sac"), seed, **fields) for seed in (0, 3)]
    folders = [tmp_path / run.name for run in runs]
    assert group_by_program(runs, folders) == [[0, 1]]
    assert not train(runs[0], folders[0], progress=silent, stop=lambda: True)
    assert group_by_program(runs, folders) == [[0], [1]]
    expected = f"{folders[1]}: expected a run of one program with {folders[0]}, after as many steps; "
    with pytest.raises(ValueError, match=re.escape(expected)):
        train_in_one_program(runs, folders, silent)


def test_which_runs_are_one_program(prior, tmp_path):
    """Those of equal updates, sizes, steps and steps so far; early stopping and body are each run's own."""

    def program(name, robot="tick", seed=0, **changes):
        run = Configuration.of(Setup.of(robot), name, changes, seed, steps=STEPS)
        return algorithms.program_of(run.hyperparameters, run.context(tmp_path))

    assert program("sac") == program("sac", seed=3) == program("sac", "queen")
    assert program("speq") == program("sope_eo")
    assert program("speq_o2o") == program("sope")
    others = [program("sac"), program("speq"), program("sope"), program("sacfd"), program("sac", "bastion")]
    others += [program("sac", batch=64), program("sac_parallel"), program("sac_parallel", "queen")]
    assert len(set(others)) == len(others)
    with pytest.raises(ValueError, match="runs in one program, got DAgger"):
        program("dagger")


@pytest.mark.long
def test_a_study_on_a_device(tmp_path, monkeypatch, capsys):
    """It stops after its minutes, goes on, and leaves a run that diverges behind."""
    runs = [tables.run("tick", "sac", 60, seed, task_kwargs=SHORT, hyperparameters=small("sac")) for seed in range(3)]
    assert runner.make_on_device(runs, tmp_path, 0.0, silent) == 0
    assert capsys.readouterr().out == "0 of 3 finished\n"
    check_actions = OffPolicyRun.check_actions

    def check(run, actions):
        check_actions(run, np.full_like(actions, np.nan) if (run.context.seed, run.steps) == (1, 40) else actions)

    monkeypatch.setattr(OffPolicyRun, "check_actions", check)
    assert runner.make_on_device(runs, tmp_path, None, silent) == 1
    out, errors = capsys.readouterr()
    assert out == "2 of 3 finished, 1 failed\n"
    assert f"{tmp_path / runs[1].name}: the learner diverged: an action is not finite at step 40;" in errors
    monkeypatch.undo()
    assert runner.make_on_device(runs, tmp_path, None, silent) == 0
    assert capsys.readouterr().out == "3 of 3 finished\n"
