"""SIGTERM, which clusters send before they take a machine away: a checkpoint, one line, exit status 143."""

import pathlib
import signal
import subprocess
import sys

import pytest

pytest.importorskip("jax", reason="of the extra `learn`: make check-agents")

ROOT = pathlib.Path(__file__).parents[3]
LONG = ["--robot=tick", "--algorithm=sac", "--steps=100000", "--hp", "hidden=16", "--hp", "batch=8"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM to catch")
def test_training_ends_with_a_checkpoint(tmp_path):
    command = [sys.executable, "-m", "arc_suite", "train", *LONG, "--output=run"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline().startswith("run: ")
        while not (tmp_path / "run" / "training.csv").exists():
            assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        output, _ = process.communicate(timeout=120)
    assert (process.returncode, output.splitlines()[-1]) == (143, "run: stopped; the same command resumes it")
    assert (tmp_path / "run" / "checkpoint.npz").exists()
