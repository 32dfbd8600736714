"""Tables of names: robots, families of bodies, tasks and arenas, including those of other packages."""

import importlib
import os
import re
import sys
from collections.abc import Callable, Mapping

from arc_suite import checks
from arc_suite.arenas import ARENAS, Arena
from arc_suite.models.families import FAMILIES
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_from_json, load_body
from arc_suite.tasks import TASKS, Task

MODULES = {}  # (kind, name) of what comes from elsewhere -> the module whose import registers it


MOST_BODIES = 1 << 16  # that one name stands for

_SEEDS = re.compile(r"(\d{1,10})(?:-(\d{1,10}))?")


class NotImported(ValueError):
    """A file names a module that has not been imported."""


def tasks_by_domain() -> dict[str, tuple[str, ...]]:
    """Return the names of the tasks by name of the robot, as they are now."""
    return {domain: tuple(TASKS) for domain in ROBOTS}


def all_tasks() -> tuple[tuple[str, str], ...]:
    """Return the names of robot and task, of all pairs there are now."""
    return tuple((domain, task) for domain in ROBOTS for task in TASKS)


def body_of(domain) -> Body:
    """Return the body of a domain.

    Args:
        domain: name of a robot, `family:seed`, path of a file that holds a body (a `Path`, or a string that
            ends in .json), the text of such a file, or the body itself.

    Raises:
        ValueError: an unknown name, a file that holds no body, or several bodies.
        OSError: the file cannot be read.
    """
    members = _members(domain)
    if members is None:
        return _single(domain)
    if len(members[1]) > 1:
        raise ValueError(f"domain {domain!r}: expected one body, got {len(members[1])}")
    return _member(members[0], members[1][0])


def bodies_of(domain) -> tuple[Body, ...]:
    """Return the bodies of a domain: those of `family:first-last`, else that of `body_of`.

    Raises:
        ValueError: as `body_of`, or more than 65536 bodies.
        OSError: as `body_of`.
    """
    members = _members(domain)
    return (_single(domain),) if members is None else tuple(_member(members[0], seed) for seed in members[1])


def family_of(name: str) -> Callable[[int], Body]:
    """Return the function from a seed to a body of a family, by name or `module:name`.

    Raises:
        ValueError: an unknown name.
    """
    return _find(name, FAMILIES, "family")


def _members(domain) -> tuple[str, range] | None:
    """The family and the seeds of `family:seed`, `module:family:seed` or a range of them; None for other domains."""
    if not isinstance(domain, str) or domain.startswith("{"):
        return None
    family, _, seeds = domain.rpartition(":")
    found = _SEEDS.fullmatch(seeds)
    if not (family in FAMILIES or ":" in family or (family and found)):  # seeds are no name of a robot
        return None
    if not found:
        raise ValueError(f"domain {domain!r}: expected {family}:seed or {family}:first-last, such as {family}:0-9")
    first, last = int(found[1]), int(found[2] or found[1])
    if not first <= last < first + MOST_BODIES:
        raise ValueError(f"domain {domain!r}: expected seeds in ascending order, at most {MOST_BODIES}")
    return family, range(first, last + 1)


def _member(family: str, seed: int) -> Body:
    body = family_of(family)(seed)
    if not isinstance(body, Body):
        raise ValueError(f"family {family!r}: expected a spec.Body of seed {seed}, got {body!r}")
    return body


def _single(domain) -> Body:
    if isinstance(domain, Body):
        return domain
    if isinstance(domain, os.PathLike) or (isinstance(domain, str) and domain.endswith(".json")):
        return load_body(domain)
    if isinstance(domain, str) and domain.startswith("{"):
        return body_from_json(domain)
    return _find(domain, ROBOTS, "domain")


def task_of(name: str) -> type[Task]:
    """Return the task of a name; see `arc_suite.load`.

    Raises:
        ValueError: an unknown name.
    """
    return _find(name, TASKS, "task")


def arena_of(arena: str | Arena, body: Body) -> Arena:
    """Return the arena of a name, made to suit a body, or the arena itself.

    Raises:
        ValueError: an unknown name.
    """
    return arena if isinstance(arena, Arena) else arena_maker(arena)(body)


def arena_maker(name: str) -> Callable[[Body], Arena]:
    """Return the function that makes the arena of a name suit a body.

    Raises:
        ValueError: an unknown name.
    """
    return _find(name, ARENAS, "arena")


def imported(kind: str, name: str) -> str:
    """Return a name that a file gives, `name` or `module:name`, if looking it up imports nothing new.

    Files are data: their names are looked up among the registered ones, and only callers choose what to import.

    Raises:
        NotImported: the name's module has not been imported yet.
    """
    module, colon, _ = name.rpartition(":")
    if colon and module not in sys.modules:
        raise NotImported(f"{kind} {name[:80]!r}: files import nothing; import {module[:80]!r} first")
    return name


def importable(kind: str, name: str) -> str:
    """Return a name as another process can look it up: `module:name` where another package registered it."""
    module = MODULES.get((kind, name))
    return name if module is None else f"{module}:{name}"


def env_id(domain_name: str, task: type[Task]) -> str:
    """Return Gymnasium's id of a robot's task."""
    return f"arc_suite/{domain_name}-{task.name}-v{task.version}"


def _find(name, table: Mapping, kind: str):
    if isinstance(name, str) and ":" in name:
        module, _, name = name.rpartition(":")
        if not all(part.isidentifier() for part in module.split(".")):
            raise ValueError(f"{kind} '{module}:{name}': expected module:name, with a module that can be imported")
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise ValueError(f"{kind} {name!r}: cannot import {module}: {error}") from None
        if name in table and (kind, name) not in MODULES:
            raise ValueError(f"{kind} '{module}:{name}': {name} is the suite's own, expected without a module")
    return table[checks.name(name, table, kind)]
