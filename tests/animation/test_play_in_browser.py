"""Pages to play in, in a browser: keys, sticks and pointers move a body, and everything is in reach."""

import itertools
import math

import nodes
import pytest
import tabs

from arc_suite.animation import play_pages
from arc_suite.bodies import generator
from arc_suite.robots import ROBOTS, gaits

ASKED = "play.panel.asked(play.inputs.command, play.inputs.pose, play.inputs.runs)"
STEP = f"play.state.play.advance({{}}, {ASKED})"
SIZES = [(1440, 900), (390, 844), (844, 390), (320, 256)]


pytestmark = [pytest.mark.slow, nodes.needs_viewer]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("play") / "play.html"
    bodies = [
        play_pages.creature(ROBOTS["tick"]),
        play_pages.creature(generator.generate(6, 3)),
        play_pages.creature(ROBOTS["queen"], "ppo"),
        play_pages.creature(ROBOTS["queen"]),
    ]
    path.write_text(play_pages.page(bodies), "utf-8")
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
    opened.evaluate("play.pause(false); play.inputs.held.clear(); delete navigator.getGamepads")
    if opened.input_value("#mode") != "free":
        opened.select_option("#mode", "free")
    opened.select_option("#ground", "level")
    opened.select_option("#body", "0")
    opened.click("#restart")
    return opened


def advanced(tab, seconds):
    """Positions and velocities after some seconds under commands."""
    tab.evaluate(f"play.state.play.advance({seconds}, {ASKED}, Infinity)")
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


def test_slow_pictures_leave_physics_its_time_and_the_pace_is_that_of_the_clock(tab):
    tab.evaluate("(() => { let calls = 0; performance.now = () => (calls += 1); })()")  # 1 ms a substep
    timestep = tab.evaluate("play.state.play.body.timestep")
    start, end = (tab.evaluate(f"{step}, play.state.play.simulation.data.time") for step in ("0", STEP.format(0.4)))
    tab.evaluate("delete performance.now")
    assert end - start == pytest.approx(min(0.4, 200 * timestep), abs=3 * timestep)
    tab.evaluate(f"play.state.play.advance(1.0, {ASKED}, Infinity)")
    assert tab.evaluate("play.state.play.pace") > 0.9
    tab.evaluate(f"play.state.play.advance(1.0, {ASKED}, 0)")  # a picture of a second, and no time for physics
    assert tab.evaluate("play.state.play.pace") < 0.1


def test_keys_kick_restart_and_pause(tab):
    _, before = advanced(tab, 1.0)
    tab.keyboard.press("b")
    after = tab.evaluate("[...play.state.play.simulation.data.qvel]")
    speed = sum((new - old) ** 2 for new, old in zip(after[:2], before[:2], strict=True)) ** 0.5
    tap = 0.35 * tab.evaluate("play.state.play.body.kick")
    assert 0.99 * tap < speed < 1.5 * tap
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
    assert 0.99 * tap < sum(value**2 for value in qvel) ** 0.5 < 1.5 * tap


def test_a_kick_grows_while_it_is_held(tab):
    largest = tab.evaluate("play.state.play.body.kick")
    button = tab.locator("#kick").bounding_box()
    tab.mouse.move(button["x"] + 5, button["y"] + 5)
    for press, let_go in (
        (lambda: tab.keyboard.down("b"), lambda: tab.keyboard.up("b")),
        (tab.mouse.down, tab.mouse.up),
        (lambda: padded(tab, {0: 1}), lambda: padded(tab, {})),
    ):
        tab.keyboard.press("r")
        press()
        tab.wait_for_function("play.kick.share === 1")
        assert tab.evaluate("play.state.play.simulation.data.qvel.every((value) => value === 0)")
        let_go()
        tab.wait_for_function("play.kick.start === null")
        qvel = tab.evaluate("[...play.state.play.simulation.data.qvel]")
        assert sum(value**2 for value in qvel[:2]) ** 0.5 == pytest.approx(largest)
    tab.evaluate("delete navigator.getGamepads")


def test_shift_or_a_button_runs(tab):
    walked = advanced_ahead(tab, ("w",))
    *offsets, duty, frequency = tab.evaluate(f"{ASKED}.gait")
    tab.evaluate("play.inputs.running = true")
    tab.keyboard.down("w")
    assert tab.evaluate(f"{ASKED}.gait") == pytest.approx([*offsets, duty - 0.1, 1.35 * frequency])
    tab.keyboard.up("w")
    assert tab.evaluate(f"{ASKED}.gait") == [*offsets, duty, frequency]  # it stands
    tab.evaluate("play.inputs.running = false")
    assert advanced_ahead(tab, ("Shift", "w")) > 1.4 * walked
    tab.click("#run")
    assert advanced_ahead(tab, ("w",)) > 1.4 * walked
    tab.click("#run")
    assert advanced_ahead(tab, ("w",)) == pytest.approx(walked, rel=0.1)


def test_a_body_without_a_run_has_no_button_and_walks_under_shift(tab):
    tab.evaluate("play.state.play.body.task.direction.run = null")
    tab.dispatch_event("#ground", "change")
    assert tab.is_hidden("#run")
    walked = advanced_ahead(tab, ("w",))
    assert advanced_ahead(tab, ("Shift", "w")) == pytest.approx(walked, rel=0.1)
    tab.evaluate("play.state.play.body.task.direction.run = 1.75")
    tab.dispatch_event("#ground", "change")
    assert tab.is_visible("#run")


def advanced_ahead(tab, keys):
    """How far a body comes in three seconds with some keys held, after one to begin."""
    tab.keyboard.press("r")
    for key in keys:
        tab.keyboard.down(key)
    (start, *_), _ = advanced(tab, 1.0)
    (end, *_), _ = advanced(tab, 3.0)
    for key in keys:
        tab.keyboard.up(key)
    return end - start


def test_the_camera_follows_a_lifted_body(tab):
    advanced(tab, 0.5)
    height = ROBOTS["tick"].torso.standing_height
    before = tab.evaluate("play.state.play.pose(), play.state.play.target().z")
    tab.evaluate(f"play.state.play.simulation.data.qpos[2] += {4.0 * height}")
    lifted = tab.evaluate("play.state.play.pose(), play.state.play.target().z")
    assert before == pytest.approx(0.45 * height, rel=0.01) and lifted > before + 3.0 * height


def test_keys_buttons_and_gamepads_jump(tab):
    """The torso rises; a trained policy does not jump, and nothing says that it does."""
    height = ROBOTS["tick"].torso.standing_height
    assert tab.text_content("#leap") == tab.text_content("#leaps") == "jump"
    ways = lambda: tab.keyboard.press("Space"), lambda: tab.click("#leap"), lambda: padded(tab, {2: 1})
    for way in ways:
        (_, _, before, *_), _ = advanced(tab, 2.0)
        way()
        tab.wait_for_function("play.state.play.simulation.driver.leap")
        heights = [advanced(tab, 0.05)[0][2] for _ in range(20)]
        assert max(heights) > before + 0.3 * height and tab.evaluate("!play.state.play.simulation.task.fell")
    tab.evaluate("delete navigator.getGamepads")
    tab.select_option("#body", "1")
    assert tab.text_content("#leaps") == "jump, while walking leap"
    tab.select_option("#body", "2")
    assert not any(each.is_visible() for each in tab.locator(".leaping").all())
    tab.keyboard.press("Space")
    assert tab.evaluate("!play.state.play.simulation.driver.leap")


def padded(tab, buttons, axes=(0, 0, 0, 0), mapping="standard"):
    """Connects a gamepad with values of axes and of some buttons by number."""
    values = [buttons.get(number, 0) for number in range(16)]
    tab.evaluate(
        """([values, axes, mapping]) => { const buttons = values.map((value) => ({ value, pressed: value > 0.5 }));
        navigator.getGamepads = () => [null, { connected: true, mapping, axes, buttons }]; }""",
        [values, axes, mapping],
    )


def posed(tab):
    """The pose that is asked for."""
    return tab.evaluate(f"{ASKED}.pose")


def test_keys_and_sliders_pose(tab):
    (low, _), *_, (_, twisted) = tab.evaluate("play.state.play.body.task.direction.room")
    height = ROBOTS["tick"].torso.standing_height
    (_, _, rest, *_), _ = advanced(tab, 1.0)
    tab.keyboard.down("c")
    assert posed(tab) == [low, 0, 0, 0, 0, 0]
    (_, _, crouched, *_), _ = advanced(tab, 2.0)
    assert (crouched - rest) / height == pytest.approx(low, abs=0.05)
    tab.keyboard.up("c")
    (_, _, again, *_), _ = advanced(tab, 2.0)
    assert again == pytest.approx(rest, abs=0.05 * height)
    tab.evaluate("document.getElementById('direction').open = true")
    slider = tab.locator("#direction .sliders input").nth(5)
    slider.focus()
    slider.press("End")  # with the focus, arrows are the slider's, and no way to walk
    assert tab.evaluate("play.inputs.command") == [0, 0, 0]
    assert posed(tab) == pytest.approx([0, 0, 0, 0, 0, twisted])
    tab.keyboard.down("v")  # not both as far as each goes
    assert posed(tab)[5] == pytest.approx(0.5 * twisted)
    tab.keyboard.up("v")
    slider.evaluate("each => each.blur()")
    tab.keyboard.press("0")
    assert posed(tab) == [0] * 6
    slider.scroll_into_view_if_needed()
    slider.click(position={"x": 1, "y": 8})  # a pointer gives the keys back
    assert posed(tab)[5] < 0 and tab.evaluate("document.activeElement === document.body")
    tab.click("#upright")
    assert posed(tab) == [0] * 6 and tab.evaluate("document.activeElement === document.body")
    tab.evaluate("document.getElementById('direction').open = false")


def test_keys_and_the_list_change_the_gait(tab):
    own = tab.evaluate(f"{ASKED}.gait")
    names = ["own", *gaits.fitting_gaits(ROBOTS["tick"])]
    assert tab.locator("#gait option").all_text_contents() == names
    tab.keyboard.down("w")
    advanced(tab, 1.0)
    for number, name in enumerate(names[1:], start=1):
        tab.keyboard.press(str(number))
        gait = gaits.gait(ROBOTS["tick"], name)
        assert tab.evaluate(f"{ASKED}.gait") == pytest.approx([*gait.offsets, gait.duty_factor, own[-1]])
    x, _ = (advanced(tab, seconds)[0][0] for seconds in (2.0, 2.0))
    units = tab.evaluate("play.state.play.simulation.task.direction.gait")
    assert units[:-1] == [round(2**20 * part) for part in (*gait.offsets, gait.duty_factor)]  # it has glided there
    tab.keyboard.press("9")  # there is none
    tab.keyboard.press(".")
    tab.keyboard.press(".")
    tab.keyboard.press(",")
    assert tab.input_value("#gait") == name
    assert tab.evaluate(f"{ASKED}.gait")[-1] == pytest.approx(1.1 * own[-1])
    tab.keyboard.up("w")
    tab.keyboard.press("0")
    assert tab.evaluate(f"{ASKED}.gait") == own


def test_a_trained_policy_is_offered_no_pose(tab):
    tab.select_option("#body", "2")
    assert not tab.is_visible("#direction") and not tab.locator(".directed").first.is_visible()
    assert tab.evaluate(ASKED) == {"command": [0, 0, 0]}
    tab.keyboard.down("c")
    advanced(tab, 0.2)
    tab.keyboard.up("c")
    tab.select_option("#body", "0")
    assert tab.is_visible("#direction")


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
    assert tab.locator("#body option").all_text_contents() == ["tick", "walker_6x3", "queen", "queen"]
    tab.select_option("#ground", "bumps")
    tab.keyboard.down("ArrowUp")
    heights = [advanced(tab, 1.0)[0][2] for _ in range(6)]
    tab.keyboard.up("ArrowUp")
    assert max(heights) - min(heights) > 0.005
    assert tab.locator("canvas").get_attribute("aria-label") == "tick on bumps ground"
    tab.select_option("#body", "1")
    assert tab.evaluate("play.state.play.body.name") == "walker_6x3"
    assert tab.evaluate("play.state.play.simulation.field !== null")
    red, _, blue = tab.evaluate(
        """(() => { const { color, position } = play.state.play.floor.geometry.attributes;
        const heights = Array.from({ length: position.count }, (_, index) => position.getZ(index));
        const colors = [Math.min, Math.max].map((most) => heights.indexOf(most(...heights)))
          .map((index) => [color.getX(index), color.getY(index), color.getZ(index)]);
        return colors[0].map((value, i) => colors[1][i] / value); })()"""
    )
    assert red > 1.5 and blue < 0.8  # the tops of bumps are of another color than level ground
    assert tab.locator("canvas").count() == 1
    tab.evaluate("play.state.play.draw()")
    assert tab.evaluate("play.state.play.view.camera.aspect") == pytest.approx(320 / 256)
    tab.select_option("#ground", "slopes")
    tab.keyboard.down("ArrowUp")
    heights = [advanced(tab, 1.0)[0][2] for _ in range(8)]
    tab.keyboard.up("ArrowUp")
    assert max(heights) - min(heights) > 0.1 * ROBOTS["tick"].torso.standing_height
    tab.select_option("#ground", "level")
    tab.focus("#ground")  # a list that has the focus keeps its keys
    tab.keyboard.press("ArrowUp")
    assert tab.evaluate("play.inputs.command") == [0, 0, 0]
    assert tab.input_value("#ground") == "level"
    for index in range(20):  # more bodies than a browser has contexts to draw in
        tab.select_option("#body", str(index % 2))


def test_a_fallen_body_gets_up(tab):
    tab.evaluate("play.state.play.simulation.data.qpos.set([0, 0, 0.1, 0, 1, 0, 0])")
    advanced(tab, 1.0)
    assert tab.evaluate("play.state.play.simulation.minds[0].rises && play.state.play.simulation.fell")
    _, _, z, _, roll, pitch, *_ = advanced(tab, 5.0)[0]
    assert 1.0 - 2.0 * (roll**2 + pitch**2) > 0.9 and z > 0.7 * ROBOTS["tick"].torso.standing_height
    assert tab.evaluate("!play.state.play.simulation.fell && play.state.play.simulation.count > 2000")  # no restart


@pytest.mark.parametrize(("body", "seconds"), [("2", 1.5), ("3", 8.0)], ids=["a policy of walk", "a demonstrator"])
def test_a_body_that_cannot_get_up_restarts(tab, body, seconds):
    """On its back, no leg of Queen reaches the ground; a policy of walk does not try to get up."""
    tab.select_option("#body", body)
    tab.evaluate("play.state.play.simulation.data.qpos.set([0, 0, 0.4, 0, 1, 0, 0])")
    advanced(tab, seconds - 0.5)
    assert tab.evaluate("play.state.play.simulation.fell")
    _, _, z, w, *_ = advanced(tab, 1.5)[0]
    assert w > 0.9 and z > 0.7 * ROBOTS["queen"].torso.standing_height


def test_a_gamepad_steers(tab):
    padded(tab, {}, (0.4, -0.8, 0.05, 0))
    forward, left, turn = tab.evaluate("play.inputs.command")
    assert (forward, left, turn) == pytest.approx((0.8 / 1.2, 0.0, -0.4 / 1.2))
    padded(tab, {6: 0.5, 12: 1, 15: 1})
    assert tab.evaluate("play.inputs.pose") == [-0.5, 0, 0, 0, -1, 0]  # a trigger, and the cross
    assert tab.evaluate("play.inputs.command") == [0, -0.5, 0]
    padded(tab, {0: 1})
    tab.wait_for_function("play.kick.start !== null")
    padded(tab, {})
    tab.wait_for_function("Math.hypot(...play.state.play.simulation.data.qvel.subarray(0, 2)) > 0.5")
    padded(tab, {1: 1})
    tab.wait_for_function("play.state.play.simulation.data.qvel.every((value) => value === 0)")
    padded(tab, {}, (-1, -1, 1, 1), mapping="")  # axes of a wheel, whose pedals rest at -1
    assert tab.evaluate("play.inputs.command") == [0, 0, 0] and tab.evaluate("play.inputs.camera") == [0, 0]


def looks(tab):
    """The angle between the directions of the camera and of the heading, rad."""
    return tab.evaluate("Math.sin(play.state.play.chase.look - play.state.play.heading)")


def test_the_camera_stays_behind_until_it_is_turned(tab):
    """A wheel zooms and leaves it behind; a gamepad's stick turns it as a pointer does, and a restart calls it back."""
    assert looks(tab) == pytest.approx(0.0, abs=1e-6)
    tab.keyboard.down("a")
    advanced(tab, 2.0)
    tab.keyboard.up("a")
    assert abs(looks(tab)) > 0.5
    tab.mouse.move(10, 140)
    tab.mouse.wheel(0, 100)
    tab.wait_for_function("play.state.play.chase.dragged === null")
    tab.evaluate("play.state.play.draw(3)")
    assert looks(tab) == pytest.approx(0.0, abs=0.01)
    tab.evaluate("play.state.play.draw(0.5, [1, 0.2])")
    assert looks(tab) == pytest.approx(math.sin(0.5), abs=0.01)
    tab.evaluate("play.state.play.draw(3)")
    assert looks(tab) == pytest.approx(math.sin(0.5), abs=0.01)
    tab.keyboard.press("r")
    tab.evaluate("play.state.play.draw(3)")
    assert looks(tab) == pytest.approx(0.0, abs=0.01)


def test_a_body_that_is_held_does_not_fall_and_then_lands(tab):
    """Even upside down it stays in the hand; let go in the air it lands on bent legs, and rises."""
    height = ROBOTS["tick"].torso.standing_height
    (_, _, rest, *_), _ = advanced(tab, 1.0)
    tab.evaluate("play.state.play.simulation.grab(0, [0, 0, play.state.play.simulation.data.qpos[2]])")
    tab.evaluate(f"play.state.play.simulation.pull.target = [0, 0, {3 * height}]")
    (_, _, held, *_), _ = advanced(tab, 3.0)
    assert held > 2.0 * height
    tab.evaluate("play.state.play.simulation.data.qpos.set([0, 1, 0, 0], 3)")
    advanced(tab, 0.2)
    assert tab.evaluate("play.state.play.simulation.task.fell && !play.state.play.simulation.fell")
    tab.evaluate("play.state.play.simulation.data.qpos.set([1, 0, 0, 0], 3)")
    tab.evaluate("play.state.play.simulation.data.qvel.fill(0); play.state.play.simulation.release()")
    assert tab.evaluate("play.state.play.simulation.landing") == math.inf
    heights = [advanced(tab, 0.05)[0][2] for _ in range(50)]
    assert tab.evaluate("play.state.play.simulation.landing") == 0
    assert min(heights) < 0.8 * rest < 0.9 * rest < heights[-1] and tab.evaluate("!play.state.play.simulation.fell")


def test_an_address_names_body_and_ground(browser, page):
    tab = tabs.new(browser, viewport={"width": 320, "height": 256})
    shown = "window.shown = document.getElementById('loading').checkVisibility()"
    tab.add_init_script(f"document.addEventListener('DOMContentLoaded', () => {{ {shown}; }})")
    tab.goto(f"{page.as_uri()}#walk&body=walker_6x3&ground=bumps")
    tab.wait_for_function("window.play")
    assert tab.evaluate("shown")
    tab.evaluate("play.pause(false)")
    assert not tab.is_visible("#loading") and tab.evaluate("play.inputs.command") != [0, 0, 0]
    assert tab.locator("canvas").get_attribute("aria-label") == "walker_6x3 on bumps ground"
    tab.select_option("#body", "2")
    assert tab.evaluate("location.hash") == "#walk=&body=queen&ground=bumps&mode=free"
    tab.goto("about:blank")
    tab.goto(f"{page.as_uri()}#body=nobody&ground=<b>")
    tab.wait_for_function("window.play")
    assert tab.locator("canvas").get_attribute("aria-label") == "tick on level ground"
    tab.close()


def test_sliders_choose_bodies_by_legs_and_links(browser, tmp_path):
    """By the address, too; where no body has the numbers, the nearest one comes."""
    path = tmp_path / "walkers.html"
    walkers = [play_pages.creature(generator.generate(*counts)) for counts in ((4, 2), (6, 3))]
    path.write_text(play_pages.page([*walkers, walkers[0] | {"counts": None}]), "utf-8")
    tab = tabs.new(browser, viewport={"width": 320, "height": 256})
    name = "play.state.play.body.name"
    tab.goto(f"{path.as_uri()}#legs=6&links=3&ground=bumps")
    tab.wait_for_function("window.play")
    tab.evaluate("play.pause(false)")
    assert tab.evaluate(name) == "walker_6x3" and tab.input_value("#body") == "legs and links"
    assert tab.evaluate("play.state.play.simulation.field !== null")  # heights are those that bodies share
    tab.focus("#legs")
    tab.keyboard.press("Home")
    assert tab.evaluate(name) == "walker_4x2" and tab.locator("output").first.text_content() == "4 legs"
    assert tab.evaluate("location.hash") == "#legs=4&links=3&ground=bumps&body=legs+and+links&mode=free"
    tab.select_option("#body", "2")
    assert not tab.is_visible("#legs") and "legs=" not in tab.evaluate("location.hash")
    tab.close()


def test_steps_leave_prints_and_dust_and_are_heard(tab):
    tab.keyboard.press("m")
    assert tab.text_content("#sound") == "sound"
    tab.click("#sound")
    assert tab.text_content("#sound") == "mute"
    drawn = f"for (let i = 0; i < 90; i++) {{ p.advance(1 / 60, {ASKED}, Infinity); p.pose(); p.walk(1 / 60); }}"
    shown = "[p.traces.prints.count, play.sound.heard, p.traces.grains.filter(({ age, alpha }) => age < 0.8).length]"
    walk = f"(() => {{ const p = play.state.play; {drawn} return {shown}; }})()"
    prints, before, grains = tab.evaluate(walk)
    assert prints == grains == 0  # it stands
    tab.keyboard.down("w")
    prints, heard, grains = tab.evaluate(walk)
    tab.keyboard.up("w")
    assert 6 <= prints <= 30 and heard - before == prints and grains > 8
    spheres = tab.evaluate("play.state.play.spheres.map((sphere) => sphere.toArray())")
    feet = tab.evaluate("play.state.play.steps.feet.map(({ place }) => place)")
    for (*place, radius), foot in zip(spheres[1:], feet, strict=True):
        assert place == foot and foot[2] > 0.9 * ROBOTS["tick"].legs[0].foot.radius and radius > 0
    tab.keyboard.press("r")
    assert tab.evaluate("play.state.play.traces.prints.count") == 0


def lengths(places):
    """How far each place is from the next, m."""
    return [math.dist(first, second) for first, second in itertools.pairwise(places)]


def places_of_round(tab, number):
    """The places of the goals of a round, m."""
    return tab.evaluate(
        """(round) => { const { goals } = play.state.play; goals.begin(round);
        return [0, 1, 2, 3, 4].map((number) => ((goals.number = number), goals.place)); }""",
        number,
    )


def test_goals_are_reached_in_a_time(tab):
    goal = "play.state.play.goals"
    tab.select_option("#mode", "goals")
    places = [[0, 0]]
    while tab.evaluate(f"{goal}.runs"):
        assert tab.evaluate(f"String({goal})").startswith(f"round 1, goal {len(places)} of 5, ")
        places.append(tab.evaluate(f"{goal}.place"))
        tab.evaluate("place => play.state.play.simulation.data.qpos.set(place)", places[-1])
        advanced(tab, 0.1)
    assert len(places) == 6 and min(lengths(places)) > 4.0 * ROBOTS["tick"].torso.standing_height
    assert tab.evaluate(f"String({goal})") == "round 1, 5 goals in 0.5 s, best 0.5 s"
    advanced(tab, 3.1)
    assert tab.evaluate(f"String({goal})").startswith("round 2, goal 1 of 5, ")
    rounds = [places, *([[0, 0], *places_of_round(tab, number)] for number in (2, 3, 4, 5))]
    for second in rounds[1:]:
        assert lengths(second) == pytest.approx(lengths(places))
    assert min(math.dist(*firsts) for firsts in itertools.combinations([way[1] for way in rounds], 2)) > 0.5
    assert tab.evaluate(f"{goal}.begin(2), String({goal})").startswith("round 2, goal 1 of 5, 0.0 s")
    tab.keyboard.press("r")
    assert tab.evaluate(f"String({goal})") == "round 1, goal 1 of 5, 0.0 s, best 0.5 s"
    tab.select_option("#mode", "free")
    assert tab.evaluate(f"String({goal})") == ""
    best = float(tab.evaluate("localStorage.getItem('best time of tick on level ground')"))
    assert best == pytest.approx(0.5, abs=0.02)
    tab.select_option("#mode", "goals")  # as after the page was closed
    assert tab.evaluate(f"String({goal})") == "round 1, goal 1 of 5, 0.0 s, best 0.5 s"
    tab.evaluate("localStorage.clear()")


def other(tab):
    """Where the other body is, and whether it lies."""
    return tab.evaluate("(({ task: { place, fell } }) => [...place, fell])(play.state.play.simulation.minds[1])")


def test_a_rival_comes_and_pushes(tab):
    tab.select_option("#mode", "rival")
    reach = tab.evaluate("play.state.play.body.reach")
    advanced(tab, 0.1)
    assert other(tab)[0] > 2.0 * reach
    advanced(tab, 3.0)
    x, y, _, fell = other(tab)
    (mine_x, mine_y, *_), _ = advanced(tab, 0.05)
    assert math.hypot(x - mine_x, y - mine_y) < 2.2 * reach and not fell
    assert math.hypot(mine_x, mine_y) > 0.05  # it is pushed


def rounds_won(tab, key, rounds, seconds):
    """The numbers of the winners of rounds, and where the player's body was a second before it lost or won.

    Args:
        tab: the page.
        key: key that is held, or None.
        rounds: number of rounds.
        seconds: time in which a round is over.
    """
    if key:
        tab.keyboard.down(key)
    found = tab.evaluate(
        """([rounds, seconds]) => { const { play: now } = play.state, winners = [], places = [];
        for (let before = [0, 0], time = 0; winners.length < rounds; time += 0.5) {
          if (time > seconds) throw new Error(`no winner within ${seconds} s`);
          const { place } = now.simulation.task;
          now.advance(0.5, play.panel.asked(play.inputs.command, play.inputs.pose, play.inputs.runs), Infinity);
          const winner = now.ring.score.findIndex((points, number) => points > before[number]);
          if (winner < 0) continue;
          winners.push(winner); places.push([...place]); before = [...now.ring.score]; time = -0.5;
        } return [winners, places]; }""",
        [rounds, seconds],
    )
    if key:
        tab.keyboard.up(key)
    return found


@pytest.mark.parametrize("body", ["0", "3"], ids=["tick", "queen"])
def test_a_rival_beats_who_does_nothing_or_only_walks_ahead(tab, body):
    """Someone idle loses a point within 40 s; who holds one key does not win all rounds, and rounds differ."""
    tab.select_option("#body", body)
    tab.select_option("#mode", "rival")
    assert rounds_won(tab, None, 1, 40.0)[0] == [1]
    tab.keyboard.press("r")
    winners, places = rounds_won(tab, "w", 3, 40.0)
    assert 1 in winners
    reach = tab.evaluate("play.state.play.body.reach")
    assert min(math.dist(first[:2], second[:2]) for first, second in itertools.combinations(places, 2)) > 0.2 * reach


def test_who_leaves_the_ring_loses_a_point(tab):
    tab.select_option("#mode", "rival")
    score, simulation = "String(play.state.play.ring)", "play.state.play.simulation"
    advanced(tab, 0.2)
    assert tab.evaluate(score) == "you 0, rival 0, 30 s"
    tab.evaluate(f"{simulation}.shares[1]().qpos[1] += 50")
    advanced(tab, 0.2)
    assert tab.evaluate(score).startswith("you win the round: you 1, rival 0, ")
    assert abs(other(tab)[1]) < 0.1  # both start again
    tab.evaluate(f"{simulation}.shares[0]().qpos[1] += 50")
    advanced(tab, 0.2)
    assert tab.evaluate(score).startswith("the rival wins the round: you 1, rival 1, ")
    tab.evaluate("play.state.stale = true")
    tab.wait_for_function("document.getElementById('state').textContent.includes('you 1, rival 1')")
    tab.keyboard.press("r")
    assert tab.evaluate(score) == "you 0, rival 0, 30 s"


def test_a_rival_that_lies_gets_up(tab):
    tab.select_option("#mode", "rival")
    start = 2.5 * tab.evaluate("play.state.play.body.reach")  # within the ring
    tab.evaluate(f"play.state.play.simulation.shares[1]().qpos.set([{start}, 0, 0.1, 0, 1, 0, 0])")
    advanced(tab, 1.0)
    assert other(tab)[-1]
    advanced(tab, 2.0)
    x, y, _, fell = other(tab)
    assert math.hypot(x - start, y) < 1.0 and not fell  # its policy rolls it over


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
    tab = tabs.new(context)
    tab.goto(page.as_uri())
    tab.wait_for_function("window.play")
    tab.evaluate("play.pause(false)")
    found = boxes(tab)
    assert ("stick" in found) is touch
    for left, top, right, bottom in found.values():
        assert left >= 0 and top >= 0 and right <= width and bottom <= height
    for (name, first), (other, second) in itertools.combinations(found.items(), 2):
        apart = first[2] <= second[0] or second[2] <= first[0] or first[3] <= second[1] or second[3] <= first[1]
        assert apart, (name, other)
    if height > 500:  # where there is room, the state is a line or two
        left, top, right, bottom = found["state"]
        assert bottom - top < 60 and (right - left > 0.8 * width or not touch)
    covered = sum((right - left) * (bottom - top) for left, top, right, bottom in found.values())
    assert covered < 0.6 * width * height
    tab.evaluate("document.getElementById('direction').open = true")
    panel = tab.locator("#direction > div").bounding_box()
    assert panel["x"] >= 0 and panel["y"] + panel["height"] <= height
    for control in tab.locator("button, select, input, summary").filter(visible=True).all():
        box = control.bounding_box()
        assert min(box["width"], box["height"]) >= (40 if touch else 24)
        named = control.evaluate("each => (each.labels?.[0] ?? each).textContent.trim()")
        assert named
    tab.evaluate("document.getElementById('direction').open = false")
    if touch:
        box = tab.locator("#stick").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        tab.mouse.move(x, y)
        tab.mouse.down()
        tab.mouse.move(x, y - box["height"] / 2)
        assert tab.evaluate("play.inputs.command") == pytest.approx([1, 0, 0])
        tab.mouse.up()
        assert tab.evaluate("play.inputs.command") == [0, 0, 0]
        for button, aside in (("#left", 0.5), ("#right", -0.5)):
            tab.hover(button)
            tab.mouse.down()
            assert tab.evaluate("play.inputs.command") == [0, aside, 0]
            tab.mouse.up()
        assert tab.evaluate("play.inputs.command") == [0, 0, 0]
    context.close()
