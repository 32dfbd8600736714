"""Tick: a pale insect with a head, two black eyes under a brow, and an orange glow below."""

from arc_suite.models.visuals.spec import Bone, Ornament, Visuals, whip

_ANTENNA = Bone("antenna", "antenna", (0.24, 0.035, 0.05), (0.325, 0.095, 0.16), 0.011, 0.01, paired=True)

VISUALS = Visuals(
    colors={
        "shell": (0.86, 0.82, 0.72),
        "trim": (0.60, 0.50, 0.38),
        "frame": (0.32, 0.26, 0.22),
        "limb": (0.62, 0.55, 0.45),
        "black": (0.02, 0.02, 0.02),
        "glow": (1.0, 0.42, 0.06),
    },
    ornaments=(
        Ornament("head", "shell", "ellipsoid", (0.07, 0.075, 0.05), (0.21, 0.0, 0.015)),
        Ornament("eye", "black", "sphere", (0.024,), (0.258, 0.036, 0.022), paired=True),
        Ornament("brow", "trim", "ellipsoid", (0.03, 0.07, 0.013), (0.248, 0.0, 0.05), (0, 22, 0)),
        Ornament("belly", "glow", "ellipsoid", (0.155, 0.105, 0.045), (-0.01, 0.0, -0.03)),
        Ornament("back", "trim", "ellipsoid", (0.16, 0.03, 0.05), (-0.03, 0.0, 0.008)),
        *whip(_ANTENNA, "frame", "glow"),
    ),
    bones=(_ANTENNA,),
    glowing=(),
)
