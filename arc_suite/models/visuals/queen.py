"""Queen: a wide ivory shell that floats above a dark chassis, amber joints, a cyan eye."""

from arc_suite.models.visuals.spec import Bone, Ornament, Visuals, whip

_ANTENNA = Bone("antenna", "antenna", (0.42, 0.18, 0.31), (0.78, 0.32, 0.46), 0.032, 0.03, paired=True)

VISUALS = Visuals(
    colors={
        "shell": (0.80, 0.77, 0.71),
        "trim": (0.38, 0.20, 0.46),
        "frame": (0.12, 0.12, 0.15),
        "limb": (0.24, 0.24, 0.28),
        "glow": (1.0, 0.45, 0.02),
        "eye": (0.15, 0.9, 1.0),
    },
    solids={"chassis": "limb"},
    ornaments=(
        Ornament("rim", "frame", "ellipsoid", (0.57, 0.67, 0.045), (0.0, 0.0, 0.235)),
        Ornament("crest", "trim", "ellipsoid", (0.53, 0.12, 0.165), (-0.01, 0.0, 0.26)),
        Ornament("panel", "trim", "ellipsoid", (0.30, 0.12, 0.04), (-0.08, 0.40, 0.35), (-20, -3, 0), paired=True),
        Ornament("neck", "frame", "cylinder", (0.14, 0.12), (0.0, 0.0, 0.13)),
        Ornament("face", "shell", "ellipsoid", (0.10, 0.17, 0.10), (0.32, 0.0, -0.01)),
        Ornament("socket", "frame", "ellipsoid", (0.06, 0.10, 0.06), (0.385, 0.0, -0.005)),
        Ornament("eye", "eye", "ellipsoid", (0.03, 0.055, 0.042), (0.425, 0.0, -0.005)),
        Ornament("vent", "frame", "box", (0.05, 0.10, 0.045), (0.40, 0.25, 0.195), (0, 20, 30), paired=True),
        Ornament("vent_upper", "glow", "box", (0.062, 0.08, 0.008), (0.402, 0.251, 0.21), (0, 20, 30), paired=True),
        Ornament("vent_lower", "glow", "box", (0.052, 0.08, 0.008), (0.394, 0.246, 0.18), (0, 20, 30), paired=True),
        *whip(_ANTENNA, "frame", "glow"),
    ),
    bones=(_ANTENNA,),
    glowing=("hip", "knee"),
)
