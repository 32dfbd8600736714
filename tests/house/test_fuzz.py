"""The program that damages files tells one outcome from another, and repeats itself."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import fuzz
import numpy as np
import programs
import pytest

ROOT = Path(__file__).parents[2]


def raises(error):
    def read():
        raise error

    return read


def parsed(text):
    try:
        return json.loads(text)
    except ValueError:
        return None


@pytest.mark.parametrize(
    ("read", "expected"),
    [
        (lambda: None, fuzz.READ),
        (raises(ValueError("a.json: no body")), fuzz.REFUSED),
        (raises(OSError("cannot read a.json: no such file")), fuzz.REFUSED),
        (raises(ValueError("two\nlines")), fuzz.TRACEBACK),
        (raises(ValueError("")), fuzz.TRACEBACK),
        (raises(KeyError("name")), fuzz.TRACEBACK),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), fuzz.CRASHED),
        (lambda: time.sleep(10.0), fuzz.TOO_LONG),
    ],
)
def test_what_comes_of_reading_is_told(read, expected):
    assert fuzz.outcome(read, limit=0.1 if expected is fuzz.TOO_LONG else fuzz.LIMIT) == expected


def test_large_memory_is_told(monkeypatch):
    monkeypatch.setattr(fuzz, "MAX_MEMORY", 1 << 26)
    assert fuzz.outcome(lambda: np.ones(1 << 24)) == fuzz.TOO_LARGE
    assert fuzz.outcome(lambda: None) == fuzz.READ


def test_files_are_damaged_again_in_the_same_way():
    sound = fuzz.SPEC.read_bytes()
    texts = [fuzz.damaged(sound, np.random.default_rng(seed)) for seed in range(200)]
    assert texts == [fuzz.damaged(sound, np.random.default_rng(seed)) for seed in range(200)]
    assert len(set(texts)) > 150 and sound not in texts
    # Odd values in JSON that is well-formed, and damage to its text.
    assert 50 < sum(isinstance(parsed(text), dict) for text in texts) < 150


@pytest.mark.parametrize("label", [label for label in fuzz.KINDS if "motion" in label or label in ("spec", "tracks")])
def test_sound_files_are_read(label, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kind = fuzz.KINDS[label]
    assert (fuzz.outcome(kind.make), fuzz.outcome(*kind.uses)) == (fuzz.READ, fuzz.READ)


@pytest.mark.parametrize(
    ("flags", "kinds"),
    [
        pytest.param(["--kind=spec"], ["spec"], marks=pytest.mark.slow),
        pytest.param([], list(fuzz.KINDS), marks=pytest.mark.release),
    ],
)
def test_a_few_damaged_files_of_each_kind(flags, kinds):
    command = [sys.executable, ROOT / "tests" / "fuzz.py", "--cases=5", "--seed=1", *flags]
    done = subprocess.run(command, capture_output=True, text=True)
    rows = [line.rsplit(maxsplit=6) for line in programs.passed(done).splitlines()[1:]]
    assert [name.strip() for name, *_ in rows] == kinds
    for name, read, refused, *_ in rows:
        assert int(read) + int(refused) == 5 + len(fuzz.KINDS[name.strip()].table), name
