"""Bastion: a low, armored hexapod with two-link legs, 0.5 m at the torso."""

from arc_suite.robots.spec import Ballast, Body, Foot, Joint, Leg, Link, Motor, Simulation, Solid, Torso, TrackingCamera

HIP = Joint(
    name="hip",
    axis=(0.0, 0.0, 1.0),
    range_deg=(-30.0, 30.0),
    armature=1.0,
    damping=1.0,
    motor=Motor(gear=150.0),
)
ANKLE = HIP.replace(name="ankle", axis=(1.0, -1.0, 0.0), range_deg=(0.0, 100.0), armature=2.0, damping=10.0)


LEFT_LEGS = (
    Leg(
        name="l1",
        mount=(0.2, 0.28, 0.0),
        links=(
            Link(name="upper", end=(0.15, 0.2, -0.1), radius=0.06, joint=HIP),
            Link(name="lower", end=(0.05, 0.05, -0.3), radius=0.05, joint=ANKLE),
        ),
        foot=Foot(radius=0.05),
    ),
    Leg(
        name="l2",
        mount=(0.0, 0.3, 0.0),
        links=(
            Link(name="upper", end=(0.08, 0.25, -0.1), radius=0.06, joint=HIP.replace(range_deg=(-45.0, 45.0))),
            Link(name="lower", end=(0.0, 0.05, -0.3), radius=0.05, joint=ANKLE.replace(axis=(1.0, 0.0, 0.0))),
        ),
        foot=Foot(radius=0.05),
    ),
    Leg(
        name="l3",
        mount=(-0.2, 0.28, 0.0),
        links=(
            Link(name="upper", end=(-0.15, 0.2, -0.1), radius=0.06, joint=HIP),
            Link(name="lower", end=(-0.05, 0.05, -0.3), radius=0.05, joint=ANKLE.replace(axis=(1.0, 1.0, 0.0))),
        ),
        foot=Foot(radius=0.05),
    ),
)
RIGHT_LEGS = tuple(leg.mirrored(leg.name.replace("l", "r")) for leg in LEFT_LEGS)

BODY = Body(
    name="bastion",
    density=25.0,
    torso=Torso(
        standing_height=0.5,
        solids=(Solid(name="chassis", shape="box", size=(0.25, 0.25, 0.1), position=(0.0, 0.0, 0.0)),),
    ),
    ballast=(
        Ballast(
            name="carapace_center",
            shape="ellipsoid",
            size=(0.38, 0.2, 0.2),
            position=(-0.05, 0.0, 0.15),
            euler_deg=(0.0, 10.0, 0.0),
            mass=3.0,
        ),
    ),
    legs=(*LEFT_LEGS, *RIGHT_LEGS),
    simulation=Simulation(),
    camera=TrackingCamera(position=(0.0, -5.0, 2.0)),
)
