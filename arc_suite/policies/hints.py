"""Errors for files, words and functions that are no policies, with hints what to type instead."""

import ast
import inspect
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NoReturn

from arc_suite import checks, files, registry
from arc_suite.cpg.selection import preset_names
from arc_suite.policies import network, other_libraries
from arc_suite.tasks import TASKS

_MAX_SIZE = 1 << 20  # bytes of a file of Python whose names an error lists
_MAX_NAMES = 8  # in an error
_METHODS = ("act", "predict", "select_action", "get_action")  # by which agents of other libraries act
_AS_FUNCTION = "write a function that loads it, and name it as file.py:function"
# By extension of a file that is no policy: what the file is, and what to do instead.
_HINTS = {
    ".onnx": f"it is for other programs; expected the folder of the run that it comes from; else {_AS_FUNCTION}",
    ".json": "it is no policy; expected the folder of a run",
    ".csv": "it is no policy; expected the folder of a run",
    ".pt": _AS_FUNCTION,
    ".pth": _AS_FUNCTION,
    ".ckpt": _AS_FUNCTION,
    ".h5": _AS_FUNCTION,
    ".pkl": _AS_FUNCTION,
    ".safetensors": _AS_FUNCTION,
}


def refuse_other_files(name: str | os.PathLike[str]) -> None:
    """Raise ValueError for a file or a folder that is no policy, with what to type instead.

    Raises:
        OSError: a file of Python cannot be read.
    """
    if files.is_address(os.fspath(name)):
        raise ValueError(f"policy {checks.preview(os.fspath(name))}: {files.ADDRESS_CURE}")
    path = Path(name)
    extension = path.suffix.lower()
    if extension == ".py":
        _refuse_file_of_python(path)
    elif extension in _HINTS:
        raise ValueError(f"policy {checks.preview(os.fspath(name))}: {_HINTS[extension]}")
    elif extension not in ("", network.EXTENSION) and path.is_file():
        if other_libraries.find(name) is None:
            raise ValueError(f"policy {checks.preview(os.fspath(name))}: it is no policy; expected the folder of a run")
    else:
        _refuse_folder_of_runs(path)


def refuse_other_words(name: Any, policy_names: Iterable[str]) -> None:
    """Raise ValueError for a robot, a task or a preset in place of a policy, or for a misspelled folder or file."""
    for kind, names in {"robot": registry.robot_words(), "task": TASKS, "preset": preset_names()}.items():
        if isinstance(name, str) and name in names:
            raise ValueError(f"policy {name!r}: it is a {kind}; expected as {kind}, next to a policy such as cpg")
    if isinstance(name, str) and os.path.isfile(f"{name}.py"):
        first_name, *_ = [*_list_functions(Path(f"{name}.py")), f"{name}.py:NAME"]
        raise ValueError(f"unknown policy {checks.preview(name)}; did you mean {first_name}?")
    if isinstance(name, str) and os.path.isfile(os.path.join(files.RUNS_FOLDER, name, network.FILE)):
        raise ValueError(f"unknown policy {checks.preview(name)}; did you mean {files.RUNS_FOLDER}/{name}?")
    hint = files.suggest_path(name) if isinstance(name, str) and not checks.hint(name, policy_names) else ""
    if hint:
        raise ValueError(f"unknown policy {checks.preview(name)}{hint}")


def _refuse_file_of_python(path: Path) -> NoReturn:
    """Raise ValueError that lists the functions and classes of a file, which is not run."""
    names = _list_functions(path)
    name_list = f" {checks.list_choices(names[:_MAX_NAMES])}" if names else ""
    expected = "a function in it that makes a policy from a robot's name"
    raise ValueError(checks.quote(f"policy '{path}': expected {path}:NAME, {expected}{name_list}"))


def _list_functions(path: Path) -> list[str]:
    """Return the functions and classes of a file of Python as names of policies; the file is not run."""
    with files.reading(path):
        size = path.stat().st_size
        source = path.read_bytes() if size <= _MAX_SIZE else b""
    try:
        statements = ast.parse(source).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        statements = []
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [f"{path}:{node.name}" for node in statements if isinstance(node, kinds) and node.name[0] != "_"]


def _refuse_folder_of_runs(path: Path) -> None:
    """Raise ValueError for a folder that has runs in it and is none."""
    try:
        is_policy = (path / network.FILE).exists() or bool(network.checkpoint_files(path))
        runs = [] if is_policy else sorted(path.glob(f"*/{network.FILE}"))
    except OSError:  # the text is too long for a path
        return
    if runs:
        raise ValueError(checks.quote(f"policy '{path}': it has runs in it; did you mean '{runs[0].parent}'?"))


def check_takes_robot(name: str, factory: Callable) -> None:
    """Raise ValueError for the function of a policy's name that does not take a robot's name."""
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):  # a function of C
        return
    try:
        signature.bind("queen")
    except TypeError:
        call = checks.quote(f"{name.rpartition(':')[2]}{signature}")
        expected = "expected a function of one argument, a robot's name"
        raise ValueError(f"policy {checks.preview(name)}: {expected}, got {call}") from None


def suggest_method(policy: Any) -> str:
    """Return the part of an error that suggests the method by which an agent acts; "" for none."""
    for method in _METHODS:
        if callable(getattr(policy, method, None)):
            return f"; did you mean its method {method}?"
    return ""
