"""Zips of stable-baselines3 and the statistics of `VecNormalize` that belong to them. No pickle is read here.

A name is `ppo.zip`, or `ppo.zip+stats.pkl` with a file of statistics. A zip of a policy that was trained in
`arc_suite.envs.sb3.VecEnv` also holds the setup of the training. The functions are those of `other_libraries.Reader`.
"""

import hashlib
import json
import re
from pathlib import Path
from typing import Any

from arc_suite import archives, files, parsers, registry, versions
from arc_suite.envs.setup import ATTRIBUTE, Setup
from arc_suite.policies.other_libraries import LoadedPolicy

EXTENSION = ".zip"
_MAX_BYTES = 1 << 32  # of all members; replay buffers are saved apart
NO_SETUP = "does not hold the robot and task that it was trained for; train in arc_suite.envs.sb3.VecEnv"


def content(path: Path) -> dict[str, Any]:
    """Return the JSON that a zip holds in addition to its pickles.

    Raises:
        ValueError: it is no zip of stable-baselines3.
        OSError: it cannot be read.
    """
    if not path.is_file():
        raise OSError(f"cannot read {path}: no such file{files.suggest_path(path)}")
    with parsers.guard(f"policy {path}: no policy of stable-baselines3"):
        return dict(json.loads(archives.read_member(path, "data", files.MAX_JSON)))


def setup(path: Path) -> Setup | None:
    """Return the setup in which the policy of a zip was trained; None for a zip that does not hold it.

    Raises:
        ValueError: as `content` and `Setup.from_dict`.
        OSError: as `content`.
    """
    space = content(path).get("observation_space")
    record = space.get(ATTRIBUTE) if isinstance(space, dict) else None
    if not isinstance(record, dict):
        return None
    try:
        return Setup.from_dict(record)
    except (ValueError, registry.NotImported) as error:
        raise ValueError(f"policy {path}: {error}") from None


def digest(path: Path, further: Path | None) -> str:
    """Return the sha256 of the members of a zip, and of the file of its statistics if there is one.

    Raises:
        ValueError, OSError: as `statistics`, or a file that is too large.
    """
    statistics_path = statistics(path, further)
    with parsers.guard(f"policy {path}: damaged"):
        members_hash = archives.digest(path, _MAX_BYTES)
    if statistics_path is None:
        return members_hash
    with statistics_path.open("rb") as file:
        statistics_hash = hashlib.file_digest(file, "sha256").hexdigest()
    return hashlib.sha256(f"{members_hash}\0{statistics_hash}".encode()).hexdigest()


def load(path: Path, further: Path | None) -> LoadedPolicy:
    """Return the policy of a zip. The pickles that it holds run code.

    Args:
        path: path of the zip.
        further: file of its statistics; None for those next to it, if there are any.

    Raises:
        ValueError: stable-baselines3 is not installed, or as `statistics` and `sb3_file.Saved`.
        OSError: a file cannot be read.
    """
    with versions.require_extra(f"policy {path}: zips need stable-baselines3", "sb3"):
        from arc_suite.policies import sb3_file
    return sb3_file.Saved(path, statistics(path, further))


def statistics(path: Path, given: Path | None = None) -> Path | None:
    """Return the file of the statistics of a zip; None for a policy of observations that are not normalized.

    By default it is a file next to the zip: `<stem>_vecnormalize.pkl`, the name that `CheckpointCallback` writes, or
    `vecnormalize.pkl`. Zips of on-policy algorithms tell whether they were trained with statistics. For other zips, a
    file next to it is taken if there is one.

    Raises:
        ValueError: as `content`; statistics that are missing, or given for a zip that was trained without any.
        OSError: as `content`, or the given file does not exist.
    """
    data = content(path)
    is_normalized = data.get("_last_original_obs") is not None
    if given is not None:
        if data.get("_last_obs") is not None and not is_normalized:
            raise ValueError(f"policy {path}: was trained without VecNormalize: expected no statistics, got {given}")
        if not given.is_file():
            raise OSError(f"cannot read {given}: no such file{files.suggest_path(given)}")
        return given
    if not is_normalized:
        return None
    # `CheckpointCallback` writes ppo_1000_steps.zip and ppo_vecnormalize_1000_steps.pkl.
    numbered = re.sub(r"_(\d+_steps)$", r"_vecnormalize_\1", path.stem)
    names = dict.fromkeys((f"{path.stem}_vecnormalize.pkl", f"{numbered}.pkl", "vecnormalize.pkl"))
    names.pop(f"{path.stem}.pkl", None)
    for name in names:
        if path.with_name(name).is_file():
            return path.with_name(name)
    is_on_policy = "rollout_buffer_class" in data
    if is_on_policy:
        raise ValueError(
            f"policy {path}: was trained with VecNormalize, whose statistics are missing: "
            f"expected --vecnormalize FILE, or {' or '.join(names)} next to it"
        )
    return None
