"""Where a disk or a limit leaves no room, one line names the file, and none is left in its place."""

import os
import pathlib
import subprocess
import sys

import pytest

from arc_suite import files
from arc_suite.journal import Journal
from arc_suite.simulation import films

GO2 = pathlib.Path(__file__).parents[1] / "fixtures" / "robots" / "go2_like.xml"
COMMANDS = {
    "big.xml": "build_model --robot queen --output big.xml",
    "e.json": "evaluate --robot tick --episodes 1 --set time_limit=0.1 --json e.json",
    "b.json": f"import {GO2} --output b.json",
    "the output": "evaluate --help",
    "a.png": "render --robot tick --steps 0 --output a.png",
}
FILMS = {
    "a.gif": "render --robot tick --steps 2 --output a.gif",
    "a.mp4": "render --robot tick --steps 6 --output a.mp4",
}


def run_in_little_room(command, folder):
    """Run a program that may write files of 1 KiB; its output goes to one of them."""
    line = f"ulimit -f 1; exec {sys.executable} -m arc_suite {command}"
    with (folder / "output.txt").open("w") as output:
        environ = {
            **os.environ,
            "PYTHONUNBUFFERED": "",
            "PYTHONDONTWRITEBYTECODE": "1",
        }  # bytecode would be cut off, too
        return subprocess.run(["bash", "-c", line], cwd=folder, env=environ, stdout=output, stderr=-1, text=True)


@pytest.mark.skipif(sys.platform != "linux", reason="counts blocks as bash does on Linux")
@pytest.mark.parametrize(
    ("file", "command"),
    [*COMMANDS.items(), *(pytest.param(*pair, marks=pytest.mark.release) for pair in FILMS.items())],
)
def test_a_file_that_is_too_large_is_one_line_with_its_name(file, command, tmp_path):
    if file == "a.mp4":
        pytest.importorskip("imageio_ffmpeg", reason="of the extra `video`")
    done = run_in_little_room(command, tmp_path)
    reason = "ffmpeg has not written all of it" if file == "a.mp4" else "file too large"
    assert (done.returncode, done.stderr) == (1, f"arc-suite {command.split()[0]}: cannot write {file}: {reason}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["output.txt"]


def test_errors_of_the_disk_name_the_file(tmp_path):
    for number in files._STORAGE_ERRORS:
        path = tmp_path / "a.txt"
        with pytest.raises(OSError, match=rf"^cannot write {path}: [a-z/ ]+$"), files.writing(path):
            raise OSError(number, os.strerror(number))
        assert not path.exists()
    with pytest.raises(OSError, match="^cannot read b: no such file$"), files.writing(tmp_path / "a.txt"):
        raise OSError("cannot read b: no such file")


def test_a_journal_names_its_file(tmp_path):
    journal = Journal(tmp_path / "journal.jsonl", {"seed": 0}, dict)
    journal._file.close()
    journal._file = open("/dev/full", "ab")  # noqa: SIM115
    with pytest.raises(OSError, match="^cannot write /dev/full: no space left on device$"):
        journal._write(b"{}\n")


def test_a_film_without_its_end_is_seen(tmp_path):
    sound = b"\0\0\0\x10ftypisom\0\0\0\0" + b"\0\0\0\x08moov" + b"\0\0\0\x0cmdat1234"
    for length in range(len(sound)):
        (tmp_path / "a.mp4").write_bytes(sound[:length])
        with pytest.raises(OSError, match="ffmpeg has not written all of it"):
            films._check_mp4(tmp_path / "a.mp4")
    (tmp_path / "a.mp4").write_bytes(sound)
    films._check_mp4(tmp_path / "a.mp4")
