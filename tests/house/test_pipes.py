"""Pipes, devices and folders in place of files: one line at once, as nobody may ever write to a pipe."""

import os
from pathlib import Path

import pytest

from arc_suite import files, registry, style
from arc_suite.importing import import_robot
from arc_suite.journal import Journal
from arc_suite.robots.spec_files import load_body

# Readers of files of strangers, by the name of the file.
READERS = {
    "body.json": load_body,
    "robot.xml": import_robot,
    "robot.urdf": registry.body_of,
    "tracks.npz": style.load,
    "journal.jsonl": lambda path: Journal(path, {}, dict),
    "table.csv": lambda path: files.read_utf8(path, 100),
}


@pytest.mark.parametrize("name", READERS)
def test_a_pipe_is_refused_at_once(name, tmp_path):
    path = tmp_path / name
    os.mkfifo(path)
    with pytest.raises((ValueError, OSError), match=f"{name}: expected a file$"):
        READERS[name](path)


def test_a_device_is_no_file():
    with pytest.raises(OSError, match=r"^cannot read /dev/zero: expected a file$"):
        load_body(Path("/dev/zero"))


def test_a_text_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "a.csv").write_text("x" * 101)
    with pytest.raises(OSError, match=r"a\.csv: expected at most 100 bytes$"):
        files.read_utf8(tmp_path / "a.csv", 100)
