"""Files that are whole or not there, folders made where need be, and locks."""

import contextlib
import errno
import glob
import json
import math
import os
import platform
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt

MAX_JSON = 1 << 24  # bytes
_FAR = 1 << 30  # the byte that is locked on Windows, where nobody else can read or write a locked one
_PAUSE = 0.1  # s between two attempts at a lock


def folder(path: str | os.PathLike) -> Path:
    """Make a folder where there is none, and return it.

    Raises:
        OSError: it cannot be made.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make folder {path}: {error.strerror.lower()}") from None
    return path


@contextlib.contextmanager
def writing(path: str | os.PathLike) -> Iterator[Path]:
    """Write a file atomically: `with writing("a.png") as temporary: save(temporary)`.

    The temporary file lies in the target's folder and has its extension; it takes the target's place
    when the block ends, unless the block has deleted it, and is deleted if the block raises. Temporary
    files that killed processes of this machine left for the target are deleted. Open the block before
    any long work: what cannot be written is found out at once.

    Args:
        path: the target; a file that is there is replaced.

    Yields:
        The path to write to.

    Raises:
        OSError: the target cannot be written.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f"{_prefix(target)}{os.getpid()}{target.suffix}")
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        temporary.touch()
        _delete_abandoned(target)
    except OSError as error:
        raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
    try:
        yield temporary
        if temporary.exists():
            temporary.replace(target)
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
    finally:
        temporary.unlink(missing_ok=True)


def write(path: str | os.PathLike, text: str) -> None:
    """Write a file of text in UTF-8 as `writing` does.

    Raises:
        OSError: the target cannot be written.
    """
    with writing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def reading(path: str | os.PathLike) -> Iterator[None]:
    """Read a file or folder, with errors of one wording: `with reading("a.md"): text = page.read_text()`.

    Raises:
        OSError: it cannot be read, or is no text where text is read.
    """
    try:
        yield
    except UnicodeDecodeError:
        raise OSError(f"cannot read {path}: expected text in UTF-8") from None
    except OSError as error:
        raise OSError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from None


def plain(path: str | os.PathLike) -> Path:
    """Return the path of a file; reading a pipe would block.

    Raises:
        OSError: there is none.
        ValueError: it is no file.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if not path.is_file():
        raise ValueError("expected a file")
    return path


def read_json(path: str | os.PathLike, most: int = MAX_JSON) -> Any:
    """Return the content of a file of JSON that others may have written.

    Args:
        path: of the file.
        most: bytes that it may have.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no file, longer, or no JSON.
    """
    path = plain(path)
    if path.stat().st_size > most:
        raise ValueError(f"expected at most {most} bytes")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except RecursionError:
        raise ValueError("expected JSON that is not nested so deeply") from None


def _prefix(target: Path) -> str:
    """Return the beginning of the names of temporary files; other machines may write to the same folder."""
    return f".{target.stem[:32]}.{platform.node()}."


def _delete_abandoned(target: Path) -> None:
    """Delete temporary files of a target whose processes are gone."""
    prefix = _prefix(target)
    for temporary in target.parent.glob(f"{glob.escape(prefix)}*{glob.escape(target.suffix)}"):
        process = temporary.name.removeprefix(prefix).removesuffix(target.suffix)
        if process.isdecimal() and not _runs(int(process)):
            temporary.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    """Return whether a process may be running; on Windows, where a signal 0 would end it, always."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # another user's
        pass
    return True


def delete_temporaries(path: str | os.PathLike) -> None:
    """Delete temporary files that killed processes left in `writing` a file; no process may be writing it."""
    target = Path(path)
    for temporary in target.parent.glob(f".{target.stem[:32]}.*{target.suffix}"):
        temporary.unlink()


@contextlib.contextmanager
def writing_json(path: str | os.PathLike | None) -> Iterator[dict]:
    """Write a file of JSON as `writing` does: `with writing_json("a.json") as report: report["a"] = 1`.

    Args:
        path: the target; with None nothing is written.

    Yields:
        A dictionary to fill. NaN and infinities in it become null, as JSON has none.

    Raises:
        OSError: the target cannot be written.
    """
    report = {}
    with contextlib.nullcontext() if path is None else writing(path) as temporary:
        yield report
        if temporary:
            temporary.write_text(json.dumps(_plain(report), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def lock(file: IO) -> bool:
    """Lock an open file until it is closed; return False where another process has locked it."""
    try:
        if fcntl:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            here = file.tell()
            file.seek(_FAR)
            try:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # of Windows
            finally:
                file.seek(here)
    except (BlockingIOError, PermissionError):
        return False
    return True


@contextlib.contextmanager
def hold_lock(path: str | os.PathLike, refusal: str | None = None) -> Iterator[None]:
    """Hold a lock against other processes: a file that is there while the lock is held.

    Args:
        path: of the file, in a folder that is there.
        refusal: the error where another process holds the lock; with None, wait for it.

    Raises:
        ValueError: another process holds the lock; the refusal.
        OSError: the file cannot be written.
    """
    while True:
        try:
            file = open(path, "ab")  # noqa: SIM115
        except OSError as error:
            raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
        with file:
            while not lock(file):
                if refusal is not None:
                    raise ValueError(refusal)
                time.sleep(_PAUSE)
            # The process that held the lock may have deleted the file since it was opened here.
            if not (os.path.exists(path) and os.path.samestat(os.stat(path), os.fstat(file.fileno()))):
                continue
            try:
                yield
            finally:
                with contextlib.suppress(PermissionError):  # Windows deletes no open file
                    os.unlink(path)
            return


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        fields = getattr(value, "_asdict", None)  # of a NamedTuple
        return _plain(fields()) if fields else [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
