"""Datasets: Minari opens them, they replay bit-exactly, and they depend on nothing but seeds and settings."""

import dataclasses
import shutil
import sys

import gaitless
import h5py
import interpreters
import minari
import numpy as np
import pytest
from datasets import ID, QUEEN, SETTINGS, SHORT, SPIDER, TICK, collect, digests, edited, quiet, verify
from refusals import refused
from tiers import never, tiers

from arc_suite import data
from arc_suite.bodies import generator
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import provenance
from arc_suite.policies.network import PACKAGED

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
def own(tmp_path, monkeypatch):
    """Let policies of the module `own` be found."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own.py").write_text(OWN)
    monkeypatch.delitem(sys.modules, "own", raising=False)


@pytest.fixture
def stay():
    with gaitless.registered():
        yield


def replay(environment, seed, actions):
    """Observations, rewards, terms, terminations and truncations of a Gymnasium environment."""
    observation, _ = environment.reset(seed=int(seed))
    observations, steps = [observation], []
    for action in actions:
        observation, reward, terminated, truncated, info = environment.step(action)
        observations.append(observation)
        terms = {name: info[f"reward_{name}"] for name in environment.unwrapped.task.settings.weights}
        steps.append((reward, terms, terminated, truncated))
    rewards, terms, terminations, truncations = zip(*steps, strict=True)
    terms = {name: np.array([term[name] for term in terms]) for name in terms[0]}
    return np.array(observations), np.array(rewards), terms, np.array(terminations), np.array(truncations)


MODIFIERS = {"kicks": 1.0, "motor_strength": [0.5, 1.0], "actuator_failure": True}
MODIFIERS |= {"friction": [0.3, 1.0], "mass": [0.8, 1.5]}
MODIFIERS |= {"observation_noise": 1.0, "delay": [0, 2], "actions": "position", "exclude_blocks": "contact_forces"}
BUMPS, WAVE = (Setup.of("queen", "walk", settings) for settings in ({"arena": "bumps"}, {"gait": "wave"}))
RANDOM = data.DatasetSettings(QUEEN, "random", (), seed=10_003, steps=30)


REPLAYED = {
    "queen": RANDOM,
    "spider": RANDOM._replace(setup=SPIDER, steps=20),
    "tick": RANDOM._replace(setup=TICK, steps=200),
    "steer": RANDOM._replace(setup=Setup.of("queen", "steer", {"gait": "ripple", "weights": {"tracking": 2.0}})),
    "bumps": RANDOM._replace(setup=BUMPS),
    "shoved": RANDOM._replace(setup=Setup.of("queen", "shoved"), steps=60),
    "modifiers": RANDOM._replace(setup=Setup.of("queen", "steer", MODIFIERS), steps=60),
    "spider by positions": RANDOM._replace(
        setup=Setup.of(SPIDER.body, "walk", MODIFIERS), policy="cpg", presets=("medium",), noise=0.05, steps=60
    ),
    "spider steers on bumps": RANDOM._replace(setup=Setup.of(SPIDER.body, "steer", {"arena": "bumps"})),
    "no gait": None,  # of a task that the test registers
}


@pytest.mark.parametrize(
    "name", tiers(REPLAYED, never, lambda name: name in ("spider", "shoved", "modifiers", "no gait"))
)
def test_minari_opens_a_dataset_whose_environment_replays_it(name, stay):
    settings = REPLAYED[name] or RANDOM._replace(setup=Setup.of("queen", "stay"))
    assert collect(ID, settings, 4) == 4
    dataset = minari.load_dataset(ID)
    assert len(dataset) == 4
    assert dataset.total_steps == sum(map(len, dataset))
    environment = dataset.recover_environment()
    seeds = [metadata["seed"] for metadata in dataset.storage.get_episode_metadata(range(4))]
    assert seeds == [10_003, 10_004, 10_005, 10_006]
    for seed, episode in zip(seeds, dataset, strict=True):
        observations, rewards, terms, terminations, truncations = replay(environment, seed, episode.actions)
        assert episode.observations.dtype == episode.actions.dtype == np.float32
        np.testing.assert_array_equal(episode.observations, observations)
        np.testing.assert_array_equal(episode.rewards, rewards)
        np.testing.assert_array_equal(episode.terminations, terminations)
        np.testing.assert_array_equal(episode.truncations, truncations)
        assert episode.infos["reward_terms"].keys() == terms.keys()
        for name, term in terms.items():
            # Minari stores the info of the reset, too.
            np.testing.assert_array_equal(episode.infos["reward_terms"][name], np.append(0.0, term))
    if settings.setup == TICK:
        assert any(episode.terminations[-1] for episode in dataset)
    assert verify(ID) == 4
    assert data.open(ID).settings == settings


@pytest.mark.slow
def test_a_body_of_a_file_is_recovered_without_the_file_in_another_process():
    collect(ID, data.DatasetSettings(SPIDER, **SHORT), 1)
    code = f"import minari; e = minari.load_dataset({ID!r}).recover_environment(); print(e.reset(seed=10_005)[0].sum())"
    (total,) = interpreters.printed(code, options=("-W", "error"))
    assert float(total) == data.open(ID)[0].observations[0].sum()


def test_normalized_scores_run_from_the_zero_policy_to_the_gaits_best():
    collect(ID, data.DatasetSettings(QUEEN, "zero", (), steps=30), 10)
    dataset = minari.load_dataset(ID)
    totals = [episode.rewards.sum() for episode in dataset]
    # Other episodes than those of evaluation, whose mean is the zero of scores.
    assert minari.get_normalized_score(dataset, np.mean(totals)) == pytest.approx(0.0, abs=0.02)
    assert minari.get_normalized_score(dataset, 4.0 * 30) == 1.0


def test_the_best_normalized_score_is_that_of_a_shorter_time_limit():
    setup = Setup.of("queen", "walk", {"time_limit": 2.0})
    for steps, length in ((1000, 40), (30, 30)):
        collect(ID, data.DatasetSettings(setup, "zero", (), steps=steps), 1, overwrite=True)
        assert len(data.open(ID)[0].actions) == length
        assert data.open(ID).metadata["ref_max_score"] == 4.0 * length


COLLECTED = {
    "presets and noise": data.DatasetSettings(QUEEN, "cpg", ("slow", "medium", "fast"), noise=0.1, **SHORT),
    "spider": data.DatasetSettings(SPIDER, "cpg", ("medium", "fast"), **SHORT),
    "random": data.DatasetSettings(TICK, "random", (), steps=60),
    "own": data.DatasetSettings(TICK, "own:make", (), noise=0.2, **SHORT),
}


@pytest.mark.parametrize("name", tiers(COLLECTED, never, lambda name: name in ("presets and noise", "own")))
def test_episodes_depend_on_seed_and_settings_alone(name):
    settings = COLLECTED[name]
    collect(ID, settings, 7, num_envs=7, threads=1)
    expected = digests()
    for other, num_envs, threads in (("a", 1, 1), ("b", 3, 2), ("c", 100, 4)):
        collect(f"{ID[:-3]}-{other}-v0", settings, 7, num_envs=num_envs, threads=threads)
        assert digests(f"{ID[:-3]}-{other}-v0") == expected
    later = settings._replace(seed=settings.seed + 4)
    collect(f"{ID[:-3]}-later-v0", later, 3)
    assert digests(f"{ID[:-3]}-later-v0") == expected[4:]
    assert len(set(expected)) == 7


@pytest.mark.slow
def test_every_setting_matters():
    base = data.DatasetSettings(QUEEN, **SHORT)
    changes = ({}, {"noise": 0.1}, {"presets": ("fast",)}, {"policy": "zero", "presets": ()})
    seen = set()
    for number, change in enumerate(changes):
        collect(f"{ID[:-3]}-{number}-v0", base._replace(**change), 1)
        seen.add(data.open(f"{ID[:-3]}-{number}-v0")[0].actions.tobytes())
    assert len(seen) == len(changes)


def test_noise_is_normal_and_differs_from_episode_to_episode():
    settings = data.DatasetSettings(QUEEN, "zero", (), noise=0.1, steps=40)
    collect(ID, settings, 2)
    first, second = (episode.actions for episode in data.open(ID))
    for noise in (first, second):
        assert abs(noise.mean()) < 0.02
        assert 0.09 < noise.std() < 0.11
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.15


def test_more_episodes_continue_and_a_finished_dataset_stays_as_it_is(root):
    settings = data.DatasetSettings(QUEEN, **SHORT)
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


@pytest.mark.slow
def test_another_dataset_under_the_id_is_refused_and_overwritten_at_will(kept):
    before = digests()
    for changed, difference in (
        (SETTINGS._replace(noise=0.5), "its noise is 0.0, and not 0.5"),
        (SETTINGS._replace(seed=10_001), "its seed is 10005, and not 10001"),
        (SETTINGS._replace(presets=("fast", "medium")), "its presets is ['medium'], and not ['fast', 'medium']"),
        (SETTINGS._replace(setup=TICK), "its robot is 'queen', and not 'tick'"),
        (SETTINGS._replace(setup=Setup.of("queen", "steer")), "its task is 'walk', and not 'steer'"),
        (SETTINGS._replace(setup=WAVE), "its task_kwargs.gait is None, and not 'wave'"),
    ):
        with refused(f"dataset {ID!r} is another: {difference}; overwrite=True (--overwrite) replaces it"):
            collect(ID, changed, 2)
        assert digests() == before

    def watched(*args, **kwargs):  # while the new episodes are played, the old ones are there
        assert digests() == before
        return quiet(*args, **kwargs)

    data.collect(ID, SETTINGS._replace(seed=10_006), 3, overwrite=True, progress=watched)
    assert digests()[0] == before[1]
    assert len(data.open(ID)) == 3
    assert [path.name for path in (kept / ID).parent.iterdir() if path.is_dir()] == ["some-v0"]


def test_the_field_that_differs_in_a_body_of_the_same_name_is_named():
    settings = data.DatasetSettings(Setup.of(generator.generate(5, 3)), **SHORT)
    collect(ID, settings, 1)
    changed = settings._replace(
        setup=Setup.of(dataclasses.replace(generator.generate(5, 3), palette="#3a5f2b,#d8c48a"))
    )
    line = "its robot.palette is None, and not '#3a5f2b,#d8c48a'; overwrite=True (--overwrite) replaces it"
    with refused(f"dataset {ID!r} is another: {line}"):
        collect(ID, changed, 2)


@pytest.mark.slow
def test_numbers_of_a_preset_that_changed_under_its_name_are_noticed(monkeypatch):
    settings = data.DatasetSettings(QUEEN, presets=("slow", "medium"), **SHORT)
    collect(ID, settings, 2)
    before, medium = digests(), PRESETS["queen"]["medium"]
    for changed in (medium._replace(stiffness=0.81), medium._replace(center=medium.center | {"ankle": (15, 30, -14)})):
        monkeypatch.setitem(PRESETS["queen"], "medium", changed)
        line = "its presets slow and medium had other numbers; overwrite=True (--overwrite) replaces it"
        with refused(f"dataset {ID!r} is another: {line}"):
            collect(ID, settings, 3)
        assert digests() == before
        assert verify(ID) == 2  # what was done can still be done
    monkeypatch.setitem(PRESETS["queen"], "medium", medium)
    monkeypatch.setitem(PRESETS["queen"], "fast", changed)  # which is none of the dataset's
    assert collect(ID, settings, 3) == 1


@pytest.mark.parametrize("kind", ["a policy file", "a function"])
def test_another_policy_under_the_name_of_the_first_is_refused(tmp_path, kind):
    file = tmp_path / "mine.npz"
    name = str(file)
    contents = [PACKAGED / "tick-walk.npz", PACKAGED / "tick-steer.npz"]
    if kind == "a function":
        file = tmp_path / "mine.py"
        name = f"{file}:make"
        contents = [tmp_path / "still.py", tmp_path / "lifted.py"]
        for path, action in zip(contents, (0.0, 1.0), strict=True):
            path.write_text(f"import numpy as np\ndef make(robot): return lambda timestep: np.full(18, {action})\n")
    settings = data.DatasetSettings(TICK, name, **SHORT)
    shutil.copy(contents[0], file)
    assert collect(ID, settings, 1) == 1
    assert collect(ID, settings, 2) == 1
    first_sha256 = data.open(ID).metadata["arc_suite"]["policy_sha256"]
    shutil.copy(contents[1], file)
    second_sha256 = provenance.policy_sha256(name)
    difference = f"its policy_sha256 is '{first_sha256}', and not '{second_sha256}'"
    with refused(f"dataset {ID!r} is another: {difference}", begins=True):
        collect(ID, settings, 3)
    assert len(data.open(ID)) == 2


def test_a_dataset_from_before_hashes_of_policy_files_goes_on(root):
    settings = data.DatasetSettings(TICK, str(PACKAGED / "tick-walk.npz"), **SHORT)
    collect(ID, settings, 1)
    edited(root, lambda metadata: metadata["arc_suite"].pop("policy_sha256"))
    assert collect(ID, settings, 2) == 1


def test_numbers_of_numpy_are_those_of_python():
    settings = data.DatasetSettings(TICK, "zero", noise=np.float32(0.5), seed=np.int64(20_000), steps=np.int32(5))
    assert collect(ID, settings, np.int64(2), num_envs=np.int64(2)) == 2
    same_settings = data.DatasetSettings(TICK, "zero", noise=0.5, seed=20_000, steps=5)
    assert data.open(ID).settings == same_settings
    assert collect(ID, same_settings, 2) == 0


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ({"episodes": 2.5}, "episodes: expected an integer from 0, got 2.5"),
        ({"episodes": -1}, "episodes: expected an integer from 0, got -1"),
        ({"episodes": 2, "num_envs": 0}, "num_envs: expected an integer from 1, got 0"),
    ],
)
def test_wrong_counts_leave_nothing_behind(root, counts, message):
    with refused(message, begins=True):
        collect(ID, SETTINGS, **counts)
    assert not root.exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"policy": "zero", "presets": ("medium",)}, "preset 'medium': goes with the policy cpg, got 'zero'"),
        ({"seed": 10_000.5}, "seed of the first of 2 episodes: expected an integer from 10000 to 99998, got 10000.5"),
        ({"presets": ("fats",)}, "unknown preset 'fats'; did you mean 'fast'?"),
        ({"policy": "cgp", "presets": ()}, "unknown policy 'cgp'; did you mean 'cpg'?"),
        ({"policy": "nowhere:make", "presets": ()}, "policy 'nowhere:make': No module named 'nowhere'"),
        ({"noise": float("nan")}, "noise: expected a finite number of at least 0, got nan"),
        ({"steps": 0}, "steps: expected an integer from 1, got 0"),
        ({"setup": Setup.of("queen", task_kwargs={"gaits": "wave"})}, "unknown setting of walk 'gaits'; did you mean "),
        ({"seed": 9999}, "seed of the first of 2 episodes: expected an integer from 10000 to 99998, got 9999"),
        ({"seed": 99_999}, "seed of the first of 2 episodes: expected an integer from 10000 to 99998, got 99999"),
    ],
)
def test_wrong_settings_leave_nothing_behind(root, changes, message):
    with refused(message, begins=True):
        collect(ID, data.DatasetSettings(QUEEN)._replace(**changes), 2)
    assert not root.exists()
