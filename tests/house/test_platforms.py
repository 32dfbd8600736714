"""The suite on other platforms: what Windows does not have, and texts whose encoding depends on the machine."""

import interpreters
import pytest

# Takes from Python what Windows does not have, and gives it a lock on a range of bytes as msvcrt has.
WINDOWS = """
import ctypes, fcntl, os, sys, types
import gymnasium, minari, multiprocessing, subprocess
posix = fcntl
def locking(descriptor, mode, count):
    here = os.lseek(descriptor, 0, os.SEEK_CUR)
    try:
        posix.lockf(descriptor, posix.LOCK_EX | posix.LOCK_NB, count, here)
    except OSError as error:
        raise PermissionError(13, "Permission denied") from error
sys.modules["msvcrt"] = types.SimpleNamespace(LK_NBLCK=2, locking=locking)
for name in ("fcntl", "resource", "termios", "pwd", "grp", "pty", "tty"):
    sys.modules[name] = None
for name in ("register_at_fork", "fork", "forkpty", "sched_getaffinity", "posix_fallocate", "mkfifo", "getuid",
             "killpg", "setsid", "getpgid"):
    delattr(os, name)
class CDLL(ctypes.CDLL):
    def __init__(self, name, *args, **kwargs):
        if name is None or "EGL" in str(name):
            raise (TypeError if name is None else OSError)("no such library")
        super().__init__(name, *args, **kwargs)
ctypes.CDLL = CDLL
"""

USE = """
import functools, pathlib
import numpy as np, tqdm
import arc_suite
from arc_suite import data, files
from arc_suite.robots import ROBOTS, spec_files
environment = arc_suite.load("queen", "walk", {"random": 0})
environment.reset()
assert environment.step(np.zeros(environment.action_spec().shape)).reward > 0.0
with files.hold_lock(".lock"):
    with files.writing_json("a.json") as report:
        report["leg"] = "Füße"
    assert os.system(sys.executable + " other.py") == 0
spec_files.save_body(ROBOTS["queen"], "queen.json")
assert spec_files.load_body("queen.json") == ROBOTS["queen"]
collect = functools.partial(data.collect, progress=functools.partial(tqdm.tqdm, disable=True))
settings = data.DatasetSettings(arc_suite.Setup.of("tick"), "random", (), steps=4)
for arguments in ({}, {"overwrite": True}):
    assert collect("test-v0", settings, 2, **arguments) == 2
assert len(data.open("test-v0")) == 2
"""

# Another process, which finds the lock held.
OTHER = """
from arc_suite import files
try:
    with files.hold_lock(".lock", "held"):
        raise SystemExit("not locked")
except ValueError as error:
    assert str(error) == "held"
"""


@pytest.mark.slow
def test_what_windows_does_not_have_is_not_needed(tmp_path):
    (tmp_path / "other.py").write_text(WINDOWS + OTHER)
    interpreters.printed(WINDOWS + USE, folder=tmp_path, MINARI_DATASETS_PATH=str(tmp_path / "datasets"))
    assert (tmp_path / "a.json").read_bytes().decode() == '{\n  "leg": "F\\u00fc\\u00dfe"\n}\n'


@pytest.mark.slow
def test_files_do_not_depend_on_the_encoding_of_the_machine(tmp_path):
    strict = "import os, sys, warnings\nwarnings.filterwarnings('error', '', EncodingWarning, 'arc_suite')\n"
    (tmp_path / "other.py").write_text(OTHER)
    options = ("-X", "warn_default_encoding", "-W", "ignore::EncodingWarning")  # those of other packages
    settings = {"options": options, "MINARI_DATASETS_PATH": str(tmp_path / "datasets")}
    interpreters.printed(strict + USE, folder=tmp_path, **settings)
