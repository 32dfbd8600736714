"""Visuals of a body: colors and decorations, without mass or contacts."""

import math

import numpy as np
from dm_control import mjcf

from arc_suite.models.visuals import bastion, leaper, queen, tick
from arc_suite.models.visuals.generic import generic_visuals
from arc_suite.models.visuals.scene import add_scene
from arc_suite.models.visuals.spec import Visuals
from arc_suite.robots import palettes
from arc_suite.robots.spec import Body, Leg, Link

# A creature without an entry has the visuals `generic`.
VISUALS = {"queen": queen.VISUALS, "bastion": bastion.VISUALS, "tick": tick.VISUALS, "leaper": leaper.VISUALS}

GROUP = 2  # of decorations; what weighs or touches is in group 0
_INERT = {"group": GROUP, "mass": 0.0, "contype": 0, "conaffinity": 0}

# How materials shine, where not like a limb: emission, specular, shininess.
_PLAIN = (0.0, 0.35, 0.4)
_FINISHES = {"shell": (0.0, 0.5, 0.6), "frame": (0.0, 0.6, 0.5), "glow": (0.7, 0.2, 0.5), "eye": (0.9, 0.6, 0.9)}

_POOR, _RICH = np.array((0.9, 0.08, 0.05, 1.0)), np.array((0.1, 0.9, 0.2, 1.0))


def reward_color(share: float) -> np.ndarray:
    """Return the color of a share of the greatest reward, from red for 0 to green for 1: rgba (4,)."""
    share = min(max(share, 0.0), 1.0)
    return (1.0 - share) * _POOR + share * _RICH


def decorate(root: mjcf.RootElement, body: Body) -> None:
    """Add visuals to a body on its ground; its dynamics stay the same.

    Adds materials for all geoms, and geoms without mass or contacts on torso and joints. A model with
    ground also gets sky, light and a grid. All of them are named; the names of the geoms begin with `visual-`,
    which no part of a spec can have. The material `glow` can show a reward.

    Args:
        root: of `assemble`.
        body: the spec it was built from.
    """
    visuals = _visuals(body)
    if root.worldbody.geom:
        add_scene(root, body.torso.standing_height)
    add_materials(root, body)
    for solid in (*body.torso.solids, *body.ballast):
        root.find("geom", solid.name).material = visuals.solids.get(solid.name, "shell")
    torso = root.find("body", "torso")
    for ornament in visuals.ornaments:
        for part in (ornament, ornament.mirrored()) if ornament.paired else (ornament,):
            euler = [math.radians(angle) for angle in part.euler_deg]
            _add(torso, part.name, part.material, part.shape, part.size, pos=part.position, euler=euler)
    for leg in body.legs:
        _dress(root, leg, visuals)


def _visuals(body: Body) -> Visuals:
    return VISUALS.get(body.name) or generic_visuals(body)


def add_materials(root: mjcf.RootElement, body: Body) -> None:
    """Add the materials of a body."""
    visuals = _visuals(body)
    own = {} if body.palette is None else palettes.colors(body.palette)
    for name, color in {**visuals.colors, **own}.items():
        emission, specular, shininess = _FINISHES.get(name, _PLAIN)
        root.asset.add(
            "material", name=name, rgba=(*color, 1.0), emission=emission, specular=specular, shininess=shininess
        )


def _dress(root: mjcf.RootElement, leg: Leg, visuals: Visuals) -> None:
    radius = 0.0
    for link in leg.links:
        name = leg.full_name(link)
        part = root.find("body", name)
        root.find("geom", name).material = "limb"
        radius = max(radius, link.radius)  # the wider of the two links that meet here
        if link.joint:
            light = "glow" if visuals.glowing is None or link.joint.name in visuals.glowing else "trim"
            axis = link.joint.axis
            _add(part, f"{name}_hub", "frame", "cylinder", (1.12 * radius, radius), zaxis=axis)
            _add(part, f"{name}_band", light, "cylinder", (1.2 * radius, 0.3 * radius), zaxis=axis)
            _add(part, f"{name}_cap", light, "cylinder", (0.6 * radius, 1.06 * radius), zaxis=axis)
        _add_plate(part, name, link)
        radius = link.radius
    name = leg.full_name(leg.foot)
    root.find("geom", name).material = "frame"
    _add(root.find("body", name), f"{name}_boot", "frame", "sphere", (1.04 * max(radius, leg.foot.radius),))


def _add_plate(part, name: str, link: Link) -> None:
    """Add a plate along the link on the side that faces up and outwards."""
    end = np.array(link.end)
    length = np.linalg.norm(end)
    outwards = np.array((0.0, 0.0, 1.0)) + _unit(end * (1.0, 1.0, 0.0))
    outwards = _unit(outwards - outwards @ end / length**2 * end)
    size = (1.1 * link.radius, 1.1 * link.radius, 0.42 * length)
    place = 0.52 * end + 0.35 * link.radius * outwards
    _add(part, f"{name}_plate", "shell", "ellipsoid", size, pos=tuple(place), zaxis=link.end)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(np.linalg.norm(vector), 1e-9)


def _add(part, name: str, material: str, shape: str, size, **place) -> None:
    part.add("geom", name=f"visual-{name}", material=material, type=shape, size=size, **place, **_INERT)
