"""Cores that a process may use: quotas of control groups count, of either version and of any level."""

import os

import pytest

from arc_suite.simulation import cores as cores_of_machine
from arc_suite.simulation.cores import prepare_jax, usable_cores, uses_gpu

ALL = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()

_US = "cpu.cfs_quota_us", "cpu.cfs_period_us"


@pytest.mark.parametrize(
    ("group", "files", "cores"),
    [
        ("0::/box/job", {"box/cpu.max": "50000 100000", "box/job/cpu.max": "max 100000"}, 1),
        ("0::/box/job", {"box/job/cpu.max": "150000 100000"}, min(2, ALL)),
        ("0::/", {"cpu.max": "90000 100000"}, 1),
        ("3:cpuset:/\n2:cpu,cpuacct:/box", {f"cpu,cpuacct/box/{name}": "9000" for name in _US}, 1),
        ("1:cpu:/box", {f"cpu/box/{_US[0]}": "-1"}, ALL),
        ("0::/box", {}, ALL),
        ("", {}, ALL),
    ],
)
def test_quotas_count(tmp_path, group, files, cores):
    (tmp_path / "groups").write_text(group)
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"{text}\n")
    assert usable_cores(tmp_path / "groups", tmp_path) == cores


@pytest.fixture
def no_settings(monkeypatch):
    """Remove what other programs have set."""
    for name in ("NPROC", "OMP_NUM_THREADS", "XLA_FLAGS", "XLA_PYTHON_CLIENT_PREALLOCATE", "JAX_PLATFORMS"):
        monkeypatch.setenv(name, "")  # restored afterwards
        monkeypatch.delenv(name)


@pytest.fixture
def plugin(monkeypatch, tmp_path):
    """A package of plugins of JAX, as its builds for GPUs have one."""
    (tmp_path / "path" / "jax_plugins").mkdir(parents=True)
    monkeypatch.syspath_prepend(str(tmp_path / "path"))


def test_a_gpu_counts_that_jax_can_use(tmp_path, monkeypatch, no_settings, plugin):
    devices = tmp_path / "dev"
    devices.mkdir()
    (devices / "nvidiactl").touch()
    assert not uses_gpu(devices)
    (devices / "nvidia0").touch()
    assert uses_gpu(devices)
    for platforms, expected in (("cpu", False), ("cuda,cpu", True), ("", True)):
        monkeypatch.setenv("JAX_PLATFORMS", platforms)
        assert uses_gpu(devices) == expected


@pytest.mark.parametrize("has_gpu", [False, True])
def test_jax_compiles_on_all_cores_for_a_gpu_and_takes_memory_as_it_needs_it(monkeypatch, no_settings, has_gpu):
    monkeypatch.setattr(cores_of_machine, "uses_gpu", lambda: has_gpu)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    prepare_jax()
    assert os.environ.get("NPROC") == (None if has_gpu else "1")
    assert os.environ.get("XLA_PYTHON_CLIENT_PREALLOCATE") == ("false" if has_gpu else None)
    assert os.environ["OMP_NUM_THREADS"] == "3"
