"""Storage of a dataset while it is collected, which opens after a kill or a full disk at any moment.

Files are written under temporary names and then moved. Finished episodes go to part files,
`data/parts/<n>.hdf5`. `main_data.hdf5`, which Minari opens, is a small file of links to the episodes
before the first missing one, and is replaced after each part; then follows `metadata.json`, with the
number of episodes. In the end the parts are merged into one plain `main_data.hdf5`, whose episodes
do not depend on the parts.

A new dataset starts in a hidden folder in the same parent, and moves to its place with its first
episodes; one that replaces another is exchanged with it when it is complete.
"""

import contextlib
import ctypes
import itertools
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Self

import h5py
from minari.dataset.minari_dataset import parse_dataset_id
from minari.namespace import create_namespace, list_local_namespaces

from arc_suite import files
from arc_suite.data import episodes, ids
from arc_suite.data.dataset import MAIN, METADATA, damages, read_metadata
from arc_suite.data.episodes import Episode

PARTS = "parts"

_HERE, _EXCHANGE = -100, 2  # AT_FDCWD and RENAME_EXCHANGE of Linux


class Storage:
    """The files of one dataset; `opened` makes one.

    Attributes:
        id: Minari's.
        metadata: Minari's without the counts; None in a new dataset until the caller sets it.
        merged: whether the dataset is one plain file.
    """

    def __init__(self, dataset_id: str, folder: Path, place: Path, early: bool):
        """Read the folder, which moves to its place with the first episodes (early), or at the end."""
        self.id, self.metadata = dataset_id, None
        self._folder, self._place = folder, place
        self._early = early
        self._where: dict[int, tuple[str, int]] = {}  # by index of an episode its part and its steps
        data = folder / "data"
        with damages(dataset_id, folder):
            for inside in (data, data / PARTS):
                if inside.is_symlink():  # nothing outside the dataset's folder is written or deleted
                    raise ValueError(f"expected a folder, and {inside} is a link")
        if (data / METADATA).exists() or any(data.rglob("*.hdf5")):
            self.metadata = read_metadata(dataset_id, folder)
        for leftover in [*data.glob(".*"), *data.glob(f"{PARTS}/.*")]:  # of a kill in mid-writing
            shutil.rmtree(leftover) if leftover.is_dir() and not leftover.is_symlink() else leftover.unlink()
        self.merged = (data / MAIN).exists() and not any(data.glob(f"{PARTS}/*.hdf5"))
        self._scan(MAIN if self.merged else f"{PARTS}/*.hdf5")

    @classmethod
    @contextlib.contextmanager
    def opened(cls, dataset_id: str, overwrite: bool, wait: bool = False) -> Iterator[Self]:
        """Open a dataset to collect into; no other process can meanwhile.

        Args:
            dataset_id: of a dataset that is there or of a new one.
            overwrite: start anew even if it is there; the old one stays until `finish`.
            wait: until no other process collects it.

        Raises:
            ValueError: the dataset is damaged, or, unless we wait, being collected by another process.
            OSError: its files cannot be made.
        """
        place = ids.folder(dataset_id)
        new, old, lock = (place.with_name(f".{place.name}.{suffix}") for suffix in ("new", "old", "lock"))
        _make_namespace(dataset_id)
        files.folder(place.parent)
        refusal = None if wait else f"dataset {dataset_id!r} is being collected by another process"
        with files.locked(lock, refusal):  # apart from the folders, which move
            if old.exists():  # killed while a dataset was replaced
                shutil.rmtree(old) if place.exists() else old.rename(place)
            folder = new if overwrite or not place.exists() else place
            files.folder(folder / "data")
            try:
                storage = cls(dataset_id, folder, place, early=not overwrite)
            except ValueError:
                if not overwrite:
                    raise
                shutil.rmtree(folder / "data")  # an overwriting collection that was given up, and damaged since
                files.folder(folder / "data")
                storage = cls(dataset_id, folder, place, early=False)
            try:
                yield storage
            finally:
                if not storage._where and storage._folder == new:
                    shutil.rmtree(new)

    @property
    def kept(self) -> frozenset[int]:
        """Return the indices of the episodes that are on disk."""
        return frozenset(self._where)

    def clear(self) -> None:
        """Delete the files of an unfinished collection."""
        data = self._folder / "data"
        (data / MAIN).unlink(missing_ok=True)
        if (data / PARTS).exists():
            shutil.rmtree(data / PARTS)
        (data / METADATA).unlink()  # last: the other files have no meaning without it
        self._where, self.metadata, self.merged = {}, None, False

    def add(self, finished: Mapping[int, Episode]) -> None:
        """Put finished episodes on disk, by index, and let Minari see them up to the first that is missing.

        Raises:
            OSError: a file cannot be written. Earlier episodes stay, and so does every one of these that fits.
        """
        try:
            self._add(finished)
        except OSError:
            if len(finished) > 1:
                for index in sorted(finished.keys() - self.kept):
                    with contextlib.suppress(OSError):
                        self._add({index: finished[index]})
            raise

    def _add(self, finished: Mapping[int, Episode]) -> None:
        if not (self._folder / "data" / METADATA).exists():
            self._write_metadata()  # first: episodes of unknown settings must not be continued
        parts = self._folder / "data" / PARTS
        parts.mkdir(exist_ok=True)
        if self.merged:
            whole = f"{PARTS}/{0:05}.hdf5"
            os.link(self._folder / "data" / MAIN, self._folder / "data" / whole)
            self.merged = False
            self._where = {index: (whole, steps) for index, (_, steps) in self._where.items()}
        number = 1 + max((int(part.stem) for part in parts.glob("*.hdf5")), default=-1)
        part = f"{PARTS}/{number:05}.hdf5"
        with _image() as file:
            for index, episode in finished.items():
                episodes.write(file, index, episode)
            self._write(part, file)
        self._where |= {index: (part, episode.length) for index, episode in finished.items()}
        self._publish()

    def finish(self, progress: Callable) -> None:
        """Merge the parts into one file, and put a dataset that replaces another in its place.

        Args:
            progress: wraps an iterable of the episodes' indices, such as `tqdm`.

        Raises:
            OSError: the disk has no space for two copies of the dataset; the present one still opens.
        """
        data, count = self._folder / "data", self._count()
        if not self.merged:
            needed, free = self._size(), shutil.disk_usage(data).free
            if free < needed:
                raise OSError(f"cannot write {data / MAIN}: no space left on device: {needed} bytes are needed")
            with files.writing(data / MAIN) as temporary, _one_line(data / MAIN):
                with h5py.File(temporary, "w") as merged:
                    order = itertools.groupby(progress(range(count)), key=lambda index: self._where[index][0])
                    for part, indices in order:
                        with h5py.File(data / part, "r") as source:
                            for index in indices:
                                source.copy(episodes.name(index), merged)
                _synchronise(temporary)
            self._where = {index: (MAIN, self._where[index][1]) for index in range(count)}
            self.merged = True
            self._write_metadata()
            (data / PARTS).rename(data / f".{PARTS}")
            shutil.rmtree(data / f".{PARTS}")
        self._move()

    def _scan(self, pattern: str) -> None:
        """Find the episodes on disk, read them and compare their digests."""
        data = self._folder / "data"
        for path in sorted(data.glob(pattern)):
            part = path.relative_to(data).as_posix()
            with damages(self.id, path), h5py.File(files.plain(path), "r") as file:
                for index in map(episodes.index, file):
                    self._where[index] = part, episodes.read(file, index).length

    def _count(self) -> int:
        """Return the number of episodes before the first that is missing."""
        return next(index for index in itertools.count() if index not in self._where)

    def _size(self) -> int:
        """Return the size of the files that hold episodes, bytes."""
        return sum((self._folder / "data" / part).stat().st_size for part in {part for part, _ in self._where.values()})

    def _publish(self) -> None:
        with _image() as file:
            for index in range(self._count()):
                name = episodes.name(index).encode()
                file.id.links.create_external(name, self._where[index][0].encode(), name)
            self._write(MAIN, file)
        self._write_metadata()
        if self._count() and self._early:
            self._move()

    def _write_metadata(self) -> None:
        count = self._count()
        counts = {
            "total_episodes": count,
            "total_steps": sum(self._where[index][1] for index in range(count)),
            "dataset_size": round(self._size() / 1e6, 1),  # MB, as Minari counts
        }
        path = self._folder / "data" / METADATA
        with files.writing(path) as temporary, _one_line(path):
            temporary.write_text(json.dumps(self.metadata | counts, indent=2) + "\n", encoding="utf-8")
            _synchronise(temporary)
        _synchronise(path.parent)

    def _write(self, name: str, file: h5py.File) -> None:
        """Write a file that was put together in memory, so that a full disk is Python's error and not HDF5's."""
        file.flush()
        path = self._folder / "data" / name
        with files.writing(path) as temporary, _one_line(path):
            temporary.write_bytes(file.id.get_file_image())
            _synchronise(temporary)
        _synchronise(path.parent)

    def _move(self) -> None:
        """Put the folder in its place."""
        if self._folder == self._place:
            return
        old = self._place.with_name(f".{self._place.name}.old")
        if not self._place.exists():
            self._folder.rename(self._place)
        elif _exchange(self._folder, self._place):
            self._folder.rename(old)
        else:
            self._place.rename(old)
            self._folder.rename(self._place)
        self._folder = self._place
        shutil.rmtree(old, ignore_errors=True)


def _make_namespace(dataset_id: str) -> None:
    namespace = parse_dataset_id(dataset_id)[0]
    if namespace is not None and namespace not in list_local_namespaces():
        create_namespace(namespace)


def _exchange(one: Path, other: Path) -> bool:
    """Let two folders change their names at once, so that neither is ever missing; False where that cannot be done."""
    try:
        renameat2 = ctypes.CDLL(None).renameat2
    except (AttributeError, TypeError):  # macOS; Windows
        return False
    return renameat2(_HERE, bytes(one), _HERE, bytes(other), _EXCHANGE) == 0  # not on every file system


def _image():
    """Return an HDF5 file in memory."""
    return h5py.File("image", "w", driver="core", backing_store=False)


@contextlib.contextmanager
def _one_line(path: Path):
    try:
        yield
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OSError(f"cannot write {path}: {reason.lower()}") from None


def _synchronise(path: Path) -> None:
    """Wait until a file or folder is on the disk; Windows opens no folders."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)  # Windows flushes what it may write
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
