"""Files that are written completely or not at all, folders that are made where needed, and locks."""

import contextlib
import difflib
import errno
import glob
import io
import itertools
import json
import math
import os
import platform
import re
import time
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt

MAX_JSON = 1 << 24  # bytes
RUNS_FOLDER = "runs"  # where runs are by default
ADDRESS_CURE = "it is an address: download the file, and name its path"

# Errors of a disk that is full, of limits on the size of files and of a broken disk; they name no file.
_STORAGE_ERRORS = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)

_LOCKED_BYTE = 1 << 30  # position in the file, on Windows; far behind all content, as others cannot read a locked byte
_LOCK_RETRY_INTERVAL = 0.1  # s
_MIN_AGE = 3600.0  # s, of a temporary file of another target
_MAX_ENTRIES = 1000  # of a folder, among which a similar name is sought
_LEAST_SIMILARITY = 0.75  # of a name that an error suggests, up to 1
_ADDRESS = re.compile(r"[a-z][a-z0-9+.-]{1,15}:/", re.IGNORECASE)  # at the start; the drive of a path is one letter
_MAX_SHOWN = 300  # characters of a path in an error
_MAX_STEM = 32  # characters of a target's name in the names of its temporary files
# What JSON wants, by the beginning of the text at which it does not go on.
_RULES_OF_JSON = {
    "//": "JSON has no comments",
    "/*": "JSON has no comments",
    "#": "JSON has no comments",
    "'": "JSON has double quotes",
    ",": "a comma too many",
    "]": "a comma too many, or a value too few",
    "}": "a comma too many, or a value too few",
    "True": "JSON has true, false and null",
    "False": "JSON has true, false and null",
    "None": "JSON has true, false and null",
}


def shorten(path: str | os.PathLike[str]) -> str:
    """Return a path for an error, without the middle of one that is too long to read."""
    text = str(path)
    half = _MAX_SHOWN // 2
    return text if len(text) <= _MAX_SHOWN else f"{text[:half]}...{text[-half:]}"


def folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder if there is none yet, and return its path.

    Raises:
        OSError: the folder cannot be made.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make folder {shorten(path)}: {error.strerror.lower()}") from None
    return path


@contextlib.contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file atomically: `with writing("a.png") as temporary: save(temporary)`.

    The temporary file lies in the target's folder and has its extension. When the block ends, the temporary file
    replaces the target, unless the block has deleted it. If the block raises, the temporary file is deleted.
    Temporary files that killed processes of this machine left for the target are deleted, too, and old ones of other
    targets in its folder. Open the block before any long work: a target that cannot be written raises at once.

    Args:
        path: the target; an existing file is replaced.

    Yields:
        The path to write to.

    Raises:
        OSError: the target cannot be written.
    """
    target = Path(os.path.realpath(path))
    temporary = target.parent / f"{_temporary_prefix(target)}{os.getpid()}{target.suffix}"
    try:
        if target.is_dir() or not target.name:
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if target.exists() and not (target.is_file() and os.access(target, os.W_OK)):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        temporary.touch()
        _delete_old_temporaries(target)
    except OSError as error:
        raise OSError(f"cannot write {shorten(path)}: {error.strerror.lower()}") from None
    try:
        with naming(path):
            yield temporary
            if temporary.exists():
                temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def check_target(path: str | os.PathLike[str] | None) -> None:
    """Raise OSError for a file that cannot be written, before long work whose result it is to hold; leave it as it is.

    Args:
        path: the target; None for none, which passes.
    """
    if path is not None:
        with writing(path) as temporary:
            temporary.unlink()  # so that nothing replaces the target


def check_folder(path: str | os.PathLike[str]) -> None:
    """Raise OSError for a folder that can neither be made nor written to, before long work; make nothing."""
    nearest = Path(os.path.realpath(path))
    while not nearest.exists() and nearest != nearest.parent:
        nearest = nearest.parent
    if not nearest.is_dir():
        raise OSError(f"cannot make folder {shorten(path)}: {nearest} is a file")
    if not os.access(nearest, os.W_OK):
        raise OSError(f"cannot make folder {shorten(path)}: permission denied in {nearest}")


@contextlib.contextmanager
def naming(path: str | os.PathLike[str]) -> Iterator[None]:
    """Name a file, or another place that is written to, in errors of its disk, which name none.

    Raises:
        OSError: the disk is full or broken, or the file is too large.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in _STORAGE_ERRORS:
            raise
        raise OSError(f"cannot write {shorten(path)}: {error.strerror.lower()}") from None


def write(path: str | os.PathLike[str], text: str) -> None:
    """Write a file of text in UTF-8 as `writing` does.

    Raises:
        OSError: the target cannot be written.
    """
    with writing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def writing_json(path: str | os.PathLike[str] | None) -> Iterator[dict]:
    """Write a JSON file as `writing` does: `with writing_json("a.json") as report: report["a"] = 1`.

    Args:
        path: the target; with None nothing is written.

    Yields:
        An empty dictionary for the block to fill. NaN and infinities in it become null, as JSON has none.

    Raises:
        OSError: the target cannot be written.
    """
    report = {}
    if path is None:
        yield report
        return
    with writing(path) as temporary:
        yield report
        text = json.dumps(_to_json_values(report), indent=2, allow_nan=False) + "\n"
        temporary.write_text(text, encoding="utf-8")


def _to_json_values(value):
    """Return a value with NamedTuples as dictionaries, other tuples as lists, and None for NaN and infinities."""
    if isinstance(value, dict):
        return {key: _to_json_values(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        if hasattr(value, "_asdict"):  # a NamedTuple
            return _to_json_values(value._asdict())
        return [_to_json_values(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def delete_temporaries(path: str | os.PathLike[str]) -> None:
    """Delete all temporary files of `writing` for a target; the caller knows that no process is writing it."""
    target = Path(path)
    for temporary in target.parent.glob(f".{glob.escape(_temporary_stem(target))}.*{glob.escape(target.suffix)}"):
        temporary.unlink()


def _temporary_prefix(target: Path) -> str:
    """Return the beginning of the names of this machine's temporary files; other machines may share the folder."""
    return f".{_temporary_stem(target)}.{platform.node()}."


def _temporary_stem(target: Path) -> str:
    """Return a target's name in the names of its temporary files; a long one is shorter, with a checksum."""
    if len(target.stem) <= _MAX_STEM:
        return target.stem
    return f"{target.stem[:_MAX_STEM]}-{zlib.crc32(target.name.encode()):08x}"


def _delete_old_temporaries(target: Path) -> None:
    """Delete temporary files in a target's folder whose processes on this machine no longer run.

    Those of other targets must be old: a container that shares the folder may have the name of this machine, and
    processes that are not seen from here.
    """
    name_pattern = re.compile(rf"\..*\.{re.escape(platform.node())}\.(\d{{1,10}})(\.[^.]*)?")
    prefix = _temporary_prefix(target)
    for temporary in target.parent.glob(f".*.{glob.escape(platform.node())}.*"):
        match = name_pattern.fullmatch(temporary.name)
        if match is None or _may_run(int(match[1])):
            continue
        is_of_target = temporary.name == f"{prefix}{match[1]}{target.suffix}"
        if is_of_target or _age(temporary) > _MIN_AGE:
            with contextlib.suppress(OSError):  # another process deletes it, or it belongs to another user
                temporary.unlink()


def _age(path: Path) -> float:
    """Return the time since a file was written, s; 0 where it is gone."""
    try:
        return time.time() - path.stat().st_mtime
    except OSError:
        return 0.0


def _may_run(process_id: int) -> bool:
    """Return whether a process may be running; on Windows, where the signal 0 would end it, always True."""
    if os.name == "nt":
        return True
    try:
        os.kill(process_id, 0)  # the signal 0 only checks that the process exists
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # the process runs for another user
        pass
    return True


@contextlib.contextmanager
def reading(path: str | os.PathLike[str]) -> Iterator[None]:
    """Give errors of reading a file or folder one wording: `with reading("a.md"): text = page.read_text()`.

    Raises:
        OSError: the path cannot be read, or the block reads text from a file that is no text.
    """
    try:
        yield
    except UnicodeDecodeError:
        raise OSError(f"cannot read {shorten(path)}: expected text in UTF-8") from None
    except OSError as error:
        cure = suggest_path(path) if isinstance(error, FileNotFoundError) else ""
        raise OSError(f"cannot read {shorten(path)}: {(error.strerror or str(error)).lower()}{cure}") from None


def is_address(text: str) -> bool:
    """Return whether a text begins as addresses of the internet do, such as https://example.com/spider.json."""
    return _ADDRESS.match(text) is not None


def is_folder(text: str) -> bool:
    """Return whether a text is the path of a folder; many a text is no path."""
    try:
        return text != "" and Path(text).is_dir()
    except (OSError, ValueError):  # it is too long, or has a null character
        return False


def suggest_extension(text: str, extensions: Iterable[str]) -> str:
    """Return the part of an error on a name that suggests a file of this name with an extension; "" for none."""
    for extension in extensions:
        with contextlib.suppress(OSError, ValueError):  # the text is too long, or has a null character
            if Path(f"{text}{extension}").is_file():
                return f"; did you mean {text}{extension}?"
    return ""


def suggest_similar_file(text: str, extensions: Iterable[str]) -> str:
    """Return the part of an error on a name that suggests a file of a similar name with an extension; "" for none."""
    path = Path(text)
    extension_of_stem = {
        entry.removesuffix(extension): extension
        for entry in _list_folder(path.parent)
        for extension in extensions
        if entry.endswith(extension) and (path.parent / entry).is_file()
    }
    matches = difflib.get_close_matches(path.name, extension_of_stem, n=1, cutoff=_LEAST_SIMILARITY)
    return f"; did you mean {path.parent / (matches[0] + extension_of_stem[matches[0]])}?" if matches else ""


def suggest_path(path: str | os.PathLike[str]) -> str:
    """Return the part of an error on a missing path that suggests one of a similar name; "" for none.

    For an address of the internet it suggests a download.
    """
    if is_address(os.fspath(path)):
        return f"; {ADDRESS_CURE}"
    path = Path(path)
    matches = difflib.get_close_matches(path.name, _list_folder(path.parent), n=1, cutoff=_LEAST_SIMILARITY)
    return f"; did you mean {path.parent / matches[0]}?" if matches else ""


def _list_folder(path: Path) -> list[str]:
    """Return the first names in a folder; none if there is no such folder, or the path is none."""
    try:
        return [entry.name for entry in itertools.islice(path.iterdir(), _MAX_ENTRIES)]
    except (OSError, ValueError):
        return []


def read_bytes(path: str | os.PathLike[str], max_bytes: int) -> bytes:
    """Return the bytes of a file that others may have written, at most one more than it may have.

    Raises:
        OSError: the file cannot be read, or the path is a pipe or the like, which might block.
    """
    path = Path(path)
    with reading(path):
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise OSError("expected a file")
        with path.open("rb") as file:
            return file.read(max_bytes + 1)


def read_utf8(path: str | os.PathLike[str], max_bytes: int) -> str:
    """Return the text of a file that others may have written, with line ends as `open` reads them.

    Raises:
        OSError: as `read_bytes`, or the file is too large, or no text in UTF-8.
    """
    data = read_bytes(path, max_bytes)
    with reading(path):
        if len(data) > max_bytes:
            raise OSError(f"expected at most {max_bytes} bytes")
        return io.TextIOWrapper(io.BytesIO(data), encoding="utf-8").read()


def plain(path: str | os.PathLike[str]) -> Path:
    """Return the path of a plain file, after a check that it is one: reading a pipe, for example, would block.

    Raises:
        OSError: there is no such path.
        ValueError: the path is no plain file.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if not path.is_file():
        raise ValueError("expected a file")
    return path


def read_json(path: str | os.PathLike[str], max_bytes: int = MAX_JSON) -> Any:
    """Return the content of a JSON file that others may have written.

    Args:
        path: path of the file.
        max_bytes: the largest valid size of the file.

    Raises:
        OSError: the file cannot be read.
        ValueError: the path is no file, or the file is too large or no JSON.
    """
    path = plain(path)
    if path.stat().st_size > max_bytes:
        raise ValueError(f"expected at most {max_bytes} bytes")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise ValueError(f"expected JSON; {describe_json_error(error)}") from None
    except RecursionError:
        raise ValueError("expected JSON that is not nested so deeply") from None


def describe_json_error(error: json.JSONDecodeError) -> str:
    """Return where a text is no JSON, and the rule that it breaks."""
    position = f"line {error.lineno}, column {error.colno}"
    text_behind = error.doc[error.pos :].lstrip()
    if not text_behind:
        return f"{position}: the text ends before its last bracket"
    for beginning, rule in _RULES_OF_JSON.items():
        if text_behind.startswith(beginning):
            return f"{position}: {rule}"
    if error.pos == 0:
        return f"{position}: it is no JSON, which begins with a bracket"
    reason = error.msg.removesuffix(" starting at")
    return f"{position}: {reason[:1].lower()}{reason[1:]}"


def lock(file: IO) -> bool:
    """Lock an open file until it is closed; return False if another process has locked it."""
    try:
        if fcntl:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            position = file.tell()
            file.seek(_LOCKED_BYTE)
            try:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # only on Windows
            finally:
                file.seek(position)
    except (BlockingIOError, PermissionError):
        return False
    return True


@contextlib.contextmanager
def hold_lock(path: str | os.PathLike[str], refusal: str | None = None) -> Iterator[None]:
    """Hold a lock against other processes during the block. The lock is a file that exists while it is held.

    Args:
        path: path of the lock's file, in a folder that exists.
        refusal: message of the error if another process holds the lock; with None, wait for that process.

    Raises:
        ValueError: another process holds the lock, and there is a refusal.
        OSError: the file cannot be written.
    """
    while True:
        try:
            file = open(path, "ab")  # noqa: SIM115
        except OSError as error:
            raise OSError(f"cannot write {shorten(path)}: {error.strerror.lower()}") from None
        with file:
            while not lock(file):
                if refusal is not None:
                    raise ValueError(refusal)
                time.sleep(_LOCK_RETRY_INTERVAL)
            # A process that held the lock may have deleted the file after it was opened here: then open a new one.
            is_current = os.path.exists(path) and os.path.samestat(os.stat(path), os.fstat(file.fileno()))
            if not is_current:
                continue
            try:
                yield
            finally:
                with contextlib.suppress(PermissionError):  # on Windows, which does not delete open files
                    os.unlink(path)
            return
