"""The scene in pictures: sky, ground, light and rendering quality."""

import math

import numpy as np
from dm_control import mjcf

MAX_WIDTH, MAX_HEIGHT = 3840, 2160  # pixels of the largest picture

_SKY = {"rgb1": (0.20, 0.28, 0.40), "rgb2": (0.62, 0.68, 0.74)}
_HORIZON = tuple((top + bottom) / 2.0 for top, bottom in zip(_SKY["rgb1"], _SKY["rgb2"], strict=True))
_GROUND = {"rgb1": (0.33, 0.37, 0.42), "rgb2": (0.29, 0.33, 0.375), "markrgb": (0.50, 0.56, 0.62)}


_OBSTACLE = (0.62, 0.36, 0.22)  # stands out from ground and creatures
_SHADE = 0.35  # by which ground is darker that is a height of the creature lower
_EXTENT = 3.5  # of the scene, in heights of the creature, about what MuJoCo makes of one on a plane
_CLIP, _CLIP_WIDE = 1.2, 3.0  # half of the shadow map's width in extents: on a plane, where other things cast shadows
# MuJoCo draws its map a pixel inside its edge. So ground that slopes along both of the map's sides would shade itself
# in one corner: the sun shines along x.
_SUN, _RIM = (-0.36, 0.0, -1.0), (0.6, 0.5, -0.35)


def add_scene(root: mjcf.RootElement, height: float) -> None:
    """Add sky and light, and a grid on the ground that makes motion over it visible.

    Args:
        root: holds the body `torso` and the geoms of an arena.
        height: of the creature, m; a cell of the grid is about that wide.
    """
    getattr(root.visual, "global").set_attributes(offwidth=MAX_WIDTH, offheight=MAX_HEIGHT)
    root.visual.quality.shadowsize = 2048
    root.visual.map.shadowclip = _CLIP
    root.visual.quality.offsamples = 4
    root.visual.map.znear = 0.02
    root.visual.rgba.haze = (*_HORIZON, 1.0)
    root.visual.headlight.set_attributes(
        ambient=(0.28, 0.29, 0.32), diffuse=(0.22, 0.22, 0.22), specular=(0.1, 0.1, 0.1)
    )
    root.asset.add("texture", name="sky", type="skybox", builtin="gradient", width=256, height=1536, **_SKY)
    root.asset.add(
        "texture", name="ground", type="2d", builtin="checker", mark="edge", width=256, height=256, **_GROUND
    )
    root.asset.add(
        "material",
        name="ground",
        texture="ground",
        texuniform=True,
        texrepeat=(0.5 / _round_length(height),) * 2,
        specular=0.1,
        shininess=0.1,
    )
    ground = root.worldbody.geom  # of the arena; the bodies have theirs
    tops = {geom: geom.pos[2] + geom.size[2] for geom in ground if geom.type == "box"}
    for geom in ground:
        geom.material = "ground"
        if geom in tops:  # higher steps are brighter
            shade = 1.0 - _SHADE * (max(tops.values()) - tops[geom]) / height
            geom.rgba = (shade, shade, shade, 1.0)
    obstacles = [geom for body in root.worldbody.body if body.mocap for geom in body.geom]
    if obstacles:
        root.asset.add("material", name="obstacle", rgba=(*_OBSTACLE, 1.0), specular=0.2, shininess=0.2)
    for geom in obstacles:
        geom.material = "obstacle"
    if obstacles or any(geom.type != "plane" for geom in ground):  # would stretch the map of shadows over all of it
        root.statistic.set_attributes(extent=_EXTENT * height, center=(0.0, 0.0, height))
        root.visual.map.shadowclip = _CLIP_WIDE

    # Lights ride on the torso, so that shadows stay sharp however far the creature walks.
    torso = root.find("body", "torso")
    for name, towards, strength, casts in (
        ("sun", _SUN, 0.62, True),
        ("rim", _RIM, 0.25, False),
    ):
        direction = np.array(towards) / np.linalg.norm(towards)
        torso.add(
            "light",
            name=name,
            mode="trackcom",
            directional=True,
            castshadow=casts,
            pos=tuple(-6.0 * height * direction),
            dir=tuple(direction),
            diffuse=(strength, 0.98 * strength, 0.94 * strength),
            specular=(0.35, 0.35, 0.35),
        )


def _round_length(length: float) -> float:
    """Return the nearest of ..., 0.1, 0.2, 0.5, 1, 2, ... m."""
    decade = 10.0 ** math.floor(math.log10(length))
    return min((decade * step for step in (1.0, 2.0, 5.0, 10.0)), key=lambda step: abs(math.log(step / length)))
