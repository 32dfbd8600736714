"""Episodes as arrays, and as groups of an HDF5 file in Minari's layout."""

import hashlib
import math
from collections.abc import Mapping
from typing import NamedTuple

import h5py
import numpy as np

from arc_suite.policies import Script

ARRAYS = ("observations", "actions", "rewards", "terminations", "truncations")
TERMS = "infos/reward_terms"  # as in the info of a step
_RESET_TERM = 0.0  # of the info of a reset, which comes first and has no reward; Minari stores steps + 1 infos

_ATTRIBUTES = {"id": int, "seed": int, "total_steps": int, "length": int, "return": float, "sha256": str}


class Episode(NamedTuple):
    """A recorded episode.

    Attributes:
        seed: seed of its reset.
        preset: preset of the demonstrator; None for other policies.
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
        """Return a policy, for one environment, that repeats the recorded actions; after the last, all are 0.

        In an environment of the same setup, reset with the episode's seed, the episode is repeated bit by bit.
        """
        return Script(lambda seed: self.actions, 1, self.actions.shape[1])

    def digest(self) -> str:
        """Return the sha256 of the whole episode: equal for bit-equal episodes."""
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
    for path, values in episode.arrays().items():
        array = np.append(_RESET_TERM, values) if path.startswith(TERMS) else values
        # h5py's `create_dataset` takes twice as long, which matters for short episodes.
        kind = h5py.h5t.py_create(array.dtype, logical=True)
        space = h5py.h5s.create_simple(array.shape)
        dataset = h5py.h5d.create(group.id, path.encode(), kind, space)
        dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, array)
    group.attrs.update(_attributes(index, episode))


def read(file, index: int) -> Episode:
    """Read an episode from an open HDF5 file.

    Sizes are compared with that of the file before anything is read, and no link is followed.

    Raises:
        ValueError: its attributes, such as the digest, do not fit its content, or its layout is not that of `write`.
        KeyError: there is no such episode, or an array or attribute is missing.
        OSError: it cannot be read.
    """
    group = _item(file, name(index), h5py.Group)
    stored_attributes = _read_attributes(group)
    arrays = _open_arrays(group)
    size = sum(map(_nbytes, arrays.values()))
    file_size = file.id.get_filesize()
    if size > file_size:
        raise ValueError(f"{group.name}: its arrays claim {size} bytes, and the file has {file_size}")
    values = {path: array[()] for path, array in arrays.items()}
    steps = len(values["rewards"])
    terms = {}
    for path in [path for path in values if path.startswith(TERMS)]:
        term = values.pop(path)
        term_of_reset = term[:-steps]  # empty in files of earlier versions
        if term_of_reset.any() or np.signbit(term_of_reset).any():
            raise ValueError(f"{group.name}/{path}: expected {_RESET_TERM} for the reset, found {term[0]}")
        terms[path.removeprefix(f"{TERMS}/")] = term[-steps:]
    episode = Episode(stored_attributes["seed"], stored_attributes.get("preset"), **values, terms=terms)
    for key, value in _attributes(index, episode).items():
        if stored_attributes[key] != value:
            raise ValueError(f"{name(index)}: expected {key} {value}, found {stored_attributes[key]}")
    return episode


def summary(file, index: int) -> dict:
    """Read the attributes of an episode from an open HDF5 file, without its arrays, whose length is compared.

    Raises:
        ValueError: an attribute is missing or of another kind, or its length is not that of the arrays.
        KeyError: there is no such episode.
        OSError: it cannot be read.
    """
    group = _item(file, name(index), h5py.Group)
    attributes = _read_attributes(group)
    (steps,) = _open_array(group, "rewards", (None,), float).shape
    if attributes["length"] != steps:
        raise ValueError(f"{name(index)}: expected length {steps}, found {attributes['length']}")
    return attributes


def _item(group, key: str, kind: type):
    """Return a group or an array that a group holds itself, not by a link."""
    if "/" in key or group.id.links.get_info(key.encode()).type != h5py.h5l.TYPE_HARD:
        raise ValueError(f"{group.name.rstrip('/')}/{key}: a link to elsewhere")
    item = group[key]
    if not isinstance(item, kind):
        raise ValueError(f"{item.name}: expected a {kind.__name__.lower()}")
    return item


def _read_attributes(group) -> dict:
    """Return the attributes of an episode in a file."""
    kinds = dict(_ATTRIBUTES)
    if "preset" in group.attrs:
        kinds["preset"] = str
    return {key: _read_attribute(group, key, kind) for key, kind in kinds.items()}


def _read_attribute(group, key: str, kind: type):
    attribute = group.attrs.get_id(key)
    if kind is str:
        text = h5py.check_string_dtype(attribute.dtype)
        fits = text is not None and text.length is None  # of any length
    else:
        fits = attribute.dtype.kind == np.dtype(kind).kind
    if attribute.shape != () or not fits:
        raise ValueError(f"{group.name}: expected the attribute {key} to be one {kind.__name__}")
    return kind(group.attrs[key])


def _open_arrays(group) -> dict[str, h5py.Dataset]:
    """Return the arrays of an episode by their paths, without reading their values."""
    (steps,) = _open_array(group, "rewards", (None,), float).shape
    if not steps:
        raise ValueError(f"{group.name}: has no steps")
    arrays = {
        "observations": _open_array(group, "observations", (steps + 1, None), np.float32),
        "actions": _open_array(group, "actions", (steps, None), np.float32),
        "rewards": _open_array(group, "rewards", (steps,), float),
        "terminations": _open_array(group, "terminations", (steps,), bool),
        "truncations": _open_array(group, "truncations", (steps,), bool),
    }
    terms = group
    for key in TERMS.split("/"):
        terms = _item(terms, key, h5py.Group)
    for term in terms:
        # Files of earlier versions have no info of the reset.
        is_earlier = _item(terms, term, h5py.Dataset).shape == (steps,)
        length = steps if is_earlier else steps + 1
        arrays[f"{TERMS}/{term}"] = _open_array(terms, term, (length,), float)
    return arrays


def _open_array(group, key: str, shape: tuple[int | None, ...], dtype) -> h5py.Dataset:
    """Return an array as `write` stores it, in this file, without reading its values.

    Args:
        group: group that holds it.
        key: its name in the group.
        shape: expected; None stands for any length.
        dtype: expected.
    """
    array = _item(group, key, h5py.Dataset)
    actual_shape = array.shape or ()
    fits = len(actual_shape) == len(shape)
    for actual_length, length in zip(actual_shape, shape, strict=False):
        if length is not None and actual_length != length:
            fits = False
    if not fits or array.dtype != dtype:
        expected = " x ".join("n" if length is None else str(length) for length in shape)
        raise ValueError(
            f"{array.name}: expected {expected} of {np.dtype(dtype)}, found {actual_shape} of {array.dtype}"
        )
    layout = array.id.get_create_plist()
    if layout.get_layout() != h5py.h5d.CONTIGUOUS or layout.get_external_count():
        raise ValueError(f"{array.name}: expected values in one piece in this file")
    start = array.id.get_offset()
    size = _nbytes(array)
    file_size = group.file.id.get_filesize()
    if size and (start is None or start + size > file_size):
        raise ValueError(f"{array.name}: claims {size} bytes, and the file has {file_size}")
    return array


def _nbytes(array: h5py.Dataset) -> int:
    return math.prod(array.shape) * array.dtype.itemsize


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


def index(group: str) -> int:
    """Return the index of the episode that a group holds.

    Raises:
        ValueError: the group's name is not that of an episode.
    """
    number = group.removeprefix("episode_")
    if not (number.isascii() and number.isdecimal() and len(number) < 12 and name(int(number)) == group):
        raise ValueError(f"{group[:80]!r}: expected the name of an episode")
    return int(number)


def name(index: int) -> str:
    """Return Minari's name of an episode's group in the HDF5 file."""
    return f"episode_{index}"
