"""Tick: a small insect with high knees, Queen's kinematics at a quarter of her height, 0.18 m."""

from arc_suite.robots.spec import Body, Foot, Joint, Leg, Link, Motor, Simulation, Solid, Torso, TrackingCamera

HIP = Joint(
    name="hip",
    axis=(0.0, 0.0, 1.0),
    range_deg=(-40.0, 40.0),
    armature=1.0,
    damping=1.0,
    motor=Motor(gear=120.0),
)
KNEE = HIP.replace(name="knee", axis=(-1.0, 0.0, 0.0), range_deg=(-80.0, 0.0), armature=2.0, damping=8.0)
ANKLE = KNEE.replace(name="ankle", range_deg=(0.0, 100.0))

MIDDLE_LEG = Leg(
    name="l2",
    mount=(0.0, 0.1, 0.02),
    links=(
        Link(name="upper", end=(0.0, 0.08, 0.14), radius=0.025, joint=HIP),
        Link(name="middle", end=(0.0, 0.18, -0.1), radius=0.025, joint=KNEE),
        Link(name="lower", end=(0.0, -0.03, -0.22), radius=0.025, joint=ANKLE),
    ),
    foot=Foot(radius=0.03),
)
LEFT_LEGS = (
    MIDDLE_LEG.replace(name="l1", mount=(0.13, 0.09, 0.02), yaw_deg=-35.0),
    MIDDLE_LEG,
    MIDDLE_LEG.replace(name="l3", mount=(-0.13, 0.09, 0.02), yaw_deg=35.0),
)
RIGHT_LEGS = tuple(leg.mirrored(leg.name.replace("l", "r")) for leg in LEFT_LEGS)

BODY = Body(
    name="tick",
    density=6.0,
    torso=Torso(
        standing_height=0.18,
        solids=(Solid(name="chassis", shape="ellipsoid", size=(0.18, 0.115, 0.055), position=(0.0, 0.0, -0.005)),),
    ),
    legs=(*LEFT_LEGS, *RIGHT_LEGS),
    simulation=Simulation(),
    camera=TrackingCamera(position=(0.0, -3.0, 1.2)),
)
