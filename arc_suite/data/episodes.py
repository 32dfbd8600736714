"""Episodes as arrays, and as groups of an HDF5 file in Minari's layout."""

import hashlib
from collections.abc import Mapping
from typing import NamedTuple

import h5py
import numpy as np

from arc_suite.policies import Script

ARRAYS = ("observations", "actions", "rewards", "terminations", "truncations")
TERMS = "infos/reward_terms"  # as in the info of a step


class Episode(NamedTuple):
    """A recorded episode.

    Attributes:
        seed: of its reset.
        preset: of the demonstrator that walked; None for other policies.
        observations: (steps + 1, size) float32; the first is that of the reset.
        actions: (steps, joints) float32 in [-1, 1], as applied.
        rewards: (steps,) float64.
        terminations: (steps,) booleans.
        truncations: (steps,) booleans.
        terms: the reward's unweighted terms by name, each (steps,) float64.
    """

    seed: int
    preset: str | None
    observations: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    terminations: np.ndarray
    truncations: np.ndarray
    terms: Mapping[str, np.ndarray]

    @property
    def length(self) -> int:
        """Number of control steps."""
        return len(self.rewards)

    @property
    def total(self) -> float:
        """Return of the episode: the sum of its rewards, undiscounted."""
        return float(self.rewards.sum())

    @property
    def nbytes(self) -> int:
        """Size of all arrays, bytes."""
        return sum(array.nbytes for array in self.arrays().values())

    def playback(self) -> Script:
        """Return a policy, for one row, that does what was done; after the last recorded action, nothing.

        In an environment of the same body and task, whose reset has the episode's seed, it repeats
        the episode to the bit.
        """
        return Script(lambda seed: self.actions, 1, self.actions.shape[1])

    def digest(self) -> str:
        """Return the sha256 of the whole episode: equal for episodes that are equal to the bit."""
        total = hashlib.sha256(f"{self.seed} {self.preset}".encode())
        for name, array in sorted(self.arrays().items()):
            total.update(f"{name} {array.dtype.str} {array.shape}".encode())
            total.update(np.ascontiguousarray(array).data)
        return total.hexdigest()

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all arrays by their paths in the file."""
        terms = {f"{TERMS}/{name}": term for name, term in self.terms.items()}
        return {name: getattr(self, name) for name in ARRAYS} | terms


def write(file, index: int, episode: Episode) -> None:
    """Write an episode into an open HDF5 file, as `episode_<index>`.

    Attributes of the group, which Minari shows as the episode's metadata: `id`, `seed`,
    `total_steps`, `length`, `return`, `preset` if there is one, and `sha256`, the digest.
    """
    group = file.create_group(name(index))
    group.create_group(TERMS)
    for path, array in episode.arrays().items():
        # h5py's `create_dataset` takes twice as long as this, which episodes of few steps would feel.
        kind, space = h5py.h5t.py_create(array.dtype, logical=True), h5py.h5s.create_simple(array.shape)
        dataset = h5py.h5d.create(group.id, path.encode(), kind, space)
        dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, array)
    group.attrs.update(_attributes(index, episode))


def read(file, index: int) -> Episode:
    """Read an episode from an open HDF5 file.

    Raises:
        ValueError: its attributes, the digest among them, are not those of what is in it.
        KeyError: there is no such episode, or something in it is missing.
        OSError: it cannot be read.
    """
    group = file[name(index)]
    attributes = dict(group.attrs)
    episode = Episode(
        int(attributes["seed"]),
        attributes.get("preset"),
        **{array: group[array][()] for array in ARRAYS},
        terms={term: dataset[()] for term, dataset in group[TERMS].items()},
    )
    for key, value in _attributes(index, episode).items():
        if attributes.get(key) != value:
            raise ValueError(f"{group.name[1:]}: expected {key} {value}, found {attributes.get(key)}")
    return episode


def _attributes(index: int, episode: Episode) -> dict:
    attributes = {
        "id": index,
        "seed": episode.seed,
        "total_steps": episode.length,
        "length": episode.length,
        "return": episode.total,
        "sha256": episode.digest(),
    }
    return attributes if episode.preset is None else attributes | {"preset": episode.preset}


def name(index: int) -> str:
    """Return the name of an episode's group in the HDF5 file, as Minari has it."""
    return f"episode_{index}"
