"""A creature in viser's scene: a tree of frames, so that a pose sends the torso and the joints alone."""

import functools
from collections.abc import Callable

import numpy as np
import viser

from arc_suite import rotations
from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.studio.creature import Creature
from arc_suite.tasks import readings

_BALL, _ORANGE = 1.35, (255, 140, 0)  # radius of a handle, of its link's, and its color
_FURTHEST = 10.0  # of the unit, that a link can be dragged at once
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
        self.creature, self._scene, self._unit = creature, scene, unit
        self._balls: list[viser.IcosphereHandle] = []
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

    def handles(self, dragged: Callable[[str, np.ndarray], None] | None) -> None:
        """Show a ball at the end of every link, which visitors drag; None hides them.

        Args:
            dragged: called with the name of a link's part, and by how much (3,) its end was dragged, in the frame of
                the link, m.
        """
        for ball in self._balls:
            ball.remove()
        self._balls = []
        frames = dict(zip((part.name for part in self.creature.parts), self._frames, strict=True))
        links = [(leg.full_name(link), link) for leg in self.creature.setup.body.legs for link in leg.links]
        for name, link in links if dragged else ():
            radius, end = _BALL * link.radius / self._unit, np.array(link.end) / self._unit
            ball = self._scene.add_icosphere(f"{frames[name].name}/end", radius, color=_ORANGE, position=end)
            ball.on_drag(functools.partial(self._drag, name, dragged))
            self._balls.append(ball)

    async def _drag(self, name: str, dragged: Callable, event: viser.SceneNodeDragEvent) -> None:
        """Take a drag when it ends; a browser may send anything."""
        if event.phase != "end":
            return
        moved = np.subtract(event.end_position, event.start_position)
        if moved.shape == (3,) and np.isfinite(moved).all() and np.linalg.norm(moved) < _FURTHEST:
            dragged(name, self._unit * moved @ self._turn(name))

    def _turn(self, name: str) -> np.ndarray:
        """Return the axes of a part's frame in the scene, as columns (3, 3)."""
        parts, turn = self.creature.parts, np.eye(3)
        index = next((index for index, part in enumerate(parts) if part.name == name), None)
        while index is not None:
            turn, index = rotations.matrix(self._frames[index].wxyz) @ turn, parts[index].parent
        return turn

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
