"""The folder of a run: plain files, complete after a kill at any moment, from which the run resumes.

    config.json         the configuration, with hashes and versions
    evaluations.csv     a line for each episode of each evaluation
    training.csv        metrics of the learner
    times.csv           seconds, which are never the same twice
    checkpoint.npz      arrays of the learner, and the lengths of the tables
    policy.npz          the policy of the latest evaluation

Tables only grow; a run that resumes cuts them back to their lengths at the checkpoint.
"""

import contextlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from arc_suite import archives, checks, files

CONFIG, CHECKPOINT, LOCK = "config.json", "checkpoint.npz", ".lock"
TABLES = ("evaluations", "training", "times")
LEG_VIEWS = "leg_views"  # name in configurations: the version of what legs see; see `tasks.leg_views`

_PROGRESS = "progress"  # name of the text in a checkpoint that is not the learner's
_NUMBERS = {"evaluated", "wall", "cpu", "return"}  # of the progress, once they are known
_FORMER = ("learner",)  # names in configurations of earlier versions that say nothing
_MAX_BYTES = 1 << 34  # of a checkpoint, unpacked: the labels of imitation are the most


class RunFolder:
    """An open folder of a run; `open_run` opens it.

    Attributes:
        path: of the folder.
        arrays: of the learner at the checkpoint; None before the first.
        progress: plain values, given to `save` with the arrays.
    """

    def __init__(self, path: Path, arrays: dict[str, np.ndarray] | None, progress: dict[str, Any]):
        """Cut the tables back to the checkpoint."""
        self.path, self.arrays, self.progress = path, arrays, progress
        lengths = progress.get("tables", {})
        self._files = {name: (path / f"{name}.csv").open("ab", buffering=0) for name in TABLES}
        self._columns = {}
        for name, file in self._files.items():
            if file.tell() < lengths.get(name, 0):
                raise ValueError(
                    f"{path / name}.csv: shorter than at the checkpoint; delete {CHECKPOINT} to start over"
                )
            file.truncate(lengths.get(name, 0))
            first = (path / f"{name}.csv").read_text(encoding="utf-8").partition("\n")[0]
            self._columns[name] = first.split(",") if first else None

    def append(self, table: str, line: Mapping[str, float]) -> None:
        """Add a line to a table; its first line names the columns.

        Raises:
            OSError: the disk is full, or the like.
        """
        if self._columns[table] is None:
            self._columns[table] = list(line)
            self._write(table, ",".join(line))
        if list(line) != self._columns[table]:
            raise ValueError(f"{self.path / table}.csv: expected columns {self._columns[table]}, got {list(line)}")
        self._write(table, ",".join(_cell(value) for value in line.values()))

    def save(self, arrays: Mapping[str, np.ndarray], progress: Mapping[str, Any]) -> None:
        """Replace the checkpoint.

        Raises:
            OSError: the disk is full, or the like; the checkpoint before stays.
        """
        lengths = {name: os.fstat(file.fileno()).st_size for name, file in self._files.items()}
        text = json.dumps({**progress, "tables": lengths})
        with files.writing(self.path / CHECKPOINT) as temporary:
            np.savez(temporary, **{_PROGRESS: np.array(text)}, **arrays)

    def close(self) -> None:
        """Close the tables."""
        for file in self._files.values():
            file.close()

    def _write(self, table: str, line: str) -> None:
        try:
            self._files[table].write(f"{line}\n".encode())
        except OSError as error:
            raise OSError(f"cannot write {self.path / table}.csv: {error.strerror.lower()}") from None


@contextlib.contextmanager
def open_run(path: str | os.PathLike, config: Mapping[str, Any], growing: Sequence[str] = ()) -> Iterator[RunFolder]:
    """Open the folder of a run, or make one, which is deleted if an error comes before the run has begun.

    Args:
        path: of the folder.
        config: record of the configuration, plain values.
        growing: names in it whose integers may be larger than in the folder.

    Raises:
        ValueError: the folder is of another run or of none, or damaged, or another process writes to it.
        OSError: it cannot be read or written.
    """
    with contextlib.ExitStack() as stack:
        stack.enter_context(_made(Path(path)))
        path = files.folder(path)
        stack.enter_context(files.hold_lock(path / LOCK, f"{path}: another process goes on with this run"))
        _configure(path, config, growing)
        files.delete_temporaries(path / CHECKPOINT)  # megabytes
        folder = RunFolder(path, *_checkpoint(path / CHECKPOINT))
        stack.callback(folder.close)
        yield folder


def read_config(path: str | os.PathLike) -> dict[str, Any]:
    """Return the record of the configuration in a run's folder.

    Raises:
        ValueError: no folder of a run.
    """
    try:
        config = files.read_json(Path(path) / CONFIG)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: no folder of a run: {checks.quote(error)}") from None
    if not isinstance(config, dict):
        raise ValueError(f"{path}: no folder of a run")
    return config


def read_progress(path: str | os.PathLike) -> dict[str, Any]:
    """Return the progress of the latest checkpoint; empty without a checkpoint.

    Raises:
        ValueError: the checkpoint is damaged.
    """
    return _checkpoint(Path(path) / CHECKPOINT, with_arrays=False)[1]


def latest_returns(evaluations: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the returns (episodes,) of the latest evaluation in a table of evaluations."""
    return evaluations["return"][evaluations["step"] == evaluations["step"][-1]]


def check_same_run(path: str | os.PathLike, config: Mapping[str, Any], left_out: Sequence[str] = ()) -> None:
    """Compare a record with that of a folder.

    Args:
        path: of the folder.
        config: record of a configuration.
        left_out: names in it that may differ.

    Raises:
        ValueError: the folder is of another run, or of none.
    """
    for name, there, here in _differences(read_config(path), json.loads(json.dumps(config))):
        if name == LEG_VIEWS:
            raise ValueError(
                f"{path}: of another version, whose legs saw some blocks as the body has them; write to another folder"
            )
        if name.partition(".")[0] not in (*left_out, *_FORMER):
            raise ValueError(
                f"{path}: of another run, with {name} {checks.preview(there)}, not {checks.preview(here)}; "
                "write to another folder"
            )


def lines(path: str | os.PathLike, name: str, columns: Sequence[str] = ()) -> list[dict[str, str]]:
    """Return the lines of a table of a run's folder as text by column; none where there is no table.

    A line that is still being written is left out.

    Args:
        path: of the folder.
        name: of the table.
        columns: that it must have.

    Raises:
        ValueError: a damaged table.
    """
    path = Path(path) / f"{name}.csv"
    try:
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        header, *others = text[: text.rfind("\n") + 1].splitlines() or [""]
        found = header.split(",")
        if others and (missing := [column for column in columns if column not in found]):
            raise ValueError(f"expected a column {missing[0]}")
        return [dict(zip(found, line.split(","), strict=True)) for line in others]
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: no table of a run: {checks.quote(error)}") from None


def table(path: str | os.PathLike, name: str) -> dict[str, np.ndarray]:
    """Return a table of a run's folder: columns by name, none before the first line; see `lines`.

    Raises:
        ValueError: a damaged table.
    """
    found = lines(path, name)
    try:
        return {column: np.array([line[column] for line in found], float) for column in (found or [{}])[0]}
    except ValueError as error:
        raise ValueError(f"{Path(path) / name}.csv: no table of a run: {checks.quote(error)}") from None


def check_latest_evaluation(path: str | os.PathLike, step: int) -> None:
    """Check the step of the latest evaluation that a checkpoint tells by the table of evaluations.

    Raises:
        ValueError: it is another one, so that evaluations would be left out.
    """
    steps = table(path, "evaluations").get("step", np.zeros(1))
    if step != steps[-1]:
        raise ValueError(
            f"{Path(path) / CHECKPOINT} is damaged: evaluated: expected {steps[-1]:g}, as in evaluations.csv, "
            f"got {checks.preview(step)}; delete it to start the run over"
        )


def is_begun(path: str | os.PathLike) -> bool:
    """Return whether the run of a folder has begun: it has a checkpoint, or a line in a table."""
    tables = [Path(path) / f"{name}.csv" for name in TABLES]
    return (Path(path) / CHECKPOINT).exists() or any(each.exists() and each.stat().st_size for each in tables)


@contextlib.contextmanager
def _made(path: Path) -> Iterator[None]:
    """Delete a folder that was missing before, and parents that it needed, if an error comes before its run begins."""
    missing = [each for each in (path, *path.parents) if not each.exists()]
    try:
        yield
    except Exception:
        if missing and not is_begun(path):
            shutil.rmtree(path, ignore_errors=True)
            for parent in missing[1:]:
                with contextlib.suppress(OSError):  # another run may be in it by now
                    parent.rmdir()
        raise


def _configure(path: Path, config: Mapping[str, Any], growing: Sequence[str]) -> None:
    """Compare the record with the folder's, and write it if no run has begun or some of its integers have grown."""
    others = sorted(each.name for each in path.iterdir() if not each.name.startswith("."))
    if others and CONFIG not in others:
        raise ValueError(f"{path}: no folder of a run, and not empty: it holds {others[0]}")
    if is_begun(path):
        there = read_config(path)
        grown = [name for name in growing if isinstance(there.get(name), int) and there[name] < config[name]]
        check_same_run(path, config, grown)
        if not grown:
            return
    with files.writing_json(path / CONFIG) as file:  # maybe over that of a run that was refused
        file.update(config)


def _differences(there: Mapping, here: Mapping, above: str = "") -> Iterator[tuple[str, Any, Any]]:
    for name in dict.fromkeys((*here, *there)):
        one, other = there.get(name), here.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            yield from _differences(one, other, f"{above}{name}.")
        elif one != other:
            yield f"{above}{name}", one, other


def _checkpoint(path: Path, with_arrays: bool = True) -> tuple[dict[str, np.ndarray] | None, dict[str, Any]]:
    if not path.exists():
        return None, {}
    try:
        arrays = archives.read(path, _MAX_BYTES, None if with_arrays else _PROGRESS)
        progress = json.loads(str(arrays.pop(_PROGRESS)))
        lengths = checks.mapping("tables", checks.mapping(_PROGRESS, progress).get("tables"))
        for name in TABLES:
            checks.integer(f"length of {name}", lengths.get(name, 0), 0)
        for name in _NUMBERS & progress.keys():
            checks.number(name, progress[name])
        return arrays, progress
    except (OSError, ValueError, KeyError, RecursionError) as error:
        raise ValueError(f"{path} is damaged: {checks.quote(error)}; delete it to start the run over") from None


def _cell(value) -> str:
    return repr(value.item() if isinstance(value, np.generic) else value)
