"""Bodies of other proportions."""

import math

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite.bodies import generator
from arc_suite.bodies.shaping import link_ends, link_names, shaped
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import measure_standing
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Ballast, Solid
from arc_suite.robots.spec_files import EXAMPLES, load_body

WALKER = generator.generate(6, 3)


def lengths(body, name):
    return [math.hypot(*link.end) for leg in body.legs for link in leg.links if link.name == name]


def test_a_link_of_one_leg_has_a_length_of_its_own():
    body = shaped(WALKER, links={"lower": 2.0, "l1_lower": 1.5})
    lengths = {part: math.hypot(*end) for part, end in link_ends(body).items()}
    before = {part: math.hypot(*end) for part, end in link_ends(WALKER).items()}
    for part, length in lengths.items():
        factor = {"l1_lower": 3.0}.get(part, 2.0 if part.endswith("_lower") else 1.0)
        assert length == pytest.approx(factor * before[part])


def test_a_link_becomes_longer_and_the_feet_stand_on_the_floor():
    body = shaped(WALKER, links={"lower": 1.5})
    assert body.name == "walker_6x3_shaped"
    np.testing.assert_allclose(lengths(body, "lower"), 1.5 * np.array(lengths(WALKER, "lower")))
    np.testing.assert_allclose(lengths(body, "upper"), lengths(WALKER, "upper"))
    pose = measure_standing(body)
    np.testing.assert_allclose(pose.soles[:, 2], -pose.height, atol=1e-9)
    assert pose.height > measure_standing(WALKER).height and flaws(body) == []


def test_the_torso_takes_the_mounts_of_the_legs_along():
    body = shaped(WALKER, length=1.5, width=0.8, thickness=2.0)
    np.testing.assert_allclose(body.torso.solids[0].size, np.array(WALKER.torso.solids[0].size) * (1.5, 0.8, 2.0))
    for leg, before in zip(body.legs, WALKER.legs, strict=True):
        np.testing.assert_allclose(leg.mount, np.array(before.mount) * (1.5, 0.8, 1.0))


def test_the_fan_turns_first_legs_forward_and_last_ones_backward():
    before, after = ({leg.name: leg.foot_position for leg in body.legs} for body in (WALKER, shaped(WALKER, fan=20.0)))
    assert after["l1"][0] > before["l1"][0] and after["l3"][0] < before["l3"][0]
    np.testing.assert_allclose(after["l2"], before["l2"])
    for left, right in (("l1", "r1"), ("l3", "r3")):
        np.testing.assert_allclose(np.multiply(after[left], (1, -1, 1)), after[right])


def test_all_lengths_are_scaled():
    twice = shaped(WALKER, scale=2.0)
    assert twice == generator.scaled(WALKER, 2.0).replace(name="walker_6x3_shaped")


def test_solids_become_longer_along_the_axes_of_the_torso():
    """However they are turned: a capsule that lies along x gains length, one that stands gains radius."""
    solids = (
        Solid(name="ball", shape="sphere", size=(0.1,), position=(0.1, 0.0, 0.0)),
        Solid(name="lying", shape="capsule", size=(0.1, 0.2), euler_deg=(0.0, 90.0, 0.0)),
        Solid(name="upright", shape="cylinder", size=(0.1, 0.2)),
        Solid(name="box", shape="box", size=(0.1, 0.2, 0.3), euler_deg=(0.0, 0.0, 90.0)),
    )
    ballast = (Ballast(name="lead", shape="sphere", size=(0.05,), mass=3.0),)
    torso = WALKER.torso.replace(solids=solids)
    body = shaped(WALKER.replace(torso=torso, ballast=ballast), length=4.0)
    ball, lying, upright, box = body.torso.solids
    assert (ball.shape, ball.position) == ("ellipsoid", (0.4, 0.0, 0.0))
    for solid, size in ((ball, (0.4, 0.1, 0.1)), (lying, (0.1, 0.8)), (upright, (0.2, 0.2)), (box, (0.1, 0.8, 0.3))):
        np.testing.assert_allclose(solid.size, size)
    assert body.ballast[0].mass == pytest.approx(12.0)


def test_without_changes_the_body_is_the_same():
    assert shaped(WALKER, scale=1.0, links={"lower": 1.0}) is WALKER


@pytest.mark.parametrize("body", [*ROBOTS.values(), *map(load_body, EXAMPLES)], ids=lambda body: body.name)
def test_any_body_can_be_shaped_and_loaded(body):
    name = link_names(body)[-1]
    made = shaped(body, scale=1.2, length=1.2, width=0.9, fan=5.0, links={name: 1.1})
    assert made.name == f"{body.name}_shaped" and made.joint_names == body.joint_names
    environment = arc_suite.load(made, "walk", {"random": 0})
    environment.reset()
    assert not environment.step(np.zeros(len(made.joint_names))).last()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"widht": 1.2},
            "unknown change of a shape 'widht'; did you mean 'width'? (there are: scale, length, width, thickness, "
            "fan, torso, head, tail, links, ends)",
        ),
        (
            {"links": {"lowr": 1.5}},
            "unknown link 'lowr'; did you mean 'lower'? (there are: upper, middle, lower, of one leg, as l1_upper)",
        ),
        ({"links": {"lower": 20.0}}, "links['lower']: expected a number from 0.1 to 10, got 20.0"),
        ({"width": 0.0}, "width: expected a number from 0.1 to 10, got 0.0"),
        ({"fan": 91.0}, "fan: expected a number from -90 to 90, got 91.0"),
        ({"scale": 1e3}, "scale: expected a number from 0.01 to 100, got 1000.0"),
    ],
)
def test_errors(changes, message):
    with refused(message):
        shaped(WALKER, **changes)
