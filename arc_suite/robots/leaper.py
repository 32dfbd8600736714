"""Leaper: a small, ball-bodied quadruped with three-link legs on rigid shoulders, 0.5 m."""

from arc_suite.robots.spec import Body, Foot, Joint, Leg, Link, Motor, Simulation, Solid, Torso, TrackingCamera

HIP = Joint(
    name="hip",
    axis=(0.0, 0.0, 1.0),
    range_deg=(-30.0, 30.0),
    armature=1.0,
    damping=1.0,
    motor=Motor(gear=150.0),
)
KNEE = HIP.replace(name="knee", axis=(-1.0, 1.0, 0.0), range_deg=(-80.0, 0.0), armature=2.0, damping=10.0)
ANKLE = KNEE.replace(name="ankle", range_deg=(0.0, 100.0))

FRONT_LEFT_LEG = Leg(
    name="fl",
    mount=(0.0, 0.0, 0.1),
    links=(
        Link(name="aux", end=(0.05, 0.15, 0.0), radius=0.05),
        Link(name="upper", end=(0.15, 0.15, 0.0), radius=0.05, joint=HIP),
        Link(name="middle", end=(0.12, 0.12, -0.25), radius=0.045, joint=KNEE),
        Link(name="lower", end=(0.06, 0.06, -0.18), radius=0.035, joint=ANKLE),
    ),
    foot=Foot(radius=0.045),
)
REAR_LEFT_LEG = Leg(
    name="rl",
    mount=(0.0, 0.0, 0.1),
    links=(
        Link(name="aux", end=(-0.05, 0.15, 0.0), radius=0.05),
        Link(name="upper", end=(-0.15, 0.15, 0.0), radius=0.05, joint=HIP),
        Link(name="middle", end=(-0.12, 0.12, -0.25), radius=0.045, joint=KNEE.replace(axis=(1.0, 1.0, 0.0))),
        Link(
            name="lower",
            end=(-0.06, 0.06, -0.18),
            radius=0.035,
            joint=ANKLE.replace(axis=(1.0, 1.0, 0.0), range_deg=(-100.0, 0.0)),
        ),
    ),
    foot=Foot(radius=0.045),
)
FRONT_RIGHT_LEG = FRONT_LEFT_LEG.mirrored("fr")
REAR_RIGHT_LEG = REAR_LEFT_LEG.mirrored("rr")

BODY = Body(
    name="leaper",
    density=5.0,
    torso=Torso(
        standing_height=0.5,
        solids=(Solid(name="torso_geom", shape="sphere", size=(0.15,), position=(0.0, 0.0, 0.0)),),
    ),
    legs=(FRONT_LEFT_LEG, FRONT_RIGHT_LEG, REAR_LEFT_LEG, REAR_RIGHT_LEG),
    simulation=Simulation(),
    camera=TrackingCamera(position=(0.0, -4.0, 1.5)),
)
