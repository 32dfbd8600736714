"""Privileged blocks that critics see after an observation: their columns, and mirror maps of both."""

from collections.abc import Iterable, Sequence

import numpy as np

from arc_suite import checks
from arc_suite.robots import mirror
from arc_suite.tasks import Task, blocks, mirrors, privileged
from arc_suite.tasks.mirrors import Symmetry


def mirror_maps(task: Task, critic_blocks: Iterable[str] = ()) -> Symmetry | None:
    """Return the mirror maps of a task, with privileged blocks after its observation; None for an asymmetric task."""
    try:
        symmetry = task.symmetry
        body_mirror = mirror.image(task.scene.body)
        privileged_mirrors = [task.privileged_blocks[name].mirror(body_mirror) for name in critic_blocks]
    except ValueError:
        return None
    return symmetry._replace(observation=mirrors.join([symmetry.observation, *privileged_mirrors]))


def privileged_columns(task: Task, critic_blocks: Sequence[str]) -> np.ndarray:
    """Return the indices of blocks in the privileged observation of a task.

    Raises:
        ValueError: the task has no such block.
    """
    if not critic_blocks:
        return np.arange(0)
    slices = blocks.slices(privileged.sizes(task))
    names = checks.names("critic_blocks", critic_blocks, slices, "block")
    return np.concatenate([np.arange(slices[name].start, slices[name].stop) for name in names])
