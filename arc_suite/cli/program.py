"""What command-line tools share: errors of one line."""

import contextlib
import io
import os
import sys
from collections.abc import Callable
from pathlib import Path

from absl import app, flags, logging

from arc_suite.simulation.opengl import RenderingUnavailable


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
