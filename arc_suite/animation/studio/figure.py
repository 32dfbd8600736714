"""A creature in viser's scene: a tree of frames, so that a pose sends the torso and the joints alone."""

from collections.abc import Callable

import numpy as np
import viser

from arc_suite import rotations
from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.studio.creature import Creature
from arc_suite.tasks import readings

_TOLERANCE = 0.01  # of a creature's reach, by which a face may cut into a round shape


class Figure:
    """Frames and meshes of a creature under a node of the scene."""

    def __init__(self, scene: viser.SceneApi, root: str, creature: Creature, unit: float):
        """Add a creature, in its standing pose.

        Args:
            scene: of viser.
            root: name of a node of the scene.
            creature: to show.
            unit: of lengths in the scene, m.
        """
        self.creature, self._unit = creature, unit
        self._frames: list[viser.FrameHandle] = []
        names: list[str] = []
        for part in creature.parts:
            names.append(f"{root if part.parent is None else names[part.parent]}/{part.name}")
            frame = scene.add_frame(names[-1], show_axes=False, position=part.place / unit, wxyz=part.quaternion)
            self._frames.append(frame)
            for material, mesh in part_meshes(part, _TOLERANCE * creature.reach).items():
                color = rgb(creature.materials[material].color)
                scene.add_mesh_simple(f"{names[-1]}/{material}", mesh.points / unit, mesh.triangles, color=color)
        self._hinges = [(index, part.joint) for index, part in enumerate(creature.parts) if part.joint is not None]
        self._standing = np.array([creature.parts[index].quaternion for index, _ in self._hinges])
        self._axes = np.array([creature.parts[index].axis for index, _ in self._hinges])

    def pose(self, qpos: np.ndarray, place: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Take a pose.

        Args:
            qpos: (nq,) positions.
            place: where the scene shows a position (3,) of the torso, m.

        Returns:
            The position (3,) of the torso, m.
        """
        now = readings.pose(qpos, self.creature.environment.task.definition.scene.layout)
        half = 0.5 * now[7:][[joint for _, joint in self._hinges], None]
        turned = rotations.product(self._standing, np.concatenate([np.cos(half), np.sin(half) * self._axes], axis=-1))
        self._frames[0].position, self._frames[0].wxyz = place(now[:3]) / self._unit, now[3:7]
        for (index, _), wxyz in zip(self._hinges, turned, strict=True):
            self._frames[index].wxyz = wxyz
        return now[:3]


def rgb(color) -> tuple[int, int, int]:
    """Return a color (3,), 0 to 1, in whole numbers, 0 to 255."""
    red, green, blue = (round(255.0 * float(part)) for part in color)
    return red, green, blue
