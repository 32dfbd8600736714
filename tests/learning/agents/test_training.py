"""Training: a tiny run of every algorithm, interrupted anywhere and resumed bit-exactly, and errors of one line."""

import contextlib
import functools
import json
import subprocess
import sys
import time

import numpy as np
import pytest
from tiers import tiers
from tqdm import tqdm

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from conftest import SHORT, small

import arc_suite
from arc_suite import evaluation, policies
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, configuration, evaluating, off_policy, priors, run_folder, training
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.learner import Diverged
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.learning.agents.training import train
from arc_suite.tasks import TASKS
from arc_suite.tasks.walk import Walk

NAMES = [name for name, each in algorithms.ALGORITHMS.items() if isinstance(each.hyperparameters, SoftActorCritic)]
STEPS, EVERY = 250, 100


silent = functools.partial(tqdm, disable=True)


@pytest.fixture
def tiny(prior):
    """A function that returns the configuration of a tiny run of an algorithm."""

    def make(name, **changes):
        needs = algorithms.algorithm(name).hyperparameters.prior != "none"
        fields = {"steps": STEPS, "evaluate_every": EVERY, "prior": prior if needs else None} | changes
        return Configuration.of(Setup.of("tick", "walk", SHORT), name, small(name), **fields)

    return make


def contents(folder):
    """Everything of a run that must not depend on interruptions."""
    files = {path.name: path.read_bytes() for path in (*folder.glob("*.csv"), folder / "config.json")}
    del files["times.csv"]
    arrays = {}
    for name in ("checkpoint.npz", "policy.npz"):
        with np.load(folder / name) as stored:
            arrays |= {f"{name}/{key}": stored[key].tobytes() for key in stored.files if key != "progress"}
    for path in (folder / "replay").iterdir():
        arrays[path.name] = path.read_bytes()
    return files | arrays


class BrokenOff(Exception):
    """Stands for a kill."""


BREAKS = 4
LEFT = [np.inf]  # calls until the next


def fragile(method):
    """A method of `RunFolder` in which a run is broken off, before or after it has done its work."""

    def broken(self, *arguments):
        LEFT[0] -= 1
        if LEFT[0] > 0 or LEFT[0] % 2:
            method(self, *arguments)
        if LEFT[0] <= 0:
            raise BrokenOff

    return broken


@pytest.mark.parametrize("name", tiers(NAMES, lambda name: name in ("sac", "sope", "sac_parallel", "xqc")))
def test_tiny_run(name, tiny, tmp_path, monkeypatch):
    """It writes what it should, and goes on to the same bits wherever it is broken off."""
    run = tiny(name)
    assert train(run, tmp_path / "whole", progress=silent)
    whole = contents(tmp_path / "whole")
    table = run_folder.table(tmp_path / "whole", "evaluations")
    assert table["step"].tolist() == sorted([*range(EVERY, STEPS, EVERY), STEPS] * 10)
    assert table["seed"].tolist() == [*range(9000, 9010)] * 3
    if run.hyperparameters.phase_updates:
        assert run_folder.table(tmp_path / "whole", "training")["phase_updates"].sum() >= 80

    random = np.random.default_rng(sum(name.encode()))
    for method in ("append", "save"):
        monkeypatch.setattr(RunFolder, method, fragile(getattr(RunFolder, method)))
    for _ in range(BREAKS):
        LEFT[:] = [random.integers(9)]
        with pytest.raises(BrokenOff):
            train(run, tmp_path / "broken", progress=silent)
    LEFT[:] = [np.inf]
    assert train(run, tmp_path / "broken", progress=silent)
    resumed = contents(tmp_path / "broken")
    assert resumed.keys() == whole.keys()
    assert [key for key in whole if whole[key] != resumed[key]] == []


def test_a_run_goes_on_after_its_buffer_has_overwritten_what_it_holds(tmp_path):
    """It ends after the last step before a checkpoint, which many environments reach late."""
    changes = {"num_envs": 600, "utd_ratio": 1 / 600, "buffer_size": 600, "start_steps": 0}
    run = Configuration.of(
        Setup.of("tick", "walk", SHORT), "sac", small("sac", **changes), steps=3000, evaluate_every=3000
    )
    assert train(run, tmp_path / "whole", progress=silent)

    def stop(step, metrics):
        if step == 2400:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(run, tmp_path / "broken", progress=silent, on_metrics=stop)
    assert train(run, tmp_path / "broken", progress=silent)
    assert contents(tmp_path / "broken") == contents(tmp_path / "whole")


def test_progress_shows_the_latest_evaluation_and_training_since():
    metrics = {"reward": 1.43418, "falls": 42.0, "std": 0.37}
    assert training._postfix(metrics, {}) == "reward 1.434 a step, falls 42"
    assert training._postfix(metrics, {"return": 2649.7}) == "return 2650, reward 1.434 a step, falls 42"


def test_the_policy_of_a_run_earns_what_its_table_says(tiny, tmp_path):
    """By the protocol, on single environments, bit-exactly."""
    run = tiny("sac")
    train(run, tmp_path / "run", progress=silent)
    table = run_folder.table(tmp_path / "run", "evaluations")
    environment = arc_suite.load("tick", "walk", SHORT)
    policy = policies.policy(str(tmp_path / "run"), "tick")
    for index, episode in enumerate(evaluation.episodes(environment, policy, range(9000, 9003))):
        row = len(table["step"]) - 10 + index
        assert (table["return"][row], table["length"][row]) == (episode.total, episode.length)


def test_processes_share_the_episodes_of_the_last_policy(tiny, tmp_path, monkeypatch):
    """They have the lines that one evaluation in this process has."""
    run, folder = tiny("sac", steps=30), tmp_path / "run"
    assert train(run, folder, progress=silent)
    monkeypatch.setattr(evaluating, "usable_cores", lambda: 4)
    evaluator = evaluating.ProcessEvaluator(run, folder)
    with contextlib.closing(evaluator):
        evaluator.begin(30, None)
        assert len(evaluator._processes[30]) == 3 and evaluator.pending == [30]
        ((step, lines),) = evaluator.pop_results(wait=True)
    table = run_folder.table(folder, "evaluations")
    assert step == 30 and evaluator.pending == []
    for name in ("seed", "return", "length"):
        assert [line[name] for line in lines] == table[name].tolist()


def test_minutes_count_the_processes_of_evaluations():
    before, here = training._cpu_clock(), time.process_time()
    subprocess.run([sys.executable, "-c", "sum(range(10**7))"], check=True)
    others = training._cpu_clock() - before - (time.process_time() - here)
    assert others > 0.05


def test_the_record_of_a_run(tiny, tmp_path):
    train(tiny("sac"), tmp_path / "run", minutes=0.0, progress=silent)
    config = json.loads((tmp_path / "run" / "config.json").read_text())
    assert config["hyperparameters"]["batch"] == 8 and config["task_kwargs"] == {"time_limit": 2.0}
    assert {"arc_suite", "mujoco", "numpy", "jax", "jaxlib", "optax"} <= config["versions"].keys()
    assert len(config["physics_sha256"]) == len(config["body_sha256"]) == 64
    assert configuration.read(tmp_path / "run" / "config.json") == tiny("sac")


def test_a_run_whose_record_names_its_learner_goes_on(tiny, tmp_path):
    """As records of earlier versions do, by module paths that are gone."""
    run, path = tiny("sac", steps=30), tmp_path / "run" / "config.json"
    assert not train(run, tmp_path / "run", minutes=0.0, progress=silent)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"learner": "arc_suite.agents.off_policy"}))
    assert configuration.read(path) == run
    assert train(run, tmp_path / "run", progress=silent)


def test_other_prior_data_under_the_same_id_are_another_run(tiny, tmp_path, prior, monkeypatch):
    run = tiny("sacfd", steps=30)
    assert train(run, tmp_path / "run", progress=silent)
    held = run_folder.read_config(tmp_path / "run")["prior_sha256"]
    assert held == priors.dataset_digest(prior)
    monkeypatch.setattr(priors, "dataset_digest", lambda prior: "0" * 64)
    with pytest.raises(ValueError, match=f"of another run, with prior_sha256 '{held}', not '0000"):
        train(run, tmp_path / "run", progress=silent)


def test_stops_after_minutes_and_goes_on(tiny, tmp_path):
    run = tiny("sac", steps=100)
    assert not train(run, tmp_path / "run", minutes=0.0, progress=silent)
    assert train(run, tmp_path / "run", progress=silent)
    assert train(run, tmp_path / "run", minutes=0.0, progress=silent), "nothing is left to do"


@pytest.mark.parametrize("name", tiers(["sac_parallel", "sope_eo"], lambda name: name == "sac_parallel"))
def test_a_run_is_extended_to_what_a_longer_one_is(name, tiny, tmp_path):
    assert train(tiny(name, steps=300), tmp_path / "long", progress=silent)
    for steps in (100, 300):
        assert train(tiny(name, steps=steps), tmp_path / "extended", progress=silent)
    long, extended = (contents(tmp_path / each) for each in ("long", "extended"))
    own = ("training.csv", "checkpoint.npz/count", "checkpoint.npz/sums")  # a line of metrics more, at 100
    assert [key for key in long if long[key] != extended[key] and not key.startswith(own)] == []
    with pytest.raises(ValueError, match=r"of another run, with steps 300, not 200; write to another folder$"):
        train(tiny(name, steps=200), tmp_path / "extended", progress=silent)


def test_a_run_with_a_schedule_is_not_extended(tmp_path):
    """`ppo`: noise falls over the length of a run."""
    hyperparameters = {"num_envs": 4, "horizon": 5, "minibatch": 10, "epochs": 1, "hidden": 16}
    for steps in (20, 40):
        run = Configuration.of(Setup.of("tick", "walk", SHORT), "ppo", hyperparameters, steps=steps, evaluate_every=20)
        if steps == 20:
            assert train(run, tmp_path / "run", progress=silent)
        else:
            with pytest.raises(ValueError, match=r"run: of a run of 20 steps, which cannot be extended; to train"):
                train(run, tmp_path / "run", progress=silent)


def test_another_seed_is_another_run(tiny, tmp_path):
    train(tiny("sac", steps=50), tmp_path / "run", progress=silent)
    with pytest.raises(ValueError, match=r"run: of another run, with seed 0, not 1; write to another folder$"):
        train(tiny("sac", steps=50, seed=1), tmp_path / "run", progress=silent)
    train(tiny("sac", steps=50, seed=1), tmp_path / "other", progress=silent)
    assert contents(tmp_path / "run") != contents(tmp_path / "other")


def test_a_learner_that_diverges_stops_with_one_line_and_its_last_checkpoint(tiny, tmp_path, monkeypatch):
    run = tiny("sac", steps=200)
    update, calls = off_policy.make_update, []

    def poisoned(hp, state, *rest):
        calls.append(1)
        state, sums = update(hp, state, *rest)
        if len(calls) == 150:
            state = state._replace(log_alpha=state.log_alpha * np.nan)
        return state, sums

    monkeypatch.setattr(off_policy, "make_update", poisoned)
    with pytest.raises(Diverged, match=r"^the learner diverged: .* at step 1[5-9]\d") as caught:
        train(run, tmp_path / "run", progress=silent)
    assert "\n" not in str(caught.value)
    with np.load(tmp_path / "run" / "checkpoint.npz") as stored:
        assert stored["count"][0] == 100
        assert all(np.isfinite(stored[name]).all() for name in stored.files if name.startswith("state"))
    monkeypatch.setattr(off_policy, "make_update", update)
    assert train(run, tmp_path / "run", progress=silent), "the checkpoint is good"


def test_a_learner_that_diverges_by_its_task_names_the_term(tmp_path, monkeypatch):
    class Spoiled(Walk):
        name = "spoiled"

        def terms(self, memory, readings):
            return super().terms(memory, readings) | {"forward": memory.forward_velocity * np.nan}

    monkeypatch.setitem(TASKS, "spoiled", Spoiled)
    run = Configuration.of(Setup.of("tick", "spoiled", SHORT), "sac", small("sac"), steps=200, evaluate_every=EVERY)
    line = "; the task spoiled gives such results itself: step 1: term 'forward' is nan under random actions$"
    with pytest.raises(Diverged, match=f"^the learner diverged: .* at step .*{line}"):
        train(run, tmp_path / "run", progress=silent)


def broken_off(run, folder):
    """Train until the second evaluation, whose checkpoint is not written."""

    def stop(step, metrics):
        if step > EVERY:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(run, folder, progress=silent, on_metrics=stop)


def test_a_run_whose_buffer_is_another_is_refused(tiny, tmp_path):
    run, folder = tiny("sac"), tmp_path / "run"
    broken_off(run, folder)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    rewards = folder / "replay" / "rewards"
    rewards.write_bytes(bytes(len(before[rewards])))
    with pytest.raises(ValueError, match=r"checkpoint\.npz is damaged: \S*replay holds other transitions; delete"):
        train(run, folder, progress=silent)
    rewards.write_bytes(before[rewards])
    assert train(run, folder, progress=silent)


def test_prior_data_that_were_overwritten_are_refused(tiny, tmp_path, prior):
    broken_off(tiny("sacfd"), tmp_path / "run")
    (file,) = tmp_path.glob("prior-*/actions")
    content = file.read_bytes()
    file.write_bytes(bytes(8) + content[8:])
    with pytest.raises(
        ValueError, match=rf"^prior '{prior}': \S*prior-\w+ is damaged: .* other transitions; delete it$"
    ):
        train(tiny("sacfd"), tmp_path / "run", progress=silent)


def test_a_checkpoint_of_something_else(tiny, tmp_path):
    run = tiny("sac", steps=100)
    assert not train(run, tmp_path / "run", minutes=0.0, progress=silent)
    np.savez(tmp_path / "run" / "checkpoint.npz", progress=np.array("{}"), count=np.zeros(2))
    with pytest.raises(ValueError, match=r"checkpoint\.npz is damaged: .*; delete it to start the run over$"):
        train(run, tmp_path / "run", progress=silent)
