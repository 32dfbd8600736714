"""Left-right symmetry of bodies."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from arc_suite.bodies import generator
from arc_suite.robots import ROBOTS
from arc_suite.robots.mirror import image
from arc_suite.robots.spec import Foot, Joint, Leg, Link, Solid

QUEEN = ROBOTS["queen"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_names_of_the_robots_tell_who_is_across_from_whom(robot):
    body, across = ROBOTS[robot], str.maketrans("lr", "rl")
    found = image(body)
    for leg, other in zip(body.legs, found.legs, strict=True):
        front, side = (leg.name[:-1], leg.name[-1]) if robot == "leaper" else (leg.name[1:], leg.name[0])
        expected = front + side.translate(across) if robot == "leaper" else side.translate(across) + front
        assert body.legs[other].name == expected
    legs = {leg.name: body.legs[other].name for leg, other in zip(body.legs, found.legs, strict=True)}
    for names, places in ((body.joint_names, found.joints), (body.part_names[1:], found.parts[1:] - 1)):
        for name, place in zip(names, places, strict=True):
            leg, _, part = name.rpartition("_")
            assert names[place] == f"{legs[leg]}_{part}"
    assert found.parts[0] == 0
    assert_array_equal(found.signs == -1, [name.endswith("hip") for name in body.joint_names])


@pytest.mark.parametrize("body", [QUEEN, generator.generate(7, 3), generator.random_body(3)], ids=lambda b: b.name)
def test_twice_is_once(body):
    found = image(body)
    for places in (found.legs, found.joints, found.parts):
        assert_array_equal(places[places], np.arange(len(places)))
    assert_array_equal(found.signs[found.joints], found.signs)


def test_a_leg_on_the_midline_is_across_from_itself():
    found = image(generator.generate(5, 2))
    assert found.legs.tolist() == [0, 4, 3, 2, 1]
    assert found.signs.tolist() == [-1, 1] * 5


def test_geometry_counts_and_not_how_it_is_written():
    """Names, order, lengths of axes and turned frames that come to the same."""
    left = QUEEN.legs[0]
    axes = ((0.0, 0.0, 0.5), (-3.0, -3.0, 0.0), (2.0, 2.0, 0.0))  # the last one the other way round
    ranges = (left.joints[0].range_deg, left.joints[1].range_deg, (-70.0, 0.0))
    assert left.joints[2].range_deg == (0.0, 70.0)
    links = [
        link.replace(
            end=(-link.end[0], link.end[1], link.end[2]), joint=link.joint.replace(axis=axis, range_deg=degrees)
        )
        for link, axis, degrees in zip(left.links, axes, ranges, strict=True)
    ]
    mount = (left.mount[0], -left.mount[1], left.mount[2])
    turned = Leg(name="other", mount=mount, yaw_deg=180.0, links=tuple(links), foot=left.foot)
    found = image(QUEEN.replace(name="twisted", legs=(turned, *QUEEN.legs[1:3], *QUEEN.legs[4:], left)))
    assert found.legs.tolist() == [5, 3, 4, 1, 2, 0]
    assert found.signs[:3].tolist() == found.signs[-3:].tolist() == [-1, 1, -1]
    assert found.signs[3:6].tolist() == [-1, 1, 1]


def capsule(**changes):
    return Solid(**{"name": "bar", "shape": "capsule", "size": (0.1, 0.4), "position": (0.0, 0.0, 0.2), **changes})


@pytest.mark.parametrize(
    ("solids", "mirrored"),
    [
        ([capsule()], True),
        ([capsule(euler_deg=(90.0, 0.0, 0.0))], True),  # across
        ([capsule(euler_deg=(0.0, 40.0, 25.0))], True),  # last about its own axis
        ([capsule(euler_deg=(25.0, 40.0, 0.0))], False),
        ([capsule(euler_deg=(30.0, 0.0, 0.0))], False),
        ([capsule(euler_deg=(30.0, 0.0, 0.0)), capsule(name="bar2", euler_deg=(-30.0, 0.0, 0.0))], True),
        ([capsule(position=(0.0, 0.1, 0.2))], False),
        ([capsule(position=(0.0, 0.1, 0.2)), capsule(name="bar2", position=(0.0, -0.1, 0.2))], True),
        ([Solid(name="ball", shape="sphere", size=(0.1,), euler_deg=(10.0, 20.0, 30.0))], True),
        ([Solid(name="box", shape="box", size=(0.1, 0.2, 0.3), euler_deg=(0.0, 30.0, 0.0))], True),
        ([Solid(name="box", shape="box", size=(0.1, 0.2, 0.3), euler_deg=(20.0, 30.0, 0.0))], False),
    ],
)
def test_solids(solids, mirrored):
    body = QUEEN.replace(name="other", torso=QUEEN.torso.replace(solids=(*QUEEN.torso.solids, *solids)))
    if mirrored:
        image(body)
    else:
        with pytest.raises(ValueError, match=r"^other is not left-right symmetric: no solid is across from b"):
            image(body)


def changed(leg=0, **fields):
    legs = list(QUEEN.legs)
    legs[leg] = legs[leg].replace(**fields)
    return QUEEN.replace(name="other", legs=tuple(legs))


def relinked(**fields):
    leg = QUEEN.legs[0]
    return changed(links=(leg.links[0].replace(joint=leg.links[0].joint.replace(**fields)), *leg.links[1:]))


@pytest.mark.parametrize(
    "body",
    [
        changed(mount=(0.26, 0.35, 0.0)),
        changed(foot=Foot(radius=0.06)),
        changed(links=(QUEEN.legs[0].links[0].replace(radius=0.09), *QUEEN.legs[0].links[1:])),
        relinked(armature=1.5),
        relinked(damping=None),
        relinked(motor=None),
        relinked(friction_loss=0.1),
        relinked(motor=QUEEN.legs[0].joints[0].motor.replace(winding_loss=0.1)),
        relinked(range_deg=(-40.0, 30.0)),
        relinked(axis=(0.0, 0.1, 1.0)),
        changed(links=(*QUEEN.legs[0].links[:2], Link(name="lower", end=(0.02, 0.02, -0.25), radius=0.04))),
    ],
)
def test_any_difference_between_left_and_right_is_noticed(body):
    with pytest.raises(ValueError, match=r"^other is not left-right symmetric: no leg is across from l1$"):
        image(body)


def test_an_upright_axis_with_a_range_to_one_side_is_mirrored_by_the_other():
    leg = Leg(
        name="l",
        mount=(0.0, 0.1, 0.0),
        links=(
            Link(
                name="upper",
                end=(0.0, 0.2, -0.4),
                radius=0.02,
                joint=Joint(name="hip", axis=(0, 0, 1), range_deg=(-10, 50)),
            ),
        ),
        foot=Foot(radius=0.03),
    )
    body = QUEEN.replace(name="other", legs=(leg, leg.mirrored("r")))
    assert body.legs[1].joints[0].range_deg == (-50.0, 10.0)
    assert image(body).signs.tolist() == [-1, -1]
    with pytest.raises(ValueError):
        image(body.replace(legs=(leg, leg.mirrored("r").replace(links=leg.mirrored("r").links[:0] + leg.links))))
