"""Policies that are functions have the hash of their file, so that another function is another policy."""

import hashlib

from arc_suite import policies
from arc_suite.evaluation import provenance


def test_hashes_of_functions(tmp_path, monkeypatch):
    file = tmp_path / "standing.py"
    file.write_text("def make(robot):\n    return lambda timestep: 0.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    expected = hashlib.sha256(file.read_bytes()).hexdigest()
    assert provenance.policy_sha256(f"{file}:make") == provenance.policy_sha256("standing:make") == expected
    file.write_text("def make(robot):\n    return lambda timestep: 1.0\n")
    assert provenance.policy_sha256("standing:make") != expected


def test_others_have_none():
    for name in ("zero", "cpg", "nowhere:make", "sys:exit"):
        assert policies.function_file(name) is None and provenance.policy_sha256(name) is None
