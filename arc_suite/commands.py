"""What command-line tools share: errors of one line, and files that are whole or not there."""

import contextlib
import errno
import io
import json
import math
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from absl import app, flags, logging

from arc_suite.rendering import RenderingUnavailable


def run(main: Callable[[], int | None]) -> None:
    """Parses the command line into absl's flags, calls `main` and exits the process.

    A wrong flag, a stray argument, and a ValueError, OSError or RenderingUnavailable from `main`
    become one line on standard error and exit status 1, Ctrl-C one line and exit status 130; any
    other exception is a mistake of ours and keeps its traceback. Where nobody reads the output any
    more, as in `tool | head`, the work goes on without it, so that its files are written. `--help`
    shows the docstring of the tool's module and its flags.

    Args:
        main: reads `absl.flags.FLAGS`; takes nothing, returns an exit status or None.
    """

    def parse(arguments):
        try:
            return flags.FLAGS(arguments)
        except flags.Error as error:
            sys.exit(_fail(error))

    def wrapped(arguments):
        logging.set_verbosity(logging.WARNING)  # dm_control tells of its backend at absl's usual verbosity
        try:
            if arguments[1:]:
                raise ValueError(f"unexpected argument {arguments[1]!r}; see --help")
            return main()
        except (ValueError, OSError, RenderingUnavailable) as error:
            return _fail(error)
        except KeyboardInterrupt as interrupt:
            _fail(str(interrupt) or "interrupted")
            return 130  # as shells count what SIGINT ends

    # A stream that was closed before the start is None.
    output, errors = (_Output(stream or io.StringIO()) for stream in (sys.stdout, sys.stderr))
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        try:
            app.run(wrapped, flags_parser=parse)
        finally:
            output.flush()


def _fail(reason: object) -> int:
    print(f"{Path(sys.argv[0]).name}: {' '.join(str(reason).split())}", file=sys.stderr)
    return 1


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


def folder(path: str | os.PathLike) -> Path:
    """A folder, made if need be.

    Raises:
        OSError: it cannot be made; one line that names it.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make folder {path}: {error.strerror.lower()}") from None
    return path


@contextlib.contextmanager
def writing(path: str | os.PathLike) -> Iterator[Path]:
    """Writes a file atomically: `with writing("a.png") as temporary: save(temporary)`.

    The temporary file lies beside the target and has its extension; it takes the target's place
    when the block ends and is deleted if the block raises. Open the block before any long work:
    what cannot be written is found out at once.

    Args:
        path: the target; a file that is there is replaced.

    Yields:
        The path to write to.

    Raises:
        OSError: the target cannot be written; one line that names it.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.stem[:32]}.{os.getpid()}{target.suffix}")
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        temporary.touch()
    except OSError as error:
        raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
    try:
        yield temporary
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def writing_json(path: str | os.PathLike | None) -> Iterator[dict]:
    """Writes a file of JSON as `writing` does: `with writing_json("a.json") as report: report["a"] = 1`.

    Args:
        path: the target; with None nothing is written.

    Yields:
        A dictionary to fill. NaN and infinities in it become null, as JSON has none.

    Raises:
        OSError: the target cannot be written; one line that names it.
    """
    report = {}
    with contextlib.nullcontext() if path is None else writing(path) as temporary:
        yield report
        if temporary:
            temporary.write_text(json.dumps(_plain(report), indent=2, allow_nan=False) + "\n")


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        fields = getattr(value, "_asdict", None)  # of a NamedTuple
        return _plain(fields()) if fields else [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
