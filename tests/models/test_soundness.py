"""What keeps a body from standing or walking is told in one line, with the value that would fit."""

import math

import pytest
from refusals import refused

import arc_suite
from arc_suite.bodies import generator
from arc_suite.bodies.families import sound_body
from arc_suite.bodies.shaping import shaped
from arc_suite.cpg import Demonstrator
from arc_suite.evaluation import cures
from arc_suite.models.overlap import measure_gaps, overlaps
from arc_suite.models.soundness import flaws
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body, Foot, Joint, Leg, Link, Motor, Solid, Torso
from arc_suite.robots.spec_files import EXAMPLES, load_body

BODY = generator.generate(6, 3)
ALL = tuple(leg.name for leg in BODY.legs)
WEAK = 0.05  # N m, of a knee's motor


def high(height):
    return BODY.replace(torso=BODY.torso.replace(standing_height=height))


def with_joints(**fields):
    def changed(link):
        return link.replace(joint=link.joint.replace(**fields))

    return BODY.replace(legs=tuple(leg.replace(links=tuple(map(changed, leg.links))) for leg in BODY.legs))


def with_gear(gear, joints=("knee",), legs=("l1",), **fields):
    """The body with motors of a gear in some joints of some legs."""

    def changed(leg, link):
        chosen = leg.name in legs and link.joint.name in joints
        return link.replace(joint=link.joint.replace(motor=Motor(gear=gear), **fields)) if chosen else link

    legs_ = (leg.replace(links=tuple(changed(leg, link) for link in leg.links)) for leg in BODY.legs)
    return BODY.replace(legs=tuple(legs_))


def narrow(share):
    """The body with its feet nearer to the middle."""

    def drawn_in(point):
        return (share * point[0], share * point[1], point[2])

    def leg(leg):
        links = tuple(link.replace(end=drawn_in(link.end)) for link in leg.links)
        return leg.replace(mount=drawn_in(leg.mount), links=links)

    return BODY.replace(legs=tuple(map(leg, BODY.legs)))


def ahead(by, body=BODY):
    """The body with its legs in front of where they were."""
    legs = (leg.replace(mount=(leg.mount[0] + by, *leg.mount[1:])) for leg in body.legs)
    return body.replace(legs=tuple(legs))


def deep(radius):
    return BODY.replace(torso=BODY.torso.replace(solids=(Solid(name="ball", shape="sphere", size=(radius,)),)))


def lifted(name, by):
    """The body with one leg that ends higher."""

    def leg(leg):
        *links, last = leg.links
        x, y, z = last.end
        return leg.replace(links=(*links, last.replace(end=(x, y, z + by * (leg.name == name)))))

    return BODY.replace(legs=tuple(map(leg, BODY.legs)))


def square(mounts, out, deep=0.05, range_deg=(-45.0, 45.0)):
    """A body of legs that go `out` to the sides, m, and down; their hips turn about the vertical."""
    hip = Joint(name="hip", axis=(0.0, 0.0, 1.0), range_deg=range_deg)
    knee = Joint(name="knee", axis=(-1.0, 0.0, 0.0), range_deg=(-80.0, 80.0))
    links = (
        Link(name="upper", end=(0.0, out, 0.0), radius=0.02, joint=hip),
        Link(name="lower", end=(0.0, 0.0, -0.3), radius=0.02, joint=knee),
    )
    left = [
        Leg(name=f"l{number}", mount=(x, 0.1, 0.0), links=links, foot=Foot(radius=0.02))
        for number, x in enumerate(mounts, 1)
    ]
    legs = (*left, *(leg.mirrored(leg.name.replace("l", "r")) for leg in left))
    chassis = Solid(name="chassis", shape="box", size=(0.4, 0.2, deep))
    return Body(name="square", torso=Torso(standing_height=0.32, solids=(chassis,)), legs=legs)


SOUND = [
    *(ROBOTS[name] for name in ("queen", "bastion", "tick")),
    *map(load_body, EXAMPLES),
    *(generator.generate(legs, links) for legs in (4, 5, 9) for links in (2, 4)),
    *map(sound_body, range(20)),
    *(generator.scaled(BODY, scale) for scale in (0.05, 50.0)),
    high(0.43),
    with_gear(WEAK, range_deg=(0.0, 40.0)),  # the limit holds what the motor cannot
    with_gear(1e-6, ("hip",)),  # of one leg in six, which carries nothing
]


@pytest.mark.parametrize("body", SOUND, ids=lambda body: body.name)
def test_bodies_that_walk_have_no_flaw(body):
    assert flaws(body) == []


HOPELESS = [
    (high(1.2), "feet hang 0.8 m above the floor: standing_height 0.4 fits"),
    (high(0.2), "feet stand 0.2 m in the floor: standing_height 0.4 fits"),
    (
        BODY.replace(legs=BODY.legs[:3]),
        "the center of mass lies 0.34 m outside of the feet, all on the left: legs mirrored to the right fit",
    ),
    (ahead(1.0), "the center of mass lies 0.233 m outside of the feet: legs 1 m backward fit"),
    (
        with_joints(range_deg=(0.0, 40.0)),
        "no leg has a joint that sweeps its foot forward and back: a hip about axis [0, 0, 1], both ways, fits",
    ),
    (deep(0.5), "the torso reaches 0.1 m lower than the feet: legs longer by more than that fit"),
]
DOUBTFUL = [
    (ROBOTS["leaper"], "feet hang 0.125 m above the floor: standing_height 0.375 fits"),
    (high(0.5), "feet hang 0.1 m above the floor: standing_height 0.4 fits"),
    (high(0.35), "feet stand 0.05 m in the floor: standing_height 0.4 fits"),
    (narrow(0.1), "a tower that tips over when tilted by 6.8 degrees: feet 0.012 m further out all around fit"),
    (BODY.replace(legs=(BODY.legs[1], BODY.legs[4])), "2 feet span no area to stand on: 3 or more legs fit"),
    (generator.generate(6, 1), "no joint lifts a foot: a second joint in each leg, about axis [-1, 0, 0], fits"),
    (lifted("l2", -0.1), "feet of l2 stand 0.1 m in the floor: legs shorter by that fit"),
    (lifted("l2", 0.1), "feet of l2 end up to 0.1 m above the lowest foot: legs longer by that fit"),
    (
        shaped(BODY, links={"l1_lower": 1.5, "r1_lower": 1.5}),
        "feet of l2, l3, r2, r3 end up to 0.141 m above the lowest foot: legs longer by that fit, or l1, r1 shorter",
    ),
    (with_gear(WEAK), "the motor of l1_knee lacks 0.0422 of the 0.0922 N m that hold the body up: gear 5.99 fits"),
    (
        with_gear(0.01, ("knee", "ankle"), ALL),
        "the motor of l1_knee lacks 0.0822 of the 0.0922 N m that hold the body up, as do those of 11 more joints: "
        "gear 5.99 fits",
    ),
    (
        with_gear(0.3, ("knee",), ALL),
        "weak: reaches about 0.2 of the target speed, as the motor of l2_knee lacks 1.64 of the 1.94 N m that a brisk "
        "stride takes, as do those of 5 more joints: gear 8.33 fits",
    ),
    (
        with_gear(0.1, ("hip",), ALL),
        "weak: reaches about 0.3 of the target speed, as the motor of l2_hip lacks 0.386 of the 0.486 N m that a brisk "
        "stride takes, as do those of 5 more joints: gear 2.08 fits",
    ),
    (deep(0.41), "the torso reaches 0.01 m lower than the feet: legs longer by more than that fit"),
]


CURED = ("standing_height", "backward fit", "further out", "longer by that", "shorter by that", "gear")


@pytest.mark.parametrize(
    ("body", "text", "hopeless"),
    [(*case, True) for case in HOPELESS] + [(*case, False) for case in DOUBTFUL],
    ids=lambda value: value.split(":")[0] if isinstance(value, str) else "",
)
def test_a_flaw_is_told_with_what_fits_and_the_body_that_has_it(body, text, hopeless):
    (flaw,) = (flaw for flaw in flaws(body) if flaw.text == text)
    assert flaw.hopeless == hopeless
    assert (flaw.cure is not None) == any(words in text for words in CURED)
    if flaw.cure is not None:
        assert len(flaws(flaw.cure)) < len(flaws(body))


@pytest.mark.parametrize(("body", "text"), HOPELESS)
def test_a_demonstrator_refuses_a_body_that_cannot_walk(body, text):
    for preset in ("medium", "steered"):
        with refused(f"walker_6x3 cannot walk: {text}"):
            Demonstrator(body, preset)


@pytest.mark.parametrize("body", [case[0] for case in DOUBTFUL])
def test_a_demonstrator_tries_a_body_that_may_walk(body):
    environment, policy = arc_suite.load(body, "walk", {"random": 0}), Demonstrator(body, "medium")
    environment.step(policy(environment.reset()))


@pytest.mark.parametrize(("gear", "stands"), [(0.02, False), (6.0, True)])
def test_the_body_stands_on_motors_of_the_gear_that_fits_and_sinks_on_those_that_lack(gear, stands):
    body = with_gear(gear, ("knee",), ALL)
    assert (flaws(body) == []) == stands
    environment = arc_suite.load(body, "walk", {"random": 0})
    timestep = environment.reset()
    for _ in range(90):
        angles, velocities = timestep.observation["posture"][5:], timestep.observation["velocities"][6:]
        timestep = environment.step((-3.7 * angles - 0.37 * velocities) / gear)  # hold the pose
        if timestep.last():
            break
    height = timestep.observation["posture"][0]
    assert height > 0.38 if stands else height < 0.25


@pytest.mark.parametrize(("gear", "joint"), [(0.1, "knee"), (0.1, "hip"), (0.3, "knee"), (1.5, "knee")])
def test_a_weak_body_reaches_about_the_speed_that_is_told(gear, joint):
    body = with_gear(gear, (joint,), ALL)
    told = [flaw.text for flaw in flaws(body)]
    walked = cures.walk(body)
    reached = 0.0 if walked.verdict.fell else walked.verdict.speed
    if told:
        assert float(told[0].removeprefix("weak: reaches about ").split()[0]) == pytest.approx(reached, abs=0.25)
    assert bool(told) == (reached < 0.7)


def test_feet_near_the_middle_are_enough():
    assert not any("tower" in flaw.text for flaw in flaws(narrow(0.2)))


@pytest.mark.parametrize(
    ("body", "text", "cured"),
    [
        (
            square((0.1, -0.1), out=0.14, deep=0.2, range_deg=(0.0, 45.0)),
            "chassis and r1_lower overlap by 0.0339 m in a stride: legs mounted 2 times as far out fit",
            True,
        ),
        (
            square((0.3, 0.0, 0.0), out=0.4, range_deg=(0.0, 45.0)),
            "l2_upper and l3_lower overlap by 0.04 m in the standing pose: shorter or thinner links fit",
            False,
        ),
    ],
    ids=["torso", "legs"],
)
def test_overlaps_are_told_with_what_fits(body, text, cured):
    *_, flaw = flaws(body)
    assert (flaw.text, flaw.hopeless, flaw.cure is not None) == (text, False, cured)
    assert not cured or not any(overlaps(flaw.cure))


def thick(height, spread=1.0):
    """The body with a thick torso, and its legs mounted so many times as far out."""
    chassis = BODY.torso.solids[0].replace(shape="ellipsoid", size=(0.4, 0.3, height))
    legs = [leg.replace(mount=(spread * leg.mount[0], spread * leg.mount[1], 0.0)) for leg in BODY.legs]
    return BODY.replace(torso=BODY.torso.replace(solids=(chassis,)), legs=tuple(legs))


def test_legs_apart_from_the_torso_are_told_and_attached():
    (flaw,) = flaws(thick(0.1, spread=2.0))
    assert flaw.text.startswith("l1, l3, r1, r3 begin up to ")
    assert flaw.text.endswith(" m away from the torso: legs mounted nearer to its middle fit")
    assert (measure_gaps(flaw.cure) <= 0.0).all() and (measure_gaps(thick(0.1, spread=2.0)) > 0.0).sum() == 4


def test_a_cure_of_overlaps_keeps_legs_on_the_torso():
    flaw = flaws(thick(0.25))[-1]
    assert " overlap by " in flaw.text and flaw.text.endswith("legs mounted up to 2 times as far out fit")
    assert not any(overlaps(flaw.cure)) and (measure_gaps(flaw.cure) <= 0.0).all()


def test_depths_of_overlaps():
    found = list(overlaps(square((0.4, 0.015, -0.015, -0.4), out=0.4)))
    depths = {each.names: each.depth for each in found if each.pose == "the standing pose"}
    near = [("upper", "lower"), ("lower", "upper"), ("lower", "lower"), ("lower", "foot"), ("foot", "lower")]
    pairs = {(f"{side}2_{one}", f"{side}3_{other}") for side in "lr" for one, other in [*near, ("foot", "foot")]}
    assert depths == dict.fromkeys(pairs, pytest.approx(0.01, abs=1e-6))
    assert 0.02 < max(each.depth for each in found) < 0.04 + 1e-6  # as legs cross


@pytest.mark.parametrize(("apart", "overlap"), [(0.0362, True), (0.0364, True), (0.0369, False), (0.0401, False)])
def test_a_hundredth_of_the_height_may_overlap(apart, overlap):
    body = square((0.3, apart, 0.0, -0.3), out=0.4, range_deg=(0.0, 45.0))
    assert any(each.pose == "the standing pose" for each in overlaps(body)) == overlap


def test_hips_may_overlap_and_rigid_links_before_them():
    body = generator.generate(5, 3)
    drawn_in = (leg.replace(mount=tuple(0.1 * part for part in leg.mount)) for leg in body.legs)
    body = body.replace(legs=tuple(drawn_in), torso=deep(0.02).torso)
    assert max(math.hypot(*leg.mount) for leg in body.legs) < body.legs[0].links[0].radius
    assert not any(overlaps(body))
    assert not any(overlaps(ROBOTS["leaper"]))


def test_neighbors_overlap_at_different_ends_of_their_strides():
    """Bastion walks in a gait of its own; in the one that suits its body, its legs reach into each other."""
    body = generator.scaled(ROBOTS["bastion"], 1.0)
    assert {each.pose for each in overlaps(body)} == {"a stride"}
    assert ("l1_upper", "l2_lower") in {each.names for each in overlaps(body)}
    assert not any(overlaps(ROBOTS["bastion"]))


def test_neighbors_overlap_as_the_body_steps_aside():
    """This body's legs pass each other in strides ahead; while it was steered aside, they overlapped by 0.047 h."""
    body = generator.random_body(15143)
    body_overlaps = list(overlaps(body))
    assert {overlap.pose for overlap in body_overlaps} == {"a stride"}
    assert ("r1_lower", "r2_foot") in {overlap.names for overlap in body_overlaps}
    assert max(overlap.depth for overlap in body_overlaps) > 0.047 * body.torso.standing_height
    assert not any(overlaps(sound_body(15143)))


def test_overlaps_scale_with_the_body():
    body = generator.generate(12, 3, "pairs")
    depths = [[each.depth for each in overlaps(generator.scaled(body, scale))] for scale in (0.5, 1.0, 2.0)]
    assert len(depths[1]) > 0
    assert depths[1] == pytest.approx([2.0 * depth for depth in depths[0]], rel=1e-3)
    assert depths[2] == pytest.approx([2.0 * depth for depth in depths[1]], rel=1e-3)
