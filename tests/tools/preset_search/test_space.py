"""The space of a search: numbers of presets as vectors."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from preset_search import Space
from preset_search.space import HARMONICS, SPACES, Torques, round_vector

from arc_suite.cpg.prescribed import lay_out_feedforward, lay_out_pattern
from arc_suite.cpg.presets import PRESETS
from arc_suite.robots import ROBOTS


@pytest.mark.parametrize("robot", PRESETS)
def test_space_holds_the_preset_that_it_is_about(robot):
    body, medium = ROBOTS[robot], PRESETS[robot]["medium"]
    space = Space(body, medium)
    assert len(space.ranges()) == space.vector().size
    same = space.preset(space.vector())
    for ours, published in zip(lay_out_pattern(body, same), lay_out_pattern(body, medium), strict=True):
        assert_allclose(ours, published, atol=1e-12)
    for name in ("stiffness", "damping", "settle", "ramp", "ramp_start", "frequency"):
        assert getattr(same, name) == getattr(medium, name)


def test_a_lead_moves_the_clock_of_all_legs():
    body, medium = ROBOTS["leaper"], PRESETS["leaper"]["medium"]
    space = Space(body, medium)
    led = space.preset(space.vector(lead=0.75))
    assert led.phase_offsets == (0.75, 0.25, 0.25, 0.75)
    assert led._replace(phase_offsets=medium.phase_offsets) == space.preset(space.vector())


def test_every_number_of_a_vector_counts_and_stays_within_bounds():
    space, torques = (
        Space(ROBOTS["tick"], PRESETS["tick"]["medium"]),
        Torques(ROBOTS["leaper"], PRESETS["leaper"]["tuned"]),
    )
    (origin,) = torques.origins()
    for each, vector, sign in ((space, space.vector(0.1), -1.0), (torques, origin, 1.0)):
        scale, low, high, _ = np.transpose(each.ranges())
        presets = [each.preset(vector + sign * step) for step in np.diag(0.5 * scale)]
        assert len({str(preset) for preset in presets}) == vector.size
        assert each.preset(np.full(vector.size, 1e9)) == each.preset(high)
        assert each.preset(np.full(vector.size, -1e9)) == each.preset(low)
    assert round_vector(np.full(origin.size, 0.12345), torques.ranges()).tolist() == [0.123] * origin.size


@pytest.mark.parametrize("robot", PRESETS)
def test_torques_are_searched_about_tuned_and_refined_is_such(robot):
    body, kind = ROBOTS[robot], SPACES["torques"]
    space = kind.space(body, PRESETS[robot][kind.preset])
    (origin,) = space.origins()
    ranks, joints = max(body.ranks) + 1, len(body.legs[0].joints)
    assert origin.size == len(space.ranges()) == ranks * joints * 2 * HARMONICS + 1
    begun, refined = space.preset(origin), PRESETS[robot]["refined"]
    added = lay_out_feedforward(body, begun)
    assert not added.cosines.any() and not added.sines.any() and added.steering.any()
    for name in begun._fields:
        if name not in ("torques", "steering"):
            assert getattr(begun, name) == getattr(refined, name) == getattr(PRESETS[robot]["tuned"], name)
    found = [value for rows in refined.torques.values() for row in rows for value in row]
    assert space.preset(np.array([*found, refined.steering])) == refined
