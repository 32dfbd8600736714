"""Privileged observations: what a simulation knows and a policy does not see, for critics and teachers.

They are declared as the blocks of an observation are, and have neither noise nor scale: lengths are in standing
heights h, speeds in sqrt(g h), turning rates in sqrt(g / h). A task has those of `blocks`, modifiers add what an
episode draws, and a task of your own may add others.
"""

from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block, places
from arc_suite.tasks.parts import ROTATIONS, Legs, Vector


def blocks(body: Body) -> dict[str, Block]:
    """Return the blocks of every task.

    `velocity` (6): of the torso, linear as it heads and angular in its own frame, without noise. `ground` (legs):
    height of the ground under each foot, 0 where it would be if the torso stood over it at its standing height.
    """
    return {
        "velocity": Block(
            (
                Vector("torso velocity", "sqrt(g h)"),
                Vector("torso angular velocity", "sqrt(g / h)", ROTATIONS, axial=True),
            )
        ),
        "ground": Block((Legs(body, "ground under the foot of {}", "h"),)),
    }


def read_observation(scene, data) -> dict:
    """Return the blocks of every task, each (..., size).

    Args:
        scene: `contract.Scene` of the task; numbers that differ between bodies may have a leading axis.
        data: `MjData`, or anything with its fields under any leading axes.
    """
    numpy, height = data.qpos.__array_namespace__(), scene.standing[..., 2:3]
    unit, rate, torso = (GRAVITY * height) ** 0.5, (GRAVITY / height) ** 0.5, data.qpos[..., :3]
    linear, heading = data.qvel[..., :3], rotations.yaw(data.qpos[..., 3:7])
    along = rotations.to_heading_frame(linear[..., :2], heading)
    velocity = [along / unit, linear[..., 2:] / unit, data.qvel[..., 3:6] / rate]
    feet = data.xpos[..., scene.layout.feet, :]
    ground = scene.arena.height(feet[..., 0], feet[..., 1]) + 0.0 * feet[..., 0]
    return {
        "velocity": numpy.concatenate(velocity, axis=-1),
        "ground": (ground - torso[..., 2:]) / height + 1.0,
    }


def vector(task, found: Mapping, dtype=np.float32):
    """Return blocks of the privileged observation of a task as one vector (..., size), as in `task.privileged_blocks`.

    Raises:
        ValueError: blocks are not those that the task declares.
    """
    expected = sizes(task)
    if (got := {name: block.shape[-1] for name, block in found.items()}) != expected:
        raise ValueError(f"privileged observation of {task.name}: expected blocks {expected}, got {got}")
    arrays = [found[name] for name in expected]
    return arrays[0].__array_namespace__().concatenate(arrays, axis=-1, dtype=dtype)


def sizes(task) -> dict[str, int]:
    """Return the sizes of the blocks by name, in the order of the vector."""
    return {name: block.size for name, block in task.privileged_blocks.items()}


def split(named: Mapping[str, int], vectors) -> dict[str, np.ndarray]:
    """Return vectors (..., size) as blocks by name, views of them, given the sizes of all."""
    return {name: vectors[..., part] for name, part in places(named).items()}
