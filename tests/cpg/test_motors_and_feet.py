"""Presets of imported robots by what their motors give and carry, and how far aside their feet stand."""

import pathlib

import pytest

from arc_suite.cpg.selection import presets_of, suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.importing import import_robot

ROBOTS = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2 = (ROBOTS / "go2_like.xml").read_text()


@pytest.fixture
def go2(tmp_path):
    """Returns a Go2-like robot with motors of other torques, N m, in hips and in knees, which carry it."""

    def load(hip=23.7, knee=45.43):
        path = tmp_path / "go2_like.xml"
        path.write_text(GO2.replace("23.7", str(hip)).replace("45.43", str(knee)))
        return import_robot(path).body

    return load


def suited(body, *tasks):
    return [suited_preset(Setup.of(body, task).definition) for task in tasks]


def test_weak_motors_cross_rough_ground_and_slopes_by_sight(go2):
    """A motor of 23.7 N m gives 0.55 m g h."""
    body = go2()
    assert presets_of(body)["hiking"] == presets_of(body)["sighted"]
    assert suited(body, "rough", "slopes", "stairs", "course") == ["hiking", "hiking", "climbing", "crossing"]


def test_strong_motors_climb(go2):
    body = go2(hip=26.0)  # 0.61 m g h
    assert "hiking" not in presets_of(body)
    assert suited(body, "rough", "slopes", "stairs", "course") == ["climbing", "climbing", "climbing", "crossing"]


def test_under_a_large_load_the_torso_stays_high(go2):
    body = go2(knee=14.0)  # standing takes 0.42 of it
    presets = presets_of(body)
    assert presets["sighted"].ride == presets["crossing"].ride == presets["leaping"].walk.ride == 1.0
    assert suited(body, "rough", "course") == ["climbing", "crossing"]
    assert presets_of(go2(knee=16.0))["sighted"].ride == 0.85


def test_feet_far_aside_are_not_braced_further():
    presets = presets_of(import_robot(ROBOTS / "hexapod.urdf").body)
    assert presets["braced"] == presets["steered"]
    assert "limping" not in presets
