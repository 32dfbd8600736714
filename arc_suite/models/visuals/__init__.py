"""Visuals of a body: colors and decorations, without mass or contacts."""

import math
from collections.abc import Iterable

import numpy as np
from dm_control import mjcf

from arc_suite import checks
from arc_suite.models.outline import solid_corners
from arc_suite.models.visuals import bastion, leaper, queen, tick
from arc_suite.models.visuals.generic import generic_visuals
from arc_suite.models.visuals.scene import add_scene
from arc_suite.models.visuals.spec import Bone, Ornament, Visuals
from arc_suite.robots import palettes
from arc_suite.robots.spec import Body, Leg, Link, Solid

# A creature without an entry has the visuals `generic`.
VISUALS = {"queen": queen.VISUALS, "bastion": bastion.VISUALS, "tick": tick.VISUALS, "leaper": leaper.VISUALS}

GROUP = 2  # of decorations; geoms that weigh or touch something are in group 0
_INERT = {"group": GROUP, "mass": 0.0, "contype": 0, "conaffinity": 0}

# How materials shine: emission, specular, shininess.
_FINISHES = {"shell": (0.0, 0.5, 0.6), "frame": (0.0, 0.6, 0.5), "glow": (0.7, 0.2, 0.5), "eye": (0.9, 0.6, 0.9)}
_DEFAULT_FINISH = (0.0, 0.35, 0.4)

_NO_REWARD = np.array((0.9, 0.08, 0.05, 1.0))  # red, rgba
_FULL_REWARD = np.array((0.1, 0.9, 0.2, 1.0))  # green, rgba


def reward_color(share: float) -> np.ndarray:
    """Return the color of a share of the greatest reward, from red for 0 to green for 1: rgba (4,)."""
    bounded_share = min(max(share, 0.0), 1.0)
    return (1.0 - bounded_share) * _NO_REWARD + bounded_share * _FULL_REWARD


def decorate(root: mjcf.RootElement, body: Body) -> None:
    """Add visuals to a body on its ground; its dynamics stay the same.

    Adds materials for all geoms, and geoms without mass or contacts on torso and joints. A model with
    ground also gets sky, light and a grid. All of them are named; the names of the geoms begin with `visual-`,
    which no part of a spec can have. The material `glow` can show a reward.

    Args:
        root: root of `assemble`.
        body: the spec it was built from.
    """
    visuals = _visuals(body)
    if root.worldbody.geom:
        add_scene(root, body.torso.standing_height)
    add_materials(root, body)
    for solid in (*body.torso.solids, *body.ballast):
        root.find("geom", solid.name).material = visuals.solids.get(solid.name, "shell")
    torso = root.find("body", "torso")
    for ornament in _with_twins(visuals.ornaments):
        _add_ornament(torso, ornament)
    for leg in body.legs:
        _decorate_leg(root, leg, visuals)


def outline_ornaments(body: Body) -> np.ndarray:
    """Return points in the torso's frame whose convex hull holds the ornaments of a body: (n, 3)."""
    corners = [np.empty((0, 3))]
    for ornament in _with_twins(_visuals(body).ornaments):
        solid = Solid(
            name=ornament.name,
            shape=ornament.shape,
            size=ornament.size,
            position=ornament.position,
            euler_deg=ornament.euler_deg,
        )
        corners.append(solid_corners(solid))
    return np.concatenate(corners)


def bones(body: Body) -> list[Bone]:
    """Return the bones of a body's ornaments; none of an imported body, which has the looks of its file."""
    return [] if body.source else _with_twins(_visuals(body).bones)


def geoms_of_bones(body: Body) -> dict[str, str]:
    """Return the names of the geoms that swing, each with the name of its bone."""
    if body.source:
        return {}
    return {_geom_name(item.name): item.bone for item in _with_twins(_visuals(body).ornaments) if item.bone}


def _with_twins(items: Iterable) -> list:
    """Return ornaments or bones, those of pairs followed by their twins."""
    return [twin for item in items for twin in ((item, item.mirrored()) if item.paired else (item,))]


def _visuals(body: Body) -> Visuals:
    """Return the visuals of a robot by its name, or those that suit any body, with ornaments if it has some."""
    visuals = VISUALS.get(body.name) or generic_visuals(body)
    return visuals if body.ornaments else visuals._replace(ornaments=(), bones=())


def key_of(body: Body) -> str:
    """Return a text for keys of caches, which changes with the visuals that are registered under a body's name."""
    return checks.full_repr(VISUALS.get(body.name))


def add_materials(root: mjcf.RootElement, body: Body) -> None:
    """Add the materials of a body."""
    colors = dict(_visuals(body).colors)
    if body.palette is not None:
        colors |= palettes.colors(body.palette)
    for name, color in colors.items():
        emission, specular, shininess = _FINISHES.get(name, _DEFAULT_FINISH)
        root.asset.add(
            "material", name=name, rgba=(*color, 1.0), emission=emission, specular=specular, shininess=shininess
        )


def _add_ornament(torso, ornament: Ornament) -> None:
    euler = [math.radians(angle) for angle in ornament.euler_deg]
    _add_geom(
        torso,
        ornament.name,
        ornament.material,
        ornament.shape,
        ornament.size,
        pos=ornament.position,
        euler=euler,
    )


def _decorate_leg(root: mjcf.RootElement, leg: Leg, visuals: Visuals) -> None:
    """Give the parts of a leg their materials, and add its joints, plates and boot."""
    previous_radius = 0.0  # of the link nearer to the torso, m
    for link in leg.links:
        name = leg.full_name(link)
        part = root.find("body", name)
        root.find("geom", name).material = "limb"
        if link.joint:
            glows = visuals.glowing is None or link.joint.name in visuals.glowing
            _add_joint(part, name, link, radius=max(previous_radius, link.radius), light="glow" if glows else "trim")
        _add_plate(part, name, link)
        previous_radius = link.radius
    name = leg.full_name(leg.foot)
    root.find("geom", name).material = "frame"
    boot_radius = 1.04 * max(previous_radius, leg.foot.radius)
    _add_geom(root.find("body", name), f"{name}_boot", "frame", "sphere", (boot_radius,))


def _add_joint(part, name: str, link: Link, radius: float, light: str) -> None:
    """Add a hub, a band and a cap about the axis of a joint.

    Args:
        part: part of the link.
        name: name of the part.
        link: link whose joint it is.
        radius: radius of the wider of the two links that meet at the joint, m.
        light: material of band and cap.
    """
    axis = link.joint.axis
    _add_geom(part, f"{name}_hub", "frame", "cylinder", (1.12 * radius, radius), zaxis=axis)
    _add_geom(part, f"{name}_band", light, "cylinder", (1.2 * radius, 0.3 * radius), zaxis=axis)
    _add_geom(part, f"{name}_cap", light, "cylinder", (0.6 * radius, 1.06 * radius), zaxis=axis)


def _add_plate(part, name: str, link: Link) -> None:
    """Add a plate along the link on the side that faces up and outwards."""
    end = np.array(link.end)
    length = np.linalg.norm(end)
    horizontal = _unit(end * (1.0, 1.0, 0.0))
    up_and_outwards = np.array((0.0, 0.0, 1.0)) + horizontal
    normal = _unit(up_and_outwards - up_and_outwards @ end / length**2 * end)  # to the link
    size = (1.1 * link.radius, 1.1 * link.radius, 0.42 * length)
    position = 0.52 * end + 0.35 * link.radius * normal
    _add_geom(part, f"{name}_plate", "shell", "ellipsoid", size, pos=tuple(position), zaxis=link.end)


def _unit(vector: np.ndarray) -> np.ndarray:
    """Return a vector of length 1 in the same direction; 0 for a vector of 0."""
    return vector / max(np.linalg.norm(vector), 1e-9)


def _add_geom(part, name: str, material: str, shape: str, size, **pose) -> None:
    """Add a geom without mass or contacts to a part."""
    part.add("geom", name=_geom_name(name), material=material, type=shape, size=size, **pose, **_INERT)


def _geom_name(name: str) -> str:
    """Return the name of a geom that visuals add; no part of a spec can have it."""
    return f"visual-{name}"
