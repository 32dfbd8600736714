"""Pages to play in, in a browser: keys, sticks and pointers move a body, and everything is in reach."""

import itertools

import nodes
import pytest
import tabs

from arc_suite.animation import play
from arc_suite.robots import ROBOTS, generator

SIZES = [(1440, 900), (390, 844), (844, 390), (320, 256)]


pytestmark = [pytest.mark.slow, nodes.needs_viewer]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("play") / "play.html"
    path.write_text(play.page([play.creature(ROBOTS["tick"]), play.creature(generator.generate(6, 3))]), "utf-8")
    return path


@pytest.fixture(scope="module")
def opened(browser, page):
    """The page as opened from disk; nothing is said in the console, and nothing requested."""
    with tabs.opened(browser, page, "window.play", 320, 256) as (tab, asked):
        yield tab
    assert [url for url in asked if not url.startswith("data:")] == [page.as_uri()]


@pytest.fixture
def tab(opened):
    """The page, paused, with a body that has just started: tests step it without pictures."""
    opened.evaluate("play.pause(false)")
    opened.select_option("#ground", "level")
    opened.select_option("#body", "0")
    opened.click("#restart")
    return opened


def advanced(tab, seconds):
    """Positions and velocities after some seconds under the present command."""
    tab.evaluate(f"play.state.play.advance({seconds}, play.inputs.command, Infinity)")
    return tab.evaluate("[[...play.state.play.simulation.data.qpos], [...play.state.play.simulation.data.qvel]]")


def turned(tab):
    return tab.evaluate("play.state.play.simulation.task.place[2]")


def test_keys_walk_and_turn(tab):
    tab.keyboard.down("ArrowUp")
    assert tab.evaluate("play.inputs.command") == [1, 0, 0]
    (x, y, *_), _ = advanced(tab, 4.0)
    assert x > 0.8 and abs(y) < 0.3
    tab.keyboard.up("ArrowUp")
    _, qvel = advanced(tab, 2.0)
    assert abs(qvel[0]) < 0.05  # it stands
    tab.keyboard.down("a")
    before = turned(tab)
    advanced(tab, 1.5)
    assert turned(tab) - before > 0.5
    tab.keyboard.down("w")  # both: the command keeps its size
    assert tab.evaluate("play.inputs.command") == [0.5, 0, 0.5]
    tab.keyboard.up("a")
    tab.keyboard.up("w")
    tab.keyboard.down("q")
    assert tab.evaluate("play.inputs.command") == [0, 0.5, 0]
    tab.keyboard.up("q")


def test_keys_kick_restart_and_pause(tab):
    _, before = advanced(tab, 1.0)
    tab.keyboard.press("Space")
    after = tab.evaluate("[...play.state.play.simulation.data.qvel]")
    speed = sum((new - old) ** 2 for new, old in zip(after[:2], before[:2], strict=True)) ** 0.5
    assert speed == pytest.approx(0.8 * (9.81 * ROBOTS["tick"].torso.standing_height) ** 0.5, rel=1e-6)
    advanced(tab, 0.5)
    tab.keyboard.press("r")
    start = tab.evaluate("play.state.play.simulation.start")
    assert tab.evaluate("[...play.state.play.simulation.data.qpos]") == start
    for playing in (True, False):
        tab.keyboard.press("p")
        assert tab.evaluate("play.state.playing") is playing
    tab.focus("#kick")  # the space bar presses what has the focus, once
    tab.keyboard.press("r")
    tab.keyboard.press("Space")
    qvel = tab.evaluate("[...play.state.play.simulation.data.qvel]")
    assert sum(value**2 for value in qvel) ** 0.5 == pytest.approx(speed)


def test_the_pointer_pulls(tab):
    """A body that is dragged upwards leaves the ground; elsewhere the pointer turns the view."""
    (_, _, height, *_), _ = advanced(tab, 0.5)
    tab.evaluate("play.state.play.draw()")
    x, y = tab.evaluate(
        """(() => { const { view, parts, body } = play.state.play, { clientWidth: w, clientHeight: h } = view.canvas;
        const p = parts[0].position.clone().project(view.camera); return [(p.x + 1) / 2 * w, (1 - p.y) / 2 * h]; })()"""
    )
    tab.mouse.move(x, y)
    tab.mouse.down()
    assert tab.evaluate("play.state.play.simulation.pull !== null")
    tab.mouse.move(x, y - 60)
    (_, _, higher, *_), _ = advanced(tab, 0.5)
    assert higher > height + 0.1 * ROBOTS["tick"].torso.standing_height
    tab.mouse.up()
    assert tab.evaluate("play.state.play.simulation.pull") is None
    assert tab.evaluate("play.state.play.simulation.data.xfrc_applied.every((force) => force === 0)")
    before = tab.evaluate("play.state.play.view.camera.position.toArray()")
    tab.mouse.move(10, 140)
    tab.mouse.down()
    tab.mouse.move(60, 140)
    tab.mouse.up()
    assert tab.evaluate("play.state.play.view.camera.position.toArray()") != before


def test_bodies_and_grounds_are_chosen(tab):
    assert tab.locator("#body option").all_text_contents() == ["tick", "walker_6x3"]
    tab.select_option("#ground", "bumps")
    tab.keyboard.down("ArrowUp")
    heights = [advanced(tab, 1.0)[0][2] for _ in range(6)]
    tab.keyboard.up("ArrowUp")
    assert max(heights) - min(heights) > 0.005
    assert tab.locator("canvas").get_attribute("aria-label") == "tick on bumps ground"
    tab.select_option("#body", "1")
    assert tab.evaluate("play.state.play.body.name") == "walker_6x3"
    assert tab.evaluate("play.state.play.simulation.field !== null")
    assert tab.locator("canvas").count() == 1
    tab.evaluate("play.state.play.draw()")
    assert tab.evaluate("play.state.play.view.camera.aspect") == pytest.approx(320 / 256)
    tab.focus("#ground")  # a list that has the focus keeps its keys
    tab.keyboard.press("ArrowUp")
    assert tab.evaluate("play.inputs.command") == [0, 0, 0]
    assert tab.input_value("#ground") == "level"
    for index in range(20):  # more bodies than a browser has contexts to draw in
        tab.select_option("#body", str(index % 2))


def test_a_fallen_body_restarts(tab):
    tab.evaluate("play.state.play.simulation.data.qpos.set([0, 0, 0.1, 0, 1, 0, 0])")
    advanced(tab, 1.0)
    assert tab.evaluate("play.state.play.simulation.task.fell")
    advanced(tab, 1.0)
    _, _, z, w, *_ = advanced(tab, 0.5)[0]
    assert w > 0.9 and z > 0.7 * ROBOTS["tick"].torso.standing_height


def test_a_gamepad_steers(tab):
    tab.evaluate("navigator.getGamepads = () => [null, { connected: true, axes: [0.05, -0.8, 0.4, 0] }]")
    forward, left, turn = tab.evaluate("play.inputs.command")
    assert (forward, left, turn) == pytest.approx((0.8 / 1.2, 0.0, -0.4 / 1.2))
    tab.evaluate("delete navigator.getGamepads")
    assert tab.evaluate("play.inputs.command") == [0, 0, 0]


def boxes(tab):
    """Visible controls and texts over the view by name: left, top, right, bottom, px."""
    return tab.evaluate(
        """Object.fromEntries([...document.querySelectorAll("header > *, footer > *")].map((each) => {
        const { left, top, right, bottom } = each.getBoundingClientRect();
        return [each.id || each.textContent.slice(0, 20), [left, top, right, bottom]];
        }).filter(([, [left, top, right, bottom]]) => right > left && bottom > top))"""
    )


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_everything_has_its_place(browser, page, width, height):
    touch = width < 1000
    context = browser.new_context(viewport={"width": width, "height": height}, has_touch=touch, is_mobile=touch)
    tab = context.new_page()
    tab.goto(page.as_uri())
    tab.wait_for_function("window.play", timeout=60_000)
    tab.evaluate("play.pause(false)")
    found = boxes(tab)
    assert ("stick" in found) is touch
    for left, top, right, bottom in found.values():
        assert left >= 0 and top >= 0 and right <= width and bottom <= height
    for (name, first), (other, second) in itertools.combinations(found.items(), 2):
        apart = first[2] <= second[0] or second[2] <= first[0] or first[3] <= second[1] or second[3] <= first[1]
        assert apart, (name, other)
    covered = sum((right - left) * (bottom - top) for left, top, right, bottom in found.values())
    assert covered < 0.6 * width * height
    for control in tab.locator("button, select").all():
        box = control.bounding_box()
        assert min(box["width"], box["height"]) >= 24
        named = control.evaluate("each => (each.labels?.[0] ?? each).textContent.trim()")
        assert named
    if touch:
        box = tab.locator("#stick").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.mouse.move(x, y)
        tab.mouse.down()
        tab.mouse.move(x, y - box["height"] / 2)
        assert tab.evaluate("play.inputs.command") == pytest.approx([1, 0, 0])
        tab.mouse.up()
        assert tab.evaluate("play.inputs.command") == [0, 0, 0]
    context.close()
