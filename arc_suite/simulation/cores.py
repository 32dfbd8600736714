"""Cores that this process may use: in containers and on clusters, fewer than the machine has."""

import importlib.util
import math
import os
from collections.abc import Iterator
from pathlib import Path

_GROUPS = Path("/proc/self/cgroup")
_MOUNT = Path("/sys/fs/cgroup")
_DEVICES = Path("/dev")
# Environment variables for JAX on a CPU. A second thread hardly makes a run faster; two cores serve two runs better.
_VARIABLES_OF_ONE_THREAD = {"NPROC": "1", "OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}
# Environment variables for JAX on a GPU. They lack NPROC=1, with which JAX would compile on one core. JAX allocates the
# GPU's memory as it needs it, and leaves the rest to Warp and to other programs.
_VARIABLES_OF_GPU = {"OMP_NUM_THREADS": "1", "XLA_PYTHON_CLIENT_PREALLOCATE": "false"}


def prepare_jax() -> None:
    """Let JAX compute on a GPU, or on one thread; call this before JAX is imported.

    Environment variables that are set stay as they are.
    """
    for name, value in (_VARIABLES_OF_GPU if uses_gpu() else _VARIABLES_OF_ONE_THREAD).items():
        os.environ.setdefault(name, value)


def uses_gpu(devices: Path = _DEVICES) -> bool:
    """Return whether JAX will compute on an NVIDIA GPU: there is one, and JAX has a plugin for it, and may use it.

    Args:
        devices: folder of the devices of this machine.
    """
    platforms = os.environ.get("JAX_PLATFORMS", "")
    is_allowed = not platforms or "cuda" in platforms or "gpu" in platforms
    has_device = any(devices.glob("nvidia[0-9]*"))
    has_plugin = importlib.util.find_spec("jax_plugins") is not None
    return is_allowed and has_device and has_plugin


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
