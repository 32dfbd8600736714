"""The creature in viser's scene: a tree of frames, so that a pose sends the torso and the joints alone.

Lengths are in the `unit` of the creature, so that the camera suits any size. The world moves under the camera.
"""

import numpy as np
import viser

from arc_suite import rotations
from arc_suite.animation.clips import shapes
from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.scenery import ground
from arc_suite.animation.studio.creature import Creature
from arc_suite.markers import Marker
from arc_suite.tasks import readings

_TOLERANCE = 0.01  # of the unit, by which a face may cut into a round shape
_AROUND = 14.0  # units of ground to each side of the torso, where it is not endless
_NEAR = 6.0  # units from the edge of that ground, at which it is drawn anew
_FOLLOW = 0.1  # of the difference, by which the camera follows the height of the ground in a picture
_SAME = 0.02  # units, by which an arrow may be off
_GROUND, _LINES, _STEPS = (214, 219, 226), (176, 184, 194), (196, 203, 212)
_GRID: dict = {"infinite_grid": True, "cell_size": 1.0, "section_size": 5.0, "fade_distance": 40.0}
_GRID |= {"cell_color": _LINES, "section_color": _LINES, "plane_color": _GROUND}
_GRID |= {"plane_opacity": 1.0, "shadow_opacity": 0.3}


class View:
    """Shows one creature at a time to all visitors."""

    def __init__(self, server: viser.ViserServer):
        """Set up light and camera."""
        self._server = server
        server.scene.configure_environment_map(environment_intensity=0.6)
        server.initial_camera.position = (2.6, -3.4, 1.9)
        server.initial_camera.look_at = (0.0, 0.0, 0.6)

    def show(self, creature: Creature) -> None:
        """Take the creature of the one before, in its pose of now."""
        self._creature, self._unit = creature, creature.unit
        colors = {name: _rgb(material.color) for name, material in creature.materials.items()}
        with self._server.atomic():
            self._server.scene.remove_by_name("/world")
            self._world = self._server.scene.add_frame("/world", show_axes=False)
            names: list[str] = []
            self._frames = []
            for part in creature.parts:
                names.append(f"{'/world' if part.parent is None else names[part.parent]}/{part.name}")
                frame = self._server.scene.add_frame(
                    names[-1], show_axes=False, position=part.place / self._unit, wxyz=part.quaternion
                )
                self._frames.append(frame)
                for material, mesh in part_meshes(part, _TOLERANCE * self._unit).items():
                    self._add(f"{names[-1]}/{material}", mesh, colors[material])
            self._hinges = [(index, part.joint) for index, part in enumerate(creature.parts) if part.joint is not None]
            self._standing = np.array([creature.parts[index].quaternion for index, _ in self._hinges])
            self._axes = np.array([creature.parts[index].axis for index, _ in self._hinges])
            self._height = 0.0
            self._draw_ground()
            self._anchor = self._server.scene.add_frame("/world/markers", show_axes=False)
            self._arrows, self._cylinders = None, {}

    def pose(self, qpos: np.ndarray, markers: list[Marker]) -> None:
        """Take a pose.

        Args:
            qpos: (nq,) positions.
            markers: of the task.
        """
        now = readings.pose(qpos, self._creature.environment.task.definition.scene.layout)
        place = now[:3] / self._unit
        if self._ground_is_stale(place):
            self._draw_ground()
        half = 0.5 * now[7:][[joint for _, joint in self._hinges], None]
        turned = rotations.product(self._standing, np.concatenate([np.cos(half), np.sin(half) * self._axes], axis=-1))
        floor = float(self._arena.height(*now[:2])) / self._unit
        self._height += _FOLLOW * (floor - self._height)
        with self._server.atomic():
            self._world.position = (-place[0], -place[1], -self._height)
            self._frames[0].position, self._frames[0].wxyz = place, now[3:7]
            for (index, _), wxyz in zip(self._hinges, turned, strict=True):
                self._frames[index].wxyz = wxyz
            self._anchor.position = place * (1.0, 1.0, 0.0)
            self._mark(markers, place * (1.0, 1.0, 0.0))

    def _add(self, name: str, mesh: Mesh, color: tuple[int, int, int]):
        return self._server.scene.add_mesh_simple(name, mesh.points / self._unit, mesh.triangles, color=color)

    def _ground_is_stale(self, place: np.ndarray) -> bool:
        walked = abs(place[:2] - self._middle).max() > _AROUND - _NEAR and not self._endless
        return walked or not np.array_equal(self._obstacles, self._mocap())

    def _mocap(self) -> np.ndarray:
        return self._creature.environment.physics.data.mocap_pos.copy()

    def _draw_ground(self) -> None:
        environment = self._creature.environment
        self._arena = environment.task.definition.scene.arena
        self._middle, self._obstacles = environment.physics.data.qpos[:2] / self._unit, self._mocap()
        self._endless = self._arena.is_level and not len(self._obstacles)
        found: dict = {"planes": [0.0], "fields": [], "solids": []}
        if not self._endless:
            reach, middle = _AROUND * self._unit, self._unit * self._middle
            found = ground(environment, middle - reach, middle + reach)
        self._server.scene.remove_by_name("/world/ground")
        self._server.scene.add_frame("/world/ground", show_axes=False)
        for index, height in enumerate(found["planes"]):
            place = (0.0, 0.0, height / self._unit)
            self._server.scene.add_grid(f"/world/ground/plane{index}", position=place, **_GRID)
        for index, field in enumerate(found["fields"]):
            self._add(f"/world/ground/field{index}", _surface(field), _GROUND)
        solids: dict[tuple[int, int, int], list[Mesh]] = {}
        for solid in found["solids"]:
            mesh = shapes.shape(solid["kind"], solid["size"], _TOLERANCE * self._unit)
            shaded = [solid["shade"] * part for part in _STEPS]
            rgb = _rgb([part / 255.0 for part in shaded] if solid["color"] is None else solid["color"])
            solids.setdefault(rgb, []).append(mesh.moved(solid["place"], np.eye(3)))
        for index, (rgb, meshes) in enumerate(solids.items()):
            self._add(f"/world/ground/solid{index}", shapes.joined(meshes), rgb)

    def _mark(self, markers: list[Marker], anchor: np.ndarray) -> None:
        """Move arrows and cylinders, or draw them anew where there are others.

        They hang on an anchor (3,), as browsers show a frame's position at once and new points of arrows later.
        """
        arrows = [marker for marker in markers if marker.shape == "arrow"]
        points = np.array([(marker.start, marker.end) for marker in arrows]).reshape(-1, 2, 3) / self._unit - anchor
        if self._arrows is None or len(self._arrows.points) != len(arrows):
            if self._arrows is not None:
                self._arrows.remove()
            self._arrows = None
            if arrows:
                radius = arrows[0].radius / self._unit
                colors = np.array([_rgb(marker.color[:3]) for marker in arrows])
                sizes: dict = {"shaft_radius": radius, "head_radius": 2.0 * radius, "head_length": 3.0 * radius}
                self._arrows = self._server.scene.add_arrows("/world/markers/arrows", points, colors, **sizes)
        elif arrows and abs(self._arrows.points - points).max() > _SAME:
            self._arrows.points = points
        cylinders = [marker for marker in markers if marker.shape == "cylinder"]
        shown = {self._style(index, marker): marker for index, marker in enumerate(cylinders)}
        for style in self._cylinders.keys() - shown.keys():
            self._cylinders.pop(style).remove()
        for style, marker in shown.items():
            middle = 0.5 * (marker.start + marker.end) / self._unit - anchor
            if style not in self._cylinders:
                index, radius, height, rgb = style
                self._cylinders[style] = self._server.scene.add_cylinder(
                    f"/world/markers/cylinder{index}", radius, height, color=rgb, opacity=0.7, position=middle
                )
            self._cylinders[style].position = middle

    def _style(self, index: int, marker: Marker) -> tuple:
        height = np.linalg.norm(marker.end - marker.start) / self._unit
        return index, round(marker.radius / self._unit, 4), round(float(height), 4), _rgb(marker.color[:3])


def _surface(field: dict) -> Mesh:
    """A height field as triangles."""
    heights = field["heights"]
    count_y, count_x = heights.shape
    axes = zip(field["low"], field["cell"], (count_x, count_y), strict=True)
    grid_x, grid_y = np.meshgrid(*(low + cell * np.arange(count) for low, cell, count in axes))
    corner = (np.arange(count_y - 1)[:, None] * count_x + np.arange(count_x - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + (0, 1, count_x), corner + (1, count_x + 1, count_x)])
    points = np.stack([grid_x, grid_y, heights], axis=-1).reshape(-1, 3)
    return Mesh(points, np.tile((0.0, 0.0, 1.0), (len(points), 1)), triangles)


def _rgb(color) -> tuple[int, int, int]:
    red, green, blue = (round(255.0 * float(part)) for part in color)
    return red, green, blue
