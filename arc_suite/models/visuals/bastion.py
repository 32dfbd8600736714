"""Bastion: three overlapping armor shells, a face shield with a cyan eye slit, and a gun."""

from arc_suite.models.visuals.spec import Bone, Ornament, Visuals

_GUN = Bone("gun", "gun", (0.14, 0.0, 0.33), (0.5, 0.0, 0.33), 0.04, 0.05)

VISUALS = Visuals(
    colors={
        "shell": (0.36, 0.43, 0.38),
        "side": (0.25, 0.31, 0.28),
        "trim": (0.66, 0.62, 0.50),
        "frame": (0.10, 0.11, 0.12),
        "limb": (0.22, 0.24, 0.24),
        "glow": (0.03, 0.68, 0.85),
    },
    solids={"chassis": "frame"},
    ornaments=(
        Ornament("side", "side", "ellipsoid", (0.36, 0.15, 0.12), (-0.06, 0.20, 0.11), (-30, 8, 0), paired=True),
        Ornament("side_edge", "trim", "ellipsoid", (0.37, 0.16, 0.02), (-0.06, 0.20, 0.09), (-30, 8, 0), paired=True),
        Ornament("edge", "trim", "ellipsoid", (0.395, 0.21, 0.02), (-0.05, 0.0, 0.16), (0, 10, 0)),
        Ornament("shield", "shell", "box", (0.02, 0.14, 0.09), (0.31, 0.0, 0.05), (0, -20, 0)),
        Ornament("brow", "trim", "box", (0.03, 0.15, 0.015), (0.295, 0.0, 0.14), (0, -20, 0)),
        Ornament("slit", "glow", "box", (0.022, 0.10, 0.012), (0.312, 0.0, 0.08), (0, -20, 0)),
        Ornament("mantlet", "frame", "ellipsoid", (0.10, 0.07, 0.06), (0.10, 0.0, 0.31)),
        Ornament("barrel", "frame", "cylinder", (0.024, 0.20), (0.32, 0.0, 0.33), (0, 90, 0), bone="gun"),
        Ornament("muzzle", "trim", "cylinder", (0.034, 0.035), (0.50, 0.0, 0.33), (0, 90, 0), bone="gun"),
    ),
    bones=(_GUN,),
)
