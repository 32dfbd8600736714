"""What all programs share: they parse flags, print errors as one line, and show help and progress bars."""

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
from dm_control.rl.control import PhysicsError
from tqdm import tqdm

from arc_suite import files
from arc_suite.cli import flag_mistakes, interrupts, places
from arc_suite.cli.help_text import help_text
from arc_suite.cli.programs import docstring_of
from arc_suite.cli.version import describe_suite
from arc_suite.simulation.opengl import RenderingUnavailable

_FLAG_NAME = re.compile(r"(?<=^--)[a-z][a-z_-]*")  # after the two dashes at the start of an argument
_GRACE_PERIOD = 20.0  # s, from SIGTERM to the end of the process; clusters give 30 s
_LOG_INTERVAL = 30.0  # s, between two lines of progress in a log
_EXPECTED_ERRORS = (flags.Error, ValueError, OSError, MemoryError, RenderingUnavailable, PhysicsError)
_SPECIAL_FLAG = re.compile(r"--?(flagfile|undefok)(=.*)?", re.DOTALL)  # which absl itself takes in every program
_INTERRUPTED = "interrupted"  # at the start of the line of an interrupt
_CURSOR_MOVES = re.compile("\\r|\x1b\\[A")  # with which bars overwrite themselves

_HELP = flags.DEFINE_bool("help", False, "Print this text and exit.", short_name="h")
_VERSION = flags.DEFINE_bool(
    "version", False, "Print the version, the folder and the commit, and exit.", short_name="V"
)


def progress(*args, **kwargs) -> tqdm:
    """Return a progress bar of tqdm, or one that prints a line every half minute if standard error is no terminal."""
    if sys.stderr.isatty():
        return tqdm(*args, **kwargs)
    return tqdm(
        *args,
        file=_Log(sys.stderr),
        ncols=0,
        delay=_LOG_INTERVAL,
        mininterval=_LOG_INTERVAL,
        maxinterval=_LOG_INTERVAL,
        **kwargs,
    )


def say(line: str) -> None:
    """Print a line at once, above a progress bar if there is one."""
    tqdm.write(line, file=sys.stdout)
    sys.stdout.flush()


@contextlib.contextmanager
def resumable(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Run work in a folder; when Ctrl-C or SIGTERM interrupts it, say that the same command resumes it."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise type(interrupt)(f"{_INTERRUPTED}; the same command resumes {folder}") from None


@contextlib.contextmanager
def watch_for_termination() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether SIGTERM has come; meanwhile the signal does not end the process.

    When it comes again, or after 20 s, it ends the process: a learner may never ask.
    """
    termination = threading.Event()
    end = threading.Timer(_GRACE_PERIOD, os.kill, (os.getpid(), signal.SIGTERM))
    end.daemon = True
    previous_handler = signal.getsignal(signal.SIGTERM)

    def handle(number, frame):
        if not termination.is_set():
            termination.set()
            end.start()
        elif callable(previous_handler):
            previous_handler(number, frame)
        else:
            raise interrupts.Terminated

    signal.signal(signal.SIGTERM, handle)
    try:
        yield termination.is_set
    finally:
        end.cancel()
        signal.signal(signal.SIGTERM, previous_handler)


def run(main: Callable[..., int | None], name: str | None = None, arguments: Sequence[str] | None = None) -> NoReturn:
    """Parse arguments into absl's flags, call `main` and exit the process, with errors as `guard` shows them.

    `--help` prints the docstring of the module of `main`, and the flags of that module and of packages `cli`.

    Args:
        main: reads `absl.flags.FLAGS`. It takes the arguments that are no flags, each with a default, and returns an
            exit status or None.
        name: how errors name the program; None for the file name of the running script.
        arguments: arguments to parse; None for those of the command line.
    """
    script = sys.argv[0]
    if arguments is None:
        arguments = sys.argv[1:]
    module = sys.modules[main.__module__]

    def parse_and_call():
        parameters = inspect.signature(main).parameters
        _, *positional_arguments = _parse([script, *arguments], module, list(parameters))
        if _HELP.value:
            print(help_text(docstring_of(module), _flags_of(module)))
            return None
        if _VERSION.value:
            print(describe_suite())
            return None
        if len(positional_arguments) > len(parameters):
            flag_mistakes.refuse_argument(arguments, positional_arguments, len(parameters))
        return main(*positional_arguments)

    guard(parse_and_call, name or Path(script).name, module)


def guard(work: Callable[[], int | None], name: str, module: ModuleType | None = None) -> NoReturn:
    """Call `work` and exit the process with the status that it returns.

    - A wrong flag, a ValueError, an OSError, a MemoryError, a RenderingUnavailable and a PhysicsError, of a body that
      cannot be simulated, become one line on standard error and exit status 1. Ctrl-C becomes one line and exit status
      130, SIGTERM one line and 143. The line of an error from other code, such as a task of another package, ends
      with its place; see `places.describe_error`. Python's development mode, `python -X dev`, keeps the traceback.
    - Any other exception is a mistake of the suite or of other code, and keeps its traceback.
    - A warning becomes one line on standard error, with its place as that of an error.
    - Where nobody reads the output any more, as in `program | head`, the work goes on without it, so that its files are
      written.

    Args:
        work: takes nothing, returns an exit status or None.
        name: name of the program, with which the line begins.
        module: module of the program; None for one of the suite.
    """

    def print_reason(reason: str) -> None:
        print(f"{name}: {' '.join(reason.split())}", file=sys.stderr)

    def show_warning(warning, category, path, line, *_, **__):
        print_reason(places.describe_warning(warning, path, line, module))

    # A stream that was closed before the start is None.
    output = _Output(sys.stdout or io.StringIO())
    errors = _Output(sys.stderr or io.StringIO())
    statuses: list[int] = []  # of signals
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors), warnings.catch_warnings():
        warnings.showwarning = show_warning
        try:
            with interrupts.interruptible(name, statuses):
                status = work()
                output.flush()  # in which a full disk may raise
        except BaseException as error:
            is_interrupt = isinstance(error, KeyboardInterrupt)
            if statuses or is_interrupt:
                message = str(error) if is_interrupt else ""
                is_ours = message.startswith(_INTERRUPTED)  # PyMJCF says in which element the interrupt came
                print_reason(message if is_ours else _INTERRUPTED)
                status = statuses[-1] if statuses else interrupts.INTERRUPTED
            elif isinstance(error, _EXPECTED_ERRORS) and not sys.flags.dev_mode:
                print_reason(places.describe_error(error, module))
                status = 1
            else:
                raise
        finally:
            output.flush()
    if status in (interrupts.INTERRUPTED, interrupts.TERMINATED):
        interrupts.leave(status)
    sys.exit(status)


def _parse(arguments: Sequence[str], module: ModuleType, parameters: Sequence[str]) -> list[str]:
    """Parse arguments into absl's flags, and return the arguments that are no flags.

    A flag of several words may be written with dashes, too.

    Args:
        arguments: the name of the script, then those of the command line.
        module: the module of the program.
        parameters: names of the arguments that are no flags; errors suggest them.

    Raises:
        ValueError: a flag that the program does not have, a value that its flag does not take, none, or another flag in
            place of a value.
    """
    with_underscores = [_FLAG_NAME.sub(lambda match: match[0].replace("-", "_"), text) for text in arguments]
    program_flags = list(_flags_of(module))
    program = module.__name__.rpartition(".")[2]
    try:
        _refuse_special_flags(with_underscores)
        positional_arguments = _flags_except_of_absl()(with_underscores)
        flags.FLAGS.mark_as_parsed()
    except flags.UnrecognizedFlagError as error:
        names = sorted({flag.name for flag in program_flags})
        flag_mistakes.refuse_unknown(error, program, names, with_underscores, parameters)
        raise
    except flags.IllegalFlagValueError as error:
        flag_mistakes.refuse_value(error)
        raise
    except flags.Error as error:
        flag_mistakes.refuse_missing_value(error)
        raise
    for flag in program_flags:
        if flag.present and flag.value in ("", []):
            raise ValueError(f"--{flag.name}=: expected a value, got none")
        if flag.present:
            flag_mistakes.refuse_flag_as_value(flag)
    flag_mistakes.warn_of_repeated_flags(program, with_underscores)
    return positional_arguments


def _refuse_special_flags(arguments: Sequence[str]) -> None:
    """Raise UnrecognizedFlagError for a flag that absl itself would take: its files of flags may hold any flag."""
    for argument in arguments:
        match = _SPECIAL_FLAG.fullmatch(argument)
        if match:
            raise flags.UnrecognizedFlagError(match[1], argument)


def _flags_except_of_absl() -> flags.FlagValues:
    """Return all flags except those of absl's modules, such as --logtostderr, which would have no effect.

    They stay in `absl.flags.FLAGS`, as the log of absl reads them.
    """
    parsed_flags = flags.FlagValues()
    parsed_flags.set_gnu_getopt(flags.FLAGS.is_gnu_getopt())
    for module_name, module_flags in flags.FLAGS.flags_by_module_dict().items():
        if not module_name.startswith("absl."):
            for flag in module_flags:
                parsed_flags[flag.name] = flag
    return parsed_flags


def _flags_of(module: ModuleType) -> Iterator[flags.Flag]:
    """Yield the flags of a program, and those that packages `cli` of the suite define for it.

    Absl calls the module of a running script by the path of the script.
    """
    for module_name, module_flags in flags.FLAGS.flags_by_module_dict().items():
        if module_name in (module.__name__, sys.argv[0]) or "cli" in module_name.split("."):
            yield from module_flags


class _Log:
    """A stream that turns progress bars into lines."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> None:
        line = _CURSOR_MOVES.sub("", text).strip()
        if line:
            self._stream.write(f"{line}\n")

    def flush(self) -> None:
        self._stream.flush()


class _Output:
    """A stream that drops what is written once its reader has gone."""

    def __init__(self, stream):
        self._stream = stream

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        with files.naming("the output"), self._without_broken_pipe():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with files.naming("the output"), self._without_broken_pipe():
            self._stream.flush()

    @contextlib.contextmanager
    def _without_broken_pipe(self):
        """Send the stream to the null device if nobody reads it any more, or if it cannot be written.

        Raises:
            OSError: the output cannot be written.
        """
        try:
            yield
        except OSError as error:
            null_device = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null_device, self._stream.fileno())  # drops the buffer of the stream, too, at exit
            os.close(null_device)
            if not isinstance(error, BrokenPipeError):
                raise
