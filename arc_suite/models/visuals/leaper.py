"""Leaper: a white ball with one dark eye ringed in red, thrusters behind, yellow joints."""

from arc_suite.models.visuals.spec import Bone, Ornament, Visuals, whip

_ANTENNA = Bone("antenna", "antenna", (-0.06, 0.0, 0.13), (-0.2, 0.0, 0.42), 0.02, 0.02)

VISUALS = Visuals(
    colors={
        "shell": (0.78, 0.80, 0.83),
        "trim": (0.85, 0.08, 0.06),
        "frame": (0.13, 0.14, 0.16),
        "limb": (0.27, 0.29, 0.33),
        "black": (0.02, 0.02, 0.03),
        "glow": (1.0, 0.72, 0.04),
    },
    ornaments=(
        Ornament("seam", "frame", "cylinder", (0.152, 0.008), (-0.02, 0.0, 0.0), (0, 90, 0)),
        Ornament("ring", "trim", "cylinder", (0.085, 0.02), (0.125, 0.0, 0.0), (0, 90, 0)),
        Ornament("eye", "black", "ellipsoid", (0.035, 0.068, 0.068), (0.138, 0.0, 0.0)),
        Ornament("glint", "shell", "sphere", (0.012,), (0.165, -0.02, 0.028)),
        Ornament("thruster", "frame", "cylinder", (0.04, 0.05), (-0.15, 0.07, 0.0), (0, 90, 0), paired=True),
        Ornament("flame", "glow", "cylinder", (0.03, 0.006), (-0.198, 0.07, 0.0), (0, 90, 0), paired=True),
        *whip(_ANTENNA, "frame", "trim"),
    ),
    bones=(_ANTENNA,),
)
