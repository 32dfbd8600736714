"""A creature in viser's scene, as a tree of frames: a pose sends only the torso's place and the turns of the joints."""

import functools
from collections.abc import Callable

import numpy as np
import viser

from arc_suite import rotations
from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.parts import Part
from arc_suite.animation.studio.creature import Creature
from arc_suite.models.swinging import Swinging, list_bones
from arc_suite.tasks import readings

_HANDLE_SCALE = 1.35  # radius of a handle's ball, in radii of its link
_HANDLE_COLOR = (255, 140, 0)  # orange
_MAX_DRAG = 10.0  # units of the scene, that one drag can move a link's end
_MAX_DEVIATION = 0.01  # of a mesh from a round shape, in reaches of the creature


class Figure:
    """Frames and meshes of a creature under a node of the scene."""

    def __init__(self, scene: viser.SceneApi, root: str, creature: Creature, unit: float):
        """Add a creature, in its standing pose.

        Args:
            scene: scene of viser.
            root: name of a node of the scene.
            creature: creature to show.
            unit: unit of lengths in the scene, m.
        """
        self.creature = creature
        self._scene = scene
        self._unit = unit
        self._balls: list[viser.IcosphereHandle] = []
        self._frames: list[viser.FrameHandle] = []  # of the creature's parts
        for part in creature.parts:
            self._add_part(part, root)
        hinged_parts = [part for part in creature.parts if part.joint is not None]
        self._hinged_frames = [
            frame for frame, part in zip(self._frames, creature.parts, strict=True) if part.joint is not None
        ]
        self._hinge_joints = [part.joint for part in hinged_parts]  # indices of joints
        self._hinge_axes = np.array([part.axis for part in hinged_parts])  # (hinges, 3)
        self._standing_turns = np.array([part.quaternion for part in hinged_parts])  # (hinges, 4)
        self._swinging = Swinging(list_bones(creature.setup.body))
        self._swinging_frames = [
            frame for frame, part in zip(self._frames, creature.parts, strict=True) if part.swing is not None
        ]

    def show_handles(self, on_drag: Callable[[str, np.ndarray], None] | None) -> None:
        """Show a ball at the end of every link whose length can change, which visitors drag; None hides the balls.

        Args:
            on_drag: called with the name of a link's part, and the shift (3,) of its end in the frame of the link, m.
        """
        for ball in self._balls:
            ball.remove()
        self._balls = []
        if on_drag is None:
            return
        frame_names = {part.name: frame.name for part, frame in zip(self.creature.parts, self._frames, strict=True)}
        for leg in self.creature.setup.body.legs:
            for link in leg.links:
                part_name = leg.full_name(link)
                if part_name not in self.creature.parts_with_lengths:
                    continue
                ball = self._scene.add_icosphere(
                    f"{frame_names[part_name]}/end",
                    radius=_HANDLE_SCALE * link.radius / self._unit,
                    color=_HANDLE_COLOR,
                    position=np.array(link.end) / self._unit,
                )
                ball.on_drag(functools.partial(self._drag, part_name, on_drag))
                self._balls.append(ball)

    def pose(self, qpos: np.ndarray, seconds: float, shown_position: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Show a pose.

        Args:
            qpos: (nq,) positions.
            seconds: time of the episode, s.
            shown_position: maps the position (3,) of the torso to the position at which the scene shows it, m.

        Returns:
            The position (3,) of the torso, m.
        """
        scene = self.creature.environment.task.definition.scene
        pose = readings.pose(qpos, scene.layout)  # (7 + joints,): position and quaternion of the torso, joint angles
        torso_position = pose[:3]
        torso_quaternion = pose[3:7]
        hinge_angles = pose[7:][self._hinge_joints]  # (hinges,) rad, from the standing pose
        half_angles = 0.5 * hinge_angles[:, None]
        joint_turns = np.concatenate([np.cos(half_angles), np.sin(half_angles) * self._hinge_axes], axis=-1)
        quaternions = rotations.product(self._standing_turns, joint_turns)
        torso_frame = self._frames[0]
        torso_frame.position = shown_position(torso_position) / self._unit
        torso_frame.wxyz = torso_quaternion
        for frame, quaternion in zip(self._hinged_frames, quaternions, strict=True):
            frame.wxyz = quaternion
        swings = self._swinging.follow(seconds, pose[:7], scene.arena)
        for frame, quaternion in zip(self._swinging_frames, swings, strict=True):
            frame.wxyz = quaternion
        return torso_position

    def _add_part(self, part: Part, root: str) -> None:
        """Add the frame of a part, in the frame of its parent, and a mesh for each of its materials."""
        parent_name = root if part.parent is None else self._frames[part.parent].name
        frame_name = f"{parent_name}/{part.name}"
        frame = self._scene.add_frame(
            frame_name, show_axes=False, position=part.place / self._unit, wxyz=part.quaternion
        )
        self._frames.append(frame)
        for material, mesh in part_meshes(part, _MAX_DEVIATION * self.creature.reach).items():
            color = rgb(self.creature.materials[material].color)
            self._scene.add_mesh_simple(
                f"{frame_name}/{material}", mesh.points / self._unit, mesh.triangles, color=color
            )

    async def _drag(
        self, part_name: str, on_drag: Callable[[str, np.ndarray], None], event: viser.SceneNodeDragEvent
    ) -> None:
        """Report a drag when it ends, if it is a short vector: a browser may send anything."""
        if event.phase != "end":
            return
        shift = np.subtract(event.end_position, event.start_position)
        if shift.shape == (3,) and np.isfinite(shift).all() and np.linalg.norm(shift) < _MAX_DRAG:
            on_drag(part_name, self._unit * shift @ self._axes_in_scene(part_name))

    def _axes_in_scene(self, part_name: str) -> np.ndarray:
        """Return the axes of a part's frame in the scene, as columns (3, 3)."""
        parts = self.creature.parts
        index_by_name = {part.name: index for index, part in enumerate(parts)}
        index: int | None = index_by_name[part_name]
        axes = np.eye(3)
        while index is not None:
            axes = rotations.matrix(self._frames[index].wxyz) @ axes
            index = parts[index].parent
        return axes


def rgb(color) -> tuple[int, int, int]:
    """Return a color (3,), 0 to 1, in whole numbers, 0 to 255."""
    red, green, blue = (round(255.0 * float(component)) for component in color)
    return red, green, blue
