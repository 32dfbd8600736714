"""The demonstrator that keeps its balance, of Leaper, over ground."""

import numpy as np
import pytest
from crossings import crossed
from numpy.testing import assert_allclose

from arc_suite.cpg import Demonstrator
from arc_suite.cpg.balancing import BALANCES, Balanced
from arc_suite.cpg.demonstrator import presets_of
from arc_suite.robots import ROBOTS, generator


@pytest.mark.long
@pytest.mark.parametrize(("task", "difficulty", "further"), [("rough", 1.0 / 3.0, 0.05), ("slopes", 2.0 / 3.0, 0.2)])
def test_balance_takes_leaper_further(task, difficulty, further):
    ground = {"difficulty": difficulty, "terrain_seed": 1}
    before, _ = crossed("leaper", "surefooted", task, ground, rows=6)
    after, fell = crossed("leaper", "balanced", task, ground, rows=6)
    assert after >= before + further and not fell, (before, after, fell)


def test_leaper_lifts_its_rear_feet():
    body, law = ROBOTS["leaper"], Balanced(ROBOTS["leaper"], BALANCES["leaper"])
    cycle = np.tile(np.linspace(0.0, 1.0, 21)[:, None], (1, len(body.legs)))
    rest = np.zeros((len(cycle), 3))
    feet = law._planned(cycle, rest, rest[:, :2], np.ones((len(cycle), 1)), rest)
    weights = np.tile(np.eye(3), (len(body.legs), 1, 1))
    angles = np.tile(law._first, (len(cycle), 1, 1))
    soles, _ = law._legs.soles(law._legs.reached(angles, feet, weights, 0.01, 20))
    assert np.ptp(soles[:, 2:, 2], axis=0).min() >= 0.2 * body.torso.standing_height


def test_it_is_a_preset_of_leaper_alone():
    assert presets_of(ROBOTS["leaper"])["balanced"] == BALANCES["leaper"]
    for body in (ROBOTS["queen"], ROBOTS["bastion"], ROBOTS["tick"], generator.random_body(4)):
        assert "balanced" not in presets_of(body)
    with pytest.raises(ValueError, match="^unknown preset 'balanced'; did you mean 'planned'.*sighted, planned.$"):
        Demonstrator("queen", "balanced")


def test_balance_has_no_scale():
    """A body ten times as large, of other joints' strength, plans the same angles for its feet."""
    laws = [Balanced(body, BALANCES["leaper"]) for body in (ROBOTS["leaper"], generator.scaled(ROBOTS["leaper"], 10.0))]
    assert_allclose(*(law._first for law in laws), atol=1e-6)
    assert_allclose(10.0 * laws[0]._places, laws[1]._places)
