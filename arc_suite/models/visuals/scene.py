"""The scene in pictures: sky, ground, light and rendering quality."""

import math

import numpy as np
from dm_control import mjcf

# Pixels of the largest picture.
MAX_WIDTH = 3840
MAX_HEIGHT = 2160

# Colors, rgb.
_SKY = {"rgb1": (0.20, 0.28, 0.40), "rgb2": (0.62, 0.68, 0.74)}  # top and bottom
_HORIZON = tuple((top + bottom) / 2.0 for top, bottom in zip(_SKY["rgb1"], _SKY["rgb2"], strict=True))
_GROUND = {"rgb1": (0.33, 0.37, 0.42), "rgb2": (0.29, 0.33, 0.375), "markrgb": (0.50, 0.56, 0.62)}
_OBSTACLE = (0.62, 0.36, 0.22)  # stands out from ground and creatures

_SHADE_PER_HEIGHT = 0.35  # by which a box is darker that lies lower by the height of the creature
_EXTENT = 3.5  # of the scene, in heights of the creature; about MuJoCo's own extent for a creature on a plane

# Half of the shadow map's width, in extents.
_SHADOW_CLIP = 1.2  # on a plane
_WIDE_SHADOW_CLIP = 3.0  # where things other than the creature cast shadows

# Directions of lights. MuJoCo draws its map of shadows a pixel inside its edge. So ground that slopes along both of
# the map's sides would shade itself in one corner: the sun shines along x.
_SUN = (-0.36, 0.0, -1.0)
_RIM_LIGHT = (0.6, 0.5, -0.35)
_SUN_STRENGTH = 0.62
_RIM_STRENGTH = 0.25


def add_scene(root: mjcf.RootElement, height: float) -> None:
    """Add sky and light, and a grid on the ground that makes motion over it visible.

    Args:
        root: holds the body `torso` and the geoms of an arena.
        height: height of the creature, m; a cell of the grid is about that wide.
    """
    _set_rendering(root)
    _add_materials(root, height)
    ground_geoms = root.worldbody.geom  # of the arena; geoms of the creature are in its bodies
    _shade_ground(ground_geoms, height)
    obstacles = [geom for body in root.worldbody.body if body.mocap for geom in body.geom]
    if obstacles:
        root.asset.add("material", name="obstacle", rgba=(*_OBSTACLE, 1.0), specular=0.2, shininess=0.2)
    for geom in obstacles:
        geom.material = "obstacle"
    is_plane = all(geom.type == "plane" for geom in ground_geoms)
    if obstacles or not is_plane:
        # MuJoCo would stretch the map of shadows over the whole ground.
        root.statistic.set_attributes(extent=_EXTENT * height, center=(0.0, 0.0, height))
        root.visual.map.shadowclip = _WIDE_SHADOW_CLIP
    # Lights ride on the torso, so that shadows stay sharp however far the creature walks.
    torso = root.find("body", "torso")
    _add_light(torso, "sun", _SUN, _SUN_STRENGTH, height, casts_shadow=True)
    _add_light(torso, "rim", _RIM_LIGHT, _RIM_STRENGTH, height, casts_shadow=False)


def _set_rendering(root: mjcf.RootElement) -> None:
    """Set sizes, shadows, haze and the light of the camera."""
    getattr(root.visual, "global").set_attributes(offwidth=MAX_WIDTH, offheight=MAX_HEIGHT)
    root.visual.quality.shadowsize = 2048
    root.visual.map.shadowclip = _SHADOW_CLIP
    root.visual.quality.offsamples = 4
    root.visual.map.znear = 0.02
    root.visual.rgba.haze = (*_HORIZON, 1.0)
    root.visual.headlight.set_attributes(
        ambient=(0.28, 0.29, 0.32), diffuse=(0.22, 0.22, 0.22), specular=(0.1, 0.1, 0.1)
    )


def _add_materials(root: mjcf.RootElement, height: float) -> None:
    """Add the sky and the material of the ground, whose grid has cells about as wide as the creature is high, m."""
    root.asset.add("texture", name="sky", type="skybox", builtin="gradient", width=256, height=1536, **_SKY)
    root.asset.add(
        "texture", name="ground", type="2d", builtin="checker", mark="edge", width=256, height=256, **_GROUND
    )
    repeats = 0.5 / _round_length(height)  # of the texture in a meter; it has two cells
    root.asset.add(
        "material",
        name="ground",
        texture="ground",
        texuniform=True,
        texrepeat=(repeats, repeats),
        specular=0.1,
        shininess=0.1,
    )


def _shade_ground(geoms, height: float) -> None:
    """Give geoms the material of the ground; higher boxes are brighter.

    Args:
        geoms: geoms of the ground.
        height: height of the creature, m.
    """
    tops = {geom: geom.pos[2] + geom.size[2] for geom in geoms if geom.type == "box"}  # m
    for geom in geoms:
        geom.material = "ground"
        if geom in tops:
            depth = max(tops.values()) - tops[geom]
            shade = 1.0 - _SHADE_PER_HEIGHT * depth / height
            geom.rgba = (shade, shade, shade, 1.0)


def _add_light(torso, name: str, direction: tuple, strength: float, height: float, casts_shadow: bool) -> None:
    """Add a light that rides on the torso.

    Args:
        torso: torso that it rides on.
        name: name of the light.
        direction: (3,) direction in which it shines, of any length.
        strength: strength of its diffuse color, at most 1.
        height: height of the creature, m.
        casts_shadow: whether things cast shadows in it.
    """
    unit_direction = np.array(direction) / np.linalg.norm(direction)
    torso.add(
        "light",
        name=name,
        mode="trackcom",
        directional=True,
        castshadow=casts_shadow,
        pos=tuple(-6.0 * height * unit_direction),
        dir=tuple(unit_direction),
        diffuse=(strength, 0.98 * strength, 0.94 * strength),
        specular=(0.35, 0.35, 0.35),
    )


def _round_length(length: float) -> float:
    """Return the nearest of ..., 0.1, 0.2, 0.5, 1, 2, ... m."""
    decade = 10.0 ** math.floor(math.log10(length))
    candidates = [decade * step for step in (1.0, 2.0, 5.0, 10.0)]
    return min(candidates, key=lambda candidate: abs(math.log(candidate / length)))
