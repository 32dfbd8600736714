"""Datasets: Minari opens them, they replay to the bit, and they depend on nothing but seeds and settings."""

import hashlib
import pathlib
import subprocess
import sys

import h5py
import minari
import numpy as np
import pytest
from datasets import ID, QUEEN, SHORT, TICK, collect, digests, quiet, verify

import arc_suite
from arc_suite import data, evaluation, policies, style, versions
from arc_suite.cpg.presets import TUNINGS
from arc_suite.robots.spec_files import load_body

ROOT = pathlib.Path(__file__).parents[2]
SPIDER = load_body(ROOT / "examples" / "spider.json")
OWN = """
import numpy as np
def make(robot):
    joints, past = {"queen": 18, "tick": 18}[robot], []
    def policy(timestep):
        past.append((timestep.step_type, timestep.reward))
        assert (timestep.reward is None) == timestep.first() == (len(past) == 1)
        height = timestep.observation["posture"][0]
        return np.sin(len(past) + height + np.arange(joints))
    return policy
"""


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """Where Minari keeps datasets, and policies are found."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own.py").write_text(OWN)
    monkeypatch.delitem(sys.modules, "own", raising=False)
    return tmp_path / "datasets"


def replay(environment, seed, actions):
    """Observations, rewards, terms, terminations and truncations of a Gymnasium environment."""
    observation, _ = environment.reset(seed=int(seed))
    observations, steps = [observation], []
    for action in actions:
        observation, reward, terminated, truncated, info = environment.step(action)
        observations.append(observation)
        steps.append((reward, info["reward_terms"], terminated, truncated))
    rewards, terms, terminations, truncations = zip(*steps, strict=True)
    terms = {name: np.array([term[name] for term in terms]) for name in terms[0]}
    return np.array(observations), np.array(rewards), terms, np.array(terminations), np.array(truncations)


@pytest.mark.parametrize(("body", "steps"), [(QUEEN, 30), (SPIDER, 20), (TICK, 200)])
def test_minari_opens_a_dataset_whose_environment_replays_it_to_the_bit(body, steps):
    settings = data.Settings(body, "random", (), seed=3, steps=steps)
    assert collect(ID, settings, 4) == 4
    dataset = minari.load_dataset(ID)
    assert len(dataset) == 4
    assert dataset.total_steps == sum(map(len, dataset))
    environment = dataset.recover_environment()
    seeds = [metadata["seed"] for metadata in dataset.storage.get_episode_metadata(range(4))]
    assert seeds == [3, 4, 5, 6]
    for seed, episode in zip(seeds, dataset, strict=True):
        observations, rewards, terms, terminations, truncations = replay(environment, seed, episode.actions)
        assert episode.observations.dtype == episode.actions.dtype == np.float32
        np.testing.assert_array_equal(episode.observations, observations)
        np.testing.assert_array_equal(episode.rewards, rewards)
        np.testing.assert_array_equal(episode.terminations, terminations)
        np.testing.assert_array_equal(episode.truncations, truncations)
        assert episode.infos["reward_terms"].keys() == terms.keys()
        for name, term in terms.items():
            np.testing.assert_array_equal(episode.infos["reward_terms"][name], term)
    if body == TICK:
        assert any(episode.terminations[-1] for episode in dataset)
    assert verify(ID) == 4


def test_a_body_of_a_file_is_recovered_without_the_file_in_another_process():
    collect(ID, data.Settings(SPIDER, **SHORT), 1)
    code = f"import minari; e = minari.load_dataset({ID!r}).recover_environment(); print(e.reset(seed=5)[0].sum())"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == data.open(ID)[0].observations[0].sum()


def test_metadata():
    collect(ID, data.Settings(QUEEN, "cpg", ("slow", "fast"), 0.1, seed=7, steps=20), 3)
    dataset = data.open(ID)
    assert dataset.settings == data.Settings(QUEEN, "cpg", ("slow", "fast"), 0.1, seed=7, steps=20)
    assert len(dataset) == 3
    about = dataset.metadata["arc_suite"]
    assert about["versions"] == versions.recorded()
    assert len(about["model_sha256"]) == 64
    assert about["settings"] == {
        "body": "queen",
        "policy": "cpg",
        "presets": ["slow", "fast"],
        "noise": 0.1,
        "seed": 7,
        "steps": 20,
        "task": "walk",
        "task_kwargs": {},
        "task_version": 0,
        "presets_sha256": [
            hashlib.sha256(repr(TUNINGS["queen"][name]).encode()).hexdigest() for name in ("slow", "fast")
        ],
    }
    summaries = dataset.summaries()
    assert [summary["preset"] for summary in summaries] == ["fast", "slow", "fast"]  # of seeds 7, 8, 9
    for summary, episode in zip(summaries, dataset, strict=True):
        assert (summary["seed"], summary["preset"]) == (episode.seed, episode.preset)
        assert summary["length"] == summary["total_steps"] == episode.length == 20
        assert summary["return"] == episode.total == episode.rewards.sum()
        assert summary["sha256"] == episode.digest()
    assert list(minari.list_local_datasets()) == [ID]


def test_normalised_scores_run_from_the_zero_policy_to_the_gaits_best():
    collect(ID, data.Settings(QUEEN, "zero", (), steps=30), 10)
    dataset = minari.load_dataset(ID)
    totals = [episode.rewards.sum() for episode in dataset]
    assert minari.get_normalized_score(dataset, np.mean(totals)) == pytest.approx(0.0, abs=1e-12)
    assert minari.get_normalized_score(dataset, 4.0 * 30) == 1.0


class Rounded:
    """A policy whose actions are rounded as those of datasets."""

    def __init__(self, policy):
        self.policy = policy
        self.begin = policy.begin

    def act(self, observation, rewards):
        return self.policy.act(observation, rewards).astype(np.float32)


def test_an_episode_is_what_the_single_environment_plays():
    collect(ID, data.Settings(TICK, "random", (), **SHORT), 2)
    for episode in data.open(ID):
        random = Rounded(policies.policy("random", "tick"))
        steps = evaluation.rollout(arc_suite.load(TICK, "walk"), random, episode.seed, max_steps=20)
        np.testing.assert_array_equal(episode.rewards, [timestep.reward for timestep in steps][1:])


def test_style_records_a_dataset():
    collect(ID, data.Settings(QUEEN, **SHORT), 2)
    dataset = data.open(ID)
    environment = dataset.environment()
    for episode in dataset:
        playback = episode.playback()
        for _ in range(2):  # the reset rewinds it
            track = style.record(environment, playback, episode.seed, max_steps=episode.length)
            np.testing.assert_array_equal(track.rewards, episode.rewards)
    after = style.record(environment, playback, episode.seed, max_steps=22)
    assert not after.actions[20:].any()


@pytest.mark.parametrize(
    "settings",
    [
        data.Settings(QUEEN, "cpg", ("slow", "medium", "fast"), noise=0.1, **SHORT),
        data.Settings(SPIDER, "cpg", ("medium", "fast"), **SHORT),
        data.Settings(TICK, "random", (), steps=60),
        data.Settings(TICK, "own:make", (), noise=0.2, **SHORT),
    ],
    ids=["presets and noise", "spider", "random", "own"],
)
def test_episodes_depend_on_seed_and_settings_alone(settings):
    collect(ID, settings, 7, rows=7, threads=1)
    expected = digests()
    for name, rows, threads in (("a", 1, 1), ("b", 3, 2), ("c", 100, 4)):
        collect(f"{ID[:-3]}-{name}-v0", settings, 7, rows=rows, threads=threads)
        assert digests(f"{ID[:-3]}-{name}-v0") == expected
    later = settings._replace(seed=settings.seed + 4)
    collect(f"{ID[:-3]}-later-v0", later, 3)
    assert digests(f"{ID[:-3]}-later-v0") == expected[4:]
    assert len(set(expected)) == 7


def test_every_setting_matters():
    base = data.Settings(QUEEN, **SHORT)
    changes = ({}, {"noise": 0.1}, {"presets": ("fast",)}, {"policy": "zero", "presets": ()})
    seen = set()
    for number, change in enumerate(changes):
        collect(f"{ID[:-3]}-{number}-v0", base._replace(**change), 1)
        seen.add(data.open(f"{ID[:-3]}-{number}-v0")[0].actions.tobytes())
    assert len(seen) == len(changes)


def test_noise_is_normal_and_differs_from_episode_to_episode():
    settings = data.Settings(QUEEN, "zero", (), noise=0.1, steps=40)
    collect(ID, settings, 2)
    first, second = (episode.actions for episode in data.open(ID))
    for noise in (first, second):
        assert abs(noise.mean()) < 0.02
        assert 0.09 < noise.std() < 0.11
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.15


def test_ids_by_default_are_minaris():
    named = {
        "arc_suite/queen/walk/cpg-medium-v0": data.Settings(QUEEN),
        "arc_suite/tick/steer/random-v0": data.Settings(TICK, "random", (), task="steer"),
        "arc_suite/queen/walk/cpg-medium-fast-noise0_1-v0": data.Settings(QUEEN, presets=("medium", "fast"), noise=0.1),
        "arc_suite/spider/walk/my_package_policies_make-50steps-v0": data.Settings(
            SPIDER, "my_package.policies:make", (), steps=50
        ),
        "arc_suite/queen/walk/cpg-medium-set59ccfc0d-v0": data.Settings(QUEEN, task_kwargs={"arena": "bumps"}),
    }
    for dataset_id, settings in named.items():
        assert settings.dataset_id() == dataset_id
        minari.dataset.minari_dataset.parse_dataset_id(dataset_id)


def test_more_episodes_continue_and_a_finished_dataset_stays_as_it_is(root):
    settings = data.Settings(QUEEN, **SHORT)
    collect(ID, settings, 3)
    file = root / ID / "data" / "main_data.hdf5"
    before = file.stat()
    assert collect(ID, settings, 3) == collect(ID, settings, 2) == 0
    assert (file.stat().st_mtime_ns, file.stat().st_ino) == (before.st_mtime_ns, before.st_ino)
    assert collect(ID, settings, 5) == 2
    collect("arc_suite/whole-v0", settings, 5)
    assert digests() == digests("arc_suite/whole-v0")
    assert sorted(path.name for path in (root / ID).rglob("*")) == ["data", "main_data.hdf5", "metadata.json"]
    with h5py.File(file) as opened:
        assert {type(opened.get(name, getlink=True)) for name in opened} == {h5py.HardLink}


def test_another_dataset_under_the_id_is_refused_and_overwritten_at_will(root):
    settings = data.Settings(QUEEN, **SHORT)
    collect(ID, settings, 2)
    before = digests()
    for changed, difference in (
        (settings._replace(noise=0.5), "its noise is 0.0, and not 0.5"),
        (settings._replace(seed=1), "its seed is 5, and not 1"),
        (settings._replace(presets=("fast", "medium")), "its presets is ['medium'], and not ['fast', 'medium']"),
        (settings._replace(body=TICK), "its body is 'queen', and not 'tick'"),
    ):
        with pytest.raises(ValueError) as error:
            collect(ID, changed, 2)
        assert str(error.value) == f"dataset {ID!r} is another: {difference}; --overwrite replaces it"
        assert digests() == before

    def watched(*args, **kwargs):  # while the new episodes are played, the old ones are there
        assert digests() == before
        return quiet(*args, **kwargs)

    data.collect(ID, settings._replace(seed=6), 3, overwrite=True, progress=watched)
    assert digests()[0] == before[1]
    assert len(data.open(ID)) == 3
    assert [path.name for path in (root / ID).parent.iterdir() if path.is_dir()] == ["some-v0"]
