"""Judging: seeds and ground follow from a policy's hash, and anchors are means over seeds of their own."""

import numpy as np
import pytest

from arc_suite import seed_ranges
from arc_suite.cpg.selection import law, preset_of
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging
from arc_suite.evaluation.judging import Part
from arc_suite.learning.studies.divisions import PLACES, SETTINGS, place_setup

FIRST = 4_100_000_000


def test_seeds_follow_from_the_hash():
    assert judging.seeds_of(None) == range(FIRST, FIRST + 100)
    first_seeds = range(FIRST + 1000, 2**32 - 100)
    for sha256 in ("0" * 64, "f" * 64, "0123456789abcdef" * 4):
        seeds = judging.seeds_of(sha256)
        assert seeds == range(first_seeds[int(sha256, 16) % len(first_seeds)], seeds.start + 100)
        assert seeds[0] in seed_ranges.JUDGING and seeds[-1] in seed_ranges.JUDGING
        assert not seed_ranges.common_seeds([judging.ANCHOR_SEEDS], seeds)


def test_the_ground_follows_too():
    seeds = judging.seeds_of("ab" * 32)
    settings = judging.setup_of(Setup.of("tick", "rough", {"rise": 0.1}), seeds).task_kwargs
    assert settings == {"rise": 0.1, "terrain_seed": seeds.start}
    for flat in (Setup.of("tick"), Setup.of("tick", "navigate"), Setup.of("tick,queen", "steer")):
        assert judging.setup_of(flat, seeds) == flat


def test_a_level_is_the_mean_over_parts_with_its_error():
    """On one ground errors are those of episodes; on several grounds those of grounds."""
    random = np.random.default_rng(0)
    shares = [random.normal(1000.0, 100.0, 125), random.normal(1010.0, 100.0, 50)]
    returns = np.concatenate(shares)
    flat = [Part("p", "zero", "", 0, len(share), share.mean(), share.std()) for share in shares]
    level = judging.level_of(flat)
    assert level == (pytest.approx(returns.mean()), pytest.approx(returns.std() / np.sqrt(175)), 175)
    rough = [Part("p", "zero", str(ground), 0, 125, mean, 1.0) for ground, mean in enumerate((900.0, 1000.0, 1100.0))]
    assert judging.level_of(rough) == (1000.0, pytest.approx(100.0 / np.sqrt(3)), 375)


def test_a_table_of_anchors_is_read_as_it_is_written(tmp_path):
    parts = [Part("tick, walk", "zero", "", FIRST, 125, 1.5, 0.5), Part('a, "b"', "blind", str(FIRST), 3, 1, 2.0, 0.0)]
    judging.write(tmp_path / "table.csv", parts)
    assert judging.read(tmp_path / "table.csv") == parts
    (tmp_path / "table.csv").write_text("place,policy\na,b\n")
    with pytest.raises(ValueError, match=r"table.csv: no table of anchors: "):
        judging.read(tmp_path / "table.csv")


def test_committed_anchors_are_those_of_places():
    """Each has standing still and a better law, over seeds of the anchors; uneven ground has the blind walker, too."""
    parts = judging.read(judging.TABLE)
    places = {str(place_setup(*place)): place_setup(*place) for place in PLACES}
    assert {part.place for part in parts} <= places.keys()
    assert all(part.first_seed in judging.ANCHOR_SEEDS for part in parts)
    for setup in places.values():
        if judging.levels(setup) is not None:
            scale = anchors.anchors(setup)
            assert scale.demonstrator > scale.zero + 5.0 * max(scale.errors)


@pytest.mark.parametrize("place", [place for place in SETTINGS if judging.levels(place_setup(*place)) is not None])
def test_ground_of_the_benchmark_asks_for_sight(place):
    """A blind walker, trained on flat ground, has less than half of the score of the best law, which reads the scan."""
    setup = place_setup(*place)
    scale = anchors.anchors(setup)
    assert scale.score(scale.blind) < 0.5
    assert "scan" in law(setup.definition, preset_of(setup.body, scale.preset)).reads
