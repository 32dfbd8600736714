"""Datasets, opened to be read; those that are damaged are one line, and nothing is lost."""

import hashlib
import os

import minari
import numpy as np
import pytest
from datasets import ID, QUEEN, SETTINGS, SHORT, TICK, collect, digests, edited, verify
from refusals import refused
from tiers import tiers

from arc_suite import data, style, versions
from arc_suite.cpg.presets import PRESETS


def test_metadata():
    settings = data.DatasetSettings(QUEEN, "cpg", ("slow", "fast"), 0.1, seed=10_007, steps=20)
    collect(ID, settings, 3)
    dataset = data.open(ID)
    assert dataset.settings == settings and len(dataset) == 3
    about = dataset.metadata["arc_suite"]
    assert about["versions"] == versions.dependency_versions()
    assert len(about["physics_sha256"]) == 64
    told = {"policy": "cpg", "presets": ["slow", "fast"], "noise": 0.1, "seed": 10_007, "steps": 20}
    told |= {"robot": "queen", "task": "walk", "task_kwargs": {}, "task_version": 0}
    assert {name: about[name] for name in about if not name.endswith(("versions", "_sha256"))} == told
    numbers = [repr(PRESETS["queen"][name]) for name in ("slow", "fast")]
    assert about["presets_sha256"] == [hashlib.sha256(text.encode()).hexdigest() for text in numbers]
    summaries = dataset.summaries()
    assert [summary["preset"] for summary in summaries] == ["fast", "slow", "fast"]  # of seeds 10,007 to 10,009
    for summary, episode in zip(summaries, dataset, strict=True):
        assert (summary["seed"], summary["preset"]) == (episode.seed, episode.preset)
        assert summary["length"] == summary["total_steps"] == episode.length == 20
        assert summary["return"] == episode.total == episode.rewards.sum()
        assert summary["sha256"] == episode.digest()
    assert list(minari.list_local_datasets()) == [ID]


def test_a_slice_is_a_list_of_episodes(kept):
    dataset = data.open(ID)
    sha256s = digests()
    for part in (slice(0, 2), slice(None, None, -1), slice(-1, None), slice(5, 9)):
        assert [episode.digest() for episode in dataset[part]] == sha256s[part]
    assert dataset[-1].digest() == dataset[np.int64(len(dataset) - 1)].digest() == sha256s[-1]
    with pytest.raises(IndexError):
        dataset[len(dataset)]


def test_style_records_a_dataset(kept):
    dataset = data.open(ID)
    environment = dataset.settings.setup.load()
    for episode in dataset:
        playback = episode.playback()
        for _ in range(2):  # the reset rewinds it
            track = style.record(environment, playback, episode.seed, max_steps=episode.length)
            np.testing.assert_array_equal(track.rewards, episode.rewards)
    after = style.record(environment, playback, episode.seed, max_steps=22)
    assert not after.actions[20:].any()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "value"), [("versions", 1), ("versions", None), ("physics_sha256", 1)])
def test_metadata_that_do_not_tell_all_are_damage(kept, name, value):
    edited(kept, lambda metadata: metadata["arc_suite"].update({name: value}))
    for use in (verify, data.open, lambda dataset_id: collect(dataset_id, SETTINGS, 2)):
        with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*metadata.json: .*{name}"):
            use(ID)


def test_a_dataset_of_an_earlier_version_goes_on(kept):
    """It has a hash of the model that differed among processors, in place of that of the physics."""

    def make_earlier(metadata):
        metadata["arc_suite"]["model_sha256"] = metadata["arc_suite"].pop("physics_sha256")

    edited(kept, make_earlier)
    assert verify(ID) == 2
    collect(ID, SETTINGS, 3)
    assert verify(ID) == 3


def test_episodes_without_metadata_are_not_continued_as_others(kept):
    (kept / ID / "data" / "metadata.json").unlink()
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*metadata.json: "):
        collect(ID, data.DatasetSettings(TICK, **SHORT), 3)


@pytest.mark.parametrize("name", ["main_data.hdf5", "metadata.json"])
@pytest.mark.parametrize("length", tiers([0, 100], lambda length: length == 100))
def test_a_truncated_file_is_one_line_and_overwrite_mends_it(kept, name, length):
    before, path = digests(), kept / ID / "data" / name
    os.truncate(path, length)
    for use in (verify, lambda dataset_id: collect(dataset_id, SETTINGS, 3)):
        with refused(f"dataset {ID!r} is damaged: {path}: ", begins=True):
            use(ID)
    collect(ID, SETTINGS, 2, overwrite=True)
    assert digests() == before
