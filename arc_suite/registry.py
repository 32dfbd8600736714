"""Tables of names: robots, families of bodies, tasks and arenas, including those of other packages.

Of what only demonstrators, wings and the command `arc-suite` know, the tables here hold what other packages add.
"""

import collections
import importlib
import itertools
import os
import pkgutil
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from arc_suite import checks
from arc_suite.arenas import ARENAS, Arena
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import EXAMPLES, body_from_json, load_body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.modifiers import MODIFIERS

# Functions from a seed to a body, by name, or where they are; `registration.register` adds those of other packages.
FAMILIES: dict[str, Callable[[int], Body] | str] = {
    "random": "arc_suite.bodies.families:sound_body",
    "varied": "arc_suite.bodies.families:varied_body",
    "few_legs": "arc_suite.bodies.families:few_legs",
    "few_links": "arc_suite.bodies.families:few_links",
}

# Functions from a path to a body, by extension of the file: robots of others.
READERS = {".xml": "arc_suite.importing:body_of", ".urdf": "arc_suite.importing:body_of"}

# The vector environment of different bodies.
BODIES_ENV = "arc_suite.bodies:BodiesEnv"

# What other packages register, or where it is, by kind and name. What uses it has a table of the suite's own, and
# checks values when it uses them; see `find`.
ADDITIONS: dict[str, dict[str, Any]] = {"law": {}, "network": {}, "algorithm": {}, "clip": {}, "program": {}}

MODULE_OF_NAME = {}  # (kind, name) of what comes from elsewhere -> the module whose import registers it

MAX_BODIES = 1 << 16  # that one name stands for

_SEEDS = re.compile(r"(\d{1,10})(?:-(\d{1,10}))?")
_SEVERAL = re.compile(r",|:\d+-\d+$")


class NotImported(ValueError):
    """A file names a module that has not been imported."""


def resolve(entry: Any) -> Any:
    """Return what an entry of a table stands for: itself, or what `module:name` has where it is imported.

    Tables of the core name what only some users need, which is imported when it is asked for.
    """
    return pkgutil.resolve_name(entry) if isinstance(entry, str) else entry


def tasks_by_domain() -> dict[str, tuple[str, ...]]:
    """Return the names of the tasks by name of the robot, as they are now."""
    return {domain: tuple(TASKS) for domain in ROBOTS}


def all_tasks() -> tuple[tuple[str, str], ...]:
    """Return the names of robot and task, of all pairs there are now."""
    return tuple((domain, task) for domain in ROBOTS for task in TASKS)


def body_of(robot, near: Iterable[str] = ()) -> Body:
    """Return the body that a word stands for.

    Args:
        robot: name of a robot, `module:name` for one of another package, `family:seed`, name of a packaged spec (such
            as spider), path of a file that holds a body or a robot in MJCF or URDF, text of a body's file, or the body
            itself.
        near: other words that are valid in its place, for the error.

    Raises:
        ValueError: an unknown name, a file that holds no body, or several bodies.
        OSError: the file cannot be read.
    """
    body, *others = itertools.islice(_bodies(robot, near), 2)
    if others:
        raise ValueError(f"robot {checks.preview(robot)}: expected one body, got several")
    return body


def bodies_of(robot, near: Iterable[str] = ()) -> tuple[Body, ...]:
    """Return the bodies of `family:first-last`, or of names with commas; else that of `body_of`.

    Raises:
        ValueError: as `body_of`, or a range of more than 65536 bodies.
        OSError: as `body_of`.
    """
    return tuple(_bodies(robot, near))


def robot_words() -> list[str]:
    """Return words for bodies: names of robots, and of packaged specs, and a body of each family."""
    return [*ROBOTS, *EXAMPLES, *(f"{family}:7" for family in FAMILIES)]


def names_several_bodies(robot) -> bool:
    """Return whether a text names several bodies: `family:first-last`, or names with commas."""
    return isinstance(robot, str) and not (robot.startswith("{") or _is_path(robot)) and bool(_SEVERAL.search(robot))


def check_stored_robot(robot: str) -> str:
    """Return what a file names bodies by, if looking it up imports nothing and opens no file but packaged ones.

    Raises:
        ValueError: an unknown name, or the path of a file.
        NotImported: the module of a name has not been imported yet.
    """
    for part in [] if robot.startswith("{") else robot.split(","):
        if not part.rpartition(":")[0] or _is_path(part):
            checks.name(part, (*ROBOTS, *EXAMPLES), "robot", robot_words()[-len(FAMILIES) :])
    for name in names_in_robot(robot):
        refuse_import("robot", name)
    return robot


def names_in_robot(robot: str) -> list[str]:
    """Return the names of robots and families, without seeds, in a text that names bodies."""
    parts = [] if robot.startswith("{") else robot.split(",")
    families = [part.rpartition(":") for part in parts]
    return [family if _SEEDS.fullmatch(seeds) else f"{family}{colon}{seeds}" for family, colon, seeds in families]


def family_of(name: str) -> Callable[[int], Body]:
    """Return the function from a seed to a body of a family, by name or `module:name`.

    Raises:
        ValueError: an unknown name.
    """
    return resolve(_find(name, FAMILIES, "family"))


def _bodies(robot, near: Iterable[str]) -> Iterator[Body]:
    text = robot if isinstance(robot, str) else ""
    family, _, seeds = text.rpartition(":")
    if isinstance(robot, Body):
        yield robot
    elif text.startswith("{"):
        yield body_from_json(text)
    elif (text in EXAMPLES and text not in ROBOTS) or _is_path(robot):
        yield _read(EXAMPLES.get(text, Path(robot)))
    elif "," in text:
        yield from itertools.chain.from_iterable(_bodies(part, near) for part in text.split(","))
    elif family in FAMILIES or ":" in family or (family and _SEEDS.fullmatch(seeds)):  # seeds are no name of a robot
        yield from (_member(family, seed) for seed in _range(family, seeds))
    else:
        yield _find(robot, ROBOTS, "robot", (*robot_words()[len(ROBOTS) :], *near))


def _read(path: Path) -> Body:
    reader = READERS.get(path.suffix.lower())
    return load_body(path) if reader is None else resolve(reader)(path)


def _is_path(robot) -> bool:
    if isinstance(robot, str):
        path = Path(robot)
        return path.suffix.lower() in (".json", *READERS) or (
            ":" not in robot and bool(path.suffix or path.name != robot)
        )
    return isinstance(robot, os.PathLike)


def _range(family: str, seeds: str) -> range:
    """The seeds of `seed` or `first-last`."""
    found = _SEEDS.fullmatch(seeds)
    if not found:
        raise ValueError(
            f"robot '{family}:{seeds}': expected {family}:seed or {family}:first-last, such as {family}:0-9"
        )
    first, last = int(found[1]), int(found[2] or found[1])
    if not first <= last < first + MAX_BODIES:
        raise ValueError(f"robot '{family}:{seeds}': expected seeds in ascending order, at most {MAX_BODIES}")
    return range(first, last + 1)


def _member(family: str, seed: int) -> Body:
    make = family_of(family)
    try:
        body = make(seed)
    except ValueError as error:
        raise ValueError(f"robot '{family}:{seed}': {checks.quote(error)}") from None
    if not isinstance(body, Body):
        raise ValueError(f"family {family!r}: expected a spec.Body of seed {seed}, got {checks.preview(body)}")
    return body


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


def modifier_setting(name: str) -> str | None:
    """Return the setting of a modifier that a name of a setting stands for, `name` or `module:name`.

    None for settings that are no modifier's.

    Raises:
        ValueError: as of other parts of a module.
    """
    if ":" in name:
        _find(name, MODIFIERS, "modifier")
        return bare_name(name)
    return name if name in MODIFIERS else None


def check_stored_settings(settings: Mapping[str, Any]) -> None:
    """Check that settings of a task, as a file gives them, import nothing.

    Raises:
        NotImported: the module of a modifier or of an arena has not been imported yet.
    """
    for name in settings:
        refuse_import("modifier", name)
    refuse_import("arena", str(settings.get("arena", "flat")))


def find(kind: str, name: str, suite: Mapping[str, Any]) -> Any:
    """Return what a name of a kind in `ADDITIONS` stands for.

    Args:
        kind: such as "algorithm".
        name: see `find_entry`.
        suite: the suite's own values, or where they are, by name.

    Raises:
        ValueError: as `find_entry`, or a value that cannot be imported.
    """
    entry = find_entry(kind, name, suite)
    try:
        return resolve(entry)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"{kind} {bare_name(name)!r}: cannot import {entry}: {checks.quote(error)}") from None


def find_entry(kind: str, name: str, suite: Mapping[str, Any]) -> Any:
    """Return the value of a name of a kind in `ADDITIONS`, or the text `module:attribute` that says where it is.

    Args:
        kind: such as "algorithm".
        name: of the suite, or of another package as `name` or `module:name`, whose module is imported.
        suite: the suite's own entries by name.

    Raises:
        ValueError: an unknown name, or one that the suite has and another package registers.
    """
    entry = _find(name, collections.ChainMap(ADDITIONS[kind], dict(suite)), kind)
    if bare_name(name) in suite and bare_name(name) in ADDITIONS[kind]:
        module = MODULE_OF_NAME.get((kind, bare_name(name))) or "__main__"
        raise ValueError(f"{kind} {bare_name(name)!r}: the suite has one of this name, and {module} registers another")
    return entry


def bare_name(name: str) -> str:
    """Return the name in `module:name`, or the name itself."""
    return name.rpartition(":")[2]


def refuse_import(kind: str, name: str) -> str:
    """Return a name that a file gives, `name` or `module:name`, if looking it up imports nothing new.

    Files are data: their names are looked up among the registered ones, and only callers choose what to import.

    Raises:
        NotImported: the name's module has not been imported yet.
    """
    module, colon, _ = name.rpartition(":")
    if colon and module not in sys.modules:
        raise NotImported(f"{kind} {checks.preview(name)}: files import nothing; import {module[:80]!r} first")
    return name


def importable_name(kind: str, name: str) -> str:
    """Return a name as another process can look it up: `module:name` where another package registered it."""
    module = MODULE_OF_NAME.get((kind, name))
    return name if module is None else f"{module}:{name}"


def env_id(domain_name: str, task: type[Task]) -> str:
    """Return Gymnasium's id of a robot's task."""
    return f"arc_suite/{domain_name}-{task.name}-v{task.version}"


def import_module(module: str, subject: str) -> None:
    """Import a module that a caller names.

    Args:
        module: its name.
        subject: with which an error begins.

    Raises:
        ValueError: it cannot be imported.
    """
    try:
        importlib.import_module(module)
    except ImportError as error:
        cause = f"cannot import {module[:80]}: {checks.quote(error)}"
        remedy = f"; start in the folder of {module[:80]}.py, or put it on Python's path"
        raise ValueError(f"{subject}: {cause}{remedy if error.name == module else ''}") from None


def _find(name, table: Mapping, kind: str, near: Iterable[str] = ()):
    if isinstance(name, str) and ":" in name:
        module, _, name = name.rpartition(":")
        if not all(part.isidentifier() for part in module.split(".")):
            given = checks.preview(f"{module}:{name}")
            raise ValueError(f"{kind} {given}: expected module:name, with a module that can be imported")
        import_module(module, f"{kind} {name[:80]!r}")
        if name not in table:
            hint = checks.hint(name, [own for own in table if MODULE_OF_NAME.get((kind, own)) == module])
            raise ValueError(f"{kind} {name[:80]!r}: {module} registers no such {kind} by arc_suite.register{hint}")
        if (kind, name) not in MODULE_OF_NAME:
            raise ValueError(f"{kind} '{module}:{name}': {name} is the suite's own, expected without a module")
    return table[checks.name(name, table, kind, near)]
