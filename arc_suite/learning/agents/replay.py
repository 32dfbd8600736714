"""Replay buffers in memory-mapped files: the latest transitions of a run, and prior data.

An observation is stored once, as the next one of a transition is the observation of the transition after it. Last
observations of episodes are in a file of their own. A million transitions of Queen take 0.9 GB. Files have their
full size from the start, so a disk that is too small is an error at the start. Checkpoints hold a checksum of what
can be sampled, as a file that was deleted or cut reads as zeros.

Several environments take turns: with n of them, the transition after number k is number k + n.
"""

import os
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import files
from arc_suite.learning.agents.learner import Damaged

_ENDS = 256  # final observations by which their file grows
_CHUNK = 4096  # transitions that are read at once


class Transitions(NamedTuple):
    """Transitions of one or several control steps, with leading axes; float32.

    Attributes:
        observations: (..., size)
        actions: (..., joints)
        rewards: (...) sum of the rewards, those after the first step discounted.
        goes_on: (...) 0 where the episode was terminated, as a time limit terminates nothing; else the discount of
            the steps after the first, 1 for a single step.
        next_observations: (..., size) after the last step.
    """

    observations: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    goes_on: np.ndarray
    next_observations: np.ndarray


class Replay:
    """The latest transitions of streams of episodes, in files of a folder.

    Transitions that could be sampled `slack` transitions ago are not overwritten, so a run can resume from a
    checkpoint that is not older.

    Attributes:
        total: transitions added since the start.
        ends: episodes that ended since the start.
        checksum: sum of the CRC-32 of the transitions that can be sampled, with their numbers since the start.
    """

    def __init__(
        self, folder: Path, capacity: int, size: int, joints: int, slack: int = 0, mode: str = "w+", num_envs: int = 1
    ):
        """Map the files.

        Args:
            folder: of the files.
            capacity: transitions that can be sampled.
            size: of an observation.
            joints: of an action.
            slack: further transitions that are kept.
            mode: "w+" to make the files where they are missing, "r+" to resume from them, "r" to read them alone.
                Files to resume from may be shorter, of a smaller capacity at which no transition was overwritten.
            num_envs: environments, whose transitions are added in turn.

        Raises:
            Damaged: a file to resume from is missing, or one to read is missing or too short.
            OSError: the disk is full, or the like.
        """
        self._folder, self._capacity, self._size, self._mode = files.folder(folder), capacity, size, mode
        self._num_envs = num_envs
        self._slots = capacity + slack + num_envs  # further ones for the observations that come next
        make = mode == "w+"
        self._observations = self._mapped("observations", np.float32, (self._slots, size), make)
        self._actions = self._mapped("actions", np.float32, (self._slots, joints), make)
        self._rewards = self._mapped("rewards", np.float32, (self._slots,), make)
        self._goes_on = self._mapped("goes_on", np.float32, (self._slots,), make)
        self._end = self._mapped("ends", np.int32, (self._slots,), make)  # which final observation is next, or -1
        self._final = self._mapped("final_observations", np.float32, (_ENDS, size), make)
        self._checksums = np.zeros(self._slots, np.uint32)
        self.total = self.ends = self.checksum = 0

    def __len__(self) -> int:
        """Return the number of transitions that can be sampled."""
        return min(self.total, self._capacity)

    def add(self, observation, action, reward: float, terminated: bool, next_observation, is_last: bool) -> None:
        """Add a transition; if it is not the last of its episode, the next one starts from its next observation."""
        slot = self.total % self._slots
        self._observations[slot], self._actions[slot], self._rewards[slot] = observation, action, reward
        self._goes_on[slot], self._end[slot] = not terminated, -1
        if is_last:
            self._make_room(self.ends + 1)
            self._final[self.ends], self._end[slot] = next_observation, self.ends
            self.ends += 1
        else:
            self._observations[(slot + self._num_envs) % self._slots] = next_observation
        if self.total >= self._capacity:
            self.checksum -= int(self._checksums[(self.total - self._capacity) % self._slots])
        self.total += 1
        self._count_in(self.total - 1, self.transitions_at(np.array([len(self) - 1])))

    def transitions_at(self, indices: np.ndarray, n_step: int = 1, discount: float = 1.0) -> Transitions:
        """Return copies of transitions by index; index 0 is the oldest.

        Args:
            indices: (batch,) from 0 to `len` - 1.
            n_step: control steps of a transition; fewer where an episode or the stored transitions end.
            discount: of a control step.

        Returns:
            Arrays (batch, ...).
        """
        numbers = self.total - len(self) + indices  # since the start
        first = numbers % self._slots
        rewards, factor = self._rewards[first], np.ones(len(indices), np.float32)
        going = np.ones(len(indices), bool)
        for _ in range(n_step - 1):
            going &= (self._end[numbers % self._slots] < 0) & (numbers + self._num_envs < self.total)
            numbers = np.where(going, numbers + self._num_envs, numbers)
            factor = np.where(going, factor * np.float32(discount), factor)
            rewards += np.where(going, factor * self._rewards[numbers % self._slots], np.float32(0.0))
        last = numbers % self._slots
        nexts, ends = self._observations[(last + self._num_envs) % self._slots], self._end[last]
        final = ends >= 0
        nexts[final] = self._final[ends[final]]
        factor = factor * self._goes_on[last]
        return Transitions(self._observations[first], self._actions[first], rewards, factor, nexts)

    def restore(self, total: int, ends: int, checksum: int) -> None:
        """Resume with the given counters; at most `slack` later transitions may be on disk.

        Raises:
            Damaged: the files hold other transitions.
        """
        self.total, self.ends, self.checksum = total, ends, 0
        self._make_room(ends)
        for first in range(0, len(self), _CHUNK):
            indices = np.arange(first, min(first + _CHUNK, len(self)))
            self._count_in(total - len(self) + first, self.transitions_at(indices))
        if self.checksum != checksum:
            raise Damaged(f"{self._folder} holds other transitions")

    def _count_in(self, number: int, transitions: Transitions) -> None:
        """Add transitions to the checksum; the first one has a number since the start."""
        columns = [array.reshape(len(array), -1) for array in transitions]
        for row in np.concatenate(columns, axis=1):
            self._checksums[number % self._slots] = crc = zlib.crc32(row, number & 0xFFFFFFFF)
            self.checksum += crc
            number += 1

    def _make_room(self, ends: int) -> None:
        while len(self._final) < ends:
            shape = 2 * len(self._final), self._size
            self._final = self._mapped("final_observations", np.float32, shape, make=self._mode != "r")

    def _mapped(self, name: str, dtype, shape: tuple[int, ...], make: bool) -> np.ndarray:
        path, size = self._folder / name, int(np.prod(shape)) * np.dtype(dtype).itemsize
        if make or (self._mode == "r+" and path.is_file()):
            _allocate(path, size)
        elif not (path.is_file() and path.stat().st_size >= size):
            raise Damaged(f"{path} is missing or too short")
        found = np.memmap(path, dtype, "r" if self._mode == "r" else "r+", shape=shape)
        return np.asarray(found)  # indexing a plain array is faster


def _allocate(path: Path, size: int) -> None:
    """Make a file, or lengthen it."""
    try:
        with path.open("a+b") as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
            elif os.fstat(file.fileno()).st_size < size:
                file.truncate(size)
    except OSError as error:
        raise OSError(f"cannot write {path}: {(error.strerror or str(error)).lower()}") from None


class CombinedReplay:
    """Two sources of transitions in one: prior data, which are never overwritten, and a buffer."""

    def __init__(self, first: Replay, second: Replay):
        """Take the sources."""
        self._first, self._second = first, second

    def __len__(self) -> int:
        """Return the number of transitions that can be sampled."""
        return len(self._first) + len(self._second)

    def transitions_at(self, indices: np.ndarray, n_step: int = 1, discount: float = 1.0) -> Transitions:
        """Return copies of transitions by index, as `Replay.transitions_at` does; those of the first source come first.

        Args:
            indices: (batch,) from 0 to `len` - 1.
            n_step: control steps of a transition.
            discount: of a control step.

        Returns:
            Arrays (batch, ...), in the order of the indices.
        """
        count = len(self._first)
        of_first = indices < count
        steps = n_step, discount
        parts = (
            self._first.transitions_at(indices[of_first], *steps),
            self._second.transitions_at(indices[~of_first] - count, *steps),
        )
        places = np.argsort(np.concatenate([np.flatnonzero(of_first), np.flatnonzero(~of_first)]))
        return Transitions(*(np.concatenate(pair)[places] for pair in zip(*parts, strict=True)))
