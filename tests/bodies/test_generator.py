"""Bodies made to order, random ones, scaled and mutated ones: they stand on all feet."""

import math

import imports
import mujoco
import numpy as np
import pytest
from dm_control import mjcf
from numpy.testing import assert_array_equal
from refusals import refused

from arc_suite import models
from arc_suite.bodies import generator, shaping
from arc_suite.models.standing import measure_standing
from arc_suite.robots import ROBOTS, mirror
from arc_suite.robots.spec import SpecError
from arc_suite.tasks.fitting import fitted_parameters
from arc_suite.tasks.walk import Walk


def compiled(body):
    return mjcf.Physics.from_mjcf_model(models.assemble(body)).model.ptr


@pytest.mark.slow
@pytest.mark.parametrize("legs", range(4, 13))
@pytest.mark.parametrize("links", range(1, 5))
def test_bodies_made_to_order_stand_on_all_feet(legs, links):
    body = generator.generate(legs, links)
    model = compiled(body)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert body.name == f"walker_{legs}x{links}"
    assert len(body.legs) == legs
    assert model.nu == legs * links
    assert model.nbody - 2 == legs * (links + 1)
    feet = {name: data.body(name).xpos for name in body.foot_names}
    bottoms = [feet[name][2] - model.geom(name).size[0] for name in body.foot_names]
    assert bottoms == pytest.approx([0.0] * legs, abs=1e-12)
    for leg, name in zip(body.legs, body.foot_names, strict=True):
        assert feet[name] - data.body("torso").xpos == pytest.approx(leg.foot_position, abs=1e-12)
    # every foot has its mirror image, and no two feet stand on one spot
    points = np.array(list(feet.values()))
    for mirrored in points * (1.0, -1.0, 1.0):
        assert np.linalg.norm(points - mirrored, axis=1).min() < 1e-12
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1) + np.eye(legs)
    assert apart.min() > 0.1
    # nothing but the feet reaches the floor
    data.qpos[2] -= 1e-6
    mujoco.mj_forward(model, data)
    pairs = [{model.geom(i).name for i in contact.geom} for contact in data.contact if contact.dist < 0.0]
    assert sorted(map(sorted, pairs)) == sorted(sorted(("floor", name)) for name in body.foot_names)


def test_even_counts_stand_in_mirrored_pairs_and_odd_ones_around():
    pairs = generator.generate(8, 3)
    assert [leg.name for leg in pairs.legs] == ["l1", "l2", "l3", "l4", "r1", "r2", "r3", "r4"]
    assert pairs.ranks == (0, 1, 2, 3) * 2
    for left, right in zip(pairs.legs[:4], pairs.legs[4:], strict=True):
        assert left.mirrored(right.name) == right
        assert left.side == "left"
    ring = generator.generate(5, 2)
    assert [leg.name for leg in ring.legs] == ["leg1", "leg2", "leg3", "leg4", "leg5"]
    headings = [math.degrees(math.atan2(leg.foot_position[1], leg.foot_position[0])) for leg in ring.legs]
    assert headings == pytest.approx([0.0, 72.0, 144.0, -144.0, -72.0], abs=1e-9)


@pytest.mark.parametrize(
    ("legs", "links", "message"),
    [
        (3, 3, "legs: expected an integer from 4 to 12, got 3"),
        (6.0, 3, "legs: expected an integer from 4 to 12, got 6.0; did you mean 6?"),
        (True, 3, "legs: expected an integer from 4 to 12, got True"),
        (6, 0, "links: expected an integer from 1 to 4, got 0"),
        (6, None, "links: expected an integer from 1 to 4, got None"),
    ],
)
def test_a_count_out_of_range_is_named(legs, links, message):
    with refused(message):
        generator.generate(legs, links)


def test_radial_legs_of_an_even_number_leave_the_front_free():
    ring = generator.generate(6, 3, "radial")
    headings = [math.degrees(math.atan2(leg.foot_position[1], leg.foot_position[0])) for leg in ring.legs]
    assert headings == pytest.approx([30.0, 90.0, 150.0, -150.0, -90.0, -30.0], abs=1e-9)
    with pytest.raises(ValueError, match="^layout: expected radial for an odd number of legs, got 'pairs' for 7$"):
        generator.generate(7, 3, "pairs")
    with pytest.raises(ValueError, match="^unknown layout 'ring' \\(there are: pairs, radial"):
        generator.generate(6, 3, "ring")


@pytest.mark.parametrize("seed", range(40))
def test_random_bodies_are_sound_and_within_their_ranges(seed):
    body = generator.random_body(seed)
    assert body == generator.random_body(seed)
    assert body.name == f"random_{seed}"
    length = body.torso.solids[0].size[0]
    height = body.torso.standing_height
    assert 4 <= len(body.legs) <= 12
    assert 2 <= len(body.legs[0].links) <= 4
    assert 0.08 <= length <= 1.2
    assert 0.6 <= height / length <= 1.4
    for leg in body.legs:
        assert leg.foot_position[2] - leg.foot.radius == pytest.approx(-height, abs=1e-12)
        out = math.dist(leg.foot_position[:2], leg.mount[:2])
        assert 0.7 * 0.75 - 1e-9 <= out / height <= 1.2 * 1.3 + 1e-9
    assert measure_standing(body).margin >= 0.08 * height


def test_random_bodies_are_of_all_kinds():
    bodies = [generator.random_body(seed) for seed in range(300)]
    assert {len(body.legs) for body in bodies} == set(range(4, 13))
    assert {len(body.legs[0].links) for body in bodies} == {2, 3, 4}
    pairs = [body for body in bodies if body.legs[0].name == "l1"]
    reaches = [{round(math.dist(leg.foot_position[:2], leg.mount[:2]), 9) for leg in body.legs} for body in bodies]
    assert 0.3 < sum(len(kinds) > 1 for kinds in reaches) / len(bodies) < 0.5
    assert 0.3 < len(pairs) / len(bodies) < 0.5
    lengths = [body.torso.solids[0].size[0] for body in bodies]
    assert (min(lengths) < 0.1, max(lengths) > 1.0) == (True, True)


def test_what_is_asked_for_leaves_the_rest_of_a_random_body_as_it_is():
    asked = generator.random_body(9, legs=6, links=3, layout="pairs")
    assert (len(asked.legs), len(asked.legs[0].links), asked.legs[0].name) == (6, 3, "l1")
    assert asked.torso.solids[0].size[0] == generator.random_body(9, legs=8, links=2).torso.solids[0].size[0]
    for kwargs, message in (
        ({"seed": -1}, "seed: expected an integer from 0 to 4294967295, got -1"),
        ({"seed": 1.5}, "seed: expected an integer from 0 to 4294967295, got 1.5"),
        ({"seed": 1, "legs": 13}, "legs: expected an integer from 4 to 12, got 13"),
        ({"seed": 1, "links": 9}, "links: expected an integer from 1 to 4, got 9"),
    ):
        with refused(message):
            generator.random_body(**kwargs)


def test_scaled_bodies_have_all_lengths_multiplied():
    body = ROBOTS["queen"]
    double = generator.scaled(body, 2.0)
    assert double.torso.standing_height == 1.5
    assert measure_standing(double).mass == pytest.approx(8.0 * measure_standing(body).mass, rel=1e-9)
    np.testing.assert_allclose(measure_standing(double).soles, 2.0 * measure_standing(body).soles, rtol=1e-12)
    assert double.simulation is None  # sized anew
    back = generator.scaled(generator.scaled(generator.generate(4, 2), 2.0), 0.5)
    assert back == generator.generate(4, 2).replace(name="walker_4x2_scaled")
    for factor in (0.0, math.nan, "2", 1e3):
        with pytest.raises(ValueError, match="^scale: expected a number from 0.01 to 100, got "):
            generator.scaled(body, factor)
    with pytest.raises(SpecError, match=r"^Solid\(chassis\).size: expected a number from 1e-06 to 100, got 3500.0$"):
        generator.scaled(generator.scaled(body, 100.0), 100.0)


def test_mutated_bodies_differ_a_little_and_stay_sound():
    body = generator.random_body(1)
    child = generator.mutated(body, 3)
    assert child == generator.mutated(body, 3)
    assert child != generator.mutated(body, 4)
    assert generator.mutated(body, 3, amount=0.0) == body.replace(name="random_1_mutated")
    lengths = [
        math.hypot(*new.end) / math.hypot(*old.end)
        for leg, former in zip(child.legs, body.legs, strict=True)
        for new, old in zip(leg.links, former.links, strict=True)
    ]
    assert min(lengths) > 0.5
    assert max(lengths) < 2.0
    for leg in child.legs:
        assert leg.foot_position[2] - leg.foot.radius == pytest.approx(-child.torso.standing_height, abs=1e-12)
    half = len(child.legs) // 2
    for left, right in zip(child.legs[:half], child.legs[half:], strict=True):
        assert left.mirrored(right.name) == right
    with pytest.raises(ValueError, match=r"^amount: expected a number from 0 to 0.5, got 2$"):
        generator.mutated(body, 3, amount=2)


def test_generated_bodies_do_not_take_the_names_of_robots():
    for name, robot in ROBOTS.items():
        scaled, mutated = generator.scaled(robot, 1.0), generator.mutated(robot, 0)
        assert (scaled.name, mutated.name) == (f"{name}_scaled", f"{name}_mutated")
        assert generator.mutated(scaled, 0).name == generator.mutated(mutated, 0).name == f"{name}_mutated"
        assert Walk.settings_for(scaled, {}).parameters.target_velocity == fitted_parameters(scaled)["target_velocity"]
    long = ROBOTS["queen"].replace(name="q" * 32)
    assert generator.scaled(long, 2.0).name == "q" * 25 + "_scaled"
    assert generator.mutated(long, 0).name == "q" * 24 + "_mutated"


DEFORMED = [generator.generate(5, 4), ROBOTS["tick"], imports.quadruped()]


def horizontal_lengths(body):
    """Lengths of links in the ground's plane, which heights of feet do not change."""
    return {part: np.linalg.norm(end[:2]) for part, end in shaping.link_ends(body).items()}


@pytest.mark.parametrize("body", DEFORMED, ids=lambda body: body.name)
def test_deformations_are_named_by_what_they_change(body):
    names = generator.list_deformations(body)
    lengths = horizontal_lengths(body)
    for index, name in enumerate(names):
        changed_body = generator.deform_legs(body, 0.1 * np.eye(len(names))[index])
        if name.endswith("_heading"):
            headings, new_headings = ({leg.name: leg.yaw_deg for leg in spec.legs} for spec in (body, changed_body))
            leg_name = name.removesuffix("_heading")
            assert new_headings[leg_name] - headings[leg_name] == pytest.approx(np.degrees(0.1))
        else:
            new_lengths = horizontal_lengths(changed_body)
            assert new_lengths[name] == pytest.approx(np.exp(0.1) * lengths[name])
            others = [part for part in lengths if not part.endswith(name.partition("_")[2])]
            assert [new_lengths[part] for part in others] == pytest.approx([lengths[part] for part in others])


def test_other_numbers_of_deformations_are_refused():
    with refused("changes: expected 12 numbers, of l1_upper, l1_middle, l1_lower, l1_heading, ", begins=True):
        generator.deform_legs(generator.generate(6, 3), [0.1, 0.2])


@pytest.mark.parametrize("legs", [5, 6, 7, 8])
def test_legs_around_a_torso_stay_mirrored(legs):
    """A leg on the midline stays there, the others have one number for both sides."""
    body = generator.generate(legs, 3, "radial")
    child = generator.mutated(generator.mutated(body, 3), 4)
    assert_array_equal(mirror.image(child).legs, mirror.image(body).legs)
    assert child.legs[0].links != body.legs[0].links
    assert len(generator.list_deformations(body)) == 4 * ((legs + 1) // 2) - legs % 2


def test_dry_friction_grows_with_torques():
    """The share of the sized motors that friction takes is the same at every scale; shapes scale alike."""
    body = generator.generate(4, 2)
    legs = []
    for leg in body.legs:
        links = [link.replace(joint=link.joint.replace(friction_loss=0.05)) for link in leg.links]
        legs.append(leg.replace(links=tuple(links)))
    rubbing_body = body.replace(name="rubbing", legs=tuple(legs))
    for scaled_body in (generator.scaled(rubbing_body, 0.25), shaping.shaped(rubbing_body, scale=0.25)):
        assert {joint.friction_loss for joint in scaled_body.joints} == {0.05 / 256.0}
    assert generator.scaled(rubbing_body, 1.0).legs == rubbing_body.legs
