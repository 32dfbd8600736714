"""Pages that play walks: what is in them, and in a browser that they show the track."""

import io
import itertools
import re
import zlib

import mujoco
import nodes
import numpy as np
import programs
import pytest
import tabs
from page_data import data_of
from PIL import Image

import arc_suite
from arc_suite.animation import pages, scenery
from arc_suite.arenas import FLAT
from arc_suite.models import swinging
from arc_suite.policies import policy
from arc_suite.robots import ROBOTS
from arc_suite.simulation.model import compile_model
from arc_suite.style import record
from arc_suite.tasks.modifiers import Kicks
from arc_suite.tasks.modifiers.motors import FAILS_FROM

STEPS = 60


@pytest.fixture(scope="module")
def tracks():
    def track(preset):
        return record(arc_suite.load("tick", "walk", {"random": 0}), policy("cpg", "tick", preset), 0, STEPS)

    return {"tick, tuned": track("tuned"), "tick, <slow> & low": track("slow")}


@pytest.fixture
def bundle(monkeypatch):
    """Something in place of the viewer, for tests of what is around it."""
    monkeypatch.setattr(pages, "viewer_script", lambda: "window.viewer = null;")


def qpos_of(track):
    return np.concatenate([track.positions, track.quaternions, track.joint_angles], axis=-1)


def test_a_page_holds_the_tracks(bundle, tracks):
    page = pages.page(tracks)
    assert "<title>tick, tuned, tick, &lt;slow&gt; &amp; low</title>" in page
    first, second = data_of(page)
    assert (first["label"], second["label"]) == tuple(tracks)
    track = tracks["tick, tuned"]
    np.testing.assert_allclose(first["positions"], track.positions, atol=1e-6)
    np.testing.assert_allclose(first["joints"], track.joint_angles, atol=1e-6)
    assert [part["name"] for part in first["parts"]] == [*ROBOTS["tick"].part_names, "antenna", "antenna_right"]
    assert first["stance"] == track.stance.astype(int).tolist() != first["schedule"]
    np.testing.assert_allclose(np.sum(list(first["terms"].values()), axis=0), track.rewards, atol=1e-5)
    assert first["totals"][-1] == pytest.approx(track.rewards.sum(), abs=1e-5)
    assert first["terms"].keys() == first["colors"].keys() and len(set(first["colors"].values())) == 10
    nothing = dict.fromkeys(("fields", "solids", "styles", "marks", "failed"), [])
    assert first["scenery"] == {"level": True, "planes": [0.0], **nothing}
    assert pages.page(tracks) == page


def scenery_of(task, settings, steps, preset=None):
    """The scenery of an episode, and the environment where it ended."""
    environment = arc_suite.load("tick", task, {"random": 0, **settings})
    task = environment.task.definition
    track = record(environment, policy("cpg", "tick", preset, task=task), 3, steps)
    return scenery.describe_scenery(track), environment


def test_the_ground_of_an_uneven_arena_comes_along():
    found, environment = scenery_of("steer", {"arena": "bumps"}, 2)
    (field,), arena = found["fields"], environment.task.definition.scene.arena
    rows, columns = field["heights"].shape
    x, y = (
        low + cell * np.arange(count)
        for low, cell, count in zip(field["low"], field["cell"], (columns, rows), strict=True)
    )
    np.testing.assert_allclose(field["heights"], arena.height(*np.meshgrid(x, y)), atol=1e-6)
    assert not found["level"] and not found["planes"] and not found["solids"]
    assert x[0] < -2.0 < 2.0 < x[-1] and np.ptp(field["heights"]) > 0.01


@pytest.mark.slow
def test_steps_come_along():
    found, environment = scenery_of("stairs", {}, 2)
    place, arena = environment.physics.data.qpos[:2], environment.task.definition.scene.arena
    unit = ROBOTS["tick"].torso.standing_height
    x, y = (place + np.random.default_rng(0).uniform((-3.0, -5.0), (10.0, 5.0), (500, 2)) * unit).T
    heights = np.full(500, max(found["planes"]))
    for solid in found["solids"]:
        (half_x, half_y, half_z), (at_x, at_y, at_z) = solid["size"], solid["place"]
        over = (abs(x - at_x) <= half_x) & (abs(y - at_y) <= half_y)
        heights = np.where(over, np.maximum(heights, at_z + half_z), heights)
    np.testing.assert_allclose(heights, arena.height(x, y), atol=1e-9)
    assert np.ptp(heights) > 0.1 * unit


def test_obstacles_and_goals_come_along():
    found, environment = scenery_of("navigate", {}, 12)
    data, run = environment.physics.data, environment.task
    places, near = {tuple(solid["place"]) for solid in found["solids"]}, 11.0 * ROBOTS["tick"].torso.standing_height
    assert places <= {tuple(place) for place in data.mocap_pos}
    assert places >= {tuple(place) for place in data.mocap_pos if abs(place - data.qpos[:3]).max() < near}
    assert {solid["kind"] for solid in found["solids"]} == {"capsule"} and found["planes"] == [0.0]
    assert len(found["marks"]) == 12
    wanted = run.markers(environment.physics)
    for (style, *ends), mark in zip(found["marks"][-1], wanted, strict=True):
        assert found["styles"][style] == {"shape": mark.shape, "radius": mark.radius, "color": tuple(mark.color)}
        np.testing.assert_allclose(ends, [*mark.start, *mark.end])


def test_kicks_and_failed_legs_come_along():
    """Of any task: `walk` has no markers of its own."""
    found, environment = scenery_of("walk", {"kicks": 1.5, "actuator_failure": 2}, 130, "tuned")
    first = environment.task.definition.state(environment.task.memory, Kicks).steps[0]
    kicked = [row for row, marks in enumerate(found["marks"], 1) if marks]
    assert kicked[0] == first and {style["shape"] for style in found["styles"]} == {"arrow"}
    leg = environment.task.body.legs[2]
    assert found["failed"][:FAILS_FROM] == [[]] * FAILS_FROM
    assert found["failed"][FAILS_FROM] == [leg.full_name(part) for part in (*leg.links, leg.foot)]


@pytest.mark.parametrize(
    ("task", "settings"),
    [
        ("mimic", {}),  # whose actions are positions about the motion
        ("steer", {"motor_strength": 1.0 / 3.0}),
        ("steer", {"delay": 2, "actions": "position"}),
    ],
)
def test_marks_go_on_where_motors_get_something_else_than_the_action(task, settings):
    found, environment = scenery_of(task, settings, 8)
    assert len(found["marks"]) == 8
    wanted = environment.task.markers(environment.physics)
    assert len(found["marks"][-1]) == len(wanted)
    for (style, *ends), mark in zip(found["marks"][-1], wanted, strict=True):
        assert found["styles"][style] == {"shape": mark.shape, "radius": mark.radius, "color": tuple(mark.color)}
        np.testing.assert_allclose(ends, [*mark.start, *mark.end], atol=1e-12)


def test_the_page_of_mimic_shows_the_motion_beside_the_body(bundle):
    environment = arc_suite.load("tick", "mimic", {"random": 0})
    task = environment.task.definition
    track = record(environment, policy("cpg", "tick", task=task), 0, 5)
    (walk,) = data_of(pages.page({"tick": track}))
    for marks, position in zip(walk["scenery"]["marks"], track.positions, strict=True):
        torso, *links = marks
        assert len(links) == sum(len(leg.links) for leg in task.scene.body.legs)
        middle = 0.5 * (np.array(torso[1:4]) + torso[4:])
        assert middle[1] - position[1] > task.scene.body.torso.standing_height
        assert len({style for style, *_ in marks}) == len(marks)


def test_marks_end_where_a_replay_differs():
    track = record(arc_suite.load("tick", "steer", {"random": 0}), policy("cpg", "tick", "steered"), 3, 8)
    moved = track._replace(positions=track.positions + np.arange(8)[:, None] // 5)
    assert len(scenery.describe_scenery(moved)["marks"]) == 5


def test_without_the_viewer_the_cure_is_one_for_a_clone_or_for_an_installed_package(tmp_path, monkeypatch):
    monkeypatch.setattr(pages.resources, "files", lambda package: tmp_path)
    with pytest.raises(
        ValueError, match="^no viewer for pages: `make web` builds it, which needs Node, https://nodejs.org$"
    ):
        pages.viewer_script()
    monkeypatch.setattr(pages.versions, "clone_folder", lambda: None)
    with pytest.raises(ValueError, match="^no viewer for pages: install a wheel that `make dist` has built in a clone"):
        pages.viewer_script()


def test_programs_without_a_viewer_write_nothing(tmp_path):
    if nodes.ENGINE.is_file():
        pytest.skip("there is a viewer here")
    commands = ("render", "-o", "walk.html"), ("style", "--page=walk.html", "--episodes=1"), ("play", "-o", "a.html")
    for command in commands:
        done = programs.run("-m", "arc_suite", *command, cwd=tmp_path)
        programs.refused(done, f"arc-suite {command[0]}: ")
        assert "make web" in done.stderr
    assert list(tmp_path.iterdir()) == []


@nodes.needs_viewer
def test_programs_write_pages(tmp_path):
    done = programs.run("-m", "arc_suite", "render", "--robot=tick", "--steps=400", "-o", "walk.html", cwd=tmp_path)
    assert re.fullmatch(r"tick: return [0-9.]+ in 400 steps\nwrote walk.html\n", programs.passed(done))
    page = (tmp_path / "walk.html").read_text()
    assert len(page) < 1_300_000
    assert "Permission is hereby granted, free of charge" in page  # three.js's license
    assert len(zlib.compress(pages.viewer_script().encode())) < 200_000
    compare = ("--robot=tick", "--compare=zero", "--episodes=1", "--page=both.html")
    programs.passed(programs.run("-m", "arc_suite", "style", *compare, cwd=tmp_path))
    labels = [walk["label"] for walk in data_of((tmp_path / "both.html").read_text())]
    assert labels == ["tick, cpg", "tick, zero"]


@pytest.fixture(scope="module")
def shown(browser, tracks, tmp_path_factory):
    """The page of both tracks, opened from disk, and all that it said and asked for."""
    path = tmp_path_factory.mktemp("page") / "walk.html"
    path.write_text(pages.page(tracks), encoding="utf-8")
    with tabs.opened(browser, path, "window.viewer", 800, 600) as (tab, asked):
        yield tab
    assert asked == [path.as_uri()]


@pytest.mark.slow
@nodes.needs_viewer
def test_the_picture_is_the_track(shown, tracks):
    """At the ends of control steps all parts are where MuJoCo has them, and halfway between two halfway."""
    body = ROBOTS["tick"]
    model = compile_model(body)
    data, parts = mujoco.MjData(model), [model.body(name).id for name in body.part_names]
    shown.evaluate("viewer.pause(false)")
    for row in (0, 7, 30, STEPS - 1):
        time = float(tracks["tick, tuned"].times[row])
        places = shown.evaluate(f"viewer.seek({time}), viewer.places()")
        for track, walk in zip(tracks.values(), places, strict=True):
            data.qpos[:] = qpos_of(track)[row]
            mujoco.mj_kinematics(model, data)
            np.testing.assert_allclose([walk[name] for name in body.part_names], data.xpos[parts], atol=1e-4)
            bones = swinging.Swinging(swinging.list_bones(body))
            poses = qpos_of(track)[: row + 1, :7]
            turns = [bones.follow(index * track.time_step, pose, FLAT) for index, pose in enumerate(poses)][-1]
            np.testing.assert_allclose(np.abs(walk["turns"]), np.abs(turns), atol=1e-3)
    track = tracks["tick, tuned"]
    places = shown.evaluate(f"viewer.seek({track.times[9] + 0.5 * track.time_step}), viewer.places()")
    np.testing.assert_allclose(places[0]["torso"], track.positions[9:11].mean(axis=0), atol=1e-5)


@pytest.mark.slow
@nodes.needs_viewer
def test_keys_and_controls(shown, tracks):
    step, end = tracks["tick, tuned"].time_step, STEPS * tracks["tick, tuned"].time_step
    time = lambda: shown.evaluate("viewer.state.time")  # noqa: E731
    shown.evaluate("viewer.pause(false)")
    shown.keyboard.press("Home")
    assert time() == 0.0
    shown.keyboard.press("ArrowRight")
    assert time() == pytest.approx(step)
    shown.keyboard.press("End")
    assert time() == pytest.approx(end)
    shown.keyboard.press("ArrowLeft")
    assert time() == pytest.approx(end - step)
    shown.keyboard.press("ArrowDown")
    assert shown.evaluate("viewer.state.speed") == 0.5
    shown.keyboard.press("Home")
    shown.keyboard.press(" ")
    shown.wait_for_function("viewer.state.time > 0.1")
    shown.keyboard.press(" ")
    assert shown.evaluate("viewer.state.playing") is False
    shown.fill("#time", "1.5")
    assert time() == pytest.approx(1.5, abs=0.01)
    assert shown.locator("section").count() == 2
    assert shown.locator("h2").first.text_content().startswith("tick, tuned: return")


def paged(path, task, steps):
    """Write the page of an episode, and return its track."""
    track = record(arc_suite.load("tick", task, {"random": 0}), policy("cpg", "tick", "steered"), 0, steps)
    path.write_text(pages.page({"tick": track}), encoding="utf-8")
    return track


@pytest.mark.slow
@nodes.needs_viewer
def test_goals_are_drawn(browser, tmp_path):
    track = paged(tmp_path / "goal.html", "navigate", 3)
    with tabs.opened(browser, tmp_path / "goal.html", "window.viewer", 800, 600) as (tab, _):
        tab.evaluate("viewer.pause(false)")
        for row in (0, 2):
            (marks,) = tab.evaluate(f"viewer.seek({track.times[row]}), viewer.marks()")
            wanted = [ends[:3] for _, *ends in scenery.describe_scenery(track)["marks"][row]]
            np.testing.assert_allclose(sorted(marks), sorted(wanted), atol=1e-5)


@pytest.mark.slow
@nodes.needs_viewer
def test_a_limp_leg_is_dark(browser, tmp_path):
    track = paged(tmp_path / "limp.html", "limp", FAILS_FROM + 5)
    with tabs.opened(browser, tmp_path / "limp.html", "window.viewer", 800, 600) as (tab, _):
        tab.evaluate("viewer.pause(false)")
        wanted = scenery.describe_scenery(track)["failed"]
        for row in (FAILS_FROM - 2, FAILS_FROM + 1, 0):
            (dark,) = tab.evaluate(f"viewer.seek({track.times[row]}), viewer.dark()")
            assert dark == wanted[row]


@pytest.mark.slow
@nodes.needs_viewer
def test_something_is_drawn(shown):
    """The creature stands out from the ground in the middle of its view, and moves over it in time."""
    shown.evaluate("viewer.pause(false)")
    pictures = []
    for time in (0.5, 1.5):
        shown.evaluate(f"viewer.seek({time})")
        picture = shown.locator("canvas.view").first.screenshot()
        pictures.append(np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), dtype=float))
    height, width = pictures[0].shape[:2]
    middle = pictures[0][height // 4 : 3 * height // 4, width // 4 : 3 * width // 4]
    assert middle.std() > 20.0
    assert abs(pictures[0] - pictures[1]).mean() > 1.0


@pytest.mark.slow
@nodes.needs_viewer
@pytest.mark.parametrize(("width", "height"), [(390, 844), (844, 390), (320, 256)])
def test_small_pages(browser, tracks, tmp_path, width, height):
    """The view is large enough or the page scrolls, nothing overlaps, controls have names and a size to hit."""
    (tmp_path / "walk.html").write_text(pages.page(tracks), encoding="utf-8")
    tab = tabs.new(browser, viewport={"width": width, "height": height}, reduced_motion="reduce")
    tab.goto((tmp_path / "walk.html").as_uri())
    tab.wait_for_function("window.viewer")
    assert tab.evaluate("viewer.state.playing") is False
    tab.evaluate("viewer.seek(1)")
    tab.wait_for_function("document.querySelector('.reward').style.height")
    drawn = [box.bounding_box() for box in tab.locator("h2, section canvas").all()]
    for first, second in itertools.combinations(drawn, 2):
        aside = first["x"] + first["width"] <= second["x"] + 1 or second["x"] + second["width"] <= first["x"] + 1
        assert (
            aside or first["y"] + first["height"] <= second["y"] + 1 or second["y"] + second["height"] <= first["y"] + 1
        )
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in drawn)
    views = [box.bounding_box()["height"] for box in tab.locator(".view").all()]
    assert min(views) >= 0.4 * height
    assert tab.evaluate("document.documentElement.scrollHeight") > height  # it scrolls
    footer = tab.locator("footer").bounding_box()
    assert footer["y"] + footer["height"] <= height + 1  # in sight without scrolling
    for control in tab.locator("button, input, select, summary").all():
        box = control.bounding_box()
        assert min(box["width"], box["height"]) >= 24
        assert control.evaluate("each => each.ariaLabel || each.textContent.trim()")
    labels = [canvas.get_attribute("aria-label") for canvas in tab.locator("canvas").all()]
    assert len(set(labels)) == 6 and all(label.startswith("tick, ") for label in labels)
    tab.close()
