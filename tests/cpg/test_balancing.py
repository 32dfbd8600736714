"""The demonstrator that keeps its balance, of Leaper, over ground."""

import numpy as np
import pytest
from crossings import crossed
from numpy.testing import assert_allclose

import arc_suite
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import presets_of
from arc_suite.cpg.stepping import GaitTiming, Stepping
from arc_suite.robots import ROBOTS


def fitted(body):
    """The law of Leaper, fitted to a body in steer."""
    return Stepping(arc_suite.load(body, "steer").task.definition, PRESETS["leaper"]["balanced"])


@pytest.mark.release
@pytest.mark.parametrize(
    ("task", "difficulty", "least", "further"), [("rough", 1.0 / 3.0, 0.8, 0.02), ("slopes", 2.0 / 3.0, 0.75, 0.2)]
)
def test_shifts_of_footholds_take_leaper_further(task, difficulty, least, further):
    ground = {"difficulty": difficulty, "terrain_seed": 1}
    balanced = PRESETS["leaper"]["surefooted"]
    before, _ = crossed("leaper", balanced._replace(lean=0.0, capture=0.0), task, ground, num_envs=6)
    after, fell = crossed("leaper", balanced, task, ground, num_envs=6)
    assert after >= max(least, before + further) and not fell, (before, after, fell)


def test_leaper_lifts_its_rear_feet():
    body, law = ROBOTS["leaper"], fitted(ROBOTS["leaper"])
    cycle = np.tile(np.linspace(0.0, 1.0, 21)[:, None], (1, len(body.legs)))
    rest = np.zeros((len(cycle), 3))
    timing = GaitTiming(cycle, law.duty_factor, law.stance_duration)
    feet = law.next_feet(timing, rest, rest[:, :2], np.ones((len(cycle), 1)))
    weights = np.tile(np.eye(3), (len(body.legs), 1, 1))
    angles = np.tile(law.rest_angles, (len(cycle), 1, 1))
    soles, _ = law.legs.soles(law.legs.solve_joint_angles(angles, feet, weights, 0.01, 20))
    assert np.ptp(soles[:, 2:, 2], axis=0).min() >= 0.12 * body.torso.standing_height


def test_its_former_name_is_a_preset_of_leaper_alone():
    assert presets_of(ROBOTS["leaper"])["balanced"] == presets_of(ROBOTS["leaper"])["surefooted"]
    for body in (ROBOTS["queen"], ROBOTS["bastion"], ROBOTS["tick"], generator.random_body(4)):
        assert "balanced" not in presets_of(body)
    with pytest.raises(
        ValueError,
        match="^unknown preset 'balanced'; did you mean 'braced'.*planned, tracked, rising, crossing.$",
    ):
        Demonstrator("queen", "balanced")


def test_balance_has_no_scale():
    """A body ten times as large, of other joints' strength, plans the same angles for its feet."""
    body = generator.random_body(4)
    laws = [fitted(body) for body in (body, generator.scaled(body, 10.0))]
    assert_allclose(*(law.rest_angles for law in laws), atol=1e-6)
    assert_allclose(10.0 * laws[0].rest_soles, laws[1].rest_soles)
