"""Datasets that are altered or of other versions: one line each."""

import h5py
import minari
import pytest
from datasets import ID, QUEEN, SETTINGS, SHORT, TICK, collect, edited, verify
from refusals import refused
from tiers import tiers

from arc_suite import data, versions
from arc_suite.data import episodes


@pytest.mark.parametrize(
    "key",
    tiers(
        ["observations", "actions", "rewards", "terminations", "truncations", "contact"], lambda key: key == "rewards"
    ),
)
def test_a_bit_that_changed_is_found(root, key):
    collect(ID, data.DatasetSettings(QUEEN, "zero", (), **SHORT), 2)
    file = root / ID / "data" / "main_data.hdf5"
    with h5py.File(file) as opened:
        group = opened["episode_1"]
        dataset = group[key] if key in group else group[episodes.TERMS][key]
        place = dataset.id.get_offset() + dataset.dtype.itemsize - 1  # for an action of 0 the sign: physics is the same
        size = dataset.dtype.itemsize
    content = bytearray(file.read_bytes())
    content[place] ^= 1 if size == 1 else 128
    file.write_bytes(content)
    for read in (verify, lambda dataset_id: list(data.open(dataset_id))):
        with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*: episode_1: expected (sha256|return) "):
            read(ID)


@pytest.mark.parametrize("key", tiers(["seed", "preset", "return", "length", "id"], lambda key: key == "seed"))
def test_episode_metadata_that_changed_is_found(kept, key):
    with h5py.File(kept / ID / "data" / "main_data.hdf5", "a") as file:
        attributes = file["episode_0"].attrs
        attributes[key] = attributes[key] + ("x" if key == "preset" else 1)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*: episode_0: expected "):
        verify(ID)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("rewards", "episode 1 differs from its replay: rewards[3]"),
        ("actions", "episode 1 differs from its replay: observations[4]"),
        ("seed", "episode 1 has seed 10005, and not 10006"),
    ],
)
def test_an_episode_that_is_whole_but_not_what_its_seed_gives_is_found(root, key, message):
    collect(ID, data.DatasetSettings(QUEEN, "zero", (), **SHORT), 2)
    with h5py.File(root / ID / "data" / "main_data.hdf5", "a") as file:
        episode = episodes.read(file, 1)
        if key == "seed":
            episode = episode._replace(seed=10_005)
        else:
            getattr(episode, key)[3] += 0.25
        del file["episode_1"]
        episodes.write(file, 1, episode)
    with refused(f"dataset {ID!r}: {message}"):
        verify(ID)


def test_another_version_or_model_is_refused(kept):
    older = versions.dependency_versions() | {"mujoco": "3.16.0"}
    for change, found, difference in (
        ({"physics_sha256": "0" * 64}, "another model of queen", "physics_sha256 is '0{64}', and not '[0-9a-f]{64}'; "),
        ({"task_version": 1}, "version 1 of walk; 0 is installed", "task_version is 1, and not 0; "),
        (
            {"task_version": 0, "versions": older},
            "mujoco 3.16.0; 3.17.* is installed",
            "mujoco is '3.16.0', and not '3.17",
        ),
    ):
        edited(kept, lambda metadata, change=change: metadata["arc_suite"].update(change))
        with pytest.raises(ValueError, match=f"^dataset '{ID}' was collected with {found}$"):
            verify(ID)
        with pytest.raises(ValueError, match=f"is another: its {difference}"):
            collect(ID, SETTINGS, 3)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' holds episodes of queen, and not of tick$"):
        verify(ID, TICK.body)
    edited(kept, lambda metadata: metadata.pop("arc_suite"))
    for use in (verify, data.open, lambda dataset_id: collect(dataset_id, SETTINGS, 3)):
        with pytest.raises(ValueError, match=f"^dataset '{ID}' was not collected by arc_suite$"):
            use(ID)
    assert len(minari.load_dataset(ID)) == 2


def test_datasets_that_minari_combined_are_refused():
    first, second = "arc_suite/queen/walk/first-v0", "arc_suite/queen/walk/second-v0"
    collect(first, SETTINGS, 1)
    collect(second, SETTINGS._replace(seed=10_100), 1)
    minari.combine_datasets([minari.load_dataset(first), minari.load_dataset(second)], "both-v0")
    with refused("dataset 'both-v0' was combined by Minari, which keeps no seeds"):
        data.open("both-v0")
