"""Tracks on disk, bit-equal."""

import errno
import functools
import io
import zipfile

import gaitless
import numpy as np
import pytest
from refusals import refused
from synthetic import assert_same

import arc_suite
from arc_suite import style
from arc_suite.arenas import FLAT
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.policies import Script, policy
from arc_suite.style import load, record, save

BODY = generator.generate(5, 2)


def recorded(body, seeds=(3,), steps=12, task="walk", **settings):
    environment = arc_suite.load(body, task, settings)
    return [record(environment, policy("cpg", body), seed, steps) for seed in seeds]


@pytest.fixture(scope="module")
def leaper():
    return recorded("leaper", seeds=(3, 4))


@pytest.fixture(scope="module")
def saved(leaper, tmp_path_factory):
    path = tmp_path_factory.mktemp("tracks") / "leaper.npz"
    save(path, leaper)
    return path


def test_names_of_metrics_may_have_slashes(leaper, tmp_path):
    """As tasks of other packages give them: `distance/ahead` beside `distance`."""
    tracks = [track._replace(progress=track.progress | {"distance/ahead": 1.5, "a/b/c": 2.0}) for track in leaper]
    save(tmp_path / "tracks.npz", tracks)
    for track, loaded in zip(tracks, load(tmp_path / "tracks.npz"), strict=True):
        assert_same(track, loaded)


@pytest.mark.parametrize("task", ["walk", "steer", "directed"])
@pytest.mark.parametrize("body", ["queen", BODY], ids=["queen", "made"])
def test_tracks_survive_the_way_there_and_back(body, task, tmp_path):
    settings = {"arena": "bumps", "gait": "ripple", "weights": {"posture": -1e-9}}
    tracks = recorded(body, (0, 2**32 - 1), task=task, **settings)
    assert tracks[0].setup == Setup.of(body, task, settings)
    save(tmp_path / "tracks.npz", tracks)
    loaded = load(str(tmp_path / "tracks.npz"))
    assert len(loaded) == 2
    for track, before in zip(loaded, tracks, strict=True):
        assert_same(track, before)
        assert_same(track.rewards, before.rewards)
    assert style.measure(loaded[0]).keys() == style.METRICS.keys()


def test_tracks_of_a_task_without_a_gait_survive_too(tmp_path):
    with gaitless.registered():
        tracks = recorded("leaper", task="stay", weights={"control": -0.1})
        save(tmp_path / "tracks.npz", tracks)
        (track,) = load(tmp_path / "tracks.npz")
    assert tracks[0].phases is tracks[0].parameters is None
    assert_same(track, tracks[0])
    assert style.report([track])["metrics"].keys() == style.report(tracks)["metrics"].keys()


def test_tracks_of_a_generator_are_saved_and_reported(leaper, saved, tmp_path):
    save(tmp_path / "tracks.npz", (track for track in leaper))
    for track, before in zip(load(tmp_path / "tracks.npz"), leaper, strict=True):
        assert_same(track, before)
    assert_same(style.report(track for track in leaper), style.report(leaper))


def test_a_file_says_what_made_it(saved):
    with np.load(saved, allow_pickle=False) as arrays:
        assert arrays["format"] == "arc_suite tracks 4"
        assert '"mujoco": "3.17' in str(arrays["versions"])


def test_seed_and_actions_repeat_a_track(leaper):
    script = Script(lambda seed: leaper[1].actions, 1, 12)
    again = record(arc_suite.load("leaper", "walk"), script, leaper[1].seed, 12)
    assert_same(again, leaper[1])


def test_what_cannot_be_saved_is_refused(leaper, tmp_path):
    for tracks, found in (([], r"\[\]"), (leaper + recorded("tick", steps=2), r"\['leaper, walk', 'tick, walk'\]")):
        with pytest.raises(ValueError, match=f"^tracks: expected those of one setup, got {found}$"):
            save(tmp_path / "a.npz", tracks)
        with pytest.raises(ValueError, match=f"^tracks: expected those of one setup, got {found}$"):
            style.report(tracks)
    with pytest.raises(ValueError, match="^task_kwargs: expected values that JSON can hold: Object of type Flat is"):
        recorded("tick", steps=2, arena=FLAT)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_no_damage_goes_unnoticed(leaper, saved, tmp_path):
    sound, random, path = saved.read_bytes(), np.random.default_rng(0), tmp_path / "damaged.npz"
    for trial in range(300):
        data = bytearray(sound)
        # Half of the trials spare the arrays and hit the archive's directory, which is its end.
        place = len(data) - 1 - random.integers(len(data) if trial % 2 else 12_000)
        if trial % 10:
            data[place] ^= 1 << random.integers(8)
        else:
            del data[place:]
        path.write_bytes(data)
        try:
            loaded = load(path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")
            assert "\n" not in str(error)
        else:
            assert len(loaded) == len(leaper)
            for track, before in zip(loaded, leaper, strict=True):
                assert_same(track, before)


def written(write, *arguments, **arrays):
    """Return the bytes of what a function of NumPy writes into a file."""
    write(file := io.BytesIO(), *arguments, **arrays)
    return file.getvalue()


archive = functools.partial(written, np.savez)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not a file of tracks, or a damaged one: no archive: File is not a zip file"),
        (b"walk", "not a file of tracks, or a damaged one: "),
        (written(np.save, np.zeros(3)), "not a file of tracks, or a damaged one: "),
        (archive(observations=np.zeros(3)), "expected 'arc_suite tracks 4', got 'no tracks'; record them anew"),
        (archive(format="arc_suite tracks 1"), "expected 'arc_suite tracks 4', got 'arc_suite tracks 1'"),
        (archive(format="arc_suite tracks 4"), "not a file of tracks, or a damaged one: 'setup'"),
        (archive(format="arc_suite tracks 4", setup="{}"), "not a file of tracks, or a damaged one: expected robot"),
        (
            archive(format=np.array([print], dtype=object)),
            "not a file of tracks, or a damaged one: format.npy: expected numbers",
        ),
    ],
)
def test_foreign_files_are_one_line(tmp_path, data, message):
    path = tmp_path / "foreign.npz"
    path.write_bytes(data)
    with refused(f"{path}: {message}", begins=True):
        load(path)


@pytest.mark.parametrize("lost", ["contacts", "duty_factors"])
def test_a_file_that_lacks_an_array_is_one_line(saved, tmp_path, lost):
    path = tmp_path / "lacking.npz"
    with zipfile.ZipFile(saved) as whole, zipfile.ZipFile(path, "w") as lacking:
        for name in whole.namelist():
            if name != f"1/{lost}.npy":
                lacking.writestr(name, whole.read(name))
    with pytest.raises(ValueError, match=lost):
        load(path)


def test_files_that_cannot_be_read_are_one_line(tmp_path):
    for path, reason in ((tmp_path / "none.npz", "no such file or directory"), (tmp_path, "is a directory")):
        with pytest.raises(OSError, match=f"^cannot read {path}: {reason}$"):
            load(path)


BAD_ARRAYS = {
    "empty": ("1/positions", np.zeros((0, 3))),
    "no axes": ("1/positions", np.float64(1.0)),
    "short": ("1/contacts", np.zeros((5, 4), bool)),
    "other feet": ("1/foot_heights", np.zeros((12, 3))),
    "text": ("1/torques", np.full((12, 12), "heavy")),
    "complex": ("1/actions", np.zeros((12, 12), complex)),
    "NaN": ("1/joint_angles", np.full((12, 12), np.nan)),
    "infinite term": ("1/terms/forward", np.full(12, np.inf)),
    "short term": ("1/terms/forward", np.zeros(3)),
    "phases of other legs": ("1/leg_phases", np.zeros((12, 3))),
    "one duty factor": ("1/duty_factors", np.float64(0.6)),
    "numbers of feet": ("1/contacts", np.zeros((12, 4))),
    "text of a number": ("1/mass", np.array("heavy")),
    "no mass": ("1/mass", np.float64(0.0)),
    "seed": ("1/seed", np.float64(3.0)),
    "negative seed": ("1/seed", np.int64(-1)),
    "weight of no term": ("1/weights/height", np.float64(1.0)),
    "array of weights": ("1/weights/forward", np.zeros(4)),
    "offsets": ("1/parameters/phase_offsets", np.zeros(3)),
    "texts": ("1/parameters/phase_offsets", np.array(["low"] * 4)),
    "parameter": ("1/parameters/speed", np.float64(1.0)),
    "field": ("1/altitude", np.zeros(12)),
    "setup": ("setup", np.zeros(3)),
    "setup of another type": ("setup", np.array("[1]")),
    "settings": ("setup", np.array('{"robot": "leaper", "task": "walk", "task_kwargs": [1]}')),
    "another body": ("setup", np.array('{"robot": "tick", "task": "walk", "task_kwargs": {}}')),
    "progress of one track": ("1/progress/goals", np.float64(1.0)),
    "deep": ("1/positions/x", np.zeros(12)),
    "index": ("99999999999/seed", np.int64(0)),
    "name": ("one/seed", np.int64(0)),
}


@pytest.mark.parametrize("name", BAD_ARRAYS)
def test_arrays_that_no_track_has_are_one_line(saved, tmp_path, name):
    path = tmp_path / "bad.npz"
    key, array = BAD_ARRAYS[name]
    with np.load(saved) as stored:
        np.savez(path, **dict(stored) | {key: array})
    with refused(f"{path}: not a file of tracks, or a damaged one: ", begins=True):
        load(path)


def header(shape):
    about = {"descr": "<f8", "fortran_order": False, "shape": shape}
    return written(np.lib.format.write_array_header_1_0, about)


@pytest.mark.parametrize("shape", [(1 << 40,), (1 << 20, 1 << 20, 1 << 20), (-1,), (13, 3), ()])
def test_headers_that_claim_what_the_file_does_not_hold_are_one_line(saved, tmp_path, shape):
    path = tmp_path / "claims.npz"
    with zipfile.ZipFile(saved) as whole, zipfile.ZipFile(path, "w") as claims:
        for name in whole.namelist():
            content = whole.read(name)
            claims.writestr(name, header(shape) + content[-288:] if name == "1/positions.npy" else content)
    with pytest.raises(ValueError, match=f"^{path}: not a file of tracks, or a damaged one: "):
        load(path)


def test_a_file_that_cannot_be_written_completely_stays_as_it_is(leaper, tmp_path, monkeypatch):
    path = tmp_path / "leaper.npz"
    save(path, leaper[:1])
    content = path.read_bytes()

    def write_half(file, **arrays):
        file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez", write_half)
    with refused(f"cannot write {path}: no space left on device", OSError):
        save(path, leaper)
    assert path.read_bytes() == content and list(tmp_path.iterdir()) == [path]
