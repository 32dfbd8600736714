"""Tables of names: robots, families of bodies, tasks and arenas, including those of other packages.

Other packages also register laws, networks, algorithms, clips, goals and axes of a search, and programs. The tables
here contain only those additions: the suite's own entries of these kinds stand in the modules that use them.
"""

import collections
import difflib
import functools
import hashlib
import importlib
import itertools
import json
import os
import pkgutil
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

from arc_suite import checks, files, parsers
from arc_suite.arenas import ARENAS, Arena, ground_text
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import EXAMPLES, body_from_json, body_to_json, hint_in_folder, load_body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.modifiers import MODIFIERS

# Functions from a seed to a body, by name, or texts `module:name` for `resolve`; `registration.register` adds those of
# other packages.
FAMILIES: dict[str, Callable[[int], Body] | str] = {
    "random": "arc_suite.bodies.families:sound_body",
    "varied": "arc_suite.bodies.families:varied_body",
    "few_legs": "arc_suite.bodies.families:few_legs",
    "few_links": "arc_suite.bodies.families:few_links",
}

# Functions from the path of a foreign file to a body, by the file's extension, as texts for `resolve`.
READERS = {".xml": "arc_suite.importing:body_of", ".urdf": "arc_suite.importing:body_of"}

# Functions from the path of a file and a scale to ground as text, by the file's extension, as texts for `resolve`.
GROUND_READERS = dict.fromkeys((".png", ".obj", ".stl", ".xml"), "arc_suite.importing.grounds:read")

# The class of vector environments of different bodies, as a text for `resolve`.
BODIES_ENV = "arc_suite.bodies:BodiesEnv"
REFUSAL_OF_ONE_BODY = "arc_suite.bodies.environments:refuse_one_environment"

# Values that other packages register, or texts `module:attribute` for `resolve`, by kind and name. The module that uses
# a kind has a table of the suite's own values, and checks all values when it uses them; see `find`.
ADDITIONS: dict[str, dict[str, Any]] = {
    kind: {} for kind in ("law", "network", "algorithm", "clip", "goal", "axis", "program")
}

# (kind, name) of what other packages register -> the module whose import registers it.
MODULE_OF_NAME = {}

# Robot and task of each place of the benchmark.
BENCHMARKING = (
    *(("queen", "walk"), ("bastion", "walk"), ("tick", "walk"), ("leaper", "walk")),
    *(("queen", "steer"), ("tick", "steer"), ("leaper", "steer")),
    *(("tick", "rough"), ("queen", "gaps"), ("tick", "navigate")),
)

_Value = TypeVar("_Value")

SETTINGS_OF_EVERY_TASK = ("time_limit", "arena", "random", "on_divergence")

MAX_BODIES = 1 << 16  # the most bodies that one text may name

_NAME_IN_MODULE = "module:name to import it"  # among the choices that errors list
_SAME_WORD = 0.8  # least similarity of a misspelled name, up to 1
_MAX_QUOTE = 80  # characters of a name in an error
_SEED_OR_RANGE = re.compile(r"(\d{1,10})(?:-(\d{1,10}))?")  # "7" or "0-9"
_GYMNASIUM_ID = re.compile(r"(?:arc_suite/)?(\w{1,40})-(\w{1,40})-v\d{1,3}")
_GROUND_FILE = re.compile(r"(.*?\.[a-zA-Z]\w{0,4})(?::([\d.][\d.ex+-]{0,100}))?", re.DOTALL)  # a path, and its scale
_MARK_OF_SEVERAL_BODIES = re.compile(r",|:\d+-\d+$")  # a comma, or a range of seeds at the end


class NotImported(ValueError):
    """A file names a module that has not been imported."""


def resolve(entry: Any) -> Any:
    """Return the value of a table's entry: the object that a text `module:name` stands for, or the entry itself.

    Tables contain texts for objects that only some users need. Their modules are imported here, at the first use.
    """
    return pkgutil.resolve_name(entry) if isinstance(entry, str) else entry


def tasks_by_domain() -> dict[str, tuple[str, ...]]:
    """Return the names of all present tasks by name of the robot."""
    return {domain: tuple(TASKS) for domain in ROBOTS}


def all_tasks() -> tuple[tuple[str, str], ...]:
    """Return all present pairs of a robot's and a task's name."""
    return tuple((domain, task) for domain in ROBOTS for task in TASKS)


def body_of(robot: str | os.PathLike[str] | Body, suggestions: Iterable[str] = ()) -> Body:
    """Return the body that a word stands for.

    Args:
        robot: name of a robot, `module:name` for one of another package, `family:seed`, name of a packaged spec (such
            as spider), path of a file with a body or a robot in MJCF or URDF, text of a body's file, or the body
            itself.
        suggestions: further words that the caller accepts; the error of an unknown name lists them, too.

    Raises:
        ValueError: an unknown name, a file that contains no body, or several bodies.
        OSError: the file cannot be read.
    """
    bodies = list(itertools.islice(_generate_bodies(robot, suggestions), 2))  # a second one is an error
    if len(bodies) > 1:
        raise ValueError(f"robot {checks.preview(robot)}: expected one body, got several")
    return bodies[0]


def bodies_of(robot, suggestions: Iterable[str] = ()) -> tuple[Body, ...]:
    """Return the bodies of `family:first-last`, or of names and files with commas between; else the one of `body_of`.

    Raises:
        ValueError: as `body_of`, or a range of more than 65536 bodies.
        OSError: as `body_of`.
    """
    return tuple(_generate_bodies(robot, suggestions))


_Cached = TypeVar("_Cached", bound=Callable)
_caches: list[Any] = []  # functions whose results depend on registered names


def cache_until_registration(maxsize: int) -> Callable[[_Cached], _Cached]:
    """Return a decorator that keeps results of a function until `forget_results`: they depend on registered names.

    Args:
        maxsize: number of results, as of `functools.lru_cache`.
    """

    def decorate(function: _Cached) -> _Cached:
        cached_function = functools.lru_cache(maxsize=maxsize)(function)
        _caches.append(cached_function)
        return cast(_Cached, cached_function)

    return decorate


def forget_results() -> None:
    """Forget the results that functions of `cache_until_registration` keep, as a new name may change them."""
    for cached_function in _caches:
        cached_function.cache_clear()


@cache_until_registration(maxsize=1024)
def distinct_name(body: Body) -> str:
    """Return the name of a body for ids, tables and files, with a hash if the suite has another body of that name."""
    named_body = _find_body(body.name)
    if named_body is None or named_body == body:
        return body.name
    return f"{body.name}_{hashlib.sha256(body_to_json(body).encode()).hexdigest()[:6]}"


def _find_body(name: str) -> Body | None:
    """Return the robot, the packaged spec, or the body `family_seed` of a name; None if there is none."""
    if name in ROBOTS:
        return ROBOTS[name]
    if name in EXAMPLES:
        return load_body(EXAMPLES[name])
    family, _, seed = name.rpartition("_")
    if family not in FAMILIES or not seed.isdecimal():
        return None
    try:
        return _draw_body(family, int(seed))
    except ValueError:  # no body of this seed
        return None


def is_body_of_suite(body: Body) -> bool:
    """Return whether a body is a robot, a packaged spec or of a family of the suite, which no package registered."""
    family, _, _ = body.name.rpartition("_")
    is_registered = ("robot", body.name) in MODULE_OF_NAME or ("family", family) in MODULE_OF_NAME
    return not is_registered and _find_body(body.name) == body


def robot_words() -> list[str]:
    """Return words for bodies: names of all robots and packaged specs, and for each family one of its bodies."""
    return [*ROBOTS, *EXAMPLES, *_family_words()]


def names_several_bodies(robot) -> bool:
    """Return whether a text names several bodies: `family:first-last`, or names and files with commas between."""
    if isinstance(robot, str) and _is_json_list(robot):
        return True
    if not isinstance(robot, str) or _is_json(robot) or _is_path(robot):
        return False
    return _MARK_OF_SEVERAL_BODIES.search(robot) is not None


def check_stored_robot(robot: str) -> str:
    """Return the text by which a file names bodies, after a check that it cannot import modules or open other files.

    Raises:
        ValueError: an unknown name, or the path of a file.
        NotImported: the module of a name has not been imported yet.
    """
    for part in split_bodies(robot):
        if _is_json(part):  # has no names
            continue
        module_or_family, _, _ = part.rpartition(":")
        if not module_or_family or _is_path(part):
            checks.name(part, (*ROBOTS, *EXAMPLES), "robot", suggestions=_family_words())
    for name in names_in_robot(robot):
        refuse_import("robot", name)
    return robot


def names_in_robot(robot: str) -> list[str]:
    """Return the names of robots and families, without seeds, in a text that names bodies."""
    names = []
    for part in split_bodies(robot):
        if not _is_json(part):
            names.append(family_in(part) or part)
    return names


def split_bodies(robot: str) -> list[str]:
    """Return the parts of a text that names bodies: a name, a range, a file, or the JSON of a body.

    Raises:
        ValueError: a list of JSON that holds anything else.
    """
    if _is_json(robot):
        return [robot]
    if not _is_json_list(robot):
        return robot.split(",")
    with parsers.guard("robot"):
        parts = json.loads(robot)
    if not parts or not all(isinstance(part, str) for part in parts):
        raise ValueError(f"robot {checks.preview(robot)}: expected a list of names and of bodies' texts")
    return parts


def join_bodies(parts: Sequence[str]) -> str:
    """Return the text that `split_bodies` splits into these parts: a list of JSON if one of them is JSON."""
    return json.dumps(parts) if any(map(_is_json, parts)) else ",".join(parts)


def embed_bodies(robot: str) -> str:
    """Return a text that names several bodies for other processes.

    It has the JSON of bodies in place of their files, and `module:name` for names of other packages.

    Raises:
        ValueError: a file that contains no body.
        OSError: a file that cannot be read.
    """
    return join_bodies([_embed_body(part) for part in split_bodies(robot)])


def _embed_body(part: str) -> str:
    """Return a part of a text that names several bodies; see `embed_bodies`."""
    if _is_path(part):
        return body_to_json(_read_file(Path(part)))
    if _is_json(part):
        return part
    family = family_in(part)
    return _add_module("family", family) + part.removeprefix(family) if family else _add_module("robot", part)


def label_bodies(robot: str) -> str:
    """Return a text that names several bodies for people: with names in place of JSON, and without modules."""
    return ",".join(map(_label_body, split_bodies(robot)))


def _label_body(part: str) -> str:
    """Return a part of a text that names several bodies; see `label_bodies`."""
    if _is_json(part):
        return distinct_name(body_from_json(part))
    family = family_in(part)
    return bare_name(family) + part.removeprefix(family) if family else bare_name(part)


def family_in(part: str) -> str:
    """Return the family of `family:seed` or `family:first-last`, as `module:family`, too; "" for another part."""
    family, _, seeds = part.rpartition(":")
    return family if _SEED_OR_RANGE.fullmatch(seeds) else ""


def family_of(name: str) -> Callable[[int], Body]:
    """Return a family's function from a seed to a body, by `name` or `module:name`.

    Raises:
        ValueError: an unknown name.
    """
    return resolve(_look_up(name, FAMILIES, "family"))


def _generate_bodies(robot, suggestions: Iterable[str]) -> Iterator[Body]:
    """Yield the bodies that a word of `body_of`, or names with commas between, stand for."""
    text = robot if isinstance(robot, str) else ""
    family, _, seeds = text.rpartition(":")
    is_example = text in EXAMPLES and text not in ROBOTS
    names_family = family in FAMILIES or ":" in family  # the latter as module:family
    if isinstance(robot, Body):
        yield robot
    elif _is_json(text):
        yield body_from_json(text)
    elif _is_json_list(text):
        for part in split_bodies(text):
            yield from _generate_bodies(part, suggestions)
    elif is_example:
        yield load_body(EXAMPLES[text])
    elif _is_path(robot) and not _GYMNASIUM_ID.fullmatch(text):
        yield _read_file(Path(robot))
    elif "," in text:
        for part in text.split(","):
            yield from _generate_bodies(part, suggestions)
    elif names_family or (family and _SEED_OR_RANGE.fullmatch(seeds)):  # a robot's name has no seeds
        for seed in _parse_seeds(family, seeds):
            yield _draw_body(family, seed)
    else:
        _refuse_other_words(text)
        yield _look_up(robot, ROBOTS, "robot", (*EXAMPLES, *_family_words(), *suggestions))


def _refuse_other_words(text: str) -> None:
    """Raise ValueError for a word that names a task, a folder or an address in place of a body."""
    if text in ROBOTS:
        return
    _refuse_gymnasium_id("robot", text)
    if files.is_address(text):
        raise ValueError(f"robot {checks.preview(text)}: {files.ADDRESS_CURE}")
    if text in TASKS:
        raise ValueError(f"robot {text!r}: it is a task; robots are {', '.join(ROBOTS)}")
    _refuse_name_of_file("robot", text, (".json", *READERS), robot_words())
    if files.is_folder(text):
        extensions = ", ".join((".json", *READERS))
        hint = hint_in_folder(text)
        raise ValueError(f"robot {checks.preview(text)}: it is a folder; expected a name, or a file {extensions}{hint}")
    is_similar_to_word = bool(checks.hint(text, robot_words()))
    file_cure = "" if is_similar_to_word else files.suggest_similar_file(text, (".json", *READERS))
    if file_cure:
        raise ValueError(f"unknown robot {checks.preview(text)}{file_cure}")


def _refuse_gymnasium_id(kind: str, text: str) -> None:
    """Raise ValueError for an id of Gymnasium in place of a robot or a task."""
    match = _GYMNASIUM_ID.fullmatch(text)
    if match and match[1] in robot_words() and match[2] in TASKS:
        raise ValueError(f"{kind} {text!r}: it is an id of Gymnasium; its robot is {match[1]}, its task {match[2]}")


def _refuse_name_of_file(kind: str, text: str, extensions: Iterable[str], names: Iterable[str]) -> None:
    """Raise ValueError for a word that is the name of a file without its extension; the error lists names."""
    cure = files.suggest_extension(text, extensions)
    if cure:
        choices = checks.list_choices([*names, _NAME_IN_MODULE])
        raise ValueError(f"unknown {kind} {checks.preview(text)}{cure} {choices}")


def _family_words() -> list[str]:
    """Return one body of each family as `family:seed`, such as errors suggest."""
    return [f"{family}:7" for family in FAMILIES]


def is_file_or_module(word: str) -> bool:
    """Return whether a word for bodies is a file, or has a module or seeds."""
    return _is_path(word) or ":" in word


def _is_json(text: str) -> bool:
    return text.startswith("{")


def _is_json_list(text: str) -> bool:
    return text.startswith("[")


def _is_path(robot) -> bool:
    """Return whether a word stands for a file: by its type, its extension, or a separator of folders."""
    if not isinstance(robot, str):
        return isinstance(robot, os.PathLike)
    if "," in robot and not os.path.exists(robot):  # several words
        return False
    path = Path(robot)
    if path.suffix.lower() in (".json", *READERS):
        return True
    has_folder = path.name != robot
    return ":" not in robot and (path.suffix != "" or has_folder)


def _read_file(path: Path) -> Body:
    if path.stem in robot_words() and not path.exists() and not files.is_address(str(path)):
        raise FileNotFoundError(f"cannot read {path}: no such file or directory; did you mean {path.stem}?")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        return load_body(path)
    return resolve(reader)(path)


def _parse_seeds(family: str, seeds: str) -> range:
    """Return the seeds in a text `seed` or `first-last`.

    Raises:
        ValueError: another text, or seeds that are too many or not in ascending order.
    """
    match = _SEED_OR_RANGE.fullmatch(seeds)
    if match is None:
        raise ValueError(
            f"robot '{family}:{seeds}': expected {family}:seed or {family}:first-last, such as {family}:0-9"
        )
    first = int(match[1])
    last = first if match[2] is None else int(match[2])
    if not first <= last < first + MAX_BODIES:
        raise ValueError(f"robot '{family}:{seeds}': expected seeds in ascending order, at most {MAX_BODIES}")
    return range(first, last + 1)


def _draw_body(family: str, seed: int) -> Body:
    """Return the body of a seed in a family.

    Raises:
        ValueError: the family is unknown, has no body of this seed, or its function returns no body.
    """
    make = family_of(family)
    try:
        body = make(seed)
    except ValueError as error:
        raise ValueError(f"robot '{family}:{seed}': {checks.quote(error)}") from None
    if not isinstance(body, Body):
        raise ValueError(f"family {family!r}: expected a spec.Body of seed {seed}, got {checks.preview(body)}")
    return body


def task_of(name: str) -> type[Task]:
    """Return the class of a task, by `name` or `module:name`.

    Raises:
        ValueError: an unknown name.
    """
    if isinstance(name, str) and name not in TASKS and name in robot_words():
        raise ValueError(f"task {name!r}: it is a robot; tasks are {', '.join(TASKS)}")
    if isinstance(name, str):
        _refuse_gymnasium_id("task", name)
    return _look_up(name, TASKS, "task")


def tasks_of(names: str) -> tuple[type[Task], ...]:
    """Return the classes of one task or of several, names with commas between.

    Raises:
        ValueError: an unknown name.
    """
    return tuple(task_of(name) for name in split_task_names(names))


def split_task_names(names: Any) -> list:
    """Return the names in a text that names tasks; anything else is one name, which `task_of` refuses."""
    return names.split(",") if isinstance(names, str) else [names]


def arena_of(arena: str | os.PathLike[str] | Arena, body: Body) -> Arena:
    """Return the arena of a word in a size that suits a body; an `Arena` is returned as it is.

    Raises:
        ValueError: as `arena_maker`, ground of a file that is too small for the body, or a function of another package
            that returns no `Arena`.
        OSError: the file cannot be read.
    """
    if isinstance(arena, Arena):
        return arena
    ground = arena_maker(arena)(body)
    if not isinstance(ground, Arena):
        raise ValueError(
            f"arena {checks.preview(arena)}: expected an Arena of its function, got {checks.preview(ground)}"
        )
    return ground


def arena_maker(arena: str | os.PathLike[str]) -> Callable[[Body], Arena]:
    """Return the function from a body to the arena that a word stands for.

    Args:
        arena: name of an arena, `module:name` for one of another package, path of a file with ground and its scale, or
            ground as text.

    Raises:
        ValueError: an unknown name, or a file or a text without ground.
        OSError: the file cannot be read.
    """
    word = arena_word(arena)
    if ground_text.is_text(word):
        return ground_text.fit(word)
    if isinstance(word, str) and word not in ARENAS:
        _refuse_name_of_file("arena", word, GROUND_READERS, ARENAS)
    return _look_up(word, ARENAS, "arena")


def arena_word(arena: str | os.PathLike[str]) -> str:
    """Return the word for an arena that files may contain.

    It is ground as text in place of its file, and `module:name` for a name of another package.

    Raises:
        ValueError: as `arena_maker`.
        OSError: as `arena_maker`.
    """
    word = os.fspath(arena) if isinstance(arena, os.PathLike) else arena
    ground_file = _ground_file(word)
    if ground_file is None:
        return _add_module("arena", word) if isinstance(word, str) else word
    path, scale = ground_file
    reader = GROUND_READERS.get(path.suffix.lower())
    if reader is None:
        extensions = ", ".join(GROUND_READERS)
        raise ValueError(f"arena {checks.preview(arena)}: expected a file {extensions}, or one of {', '.join(ARENAS)}")
    return resolve(reader)(path, scale)


def names_arena(arena: Any) -> bool:
    """Return whether a word is the name of an arena, and neither a file nor ground as text."""
    return isinstance(arena, str) and _ground_file(arena) is None and not ground_text.is_text(arena)


def _ground_file(arena: str) -> tuple[Path, str | None] | None:
    """Return the path and the scale of a word that stands for a file; None for other words."""
    if not isinstance(arena, str) or ground_text.is_text(arena):
        return None
    match = _GROUND_FILE.fullmatch(arena)
    return None if match is None else (Path(match[1]), match[2])


def modifier_setting(name: str) -> str | None:
    """Return the bare name of a modifier's setting, given `name` or `module:name`.

    None for the name of a setting that belongs to no modifier.

    Raises:
        ValueError: the module cannot be imported, or registers no such setting.
    """
    if ":" in name:
        _look_up(name, MODIFIERS, "modifier")
        return bare_name(name)
    return name if name in MODIFIERS else None


def task_setting_names() -> set[str]:
    """Return the names of the settings of all tasks, without those of modifiers."""
    names = set(SETTINGS_OF_EVERY_TASK)
    for task in TASKS.values():
        names.update(task.names())
    return names


def setting_names() -> set[str]:
    """Return the names of the settings of all tasks and of modifiers."""
    return task_setting_names() | MODIFIERS.keys()


def refuse_settings_of_others(task: type[Task], settings: Iterable[str]) -> None:
    """Raise ValueError for a setting that a task lacks and others have; none where the task does not list its own."""
    if not task.names():
        return
    names = (*task.names(), *SETTINGS_OF_EVERY_TASK)
    for name in settings:
        if name in names or difflib.get_close_matches(str(name), names, n=1, cutoff=_SAME_WORD):
            continue
        task_names = [key for key, kind in TASKS.items() if name in kind.names()]
        if task_names:
            verb = "has" if len(task_names) == 1 else "have"
            raise ValueError(f"setting {name!r}: {task.name} has none; {', '.join(task_names)} {verb} it")


def check_stored_settings(settings: Mapping[str, Any]) -> None:
    """Check that settings of a task which come from a file cannot import modules or open other files.

    Raises:
        ValueError: an arena or another setting that is a file.
        NotImported: the module of a modifier or of an arena has not been imported yet.
    """
    for name in settings:
        refuse_import("modifier", name)
    arena = str(settings.get("arena", "flat"))
    if _ground_file(arena) is not None:
        raise ValueError(f"arena {checks.preview(arena)}: what is stored cannot name a file")
    if names_arena(arena):
        refuse_import("arena", arena)
    for task in TASKS.values():
        for name in task.file_settings.keys() & settings.keys():
            if task.file_settings[name].names_file(settings[name]):
                raise ValueError(f"{name} {checks.preview(settings[name])}: what is stored cannot name a file")


def find(kind: str, name: str, suite: Mapping[str, Any]) -> Any:
    """Return the value of a name, such as the algorithm of a name.

    Args:
        kind: one of `ADDITIONS`, such as "algorithm".
        name: see `find_entry`.
        suite: the suite's own values of the kind by name, or texts `module:attribute` for `resolve`.

    Raises:
        ValueError: as `find_entry`, or a value that cannot be imported.
    """
    entry = find_entry(kind, name, suite)
    if isinstance(entry, str):
        return checks.import_object(entry, f"{kind} {bare_name(name)!r}: cannot import")
    return entry


def find_instance(kind: str, name: str, suite: Mapping[str, Any], value_class: type[_Value]) -> _Value:
    """Return the value of a name after a check of its class; arguments are as of `find`.

    Raises:
        ValueError: as `find`, or a value of another class.
    """
    value = find(kind, name, suite)
    if not isinstance(value, value_class):
        expected = value_class.__name__
        article = "an" if expected[0] in "AEIOU" else "a"
        raise ValueError(f"{kind} {bare_name(name)!r}: expected {article} {expected}, got {checks.preview(value)}")
    return value


def find_entry(kind: str, name: str, suite: Mapping[str, Any]) -> Any:
    """Return the table's entry for a name: the value itself, or the text `module:attribute` that `resolve` imports.

    Args:
        kind: one of `ADDITIONS`, such as "algorithm".
        name: a name of the suite, or one of another package as `name` or `module:name`; that module is imported.
        suite: the suite's own entries by name.

    Raises:
        ValueError: an unknown name, or one that the suite has and another package registers.
    """
    additions = ADDITIONS[kind]
    entry = _look_up(name, collections.ChainMap(additions, dict(suite)), kind)
    key = bare_name(name)
    if key in suite and key in additions:
        module = MODULE_OF_NAME.get((kind, key)) or "__main__"  # `register` stores None for the main program
        raise ValueError(f"{kind} {key!r}: the suite has one of this name, and {module} registers another")
    return entry


def bare_name(name: str) -> str:
    """Return the part after the module in `module:name`; a name without a module is returned as it is."""
    return name.rpartition(":")[2]


def refuse_import(kind: str, name: str) -> str:
    """Return `name` or `module:name` from a file, after a check that the module has already been imported.

    Files are data: their names are looked up among the registered ones, and only callers choose what to import.

    Raises:
        NotImported: the name's module has not been imported yet.
    """
    module, colon, _ = name.rpartition(":")
    if colon and module not in sys.modules:
        raise NotImported(f"{kind} {checks.preview(name)}: files import nothing; import {module[:_MAX_QUOTE]!r} first")
    return name


def importable_name(kind: str, name: str) -> str:
    """Return a name in the form that other processes can look up: `module:name` where another package registers it."""
    module = MODULE_OF_NAME.get((kind, name))
    return name if module is None else f"{module}:{name}"


def _add_module(kind: str, name: str) -> str:
    """Return `module:name` for a name that another package has registered, and other names as they are."""
    registered_name = bare_name(name)
    return importable_name(kind, registered_name) if (kind, registered_name) in MODULE_OF_NAME else name


def env_id(domain_name: str, task: type[Task]) -> str:
    """Return Gymnasium's id of a robot and a task, such as "arc_suite/queen-walk-v0"."""
    return f"arc_suite/{domain_name}-{task.name}-v{task.version}"


def import_module(module: str, subject: str) -> None:
    """Import a module that a caller names.

    Args:
        module: dotted name of the module.
        subject: what needs the module, such as "task 'leap'"; errors begin with it.

    Raises:
        ValueError: it cannot be imported.
    """
    try:
        importlib.import_module(module)
    except (ImportError, SyntaxError) as error:
        reason = checks.describe_import_error(error, module)
        raise ValueError(f"{subject}: cannot import {module[:_MAX_QUOTE]}: {reason}") from None


def _refuse_file(kind: str, name: str) -> None:
    """Raise ValueError for a part that is named by the file of its module, with how to name it."""
    path, extension, key = name.rpartition(".py")
    if not extension or key[:1] not in ("", ":"):
        return
    folder = Path(path).parent
    hint = "" if folder == Path() else f", with {folder} in PYTHONPATH"
    raise ValueError(f"{kind} {checks.preview(name)}: expected {Path(path).name}:{key[1:] or 'name'}{hint}")


def _look_up(name, table: Mapping, kind: str, suggestions: Iterable[str] = ()):
    """Return the entry of `name`, or of `module:name` after an import of the module, in a table of a kind.

    Raises:
        ValueError: an unknown name, a module that cannot be imported, or a module that does not register the name.
    """
    if isinstance(name, str):
        _refuse_file(kind, name)
    if not (isinstance(name, str) and ":" in name):
        return table[checks.name(name, table, kind, suggestions, (_NAME_IN_MODULE,))]

    module, _, key = name.rpartition(":")
    if not all(part.isidentifier() for part in module.split(".")):
        raise ValueError(f"{kind} {checks.preview(name)}: expected module:name, with a module that can be imported")
    shown_key = repr(key[:_MAX_QUOTE])
    import_module(module, f"{kind} {shown_key}")
    if key not in table:
        names_of_module = [entry for entry in table if MODULE_OF_NAME.get((kind, entry)) == module]
        hint = checks.describe_other_module(module) or checks.hint(key, names_of_module)
        raise ValueError(f"{kind} {shown_key}: {module} registers no such {kind} by arc_suite.register{hint}")
    if (kind, key) not in MODULE_OF_NAME:
        raise ValueError(f"{kind} '{module}:{key}': {key} is the suite's own, expected without a module")
    return table[key]
