"""Sources of tracks: policies, files and datasets."""

import json

import numpy as np
import pytest
from refusals import refused
from synthetic import assert_same

import arc_suite
from arc_suite import data, style
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.policies import policy
from arc_suite.robots import ROBOTS
from arc_suite.style import record, source
from arc_suite.tasks import walk

BODY = generator.generate(5, 2)
SETTINGS = data.DatasetSettings(Setup.of("leaper"), "cpg", ("medium",), noise=0.1, seed=10_007, steps=30)


@pytest.fixture(scope="module")
def leaper():
    environment = arc_suite.load("leaper", "walk")
    return [record(environment, policy("cpg", "leaper"), seed, 12) for seed in (3, 4)]


@pytest.fixture(scope="module")
def saved(leaper, tmp_path_factory):
    path = tmp_path_factory.mktemp("tracks") / "leaper.npz"
    style.save(path, leaper)
    return path


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    data.collect("arc_suite/leaper/noisy-v0", SETTINGS, episodes=2)
    return data.open("arc_suite/leaper/noisy-v0")


LEAPER, TICK = Setup.of("leaper"), Setup.of("tick")


def take(opened, setup, seeds):
    return [recorder() for recorder in opened.recorders(setup, seeds)]


def test_a_file_may_have_its_extension_in_capitals(leaper, tmp_path):
    path = tmp_path / "LEAPER.NPZ"
    style.save(path, leaper)
    for track, before in zip(take(source(str(path)), LEAPER, (3, 4)), leaper, strict=True):
        assert_same(track, before)


def test_policies_walk_any_body_once_for_each_seed():
    opened = source("zero")
    assert (opened.label, opened.setup) == ("zero", None)
    for setup in (
        Setup.of("tick", "walk", {"time_limit": 1.0}),
        Setup.of(BODY, "steer", {"time_limit": 1.0, "arena": "bumps"}),
    ):
        tracks = take(opened, setup, (5, 6))
        assert [(track.setup, track.seed) for track in tracks] == [(setup, 5), (setup, 6)]
        assert not tracks[0].actions.any()
    assert source("cpg", "fast").label == "cpg fast"


def test_files_have_the_tracks_that_they_have(leaper, saved):
    opened = source(str(saved))
    assert (opened.label, opened.setup) == ("leaper.npz", LEAPER)
    for count, expected in ((1, 1), (2, 2), (10, 2)):
        tracks = take(opened, LEAPER, range(count))
        assert len(tracks) == expected
        assert_same(tracks[-1], leaper[expected - 1])


def test_what_is_no_source_is_refused_before_any_work(saved):
    for arguments, message in (
        (("cgp",), "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random, ppo, universal)"),
        (("cpg", "fats"), "unknown preset 'fats'; did you mean 'fast'? (there are: "),
        (("none.npz",), "cannot read none.npz: no such file or directory"),
    ):
        with refused(message, (ValueError, OSError), begins=True):
            source(*arguments)
    for body, other in ((ROBOTS["tick"], "leaper"), (ROBOTS["leaper"].replace(density=7.0), "another body")):
        with pytest.raises(ValueError, match=f"^{saved}: expected tracks of {body.name}, got those of {other}"):
            source(str(saved)).recorders(Setup.of(body), (0,))
    colored = Setup.of(ROBOTS["leaper"].replace(palette="coral"))
    assert len(source(str(saved)).recorders(colored, (0,))) == 1
    for arguments, text in ((("steer",), "steer"), (("walk", {"arena": "bumps"}), 'walk, {"arena": "bumps"}')):
        with refused(f"{saved}: expected tracks of leaper, {text}, got those of leaper, walk"):
            source(str(saved)).recorders(Setup.of("leaper", *arguments), (0,))


def test_stored_tracks_tell_their_setup(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    offsets = (0.0, 3.0, 0.0, 3.0, 0.0, 3.0)
    setup = Setup.of("tick", "steer", {"phase_offsets": offsets, "arena": "bumps"})
    style.save(tmp_path / "tick.npz", [record(setup.load(), policy("cpg", "tick"), 0, 5)])
    data.collect("arc_suite/tick/steers-v0", data.DatasetSettings(setup, steps=5), episodes=1)
    for name in (str(tmp_path / "tick.npz"), "arc_suite/tick/steers-v0"):
        assert source(name).setup == setup
        (track,) = take(source(name), setup, range(1))
        assert (track.setup, len(track.times)) == (setup, 5)


def test_datasets_are_replayed(dataset):
    opened = source(dataset.id)
    assert (opened.label, opened.setup) == (dataset.id, LEAPER)
    assert len(opened.recorders(LEAPER, range(1))) == 1
    tracks = take(opened, LEAPER, range(10))
    assert [track.seed for track in tracks] == [10_007, 10_008]
    for track, episode in zip(tracks, dataset, strict=True):
        assert_same(track.actions, episode.actions.astype(float))
        assert_same(track.rewards, episode.rewards)
        assert_same(track.terms, {name: episode.terms[name] for name in track.terms})


def test_a_replay_that_differs_is_one_line(dataset, monkeypatch):
    monkeypatch.setitem(walk.Walk.weights, "healthy", 0.5)
    line = f"^dataset {dataset.id!r}: episode 0 earned .*; arc-suite collect --verify={dataset.id} shows more$"
    with pytest.raises(ValueError, match=line):
        take(source(dataset.id), LEAPER, range(1))


def test_datasets_that_cannot_be_replayed_are_one_line(dataset):
    with pytest.raises(ValueError, match=f"^{dataset.id}: expected tracks of tick, got those of leaper$"):
        source(dataset.id).recorders(TICK, range(1))
    for name, message in (
        ("arc_suite/leaper/niosy-v0", f"unknown dataset 'arc_suite/leaper/niosy-v0'; did you mean {dataset.id!r}?"),
        ("noisy-v0", "unknown dataset 'noisy-v0' (there are: arc_suite/leaper/noisy-v0)"),
        ("arc_suite/leaper/noisy", "cannot read arc_suite/leaper/noisy: no such file; the id "),
    ):
        with refused(message, (ValueError, OSError), begins=True):
            source(name)
    (dataset.path / "data" / "main_data.hdf5").write_bytes(b"HDF")
    with pytest.raises(ValueError, match="is damaged"):
        take(source(dataset.id), LEAPER, range(1))


def test_tracks_import_nothing(leaper, tmp_path, monkeypatch):
    (tmp_path / "strolling.py").write_text("import pathlib; pathlib.Path(__file__).with_name('imported').touch()")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "tracks.npz"
    for change in ({"task": "strolling:walk"}, {"task_kwargs": {"arena": "strolling:flat"}}):
        style.save(path, leaper)
        with np.load(path) as stored:
            arrays = dict(stored)
        arrays["setup"] = json.dumps(LEAPER.to_dict() | change)
        np.savez(path, **arrays)
        with pytest.raises(ValueError, match=f"^{path}: .*: files import nothing; import 'strolling' first$"):
            source(str(path))
    assert not (tmp_path / "imported").exists()
