"""Reading of datasets: a dataset is a sequence of recorded episodes."""

import contextlib
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, overload

import h5py

from arc_suite import checks, files, parsers, usage
from arc_suite.data import episodes, ids
from arc_suite.data.episodes import Episode
from arc_suite.data.settings import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.simulation.model_hash import PHYSICS

METADATA = "metadata.json"
MAIN = "main_data.hdf5"


def open(dataset_id: str) -> "Dataset":
    """Open a dataset that `collect` has written.

    Nothing that the files name is imported: for a dataset with a robot, task or arena of another package, import
    that package first.

    Args:
        dataset_id: such as "arc_suite/queen/walk/cpg-medium-v0"; Minari decides in which folder datasets lie.

    Raises:
        ValueError: no such dataset, one that is damaged or not of this suite, or one that needs a module
            which has not been imported; or a run learns that declares no prior data as its source.
    """
    usage.add_source(usage.PRIOR_DATA)
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
        self.id = dataset_id
        self.path = path
        self.metadata = read_metadata(dataset_id, path / "data")
        provenance = self.metadata["arc_suite"]
        try:
            setup = Setup.from_dict(provenance)
        except ValueError as error:
            raise ValueError(f"dataset {dataset_id!r}: {METADATA}: {checks.quote(error)}") from None
        with explain_damage(dataset_id, path / "data" / METADATA):
            presets = _check_type("presets", provenance["presets"], list)
            self.settings = DatasetSettings(
                setup=setup,
                policy=_check_type("policy", provenance["policy"], str),
                presets=tuple(_check_type("presets", preset, str) for preset in presets),
                noise=checks.number("noise", provenance["noise"], 0.0),
                seed=checks.seed(provenance["seed"]),
                steps=checks.integer("steps", provenance["steps"], 1),
            )
            self._length = checks.integer("total_episodes", self.metadata["total_episodes"], 0, 1 << 32)
            checks.integer("total_steps", self.metadata["total_steps"], 0, 1 << 53)
            _check_spec(self.metadata.get("env_spec"), self.settings, provenance)

    @property
    def seeds(self) -> range:
        """Seeds of all episodes."""
        return range(self.settings.seed, self.settings.seed + len(self))

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> Episode: ...

    @overload
    def __getitem__(self, index: slice) -> list[Episode]: ...

    def __getitem__(self, index):
        """Read one episode, or the list of those of a slice.

        Raises:
            IndexError: there is no such episode.
            ValueError: one is damaged.
        """
        position = range(len(self))[index]
        return [self._read(number) for number in position] if isinstance(index, slice) else self._read(position)

    def _read(self, index: int) -> Episode:
        """Return the episode of an index that exists; for errors see `__getitem__`."""
        joints = len(self.settings.setup.body.joint_names)
        with self.reading() as file:
            episode = episodes.read(file, index)
            joints_of_actions = episode.actions.shape[1]
            if joints_of_actions != joints:
                raise ValueError(
                    f"{episodes.name(index)}: expected actions of {joints} joints, found {joints_of_actions}"
                )
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
        """Yield the open HDF5 file. In this context, an error of a damaged file becomes a ValueError of one line.

        Raises:
            ValueError: a run learns that declares no prior data as its source.
        """
        usage.add_source(usage.PRIOR_DATA)
        path = self.path / "data" / MAIN
        with explain_damage(self.id, path), h5py.File(files.plain(path), "r") as file:
            yield file


def explain_damage(dataset_id: str, file: Path) -> contextlib.AbstractContextManager[None]:
    """Turn errors of a damaged file into one line that names dataset and file; see `parsers.guard`."""
    return parsers.guard(f"dataset {dataset_id!r} is damaged: {file}")


def _check_type(name: str, value, kind: type):
    """Return a value of a type; raise a TypeError for a value of another type."""
    if not isinstance(value, kind):
        raise TypeError(f"expected {name} to be a {kind.__name__}")
    return value


def _check_spec(spec: str | None, settings: DatasetSettings, provenance: Mapping[str, Any]) -> None:
    """Compare Minari's spec of the environment, if there is one, with the settings, by which episodes are replayed.

    Raises:
        ValueError: they differ.
    """
    if spec is None:
        return
    stored = json.loads(spec)
    expected = json.loads(settings.setup.spec(settings.steps).to_json())
    # Texts of one robot may differ, so that of the file is taken. Versions of tasks may have increased since.
    expected["kwargs"]["domain_name"] = provenance["robot"]
    stored["id"] = _without_version(stored["id"])
    expected["id"] = _without_version(expected["id"])
    for name in ("id", "entry_point", "max_episode_steps", "kwargs"):
        if stored.get(name) != expected[name]:
            stored_text = checks.quote(json.dumps(stored.get(name)))
            expected_text = checks.quote(json.dumps(expected[name]))
            raise ValueError(f"{name} of its env_spec is {stored_text}, and its settings say {expected_text}")


def _without_version(env_id: str) -> str:
    return re.sub(r"-v\d+$", "", env_id)


def read_metadata(dataset_id: str, folder: Path) -> dict:
    """Return the metadata of a dataset from the folder that holds the file.

    Raises:
        ValueError: it is damaged, or the dataset is not of this suite.
    """
    path = folder / METADATA
    with explain_damage(dataset_id, path):
        metadata = files.read_json(path)
    if not isinstance(metadata, dict) or "arc_suite" not in metadata:
        combined = isinstance(metadata, dict) and metadata.get("combined_datasets")
        origin = "was combined by Minari, which keeps no seeds" if combined else "was not collected by arc_suite"
        raise ValueError(f"dataset {dataset_id!r} {origin}")
    with explain_damage(dataset_id, path):
        suite_metadata = metadata["arc_suite"]
        _check_type("versions of arc_suite", suite_metadata["versions"], dict)
        _check_type(f"{PHYSICS} of arc_suite", suite_metadata.get(PHYSICS, ""), str)
    return metadata
