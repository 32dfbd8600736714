"""Zips of stable-baselines3 and the statistics of `VecNormalize` that belong to them. No pickle is read here.

A name is `ppo.zip`, or `ppo.zip+stats.pkl` with a file of statistics. A zip that was trained in
`arc_suite.envs.sb3.VecEnv` also holds the setup that it was trained in. The functions are those of
`other_libraries.Reader`.
"""

import json
import re
import zipfile
from pathlib import Path
from typing import Any

from arc_suite import checks, registry, versions
from arc_suite.envs.setup import ATTRIBUTE, Setup
from arc_suite.policies.other_libraries import Loaded

EXTENSION = ".zip"
NO_SETUP = "does not hold the robot and task that it was trained for; train in arc_suite.envs.sb3.VecEnv"


def content(path: Path) -> dict[str, Any]:
    """Return the JSON that a zip holds in addition to its pickles.

    Raises:
        ValueError: it is none of stable-baselines3.
        OSError: it cannot be read.
    """
    if not path.is_file():
        raise OSError(f"cannot read {path}: no such file")
    try:
        with zipfile.ZipFile(path) as archive:
            return dict(json.loads(archive.read("data")))
    except (zipfile.BadZipFile, ValueError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"policy {path}: no policy of stable-baselines3: {checks.quote(error)}") from None


def setup(path: Path) -> Setup | None:
    """Return the setup that a zip was trained in; None for one that does not hold it.

    Raises:
        ValueError: as `content` and `Setup.from_dict`.
        OSError: as `content`.
    """
    space = content(path).get("observation_space")
    known = space.get(ATTRIBUTE) if isinstance(space, dict) else None
    if not isinstance(known, dict):
        return None
    try:
        return Setup.from_dict(known)
    except (ValueError, registry.NotImported) as error:
        raise ValueError(f"policy {path}: {error}") from None


def policy_files(path: Path, further: Path | None) -> list[Path]:
    """Return a zip and the file of the statistics with which it acts, if there are any.

    Raises:
        ValueError, OSError: as `statistics`.
    """
    found = statistics(path, further)
    return [path] if found is None else [path, found]


def load(path: Path, further: Path | None) -> Loaded:
    """Return the policy of a zip. The pickles that it holds run code.

    Args:
        path: of the zip.
        further: file of its statistics; None for those next to it, if there are any.

    Raises:
        ValueError: stable-baselines3 is not installed, or as `statistics` and `sb3_file.Saved`.
        OSError: a file cannot be read.
    """
    with versions.require_extra(f"policy {path}: zips need stable-baselines3", "sb3"):
        from arc_suite.policies import sb3_file
    return sb3_file.Saved(path, statistics(path, further))


def statistics(path: Path, given: Path | None = None) -> Path | None:
    """Return the file of the statistics with which a zip acts; None for one that acts on plain observations.

    Without a given file it lies next to the zip: `<stem>_vecnormalize.pkl`, the name that `CheckpointCallback` gives
    it, or `vecnormalize.pkl`. Zips of on-policy algorithms tell whether they were trained with statistics; of others
    those next to the zip are taken if there are any.

    Raises:
        ValueError: as `content`; statistics that are missing, or given for a zip that was trained without any.
        OSError: as `content`, or the given file does not exist.
    """
    data = content(path)
    normalized = data.get("_last_original_obs") is not None
    if given is not None:
        if data.get("_last_obs") is not None and not normalized:
            raise ValueError(f"policy {path}: was trained without VecNormalize: expected no statistics, got {given}")
        if not given.is_file():
            raise OSError(f"cannot read {given}: no such file")
        return given
    if not normalized:
        return None
    numbered = re.sub(r"_(\d+_steps)$", r"_vecnormalize_\1", path.stem)
    names = dict.fromkeys((f"{path.stem}_vecnormalize.pkl", f"{numbered}.pkl", "vecnormalize.pkl"))
    names.pop(f"{path.stem}.pkl", None)
    found = next((path.with_name(name) for name in names if path.with_name(name).is_file()), None)
    if found is None and "rollout_buffer_class" in data:
        raise ValueError(
            f"policy {path}: was trained with VecNormalize, whose statistics are missing: "
            f"expected --vecnormalize FILE, or {' or '.join(names)} next to it"
        )
    return found
