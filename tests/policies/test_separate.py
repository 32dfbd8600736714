"""Modules that act in a process of their own, from a frozen copy of their folder."""

import os

import numpy as np
import pytest
from refusals import refused

from arc_suite.policies import frozen, separate

SIZES = {"numbers": 2, "more": 1}
BEGIN = "import os, sys, time, pathlib\nimport numpy as np\n"
WEIGHTS = """
def make(robot):
    print("no message")
    scale = np.load(pathlib.Path(__file__).with_suffix(".npy"))
    return lambda timestep: np.full(18, scale * timestep.observation["numbers"][1] + (timestep.reward or 0.0))
"""


def acting(path, num_envs=2, **options):
    return separate.Separate(path, "make", "tick", num_envs, SIZES, f"policy theirs/{path.name}", **options)


@pytest.mark.slow
def test_arrays_go_through_the_pipe(tmp_path):
    """Rewards and blocks of each environment there, actions back; what a module prints is no message."""
    (tmp_path / "tick.py").write_text(BEGIN + WEIGHTS)
    np.save(tmp_path / "tick.npy", np.float64(0.1))
    with frozen.freeze(tmp_path) as copy:
        np.save(tmp_path / "tick.npy", np.float64(0.9))  # after the freeze: nobody sees it
        policy = acting(copy.path / "tick.py")
        blocks = {"numbers": np.array([[0.0, 1.0], [0.0, 3.0]], np.float32), "more": np.zeros((2, 1))}
        policy.reset([0, 1], [5, 6])
        assert policy.act(blocks, np.array([0.5, 0.5])).tolist() == [[0.1] * 18, [0.1 * 3.0] * 18]
        actions = policy.act(blocks, np.array([0.25, -0.25]))
        assert actions == pytest.approx(np.repeat([[0.35], [0.05]], 18, axis=1))
        with refused("policy theirs/tick.py: expected blocks {'numbers': 2, 'more': 1}, got {'numbers': 2}"):
            policy.act({"numbers": blocks["numbers"]}, np.zeros(2))
        policy.close()
    assert not copy.path.exists()


@pytest.mark.long
@pytest.mark.parametrize(
    ("code", "line"),
    [
        ("return lambda t: np.full(18, np.nan)", "episode of seed 7, step 0: action[0]: expected a number from -1 to "),
        ("return lambda t: 1 / 0", "ZeroDivisionError: division by zero"),
        ("return lambda t: os._exit(3)", "its process ended with status 3"),
        ("return lambda t: time.sleep(60)", "no answer after 1 s"),
    ],
)
def test_a_module_that_fails_is_one_line(tmp_path, code, line):
    path = tmp_path / "tick.py"
    path.write_text(f"{BEGIN}def make(robot):\n    {code}\n")
    with refused(f"policy theirs/tick.py: {line}", begins=True):
        policy = acting(path, 1, max_step=1.0)
        try:
            policy.reset([0], [7])
            policy.act({"numbers": np.zeros((1, 2)), "more": np.zeros((1, 1))}, np.zeros(1))
        finally:
            policy.close()


def digest(folder):
    with frozen.freeze(folder) as copy:
        return copy.sha256


def test_the_hash_of_a_folder_is_that_of_names_and_bytes(tmp_path):
    for name, text in (("policy.py", "a"), ("weights/one.npy", "bc"), ("__pycache__/policy.pyc", "old")):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    before = digest(tmp_path)
    (tmp_path / "__pycache__" / "policy.pyc").write_text("new")
    os.utime(tmp_path / "policy.py", (0, 0))
    (tmp_path / "empty").mkdir()
    assert digest(tmp_path) == before
    digests = {before}
    (tmp_path / "weights" / "one.npy").write_text("bd")
    digests.add(digest(tmp_path))
    (tmp_path / "weights" / "one.npy").rename(tmp_path / "weights" / "two.npy")
    digests.add(digest(tmp_path))
    (tmp_path / "weights" / "two.npy").write_text("b")  # the last byte moves into the next file
    (tmp_path / "weights" / "u.npy").write_text("d")
    digests.add(digest(tmp_path))
    assert len(digests) == 4


def test_folders_are_bounded_and_have_no_links(tmp_path, monkeypatch):
    (tmp_path / "policy.py").write_text("text")
    monkeypatch.setattr(frozen, "MAX_BYTES", 3)
    with refused(f"{tmp_path}: expected at most 3 bytes next to a module"):
        digest(tmp_path)
    monkeypatch.setattr(frozen, "MAX_FILES", 0)
    with refused(f"{tmp_path}: expected at most 0 files next to a module"):
        digest(tmp_path)
    (tmp_path / "link").symlink_to("/etc/hostname")
    with refused(f"{tmp_path / 'link'}: expected a file or a folder next to a module, got a link or the like"):
        digest(tmp_path)
    (tmp_path / "link").unlink()
    os.mkfifo(tmp_path / "pipe")
    with refused(f"{tmp_path / 'pipe'}: expected a file or a folder next to a module, got a link or the like"):
        digest(tmp_path)
