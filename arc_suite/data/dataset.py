"""Opens datasets to be read."""

import contextlib
import json
import operator
from collections.abc import Iterator
from pathlib import Path

import h5py

from arc_suite import registry
from arc_suite.data import episodes, ids
from arc_suite.data.episodes import Episode
from arc_suite.data.settings import Settings
from arc_suite.envs.dm import load

METADATA = "metadata.json"
MAIN = "main_data.hdf5"


def open(dataset_id: str) -> "Dataset":
    """Open a dataset that `collect` has written.

    Args:
        dataset_id: such as "arc_suite/queen/walk/cpg-medium-v0"; Minari says where datasets lie.

    Raises:
        ValueError: no such dataset, or one that is damaged or not of this suite; one line.
    """
    return Dataset(dataset_id, ids.find(dataset_id))


class Dataset:
    """A dataset of recorded episodes: a sequence of `Episode`s, each read when it is asked for.

    Attributes:
        id: Minari's.
        path: its folder.
        metadata: Minari's for the dataset; "arc_suite" holds `settings`, `versions` and `model_sha256`.
        settings: what the episodes depend on.
    """

    def __init__(self, dataset_id: str, path: Path):
        """Read the metadata; see `open`."""
        self.id, self.path = dataset_id, path
        self.metadata = read_metadata(dataset_id, path)
        with damages(dataset_id, path / "data" / METADATA):
            known = self.metadata["arc_suite"]["settings"]
            fields = {name: known[name] for name in Settings._fields} | {"presets": tuple(known["presets"])}
            names = json.loads(self.metadata["env_spec"])["kwargs"]  # with the modules that register them
            domain, task = names["domain_name"], names["task_name"]
            self._length = operator.index(self.metadata["total_episodes"])
        self.settings = Settings(**fields | {"body": registry.body_of(domain), "task": task})

    def environment(self):
        """Return the dm_env in which the episodes play."""
        return load(self.settings.body, self.settings.task, self.settings.task_kwargs)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: int) -> Episode:
        """Read one episode.

        Raises:
            IndexError: there is none.
            ValueError: it is damaged; one line.
        """
        index = range(len(self))[index]
        with self.reading() as file:
            return episodes.read(file, index)

    def __iter__(self) -> Iterator[Episode]:
        return (self[index] for index in range(len(self)))

    def summaries(self) -> list[dict]:
        """Return the metadata of every episode: `seed`, `length`, `return`, `sha256`, and `preset` if there is one.

        Raises:
            ValueError: the file is damaged; one line.
        """
        with self.reading() as file:
            return [dict(file[episodes.name(index)].attrs) for index in range(len(self))]

    @contextlib.contextmanager
    def reading(self):
        """Yield the open HDF5 file; what goes wrong in reading it becomes a ValueError of one line."""
        path = self.path / "data" / MAIN
        with damages(self.id, path), h5py.File(path, "r") as file:
            yield file


@contextlib.contextmanager
def damages(dataset_id: str, file: Path):
    """Turn what h5py raises at a damaged file into a ValueError of one line that names dataset and file."""
    try:
        yield
    except (LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
        raise ValueError(f"dataset {dataset_id!r} is damaged: {file}: {error}") from None


def read_metadata(dataset_id: str, path: Path) -> dict:
    """Return the metadata of a dataset in a folder.

    Raises:
        ValueError: it is damaged, or the dataset is not of this suite; one line.
    """
    path = path / "data" / METADATA
    with damages(dataset_id, path):
        metadata = json.loads(path.read_text())
    if not isinstance(metadata, dict) or "arc_suite" not in metadata:
        raise ValueError(f"dataset {dataset_id!r} was not collected by arc_suite")
    with damages(dataset_id, path):
        for name, kind in (("settings", dict), ("versions", dict), ("model_sha256", str)):
            if not isinstance(metadata["arc_suite"][name], kind):
                raise TypeError(f"expected {name} of arc_suite to be a {kind.__name__}")
    if "task" not in metadata["arc_suite"]["settings"]:
        raise ValueError(
            f"dataset {dataset_id!r} is of an earlier form, which does not tell its task: collect it anew, "
            "with --overwrite under the same id"
        )
    return metadata
