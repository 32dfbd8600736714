"""Folders of runs: whole whatever happens, and refused in one line where they do not fit."""

import json
import os

import numpy as np
import pytest
from refusals import refused

from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.run_folder import open_run

CONFIG = {"robot": "tick", "hyperparameters": {"hidden": 4, "batch": 8}, "seed": 0, "versions": {"numpy": "2"}}
ARRAYS = {"state/weight": np.arange(6.0, dtype=np.float32).reshape(2, 3), "count": np.array([3, 4])}


@pytest.fixture
def path(tmp_path):
    """A folder with a checkpoint after two lines of a table, and a third line after that."""
    with open_run(tmp_path / "run", CONFIG) as folder:
        folder.append("training", {"step": 1, "loss": 0.5})
        folder.append("training", {"step": 2, "loss": np.float32(0.25)})
        folder.save(ARRAYS, {"evaluated": 2})
        folder.append("training", {"step": 3, "loss": 0.125})
    return tmp_path / "run"


def one_line(path, match, config=CONFIG, error=ValueError):
    before = {each.name: each.read_bytes() for each in path.iterdir()}
    with pytest.raises(error, match=match) as caught, open_run(path, config):
        pass
    assert "\n" not in str(caught.value)
    assert {each.name: each.read_bytes() for each in path.iterdir()} == before, "nothing is lost"


def test_goes_on_from_the_checkpoint(path):
    with open_run(path, CONFIG) as folder:
        assert folder.progress["evaluated"] == 2
        assert all(np.array_equal(folder.arrays[name], array) for name, array in ARRAYS.items())
        assert (path / "training.csv").read_text() == "step,loss\n1,0.5\n2,0.25\n"
        folder.append("training", {"step": 3, "loss": 0.5})
    assert (path / "training.csv").read_text() == "step,loss\n1,0.5\n2,0.25\n3,0.5\n"


def test_without_a_checkpoint_it_starts_over(path):
    (path / "checkpoint.npz").unlink()
    with open_run(path, CONFIG) as folder:
        assert folder.arrays is None
        assert (path / "training.csv").read_text() == ""


def test_a_run_whose_legs_saw_other_views_is_refused(path):
    """By the version of the views, which records of before lack."""
    line = "run: of another version, whose legs saw some blocks as the body has them; write to another folder$"
    one_line(path, line, CONFIG | {"leg_views": 1})


def test_what_never_began_leaves_the_folder_to_others(tmp_path):
    """A rejected run leaves a folder that the mended command can use."""
    with open_run(tmp_path / "run", CONFIG):
        pass
    with open_run(tmp_path / "run", CONFIG | {"seed": 1}) as folder:
        folder.append("training", {"step": 1, "loss": 0.5})
    one_line(tmp_path / "run", "of another run, with seed 1, not 0")


def test_a_rejected_run_leaves_no_folder(tmp_path):
    with pytest.raises(ValueError, match="no prior data"), open_run(tmp_path / "runs" / "run", CONFIG) as folder:
        (folder.path / "replay").mkdir()
        raise ValueError("no prior data")
    assert not list(tmp_path.iterdir())
    (tmp_path / "runs" / "other").mkdir(parents=True)
    for path in (tmp_path / "runs" / "run", tmp_path / "runs" / "other"):
        with pytest.raises(ValueError, match="no prior data"), open_run(path, CONFIG):
            raise ValueError("no prior data")
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["other"], "which was there before"


def test_an_error_after_the_first_checkpoint_loses_nothing(tmp_path):
    with pytest.raises(ValueError, match="diverged"), open_run(tmp_path / "run", CONFIG) as folder:
        folder.save(ARRAYS, {"evaluated": 2})
        raise ValueError("diverged")
    with open_run(tmp_path / "run", CONFIG) as folder:
        assert folder.progress["evaluated"] == 2


def test_what_a_kill_has_left_half_written_is_deleted(path):
    (path / ".checkpoint.1234.npz").write_bytes(b"half")
    with open_run(path, CONFIG):
        assert list(path.glob(".*")) == [path / ".lock"]


def test_progress_is_read_alone(path):
    assert run_folder.read_progress(path)["evaluated"] == 2


def test_tables_are_read_also_while_a_line_is_written(path):
    with (path / "training.csv").open("a") as file:
        file.write("4,0.06")
    assert {name: column.tolist() for name, column in run_folder.table(path, "training").items()} == {
        "step": [1.0, 2.0, 3.0],
        "loss": [0.5, 0.25, 0.125],
    }


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"seed": 1}, r"with seed 0, not 1; write to another folder$"),
        ({"hyperparameters": {"hidden": 4, "batch": 9}}, r"with hyperparameters\.batch 8, not 9;"),
        ({"versions": {"numpy": "3"}}, r"with versions\.numpy '2', not '3';"),
        ({"prior": "a"}, r"with prior None, not 'a';"),
    ],
)
def test_another_run(path, changed, named):
    one_line(path, named, CONFIG | changed)


def test_steps_may_grow(path):
    (path / "config.json").write_text(json.dumps(CONFIG | {"steps": 5}))
    with open_run(path, CONFIG | {"steps": 9}, growing=["steps"]) as folder:
        assert folder.progress["evaluated"] == 2
    assert run_folder.read_config(path)["steps"] == 9
    line = f"a run of 9 steps, which .* --algorithm finetune --hp start={path}$"
    with pytest.raises(ValueError, match=line), open_run(path, CONFIG | {"steps": 10}):
        pass
    for config, growing in (({"steps": 8}, ["steps"]), ({"steps": 8}, []), ({"steps": 10, "seed": 1}, ["steps"])):
        with pytest.raises(ValueError, match="of another run, with"), open_run(path, CONFIG | config, growing):
            pass
    assert run_folder.read_config(path)["steps"] == 9


def test_a_folder_of_something_else(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    one_line(tmp_path, r"no folder of a run, and not empty: it holds thesis\.tex$")


@pytest.mark.parametrize("kept", [0, 10, 200, -30])
def test_a_damaged_checkpoint(path, kept):
    data = (path / "checkpoint.npz").read_bytes()
    (path / "checkpoint.npz").write_bytes(data[:kept])
    one_line(path, r"checkpoint\.npz is damaged: .*; delete it to start the run over$")


def test_a_flipped_bit(path):
    data = bytearray((path / "checkpoint.npz").read_bytes())
    data[data.index(np.float32(5.0).tobytes())] ^= 1
    (path / "checkpoint.npz").write_bytes(data)
    one_line(path, r"checkpoint\.npz is damaged: ")


@pytest.mark.parametrize(
    ("progress", "line"),
    [
        ("[]", "progress: expected a mapping"),
        ('{"tables": 3}', "tables: expected a mapping"),
        ('{"tables": {"training": "12"}}', "length of training: expected an integer from 0"),
        ('{"evaluated": "2"}', "evaluated: expected a finite number"),
        ('{"cpu": NaN}', "cpu: expected a finite number"),
        ("[" * 100_000, "nested too deeply"),
        (np.array({"evaluated": 2}, object), "progress.npy: expected numbers or texts, got a pickle"),
    ],
)
def test_progress_made_in_bad_faith(path, progress, line):
    np.savez(path / "checkpoint.npz", progress=np.array(progress), **ARRAYS)
    one_line(path, rf"checkpoint\.npz is damaged: {line}")


@pytest.mark.parametrize("text", ["[" * 100_000, "[]", "3"])
def test_a_record_made_in_bad_faith(path, text):
    (path / "config.json").write_text(text)
    one_line(path, r"run: no folder of a run")


def test_pipes_are_not_waited_for(path):
    for name, line in (("checkpoint.npz", "is damaged: expected a file"), ("config.json", "expected a file")):
        (path / name).unlink()
        os.mkfifo(path / name)
        with pytest.raises(ValueError, match=line):
            run_folder.read_progress(path) if name == "checkpoint.npz" else run_folder.read_config(path)


def test_a_table_that_is_a_pipe_is_not_waited_for(path):
    (path / "training.csv").unlink()
    os.mkfifo(path / "training.csv")
    for read in (lambda: run_folder.table(path, "training"), lambda: open_run(path, CONFIG).__enter__()):
        with pytest.raises((ValueError, OSError), match=r"training\.csv: .*expected a file$"):
            read()


def test_a_table_that_has_lost_lines(path):
    (path / "training.csv").write_text("step,loss\n")
    one_line(path, r"training\.csv: shorter than at the checkpoint; delete checkpoint\.npz to start over$")


def test_a_run_has_one_process(path):
    with open_run(path, CONFIG):
        one_line(path, r"run: another process goes on with this run$")


def test_a_full_disk_keeps_the_checkpoint(path, monkeypatch):
    def full(*arguments, **keywords):
        raise OSError(28, "No space left on device")

    before = (path / "checkpoint.npz").read_bytes()
    with open_run(path, CONFIG) as folder:
        monkeypatch.setattr(np, "savez", full)
        with pytest.raises(OSError, match=r"^cannot write .*checkpoint\.npz: no space left on device$"):
            folder.save({"count": np.zeros(3)}, {})
    assert (path / "checkpoint.npz").read_bytes() == before
    assert sorted(each.name for each in path.iterdir()) == sorted(
        ["checkpoint.npz", "config.json", *(f"{table}.csv" for table in run_folder.TABLES)]
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(OSError, match=r"cannot make folder"), open_run(tmp_path / "run", CONFIG):
        pass


def test_evaluated_is_that_of_the_table(tmp_path):
    run_folder.check_latest_evaluation(tmp_path, 0)
    (tmp_path / "evaluations.csv").write_text("step,seed,return\n100,0,1.5\n200,0,2.5\n")
    run_folder.check_latest_evaluation(tmp_path, 200)
    line = "evaluated: expected 200, as in evaluations.csv, got 1000000000; delete it to start the run over"
    with refused(f"{tmp_path / 'checkpoint.npz'} is damaged: {line}"):
        run_folder.check_latest_evaluation(tmp_path, 10**9)
