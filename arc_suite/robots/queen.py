"""Queen: a tall hexapod with three-link legs under a wide shell, 0.75 m at the torso."""

from arc_suite.robots.spec import Ballast, Body, Foot, Joint, Leg, Link, Motor, Simulation, Solid, Torso, TrackingCamera

HIP = Joint(
    name="hip",
    axis=(0.0, 0.0, 1.0),
    range_deg=(-30.0, 30.0),
    armature=1.0,
    damping=1.0,
    motor=Motor(gear=120.0),
)
KNEE = HIP.replace(name="knee", axis=(-1.0, 1.0, 0.0), range_deg=(-80.0, 0.0), armature=2.0, damping=10.0)
ANKLE = KNEE.replace(name="ankle", range_deg=(0.0, 70.0))

LEFT_LEGS = (
    Leg(
        name="l1",
        mount=(0.25, 0.35, 0.0),
        links=(
            Link(name="upper", end=(0.3, 0.3, -0.15), radius=0.08, joint=HIP),
            Link(name="middle", end=(0.1, 0.1, -0.35), radius=0.06, joint=KNEE),
            Link(name="lower", end=(0.02, 0.02, -0.25), radius=0.04, joint=ANKLE),
        ),
        foot=Foot(radius=0.05),
    ),
    Leg(
        name="l2",
        mount=(0.0, 0.4, 0.0),
        links=(
            Link(name="upper", end=(0.0, 0.4, -0.15), radius=0.08, joint=HIP),
            Link(name="middle", end=(0.0, 0.15, -0.35), radius=0.06, joint=KNEE.replace(axis=(-1.0, 0.0, 0.0))),
            Link(
                name="lower",
                end=(0.0, 0.03, -0.25),
                radius=0.04,
                joint=ANKLE.replace(axis=(-1.0, 0.0, 0.0), range_deg=(0.0, 100.0)),
            ),
        ),
        foot=Foot(radius=0.05),
    ),
    Leg(
        name="l3",
        mount=(-0.25, 0.35, 0.0),
        links=(
            Link(name="upper", end=(-0.3, 0.3, -0.15), radius=0.08, joint=HIP),
            Link(
                name="middle",
                end=(-0.1, 0.1, -0.35),
                radius=0.06,
                joint=KNEE.replace(axis=(1.0, 1.0, 0.0), range_deg=(0.0, 80.0)),
            ),
            Link(
                name="lower",
                end=(-0.02, 0.02, -0.25),
                radius=0.04,
                joint=ANKLE.replace(axis=(1.0, 1.0, 0.0), range_deg=(-70.0, 0.0)),
            ),
        ),
        foot=Foot(radius=0.05),
    ),
)
RIGHT_LEGS = tuple(leg.mirrored(leg.name.replace("l", "r")) for leg in LEFT_LEGS)

BODY = Body(
    name="queen",
    density=10.0,
    torso=Torso(
        standing_height=0.75,
        solids=(Solid(name="chassis", shape="ellipsoid", size=(0.35, 0.45, 0.15), position=(0.0, 0.0, -0.05)),),
    ),
    ballast=(
        Ballast(name="carapace_main", shape="ellipsoid", size=(0.55, 0.65, 0.15), position=(0.0, 0.0, 0.25), mass=10.0),
    ),
    legs=(*LEFT_LEGS, *RIGHT_LEGS),
    simulation=Simulation(),
    camera=TrackingCamera(position=(0.0, -7.0, 3.0)),
)
