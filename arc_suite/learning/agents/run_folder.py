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
from typing import IO, Any

import numpy as np

from arc_suite import archives, checks, files, parsers, usage
from arc_suite.simulation.model_hash import PHYSICS

CONFIG = "config.json"
CHECKPOINT = "checkpoint.npz"
LOCK = ".lock"
TABLES = ("evaluations", "training", "times")
LEG_VIEWS = "leg_views"  # name of a field of records: the version of what legs see; see `tasks.leg_views`
MODEL_HASH = "model_sha256"  # in records of earlier versions, in place of `PHYSICS`; it differed among processors
COMMIT = "commit"  # of the clone in which a run began; it may go on in another one
MODULE = "module "  # begins names of other packages' modules among versions; records of earlier versions lack them

_PROGRESS = "progress"  # name of the text in a checkpoint that is not the learner's
_NUMBERS_OF_PROGRESS = {"evaluated", "wall", "cpu", "return"}  # those that a checkpoint may have
_IGNORED_FIELDS = ("learner", MODEL_HASH, COMMIT)  # which may differ; the first two are of earlier versions
_MAX_TABLE = 1 << 30  # bytes
_MAX_CHECKPOINT_BYTES = 1 << 34  # unpacked; the labels of imitation are the largest part


class RunFolder:
    """An open folder of a run; `open_run` opens it.

    Attributes:
        path: path of the folder.
        arrays: arrays of the learner at the checkpoint; None before the first.
        progress: plain values that `save` wrote with the arrays.
    """

    def __init__(self, path: Path, arrays: dict[str, np.ndarray] | None, progress: dict[str, Any]):
        """Cut the tables back to the checkpoint."""
        self.path = path
        self.arrays = arrays
        self.progress = progress
        lengths = progress.get("tables", {})  # of the tables at the checkpoint, bytes
        self._files = {name: _open_table(path / f"{name}.csv") for name in TABLES}
        self._columns = {}
        for name, file in self._files.items():
            length = lengths.get(name, 0)
            if file.tell() < length:
                raise ValueError(
                    f"{path / name}.csv: shorter than at the checkpoint; delete {CHECKPOINT} to start over"
                )
            file.truncate(length)
            header, _, _ = (path / f"{name}.csv").read_text(encoding="utf-8").partition("\n")
            self._columns[name] = header.split(",") if header else None

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
        self._write(table, ",".join(_cell_text(value) for value in line.values()))

    def _write(self, table: str, line: str) -> None:
        try:
            self._files[table].write(f"{line}\n".encode())
        except OSError as error:
            raise OSError(f"cannot write {self.path / table}.csv: {error.strerror.lower()}") from None

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


def _open_table(path: Path) -> IO[bytes]:
    if path.exists() and not path.is_file():  # a pipe would block
        raise OSError(f"cannot write {path}: expected a file")
    return path.open("ab", buffering=0)


def _cell_text(value) -> str:
    plain_value = value.item() if isinstance(value, np.generic) else value
    return repr(plain_value)


@contextlib.contextmanager
def open_run(
    path: str | os.PathLike[str], config: Mapping[str, Any], growing: Sequence[str] = ()
) -> Iterator[RunFolder]:
    """Open the folder of a run, or make one, which is deleted if an error comes before the run has begun.

    Args:
        path: path of the folder.
        config: record of the configuration, plain values.
        growing: fields of the record whose integers may be larger than in the folder.

    Raises:
        ValueError: the folder is of another run or of none, or damaged, or another process writes to it.
        OSError: it cannot be read or written.
    """
    with contextlib.ExitStack() as stack:
        stack.enter_context(_delete_unless_begun(Path(path)))
        path = files.folder(path)
        stack.enter_context(files.hold_lock(path / LOCK, f"{path}: another process goes on with this run"))
        _write_config(path, config, growing)
        files.delete_temporaries(path / CHECKPOINT)  # of a process that was killed; they take megabytes
        arrays, progress = _read_checkpoint(path / CHECKPOINT)
        run_files = RunFolder(path, arrays, progress)
        stack.callback(run_files.close)
        yield run_files


def _suggest_run(path: Path) -> str:
    """Return the part of an error that suggests a run: that of a file, one in a folder, or one of a similar name.

    It is "" for none.
    """
    if not path.exists():
        path_in_runs = Path(files.RUNS_FOLDER) / path
        return f"; did you mean {path_in_runs}?" if (path_in_runs / CONFIG).exists() else files.suggest_path(path)
    configs = [path.parent / CONFIG] if path.is_file() else sorted(path.glob(f"*/{CONFIG}"))
    runs = [config.parent for config in configs if config.exists()]
    return f"; did you mean {runs[0]}?" if runs else ""


def read_config(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the record of the configuration in a run's folder.

    Raises:
        ValueError: no folder of a run.
    """
    if not (Path(path) / CONFIG).exists():
        raise ValueError(f"{path}: no folder of a run{_suggest_run(Path(path))}")
    with parsers.guard(f"{path}: no folder of a run"):
        config = files.read_json(Path(path) / CONFIG)
    if not isinstance(config, dict):
        raise ValueError(f"{path}: no folder of a run")
    return config


def read_progress(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the progress of the latest checkpoint; empty without a checkpoint.

    Raises:
        ValueError: the checkpoint is damaged.
    """
    _, progress = _read_checkpoint(Path(path) / CHECKPOINT, with_arrays=False)
    return progress


def read_arrays(path: str | os.PathLike[str]) -> dict[str, np.ndarray] | None:
    """Return the arrays of the latest checkpoint; None without a checkpoint.

    Raises:
        ValueError: the checkpoint is damaged.
    """
    arrays, _ = _read_checkpoint(Path(path) / CHECKPOINT)
    return arrays


def latest_returns(evaluations: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the returns (episodes,) of the latest evaluation in a table of evaluations."""
    latest_step = evaluations["step"][-1]
    return evaluations["return"][evaluations["step"] == latest_step]


def check_same_run(path: str | os.PathLike[str], config: Mapping[str, Any], left_out: Sequence[str] = ()) -> None:
    """Check that a folder has the record of a configuration.

    Args:
        path: path of the folder.
        config: record of a configuration.
        left_out: fields of it that may differ.

    Raises:
        ValueError: the folder is of another run, or of none.
    """
    plain_config = json.loads(json.dumps(config))  # as a file has it: lists for tuples
    for name, folder_value, value in checks.differences(read_config(path), plain_config):
        if name == LEG_VIEWS:
            raise ValueError(
                f"{path}: of another version, whose legs saw some blocks as the body has them; write to another folder"
            )
        if name == "steps" and name not in left_out and folder_value < value:
            algorithm = "finetune_bodies" if str(config.get("algorithm", "")).endswith("_bodies") else "finetune"
            raise ValueError(
                f"{path}: of a run of {folder_value} steps, which cannot be extended; to train its policy further, "
                f"write to another folder with --algorithm {algorithm} --hp start={path}"
            )
        field, _, _ = name.partition(".")
        is_unknown = folder_value is None and (name == PHYSICS or name.startswith(f"versions.{MODULE}"))
        if field not in (*left_out, *_IGNORED_FIELDS) and not is_unknown:
            raise ValueError(
                f"{path}: of another run, with {name} {checks.preview(folder_value)}, not {checks.preview(value)}; "
                "write to another folder"
            )


def lines(path: str | os.PathLike[str], name: str, columns: Sequence[str] = ()) -> list[dict[str, str]]:
    """Return the lines of a table of a run's folder as text by column; none where there is no table.

    A line without an end is left out, as it is still being written.

    Args:
        path: path of the folder.
        name: name of the table.
        columns: columns that the table must have, if it has a line.

    Raises:
        ValueError: a damaged table.
    """
    path = Path(path) / f"{name}.csv"
    with parsers.guard(f"{path}: no table of a run"):
        text = files.read_utf8(path, _MAX_TABLE) if path.exists() else ""
        text_of_complete_lines = text[: text.rfind("\n") + 1]
        header, *table_lines = text_of_complete_lines.splitlines() or [""]
        table_columns = header.split(",")
        missing = [column for column in columns if column not in table_columns]
        if table_lines and missing:
            raise ValueError(f"expected a column {missing[0]}")
        return [dict(zip(table_columns, line.split(","), strict=True)) for line in table_lines]


def table(path: str | os.PathLike[str], name: str) -> dict[str, np.ndarray]:
    """Return a table of a run's folder: columns by name, none before the first line; see `lines`.

    Raises:
        ValueError: a damaged table.
    """
    table_lines = lines(path, name)
    columns = table_lines[0].keys() if table_lines else ()
    with parsers.guard(f"{Path(path) / name}.csv: no table of a run"):
        return {column: np.array([line[column] for line in table_lines], float) for column in columns}


def check_latest_evaluation(path: str | os.PathLike[str], step: int) -> None:
    """Check that the latest evaluation of a checkpoint is that of the table of evaluations.

    Args:
        path: path of the folder.
        step: environment step of the latest evaluation, by the checkpoint; 0 for none.

    Raises:
        ValueError: it is another one, so that evaluations would be left out.
    """
    steps = table(path, "evaluations").get("step", np.zeros(1))
    latest_step = steps[-1]
    if step != latest_step:
        raise ValueError(
            f"{Path(path) / CHECKPOINT} is damaged: evaluated: expected {latest_step:g}, as in evaluations.csv, "
            f"got {checks.preview(step)}; delete it to start the run over"
        )


def is_begun(path: str | os.PathLike[str]) -> bool:
    """Return whether the run of a folder has begun: it has a checkpoint, or a line in a table."""
    if (Path(path) / CHECKPOINT).exists():
        return True
    table_paths = [Path(path) / f"{name}.csv" for name in TABLES]
    return any(table_path.exists() and table_path.stat().st_size for table_path in table_paths)


@contextlib.contextmanager
def _delete_unless_begun(path: Path) -> Iterator[None]:
    """Delete a folder that was missing before, and parents that it needed, if an error comes before its run begins."""
    missing_folders = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        yield
    except Exception:
        if missing_folders and not is_begun(path):
            shutil.rmtree(path, ignore_errors=True)
            missing_parents = missing_folders[1:]
            for parent in missing_parents:
                with contextlib.suppress(OSError):  # another run may be in it by now
                    parent.rmdir()
        raise


def _write_config(path: Path, config: Mapping[str, Any], growing: Sequence[str]) -> None:
    """Compare the record with the folder's, and write it if no run has begun or some of its integers have grown."""
    names = sorted(file.name for file in path.iterdir() if not file.name.startswith("."))
    if names and CONFIG not in names:
        raise ValueError(f"{path}: no folder of a run, and not empty: it holds {names[0]}")
    if is_begun(path):
        folder_config = read_config(path)
        larger_fields = [
            field
            for field in growing
            if isinstance(folder_config.get(field), int) and folder_config[field] < config[field]
        ]
        check_same_run(path, config, left_out=larger_fields)
        if not larger_fields:
            return
    with files.writing_json(path / CONFIG) as file:  # maybe over that of a run that was refused
        file.update(config)


def _read_checkpoint(path: Path, with_arrays: bool = True) -> tuple[dict[str, np.ndarray] | None, dict[str, Any]]:
    """Return the arrays and the progress of a checkpoint; None and an empty progress where there is no file."""
    if not path.exists():
        return None, {}
    with parsers.guard(f"{path} is damaged", cure="; delete it to start the run over"):
        max_bytes = min(_MAX_CHECKPOINT_BYTES, files.plain(path).stat().st_size)  # `save` packs nothing
        arrays = archives.read(path, max_bytes, None if with_arrays else _PROGRESS)
        progress = json.loads(str(arrays.pop(_PROGRESS)))
        lengths = checks.mapping("tables", checks.mapping(_PROGRESS, progress).get("tables"))
        for name in TABLES:
            checks.integer(f"length of {name}", lengths.get(name, 0), 0)
        for name in _NUMBERS_OF_PROGRESS & progress.keys():
            checks.number(name, progress[name])
        for name in usage.STEP_COUNTS:
            checks.integer(name, progress.get(name, 0), 0)
        for source in progress.get("sources", []):
            checks.name(source, usage.SOURCES, "source")
        for step in progress.get("pending", []):
            checks.integer("pending", step, 1)
        return arrays, progress
