"""Creatures on their ground in viser's scene, in the light of pages to play in.

The scene measures lengths in a `unit`, the extent of the creatures, so that the camera suits creatures of any size. The
camera stands still, and the world moves under it.
"""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import viser

from arc_suite.animation.clips import shapes
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.scenery import describe_ground
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.figure import Figure, rgb
from arc_suite.markers import Marker

_CAMERA_POSITION = (3.4, -4.7, 2.3)  # units
_CAMERA_TARGET = (0.0, 0.0, 0.25)  # units, from which the arrow of a command is in the picture, too
_PHONE_TARGET = (0.0, 0.0, -1.3)  # units; a sheet of widgets covers the lower part of a phone's picture
_MAX_PHONE_WIDTH = 500  # pixels of a picture
_CAMERA_ANGLE = math.radians(35.0)  # over the shorter side of a picture
_CAMERA_RISE_SHARE = 0.1  # of the difference to the height of the ground, that the camera makes up in each picture
_COMPANION_DISTANCE = 0.9  # between both creatures, in sums of their reaches

_GROUND_EXTENT = 14.0  # units of uneven ground to each side of the torso, that are drawn
_GROUND_MARGIN = 10.0  # units from the edge of that ground, at which it is drawn again around the torso
_MAX_DEVIATION = 0.01  # units, of a mesh from a round shape of the ground
_LINE_LIFT = 0.005  # units, of lines over uneven ground
_LINE_STYLE: dict = {"thickness": 1.5, "thickness_units": "screen"}  # pixels
_TILES_PER_SECTION = 5.0

_MAX_ARROW_ERROR = 0.02  # units, by which an arrow may be off
_CYLINDER_OPACITY = 0.7

_SKY_COLOR = (163, 173, 184)
_GROUND_COLOR = (93, 104, 117)
_LINE_COLOR = (141, 153, 166)
_STEP_COLOR = (93, 104, 117)  # of steps and blocks in full light
_FOG_RANGE = (7.0, 18.0)  # units from the camera
_GRID_STYLE: dict = {
    "infinite_grid": True,
    "fade_distance": 60.0,  # units
    "cell_color": _LINE_COLOR,
    "section_color": _LINE_COLOR,
    "plane_color": _GROUND_COLOR,
    "plane_opacity": 1.0,
    "shadow_opacity": 0.45,
}


class View:
    """Shows a creature, and perhaps a companion, to all visitors."""

    def __init__(self, server: viser.ViserServer):
        """Set up light and camera."""
        self._server = server
        scene = server.scene
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/sky", sky_color=(223, 232, 242), ground_color=(86, 96, 108), intensity=2.2)
        scene.add_light_directional(
            "/sun", color=(255, 244, 230), intensity=3.4, position=(-0.3, 0.5, 1.2), cast_shadow=True
        )
        scene.set_background_image(np.full((1, 1, 3), _SKY_COLOR, np.uint8), format="png")
        scene.configure_fog(*_FOG_RANGE, color=_SKY_COLOR)
        camera = server.initial_camera
        camera.position = _CAMERA_POSITION
        camera.look_at = _CAMERA_TARGET
        camera.fov = _CAMERA_ANGLE
        server.on_client_connect(_aim_camera)

    def show(self, creature: Creature, companion: Creature | None = None) -> None:
        """Show a creature in place of the one before, and perhaps a companion next to it."""
        self._unit = creature.reach
        self._lane = np.zeros(3)  # from the creature to its companion, m
        if companion is not None:
            self._lane[1] = _COMPANION_DISTANCE * (creature.reach + companion.reach)
            self._unit = max(creature.reach, companion.reach) + 0.5 * self._lane[1]
        scene = self._server.scene
        with self._server.atomic():
            scene.remove_by_name("/world")
            self._world = scene.add_frame("/world", show_axes=False)
            self._figure = Figure(scene, "/world/now", creature, self._unit)
            self._companion = None if companion is None else Figure(scene, "/world/kept", companion, self._unit)
            self._companion_shift = np.full(3, np.inf)  # from where it walks to where it is shown, m; not yet known
            self._shown_floor = 0.0  # units, height of the floor that the camera follows
            self._ground = _Ground(scene, creature, self._unit)
            self._markers = _Markers(scene, self._unit)

    def pose(
        self,
        qpos: np.ndarray,
        markers: list[Marker],
        companion_qpos: np.ndarray | None = None,
        seconds: float = 0.0,
        companion_seconds: float = 0.0,
    ) -> None:
        """Show a pose.

        Args:
            qpos: (nq,) positions of the creature.
            markers: markers of the task.
            companion_qpos: (nq,) positions of the companion; None without one.
            seconds: time of the creature's episode, by which bones of its ornaments swing, s.
            companion_seconds: that of the companion.
        """
        with self._server.atomic():
            torso_position = self._figure.pose(qpos, seconds, shown_position=lambda position: position)
            if self._companion is not None:
                self._companion.pose(
                    companion_qpos, companion_seconds, functools.partial(self._place_companion, torso_position)
                )
            self._ground.follow(torso_position)
            floor = self._ground.height(torso_position) / self._unit
            self._shown_floor += _CAMERA_RISE_SHARE * (floor - self._shown_floor)
            center = (torso_position + 0.5 * self._lane) / self._unit  # between the creature and its companion
            self._world.position = (-center[0], -center[1], -self._shown_floor)
            self._markers.show(markers, torso_position)

    def show_handles(self, on_drag: Callable[[str, np.ndarray], None] | None) -> None:
        """Show balls to drag the creature's links by, or hide them; see `Figure.show_handles`."""
        with self._server.atomic():
            self._figure.show_handles(on_drag)

    def _place_companion(self, torso_position: np.ndarray, companion_position: np.ndarray) -> np.ndarray:
        """Return where the scene shows the companion's torso, (3,) m.

        The companion moves as in its own episode. Where it would leave the picture, it comes back next to the creature.

        Args:
            torso_position: (3,) position of the creature's torso, m.
            companion_position: (3,) position of the companion's torso in its own episode, m.
        """
        lane_error = np.linalg.norm(companion_position + self._companion_shift - torso_position - self._lane)
        is_in_picture = lane_error < self._lane[1]
        if not is_in_picture:
            self._companion_shift = (torso_position + self._lane - companion_position) * (1.0, 1.0, 0.0)
        shown_position = companion_position + self._companion_shift
        arena = self._companion.creature.environment.task.definition.scene.arena
        shown_floor = self._ground.height(shown_position)
        companion_floor = float(arena.height(*companion_position[:2]))
        return shown_position + (0.0, 0.0, shown_floor - companion_floor)


class _Ground:
    """The ground and the obstacles of a creature's episode: level ground without end, or uneven ground around it."""

    def __init__(self, scene: viser.SceneApi, creature: Creature, unit: float):
        """Draw the ground.

        Args:
            scene: scene of viser, with a node "/world".
            creature: on the ground.
            unit: unit of lengths in the scene, m.
        """
        self._scene = scene
        self._environment = creature.environment
        self._tile = creature.tile  # m
        self._unit = unit
        self._draw()

    def height(self, position: np.ndarray) -> float:
        """Return the height of the ground under a position (3,), m."""
        return float(self._arena.height(*position[:2]))

    def follow(self, torso_position: np.ndarray) -> None:
        """Draw the ground again if the torso is near its edge, or if obstacles have moved."""
        walked_distance = abs(torso_position[:2] - self._center).max() / self._unit
        is_near_edge = walked_distance > _GROUND_EXTENT - _GROUND_MARGIN and not self._is_endless
        if is_near_edge or not np.array_equal(self._obstacles, self._obstacle_positions()):
            self._draw()

    def _obstacle_positions(self) -> np.ndarray:
        return self._environment.physics.data.mocap_pos.copy()

    def _draw(self) -> None:
        """Draw planes, height fields and solids around the torso."""
        self._arena = self._environment.task.definition.scene.arena
        self._center = self._environment.physics.data.qpos[:2].copy()  # m
        self._obstacles = self._obstacle_positions()
        self._is_endless = self._arena.is_level and not len(self._obstacles)
        if self._is_endless:
            ground: dict = {"planes": [0.0], "fields": [], "solids": []}
        else:
            extent = _GROUND_EXTENT * self._unit
            ground = describe_ground(self._environment, self._center - extent, self._center + extent)
        self._scene.remove_by_name("/world/ground")
        self._scene.add_frame("/world/ground", show_axes=False)
        self._add_planes(ground["planes"])
        self._add_height_fields(ground["fields"])
        self._add_solids(ground["solids"])

    def _add_planes(self, heights: list[float]) -> None:
        """Add endless planes at heights, m, with tiles."""
        tile = self._tile / self._unit
        for index, height in enumerate(heights):
            self._scene.add_grid(
                f"/world/ground/plane{index}",
                position=(0.0, 0.0, height / self._unit),
                cell_size=tile,
                section_size=_TILES_PER_SECTION * tile,
                **_GRID_STYLE,
            )

    def _add_height_fields(self, fields: list[dict]) -> None:
        """Add height fields of `scenery.describe_ground`, with tiles."""
        for index, field in enumerate(fields):
            self._add_mesh(f"/world/ground/field{index}", _surface_mesh(field), _GROUND_COLOR)
            lines = _tile_edges(field, self._tile) / self._unit + (0.0, 0.0, _LINE_LIFT)
            self._scene.add_line_segments(f"/world/ground/tiles{index}", lines, _LINE_COLOR, **_LINE_STYLE)

    def _add_solids(self, solids: list[dict]) -> None:
        """Add solids of `scenery.describe_ground`, those of one color as one mesh."""
        meshes_by_color: dict[tuple[int, int, int], list[Mesh]] = {}
        for solid in solids:
            mesh = shapes.shape_mesh(solid["kind"], solid["size"], _MAX_DEVIATION * self._unit)
            if solid["color"] is None:
                # A shade is a brightness, 0 to 1.
                color = rgb([solid["shade"] * component / 255.0 for component in _STEP_COLOR])
            else:
                color = rgb(solid["color"])
            meshes_by_color.setdefault(color, []).append(mesh.transform(solid["place"], np.eye(3)))
        for index, (color, meshes) in enumerate(meshes_by_color.items()):
            self._add_mesh(f"/world/ground/solid{index}", shapes.join_meshes(meshes), color)

    def _add_mesh(self, name: str, mesh: Mesh, color: tuple[int, int, int]) -> None:
        self._scene.add_mesh_simple(name, mesh.points / self._unit, mesh.triangles, color=color)


class _CylinderStyle(NamedTuple):
    """What tells one drawn cylinder from another.

    Attributes:
        index: among the cylinders of the task.
        radius: units.
        height: units.
        color: 0 to 255.
    """

    index: int  # type: ignore[assignment]  # hides the method of tuples
    radius: float
    height: float
    color: tuple[int, int, int]


class _Markers:
    """The debug markers of a task: arrows and cylinders.

    They hang on an anchor under the torso: browsers show a frame's position at once, and new points of arrows later.
    """

    def __init__(self, scene: viser.SceneApi, unit: float):
        """Begin without markers.

        Args:
            scene: scene of viser, with a node "/world".
            unit: unit of lengths in the scene, m.
        """
        self._scene = scene
        self._unit = unit
        self._anchor = scene.add_frame("/world/markers", show_axes=False)
        self._arrows: viser.ArrowsHandle | None = None
        self._cylinders: dict[_CylinderStyle, viser.CylinderHandle] = {}

    def show(self, markers: list[Marker], torso_position: np.ndarray) -> None:
        """Move the markers, or draw them again if they are other ones.

        Args:
            markers: markers of the task.
            torso_position: (3,) m.
        """
        anchor = torso_position / self._unit * (1.0, 1.0, 0.0)
        self._anchor.position = anchor
        self._show_arrows([marker for marker in markers if marker.shape == "arrow"], anchor)
        self._show_cylinders([marker for marker in markers if marker.shape == "cylinder"], anchor)

    def _show_arrows(self, arrows: list[Marker], anchor: np.ndarray) -> None:
        """Show arrows relative to the anchor (3,), units."""
        ends = np.array([(arrow.start, arrow.end) for arrow in arrows]).reshape(-1, 2, 3)  # m
        points = ends / self._unit - anchor
        if self._arrows is not None and len(self._arrows.points) == len(arrows):
            if abs(self._arrows.points - points).max() > _MAX_ARROW_ERROR:
                self._arrows.points = points
            return
        if self._arrows is not None:
            self._arrows.remove()
            self._arrows = None
        if arrows:
            radius = arrows[0].radius / self._unit
            self._arrows = self._scene.add_arrows(
                "/world/markers/arrows",
                points,
                np.array([rgb(arrow.color[:3]) for arrow in arrows]),
                shaft_radius=radius,
                head_radius=2.0 * radius,
                head_length=3.0 * radius,
            )

    def _show_cylinders(self, cylinders: list[Marker], anchor: np.ndarray) -> None:
        """Show cylinders relative to the anchor (3,), units."""
        cylinder_by_style = {
            self._cylinder_style(index, cylinder): cylinder for index, cylinder in enumerate(cylinders)
        }
        for style in self._cylinders.keys() - cylinder_by_style.keys():
            self._cylinders.pop(style).remove()
        for style, cylinder in cylinder_by_style.items():
            center = 0.5 * (cylinder.start + cylinder.end) / self._unit - anchor
            if style not in self._cylinders:
                self._cylinders[style] = self._scene.add_cylinder(
                    f"/world/markers/cylinder{style.index}",
                    style.radius,
                    style.height,
                    color=style.color,
                    opacity=_CYLINDER_OPACITY,
                    position=center,
                )
            self._cylinders[style].position = center

    def _cylinder_style(self, index: int, cylinder: Marker) -> _CylinderStyle:
        height = np.linalg.norm(cylinder.end - cylinder.start) / self._unit
        return _CylinderStyle(
            index=index,
            radius=round(cylinder.radius / self._unit, 4),
            height=round(float(height), 4),
            color=rgb(cylinder.color[:3]),
        )


def _surface_points(field: dict) -> np.ndarray:
    """Return the points (rows, columns, 3) of a height field of `scenery.describe_ground`, m."""
    heights = field["heights"]
    count_y, count_x = heights.shape
    x = field["low"][0] + field["cell"][0] * np.arange(count_x)
    y = field["low"][1] + field["cell"][1] * np.arange(count_y)
    grid_x, grid_y = np.meshgrid(x, y)
    return np.stack([grid_x, grid_y, heights], axis=-1)


def _surface_mesh(field: dict) -> Mesh:
    """Return a height field of `scenery.describe_ground` as a mesh of two triangles a cell."""
    count_y, count_x = field["heights"].shape
    points = _surface_points(field).reshape(-1, 3)
    normals = np.tile((0.0, 0.0, 1.0), (len(points), 1))
    # Indices of the points at the low corners of cells; the next column is 1 further, the next row count_x further.
    corners = (np.arange(count_y - 1)[:, None] * count_x + np.arange(count_x - 1)).reshape(-1, 1)
    lower_triangles = corners + (0, 1, count_x)
    upper_triangles = corners + (1, count_x + 1, count_x)
    return Mesh(points, normals, np.concatenate([lower_triangles, upper_triangles]))


def _tile_edges(field: dict, tile: float) -> np.ndarray:
    """Return the edges of tiles on a height field, at rows and columns of its points, as segments (n, 2, 3), m.

    Args:
        field: field of `scenery.describe_ground`.
        tile: side of a tile, m.
    """
    points = _surface_points(field)
    strides = np.maximum(1, np.round(tile / field["cell"]).astype(int))  # points between two edges, along x and y
    # Edges count from the world's origin, so that they are the same in every part of a field.
    first_edges = -np.round(field["low"] / field["cell"]).astype(int) % strides
    lines_along_x = points[first_edges[1] :: strides[1]]
    lines_along_y = points[:, first_edges[0] :: strides[0]]
    segments_along_x = np.stack([lines_along_x[:, :-1], lines_along_x[:, 1:]], axis=2)
    segments_along_y = np.stack([lines_along_y[:-1], lines_along_y[1:]], axis=2)
    return np.concatenate([segments_along_x.reshape(-1, 2, 3), segments_along_y.reshape(-1, 2, 3)])


def _aim_camera(client: viser.ClientHandle) -> None:
    """Have a visitor's camera suit the shape of the picture, now and later."""
    target = _CAMERA_TARGET

    def fit_camera(camera: viser.CameraHandle) -> None:
        nonlocal target
        # A browser reports the size of its picture some time after it has connected.
        is_phone = camera.image_width < _MAX_PHONE_WIDTH and camera.aspect < 1.0
        suitable_target = _PHONE_TARGET if is_phone else _CAMERA_TARGET
        if suitable_target != target:
            target = suitable_target
            camera.look_at = target
        _fit_lens(camera)

    fit_camera(client.camera)
    client.camera.on_update(fit_camera)


def _fit_lens(camera: viser.CameraHandle) -> None:
    """Set the angle of view so that the shorter side of the picture always spans the same angle."""
    tangent = math.tan(0.5 * _CAMERA_ANGLE)  # of half of the angle over the shorter side
    camera.fov = 2.0 * math.atan(tangent * max(1.0, 1.0 / camera.aspect))  # over the height of the picture
