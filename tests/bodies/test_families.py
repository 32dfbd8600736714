"""Families of bodies: a sound body for every seed, of all kinds, by name wherever a body is asked for."""

import hashlib

import interpreters
import numpy as np
import programs
import pytest
from refusals import refused

from arc_suite import registry
from arc_suite.bodies import families, generator
from arc_suite.envs.setup import Setup
from arc_suite.learning import transfer
from arc_suite.models.overlap import overlaps
from arc_suite.models.soundness import flaws
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import SpecError
from arc_suite.robots.spec_files import body_from_json, body_to_json, load_body


@pytest.fixture(scope="module")
def bodies():
    return [families.varied_body(seed) for seed in range(60)]


def test_every_body_is_sound_and_one_of_its_seed(bodies):
    assert all(not flaws(body) for body in bodies[::3])
    assert [body.name for body in bodies] == [f"varied_{seed}" for seed in range(60)]
    assert families.varied_body(7) == bodies[7] and len(set(bodies)) == 60
    assert all(body_from_json(body_to_json(body)) == body for body in bodies)


def test_bodies_are_of_all_kinds(bodies):
    joints = [joint for body in bodies for leg in body.legs for joint in leg.joints]
    bends = [joint for joint in joints if joint.name != "hip"]
    assert {len(body.legs) for body in bodies} == set(range(4, 13))
    assert {len(leg.joints) for body in bodies for leg in body.legs} == {2, 3, 4}
    one_sided = np.mean([0.0 in joint.range_deg for joint in bends])
    assert 0.2 < one_sided < 0.5
    assert 0.25 < np.mean([joint.axis[2] < 0.0 for joint in joints if joint.name == "hip"]) < 0.6
    assert {len(body.torso.solids) for body in bodies} == {1, 3}
    assert {solid.shape for body in bodies for solid in body.torso.solids} >= {"box", "ellipsoid", "sphere"}
    assert 0.05 < np.mean([bool(body.ballast) for body in bodies]) < 0.4
    tilted = [leg for body in bodies for leg in body.legs if abs(leg.links[-1].end[0]) > 1e-9]
    assert tilted
    unequal = [len({joint.range_deg for leg in body.legs for joint in leg.joints[:1]}) for body in bodies]
    assert max(unequal) > 2, "pairs of some bodies have different joints"
    assert any(leg.name == "fl" for body in bodies for leg in body.legs), "no leaper"


def test_a_seed_stands_for_the_same_body_whatever_is_registered(bodies, monkeypatch):
    monkeypatch.setitem(ROBOTS, "spider", load_body("spider"))
    assert [families.varied_body(seed) for seed in range(8)] == bodies[:8]


def test_draws_that_are_unsound_are_drawn_again_by_seed_and_attempt():
    asked = []

    def draw(random):
        asked.append(random.integers(1000))
        if len(asked) == 1:
            raise SpecError("too small")
        body = generator.generate(6, 3)
        return body if len(asked) > 2 else body.replace(torso=body.torso.replace(standing_height=9.0))

    body = families.sound(draw, "late", 5)
    assert body == generator.generate(6, 3).replace(name="late_5")
    assert asked == [np.random.default_rng((5, attempt)).integers(1000) for attempt in range(3)]


def test_a_family_without_sound_bodies_is_one_line():
    hanging = generator.random_body(3)
    hanging = hanging.replace(torso=hanging.torso.replace(standing_height=9.0))
    with refused("hanging:5: none of 100 draws stands and can take steps; see arc-suite check"):
        families.sound(lambda random: hanging, "hanging", 5)


def test_seeds_stand_for_the_same_bodies_for_good():
    """A change of this digest changes the results of studies that name bodies by their seeds."""
    text = "".join(
        body_to_json(make(seed)) for make in (families.sound_body, families.varied_body) for seed in range(8)
    )
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == "8a68ff0ee14d7f36"


@pytest.mark.parametrize("family", registry.FAMILIES)
@pytest.mark.parametrize("seeds", [range(8), pytest.param(range(8, 200), marks=pytest.mark.release)], ids=str)
def test_bodies_of_every_family_are_sound(family, seeds):
    assert [seed for seed in seeds if flaws(registry.family_of(family)(seed))] == []


def test_a_sound_first_draw_is_the_body_and_later_ones_keep_legs_and_links():
    kept = 0
    for seed in range(24):
        first, body = generator.random_body(seed), families.sound_body(seed)
        assert body.name == first.name
        assert (len(body.legs), len(body.legs[0].links)) == (len(first.legs), len(first.legs[0].links))
        assert (body == first) == (not any(overlaps(first)))
        kept += body == first
    assert 6 < kept < 24


def test_what_is_asked_of_a_sound_body():
    body = families.sound_body(10, legs=8, links=4, layout="pairs")
    assert [len(body.legs), len(body.legs[0].links), body.legs[0].name] == [8, 4, "l1"] and not flaws(body)
    assert len(families.sound_body(11, 4, 1).legs[0].links) == 1
    with refused("legs: expected an integer from 4 to 12, got 13"):
        families.sound_body(0, legs=13)


def test_restricted_families_leave_out_what_tests_have():
    assert {len(families.few_legs(seed).legs) for seed in range(12)} == set(range(4, 9))
    assert {len(leg.joints) for seed in range(12) for leg in families.few_links(seed).legs} == {2, 3}
    assert families.few_legs(7).name == "few_legs_7" and families.few_links(7).name == "few_links_7"
    for name, count in (("many_legs", {9, 10, 11, 12}), ("four_links", {4})):
        bodies = [transfer.FAMILIES[name][0](index) for index in range(8)]
        assert {len(body.legs) if name == "many_legs" else len(body.legs[0].joints) for body in bodies} == count


def test_names_of_families():
    assert registry.body_of("random:7") == families.sound_body(7)
    assert registry.body_of("varied:7") == families.varied_body(7)
    assert registry.bodies_of("varied:3-5") == tuple(families.varied_body(seed) for seed in (3, 4, 5))
    assert registry.bodies_of("queen") == (registry.body_of("queen"),)
    setup = Setup.of("varied:7", "steer")
    assert Setup.from_dict(setup.to_dict()) == setup and setup.robot.startswith("{")


FAMILIES = "random, varied, few_legs, few_links"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("varied:0-1", "robot 'varied:0-1': expected one body, got several"),
        ("varied:x", "robot 'varied:x': expected varied:seed or varied:first-last, such as varied:0-9"),
        ("varied:-3", "robot 'varied:-3': expected varied:seed or varied:first-last, such as varied:0-9"),
        ("random:", "robot 'random:': expected random:seed or random:first-last, such as random:0-9"),
        ("varied:5-3", "robot 'varied:5-3': expected seeds in ascending order, at most 65536"),
        ("varied:0-99999999", "robot 'varied:0-99999999': expected seeds in ascending order, at most 65536"),
        (
            "varied:4294967296",
            "robot 'varied:4294967296': seed: expected an integer from 0 to 4294967295, got 4294967296",
        ),
        ("json:varied:3", "family 'json:varied': varied is the suite's own, expected without a module"),
        ("json:vared:3", "family 'vared': json registers no such family by arc_suite.register"),
    ],
)
def test_wrong_names_are_one_line(name, message):
    with refused(message):
        registry.body_of(name)


FAMILY = """
import arc_suite
from arc_suite.bodies.families import sound
from arc_suite.bodies.generator import generate, mutated

def crab(seed):
    return sound(lambda random: mutated(generate(8, 3), int(random.integers(1000))), "crab", seed)

arc_suite.register(module=__name__, families={"crab": crab, "random_access": crab})
"""


def test_families_of_other_packages_come_before_modules_of_their_names(tmp_path):
    (tmp_path / "creatures.py").write_text(FAMILY)
    (tmp_path / "crab.py").write_text("raise SystemExit('imported')\n")
    code = (
        "import arc_suite, creatures\n"
        "from arc_suite import registry\n"
        "body = registry.body_of('crab:3')\n"
        "assert body == creatures.crab(3) == registry.body_of('creatures:crab:3')\n"
        "print(body.name, len(registry.bodies_of('crab:0-4')))\n"
        "for given in ({'crab': len}, {'cr ab': len}):\n"
        "    try:\n"
        "        arc_suite.register(families=given)\n"
        "    except ValueError as error:\n"
        "        print(error)\n"
    )
    assert interpreters.printed(code, folder=tmp_path) == [
        "crab_3 5",
        "family 'crab' is already registered; choose another name",
        "family 'cr ab': expected letters, digits and underscores, without a digit first",
    ]
    done = programs.arc_suite("build_model", "--robot=creatures:crab:3", "--summary", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "") and "crab_3" in done.stdout


def test_programs_take_bodies_of_families():
    done = programs.arc_suite("evaluate", "--robot=varied:3-4", "--episodes=1", "--set=time_limit=1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "varied_3, straight" in done.stdout and "varied_4, straight" in done.stdout
