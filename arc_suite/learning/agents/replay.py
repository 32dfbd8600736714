"""Replay buffers in memory-mapped files: the latest transitions of a run, and prior data.

An observation is stored once: the next observation of a transition is the observation of the transition after it.
Final observations of episodes are in a separate file. A million transitions of Queen take 0.9 GB. Files have their full
size from the start, so a disk that is too small is an error at the start. Checkpoints hold a checksum of what can be
sampled, as a file that was deleted or cut reads as zeros.

Several environments take turns: with n of them, the transition after number k is number k + n.
"""

import os
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import files
from arc_suite.learning.agents.learner import Damaged

_ENDS = 256  # final observations that a new file has room for
_NO_END = -1  # in place of the index of a final observation
_TRANSITIONS_PER_READ = 4096


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

    A slot of the files holds a transition. The last `slack` transitions that could be sampled before are not
    overwritten, so a run can resume from a checkpoint that is up to `slack` transitions old.

    Attributes:
        folder: folder of the files.
        size: numbers of an observation.
        joints: numbers of an action.
        slots: number of the slots.
        total: transitions added since the start.
        ends: episodes that ended since the start.
        checksum: sum of the CRC-32 of the transitions that can be sampled, with their numbers since the start.
    """

    def __init__(
        self, folder: Path, capacity: int, size: int, joints: int, slack: int = 0, mode: str = "w+", num_envs: int = 1
    ):
        """Map the files.

        Args:
            folder: folder of the files.
            capacity: transitions that can be sampled.
            size: numbers of an observation.
            joints: numbers of an action.
            slack: further transitions that stay in the files.
            mode: "w+" to make the files where they are missing, "r+" to resume from them, "r" to read them alone.
                Files to resume from may be shorter, of a smaller capacity at which no transition was overwritten.
            num_envs: environments, whose transitions are added in turn.

        Raises:
            Damaged: a file to resume from is missing, or one to read is missing or too short.
            OSError: the disk is full, or the like.
        """
        self.folder = files.folder(folder)
        self._capacity = capacity
        self.size = size
        self._mode = mode
        self._num_envs = num_envs
        self.joints = joints
        self.slots = capacity + slack + num_envs  # `num_envs` more for the next observations of the latest transitions
        make = mode == "w+"
        self._observations = self._map_file("observations", np.float32, (self.slots, size), make)
        self._actions = self._map_file("actions", np.float32, (self.slots, joints), make)
        self._rewards = self._map_file("rewards", np.float32, (self.slots,), make)
        self._goes_on = self._map_file("goes_on", np.float32, (self.slots,), make)
        # Of each slot the index of its next observation among the final ones; `_NO_END` where the episode goes on.
        self._end_indices = self._map_file("ends", np.int32, (self.slots,), make)
        self._final_observations = self._map_file("final_observations", np.float32, (_ENDS, size), make)
        self._checksums = np.zeros(self.slots, np.uint32)
        self.total = 0
        self.ends = 0
        self.checksum = 0

    def __len__(self) -> int:
        """Return the number of transitions that can be sampled."""
        return min(self.total, self._capacity)

    def add(self, observation, action, reward: float, terminated: bool, next_observation, is_last: bool) -> None:
        """Add a transition; if it is not the last of its episode, the next one starts from its next observation."""
        slot = self.total % self.slots
        self._observations[slot] = observation
        self._actions[slot] = action
        self._rewards[slot] = reward
        self._goes_on[slot] = not terminated
        if is_last:
            self._grow_final_observations(self.ends + 1)
            self._final_observations[self.ends] = next_observation
            self._end_indices[slot] = self.ends
            self.ends += 1
        else:
            self._end_indices[slot] = _NO_END
            self._observations[self._next_slots(slot)] = next_observation
        if self.total >= self._capacity:
            oldest_slot = (self.total - self._capacity) % self.slots
            self.checksum -= int(self._checksums[oldest_slot])
        self.total += 1
        latest = self.transitions_at(np.array([len(self) - 1]))
        self._add_to_checksum(self.total - 1, latest)

    def transitions_at(self, indices: np.ndarray, n_step: int = 1, discount: float = 1.0) -> Transitions:
        """Return copies of transitions by index; index 0 is the oldest.

        Args:
            indices: (batch,) from 0 to `len` - 1.
            n_step: control steps of a transition; fewer where an episode or the stored transitions end.
            discount: discount of a control step.

        Returns:
            Arrays (batch, ...).
        """
        numbers = self.total - len(self) + indices  # of transitions, since the start
        first_slots = numbers % self.slots
        last_numbers, rewards, discounts = follow_steps(
            numbers,
            self.total,
            self._num_envs,
            n_step,
            discount,
            reward_of=lambda numbers: self._rewards[numbers % self.slots],
            is_last=lambda numbers: self._end_indices[numbers % self.slots] >= 0,
        )
        last_slots = last_numbers % self.slots
        next_observations = self._observations[self._next_slots(last_slots)]
        end_indices = self._end_indices[last_slots]
        is_end = end_indices >= 0
        next_observations[is_end] = self._final_observations[end_indices[is_end]]
        return Transitions(
            observations=self._observations[first_slots],
            actions=self._actions[first_slots],
            rewards=rewards,
            goes_on=discounts * self._goes_on[last_slots],
            next_observations=next_observations,
        )

    def next_slots_to_add(self) -> np.ndarray:
        """Return the slots (num_envs,) of the transitions that a step of all environments will add."""
        return (self.total + np.arange(self._num_envs)) % self.slots

    def parts(self) -> Iterator[tuple[np.ndarray, Transitions, np.ndarray]]:
        """Yield all transitions in parts: slots, single steps, and whether they are the last of their episodes."""
        for first in range(0, len(self), _TRANSITIONS_PER_READ):
            indices = np.arange(first, min(first + _TRANSITIONS_PER_READ, len(self)))
            slots = (self.total - len(self) + indices) % self.slots
            yield slots, self.transitions_at(indices), self._end_indices[slots] >= 0

    def _next_slots(self, slots):
        """Return the slots of the next transitions of the same environments."""
        return (slots + self._num_envs) % self.slots

    def restore(self, total: int, ends: int, checksum: int) -> None:
        """Resume with the counters of a checkpoint; at most `slack` later transitions may be on disk.

        Raises:
            Damaged: the files hold other transitions.
        """
        self.total = total
        self.ends = ends
        self.checksum = 0
        self._grow_final_observations(ends)
        first_number = total - len(self)
        for first in range(0, len(self), _TRANSITIONS_PER_READ):
            indices = np.arange(first, min(first + _TRANSITIONS_PER_READ, len(self)))
            self._add_to_checksum(first_number + first, self.transitions_at(indices))
        if self.checksum != checksum:
            raise Damaged(f"{self.folder} holds other transitions")

    def _add_to_checksum(self, first_number: int, transitions: Transitions) -> None:
        """Add consecutive transitions to the checksum, of which the first has this number since the start."""
        columns = [array.reshape(len(array), -1) for array in transitions]
        for number, values in enumerate(np.concatenate(columns, axis=1), first_number):
            crc = zlib.crc32(values, number & 0xFFFFFFFF)
            self._checksums[number % self.slots] = crc
            self.checksum += crc

    def _grow_final_observations(self, ends: int) -> None:
        """Map the file of final observations again until it has room for this many."""
        while len(self._final_observations) < ends:
            shape = (2 * len(self._final_observations), self.size)
            make = self._mode != "r"
            self._final_observations = self._map_file("final_observations", np.float32, shape, make)

    def _map_file(self, name: str, dtype, shape: tuple[int, ...], make: bool) -> np.ndarray:
        """Map a file of the folder as an array.

        Args:
            name: name of the file.
            dtype: dtype of the array.
            shape: shape of the array.
            make: whether to make the file or to lengthen it.

        Raises:
            Damaged: the file is missing or too short.
        """
        path = self.folder / name
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize  # bytes
        is_resumed = self._mode == "r+" and path.is_file()
        if make or is_resumed:
            _allocate(path, size)
        elif not path.is_file() or path.stat().st_size < size:
            raise Damaged(f"{path} is missing or too short")
        mapped_array = np.memmap(path, dtype, "r" if self._mode == "r" else "r+", shape=shape)
        return np.asarray(mapped_array)  # indexing a plain array is faster


def follow_steps(ordinals, total, num_envs: int, n_step: int, discount: float, reward_of: Callable, is_last: Callable):
    """Follow transitions over several control steps, with arrays of NumPy or JAX.

    Args:
        ordinals: (batch,) numbers of the first transitions, since the start.
        total: transitions added since the start.
        num_envs: environments, whose transitions are added in turn.
        n_step: control steps; fewer where an episode or the stored transitions end.
        discount: discount of a control step.
        reward_of: function of such numbers that returns the rewards of these transitions.
        is_last: function of such numbers that returns whether these transitions are the last of their episodes.

    Returns:
        The numbers of the last transitions, the sums of the rewards, those after the first discounted, and the
        discounts of the last; (batch,) each.
    """
    xp = ordinals.__array_namespace__()
    rewards = reward_of(ordinals)
    discounts = xp.ones(len(ordinals), xp.float32)
    has_next_step = xp.ones(len(ordinals), bool)
    for _ in range(n_step - 1):
        is_next_stored = ordinals + num_envs < total
        has_next_step = has_next_step & ~is_last(ordinals) & is_next_stored
        ordinals = xp.where(has_next_step, ordinals + num_envs, ordinals)
        discounts = xp.where(has_next_step, discounts * np.float32(discount), discounts)
        rewards = rewards + xp.where(has_next_step, discounts * reward_of(ordinals), np.float32(0.0))
    return ordinals, rewards, discounts


def _allocate(path: Path, size: int) -> None:
    """Make a file of a size, bytes, or lengthen it."""
    try:
        with path.open("a+b") as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
            elif os.fstat(file.fileno()).st_size < size:
                file.truncate(size)
    except OSError as error:
        raise OSError(f"cannot write {path}: {(error.strerror or str(error)).lower()}") from None


class CombinedReplay:
    """Prior data, which are never overwritten, and a buffer, as one source of transitions."""

    def __init__(self, prior: Replay, buffer: Replay):
        """Combine prior data and a buffer."""
        self._prior = prior
        self._buffer = buffer

    def __len__(self) -> int:
        """Return the number of transitions that can be sampled."""
        return len(self._prior) + len(self._buffer)

    def transitions_at(self, indices: np.ndarray, n_step: int = 1, discount: float = 1.0) -> Transitions:
        """Return copies of transitions by index, as `Replay.transitions_at` does; the prior ones come first.

        Args:
            indices: (batch,) from 0 to `len` - 1.
            n_step: control steps of a transition.
            discount: discount of a control step.

        Returns:
            Arrays (batch, ...), in the order of the indices.
        """
        is_prior = indices < len(self._prior)
        prior_part = self._prior.transitions_at(indices[is_prior], n_step, discount)
        buffer_part = self._buffer.transitions_at(indices[~is_prior] - len(self._prior), n_step, discount)
        positions = np.concatenate([np.flatnonzero(is_prior), np.flatnonzero(~is_prior)])
        order = np.argsort(positions)
        return Transitions(*(np.concatenate(parts)[order] for parts in zip(prior_part, buffer_part, strict=True)))
