"""Inertias that are too large for the robot become those of its colliders, which a note tells; others stay."""

import pathlib
import re

import mujoco
import numpy as np
import pytest

from arc_suite.evaluation import cures
from arc_suite.importing import import_robot

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2, A1, HEXAPOD = (FOLDER / name for name in ("go2_like.xml", "a1_like.urdf", "hexapod.urdf"))
NOTE = "repaired: inertias of {} links, too large for the robot, are those of its colliders, such as of {}"


def edited(folder, source, *edits):
    """Write a file with replacements of its first matches, and return its path."""
    text = source.read_text()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / source.name
    path.write_text(text)
    return path


def compiled(body):
    return mujoco.MjModel.from_xml_string(body.source)


CALF = 'mass="0.2414" diaginertia="0.00149 0.00146 5.3e-05"'


@pytest.mark.parametrize(
    ("source", "old", "new", "label"),
    [
        (GO2, CALF, 'mass="0.2414" diaginertia="1490 1460 53"', "FL_calf (1.49e+03 kg m^2 at 0.241 kg)"),
        (GO2, CALF, 'mass="1e-5" diaginertia="0.00149 0.00146 5.3e-05"', "FL_calf (0.00149 kg m^2 at 1e-05 kg)"),
        (A1, 'ixx="0.000469246"', 'ixx="1000" ', "FR_hip (333 kg m^2 at 0.696 kg)"),
        (A1, '<mass value="0.001"/>\n      <inertia ixx="1e-06"', '<mass value="0.001"/><inertia ixx="2000"', "base ("),
    ],
    ids=["in g mm^2", "of another mass", "one moment", "of a link that is fixed to the torso"],
)
def test_an_inertia_that_is_too_large_is_that_of_the_colliders(source, old, new, label, tmp_path):
    body, notes = import_robot(edited(tmp_path, source, (old, new)))
    assert any(note.startswith(NOTE.format(1, label)) for note in notes), notes
    corrected, original = compiled(body), compiled(import_robot(source).body)
    assert corrected.body_inertia.max() < 2.0 * original.body_inertia.max()
    changed = np.flatnonzero(abs(corrected.body_inertia - original.body_inertia).max(axis=1) > 1e-12)
    assert len(changed) == 1
    assert corrected.body_ipos[changed] == pytest.approx(original.body_ipos[changed], abs=1e-3)


def test_it_is_that_of_a_rod_where_the_collider_is_one(tmp_path):
    shapes = '<geom size="0.012" fromto="0.006 0 -0.02 0.006 0 -0.12"/>'
    lower_shape = '<geom size="0.01" fromto="0.018 0 -0.13 0 0 -0.2"/>'
    foot = '<geom name="FL" class="foot" pos="-0.002 0 -0.213"/>'
    rod = '<geom name="FL" size="0.002" fromto="0 0 0 0 0 -0.213"/>'
    path = edited(
        tmp_path, GO2, (CALF, 'mass="0.3" diaginertia="90 90 1"'), (shapes, ""), (lower_shape, ""), (foot, rod)
    )
    link = compiled(import_robot(path).body).body("l1_link3")
    assert link.mass == 0.3
    assert link.inertia[:2] == pytest.approx(0.3 * 0.215**2 / 12.0, rel=0.02)


def test_links_without_colliders_get_those_of_a_ball(tmp_path):
    body, notes = import_robot(edited(tmp_path, HEXAPOD, ('ixx="1e-05"', 'ixx="1000"')))
    assert any(NOTE.format(1, "c_lf") in note for note in notes)
    inertia = compiled(body).body("l1_link1").inertia
    assert 1e-5 < inertia.min() == inertia.max() < 1e-4


def test_inertias_of_the_robots_size_stay():
    for path in (GO2, A1, HEXAPOD):
        assert not any("too large" in note for note in import_robot(path).notes)


@pytest.mark.slow
def test_a_robot_of_six_legs_with_inertias_in_g_mm2_walks(tmp_path):
    text = re.sub(
        r'(i[xyz][xyz])="([^"]+)"', lambda match: f'{match[1]}="{float(match[2]) * 1e9:g}"', HEXAPOD.read_text()
    )
    path = tmp_path / "hexapod.urdf"
    path.write_text(text)
    body, notes = import_robot(path)
    assert any(NOTE.format(19, "base_link") in note for note in notes), notes
    walk = cures.walk(body)
    assert not walk.verdict.fell and walk.verdict.speed > 0.8
