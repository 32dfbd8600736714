"""Whether the demonstrator walks a body, and what cures one that it does not."""

from arc_suite.evaluation import cures
from arc_suite.robots.spec_files import load_body

SPIDER = load_body("spider")


def deep(share):
    """A spider whose chassis reaches down by a share of its standing height."""
    (chassis,) = SPIDER.torso.solids
    height = SPIDER.torso.standing_height
    solids = (chassis.replace(size=(*chassis.size[:2], share * height)),)
    return SPIDER.replace(torso=SPIDER.torso.replace(solids=solids))


def test_a_walk_is_as_good_as_the_rule_says():
    walk = cures.walk(SPIDER)
    assert (walk.length, walk.quality, walk.verdict.failures) == (100, 2, ())
    assert 0.9 < walk.speed / walk.target == walk.verdict.speed < 1.3


def test_a_body_that_drags_its_torso_does_not_walk_however_fast():
    walk = cures.walk(deep(1.01))
    assert walk.verdict.speed > 0.7 and walk.verdict.failures == ("touch",)
    assert walk.quality == 1


def test_fields_that_a_spec_gives_are_found():
    first, *others = SPIDER.legs
    hip, *links = first.links
    hip = hip.replace(joint=hip.joint.replace(damping=0.1))
    assert cures.given_fields(SPIDER) == []
    assert cures.given_fields(SPIDER.replace(legs=(first.replace(links=(hip, *links)), *others))) == ["damping"]
