"""Sources of tracks: policies, files and datasets."""

import pytest
from synthetic import assert_same

import arc_suite
from arc_suite import data, style
from arc_suite.policies import policy
from arc_suite.robots import ROBOTS, generator
from arc_suite.style import record, source
from arc_suite.tasks import walk

BODY = generator.generate(5, 2)
SETTINGS = data.Settings(ROBOTS["leaper"], "cpg", ("medium",), noise=0.1, seed=7, steps=30)


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


def take(opened, body, seeds):
    return [made() for made in opened.takes(body, seeds)]


def test_policies_walk_any_body_once_for_each_seed():
    opened = source("zero")
    assert (opened.label, opened.body) == ("zero", None)
    for body in (ROBOTS["tick"], BODY):
        tracks = take(opened, body, (5, 6))
        assert [(track.body, track.seed) for track in tracks] == [(body, 5), (body, 6)]
        assert not tracks[0].actions.any()
    assert source("cpg", "fast").label == "cpg fast"


def test_files_have_the_tracks_that_they_have(leaper, saved):
    opened = source(str(saved))
    assert (opened.label, opened.body) == ("leaper.npz", ROBOTS["leaper"])
    for count, expected in ((1, 1), (2, 2), (10, 2)):
        tracks = take(opened, ROBOTS["leaper"], range(count))
        assert len(tracks) == expected
        assert_same(tracks[-1], leaper[expected - 1])


def test_what_is_no_source_is_refused_before_any_work(saved):
    for arguments, message in (
        (("cgp",), "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random)"),
        (("cpg", "fats"), "unknown preset 'fats'; did you mean 'fast'? (there are: "),
        (("none.npz",), "cannot read none.npz: no such file or directory"),
    ):
        with pytest.raises((ValueError, OSError)) as error:
            source(*arguments)
        assert str(error.value).startswith(message)
    for body, other in ((ROBOTS["tick"], "leaper"), (ROBOTS["leaper"].replace(density=7.0), "another body")):
        with pytest.raises(ValueError, match=f"^{saved}: expected tracks of {body.name}, got those of {other}"):
            source(str(saved)).takes(body, (0,))


def test_datasets_are_replayed(dataset):
    opened = source(dataset.id)
    assert (opened.label, opened.body) == (dataset.id, ROBOTS["leaper"])
    assert len(opened.takes(ROBOTS["leaper"], range(1))) == 1
    tracks = take(opened, ROBOTS["leaper"], range(10))
    assert [track.seed for track in tracks] == [7, 8]
    for track, episode in zip(tracks, dataset, strict=True):
        assert_same(track.actions, episode.actions.astype(float))
        assert_same(track.rewards, episode.rewards)
        assert_same(track.terms, {name: episode.terms[name] for name in track.terms})


def test_a_replay_that_differs_is_one_line(dataset, monkeypatch):
    monkeypatch.setitem(walk.WEIGHTS, "healthy", 0.5)
    with pytest.raises(ValueError) as error:
        take(source(dataset.id), ROBOTS["leaper"], range(1))
    assert str(error.value).startswith(f"dataset {dataset.id!r}: episode 0 earned ")
    assert str(error.value).endswith(f"; tools/collect.py --verify={dataset.id} tells more")


def test_datasets_that_cannot_be_replayed_are_one_line(dataset):
    with pytest.raises(ValueError, match=f"^{dataset.id}: expected tracks of tick, got those of leaper$"):
        source(dataset.id).takes(ROBOTS["tick"], range(1))
    for name, message in (
        ("arc_suite/leaper/niosy-v0", f"unknown dataset 'arc_suite/leaper/niosy-v0'; did you mean {dataset.id!r}?"),
        ("noisy-v0", "unknown dataset 'noisy-v0'; did you mean"),
        ("arc_suite/leaper/noisy", "dataset id 'arc_suite/leaper/noisy': expected "),
    ):
        with pytest.raises(ValueError) as error:
            source(name)
        assert str(error.value).startswith(message)
    (dataset.path / "data" / "main_data.hdf5").write_bytes(b"HDF")
    with pytest.raises(ValueError, match="is damaged"):
        take(source(dataset.id), ROBOTS["leaper"], range(1))
