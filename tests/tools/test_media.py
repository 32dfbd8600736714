"""tools/make_media.py: the pictures of creatures are there, small, used by a page, and show what they are about."""

import itertools
import re
import types

import make_media
import numpy as np
import pytest
from media import stage, views
from PIL import Image
from tiers import tiers
from website import robots, tasks

from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS
from arc_suite.simulation import pictures
from arc_suite.tasks import TASKS

ROOT = make_media.ROOT
PAGES = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
PICTURE = re.compile(r"\]\((?P<path>[^):#\s]+\.(?:png|gif|webp|svg))\)")
ROWS = {ROOT / media.path: media for media in make_media.MEDIA}
FILMS = [path for path in ROWS if path.suffix == ".webp"]
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
    assert {path.stem for path in (ROOT / "docs" / "films").iterdir()} == {*ROBOTS, *TASKS, "first_sight"}
    for path, media in ROWS.items():
        with Image.open(path) as picture:
            assert picture.size == media.picture_size
            assert getattr(picture, "n_frames", 1) == media.frames


@pytest.mark.parametrize("path", FILMS, ids=lambda path: path.stem)
def test_films_have_24_pictures_a_second(path):
    with Image.open(path) as film:
        durations = []
        for frame in range(film.n_frames):
            film.seek(frame)
            film.load()
            durations.append(film.info["duration"])
    assert 1000.0 * film.n_frames / sum(durations) == pytest.approx(views.FPS, abs=0.1)


@pytest.mark.parametrize("path", [path for path in FILMS if path.stem != "first_sight"], ids=lambda path: path.stem)
def test_films_close(path):
    """The last picture differs from the first one hardly more than pictures that follow each other."""
    with Image.open(path) as film:
        pictures = []
        for frame in range(film.n_frames):
            film.seek(frame)
            pictures.append(np.asarray(film.convert("L").reduce(2), float))
    differences = [abs(second - first).mean() for first, second in itertools.pairwise(pictures)]
    assert abs(pictures[0] - pictures[-1]).mean() < 1.3 * max(differences)


def test_the_end_of_a_film_fades_into_what_comes_before_its_first_picture():
    film = [np.full((1, 1, 3), value, np.uint8) for value in (0, 40, 100, 120, 200, 210)]
    assert [int(picture[0, 0, 0]) for picture in stage.close(film, 2)] == [100, 120, 133, 97]
    assert stage.close(film, 0) == film


@pytest.mark.parametrize("name", [name for name, view in views.ONE_VIEWS.items() if view.seconds < 3.0])
def test_a_film_ends_where_the_gait_begins_anew(name):
    view = views.ONE_VIEWS[name]
    parameters = Setup.of(view.robot, "walk").definition.settings.parameters
    cycles = view.seconds * parameters.gait_frequency
    assert cycles == pytest.approx(round(cycles), abs=1e-9)
    assert view.frames / views.FPS == pytest.approx(view.seconds, abs=1e-9)


def test_the_film_of_readme_has_four_cuts_of_less_than_two_seconds():
    film = make_media.MEDIA[0]
    assert f"({film.path})" in (ROOT / "README.md").read_text(encoding="utf-8").partition("\n")[0]
    assert film.picture_size == (1280, 720)
    assert film.limit <= 3_000_000
    assert [1.5 <= cut.seconds <= 2.0 for cut in film.cuts.values()] == 4 * [True]


def test_a_creature_that_is_too_small_is_refused():
    view = views.TASK_VIEWS["walk"]._replace(start=2, seconds=2.0 / views.FPS, distance=9.0)
    with pytest.raises(ValueError, match=r"^frame 0: the creature has 0\.\d\d of the width, at least 0\.33$"):
        next(stage.pictures_of(view, (64, 36), True))


def test_a_creature_that_an_edge_cuts_is_refused():
    view = views.TASK_VIEWS["walk"]._replace(start=2, seconds=2.0 / views.FPS, distance=2.0)
    with pytest.raises(ValueError, match=r"^frame 0: the (left|right|top|bottom) edge cuts the creature$"):
        next(stage.pictures_of(view, (64, 36), True))


def test_tiles_of_the_ground_meet_at_the_end_of_a_film():
    model = pictures.Decorated.from_body(ROBOTS["queen"]).model.ptr
    stage._fit_tiles(model, 1.9)
    (repeats,) = set(model.mat_texrepeat[model.material("ground").id])
    assert 0.5 * repeats * 1.9 == pytest.approx(1.0)


def steps_of(name):
    """The markers, whether a leg hangs limp, and the progress at each step of the film of a task."""
    view = views.TASK_VIEWS[name]
    environment, run = views.open_environment(view), []
    for _ in views.play(view, environment, 67):
        task = environment.task
        run.append((task.markers(environment.physics), task.failed_legs(), task.progress))
    environment.close()
    return run


QUICK = ("steer", "navigate", "shoved", "mimic")  # films of other tasks are made for a release


@pytest.mark.parametrize("name", tiers([name for name in TASKS if name not in ("walk", "limp")], QUICK.__contains__))
def test_a_film_of_a_task_shows_what_the_task_is_about(name):
    run = steps_of(name)
    assert len(run) == 67 and not run[-1][2].get("fell")
    reds = [any(mark.color[1] < 0.2 for mark in marks) for marks, *_ in run]
    moment = views.TASK_VIEWS[name].moment
    assert all(len(marks) >= 2 for marks, *_ in run) or name in ("navigate", "recover")
    assert (any(reds), reds[moment]) == 2 * (name in ("shoved", "roam"),)
    if name == "navigate":
        assert run[-1][2]["goals"] > run[0][2]["goals"]


def test_the_film_of_limp_shows_a_dark_leg_and_that_of_walk_no_markers():
    assert {legs for _, legs, _ in steps_of("limp")} == {("l2",)}
    assert [marks for marks, *_ in steps_of("walk") if marks] == []


def test_a_row_is_drawn_from_its_views(tmp_path, monkeypatch):
    monkeypatch.setattr(make_media, "ROOT", tmp_path)
    view = views.TASK_VIEWS["limp"]._replace(start=2, moment=1, seconds=3.0 / views.FPS, fade=1)
    film = make_media.Media("films/a.webp", {"a": view, "b": view._replace(azimuth=0.0)}, 2, (64, 48))
    make_media.draw(film)
    with Image.open(tmp_path / film.path) as picture:
        assert (picture.size, picture.n_frames) == ((128, 48), 3)
        picture_of_both = np.asarray(picture.convert("RGB")).astype(int)
        assert abs(picture_of_both[:, :64] - picture_of_both[:, 64:]).mean() > 2.0
    make_media.draw(make_media.Media("films/a.png", {"a": view}, size=(64, 48)))
    with Image.open(tmp_path / "films" / "a.png") as picture:
        assert (picture.size, picture.mode) == ((64, 48), "P")
    with pytest.raises(ValueError, match=r"^films/a.webp: \d+ bytes, at most 10$"):
        make_media.draw(film._replace(limit=10))


@pytest.mark.parametrize(("drives", "least", "most"), [(False, 0.0, 0.0), (True, 0.4, 1.5)])  # at 0.5 m/s, for 2 s
def test_a_camera_stands_or_goes_along(drives, least, most):
    view = views.TASK_VIEWS["walk"]._replace(start=2, drives=drives)
    environment = views.open_environment(view)
    scene = types.SimpleNamespace(camera=[types.SimpleNamespace()])
    film = views.film_instants(view, environment)
    environment.close()
    camera = stage.Camera(view, environment.task.body, np.array([instant.qpos[:7] for instant in film]))
    places = []
    for frame in (0, len(film) - 1):
        camera.aim(scene, frame)
        (seen,) = scene.camera
        places.append(seen.pos)
        assert np.dot(seen.forward, seen.up) == pytest.approx(0.0, abs=1e-9)
    assert least <= (places[1] - places[0])[0] <= most


def test_frames_lie_between_control_steps():
    view = views.TASK_VIEWS["walk"]._replace(seconds=6.0 / views.FPS)
    environment = views.open_environment(view)
    film = views.film_instants(view, environment)
    environment.close()
    steps = np.diff([instant.qpos[0] for instant in film])
    assert len(film) == 6
    assert (steps > 0.0).all()
    assert steps.max() < 3.0 * steps.min()  # none is shown twice
