"""Small pictures for buttons: bodies and palettes. They need no OpenGL."""

import base64
import functools
import io

import numpy as np
from PIL import Image, ImageDraw

from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.parts import describe_body, part_frames
from arc_suite.models import visuals
from arc_suite.robots import palettes
from arc_suite.robots.spec import Body

_SIZE = (84, 56)  # pixels, width and height
_SCALE = 3  # pixels drawn for each of the picture along its sides
_MARGIN = 2  # pixels
_TOLERANCE = 0.03  # standing heights, by which a face may cut into a round shape
_CAMERA = np.array((1.0, -1.1, 0.7))  # direction from the body
_LIGHT = np.array((0.3, -0.5, 0.8))  # direction of the light, from the body
_SHADE = 0.45  # of a face that the light does not reach


def body_picture(body: Body) -> str:
    """Return a picture of a body as it stands, as a value of CSS."""
    return _draw_body(body, visuals.key_of(body))


@functools.lru_cache(maxsize=64)
def _draw_body(body: Body, visuals_key: str) -> str:
    """Return the picture of `body_picture`, the same one for the same `visuals.key_of`."""
    triangles, colors = _body_triangles(body)
    camera = _CAMERA / np.linalg.norm(_CAMERA)
    right = np.cross((0.0, 0.0, 1.0), camera)
    right /= np.linalg.norm(right)
    axes = np.stack([right, -np.cross(camera, right), camera])  # right, down, towards the camera
    seen_triangles = triangles @ axes.T
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    light = np.maximum(normals @ _LIGHT / np.linalg.norm(_LIGHT), 0.0)
    shaded_colors = colors * (_SHADE + (1.0 - _SHADE) * light)[:, None]
    faces_camera = normals @ camera > 0.0
    order = [index for index in seen_triangles[..., 2].mean(axis=1).argsort() if faces_camera[index]]

    size = _SCALE * np.array(_SIZE)
    points = seen_triangles[..., :2]
    low = points.min(axis=(0, 1))
    high = points.max(axis=(0, 1))
    scale = ((size - 2 * _SCALE * _MARGIN) / (high - low)).min()
    points = scale * (points - 0.5 * (low + high)) + 0.5 * size
    picture = Image.new("RGBA", tuple(size.tolist()))
    draw = ImageDraw.Draw(picture)
    for index in order:
        draw.polygon([tuple(point) for point in points[index]], fill=_to_bytes(shaded_colors[index]))
    encoded = io.BytesIO()
    picture.resize(_SIZE, Image.Resampling.LANCZOS).save(encoded, "PNG")
    return f"url(data:image/png;base64,{base64.b64encode(encoded.getvalue()).decode()})"


def palette_picture(palette: str) -> str:
    """Return the colors of a palette side by side, as a value of CSS."""
    colors = [f"rgb{_to_bytes(np.array(color))}" for color in palettes.colors(palette).values()]
    width = 100.0 / len(colors)
    stops = [f"{color} {index * width:g}% {(index + 1) * width:g}%" for index, color in enumerate(colors)]
    return f"linear-gradient(to right, {', '.join(stops)})"


def _body_triangles(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (n, 3, 3) of a body as it stands, m, and their colors (n, 3), 0 to 1."""
    parts, materials = describe_body(body)
    triangles = []
    colors = []
    for part, position, orientation in zip(parts, *part_frames(parts), strict=True):
        for material, mesh in part_meshes(part, _TOLERANCE * body.torso.standing_height).items():
            mesh_in_world = mesh.transform(position, orientation)
            triangles.append(mesh_in_world.points[mesh.triangles])
            colors.append(np.tile(materials[material].color, (len(mesh.triangles), 1)))
    return np.concatenate(triangles), np.concatenate(colors)


def _to_bytes(color: np.ndarray) -> tuple[int, ...]:
    return tuple((255.0 * color).round().astype(int).tolist())
