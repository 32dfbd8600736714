"""Cores that a process may use: quotas of control groups count, of either version and of any level."""

import os

import pytest

from arc_suite.simulation.cores import usable_cores

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
