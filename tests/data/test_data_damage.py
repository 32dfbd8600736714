"""Datasets that are damaged, altered or missing: one line each, and nothing is lost."""

import json
import os

import h5py
import minari
import pytest
from datasets import ID, QUEEN, SHORT, TICK, collect, digests, verify

from arc_suite import data
from arc_suite.data import episodes


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """Where Minari keeps datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path / "datasets"


@pytest.mark.parametrize("key", ["observations", "actions", "rewards", "terminations", "truncations", "contact"])
def test_a_bit_that_changed_is_found(root, key):
    collect(ID, data.Settings(QUEEN, "zero", (), **SHORT), 2)
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


@pytest.mark.parametrize("key", ["seed", "preset", "return", "length", "id"])
def test_episode_metadata_that_changed_is_found(root, key):
    collect(ID, data.Settings(QUEEN, **SHORT), 2)
    with h5py.File(root / ID / "data" / "main_data.hdf5", "a") as file:
        attributes = file["episode_0"].attrs
        attributes[key] = attributes[key] + ("x" if key == "preset" else 1)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*: episode_0: expected "):
        verify(ID)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("rewards", "episode 1 differs from its replay: rewards[3]"),
        ("actions", "episode 1 differs from its replay: observations[4]"),
        ("seed", "episode 1 has seed 5, and not 6"),
    ],
)
def test_an_episode_that_is_whole_but_not_what_its_seed_gives_is_found(root, key, message):
    collect(ID, data.Settings(QUEEN, "zero", (), **SHORT), 2)
    with h5py.File(root / ID / "data" / "main_data.hdf5", "a") as file:
        episode = episodes.read(file, 1)
        if key == "seed":
            episode = episode._replace(seed=5)
        else:
            getattr(episode, key)[3] += 0.25
        del file["episode_1"]
        episodes.write(file, 1, episode)
    with pytest.raises(ValueError) as error:
        verify(ID)
    assert str(error.value) == f"dataset {ID!r}: {message}"


def edited(root, change):
    path = root / ID / "data" / "metadata.json"
    metadata = json.loads(path.read_text())
    change(metadata)
    path.write_text(json.dumps(metadata))


def test_another_version_or_model_is_refused(root):
    settings = data.Settings(QUEEN, **SHORT)
    collect(ID, settings, 2)
    edited(root, lambda metadata: metadata["arc_suite"].update(model_sha256="0" * 64))
    with pytest.raises(ValueError, match=f"^dataset '{ID}' was collected with another model of queen$"):
        verify(ID)
    with pytest.raises(ValueError, match="is another: the sha256 of its model is 000000000000, and not [0-9a-f]{12}; "):
        collect(ID, settings, 3)
    edited(root, lambda metadata: metadata["arc_suite"]["versions"].update(mujoco="3.16.0"))
    with pytest.raises(ValueError, match=f"^dataset '{ID}' was collected with mujoco 3.16.0; 3.17.* is installed$"):
        verify(ID)
    with pytest.raises(ValueError, match="is another: its mujoco is '3.16.0', and not '3.17"):
        collect(ID, settings, 3)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' holds episodes of queen, and not of tick$"):
        verify(ID, TICK)
    edited(root, lambda metadata: metadata.pop("arc_suite"))
    for use in (verify, data.open, lambda dataset_id: collect(dataset_id, settings, 3)):
        with pytest.raises(ValueError, match=f"^dataset '{ID}' was not collected by arc_suite$"):
            use(ID)
    assert len(minari.load_dataset(ID)) == 2


@pytest.mark.parametrize("name", ["settings", "versions", "model_sha256"])
def test_metadata_that_do_not_tell_all_are_damage(root, name):
    settings = data.Settings(QUEEN, **SHORT)
    collect(ID, settings, 1)
    for change in (lambda about: about.update({name: 1}), lambda about: about.pop(name)):
        edited(root, lambda metadata, change=change: change(metadata["arc_suite"]))
        for use in (verify, data.open, lambda dataset_id: collect(dataset_id, settings, 2)):
            with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*metadata.json: .*{name}"):
                use(ID)


def test_episodes_without_metadata_are_not_continued_as_others(root):
    collect(ID, data.Settings(QUEEN, **SHORT), 2)
    (root / ID / "data" / "metadata.json").unlink()
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: .*metadata.json: "):
        collect(ID, data.Settings(TICK, **SHORT), 3)


@pytest.mark.parametrize("name", ["main_data.hdf5", "metadata.json"])
@pytest.mark.parametrize("length", [0, 100])
def test_a_truncated_file_is_one_line_and_overwrite_mends_it(root, name, length):
    settings = data.Settings(QUEEN, **SHORT)
    collect(ID, settings, 2)
    before, path = digests(), root / ID / "data" / name
    os.truncate(path, length)
    for use in (verify, lambda dataset_id: collect(dataset_id, settings, 3)):
        with pytest.raises(ValueError) as error:
            use(ID)
        assert str(error.value).startswith(f"dataset {ID!r} is damaged: {path}: ")
        assert "\n" not in str(error.value)
    collect(ID, settings, 2, overwrite=True)
    assert digests() == before


def test_a_folder_that_cannot_be_made_is_named(root):
    (root / ID).mkdir(parents=True)
    (root / ID / "data").touch()
    with pytest.raises(OSError) as error:
        collect(ID, data.Settings(QUEEN, **SHORT), 1)
    assert str(error.value) == f"cannot make folder {root / ID / 'data'}: file exists"


def test_unknown_ids():
    with pytest.raises(ValueError, match=f"^unknown dataset '{ID}': there are none in "):
        data.open(ID)
    collect(ID, data.Settings(QUEEN, **SHORT), 1)
    with pytest.raises(ValueError) as error:
        data.open("arc_suite/test/same-v0")
    assert str(error.value) == f"unknown dataset 'arc_suite/test/same-v0'; did you mean {ID!r}? (there are: {ID})"
    other = "arc_suite/queen/walk/cpg-medium-v0"
    for wrong, example in ((ID[:-3], ID), (f"{ID}/inner-v0", other), ("../some-v0", other), ("", other)):
        with pytest.raises(ValueError) as error:
            data.open(wrong)
        assert str(error.value) == (
            f"dataset id {wrong!r}: expected names of letters, digits, '-' and '_' with '/' between and a version "
            f"at the end alone, such as {example!r}"
        )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"presets": ("fats",)}, "unknown preset 'fats'; did you mean 'fast'?"),
        ({"presets": ()}, "preset: expected one or more of slow, medium, fast"),
        ({"policy": "cgp", "presets": ()}, "unknown policy 'cgp'; did you mean 'cpg'?"),
        ({"policy": "nowhere:make", "presets": ()}, "policy 'nowhere:make': No module named 'nowhere'"),
        ({"noise": float("nan")}, "noise: expected a number from 0, got nan"),
        ({"seed": 2**32 - 1}, "seed: expected an integer from 0 to 4294967295, got 4294967296"),
    ],
)
def test_wrong_settings_leave_nothing_behind(root, changes, message):
    with pytest.raises(ValueError) as error:
        collect(ID, data.Settings(QUEEN)._replace(**changes), 2)
    assert str(error.value).startswith(message)
    assert not root.exists()
