"""tools/make_media.py: the pictures of creatures are there, small, used by a page, and show what they are about."""

import re
import types

import make_media
import numpy as np
import pytest
from PIL import Image
from website import robots, tasks

from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

ROOT = make_media.ROOT
PAGES = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
PICTURE = re.compile(r"\]\((?P<path>[^):#\s]+\.(?:png|gif|webp|svg))\)")
ROWS = {ROOT / media.path: media for media in make_media.MEDIA}
MAX_STILL_BYTES = 300_000  # of a picture that does not move


def named(text, folder):
    return {(folder / found["path"]).resolve() for found in PICTURE.finditer(text)}


def generated():
    """The pictures that the site's pages of robots and tasks name."""
    pages = {"robots": map(robots.page, ROBOTS), "tasks": map(tasks.page, TASKS)}
    return set().union(*(named(text, ROOT / "docs" / folder) for folder, texts in pages.items() for text in texts))


def test_pictures_that_pages_name_are_there_and_small():
    pictures = set().union(*(named(page.read_text(encoding="utf-8"), page.parent) for page in PAGES))
    assert len(pictures) > 10
    missing = [str(path) for path in pictures if not path.is_file()]
    assert missing == []
    used = pictures | generated()
    assert ROWS.keys() - used == set()


def test_pictures_of_the_repository_are_small():
    pictures = [path for folder in ("docs", "studies", "examples") for path in (ROOT / folder).rglob("*.png")]
    assert len(pictures) > 10
    assert {path.name: path.stat().st_size for path in pictures if path.stat().st_size > MAX_STILL_BYTES} == {}


def test_every_row_is_drawn_and_within_its_limit():
    sizes = {path: path.stat().st_size for path in ROWS}
    assert {path.name: size for path, size in sizes.items() if size > ROWS[path].limit} == {}
    assert sum(sizes.values()) <= make_media.MAX_TOTAL_BYTES
    assert {path.stem for path in (ROOT / "docs" / "films").iterdir()} == {*ROBOTS, *TASKS, "robots"}
    for path, media in ROWS.items():
        with Image.open(path) as picture:
            cells = len(media.views) + 3 * media.large  # the large view takes four
            rows = -(-cells // media.columns)
            assert picture.size == (media.columns * media.size[0], rows * media.size[1])
            assert getattr(picture, "n_frames", 1) == max(1, media.steps)


def steps_of(name):
    """The markers, whether a leg hangs limp, and the progress at each step of the film of a task."""
    view = make_media.TASK_VIEWS[name]
    environment, run = make_media.open_environment(view), []
    for _ in make_media.play(view, environment, 67):
        task = environment.task
        run.append((task.markers(environment.physics), task.failed_legs(), task.progress))
    environment.close()
    return run


@pytest.mark.parametrize("name", [name for name in TASKS if name not in ("walk", "limp")])
def test_a_film_of_a_task_shows_what_the_task_is_about(name):
    run = steps_of(name)
    assert len(run) == 67 and not run[-1][2].get("fell")
    reds = [any(mark.color[1] < 0.2 for mark in marks) for marks, *_ in run]
    moment = make_media.TASK_VIEWS[name].moment
    assert all(len(marks) >= 2 for marks, *_ in run) or name in ("navigate", "recover")
    assert (any(reds), reds[moment]) == 2 * (name in ("shoved", "roam"),)
    if name == "navigate":
        assert run[-1][2]["goals"] > run[0][2]["goals"]


def test_the_film_of_limp_shows_a_dark_leg_and_that_of_walk_no_markers():
    assert {legs for _, legs, _ in steps_of("limp")} == {("l2",)}
    assert [marks for marks, *_ in steps_of("walk") if marks] == []


def test_a_row_is_drawn_from_its_views(tmp_path, monkeypatch):
    monkeypatch.setattr(make_media, "ROOT", tmp_path)
    view = make_media.TASK_VIEWS["limp"]._replace(start=2, moment=1)
    film = make_media.Media("films/a.webp", {"a": view, "b": view._replace(azimuth=0.0)}, 2, (64, 48), 3)
    make_media.draw(film)
    with Image.open(tmp_path / film.path) as picture:
        assert (picture.size, picture.n_frames) == ((128, 48), 3)
        view = np.asarray(picture.convert("RGB")).astype(int)
        assert abs(view[:, :64] - view[:, 64:]).mean() > 2.0
    with pytest.raises(ValueError, match=r"^films/a.webp: \d+ bytes, at most 10$"):
        make_media.draw(film._replace(limit=10))


@pytest.mark.parametrize(("drives", "least", "most"), [(False, 0.0, 0.0), (True, 0.8, 2.5)])  # at 0.5 m/s, for 3.35 s
def test_a_camera_stands_or_goes_along(drives, least, most):
    view = make_media.TASK_VIEWS["walk"]._replace(start=2, drives=drives)
    environment, scene = make_media.open_environment(view), types.SimpleNamespace(camera=[types.SimpleNamespace()])
    camera, places = make_media.Camera(view, environment), []
    for step in (0, 66):
        camera.aim(scene, step)
        (seen,) = scene.camera
        places.append(seen.pos)
        assert np.dot(seen.forward, seen.up) == pytest.approx(0.0, abs=1e-9)
    assert least <= (places[1] - places[0])[0] <= most
    environment.close()
