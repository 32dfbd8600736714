"""Gaits as data: one rule, named gaits, and which fit."""

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS, gaits

QUAD, HEXAPOD, OCTOPOD = (generator.generate(legs, 3) for legs in (4, 6, 8))
STARFISH = generator.generate(5, 3)


def stance(gait, cycles):
    return (cycles + np.array(gait.offsets)) % 1.0 < gait.duty_factor


def test_metachronal_waves_run_from_the_rear_to_the_front():
    # six legs at 5/6: l3, l2, l1, r3, r2, r1 swing one after another, each a sixth of a cycle
    gait = gaits.gait(HEXAPOD, "wave")
    assert gait.duty_factor == pytest.approx(5.0 / 6.0)
    cycles = (np.arange(6) + 0.5) / 6.0 + gait.duty_factor  # l3 takes off at 5/6 of its cycle
    swinging = [np.flatnonzero(~stance(gait, cycle)) for cycle in cycles]
    names = ["".join(HEXAPOD.legs[i].name for i in feet) for feet in swinging]
    assert names == ["l3", "l2", "l1", "r3", "r2", "r1"]


def test_the_rule_gives_a_tripod_at_half_and_a_tetrapod_at_two_thirds():
    tripod = gaits.metachronal(HEXAPOD, 0.5)
    assert tripod.offsets == pytest.approx((0.0, 0.5, 0.0, 0.5, 0.0, 0.5))
    tetrapod = gaits.gait(HEXAPOD, "tetrapod")
    counts = {int(stance(tetrapod, cycle).sum()) for cycle in (np.arange(60) + 0.5) / 60.0}
    assert counts == {4}


@pytest.mark.parametrize(
    ("name", "groups"), [("trot", {"l1 r2", "l2 r1"}), ("pace", {"l1 l2", "r1 r2"}), ("bound", {"l1 r1", "l2 r2"})]
)
def test_gaits_of_quadrupeds_pair_their_legs(name, groups):
    gait = gaits.gait(QUAD, name)
    pairs = {}
    for leg, offset in zip(QUAD.legs, gait.offsets, strict=True):
        pairs.setdefault(offset, []).append(leg.name)
    assert {" ".join(sorted(pair)) for pair in pairs.values()} == groups
    assert abs(np.subtract(*pairs)) == 0.5


def test_walk_of_a_quadruped_is_a_lateral_sequence():
    gait = gaits.gait(QUAD, "walk")
    assert gait.duty_factor == 0.75
    landing = {leg.name: -offset % 1.0 for leg, offset in zip(QUAD.legs, gait.offsets, strict=True)}
    assert sorted(landing, key=landing.get) == ["l2", "l1", "r2", "r1"]


@pytest.mark.parametrize(
    ("body", "fit"),
    [
        (QUAD, ("trot", "pace", "bound", "walk", "wave")),
        (STARFISH, ("ripple", "wave")),
        (HEXAPOD, ("tripod", "tetrapod", "ripple", "wave")),
        (OCTOPOD, ("tripod", "tetrapod", "ripple", "wave")),
        (ROBOTS["leaper"], ("trot", "pace", "bound", "walk", "wave")),
    ],
)
def test_gaits_that_fit_can_be_asked_for(body, fit):
    assert gaits.fitting_gaits(body) == fit
    for name in gaits.NAMES:
        if name in fit:
            gait = gaits.gait(body, name)
            assert len(gait.offsets) == len(body.legs)
            assert all(0.0 <= offset < 1.0 for offset in gait.offsets)
        else:
            legs = f"{body.name} with its {len(body.legs)} legs"
            with refused(f"gait {name!r} does not fit {legs} (fit: {', '.join(fit)})"):
                gaits.gait(body, name)


@pytest.mark.parametrize(("robot", "name"), [("queen", "tripod"), ("bastion", "tripod"), ("leaper", "trot")])
def test_published_gaits_are_among_the_named_ones(robot, name):
    published = arc_suite.load(robot, "walk").task.settings.parameters
    named = arc_suite.load(robot, "walk", {"gait": name}).task.settings.parameters
    assert named.duty_factor == published.duty_factor
    # up to where the clock starts
    shift = (named.phase_offsets - published.phase_offsets) % (2.0 * np.pi)
    np.testing.assert_allclose(shift, shift[0], atol=1e-12)


def test_task_and_demonstrator_take_a_gait():
    parameters = arc_suite.load("queen", "walk", {"gait": "ripple"}).task.settings.parameters
    gait = gaits.gait(ROBOTS["queen"], "ripple")
    assert parameters.duty_factor == 0.75
    np.testing.assert_allclose(parameters.phase_offsets, 2.0 * np.pi * np.array(gait.offsets))
    environment = arc_suite.load("queen", "walk", {"gait": "ripple", "duty_factor": 0.7})
    assert environment.task.settings.parameters.duty_factor == 0.7
    with pytest.raises(ValueError, match=r"^gait 'trot' does not fit queen with its 6 legs \(fit: tripod, tetrapod"):
        arc_suite.load("queen", "walk", {"gait": "trot"})


def test_a_body_walks_in_the_gait_that_is_asked_for():
    def compliance(walked):
        environment = arc_suite.load(HEXAPOD, "walk", {"random": 0, "gait": "ripple"})
        policy = Demonstrator(arc_suite.load(HEXAPOD, "walk", {"gait": walked}), "medium")
        step, share = environment.reset(), 0.0
        for _ in range(200):
            step = environment.step(policy(step))
            share += environment.task.terms["gait_bonus"] / 200.0
        return share

    assert compliance("ripple") > compliance("tripod") + 0.1


def test_paces_lie_between_those_of_the_table():
    assert gaits.pace_at(1.0) == gaits.pace_under_command((0.0, 0.5, 0.0)) == (1.0, 1.0, 0.0, 1.0)
    for pace in gaits.PACES.values():
        assert gaits.pace_at(pace.speed) == pace
    assert gaits.pace_at(0.8) == pytest.approx((0.8, 0.91, 0.025, 0.925))
    assert gaits.pace_at(0.1)[1:] == gaits.PACES["slow"][1:] and gaits.pace_at(3.0)[1:] == gaits.PACES["run"][1:]
    assert gaits.pace_under_command((0.5, 0.0, -0.5)) == gaits.pace_at(1.0)  # a curve
    assert gaits.pace_under_command((-0.5, 0.0, 0.0)) == gaits.pace_at(1.0)


def test_lifts_of_many_commands_are_those_of_each():
    commands = np.random.default_rng(0).uniform(-2.0, 2.0, (200, 3))
    lifts = [gaits.pace_under_command(command).height for command in commands]
    np.testing.assert_allclose(gaits.lifts_under_commands(commands), lifts)
