"""Cores that this process may use: less than the machine's in containers and on clusters."""

import math
import os
from collections.abc import Iterator
from pathlib import Path

_GROUPS, _MOUNT = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")


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
