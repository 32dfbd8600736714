"""The page in Chromium: sliders moved, creature changed, command followed, files saved: `make check-studio`."""

import re
import threading
import time

import imports
import mujoco
import numpy as np
import pytest
import tabs

from arc_suite import rotations
from arc_suite.animation import player_controls
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import FILE, RANDOM, Sketch
from arc_suite.bodies import generator, shaping
from arc_suite.robots import gaits
from arc_suite.robots.spec_files import body_from_json, body_to_json

viser = pytest.importorskip("viser", reason="no viser here: make check-studio")
from arc_suite.animation.studio import page as pages  # noqa: E402

_PATIENCE = 0.001 * tabs.PATIENCE  # s

HIGH = generator.generate(6, 2)
HIGH = HIGH.replace(torso=HIGH.torso.replace(standing_height=0.5))


class Served:
    """A session and its page in a thread, with a browser's tab on it."""

    def __init__(self):
        self.session = Session(Sketch(legs=8, links=2))
        self.addresses: list[str] = []
        made = pages.Page

        def kept(*arguments):
            self.page, pages.Page = made(*arguments), made
            return self.page

        pages.Page = kept
        arguments = (self.session, "127.0.0.1", 8180, self.addresses.append)
        self.thread = threading.Thread(target=pages.serve, args=arguments)
        self.thread.start()
        self.until(lambda: self.addresses)

    def until(self, condition):
        end = time.monotonic() + _PATIENCE
        while not condition():
            assert time.monotonic() < end and self.thread.is_alive()
            time.sleep(0.05)

    def close(self):
        self.session.close()
        self.thread.join()


@pytest.fixture(scope="module")
def served():
    made = Served()
    yield made
    made.close()


@pytest.fixture(scope="module")
def tab(browser, served):
    context = browser.new_context(viewport={"width": 1100, "height": 700}, accept_downloads=True)
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab, wrong, asked = tabs.new(context), [], []
    tab.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    tab.on("pageerror", lambda error: wrong.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(served.addresses[0])
    tab.wait_for_selector("#status")
    tab.get_by_text("Fan of the legs").wait_for()
    tab.add_style_tag(content="#webgl-software-rendering { display: none }")  # a note, over the tabs
    yield tab
    assert [line for line in wrong if "preventDefault" not in line] == []  # which viser calls too late in a drag
    at_home = served.addresses[0].partition("?")[0], "data:", "blob:"
    assert {url for url in asked if not url.startswith(at_home)} == set()
    context.close()


def field(tab, label):
    """The line of a widget, by its label."""
    return tab.locator(f"xpath=//label[.='{label}']/ancestor::div[contains(@class, 'Flex-root')][1]")


def press(tab, label, key, times=1):
    thumb = field(tab, label).get_by_role("slider")
    for _ in range(times):
        thumb.press(key)


def choose(tab, label, option):
    field(tab, label).get_by_role("combobox").click()
    tab.get_by_role("option", name=option, exact=True).click()


def press_picture(tab, name):
    tab.get_by_role("button", name=name, exact=True).click()


def open_tab(tab, name):
    tab.get_by_role("tab", name=name, exact=True).click()


def saved(tab, label):
    open_tab(tab, "Files")
    with tab.expect_download() as download:
        tab.get_by_role("button", name=f"Save {label}", exact=True).click()
    return download.value.suggested_filename, download.value.path().read_bytes()


def upload(tab, path, content):
    path.write_bytes(content)
    open_tab(tab, "Body")
    with tab.expect_file_chooser() as chooser:
        tab.get_by_role("button", name="Open a spec or a design").click()
    chooser.value.set_files(path)


def reset(served, tab):
    """Return to the creature with which the page began."""
    open_tab(tab, "Body")
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.sketch == Sketch(legs=8, links=2))


def test_it_listens_on_this_machine_alone_and_never_asks_for_a_public_address(served):
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{22}", served.addresses[0])
    assert pages.Server.request_share_url is not viser.ViserServer.request_share_url


def test_an_address_of_another_machine_is_refused():
    for host in ("192.0.2.1", "no-such-machine.invalid"):
        with pytest.raises(ValueError, match=f"^host {host}: cannot listen there: [^\n]+$"):
            pages.serve(None, host, 8180, print)


def test_a_slider_changes_the_creature(served, tab):
    press(tab, "Legs", "ArrowLeft", 2)
    served.until(lambda: served.session.creature.setup.body == generator.generate(6, 2))
    tab.get_by_text("walker_6x2 stands and can take steps").wait_for()
    press(tab, "lower", "ArrowRight", 4)
    served.until(lambda: served.session.creature.setup.body.name == "walker_6x2_shaped")
    served.until(lambda: dict(served.session.creature.sketch.lengths)["lower"] == pytest.approx(1.2))
    press_picture(tab, "moss")
    served.until(lambda: served.session.creature.setup.body.palette == "moss")
    colors = field(tab, "Colors").get_by_role("textbox")
    served.until(lambda: colors.input_value() == "moss")
    colors.fill("#3a5f2b,#d8c48a")
    served.until(lambda: served.session.creature.setup.body.palette == "#3a5f2b,#d8c48a")
    colors.fill("3a5f2b")
    error = tab.get_by_role("alert").get_by_text("did you mean '#3a5f2b'?")
    error.wait_for()
    edges, edges_of_field = error.bounding_box(), colors.bounding_box()
    assert edges_of_field["y"] > 300.0  # the sheet is scrolled down, and the error is in sight next to it
    assert edges["y"] == 0.0 and 0.0 < edges["x"] + edges["width"] < edges_of_field["x"]
    colors.fill("")
    served.until(lambda: colors.input_value() == "own" and not served.session.error)


def test_a_bad_combination_stands_in_the_page_and_the_creature_walks_on(served, tab):
    before = served.session.creature
    choose(tab, "Layout", "pairs")
    press(tab, "Legs", "ArrowLeft")
    tab.get_by_role("alert").get_by_text("layout: expected radial for an odd number of legs").wait_for()
    assert served.session.creature.setup.body.name == before.setup.body.name
    press(tab, "lower", "ArrowRight")
    choose(tab, "Layout", "own")
    served.until(lambda: served.session.creature.sketch.legs == 5 and not served.session.error)
    assert dict(served.session.creature.sketch.lengths)["lower"] == pytest.approx(1.25)


def test_the_command_is_followed(served, tab):
    open_tab(tab, "Command")
    press(tab, "Turn", "End")
    press(tab, "Forward", "Home")
    served.until(lambda: np.allclose(served.session.velocity, (-1.0, 0.0, 1.0)))
    tab.evaluate("document.activeElement.blur()")  # keys go to the page, and not to a widget
    tab.keyboard.press("i")
    served.until(lambda: np.allclose(served.session.velocity, (-0.75, 0.0, 1.0)))
    served.until(lambda: served.session.episodes.timestep.observation["command"][0] == -0.75)


def test_pose_and_gait_are_followed(served, tab):
    open_tab(tab, "Command")
    press(tab, "Height", "Home")
    low = player_controls.pose_room(served.session.creature.setup.body)[0, 0]
    served.until(lambda: served.session.pose[0] == pytest.approx(low))
    choose(tab, "Gait now", "ripple")
    ripple = gaits.gait(served.session.creature.setup.body, "ripple")
    served.until(lambda: served.session.episodes.timestep.observation["gait"][-2] == pytest.approx(ripple.duty_factor))
    served.until(lambda: served.session.episodes.timestep.observation["pose"][0] == pytest.approx(low))
    frequency = served.session.episodes.timestep.observation["gait"][-1]
    press(tab, "Frequency", "End")
    served.until(lambda: served.session.gait == ("ripple", 1.4))
    faster = pytest.approx(1.4 * frequency, rel=1e-3)
    served.until(lambda: served.session.episodes.timestep.observation["gait"][-1] == faster)
    tab.get_by_role("button", name="Upright").click()
    served.until(lambda: served.session.gait == ("own", 1.0) and not served.session.pose.any())
    open_tab(tab, "Task")
    choose(tab, "Task", "steer")
    open_tab(tab, "Command")
    tab.get_by_text("Gait now").wait_for(state="hidden")
    open_tab(tab, "Task")
    choose(tab, "Task", "directed")


def test_undo_redo_and_reset(served, tab):
    """By keys and by buttons, over changes of body, task and command."""
    open_tab(tab, "Body")
    before = served.session.creature.sketch
    press(tab, "Fan of the legs", "End")
    served.until(lambda: served.session.creature.sketch.fan == 40.0)
    open_tab(tab, "Command")
    press(tab, "Left", "End")
    served.until(lambda: served.session.velocity[1] == 1.0)
    tab.evaluate("document.activeElement.blur()")
    tab.keyboard.press("Control+z")
    served.until(lambda: served.session.velocity[1] == 0.0)
    served.until(lambda: float(field(tab, "Left").get_by_role("slider").get_attribute("aria-valuenow")) == 0.0)
    tab.keyboard.press("Control+z")
    served.until(lambda: served.session.creature.sketch == before)
    tab.keyboard.press("Control+Shift+Z")
    served.until(lambda: served.session.creature.sketch.fan == 40.0)
    tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.sketch == before)
    tab.get_by_role("button", name="Redo").click()
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.sketch == Sketch(legs=8, links=2))
    served.until(lambda: served.session.velocity.tolist() == [1.0, 0.0, 0.0])
    open_tab(tab, "Body")
    served.until(lambda: field(tab, "Legs").get_by_role("textbox").input_value() == "8")
    for _ in range(2):
        tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.sketch == before)


def seen(view, camera, name=None):
    """Where the origins of a creature's parts are in the picture: shares of the way from its middle to its edges.

    Args:
        view: of the page.
        camera: of a visitor.
        name: of the part whose end is meant, if one is.
    """
    figure, places, turns = view._figure, {None: np.zeros(3)}, {None: np.eye(3)}
    for index, (part, frame) in enumerate(zip(figure.creature.parts, figure._frames, strict=True)):
        places[index] = places[part.parent] + turns[part.parent] @ frame.position
        turns[index] = turns[part.parent] @ rotations.matrix(np.array(frame.wxyz))
    points = [places[index] for index in range(len(figure.creature.parts))]
    if name is not None:
        (index,) = (index for index, part in enumerate(figure.creature.parts) if part.name == name)
        end = np.array(shaping.link_ends(figure.creature.setup.body)[name]) / figure._unit
        points = [places[index] + turns[index] @ end]
    x, y, z = ((np.array(points) + view._world.position - camera.position) @ rotations.matrix(camera.wxyz)).T
    high = np.tan(0.5 * camera.fov)
    return np.stack([x / (z * high * camera.aspect), y / (z * high)], axis=-1)


def drawn(client):
    """Wait until a browser has drawn all that it was sent before."""
    client.get_render(height=8, width=8, timeout=_PATIENCE)


@pytest.mark.parametrize("source", ["queen", "tick", "millipede"])
def test_the_camera_has_any_creature_of_any_size_in_its_picture(served, tab, source):
    """Feet at the size that the slider has at most, where visitors see them."""
    view, sketch = served.page._view, Sketch(source=source, scale=4.0)
    (client,) = view._server.get_clients().values()
    served.session.ask(sketch)
    served.until(lambda: view._figure.creature.sketch == sketch)
    shares = seen(view, client.camera)  # of the way from the middle to the edges
    assert 0.3 < abs(shares).max() < 1.0


def test_the_creature_has_two_thirds_of_the_window_until_charts_are_shown(served, tab):
    picture = tab.locator("canvas").first
    assert picture.bounding_box()["width"] > 2.0 / 3.0 * 1100
    assert not tab.get_by_text("Reward by term").is_visible()
    tab.get_by_role("checkbox", name="Charts").click()
    tab.get_by_text("Reward by term").wait_for()
    assert not tab.get_by_text("healthy", exact=True).is_visible()
    tab.get_by_role("checkbox", name="Charts").click()
    tab.get_by_text("Reward by term").wait_for(state="hidden")


def test_bodies_are_chosen_by_their_pictures(served, tab, monkeypatch):
    open_tab(tab, "Body")
    tab.get_by_role("button", name="Reset").click()
    press_picture(tab, "queen")
    served.until(lambda: served.session.creature.setup.body.name == "queen")
    for name in ("queen", "starfish", "moss"):  # the last one is a palette
        button = tab.get_by_role("button", name=name, exact=True)
        served.until(lambda button=button: button.evaluate("each => getComputedStyle(each).backgroundImage") != "none")
    press(tab, "Size", "ArrowRight")
    monkeypatch.setattr(pages.random, "randint", lambda low, high: high)  # which colors can be drawn of, too
    tab.get_by_role("button", name="Random body").click()
    served.until(lambda: served.session.creature.sketch.source == RANDOM)
    sketch = served.session.creature.sketch
    assert sketch.palette == str(sketch.seed) and sketch.scale == 1.0
    tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.setup.body.name == "queen_shaped")


def test_a_saved_creature_comes_back(served, tab):
    open_tab(tab, "Body")
    tab.get_by_role("button", name="Reset").click()
    press_picture(tab, "spider")
    served.until(lambda: served.session.creature.setup.body.name == "spider")
    name, _ = saved(tab, "Spec")
    open_tab(tab, "Body")
    press_picture(tab, "crab")
    served.until(lambda: served.session.creature.setup.body.name == "crab")
    saved(tab, "Design")
    press_picture(tab, f"1 {name}")
    served.until(lambda: served.session.creature.setup.body.name == "spider")
    press_picture(tab, "2 crab_design.json")
    served.until(lambda: served.session.creature.setup.body.name == "crab")


def test_one_leg_and_the_leg_across(served, tab):
    reset(served, tab)
    choose(tab, "Legs to change", "l1")
    press(tab, "l1_lower", "ArrowRight", 4)
    served.until(
        lambda: sketches.length_factor(served.session.creature.sketch, "r1_lower") == pytest.approx(1.2, rel=1e-3)
    )
    tab.get_by_role("checkbox", name="Symmetric").click()
    press(tab, "l1_lower", "ArrowRight", 2)
    served.until(
        lambda: sketches.length_factor(served.session.creature.sketch, "l1_lower") == pytest.approx(1.3, rel=1e-3)
    )
    assert sketches.length_factor(served.session.creature.sketch, "r1_lower") == pytest.approx(1.2, rel=1e-3)
    tab.get_by_role("checkbox", name="Symmetric").click()
    choose(tab, "Legs to change", "all")
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.sketch == Sketch(legs=8, links=2))


def test_a_joint_is_dragged(served, tab):
    """A foot to the right of the picture, and the one across with it."""
    view = served.page._view
    (client,) = view._server.get_clients().values()
    tab.get_by_role("checkbox", name="Drag joints").click()
    served.until(lambda: served.session.paused and served.session.episodes.steps == 0 and view._figure._balls)
    drawn(client)
    box = tab.locator("canvas").first.bounding_box()
    unit, (place,) = view._unit, seen(view, client.camera, "r2_lower")
    x, y = box["x"] + 0.5 * (1.0 + place[0]) * box["width"], box["y"] + 0.5 * (1.0 + place[1]) * box["height"]
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 12.0, y, steps=4)
    drawn(client)
    tab.mouse.up()
    served.until(lambda: len(served.session.creature.sketch.ends) == 2)
    ends = dict(served.session.creature.sketch.ends)
    x, y, z = ends["r2_lower"]
    assert ends["l2_lower"] == (x, -y, z)
    own = shaping.link_ends(generator.generate(8, 2))["r2_lower"]
    pixel = 2.0 * np.linalg.norm(client.camera.position) * np.tan(0.5 * client.camera.fov) / box["height"]  # units
    moved = np.linalg.norm(np.subtract(ends["r2_lower"], own)) / unit
    assert moved == pytest.approx(12.0 * pixel, rel=0.4)  # a foot is nearer than the middle of the body
    tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.sketch.ends == ())
    tab.get_by_role("checkbox", name="Drag joints").click()
    served.until(lambda: not served.session.paused and not view._figure._balls)


def test_a_kept_creature_walks_next_to(served, tab):
    view = served.page._view
    tab.get_by_role("checkbox", name="Keep").click()
    served.until(lambda: view._companion)
    press(tab, "Size", "End")
    served.until(lambda: view._figure.creature.sketch.scale == 4.0)
    assert view._companion.creature.sketch.scale == 1.0
    tab.get_by_text("kept").wait_for()
    lane = 0.9 * (view._figure.creature.reach + view._companion.creature.reach)

    def apart():
        return (view._companion._frames[0].position - view._figure._frames[0].position)[:2] * view._unit

    served.until(lambda: 0.0 < np.linalg.norm(apart() - (0.0, lane)) < lane)
    tab.get_by_role("checkbox", name="Keep").click()
    tab.get_by_role("button", name="Undo").click()
    served.until(lambda: view._companion is None and view._figure.creature.sketch.scale == 1.0)


def test_a_design_is_opened_again(served, tab, tmp_path):
    """Body, task and command as they were saved, after everything else was changed."""
    open_tab(tab, "Body")
    press(tab, "Fan of the legs", "ArrowRight", 3)
    open_tab(tab, "Command")
    press(tab, "Turn", "End")
    served.until(lambda: served.session.creature.sketch.fan == 3.0)
    name, content = saved(tab, "Design")
    assert name == "walker_8x2_shaped_design.json"
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.sketch.fan == 0.0)
    upload(tab, tmp_path / name, content)
    served.until(lambda: served.session.creature.sketch.fan == 3.0 and served.session.velocity[2] == 1.0)
    upload(tab, tmp_path / "bad.json", content.replace(b'"fan": 3.0', b'"policy": "file.py:make"'))
    tab.get_by_role("alert").get_by_text("unknown policy 'file.py:make'").wait_for()
    assert served.session.creature.sketch.fan == 3.0
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.sketch.fan == 0.0 and not served.session.error)


def test_what_has_no_effect_is_not_shown(served, tab):
    open_tab(tab, "Task")
    tab.get_by_text("Ground", exact=True).wait_for()
    choose(tab, "Task", "stairs")  # which has its own
    tab.get_by_text("Ground", exact=True).wait_for(state="hidden")
    choose(tab, "Policy", "zero")
    tab.get_by_text("Preset", exact=True).wait_for(state="hidden")
    open_tab(tab, "Command")
    tab.get_by_text("Forward", exact=True).wait_for()
    tab.get_by_role("checkbox", name="By hand").click()
    tab.get_by_text("Forward", exact=True).wait_for(state="hidden")
    tab.get_by_role("button", name="Reset").click()
    tab.get_by_text("Forward", exact=True).wait_for()
    tab.get_by_text("Frequency", exact=True).wait_for()


def test_tasks_and_grounds(served, tab):
    open_tab(tab, "Task")
    choose(tab, "Ground", "bumps")
    served.until(lambda: served.session.creature.setup.task_kwargs.get("arena") == "bumps")
    choose(tab, "Task", "navigate")
    served.until(lambda: served.session.creature.setup.task == "navigate")
    choose(tab, "Task", "directed")
    choose(tab, "Ground", "flat")
    served.until(lambda: served.session.creature.setup.task_kwargs == {})


def test_an_uploaded_body_and_the_value_that_fits(served, tab, tmp_path):
    upload(tab, tmp_path / "high.json", body_to_json(HIGH).encode())
    served.until(lambda: served.session.creature.setup.body == HIGH)
    assert served.session.creature.sketch.source == FILE
    tab.get_by_text("feet hang 0.1 m above the floor: standing_height 0.4 fits").wait_for()
    tab.get_by_role("button", name="Apply: standing_height 0.4 fits").click()
    served.until(lambda: served.session.creature.setup.body.torso.standing_height == 0.4)
    tab.get_by_text("walker_6x2 stands and can take steps").wait_for()


def test_an_imported_robot_changes_its_size_and_its_links(served, tab, tmp_path):
    """By sliders and by a drag; what has no effect is hidden, and undo, reset and files follow."""
    upload(tab, tmp_path / "robot.json", body_to_json(imports.quadruped()).encode())
    served.until(lambda: served.session.creature.setup.body == imports.quadruped())
    tab.get_by_text("Torso length", exact=True).wait_for(state="hidden")
    for hidden in ("Torso width", "Fan of the legs", "Head"):
        assert not tab.get_by_text(hidden, exact=True).is_visible()
    press(tab, "link3", "ArrowRight", 4)
    served.until(lambda: dict(served.session.creature.sketch.lengths).get("link3") == pytest.approx(1.2))
    longer = served.session.creature.sketch
    press(tab, "Size", "End")
    served.until(lambda: served.session.creature.sketch.scale == 4.0)
    body = served.session.creature.setup.body
    assert body == shaping.shaped(imports.quadruped(), links={"link3": 1.2}, scale=4.0)
    served.until(lambda: served.session.episodes.steps > 20)  # it walks
    name, content = saved(tab, "Spec")
    assert name == "quadruped_15_kg_shaped.json" and body_from_json(content) == body
    tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.sketch == longer)
    tab.get_by_role("button", name="Reset").click()
    served.until(lambda: served.session.creature.setup.body.source is None)
    for _ in range(3):
        tab.get_by_role("button", name="Undo").click()
    served.until(lambda: served.session.creature.setup.body == imports.quadruped())


def test_files_are_saved(served, tab):
    reset(served, tab)
    name, content = saved(tab, "Spec")
    assert name == "walker_8x2.json" and body_from_json(content) == served.session.creature.setup.body
    name, content = saved(tab, "MJCF")
    assert name == "walker_8x2.xml" and mujoco.MjModel.from_xml_string(content.decode()).nu == 16
    name, content = saved(tab, "Picture")
    assert name == "walker_8x2.png" and content.startswith(b"\x89PNG")


def test_lines_are_copied(served, tab):
    reset(served, tab)
    open_tab(tab, "Files")
    tab.get_by_role("button", name="Copy command").click()
    line = tab.evaluate("navigator.clipboard.readText()")
    assert line == "arc-suite view --legs 8 --links 2 --task directed"


def test_another_visitor_sees_the_same_creature(served, tab):
    reset(served, tab)
    served.session.pause(True)
    other = tabs.new(tab.context)
    other.goto(served.addresses[0])
    other.get_by_text("walker_8x2 stands and can take steps").wait_for()
    other.close()
    served.session.pause(False)
    steps = served.session.episodes.steps
    served.until(lambda: served.session.episodes.steps > steps)


def test_a_phone_has_controls_for_fingers(served, tab):
    """A sheet as wide as the window and a third as high, and nothing to press that is too small."""
    page = served.page
    context = tab.context.browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    phone = tabs.new(context)
    phone.goto(served.addresses[0])
    undo = phone.get_by_role("button", name="Undo", exact=True)
    undo.wait_for()
    assert undo.bounding_box()["height"] >= 40.0
    sheet = undo.locator("xpath=ancestor::div[contains(@class, 'Paper-root')][1]").bounding_box()
    assert sheet["width"] == 390.0 and sheet["height"] < 0.35 * 844
    served.until(lambda: any(client.camera.look_at[2] < -1.0 for client in page._server.get_clients().values()))
    phone.set_viewport_size({"width": 844, "height": 390})  # it is turned
    served.until(lambda: all(client.camera.look_at[2] > 0.0 for client in page._server.get_clients().values()))
    served.until(lambda: phone.locator("canvas").first.bounding_box()["width"] > 0.66 * 844)
    context.close()


# Returns once the page has shown that the studio runs in so many seconds.
_BEATS = """(count) => {
  const beats = window.beats ??= new Set();
  beats.add(document.getElementById("status").dataset.beat);
  return beats.size > count;
}"""


def test_a_page_says_when_the_studio_has_stopped(browser):
    ending = Served()
    tab = tabs.new(browser, viewport={"width": 320, "height": 256})  # which is drawn soon
    tab.goto(ending.addresses[0])
    tab.wait_for_selector("#status")
    note = tab.get_by_text("The studio has stopped. Start it again")
    ending.session.pause(True)
    tab.wait_for_function(_BEATS, arg=10)
    note.wait_for(state="hidden")  # time stands still, and the studio runs
    ending.close()
    note.wait_for()
    tab.close()
