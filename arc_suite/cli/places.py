"""The place of an error or a warning in code outside of the suite: file, line and function, for errors of one line."""

import os
import sysconfig
import traceback
from pathlib import Path
from types import ModuleType

from absl import flags

from arc_suite import files

_PACKAGE_FOLDER = Path(__file__).parents[1]
_INSTALLED = ("site-packages", "dist-packages")  # folders of installed packages, by interpreter
_LIBRARIES = [Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")]


def describe_error(error: BaseException, program: ModuleType | None = None) -> str:
    """Return the message of an error, with its place if it came through code outside of the suite.

    The place is that of the innermost call in a module which is neither of the suite, nor of the program, nor of
    Python, nor an installed package. Errors of flags have no place.

    Args:
        error: any, with its traceback.
        program: module of the running program, whose errors tell users what to change in the command; None for one of
            the suite.
    """
    if isinstance(error, flags.Error):
        return str(error)
    for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
        code = frame.f_code
        if not _is_foreign(code.co_filename, program):
            continue
        function = "" if code.co_name == "<module>" else f", in {_qualified_name(code)}"
        return f"{_message(error)} ({_describe_place(code.co_filename, line)}{function})"
    return _message(error)


def _message(error: BaseException) -> str:
    """Return the message of an error; of one of the operating system, such as of a name too long, file and reason."""
    if isinstance(error, OSError) and error.strerror and isinstance(error.filename, str | os.PathLike):
        return f"{files.shorten(error.filename)}: {error.strerror.lower()}"
    return str(error)


def describe_warning(warning: Warning | str, path: str, line: int, program: ModuleType | None = None) -> str:
    """Return the message of a warning, with its place if it is outside of the suite; see `describe_error`.

    Args:
        warning: the warning.
        path: file of the code that warns.
        line: line in the file.
        program: see `describe_error`.
    """
    return f"{warning} ({_describe_place(path, line)})" if _is_foreign(path, program) else str(warning)


def _is_foreign(path: str, program: ModuleType | None) -> bool:
    """Return whether a file of code is neither of the suite, nor of the program, nor of Python, nor installed."""
    resolved_path = Path(path).resolve()
    if path.startswith("<") or not resolved_path.is_file():  # generated code, such as methods of dataclasses
        return False
    folders = [_PACKAGE_FOLDER, *_LIBRARIES]
    program_path = getattr(program, "__file__", None)
    if program_path is not None:
        folders.append(Path(program_path).resolve().parent)
    is_installed = any(name in resolved_path.parts for name in _INSTALLED)
    return not is_installed and not any(resolved_path.is_relative_to(folder) for folder in folders)


def _describe_place(path: str, line: int) -> str:
    """Return a file and a line, as in `carry.py:41`; the path of a file in the current folder is relative to it."""
    relative_path = os.path.relpath(path)
    return f"{path if relative_path.startswith(os.pardir) else relative_path}:{line}"


def _qualified_name(code) -> str:
    """Return the name of a function with that of its class, as in `Carry.terms`."""
    return code.co_qualname.replace("<locals>.", "")
