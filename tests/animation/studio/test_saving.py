"""Files that the buttons save; no viser."""

import json
import re

import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest

from arc_suite.animation import pages
from arc_suite.animation.studio import saving
from arc_suite.animation.studio.creature import open_creature
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_from_json

FILES = {file.label: file for file in saving.FILES}
AHEAD = np.array((1.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def creature():
    made = open_creature(Sketch(source="tick", width=1.1))
    made.environment.reset()
    return made


def content(creature, label, **commands):
    return FILES[label].make(creature, creature.environment.physics.data.qpos.copy(), commands)


def test_names(creature):
    names = {saving.download_name(creature, file) for file in saving.FILES}
    ends = (".json", ".xml", ".glb", ".html", "_play.html", ".png", ".mp4")
    assert names == {f"tick_shaped{end}" for end in ends}


def test_spec_and_model(creature):
    assert body_from_json(content(creature, "Spec")) == creature.setup.body
    model = mujoco.MjModel.from_xml_string(content(creature, "MJCF").decode())
    assert model.nu == len(ROBOTS["tick"].joint_names)


def test_the_model_stands_on_the_ground_of_the_task():
    made = open_creature(Sketch(source="tick", ground="bumps"))
    assert mujoco.MjModel.from_xml_string(content(made, "MJCF").decode()).nhfield == 1


def test_a_page_to_play_in_begins_on_the_ground_of_the_creature(monkeypatch):
    monkeypatch.setattr(saving.play_pages, "page", lambda creatures: " ".join(creatures[0]["grounds"]))
    for ground, names in (("flat", b"level bumps slopes"), ("stairs", b"stairs level bumps slopes")):
        assert content(open_creature(Sketch(source="tick", ground=ground)), "Page to play in") == names


def test_a_picture(creature):
    view = imageio.imread(content(creature, "Picture"))
    assert view.shape == (480, 640, 3) and np.ptp(view) > 100


def test_a_page_plays_the_walk_under_the_command(creature, monkeypatch):
    monkeypatch.setattr(pages, "viewer_script", lambda: "")
    monkeypatch.setattr(saving, "_PAGE_STEPS", 40)
    tracks = []
    monkeypatch.setattr(saving.pages, "page", lambda given: tracks.append(given) or "<html>")
    assert content(creature, "Page", command=AHEAD) == b"<html>"
    (track,) = tracks[0].values()
    assert track.body == creature.setup.body and len(track.times) == 40
    forward, start = track.quaternions[-1], track.positions[[0, -1]]
    heading = np.array((1 - 2 * forward[3] ** 2, 2 * forward[0] * forward[3]))
    assert (start[1] - start[0])[:2] @ heading > 0.1


def test_a_page_to_play_in_has_the_body_and_its_law(creature, monkeypatch):
    made = []
    monkeypatch.setattr(saving.play_pages, "page", lambda given: made.extend(given) or "<html>")
    assert content(creature, "Page to play in") == b"<html>"
    (walker,) = made
    assert walker["name"] == "tick_shaped" and walker["policy"]["kind"] == "law"


@pytest.mark.slow
def test_a_film(creature, monkeypatch):
    monkeypatch.setattr(saving, "_FILM_STEPS", 6)
    film = content(creature, "Film", command=AHEAD)
    assert film[4:8] == b"ftyp" and len(film) > 1000


def test_clips_take_the_weight_of_a_slider(creature, monkeypatch):
    weights = []
    monkeypatch.setattr(saving.clips, "clips", lambda *given, weight: weights.append(weight) or [])
    monkeypatch.setattr(saving.clips, "glb", lambda *given, generator: b"glTF")
    (file,) = (file for file in saving.FILES if file.takes_weight)
    assert file.make(creature, None, {}, weight=0.5) == content(creature, "Clips") == b"glTF"
    assert weights == [0.5, 1.0]


@pytest.mark.long
def test_clips(creature):
    made = content(creature, "Clips")
    (length,) = np.frombuffer(made[12:16], "<u4")
    names = {each["name"] for each in json.loads(made[20 : 20 + length])["animations"]}
    assert made.startswith(b"glTF") and any(re.match("walk", name) for name in names)
