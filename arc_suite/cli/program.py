"""What all programs share: flags parsed, errors of one line, help, progress bars."""

import contextlib
import inspect
import io
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import NoReturn

from absl import flags
from tqdm import tqdm

import arc_suite
from arc_suite import checks, policies, registry
from arc_suite.cli.help_text import help_text
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.tasks import TASKS

TERMINATED = 143  # exit status of a program that SIGTERM has ended, as shells count it

VERSION = f"arc_suite {arc_suite.__version__}"

_LONG = re.compile(r"(?<=^--)[a-z][a-z_-]*")  # the name of a flag
_PAUSE = 30.0  # s between two lines of progress in a log
_CONTROL = re.compile("\\r|\x1b\\[A")  # with which bars overwrite themselves

_HELP = flags.DEFINE_bool("help", False, "Print this text and exit.", short_name="h")
_VERSION = flags.DEFINE_bool("version", False, "Print the version of the package and exit.")


class Terminated(KeyboardInterrupt):
    """SIGTERM has come, which clusters send before they take a machine away."""


def progress(*args, **kwargs) -> tqdm:
    """Return a progress bar of tqdm; where standard error is no terminal, a line in half a minute, for logs."""
    if sys.stderr.isatty():
        return tqdm(*args, **kwargs)
    pauses = dict.fromkeys(("delay", "mininterval", "maxinterval"), _PAUSE)
    return tqdm(*args, file=_Log(sys.stderr), ncols=0, **pauses, **kwargs)


def say(line: str) -> None:
    """Print a line at once, above a progress bar if there is one."""
    tqdm.write(line, file=sys.stdout)
    sys.stdout.flush()


@contextlib.contextmanager
def resumable(place) -> Iterator[None]:
    """Say of an interruption, by Ctrl-C or SIGTERM, that the same command resumes the work in a folder."""

    def terminate(*_):
        raise Terminated

    before = signal.signal(signal.SIGTERM, terminate)
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise type(interrupt)(f"interrupted; the same command resumes {place}") from None
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def watch_for_termination() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether SIGTERM has come.

    The signal does not end the process meanwhile.
    """
    came = threading.Event()
    before = signal.signal(signal.SIGTERM, lambda *_: came.set())
    try:
        yield came.is_set
    finally:
        signal.signal(signal.SIGTERM, before)


def run(main: Callable[..., int | None], name: str | None = None, arguments: Sequence[str] | None = None) -> NoReturn:
    """Parse arguments into absl's flags, call `main` and exit the process, with errors as `guard` shows them.

    `--help` prints the docstring of the module of `main`, and the flags of that module and of packages `cli`.

    Args:
        main: reads `absl.flags.FLAGS`; takes what is no flag, each with a default, and returns an exit
            status or None.
        name: how errors name the program; None for the file name of the running script.
        arguments: to parse; None for those of the command line.
    """
    script, *given = sys.argv
    arguments = given if arguments is None else arguments

    def work():
        _, *rest = _parsed([script, *arguments], sys.modules[main.__module__])
        if _HELP.value:
            module = sys.modules[main.__module__]
            return print(help_text(module.__doc__, _flags(module)))
        if _VERSION.value:
            return print(VERSION)
        places = len(inspect.signature(main).parameters)
        if len(rest) > places:
            raise ValueError(f"unexpected argument {checks.preview(rest[places])}; {_meant(rest[places])}see --help")
        return main(*rest)

    guard(work, name or Path(script).name)


def guard(work: Callable[[], int | None], name: str) -> NoReturn:
    """Call `work` and exit the process with the status that it returns.

    A wrong flag, a ValueError, an OSError and a RenderingUnavailable become one line on standard
    error and exit status 1, Ctrl-C one line and exit status 130, SIGTERM in work that
    can be resumed one line and 143; any other exception is a mistake of
    ours and keeps its traceback. A warning is one line on standard error, too. Where nobody reads the
    output any more, as in `program | head`, the work goes on without it, so that its files are written.

    Args:
        work: takes nothing, returns an exit status or None.
        name: the program's, with which the line begins.
    """

    def say(reason, *_, **__):
        print(f"{name}: {' '.join(str(reason).split())}", file=sys.stderr)

    def fail(reason, status):
        say(reason)
        return status

    # A stream that was closed before the start is None.
    output, errors = (_Output(stream or io.StringIO()) for stream in (sys.stdout, sys.stderr))
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors), warnings.catch_warnings():
        warnings.showwarning = say
        try:
            status = work()
        except (flags.Error, ValueError, OSError, RenderingUnavailable) as error:
            status = fail(error, 1)
        except KeyboardInterrupt as interrupt:
            status = TERMINATED if isinstance(interrupt, Terminated) else 130  # as shells count what SIGINT ends
            fail(str(interrupt) or "interrupted", status)
        finally:
            output.flush()
    sys.exit(status)


def _parsed(arguments: Sequence[str], module: ModuleType) -> list[str]:
    """Parse arguments into absl's flags, and return those that are none.

    A flag of several words may be written with dashes, too.

    Raises:
        ValueError: a flag that the program does not have, or a value that its flag does not take.
        flags.Error: a flag without its value.
    """
    try:
        return flags.FLAGS([_LONG.sub(lambda flag: flag[0].replace("-", "_"), text) for text in arguments])
    except flags.UnrecognizedFlagError as error:
        checks.name(error.flagname, sorted({flag.name for flag in _flags(module)}), "flag")
        raise
    except flags.IllegalFlagValueError as error:
        given = str(error).removesuffix(f": {error.__context__}")  # flag --NAME=VALUE
        parser = flags.FLAGS[given.removeprefix("flag --").partition("=")[0]].parser
        choices = getattr(parser, "enum_values", ("true", "false"))
        raise ValueError(f"{checks.quote(given)}: expected {parser.syntactic_help or ' or '.join(choices)}") from None


def _meant(argument: str) -> str:
    """Return the flag that an argument without one may belong to, for an error; "" where none takes it."""
    guesses = {
        "robot": registry.robot_words(),
        "task": TASKS,
        "policy": [*policies.POLICIES, *filter(os.path.exists, [argument])],
    }
    fitting = (flag for flag, names in guesses.items() if flag in flags.FLAGS and argument in names)
    return next((f"did you mean --{flag}={argument}? " for flag in fitting), "")


def _flags(module: ModuleType) -> Iterator[flags.Flag]:
    """Yield the flags of a program, of this package, and of a program of the suite that it is made from."""
    for name, defined in flags.FLAGS.flags_by_module_dict().items():
        if name in (module.__name__, sys.argv[0]) or "cli" in name.split("."):
            yield from defined


class _Log:
    """A stream that bars are written to as lines."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> None:
        if line := _CONTROL.sub("", text).strip():
            self._stream.write(f"{line}\n")

    def flush(self) -> None:
        self._stream.flush()


class _Output:
    """A stream that goes nowhere once its reader has gone."""

    def __init__(self, stream):
        self._stream = stream

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with self._enduring():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with self._enduring():
            self._stream.flush()

    @contextlib.contextmanager
    def _enduring(self):
        try:
            yield
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())  # what is in the stream's buffer goes there too, at exit
            os.close(nowhere)
