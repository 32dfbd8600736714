"""Entries of a leaderboard: files of `arc-suite evaluate --json`, checked by playing their episodes again."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from arc_suite import checks, files, policies, registry, versions
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol, provenance
from arc_suite.evaluation.protocol import EPISODES
from arc_suite.seed_ranges import Ranges

_MAX_BYTES = 1 << 20


class Entry(NamedTuple):
    """An evaluation of a policy on one robot.

    Attributes:
        setup: body, task and settings.
        policy: its name, as on the command line.
        preset: of the demonstrator; None for other policies.
        policy_sha256: hash of its files; None for a policy without files.
        training_seeds: of the episodes that it learned from; None if they are unknown.
        episodes: results of the protocol's episodes.
    """

    setup: Setup
    policy: str
    preset: str | None
    policy_sha256: str | None
    training_seeds: Ranges | None
    episodes: list[protocol.EpisodeResult]


def read(path: Path) -> dict[str, Any]:
    """Return the JSON of an entry.

    Raises:
        ValueError: no JSON of `arc-suite evaluate`.
        OSError: it cannot be read.
    """
    try:
        with files.reading(path):
            found = checks.mapping("entry", files.read_json(path, _MAX_BYTES))
        for name in ("policy", "seed", "versions", "robots", "policy_sha256"):
            if name not in found:
                raise ValueError(f"expected a field {name}, got none")
        for report in checks.mapping("robots", found["robots"]).values():
            checks.mapping("provenance", checks.mapping("report", report).get("provenance"))
        return dict(found)
    except ValueError as error:
        raise ValueError(f"{path}: no entry: {checks.quoted(error)}") from None


def checked(path: Path, policy: str | None, progress=lambda seeds: seeds) -> list[Entry]:
    """Return the entries of a file, one for each robot, after playing their episodes again.

    The file imports nothing and names no policy file: the caller does.

    Args:
        path: of the file that `arc-suite evaluate --json` wrote.
        policy: name of the policy; None for one that needs no files.
        progress: wraps the seeds of a robot.

    Raises:
        ValueError: no entry; other versions, body, model, task or policy than the file says; or other episodes.
        OSError: a file cannot be read.
    """
    found = read(path)
    here = versions.recorded()
    _same(path, "versions", found["versions"], here)
    name = found["policy"] if policy is None else policy
    if policy is None and name not in policies.POLICIES:
        raise ValueError(f"{path}: policy {checks.quoted(name)!r}: expected --policy with its file, got none")
    _same(path, "policy_sha256", found["policy_sha256"], provenance.policy_sha256(name))
    if found["policy_sha256"] is None:  # files may lie elsewhere; without them the name alone tells policies apart
        _same(path, "policy", found["policy"], name)
    if found["seed"] != 0:
        raise ValueError(f"{path}: expected episodes from seed 0, got {checks.quoted(found['seed'])}")
    training_seeds = provenance.training_seeds(name, range(EPISODES))
    entries = []
    if not found["robots"]:
        raise ValueError(f"{path}: expected robots, got none")
    for report in found["robots"].values():
        stated = report["provenance"]
        try:
            setup, preset = Setup.from_dict(stated), report.get("preset")
            if preset is not None:
                checks.name(checks.quoted(preset), policies.preset_names(), "preset")
        except (ValueError, registry.NotImported) as error:
            raise ValueError(f"{path}: {error}") from None
        totals = _totals(report)
        if len(totals) != EPISODES:
            wanted = f"expected {EPISODES} episodes of {setup.body.name}"
            raise ValueError(f"{path}: {wanted}, got {len(totals)}; evaluate without --episodes")
        known = provenance.of_setup(setup)
        for field in provenance.FIELDS:
            _same(path, field, stated.get(field), known[field])
        environment = setup.load()
        player = policies.policy(name, setup.body, preset, task=environment.task.definition)
        episodes = protocol.episodes(environment, player, progress(range(EPISODES)))
        _same(path, f"returns of {setup.body.name}", totals, [each.total for each in episodes])
        entries.append(Entry(setup, name, preset, found["policy_sha256"], training_seeds, episodes))
    return entries


def _totals(report: Mapping[str, Any]) -> list:
    episodes = report.get("episodes")
    if not isinstance(episodes, Iterable):
        return []
    return [each.get("total") if isinstance(each, dict) else None for each in episodes]


def _same(path: Path, name: str, told, here) -> None:
    if told != here:
        told, here = (checks.quoted(json.dumps(each)) for each in (told, here))
        raise ValueError(f"{path}: {name}: the file says {told}, and here it is {here}")
