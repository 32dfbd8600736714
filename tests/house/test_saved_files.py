"""Files that an earlier version saved load, and do what they did; `tests/saved_files.py` writes them."""

import json
import pathlib
import pickle
import re
import urllib.parse

import gymnasium
import numpy as np
import programs
import pytest
import saved_files
from saved_files import FOLDER

from arc_suite import animation, data, registry, style, versions
from arc_suite.animation.studio import sketch, states
from arc_suite.robots.spec_files import load_body, save_body

ROUNDING = 1e-9  # of rewards: last bits differ between the processor that saved the files and others


def test_a_body(tmp_path):
    assert load_body(FOLDER / "body.json") == registry.body_of("varied:7")
    save_body(load_body(FOLDER / "body.json"), tmp_path / "body.json")
    assert (tmp_path / "body.json").read_bytes() == (FOLDER / "body.json").read_bytes()


def test_the_state_of_the_studio():
    text = (FOLDER / "studio_state.json").read_text(encoding="utf-8")
    state = states.from_json(text)
    assert states.to_json(state) == text
    assert state.value("gait") == "tripod" and state.value("turn") == -0.2
    assert len(sketch.make_body(state.sketch).legs) == 6


def test_tracks():
    tracks = style.load(FOLDER / "tracks.npz")
    assert [len(track.rewards) for track in tracks] == [40, 40]
    assert style.report(tracks)["metrics"]["duty_factor"]["robot"][0] == pytest.approx(0.585, abs=1e-3)


@pytest.mark.release
def test_a_search_for_bodies_goes_on(tmp_path):
    folder = saved_files.unpack("design", tmp_path)
    if json.loads((folder / "design.json").read_text())["versions"] != versions.dependency_versions():
        pytest.skip("other versions of the physics than the search has; it would be refused")
    journal = (folder / "journal.jsonl").read_text()
    programs.passed(programs.arc_suite(*saved_files.design_command(folder, bodies=40)))
    continued = (folder / "journal.jsonl").read_text()
    assert continued.startswith(journal) and len(continued) > len(journal)


def test_a_dataset_has_every_bit(tmp_path):
    with saved_files.datasets_in(tmp_path):
        folder = saved_files.unpack("datasets", tmp_path)
    with saved_files.datasets_in(folder):
        data.verify(saved_files.DATASET_ID, progress=saved_files.silent)


@pytest.mark.parametrize("kind", saved_files.ENVIRONMENTS)
def test_a_snapshot_goes_on_as_before(kind):
    with np.load(FOLDER / f"snapshot_{kind}.npz", allow_pickle=False) as file:
        arrays = dict(file)
    expected = arrays.pop("expected/rewards")
    environment = saved_files.ENVIRONMENTS[kind]()
    environment.reset(seed=0)
    environment.restore(arrays)
    np.testing.assert_allclose(saved_files.rewards(environment), expected, rtol=ROUNDING)


@pytest.mark.parametrize("kind", saved_files.PICKLED)
def test_a_pickled_environment_goes_on_as_before(kind):
    pickled, expected = saved_files.read_pickled(f"environment_{kind}.pickle.xz")
    np.testing.assert_allclose(saved_files.rewards(pickle.loads(pickled)), expected, rtol=ROUNDING)


def test_the_link_of_a_page_names_its_lists():
    link = (FOLDER / "link.txt").read_text().strip()
    page = (pathlib.Path(animation.__file__).parent / "play.html").read_text()
    for name, choice in urllib.parse.parse_qsl(urllib.parse.urlsplit(link).fragment):
        options = re.search(rf'<select id="{name}">(.*?)</select>', page).group(1)
        assert not options or f"<option>{choice}</option>" in options


def test_pickled_values():
    setup, several, body, environment = saved_files.read_pickled("values.pickle.xz")
    assert setup == saved_files.Setup.of("varied:7", "roam", saved_files.SETTINGS)
    assert several == saved_files.Setup.of("varied:0-7", "steer")
    assert body == registry.body_of("spider")
    observation, _ = environment.reset(seed=5)
    expected, _ = gymnasium.make("arc_suite/queen-steer-v0").reset(seed=5)
    np.testing.assert_array_equal(observation, expected)
