"""What all programs share: they parse flags, print errors as one line, and show help and progress bars."""

import contextlib
import inspect
import io
import itertools
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

from arc_suite import checks, files, policies, registry
from arc_suite.cli import interrupts
from arc_suite.cli.help_text import help_text
from arc_suite.cli.programs import docstring_of
from arc_suite.cli.version import describe_suite
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.tasks import TASKS

_DASHES = "-\u2013\u2014"  # also those that word processors write in place of two
_POLICY_EXTENSIONS = (".npz", ".zip")
_FLAG_NAME = re.compile(r"(?<=^--)[a-z][a-z_-]*")  # after the two dashes at the start of an argument
_SEVERAL = re.compile(r"\bcommas\b|\ball\b|\bseveral\b")  # in the help of a flag whose text may be a list
_LOG_INTERVAL = 30.0  # s, between two lines of progress in a log
_EXPECTED_ERRORS = (flags.Error, ValueError, OSError, MemoryError, RenderingUnavailable, PhysicsError)
_CURSOR_MOVES = re.compile("\\r|\x1b\\[A")  # with which bars overwrite themselves

# What shows files that no program of the suite shows, by extension.
_VIEWERS = {
    ".glb": "Blender, Godot and other programs show a .glb: see docs/engines.md",
    ".html": "a browser shows a page",
}

# Answers to flags of other programs, which no flag of this suite replaces.
_RESUME = "the same command goes on where it was interrupted"
_DEVICE = "learners compute on the device of JAX; see docs/gpu.md"
_CURES = {
    "continue": _RESUME,
    "resume": _RESUME,
    "cuda": _DEVICE,
    "device": _DEVICE,
    "gpu": _DEVICE,
    "name": "arc-suite build_model --name NAME --json writes a spec with a name of its own",
    "format": "the extension of the output is its format",
}

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
        raise type(interrupt)(f"interrupted; the same command resumes {folder}") from None


@contextlib.contextmanager
def watch_for_termination() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether SIGTERM has come; meanwhile the signal does not end the process."""
    termination = threading.Event()
    previous_handler = signal.signal(signal.SIGTERM, lambda *_: termination.set())
    try:
        yield termination.is_set
    finally:
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
            unexpected = positional_arguments[len(parameters)]
            suggestion = _suggest_list(arguments, positional_arguments, len(parameters)) or _suggest_flag(unexpected)
            raise ValueError(f"unexpected argument {checks.preview(unexpected)}; {suggestion}see --help")
        return main(*positional_arguments)

    guard(parse_and_call, name or Path(script).name)


def guard(work: Callable[[], int | None], name: str) -> NoReturn:
    """Call `work` and exit the process with the status that it returns.

    - A wrong flag, a ValueError, an OSError, a MemoryError, a RenderingUnavailable and a PhysicsError, of a body that
      cannot be simulated, become one line on standard error and exit status 1. Ctrl-C becomes one line and exit status
      130, SIGTERM one line and 143.
    - Any other exception is a mistake of the suite, and keeps its traceback.
    - A warning becomes one line on standard error.
    - Where nobody reads the output any more, as in `program | head`, the work goes on without it, so that its files are
      written.

    Args:
        work: takes nothing, returns an exit status or None.
        name: name of the program, with which the line begins.
    """

    def print_reason(reason, *_, **__):
        print(f"{name}: {' '.join(str(reason).split())}", file=sys.stderr)

    # A stream that was closed before the start is None.
    output = _Output(sys.stdout or io.StringIO())
    errors = _Output(sys.stderr or io.StringIO())
    statuses: list[int] = []  # of signals
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors), warnings.catch_warnings():
        warnings.showwarning = print_reason
        try:
            with interrupts.interruptible(name, statuses):
                status = work()
                output.flush()  # in which a full disk may raise
        except BaseException as error:
            is_interrupt = isinstance(error, KeyboardInterrupt)
            if statuses or is_interrupt:
                message = str(error) if is_interrupt else ""
                print_reason(message or "interrupted")
                status = statuses[-1] if statuses else interrupts.INTERRUPTED
            elif isinstance(error, _EXPECTED_ERRORS):
                print_reason(error)
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
        ValueError: a flag that the program does not have, a value that its flag does not take, or an empty one.
        flags.Error: a flag without its value.
    """
    with_underscores = [_FLAG_NAME.sub(lambda match: match[0].replace("-", "_"), text) for text in arguments]
    try:
        positional_arguments = flags.FLAGS(with_underscores)
    except flags.UnrecognizedFlagError as error:
        names = sorted({flag.name for flag in _flags_of(module)})
        _, _, value = error.flagvalue.partition("=")
        _refuse_name_of_value(error.flagname, value, names)
        if len(error.flagname) == 1:
            long_names = [f"--{name}" for name in names if name[0] == error.flagname]
            if long_names:
                raise ValueError(f"unknown flag '-{error.flagname}'; did you mean {' or '.join(long_names)}?") from None
        value = value or _value_behind(with_underscores, error.flagname)
        _refuse_name_of_argument(error.flagname, value, parameters)
        if error.flagname in _CURES:
            raise ValueError(f"unknown flag {checks.preview(error.flagname)}; {_CURES[error.flagname]}") from None
        checks.name(error.flagname, names, "flag")  # raises a ValueError that suggests a name
        raise
    except flags.IllegalFlagValueError as error:
        flag_and_value = str(error).removesuffix(f": {error.__context__}")  # flag --NAME=VALUE
        name = flag_and_value.removeprefix("flag --").partition("=")[0]
        parser = flags.FLAGS[name].parser
        choices = getattr(parser, "enum_values", ("true", "false"))
        expected = parser.syntactic_help or " or ".join(choices)
        hint = ""
        if isinstance(parser, flags.IntegerParser):
            _, _, value = flag_and_value.partition("=")
            hint = checks.hint_integer(value, parser.lower_bound, parser.upper_bound, before=f"--{name}=")
        raise ValueError(f"{checks.quote(flag_and_value)}: expected {expected}{hint}") from None
    for flag in _flags_of(module):
        if flag.present and flag.value in ("", []):
            raise ValueError(f"--{flag.name}=: expected a value, got none")
    return positional_arguments


def _refuse_name_of_value(name: str, value: str, flag_names: Sequence[str]) -> None:
    """Raise ValueError for a flag that is the name of a setting or of a hyperparameter, with the flag that takes it."""
    words_of_flags = {
        "set": registry.setting_names() - {"random"},  # programs seed episodes by flags of their own
        "hp": hyperparameter_words(),
    }
    meanings = checks.meanings(name)
    if any(meaning in flag_names for meaning in meanings):
        return
    suggestions = [
        f"--{flag} {meaning}={checks.quote(value) or 'VALUE'}"
        for flag, words in words_of_flags.items()
        for meaning in meanings
        if flag in flag_names and meaning in words
    ]
    if suggestions:
        raise ValueError(f"unknown flag {checks.preview(name)}; did you mean {' or '.join(suggestions)}?")


def hyperparameter_words() -> set[str]:
    """Return the names of hyperparameters, as the help of --hp lists them; none without that flag."""
    return set(re.findall(r"\w+", flags.FLAGS["hp"].help)) if "hp" in flags.FLAGS else set()


def _refuse_name_of_argument(name: str, value: str, parameters: Sequence[str]) -> None:
    """Raise ValueError for a flag that is the name of an argument without a flag."""
    for meaning in checks.meanings(name):
        if meaning in parameters:
            argument = f": {checks.quote(value)}" if value else ""
            raise ValueError(
                f"unknown flag {checks.preview(name)}; the {meaning} is an argument without a flag{argument}"
            )


def _value_behind(arguments: Sequence[str], name: str) -> str:
    """Return the argument behind a flag, which may be its value; "" if there is none, or another flag."""
    for flag, value in itertools.pairwise(arguments):
        if flag in (f"--{name}", f"-{name}"):
            return "" if value[:1] in _DASHES else value
    return ""


def _suggest_list(arguments: Sequence[str], positional_arguments: Sequence[str], parameter_count: int) -> str:
    """Return a question for a flag whose several values have spaces between them, such as --clips walk idle.

    Args:
        arguments: those of the command line.
        positional_arguments: those of them that are no flags and no values of flags, by absl.
        parameter_count: number of arguments without a flag that the program takes.

    Returns:
        "" where no flag with several values comes before the first argument that is too many.
    """
    end = start = arguments.index(positional_arguments[parameter_count])
    while start > 0 and arguments[start - 1][:1] not in _DASHES:
        start -= 1
    while end < len(arguments) and arguments[end][:1] not in _DASHES:
        end += 1
    name, equals, value = arguments[start - 1].lstrip("-").replace("-", "_").partition("=")
    if start == 0 or name not in flags.FLAGS or flags.FLAGS[name].boolean:
        return ""
    values = [value] * bool(equals) + list(arguments[start:end])
    arguments_elsewhere = len(positional_arguments) - (len(values) - 1)
    arguments_behind = max(0, parameter_count - arguments_elsewhere)
    return _join_values(flags.FLAGS[name], values[: len(values) - arguments_behind])


def _join_values(flag: flags.Flag, values: Sequence[str]) -> str:
    """Return a question for several values of a flag; "" if it takes one value."""
    if isinstance(flag, flags.MultiFlag):
        is_list_of_settings = all("=" in text for text in values)
        return f"did you mean {' '.join(f'--{flag.name} {text}' for text in values)}? " if is_list_of_settings else ""
    if not isinstance(flag.parser, flags.ListParser) and _SEVERAL.search(flag.help) is None:
        return ""
    list_text = ",".join(text.strip(",") for text in values if text.strip(","))
    return f"did you mean --{flag.name}={list_text}? a list has commas and no spaces; "


def _suggest_flag(argument: str) -> str:
    """Return a question for the flag that an argument may be the value of; "" if the program has no such flag."""
    name, equals, value = argument.lstrip(_DASHES).partition("=")
    if name in flags.FLAGS and (equals or argument[0] in _DASHES):
        return f"did you mean --{name}{equals}{value}? "
    extension = os.path.splitext(argument)[1].lower()
    if extension in _VIEWERS and os.path.exists(argument):
        return f"{_VIEWERS[extension]}; "
    flag_takes_argument = {
        "robot": argument in registry.robot_words(),
        "task": argument in TASKS,
        "spec": extension in (".json", *registry.READERS),
        "policy": argument in policies.POLICIES or os.path.isdir(argument) or extension in _POLICY_EXTENSIONS,
        "output": extension != "" and not os.path.exists(argument),
    }
    for flag, takes_argument in flag_takes_argument.items():
        if takes_argument and flag in flags.FLAGS:
            return f"did you mean --{flag}={argument}? "
    return ""


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
