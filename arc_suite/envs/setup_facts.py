"""Facts that tell the setups of environments apart: body, task, arena, and all settings, by name.

Snapshots contain them, since arrays of another setup may have the same shapes.
"""

import dataclasses
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite import checks, registry
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks import Task

_MAX_TEXT = 80  # characters of a value that is stored as text; of a longer one the hash is stored
_HASH_DIGITS = 12
_DIGITS = 9  # significant digits of numbers, as machines may differ in the last ones
_CACHED_TASKS = 16


@registry.cache_until_registration(maxsize=_CACHED_TASKS)
def describe(task: Task) -> str:
    """Return the facts of a task's setup as JSON of texts by name.

    Numbers of the settings have names such as `parameters.duty_factor`. Long values are replaced by their hashes.
    """
    body = task.scene.body
    facts = {
        "body": f"{registry.distinct_name(body)} {_hash(body_to_json(body))}",
        "task": f"{task.name}-v{task.version}",
        "arena": type(task.scene.arena).__name__,
        "step limit": repr(task.step_limit),
    }
    modifiers = getattr(task, "changes", ())
    parts = {"settings": task.settings, "arena": task.scene.arena}
    parts |= {type(modifier).__name__.lower(): modifier for modifier in modifiers}
    for part_name, part in parts.items():
        for path, value in _leaves(part_name, part):
            facts[path.removeprefix("settings.")] = _to_text(value)
    return json.dumps(facts)


def check_equal(facts_of_environment: str, facts_of_snapshot: Any) -> None:
    """Refuse the facts of a snapshot that differ from those of an environment; names that only one has are ignored.

    Args:
        facts_of_environment: JSON.
        facts_of_snapshot: JSON, unchecked.

    Raises:
        ValueError: a difference, or no such JSON.
    """
    expected_facts = json.loads(facts_of_environment)
    facts = checks.mapping("setup", json.loads(facts_of_snapshot))
    for name, expected in expected_facts.items():
        fact = facts.get(name, expected)
        if fact != expected:
            raise ValueError(f"{name} {checks.preview(fact)}, where this environment has {expected!r}")


def _leaves(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the values in a tree of records and mappings, each with its path, names with dots between them."""
    children = _children(value)
    if children is None:
        yield path, value
        return
    for name, child in children.items():
        yield from _leaves(f"{path}.{name}", child)


def _children(value: Any) -> Mapping[str, Any] | None:
    """Return the fields of a dataclass or NamedTuple, or the items of a mapping, by name; None for other values."""
    if dataclasses.is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if hasattr(value, "_asdict"):
        return value._asdict()
    if isinstance(value, Mapping):
        return {str(name): child for name, child in value.items()}
    return None


def _to_text(value: Any) -> str:
    """Return a value as text: JSON, or the hash of it."""
    text = json.dumps(_to_plain(value))
    return text if len(text) <= _MAX_TEXT else _hash(text)


def _to_plain(value: Any) -> Any:
    """Return a value in JSON's types, with rounded numbers; the name of its class if there is no such form."""
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}")
    if isinstance(value, (np.ndarray, np.generic)):
        return _to_plain(value.tolist())
    children = _children(value)
    if children is not None:
        return {name: _to_plain(child) for name, child in children.items()}
    if isinstance(value, Sequence):
        return [_to_plain(child) for child in value]
    return type(value).__name__


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:_HASH_DIGITS]
