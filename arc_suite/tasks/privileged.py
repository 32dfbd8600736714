"""Privileged observations: numbers of the simulation that a policy does not see, for critics and teachers.

They are blocks like those of the observation, without noise. Lengths are in standing heights h, speeds in sqrt(g h),
turning rates in sqrt(g / h). Every task has those of `blocks`. Modifiers add what an episode draws, and a task of
another package may add its own.
"""

from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import Body
from arc_suite.tasks import readings
from arc_suite.tasks.blocks import Block, slices
from arc_suite.tasks.parts import ROTATIONS, Legs, Vector


def blocks(body: Body) -> dict[str, Block]:
    """Return the blocks of every task.

    `velocity` (6): of the torso, linear relative to the heading and angular in its own frame. `ground` (legs): height
    of the ground under each foot; 0 is the height at which the torso would be at its standing height.
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
    xp = data.qpos.__array_namespace__()
    height = scene.standing[..., 2:3]  # h, m
    velocity_unit = (GRAVITY * height) ** 0.5
    rate_unit = (GRAVITY / height) ** 0.5
    qpos = readings.torso_qpos(data.qpos, scene.layout)
    qvel = readings.torso_qvel(data.qvel, data.qpos, scene.layout)
    linear_velocity = qvel[..., :3]
    angular_velocity = qvel[..., 3:6]
    horizontal_velocity = rotations.to_heading_frame(linear_velocity[..., :2], rotations.yaw(qpos[..., 3:7]))
    velocity = [
        horizontal_velocity / velocity_unit,
        linear_velocity[..., 2:] / velocity_unit,
        angular_velocity / rate_unit,
    ]
    feet = data.xpos[..., scene.layout.feet, :]
    ground = scene.arena.height(feet[..., 0], feet[..., 1]) + 0.0 * feet[..., 0]  # level ground gives one number
    torso_height = qpos[..., 2:3]
    return {
        "velocity": xp.concatenate(velocity, axis=-1),
        "ground": (ground - torso_height) / height + 1.0,
    }


def vector(task, blocks_by_name: Mapping, dtype=np.float32):
    """Return blocks of the privileged observation of a task as one vector (..., size), as in `task.privileged_blocks`.

    Raises:
        ValueError: blocks are not those that the task declares.
    """
    expected = sizes(task)
    actual = {name: block.shape[-1] for name, block in blocks_by_name.items()}
    if actual != expected:
        raise ValueError(f"privileged observation of {task.name}: expected blocks {expected}, got {actual}")
    arrays = [blocks_by_name[name] for name in expected]
    return arrays[0].__array_namespace__().concatenate(arrays, axis=-1, dtype=dtype)


def sizes(task) -> dict[str, int]:
    """Return the sizes of the blocks by name, in the order of the vector."""
    return {name: block.size for name, block in task.privileged_blocks.items()}


def split(sizes_by_name: Mapping[str, int], vectors) -> dict[str, np.ndarray]:
    """Return vectors (..., size) as blocks by name, views of them, given the sizes of all."""
    return {name: vectors[..., part] for name, part in slices(sizes_by_name).items()}
