"""Versions that are recorded with results."""

import importlib
import sys

import mujoco
import numpy as np
import programs
import pytest

from arc_suite import versions


def test_versions():
    found = versions.dependency_versions()
    assert list(found) == ["arc_suite", "mujoco", "dm_control", "numpy"]
    assert found["mujoco"] == mujoco.__version__
    assert found["numpy"] == np.__version__


@pytest.mark.parametrize(("python", "options"), [((3, 12), ""), ((3, 13), "--no-deps ")])
def test_the_command_that_installs_dm_control(monkeypatch, python, options):
    monkeypatch.setattr(versions.sys, "version_info", python)
    monkeypatch.setattr(versions, "version_of", lambda package: None)
    monkeypatch.setattr(versions, "REQUIREMENTS", {"dm-control": "==1.0.50"})
    command = f"pip install {options}'dm-control==1.0.50'"
    assert versions.problems() == [f"dm-control is not installed and should be ==1.0.50: {command}"]


def test_an_extra_is_named_for_a_clone_and_for_an_installed_package(monkeypatch, tmp_path):
    def line():
        return str(versions.MissingExtra("ONNX needs onnx", "learn", ImportError("No module named 'onnx'")))

    assert line() == f"ONNX needs onnx: {programs.install('learn')} (No module named 'onnx')"
    monkeypatch.setattr(versions, "__file__", str(tmp_path / "site-packages" / "arc_suite" / "versions.py"))
    assert line() == "ONNX needs onnx: install arc_suite with the extra 'learn' (No module named 'onnx')"


def test_a_module_for_another_library_names_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.delitem(sys.modules, "arc_suite.envs.sb3", raising=False)
    with pytest.raises(ImportError, match=r"^arc_suite.envs.sb3 needs stable-baselines3: pip install .*sb3"):
        importlib.import_module("arc_suite.envs.sb3")
