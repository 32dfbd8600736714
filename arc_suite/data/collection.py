"""Collection of datasets: `collect` plays the missing episodes. Finished ones are kept if the process is killed."""

import contextlib
import functools
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from minari import __version__ as minari_version
from minari.serialization import serialize_space
from tqdm import tqdm

from arc_suite import checks, evaluation, policies, seed_ranges
from arc_suite.data import rollouts
from arc_suite.data.settings import DatasetSettings
from arc_suite.data.storage import Storage
from arc_suite.envs.vector import VectorEnv
from arc_suite.simulation.model_hash import PHYSICS
from arc_suite.tasks import Task, terms

NUM_ENVS = 64  # more do not make steps faster, and more of them would idle during the last episodes

MAX_WRITING_SHARE = 0.1  # of the time so far; below it, finished episodes are written at once
MAX_PENDING_BYTES = 1 << 24  # of finished episodes that wait to be written where writing has taken more of the time


def collect(
    dataset_id: str,
    settings: DatasetSettings,
    episodes: int,
    num_envs: int = NUM_ENVS,
    threads: int | None = None,
    overwrite: bool = False,
    progress: Callable[..., Any] = tqdm,
    author: str | None = None,
    code_permalink: str | None = None,
    wait: bool = False,
) -> int:
    """Collect the episodes that a dataset does not have yet.

    Args:
        dataset_id: Minari's.
        settings: what the episodes depend on; all their seeds are of `seed_ranges.COLLECTING`.
        episodes: number of episodes of the complete dataset.
        num_envs: number of episodes that are played at a time; the data do not depend on it.
        threads: number of threads of the simulation; None for all cores. The data do not depend on it.
        overwrite: whether to replace an existing dataset, once the new one is complete.
        progress: makes progress bars as `tqdm` does.
        author: for Minari's metadata; None keeps that of the dataset, if it has one.
        code_permalink: address of the code that made the dataset; None keeps that of the dataset, if it has one.
        wait: whether to wait for another process that collects the dataset; else that is an error.

    Returns:
        The number of episodes that were missing.

    Raises:
        ValueError: settings that do not fit, a dataset that is damaged or has other settings, or a
            policy with an invalid action. Episodes finished before are kept.
        OSError: the disk is full, or another error of writing. Finished episodes are kept.
        KeyboardInterrupt: Ctrl-C. Finished episodes are kept.
    """
    episodes = checks.integer("episodes", episodes, 0)
    num_envs = checks.integer("num_envs", num_envs, 1)
    settings = _check_settings(settings, episodes)
    checks.boolean("overwrite", overwrite)
    checks.boolean("wait", wait)
    named_metadata = _make_named_metadata(author, code_permalink)
    provenance = settings.provenance()
    with Storage.open(dataset_id, overwrite, wait) as storage:
        _check_same_dataset(storage, dataset_id, provenance, overwrite)
        missing = [index for index in range(episodes) if index not in storage.kept]
        try:
            try:
                if missing:
                    if storage.metadata is None:
                        storage.metadata = _metadata(dataset_id, settings, provenance, threads)
                    storage.metadata |= named_metadata
                    _play(storage, settings, missing, num_envs, threads, progress)
                elif storage.metadata is not None:
                    storage.add_metadata(named_metadata)
            finally:
                if not overwrite or storage.kept.issuperset(missing):
                    storage.finish(functools.partial(progress, desc="merging", unit="episode", leave=False))
        except (ValueError, OSError, KeyboardInterrupt) as error:
            count = len(storage.kept.intersection(range(episodes)))
            raise _add_note(error, f"{count} of {episodes} episodes of {dataset_id!r} are kept") from None
        return len(missing)


def _add_note(error: ValueError | OSError | KeyboardInterrupt, note: str) -> BaseException:
    """Return an error of the same kind with a note."""
    if isinstance(error, KeyboardInterrupt):
        return KeyboardInterrupt(f"interrupted; {note}")
    error_type = ValueError if isinstance(error, ValueError) else OSError
    return error_type(f"{error}; {note}")


def _make_named_metadata(author: str | None, code_permalink: str | None) -> dict[str, Any]:
    """Return the part of Minari's metadata that the caller names."""
    metadata: dict[str, Any] = {}
    if author is not None:
        metadata["author"] = [author]  # Minari makes a set of it
    if code_permalink is not None:
        metadata["code_permalink"] = code_permalink
    return metadata


def _check_settings(settings: DatasetSettings, episodes: int) -> DatasetSettings:
    """Return the settings with numbers of Python, given the number of episodes of the complete dataset.

    Raises:
        ValueError: a number out of range, or no such policy.
    """
    last = seed_ranges.COLLECTING[-1] - (episodes - 1)
    first_seed = f"seed of the first of {episodes} episodes"
    settings = settings._replace(
        steps=checks.integer("steps", settings.steps, 1),
        seed=checks.integer(first_seed, settings.seed, seed_ranges.COLLECTING.start, last),
        noise=checks.number("noise", settings.noise, 0.0),
    )
    _policy(settings, num_envs=1, task=settings.setup.definition)  # raises an error if there is no such policy
    return settings


def _policy(settings: DatasetSettings, num_envs: int, task: Task | None = None) -> policies.Policy:
    return policies.policy(settings.policy, settings.setup.body, settings.preset_names, num_envs, settings.noise, task)


def _check_same_dataset(storage: Storage, dataset_id: str, provenance: dict, overwrite: bool) -> None:
    """Check that stored episodes have the provenance of the new ones; delete others if they may be overwritten.

    Raises:
        ValueError: there are episodes of another provenance, and they may not be overwritten.
    """
    if storage.metadata is None:
        return
    difference = _difference(storage.metadata["arc_suite"], provenance)
    if difference and storage.kept and not overwrite:
        raise ValueError(f"dataset {dataset_id!r} is another: {difference}; overwrite=True (--overwrite) replaces it")
    if difference:
        storage.clear()


def _difference(stored: dict, present: dict) -> str | None:
    """Return a text on the first difference of two provenances; None if they are equal."""
    stored = _with_versions_by_package(stored)
    present = _with_versions_by_package(present)
    for name, stored_value, value in checks.differences(stored, present):
        field, _, _ = name.partition(".")
        is_unknown = field not in present or (name in (PHYSICS, "policy_sha256") and stored_value is None)
        if is_unknown:  # in one of the two versions of the suite
            continue
        if name == "presets_sha256":
            return f"its presets {' and '.join(present['presets'])} had other numbers"
        return f"its {name} is {checks.quote(repr(stored_value))}, and not {checks.quote(repr(value))}"
    return None


def _with_versions_by_package(provenance: dict) -> dict:
    return provenance["versions"] | provenance | {"versions": None}


def _play(
    storage: Storage,
    settings: DatasetSettings,
    missing: list[int],
    num_envs: int,
    threads,
    progress: Callable[..., Any],
) -> None:
    """Play the missing episodes into the storage."""
    # As few environments as play the episodes in the same number of rounds.
    episodes_per_environment = math.ceil(len(missing) / num_envs)
    num_envs = math.ceil(len(missing) / episodes_per_environment)
    environment = settings.environment(num_envs, threads)
    seeds = [settings.seed + index for index in missing]
    pending = {}  # finished episodes by index
    pending_bytes = 0
    start = time.monotonic()
    writing_seconds = 0.0
    first_count = len(storage.kept)
    total = len(missing) + first_count

    def write():
        nonlocal pending, pending_bytes, writing_seconds
        start_of_writing = time.monotonic()
        not_stored = {index: episode for index, episode in pending.items() if index not in storage.kept}
        if not_stored:
            storage.add(not_stored)
        writing_seconds += time.monotonic() - start_of_writing
        pending = {}
        pending_bytes = 0
        bar.set_postfix_str(f"{len(storage.kept)} of {total} episodes kept", refresh=False)

    with progress(
        desc=settings.setup.name,
        leave=False,
        total=total * settings.steps,
        initial=first_count * settings.steps,
        unit="step",
        unit_scale=True,
    ) as bar:
        try:
            policy = _policy(settings, num_envs, environment.task.definition)
            for step in rollouts.play(environment, policy, seeds, settings.steps):
                bar.update(step.playing)
                for episode in step.finished:
                    pending[episode.seed - settings.seed] = episode._replace(preset=settings.preset(episode.seed))
                    pending_bytes += episode.nbytes
                    bar.update(settings.steps - episode.length)
                    if pending_bytes >= MAX_PENDING_BYTES:
                        write()
                if pending and writing_seconds <= MAX_WRITING_SHARE * (time.monotonic() - start):
                    write()
        finally:
            if pending:
                write()
            environment.close()


def _metadata(dataset_id: str, settings: DatasetSettings, provenance: dict, threads) -> dict:
    """Return Minari's metadata without the counts."""
    preset_names = settings.preset_names
    presets = f" {' and '.join(preset_names)}" if preset_names else ""
    noise = f", with normal noise of standard deviation {settings.noise:g} on its actions" if settings.noise else ""
    environment = settings.environment(evaluation.CURVE_EPISODES, threads)
    with contextlib.closing(environment):
        greatest_reward = terms.greatest(environment.task.definition.settings.weights)
        return {
            "dataset_id": dataset_id,
            "minari_version": minari_version,
            "data_format": "hdf5",
            "jpeg_encoding": False,
            "observation_space": serialize_space(environment.single_observation_space),
            "action_space": serialize_space(environment.single_action_space),
            "env_spec": settings.setup.spec(settings.steps).to_json(),
            "algorithm_name": "-".join([settings.policy, *preset_names]),
            "description": f"{settings.setup} by policy {settings.policy}"
            f"{presets}{noise}; episode k has seed {settings.seed} + k.",
            "requirements": [f"{name}=={version}" for name, version in provenance["versions"].items() if version],
            "ref_min_score": _mean_return(environment, settings._replace(policy="zero", presets=(), noise=0.0)),
            "ref_max_score": greatest_reward * float(environment.step_limit),
            "num_episodes_average_score": evaluation.CURVE_EPISODES,
            "arc_suite": provenance,
        }


def _mean_return(environment: VectorEnv, settings: DatasetSettings) -> float:
    """Return the mean return of the episodes from seed 0 on, one in each environment."""
    policy = _policy(settings, environment.num_envs, environment.task.definition)
    return float(np.mean([episode.total for episode in evaluation.episodes_in_batch(environment, policy)]))
