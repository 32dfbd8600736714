"""Storage of a dataset while it is collected, which keeps every finished episode after a kill or a full disk.

Finished episodes go to part files in a hidden folder next to the dataset, `.<name>.parts`, which holds the
dataset's metadata, too. In the end they are merged with the dataset's earlier episodes into one
`main_data.hdf5`, which Minari opens. Every file is written under a temporary name and then moved. If a kill comes
before the merged file is moved, the next collection continues from the parts. The dataset then is as it was before, or
without metadata where it was to be overwritten.
"""

import contextlib
import itertools
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import h5py
from minari.dataset.minari_dataset import parse_dataset_id
from minari.namespace import create_namespace, list_local_namespaces

from arc_suite import files
from arc_suite.data import episodes, ids
from arc_suite.data.dataset import MAIN, METADATA, explain_damage, read_metadata
from arc_suite.data.episodes import Episode


class StoredEpisode(NamedTuple):
    """An episode on disk."""

    path: Path  # of the HDF5 file
    steps: int


class Storage:
    """The files of one dataset; `open` makes one.

    Attributes:
        id: Minari's id of the dataset.
        metadata: Minari's metadata without the counts of episodes and steps; None in a new dataset until the caller
            sets it.
    """

    def __init__(self, dataset_id: str, overwrite: bool):
        """Read the files that exist; see `open`."""
        self.id = dataset_id
        self.metadata: dict[str, Any] | None = None
        self._data = ids.folder(dataset_id) / "data"
        self._parts = ids.parts_folder(dataset_id)
        self._overwrite = overwrite
        self._continues = False  # whether the parts belong to this collection
        self._stored: dict[int, StoredEpisode] = {}  # by index
        if self._data.is_symlink():  # nothing outside the dataset's folder is written
            raise ValueError(f"dataset {dataset_id!r} is damaged: expected a folder, and {self._data} is a link")
        if self._data.exists():
            files.folder(self._data)  # raises an error if it is a file
        try:
            self._read()
        except ValueError:
            if not overwrite:
                raise
            self.clear()

    def _read(self) -> None:
        metadata_of_parts = None
        if (self._parts / METADATA).exists():
            metadata_of_parts = read_metadata(self.id, self._parts)
        else:  # parts whose deletion was interrupted
            shutil.rmtree(self._parts, ignore_errors=True)
        # With parts, the dataset counts only if it has metadata: a kill in the middle of an overwriting merge leaves it
        # without, and the parts hold all episodes. Without parts, any file is of the dataset, and damage is an error.
        pattern = "*" if metadata_of_parts is None else METADATA
        if not self._overwrite and any(self._data.glob(pattern)):
            self.metadata = read_metadata(self.id, self._data)
            self._scan(self._data / MAIN)
        if metadata_of_parts is None:
            return
        # Parts with other settings than the dataset's are left alone; the first new episodes replace them.
        if self.metadata is None or self.metadata["arc_suite"] == metadata_of_parts["arc_suite"]:
            self.metadata = metadata_of_parts
            self._continues = True
            for part in sorted(self._parts.glob("[0-9]*.hdf5")):
                self._scan(part)

    @classmethod
    @contextlib.contextmanager
    def open(cls, dataset_id: str, overwrite: bool, wait: bool = False) -> Iterator[Self]:
        """Open a dataset to add episodes; meanwhile, no other process can open it.

        Args:
            dataset_id: id of an existing dataset or of a new one.
            overwrite: whether to start a new dataset in place of an existing one, which stays until `finish`.
            wait: whether to wait until no other process collects it; else that is an error.

        Raises:
            ValueError: the dataset is damaged, or another process collects it.
            OSError: its files cannot be made.
        """
        folder = ids.folder(dataset_id)
        _make_namespace(dataset_id)
        files.folder(folder.parent)
        refusal = None if wait else f"dataset {dataset_id!r} is being collected by another process"
        with files.hold_lock(folder.with_name(f".{folder.name}.lock"), refusal):
            yield cls(dataset_id, overwrite)

    @property
    def kept(self) -> frozenset[int]:
        """The indices of the episodes that are on disk."""
        return frozenset(self._stored)

    def clear(self) -> None:
        """Forget all episodes; `add` then deletes their parts before it writes new ones."""
        self._stored = {}
        self.metadata = None
        self._continues = False

    def add(self, finished: Mapping[int, Episode]) -> None:
        """Put finished episodes on disk, by index.

        Raises:
            OSError: a file cannot be written. Earlier episodes stay.
        """
        if not self._continues:
            shutil.rmtree(self._parts, ignore_errors=True)
            files.folder(self._parts)
            _write_metadata(self._parts, self.metadata)  # before episodes, whose settings must be known
            self._continues = True
        path = self._parts / f"{min(finished)}.hdf5"
        # As the file is composed in memory, a full disk raises an error of Python and not one of HDF5.
        with h5py.File("image", "w", driver="core", backing_store=False) as file:
            for index, episode in finished.items():
                episodes.write(file, index, episode)
            file.flush()
            with _writing(path) as temporary:
                temporary.write_bytes(file.id.get_file_image())
        self._stored |= {index: StoredEpisode(path, episode.length) for index, episode in finished.items()}

    def add_metadata(self, metadata: dict[str, Any]) -> None:
        """Add to the metadata of a dataset that lacks no episode; those that it has leave its file as it is.

        Raises:
            OSError: the file cannot be written.
        """
        if metadata.items() <= self.metadata.items():
            return
        self.metadata |= metadata
        has_new_episodes = self._continues  # with which `finish` writes the metadata
        if not has_new_episodes:
            _write_metadata(self._data, self.metadata)

    def finish(self, progress: Callable[..., Any]) -> None:
        """Merge the episodes before the first missing one into the dataset. If none is missing, delete the parts.

        Args:
            progress: wraps an iterable of the episodes' indices, such as `tqdm`.

        Raises:
            OSError: the disk has no space for the merged file in addition to the parts, which stay.
        """
        count = 0  # of episodes before the first missing one
        while count in self._stored:
            count += 1
        has_new_episodes = self._continues
        if not has_new_episodes or count == 0:
            return
        path = files.folder(self._data) / MAIN
        paths = {episode.path for episode in self._stored.values()}
        num_bytes = sum(part.stat().st_size for part in paths)
        if shutil.disk_usage(self._data).free < num_bytes:
            raise OSError(f"cannot write {path}: no space left on device: {num_bytes} bytes are needed")
        with _writing(path) as temporary:
            with h5py.File(temporary, "w") as merged:
                # Adjacent episodes of one file are copied together, so that it is opened once for them.
                indices = progress(range(count))
                indices_by_path = itertools.groupby(indices, key=lambda index: self._stored[index].path)
                for part, indices_in_part in indices_by_path:
                    with h5py.File(part, "r") as source:
                        for index in indices_in_part:
                            source.copy(episodes.name(index), merged)
            # The merged file takes its place at the end of this block. Metadata of the replaced episodes must not stand
            # next to it, not even after a kill.
            if self._overwrite:
                (self._data / METADATA).unlink(missing_ok=True)
        counts = {
            "total_episodes": count,
            "total_steps": sum(self._stored[index].steps for index in range(count)),
            "dataset_size": round(path.stat().st_size / 1e6, 1),  # MB, as Minari counts
        }
        _write_metadata(self._data, self.metadata | counts)
        if count == len(self._stored):
            shutil.rmtree(self._parts)

    def _scan(self, path: Path) -> None:
        """Note the episodes of a file. Each is read, as `episodes.read` compares its digest."""
        with explain_damage(self.id, path), h5py.File(files.plain(path), "r") as file:
            for index in map(episodes.index, file):
                self._stored[index] = StoredEpisode(path, episodes.read(file, index).length)


def _make_namespace(dataset_id: str) -> None:
    namespace, _, _ = parse_dataset_id(dataset_id)
    if namespace is not None and namespace not in list_local_namespaces():
        create_namespace(namespace)


def _write_metadata(folder: Path, metadata: Mapping) -> None:
    with _writing(folder / METADATA) as temporary:
        temporary.write_text(json.dumps(metadata, indent=2) + "\n", encoding="utf-8")


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[Path]:
    """Write a file atomically, with errors of one line; it is on the disk before it takes its place."""
    with files.writing(path) as temporary:
        try:
            yield temporary
            with temporary.open("r+b") as file:
                os.fsync(file.fileno())
        except (OSError, RuntimeError) as error:  # HDF5 raises both
            reason = getattr(error, "strerror", None) or str(error)
            raise OSError(f"cannot write {path}: {reason.lower()}") from None
