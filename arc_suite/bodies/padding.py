"""Padding of legs and joints: every body as one of 12 legs of 4 joints, 0 where it has none."""

import functools

import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.contract import Task
from arc_suite.tasks.parts import Padding, join_padding, joint_places

MAX_LEGS = 12  # at most, of a body
MAX_JOINTS = 4  # at most, of a leg


def pad_joints(body: Body, values: np.ndarray) -> np.ndarray:
    """Return values (joints, ...) of a body's joints as (12, 4, ...), 0 where there is none."""
    padded_values = np.zeros((MAX_LEGS * MAX_JOINTS, *np.shape(values)[1:]))
    padded_values[joint_slots(body)] = values
    return padded_values.reshape(MAX_LEGS, MAX_JOINTS, *padded_values.shape[1:])


def privileged_sizes(task: Task) -> dict[str, int]:
    """Return the sizes of the blocks of a task's privileged observation, padded to 12 legs of 4 joints."""
    return {name: _padding(block).size for name, block in task.privileged_blocks.items()}


def privileged_padding(task: Task) -> Padding:
    """Return the indices of a task's privileged observation in that of a body of 12 legs of 4 joints."""
    return join_padding([_padding(block) for block in task.privileged_blocks.values()])


def spread(padding: Padding, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (environments, size) of a body as padded ones (environments, padded size), 0 where padded."""
    padded_vectors = np.zeros((len(vectors), padding.size), vectors.dtype)
    padded_vectors[:, padding.places] = vectors
    return padded_vectors


def _padding(block: Block) -> Padding:
    """Return the indices of a block's numbers in the block of a body of 12 legs of 4 joints."""
    return join_padding([part.padding(MAX_LEGS, MAX_JOINTS) for part in block.parts])


def joint_slots(body: Body) -> np.ndarray:
    """Return the indices (joints,) of a body's joints among the 12 x 4 joints of padded legs.

    Raises:
        ValueError: the body has more than 12 legs, or a leg more than 4 joints.
    """
    return np.array(_cached_slots(body))


@functools.lru_cache(maxsize=256)
def _cached_slots(body: Body) -> tuple[int, ...]:
    return joint_places(body, MAX_LEGS, MAX_JOINTS)
