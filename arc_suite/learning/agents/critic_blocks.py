"""Privileged blocks behind an observation, for critics: their places, and mirror maps of both."""

from collections.abc import Iterable, Sequence

import numpy as np

from arc_suite import checks
from arc_suite.robots import mirror
from arc_suite.tasks import Task, blocks, mirrors, privileged
from arc_suite.tasks.mirrors import Symmetry


def mirror_maps(task: Task, critic_blocks: Iterable[str] = ()) -> Symmetry | None:
    """Return the mirror maps of a task, with privileged blocks after its observation; None where there are none."""
    try:
        own = task.symmetry
        image = mirror.image(task.scene.body)
        more = [task.privileged_blocks[name].mirror(image) for name in critic_blocks]
    except ValueError:
        return None
    return own._replace(observation=mirrors.join([own.observation, *more]))


def privileged_columns(task: Task, critic_blocks: Sequence[str]) -> np.ndarray:
    """Return the places of blocks in the privileged observation of a task.

    Raises:
        ValueError: the task has no such block.
    """
    if not critic_blocks:
        return np.arange(0)
    there = blocks.places(privileged.sizes(task))
    names = checks.names("critic_blocks", critic_blocks, there, "block")
    return np.concatenate([np.arange(there[name].start, there[name].stop) for name in names])
