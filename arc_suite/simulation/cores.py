"""Cores that this process may use: in containers and on clusters, fewer than the machine has."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

_GROUPS = Path("/proc/self/cgroup")
_MOUNT = Path("/sys/fs/cgroup")
# A second thread hardly makes a run faster, so that two cores serve two runs better.
_ONE_THREAD = {"NPROC": "1", "OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}


def use_one_thread() -> None:
    """Let JAX compute on one thread, unless environment variables are set; call this before JAX is imported."""
    for name, value in _ONE_THREAD.items():
        os.environ.setdefault(name, value)


def usable_cores(groups: Path = _GROUPS, mount: Path = _MOUNT) -> int:
    """Return the number of cores that this process may use, at least 1: by its affinity and its control groups.

    Args:
        groups: file that names the control groups of the process.
        mount: where control groups are mounted.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, math.ceil(min(cores, *_quotas(groups, mount))))


def _quotas(groups: Path, mount: Path) -> Iterator[float]:
    """Yield the CPU quotas, cores, of all control groups of a process, those of version 1 and 2."""
    yield math.inf  # without control groups
    for line in _text(groups).splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers and "cpu" not in controllers.split(","):
            continue
        root = mount / controllers if controllers else mount
        group = root / path.strip("/")
        for folder in (group, *group.parents):
            if folder == root.parent:
                break
            yield _quota(folder)


def _quota(folder: Path) -> float:
    """Return the quota of a control group, cores; infinite without one."""
    numbers = _text(folder / "cpu.max").split()  # version 2: quota and period
    if not numbers:  # version 1
        numbers = [*_text(folder / "cpu.cfs_quota_us").split(), *_text(folder / "cpu.cfs_period_us").split()]
    if len(numbers) < 2:
        return math.inf
    quota, period = numbers
    if quota in ("max", "-1") or float(period) == 0.0:
        return math.inf
    return float(quota) / float(period)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError:
        return ""
