"""Creatures on their ground in viser's scene, in the light of pages to play in.

Lengths are in a `unit`, how far the creatures extend, so that the camera suits any size. The world moves under it.
"""

import functools
import math
from collections.abc import Callable

import numpy as np
import viser

from arc_suite.animation.clips import shapes
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.scenery import describe_ground
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.figure import Figure, rgb
from arc_suite.markers import Marker

_TOLERANCE = 0.01  # units, by which a face may cut into a round shape of the ground
_AROUND = 14.0  # units of ground to each side of the torso, where it is not endless
_NEAR = 10.0  # units from the edge of that ground, at which it is drawn anew
_FOLLOW = 0.1  # of the difference, by which the camera follows the height of the ground in a picture
_THIN: dict = {"thickness": 1.5, "thickness_units": "screen"}  # pixels
_RAISED = 0.005  # units, of lines over the ground
_SAME = 0.02  # units, by which an arrow may be off
_LANE = 0.9  # of both creatures' reach, between the one of now and the one that is kept
_CAMERA, _TARGET = (3.4, -4.7, 2.3), (0.0, 0.0, 0.25)  # units: the arrow of a command ends in the picture, too
_OVER_SHEET = (0.0, 0.0, -2.3)  # where the camera of a phone looks, whose lower part a sheet of widgets covers
_PHONE = 500  # pixels, of the width of a picture
_ANGLE = math.radians(35.0)  # of the camera, over the shorter side of a picture
_SKY, _GROUND, _LINES, _STEPS = (163, 173, 184), (93, 104, 117), (141, 153, 166), (93, 104, 117)
_FOG = (7.0, 18.0)  # units from the camera
_GRID: dict = {"infinite_grid": True, "fade_distance": 60.0, "cell_color": _LINES, "section_color": _LINES}
_GRID |= {"plane_color": _GROUND, "plane_opacity": 1.0, "shadow_opacity": 0.45}


class View:
    """Shows a creature to all visitors."""

    def __init__(self, server: viser.ViserServer):
        """Set up light and camera."""
        self._server, scene, camera = server, server.scene, server.initial_camera
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/sky", sky_color=(223, 232, 242), ground_color=(86, 96, 108), intensity=2.2)
        sun = {"color": (255, 244, 230), "intensity": 3.4, "position": (-0.3, 0.5, 1.2)}
        scene.add_light_directional("/sun", cast_shadow=True, **sun)
        scene.set_background_image(np.full((1, 1, 3), _SKY, np.uint8), format="png")
        scene.configure_fog(*_FOG, color=_SKY)
        camera.position, camera.look_at, camera.fov = _CAMERA, _TARGET, _ANGLE
        server.on_client_connect(_aim)

    def show(self, creature: Creature, kept: Creature | None = None) -> None:
        """Take the creature of the one before, in its pose of now, and one that is kept next to it."""
        self._creature, self._unit, self._lane = creature, creature.reach, np.zeros(3)
        if kept is not None:
            self._lane[1] = _LANE * (creature.reach + kept.reach)
            self._unit = max(creature.reach, kept.reach) + 0.5 * self._lane[1]
        with self._server.atomic():
            self._server.scene.remove_by_name("/world")
            self._world = self._server.scene.add_frame("/world", show_axes=False)
            self._figure = Figure(self._server.scene, "/world/now", creature, self._unit)
            self._kept = kept and Figure(self._server.scene, "/world/kept", kept, self._unit)
            self._height, self._aside = 0.0, np.full(3, np.inf)
            self._draw_ground()
            self._anchor = self._server.scene.add_frame("/world/markers", show_axes=False)
            self._arrows, self._cylinders = None, {}

    def pose(self, qpos: np.ndarray, markers: list[Marker], kept: np.ndarray | None = None) -> None:
        """Take a pose.

        Args:
            qpos: (nq,) positions.
            markers: of the task.
            kept: positions of the creature that is kept, if one is.
        """
        with self._server.atomic():
            place = self._figure.pose(qpos, lambda place: place)
            if self._kept is not None:
                self._kept.pose(kept, functools.partial(self._next_to, place))
            middle, place = (place + 0.5 * self._lane) / self._unit, place / self._unit
            if self._ground_is_stale(place):
                self._draw_ground()
            floor = float(self._arena.height(*place[:2] * self._unit)) / self._unit
            self._height += _FOLLOW * (floor - self._height)
            self._world.position = (-middle[0], -middle[1], -self._height)
            self._anchor.position = place * (1.0, 1.0, 0.0)
            self._mark(markers, place * (1.0, 1.0, 0.0))

    def handles(self, dragged: Callable[[str, np.ndarray], None] | None) -> None:
        """Show balls to drag the creature's links by, or hide them; see `Figure.handles`."""
        with self._server.atomic():
            self._figure.handles(dragged)

    def _next_to(self, place: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return where the scene shows the kept creature, whose torso is at a place of its `own`, m.

        It walks as far as it does, and is set next to the other one again where it would leave the picture.
        """
        if not np.linalg.norm(own + self._aside - place - self._lane) < self._lane[1]:
            self._aside = (place + self._lane - own) * (1.0, 1.0, 0.0)
        shown = own + self._aside
        arena = self._kept.creature.environment.task.definition.scene.arena
        rise = float(self._arena.height(*shown[:2])) - float(arena.height(*own[:2]))
        return shown + (0.0, 0.0, rise)

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
            found = describe_ground(environment, middle - reach, middle + reach)
        self._server.scene.remove_by_name("/world/ground")
        self._server.scene.add_frame("/world/ground", show_axes=False)
        for index, height in enumerate(found["planes"]):
            place = (0.0, 0.0, height / self._unit)
            tile = self._creature.tile / self._unit
            sizes = {"cell_size": tile, "section_size": 5.0 * tile}
            self._server.scene.add_grid(f"/world/ground/plane{index}", position=place, **_GRID | sizes)
        for index, field in enumerate(found["fields"]):
            self._add(f"/world/ground/field{index}", _surface(field), _GROUND)
            lines = _tiles(field, self._creature.tile) / self._unit + (0.0, 0.0, _RAISED)
            self._server.scene.add_line_segments(f"/world/ground/tiles{index}", lines, _LINES, **_THIN)
        solids: dict[tuple[int, int, int], list[Mesh]] = {}
        for solid in found["solids"]:
            mesh = shapes.shape_mesh(solid["kind"], solid["size"], _TOLERANCE * self._unit)
            shaded = [solid["shade"] * part for part in _STEPS]
            color = rgb([part / 255.0 for part in shaded] if solid["color"] is None else solid["color"])
            solids.setdefault(color, []).append(mesh.transform(solid["place"], np.eye(3)))
        for index, (color, meshes) in enumerate(solids.items()):
            self._add(f"/world/ground/solid{index}", shapes.join_meshes(meshes), color)

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
                colors = np.array([rgb(marker.color[:3]) for marker in arrows])
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
                index, radius, height, color = style
                self._cylinders[style] = self._server.scene.add_cylinder(
                    f"/world/markers/cylinder{index}", radius, height, color=color, opacity=0.7, position=middle
                )
            self._cylinders[style].position = middle

    def _style(self, index: int, marker: Marker) -> tuple:
        height = np.linalg.norm(marker.end - marker.start) / self._unit
        return index, round(marker.radius / self._unit, 4), round(float(height), 4), rgb(marker.color[:3])


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


def _tiles(field: dict, tile: float) -> np.ndarray:
    """The edges of tiles on a height field, at rows and columns of its points, as segments (n, 2, 3), m."""
    points = _surface(field).points.reshape(*field["heights"].shape, 3)
    strides = np.maximum(1, np.round(tile / field["cell"]).astype(int))
    starts = -np.round(field["low"] / field["cell"]).astype(int) % strides  # the same in every part of a field
    along_x, along_y = points[starts[1] :: strides[1]], points[:, starts[0] :: strides[0]]
    segments = (along_x[:, :-1], along_x[:, 1:]), (along_y[:-1], along_y[1:])
    return np.concatenate([np.stack(pair, axis=2).reshape(-1, 2, 3) for pair in segments])


def _aim(client: viser.ClientHandle) -> None:
    """Have a visitor's camera suit the form of the picture, now and later."""
    if client.camera.image_width < _PHONE:
        client.camera.look_at = _OVER_SHEET
    _fit_lens(client.camera)
    client.camera.on_update(_fit_lens)


def _fit_lens(camera: viser.CameraHandle) -> None:
    """Have a creature as far from the sides of a narrow picture as it is from top and bottom of a wide one."""
    camera.fov = 2.0 * math.atan(math.tan(0.5 * _ANGLE) * max(1.0, 1.0 / camera.aspect))
