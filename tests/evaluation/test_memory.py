"""Evaluation that memory cannot win: data and evaluation share no seed, and what a policy learned from is known."""

import contextlib
import functools
import json

import networks
import numpy as np
import programs
import pytest
from datasets import ID, SETTINGS, collect, edited
from refusals import refused
from tqdm import tqdm

from arc_suite import checks, data, evaluation, policies, seed_ranges
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import provenance
from arc_suite.learning.agents import priors
from arc_suite.learning.agents.learner import MAX_RUN_SEED
from arc_suite.policies import network

STEPS, RECORDED, PLAYED = 100, 15, 30


class Replay:
    """A policy that replays the recorded episode whose first observation is nearest."""

    def __init__(self, recorded):
        self.starts = np.stack([episode.observations[0] for episode in recorded])
        self.recorded = recorded

    def reset(self, indices, seeds):
        self.actions = None

    def act(self, observation, rewards):
        if self.actions is None:
            seen = np.concatenate(list(observation.values()), axis=-1)[:, None]
            nearest = np.linalg.norm(self.starts - seen, axis=-1).argmin(axis=-1)
            self.actions = iter(np.stack([self.recorded[index].actions for index in nearest], axis=1))
        return next(self.actions).astype(float)


@pytest.mark.long
@pytest.mark.parametrize(
    ("robot", "task", "preset"),
    [("queen", "walk", "medium"), pytest.param("tick", "steer", "reactive", marks=pytest.mark.release)],
)
def test_a_replay_of_the_data_earns_on_evaluations_seeds_what_it_earns_on_others(
    tmp_path, monkeypatch, robot, task, preset
):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    settings = data.DatasetSettings(Setup.of(robot, task), presets=(preset,), steps=STEPS)
    data.collect("memory-v0", settings, RECORDED, RECORDED, threads=1, progress=functools.partial(tqdm, disable=True))
    recorded = list(data.open("memory-v0"))
    with contextlib.closing(settings.environment(PLAYED, threads=1)) as environment:

        def earned(seeds):
            played = evaluation.episodes_in_batch(environment, Replay(recorded), seeds)
            return np.mean([episode.total for episode in played])

        known = np.mean([episode.rewards.sum() for episode in recorded])
        remembered = earned([settings.seed + index % RECORDED for index in range(PLAYED)])
        assert remembered == pytest.approx(known), "it remembers what it has seen"
        judged = earned(range(PLAYED))
        assert judged == pytest.approx(earned(range(50_000, 50_000 + PLAYED)), rel=0.1)
        assert judged < 0.95 * known


@pytest.mark.parametrize("seed", [0, 9_999])
def test_data_with_episodes_of_evaluation_are_no_prior_data(tmp_path, monkeypatch, seed):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    collect(ID, SETTINGS, 2)
    assert priors.dataset_seeds(ID) == range(10_005, 10_007)
    edited(tmp_path, lambda metadata: metadata["arc_suite"].update(seed=seed))
    with refused(f"prior {ID!r}: expected seeds from 10000 on, got {seed}; collect it anew"):
        priors.dataset_seeds(ID)


def test_every_seed_has_one_owner():
    """Up to the largest seed of NumPy."""
    owners = (seed_ranges.EVALUATION, seed_ranges.COLLECTING, seed_ranges.LEARNING, seed_ranges.JUDGING)
    assert [owner.start for owner in owners] == [0, *(owner.stop for owner in owners[:-1])]
    for seed in (0, 1, MAX_RUN_SEED):
        run = seed_ranges.of_run(seed)
        assert run[0] in seed_ranges.LEARNING and run[-1] in seed_ranges.LEARNING
        assert run.stop == seed_ranges.of_run(seed + 1).start
    assert set(range(evaluation.EPISODES)) <= set(seed_ranges.EVALUATION)
    assert set(seed_ranges.VALIDATION) <= set(seed_ranges.EVALUATION) - set(range(evaluation.EPISODES))
    assert seed_ranges.JUDGING[-1] == checks.MAX_SEED


@pytest.mark.parametrize(
    ("ranges", "shared"),
    [([], range(0)), ([range(100, 200)], range(0)), ([range(50, 90), range(5, 12)], range(5, 10))],
)
def test_what_ranges_have_in_common(ranges, shared):
    assert seed_ranges.common_seeds(ranges, range(10)) == shared


def saved(path, *ranges, known=True):
    """A policy file that learned from the episodes of some seeds."""
    network.save(path, networks.made()._replace(training_seeds=ranges if known else None))
    return str(path)


def test_a_policy_file_holds_the_seeds_that_it_learned_from(tmp_path):
    both = range(100_000, 200_000), range(10_000, 10_100)
    assert policies.training_seeds(saved(tmp_path / "a.npz", *both)) == both
    assert policies.training_seeds(saved(tmp_path / "b.npz", known=False)) is None
    assert network.load(tmp_path / "a.npz").training_seeds == both


def test_checkpoints_learned_from_what_each_of_them_did(tmp_path):
    for step, first in ((1, 100_000), (2, 10_000)):
        (tmp_path / str(step)).mkdir()
        saved(tmp_path / str(step) / network.FILE, range(first, first + 5))
    assert policies.training_seeds(str(tmp_path)) == (range(100_000, 100_005), range(10_000, 10_005))


@pytest.mark.parametrize("name", ["own_policies:stand", "file.py:make", "theirs.zip"])
def test_functions_and_zips_do_not_say_what_they_learned_from(name):
    assert provenance.training_seeds(name, range(100)) is None


@pytest.mark.parametrize("name", policies.POLICIES)
def test_policies_of_the_suite_know_no_episode_of_evaluation_or_data(name):
    assert provenance.training_seeds(name, range(100_000)) is not None


def test_episodes_that_a_policy_learned_from_do_not_judge_it(tmp_path):
    learned = saved(tmp_path / "policy.npz", range(5, 30))
    assert provenance.training_seeds(learned, range(5)) == (range(5, 30),)
    done = programs.arc_suite("evaluate", "--robot=tick", f"--policy={learned}", "--episodes=10")
    line = f"policy {learned}: learned from episodes of seeds 5 to 9; those below 10000 are evaluation's"
    assert (done.returncode, done.stderr) == (1, f"arc-suite evaluate: {line}\n")


@pytest.mark.parametrize("known", [True, False])
def test_a_policy_without_provenance_is_marked(tmp_path, known):
    policy, entry = saved(tmp_path / "policy.npz", known=known), tmp_path / "entry.json"
    command = ["--robot=tick", f"--policy={policy}", "--episodes=2", "--set=time_limit=0.2", f"--json={entry}"]
    done = programs.arc_suite("evaluate", *command)
    assert (done.returncode, done.stderr) == (0, "")
    assert (f"policy {policy}: training data unknown\n" in done.stdout) != known
    assert json.loads(entry.read_text())["training_seeds"] == ([] if known else None)
