"""Cores that this process may use, less than the machine's in containers and on clusters; and the one of a learner."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

_GROUPS, _MOUNT = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
# One thread a run: two runs on two cores learn twice as much, two threads in a run hardly more than one.
_ONE_THREAD = {"NPROC": "1", "OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}


def use_one_thread() -> None:
    """Have JAX compute on one thread, unless the environment says otherwise; before it is imported."""
    for name, value in _ONE_THREAD.items():
        os.environ.setdefault(name, value)


def usable_cores(groups: Path = _GROUPS, mount: Path = _MOUNT) -> int:
    """Return how many cores this process may use by its affinity and the quotas of its control groups, at least 1.

    Args:
        groups: file that names the control groups of the process.
        mount: where control groups are mounted.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, math.ceil(min(cores, *_quotas(groups, mount))))


def _quotas(groups: Path, mount: Path) -> Iterator[float]:
    """Yield the CPU quotas, cores, of all control groups of a process, those of version 1 and 2."""
    yield math.inf
    for line in _text(groups).splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers and "cpu" not in controllers.split(","):
            continue
        root = mount / controllers if controllers else mount
        own = root / path.strip("/")
        for folder in (own, *own.parents):
            if folder == root.parent:
                break
            yield _quota(folder)


def _quota(folder: Path) -> float:
    """Quota of one control group, cores; infinite where there is none."""
    texts = _text(folder / "cpu.max") or " ".join(_text(folder / f"cpu.cfs_{name}_us") for name in ("quota", "period"))
    quota, period, *_ = (*texts.split(), "max", "1")
    return math.inf if quota in ("max", "-1") or not float(period) else float(quota) / float(period)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError:
        return ""
