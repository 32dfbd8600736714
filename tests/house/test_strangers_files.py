"""Each kind of damage to a stranger's file is read, or refused in one line, within seconds; see `make check-fuzz`."""

import os

import damages
import fuzz
import pytest

# Kinds of files whose damage takes no time, and those that `make check-release` damages.
QUICK = ("robot in MJCF", "robot in URDF", "mesh in STL", "journal of a search")
OTHERS = (
    *("imported body", "policy", "tracks", "motion", "motion in glTF", "JSON of a motion in glTF", "motion in BVH"),
    "motion in CSV",
    *("mesh in OBJ", "header of a policy", "zip of another library", "snapshot", "journal of a design"),
    *("config.json of a run", "checkpoint.npz of a run", "evaluations.csv of a run", "scores of a benchmark"),
    *("runs.csv of a study", "metadata of a dataset", "episodes of a dataset"),
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path


@pytest.mark.parametrize("label", [*QUICK, *(pytest.param(label, marks=pytest.mark.release) for label in OTHERS)])
def test_every_kind_of_damage_is_read_or_one_line(label, folder, capfd):
    kind = fuzz.KINDS[label]
    outcomes = fuzz.fuzz(kind, cases=3, seed=5, label=label)
    assert outcomes.total() == outcomes[fuzz.READ] + outcomes[fuzz.REFUSED], capfd.readouterr().err
    assert outcomes[fuzz.REFUSED] > 0


@pytest.mark.parametrize("table", ["MJCF", "URDF", "IMPORTED", "ARCHIVES", "GRAPHS", "EPISODES"])
def test_tables_have_enough_kinds(table):
    assert len(getattr(damages, table)) >= 18


def test_work_is_not_done_before_it_is_refused(folder, monkeypatch):
    """The memory of a refused file is that of its bytes."""
    fuzz.KINDS["policy"].make()
    sound = (folder / "policy.npz").read_bytes()
    (folder / "policy.npz").write_bytes(damages.GRAPHS["twelve products of 7000 x 7000"](sound))
    assert os.path.getsize("policy.npz") < 400_000
    monkeypatch.setattr(fuzz, "MAX_MEMORY", 1 << 30)
    assert fuzz.outcome(*fuzz.KINDS["policy"].uses, limit=3.0) == fuzz.REFUSED
