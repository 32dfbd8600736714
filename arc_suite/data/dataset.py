"""Opens datasets to be read."""

import contextlib
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py

from arc_suite import checks, files
from arc_suite.data import episodes, ids
from arc_suite.data.episodes import Episode
from arc_suite.data.settings import DatasetSettings
from arc_suite.envs.setup import Setup

METADATA = "metadata.json"

# What damage makes h5py, json and our own checks raise.
_DAMAGES = (
    ArithmeticError,
    AttributeError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)
MAIN = "main_data.hdf5"


def open(dataset_id: str) -> "Dataset":
    """Open a dataset that `collect` has written.

    Nothing that the files name is imported: for a dataset with a robot, task or arena of another package, import
    that package first.

    Args:
        dataset_id: such as "arc_suite/queen/walk/cpg-medium-v0"; Minari says where datasets lie.

    Raises:
        ValueError: no such dataset, one that is damaged or not of this suite, or one that needs a module
            which has not been imported.
    """
    return Dataset(dataset_id, ids.find(dataset_id))


class Dataset:
    """A dataset of recorded episodes: a sequence of `Episode`, each read on access.

    Attributes:
        id: Minari's.
        path: its folder.
        metadata: Minari's for the dataset; "arc_suite" holds `DatasetSettings.provenance`.
        settings: what the episodes depend on.
    """

    def __init__(self, dataset_id: str, path: Path):
        """Read the metadata; see `open`."""
        self.id, self.path = dataset_id, path
        self.metadata = read_metadata(dataset_id, path / "data")
        known = self.metadata["arc_suite"]
        try:
            setup = Setup.from_dict(known)
        except ValueError as error:
            raise ValueError(f"dataset {dataset_id!r}: {METADATA}: {checks.quote(error)}") from None
        with damages(dataset_id, path / "data" / METADATA):
            presets = _typed("presets", known["presets"], list)
            self.settings = DatasetSettings(
                setup=setup,
                policy=_typed("policy", known["policy"], str),
                presets=tuple(_typed("presets", preset, str) for preset in presets),
                noise=checks.number("noise", known["noise"], 0.0),
                seed=checks.seed(known["seed"]),
                steps=checks.integer("steps", known["steps"], 1),
            )
            self._length = checks.integer("total_episodes", self.metadata["total_episodes"], 0, 1 << 32)
            checks.integer("total_steps", self.metadata["total_steps"], 0, 1 << 53)
            _check_spec(self.metadata.get("env_spec"), self.settings, known)

    @property
    def seeds(self) -> range:
        """Seeds of all episodes."""
        return range(self.settings.seed, self.settings.seed + len(self))

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: int) -> Episode:
        """Read one episode.

        Raises:
            IndexError: there is none.
            ValueError: it is damaged.
        """
        index = range(len(self))[index]
        joints = len(self.settings.setup.body.joint_names)
        with self.reading() as file:
            episode = episodes.read(file, index)
            if episode.actions.shape[1] != joints:
                found = episode.actions.shape[1]
                raise ValueError(f"{episodes.name(index)}: expected actions of {joints} joints, found {found}")
        return episode

    def __iter__(self) -> Iterator[Episode]:
        return (self[index] for index in range(len(self)))

    def summaries(self) -> list[dict]:
        """Return the metadata of every episode: `seed`, `length`, `return`, `sha256`, and `preset` if there is one.

        Raises:
            ValueError: the file is damaged.
        """
        with self.reading() as file:
            return [episodes.summary(file, index) for index in range(len(self))]

    @contextlib.contextmanager
    def reading(self):
        """Yield the open HDF5 file; what goes wrong in reading it becomes a ValueError of one line."""
        path = self.path / "data" / MAIN
        with damages(self.id, path), h5py.File(files.plain(path), "r") as file:
            yield file


@contextlib.contextmanager
def damages(dataset_id: str, file: Path):
    """Turn what h5py raises at a damaged file into one line that names dataset and file.

    Raises:
        ValueError: the file is damaged.
    """
    try:
        yield
    except _DAMAGES as error:
        raise ValueError(f"dataset {dataset_id!r} is damaged: {file}: {checks.quote(error)}") from None


def _typed(name: str, value, kind: type):
    if not isinstance(value, kind):
        raise TypeError(f"expected {name} to be a {kind.__name__}")
    return value


def _check_spec(spec: str | None, settings: DatasetSettings, known: Mapping[str, Any]) -> None:
    """Compare Minari's spec of the environment, if there is one, with the settings, which are what we replay.

    Raises:
        ValueError: they differ.
    """
    if spec is None:
        return
    there, here = json.loads(spec), json.loads(settings.setup.spec(settings.steps).to_json())
    # A robot's text is that of the file; versions of tasks may have moved on since.
    here["kwargs"]["domain_name"] = known["robot"]
    for found in (there, here):
        found["id"] = re.sub(r"-v\d+$", "", found["id"])
    for name in ("id", "entry_point", "max_episode_steps", "kwargs"):
        if there.get(name) != here[name]:
            said, wanted = (checks.quote(json.dumps(each)) for each in (there.get(name), here[name]))
            raise ValueError(f"{name} of its env_spec is {said}, and its settings say {wanted}")


def read_metadata(dataset_id: str, folder: Path) -> dict:
    """Return the metadata of a dataset from the folder that holds the file.

    Raises:
        ValueError: it is damaged, or the dataset is not of this suite.
    """
    path = folder / METADATA
    with damages(dataset_id, path):
        metadata = files.read_json(path)
    if not isinstance(metadata, dict) or "arc_suite" not in metadata:
        raise ValueError(f"dataset {dataset_id!r} was not collected by arc_suite")
    with damages(dataset_id, path):
        for name, kind in (("versions", dict), ("model_sha256", str)):
            _typed(f"{name} of arc_suite", metadata["arc_suite"][name], kind)
    return metadata
