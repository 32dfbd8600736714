"""Pictures of states: drawn without a simulation, and the same as of one."""

import copy
import pickle

import imports
import mujoco
import numpy as np
import pytest
from fixtures.obstacles import Obstacle
from numpy.testing import assert_array_equal
from tiers import never, tiers

import arc_suite
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.bodies import generator
from arc_suite.markers import Marker
from arc_suite.models.outline import torso_box
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Visuals
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import MATERIALS
from arc_suite.simulation.model import compile_model
from arc_suite.simulation.physics import Physics
from arc_suite.simulation.pictures import QUALITIES, Decorated, check_camera, picture

BODY = ROBOTS["queen"]


@pytest.mark.parametrize("share", tiers([None, 0.1], never, lambda share: share is None))
@pytest.mark.parametrize("arena", ARENAS)
def test_a_state_looks_like_the_simulation_in_it(arena, share):
    arena = ARENAS[arena](BODY)
    physics = Physics.from_body(BODY, arena)
    physics.step(50)
    physics.shown_reward = share
    qpos = physics.position().copy()
    for depth in (False, True):
        drawn = picture(BODY, arena, qpos, 60, 80, "profile", share, depth=depth)
        assert_array_equal(drawn, physics.render(60, 80, "profile", depth=depth))
        assert drawn.std() > 0.1


@pytest.mark.slow
def test_the_ground_and_the_reward_are_seen():
    qpos = compile_model(BODY).qpos0
    views = [picture(BODY, arena(BODY), qpos, 60, 80, "tracking") for arena in ARENAS.values()]
    views.append(picture(BODY, FLAT, qpos, 60, 80, "tracking", share=0.0))
    for index, view in enumerate(views[1:], 1):
        assert not np.array_equal(view, views[index - 1])


@pytest.mark.slow
def test_obstacles_are_seen_where_they_stand():
    def drawn(*place):
        return picture(BODY, Obstacle(), qpos, 60, 80, "tracking", mocap_pos=np.array([place]))

    qpos = compile_model(BODY, Obstacle()).qpos0
    near, far = drawn(0.0, 2.0, 0.5), drawn(90.0, 90.0, 0.5)
    assert not np.array_equal(near, far)
    assert_array_equal(drawn(0.0, 2.0, 0.5), near)
    physics = Physics.from_body(BODY, Obstacle())
    physics.data.mocap_pos[:] = (0.0, 2.0, 0.5)
    assert_array_equal(physics.render(60, 80), near)


def test_marks_are_seen_and_have_no_depth():
    qpos = compile_model(BODY).qpos0
    foot, way = np.array([0.0, 0.0, 1.2]), np.array([0.0, 0.8, 0.0])
    views = {None: picture(BODY, FLAT, qpos, 60, 80, "tracking")}
    for shape in ("arrow", "cylinder"):
        marks = [Marker(shape, foot, foot + way, 0.1, (1.0, 0.0, 0.0, 1.0))]
        views[shape] = picture(BODY, FLAT, qpos, 60, 80, "tracking", markers=marks)
        red = (views[shape].astype(int) - views[None]).max(axis=(0, 1))
        assert red[0] > 50 and (views[shape] != views[None]).any(axis=-1).mean() < 0.2
        depths = [picture(BODY, FLAT, qpos, 60, 80, "tracking", depth=True, markers=shown) for shown in (marks, ())]
        assert_array_equal(*depths)
    assert not np.array_equal(views["arrow"], views["cylinder"])
    assert_array_equal(picture(BODY, FLAT, qpos, 60, 80, "tracking"), views[None])


def test_an_arrow_ends_at_its_tip():
    """MuJoCo draws one half as long as a cylinder between the same ends; here they are as long."""
    qpos, foot, way = compile_model(BODY).qpos0, np.array([-1.0, 0.0, 1.2]), np.array([2.0, 0.0, 0.0])
    plain, widths = picture(BODY, FLAT, qpos, 120, 160, "tracking"), {}
    for shape in ("arrow", "cylinder"):
        marker = Marker(shape, foot, foot + way, 0.05, (1.0, 0.0, 0.0, 1.0))
        drawn = picture(BODY, FLAT, qpos, 120, 160, "tracking", markers=[marker]).astype(int)
        widths[shape] = np.ptp(np.flatnonzero(((drawn - plain)[..., 0] > 50).any(axis=0)))
    assert widths["cylinder"] > 15
    assert abs(widths["arrow"] - widths["cylinder"]) <= 3


def test_a_limp_leg_is_dark():
    qpos = compile_model(BODY).qpos0
    plain, dark = (
        picture(BODY, FLAT, qpos, 120, 160, "profile", failed_legs=failed_legs).astype(int)
        for failed_legs in ((), ("r2",))
    )
    changed = (plain != dark).any(axis=-1)
    assert 0.01 < changed.mean() < 0.2
    assert dark[changed].mean() < 0.5 * plain[changed].mean()
    assert_array_equal(picture(BODY, FLAT, qpos, 120, 160, "profile"), plain)
    decorated = Decorated.from_body(BODY)
    decorated.pose(qpos, failed_legs=("r2",))
    colors = {name: decorated.named.model.geom_rgba[name] for name in ("r2_foot", "l2_foot")}
    assert colors["r2_foot"][:3].max() < 0.1 < colors["l2_foot"][:3].min()
    decorated.pose(qpos)
    assert decorated.named.model.geom_rgba["r2_foot"][:3].min() > 0.1


def test_cameras_are_checked_on_a_model():
    model = compile_model(BODY)
    for camera in ("tracking", "portrait", "profile", 0, 2, -1):
        check_camera(model, camera)
    with pytest.raises(ValueError, match=r"^no camera 4: "):
        picture(BODY, FLAT, model.qpos0, 60, 80, 4)


def test_a_placed_camera_shows_the_decorated_body_and_does_not_move():
    """A user's `MjvCamera` is drawn as dm_control draws the free camera, and as the model's own by their numbers."""
    physics = Physics.from_body(BODY, ARENAS["bumps"](BODY))
    physics.forward()
    free = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(Decorated.from_body(BODY, physics.arena).model.ptr, free)
    assert_array_equal(physics.render(60, 80, free), physics.render(60, 80, -1))
    free.lookat, free.distance, free.azimuth, free.elevation = (0.0, 0.0, 0.5), 3.0, 120.0, -20.0
    placed = physics.render(60, 80, free)
    assert_array_equal(physics.render(60, 80, free), placed)
    assert (placed != physics.render(60, 80, -1)).any(axis=-1).mean() > 0.3
    assert (physics.render(60, 80, free, depth=True) < 5.0).mean() > 0.1
    tracking = mujoco.MjvCamera()
    tracking.type, tracking.trackbodyid = mujoco.mjtCamera.mjCAMERA_TRACKING, physics.model.body("torso").id
    physics.render(60, 80, tracking)
    assert_array_equal(tracking.lookat, np.zeros(3))
    fixed = mujoco.MjvCamera()
    fixed.type, fixed.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, physics.model.camera("profile").id
    assert_array_equal(physics.render(60, 80, fixed), physics.render(60, 80, "profile"))


@pytest.mark.parametrize(
    ("kind", "field", "message"),
    [
        ("TRACKING", "trackbodyid", "trackbodyid of the camera: expected an integer from 0 to 25, got 99"),
        ("FIXED", "fixedcamid", "fixedcamid of the camera: expected an integer from 0 to 3, got 99"),
        ("USER", "distance", "type of the camera: expected mjCAMERA_FREE, mjCAMERA_TRACKING or mjCAMERA_FIXED, got 3"),
    ],
)
def test_placed_cameras_of_no_part_or_kind_are_refused(kind, field, message):
    camera = mujoco.MjvCamera()
    camera.type = getattr(mujoco.mjtCamera, f"mjCAMERA_{kind}")
    setattr(camera, field, 99)
    with pytest.raises(ValueError, match=f"^{message}$"):
        Physics.from_body(BODY).render(60, 80, camera)


@pytest.mark.parametrize(
    "body", [*ROBOTS.values(), imports.quadruped(), generator.random_body(3)], ids=lambda body: body.name
)
def test_the_eye_looks_ahead_from_the_torso_s_front_and_nothing_is_before_it(body):
    physics, half = Physics.from_body(body), np.radians(35.0)
    physics.forward()
    height, front = body.torso.standing_height, torso_box(body)[1][0]
    torso, eye = physics.named.data.xpos["torso"], physics.named.data.cam_xpos["eye"]
    ahead = -physics.named.data.cam_xmat["eye"].reshape(3, 3)[:, 2]
    np.testing.assert_allclose(ahead, (np.cos(np.radians(15.0)), 0.0, -np.sin(np.radians(15.0))), atol=1e-6)
    assert (eye - torso)[0] == pytest.approx(front, abs=1e-6) and abs((eye - torso)[1]) < 0.1 * height
    depth = physics.render(64, 64, "eye", depth=True)
    ground = eye[2] * np.cos(half) / np.sin(half + np.radians(15.0))  # along the axis, at the lower edge
    assert np.median(depth[-1]) == pytest.approx(ground, rel=0.03)
    assert depth[0].max() > 20.0 * height  # the sky


def test_the_eye_sees_neither_markers_nor_failed_legs():
    qpos = compile_model(BODY).qpos0
    mark = Marker("arrow", qpos[:3] + (2.0, -1.0, 0.0), qpos[:3] + (2.0, 1.0, 0.0), 0.2, (1.0, 0.0, 0.0, 1.0))
    shown = {"markers": [mark], "failed_legs": [BODY.legs[0].name], "share": 0.1}
    plain = picture(BODY, FLAT, qpos, 64, 64, "eye")
    assert_array_equal(picture(BODY, FLAT, qpos, 64, 64, "eye", **shown), plain)
    assert not np.array_equal(picture(BODY, FLAT, qpos, 64, 64, "eye", quality="fast", **shown), plain)


def test_qualities_show_the_same_in_finer_pixels():
    """A still is the mean of a film's picture of twice its size; pictures of depth are not averaged."""
    physics = Physics.from_body(ROBOTS["tick"])
    physics.forward()
    sense, fast, film, still = (physics.render(90, 120, "portrait", quality=name) for name in QUALITIES)
    assert 0.0 < abs(sense.astype(int) - fast).mean() < 12.0  # no ornaments
    assert_array_equal(physics.render(90, 120, "portrait"), fast)
    assert (fast != film).any() and abs(fast.astype(int) - film).mean() < 2.0  # edges of shadows alone
    double = physics.render(180, 240, "portrait", quality="film").astype(float)
    mean = (double[::2, ::2] + double[1::2, ::2] + double[::2, 1::2] + double[1::2, 1::2]) / 4.0
    np.testing.assert_allclose(still, mean, atol=1.0)
    depths = [physics.render(90, 120, "portrait", depth=True, quality=name) for name in ("film", "still")]
    assert_array_equal(*depths)
    with pytest.raises(ValueError, match="^unknown quality 'fine'"):
        physics.render(90, 120, quality="fine")


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda environment: pickle.loads(pickle.dumps(environment))])
def test_copies_of_environments_look_like_them(copied):
    environment = arc_suite.load("queen", "limp", {"random": 0}, visualize_reward=True)
    environment.reset()
    for _ in range(45):
        environment.step(np.zeros(18))
    twin = copied(environment)
    assert twin.physics.failed_legs() == environment.physics.failed_legs() != ()
    assert twin.physics.shown_reward == environment.physics.shown_reward > 0.0
    np.testing.assert_array_equal(twin.physics.render(120, 160), environment.physics.render(120, 160))


def test_a_restored_environment_shows_arrows_and_failed_legs_before_its_first_step():
    environment = arc_suite.load("queen", "limp", {"random": 0})
    environment.reset()
    for _ in range(45):
        environment.step(np.zeros(18))
    other = arc_suite.load("queen", "limp")
    other.restore(environment.snapshot())
    np.testing.assert_array_equal(other.physics.render(120, 160), environment.physics.render(120, 160))


def test_pictures_show_the_visuals_that_were_registered_last(monkeypatch):
    body = generator.generate(4, 2).replace(name="painted")
    model = compile_model(body, FLAT)
    greens = []
    for green in (0.0, 1.0):
        colors = dict.fromkeys(MATERIALS, (1.0 - green, green, 0.0))
        monkeypatch.setitem(VISUALS, body.name, Visuals(colors))
        pixels = picture(body, FLAT, model.qpos0, 60, 80, "portrait").astype(int)
        greens.append((pixels[..., 1] > pixels[..., 0] + 50).sum())
    assert greens[0] < 20 < 200 < greens[1]
