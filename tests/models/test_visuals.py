"""Looks: they show, and they change nothing."""

import mujoco
import numpy as np
import pytest
from episodes import begun
from tiers import tiers

import arc_suite
from arc_suite import models, registry
from arc_suite.models import visuals
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import MATERIALS, Solid
from arc_suite.robots.spec_files import body_from_json, body_to_json

# A body that has no visuals of its own: Tick's legs, four of them askew, under a lying capsule.
_TICK = ROBOTS["tick"]
STRANGER = _TICK.replace(
    name="stranger",
    torso=_TICK.torso.replace(
        solids=(Solid(name="tube", shape="capsule", size=(0.06, 0.1), euler_deg=(0.0, 90.0, 20.0)),)
    ),
    legs=tuple(leg for leg in _TICK.legs if leg.name != "r2"),
)
BODIES = [*ROBOTS.values(), STRANGER]
# What may differ on bodies and joints: where their geoms are listed, and a length scale that only sleeping reads.
LAYOUT = {"body_geomnum", "body_geomadr", "body_bvhadr", "body_bvhnum", "dof_length"}
FEW = ("bastion", "stranger", "hound")  # in `make check`
HOUND = registry.body_of("hound")  # with a long tail that is drawn


def is_in_check(body) -> bool:
    """Return whether tests of a body are in `make check`."""
    return body.name in FEW


every_body = pytest.mark.parametrize("body", tiers(BODIES, is_in_check), ids=lambda body: body.name)
every_robot = pytest.mark.parametrize("robot", tiers(ROBOTS, lambda robot: robot in FEW))


def compiled(body, decorated):
    return mujoco.MjModel.from_xml_string(models.assemble(body, decorated=decorated).to_xml_string())


@every_body
def test_visuals_keep_every_array_of_the_dynamics(body):
    plain, shown = compiled(body, False), compiled(body, True)
    names = [name for name in dir(plain) if name.startswith(("body_", "jnt_", "dof_", "actuator_", "sensor_", "qpos"))]
    for name in set(names) - LAYOUT:
        if isinstance(getattr(plain, name), np.ndarray):
            np.testing.assert_array_equal(getattr(shown, name), getattr(plain, name), err_msg=name)
    same = [shown.geom(plain.geom(i).name).id for i in range(plain.ngeom)]
    for name in ("type", "contype", "conaffinity", "condim", "friction", "margin", "size", "pos", "quat", "bodyid"):
        np.testing.assert_array_equal(getattr(shown, f"geom_{name}")[same], getattr(plain, f"geom_{name}"), name)
    added = sorted(set(range(shown.ngeom)) - set(same))
    assert added
    assert not shown.geom_contype[added].any()
    assert not shown.geom_conaffinity[added].any()
    assert set(shown.geom_group[added]) == {visuals.GROUP}
    assert visuals.GROUP not in shown.geom_group[same]


@every_body
def test_a_body_without_ornaments_has_bare_legs_and_solids(body):
    bare_body = body.replace(ornaments=False)
    plain, shown, bare = compiled(body, False), compiled(body, True), compiled(bare_body, True)

    def names_on_torso(model):
        torso = model.body("torso").id
        return {model.geom(index).name for index in np.flatnonzero(model.geom_bodyid == torso)}

    assert names_on_torso(bare) == names_on_torso(plain) < names_on_torso(shown)
    geoms_of_legs = {shown.geom(index).name for index in range(shown.ngeom)} - names_on_torso(shown)
    assert geoms_of_legs == {bare.geom(index).name for index in range(bare.ngeom)} - names_on_torso(bare)
    assert visuals.bones(bare_body) == [] and visuals.geoms_of_bones(bare_body) == {}
    assert visuals.bones(body) != [] or body.name == "stranger"
    assert body_from_json(body_to_json(bare_body)) == bare_body


@pytest.mark.parametrize(
    ("tail", "goes"),
    [
        (Solid(name="tail", shape="capsule", size=(0.02, 0.15), position=(-0.3, 0.0, 0.1), euler_deg=(0, -60, 0)), -1),
        (Solid(name="fin", shape="box", size=(0.1, 0.01, 0.05), position=(-0.25, 0.0, 0.0)), -1),
        (Solid(name="mast", shape="cylinder", size=(0.02, 0.15), position=(-0.3, 0.0, 0.15)), 0),
    ],
)
def test_a_tail_goes_on_from_the_rearmost_solid(tail, goes):
    """As its end does, from a place inside of it."""
    body = _TICK.replace(name="tailed", torso=_TICK.torso.replace(solids=(*_TICK.torso.solids, tail)))
    (bone,) = visuals.bones(body)
    model = compiled(body, False)
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom(tail.name).quat)
    inside = (np.array(bone.pivot) - tail.position) @ rotation.reshape(3, 3)
    extents = tail.size if tail.shape == "box" else (tail.size[0], tail.size[0], tail.size[1] + tail.size[0])
    assert (abs(inside) <= np.array(extents) + 1e-9).all()
    assert np.sign(round(bone.tip[0] - bone.pivot[0], 9)) == goes


@every_body
def test_everything_that_visuals_add_is_named(body):
    model = compiled(body, True)
    for kind, count in (("geom", "ngeom"), ("light", "nlight"), ("camera", "ncam"), ("mat", "nmat"), ("tex", "ntex")):
        assert all(getattr(model, kind)(i).name for i in range(getattr(model, count))), kind
    assert (model.geom_matid >= 0).all()
    assert (model.geom_matid == model.mat("glow").id).any()


def test_ornaments_of_a_pair_mirror_each_other():
    model = compiled(ROBOTS["queen"], True)
    left, right = model.geom("visual-vent"), model.geom("visual-vent_right")
    np.testing.assert_allclose(right.pos, left.pos * (1, -1, 1), rtol=1e-12)
    turn = [np.empty(9), np.empty(9)]
    for geom, matrix in zip((left, right), turn, strict=True):
        mujoco.mju_quat2Mat(matrix, geom.quat)
    reflection = np.diag((1.0, -1.0, 1.0))
    np.testing.assert_allclose(turn[1].reshape(3, 3), reflection @ turn[0].reshape(3, 3) @ reflection, atol=1e-12)


@pytest.mark.parametrize("body", tiers([*BODIES, HOUND], is_in_check), ids=lambda body: body.name)
@pytest.mark.parametrize("camera", ["portrait", pytest.param("profile", marks=pytest.mark.slow)])
def test_near_cameras_frame_the_standing_body(body, camera):
    """Seen by segmentation, the body touches no edge of a 4:3 picture, yet fills most of its width or height."""
    environment = arc_suite.simulation.physics.Physics.from_body(body)
    environment.forward()
    kinds = environment.render(120, 160, camera, segmentation=True)
    model = environment.decorated_pose().model
    geoms = [model.geom(i).name for i in range(model.ngeom)]
    seen = (kinds[..., 1] == mujoco.mjtObj.mjOBJ_GEOM) & (kinds[..., 0] != geoms.index("floor"))
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    assert min(rows[0], columns[0], 119 - rows[-1], 159 - columns[-1]) > 0
    assert max(np.ptp(rows) / 120, np.ptp(columns) / 160) > 0.65
    environment.free()


@every_robot
def test_pictures_show_something_and_differ_by_camera(robot):
    environment = begun(robot)
    pictures = [environment.physics.render(90, 120, camera) for camera in ("tracking", "portrait", "profile")]
    for i, picture in enumerate(pictures):
        assert (picture.shape, picture.dtype) == ((90, 120, 3), np.uint8)
        assert picture.std() > 10.0
        assert (picture == 255).mean() < 0.02  # hardly anything is over-exposed
        assert not any(np.array_equal(picture, other) for other in pictures[:i])
    environment.close()


def glow_in(physics) -> np.ndarray:
    return physics.decorated_pose().model.mat("glow").rgba.copy()


@pytest.mark.slow
@every_robot
def test_visualize_reward_colors_the_glow(robot):
    plain, shown = begun(robot), arc_suite.load(robot, "walk", {"random": 0}, visualize_reward=True)
    shown.reset()
    own = compiled(ROBOTS[robot], True).mat("glow").rgba
    np.testing.assert_array_equal(glow_in(plain.physics), own)
    np.testing.assert_array_equal(glow_in(shown.physics), own)
    action = np.zeros(plain.action_spec().shape)
    reward = plain.step(action).reward
    assert shown.step(action).reward == reward
    np.testing.assert_array_equal(glow_in(plain.physics), own)
    np.testing.assert_allclose(glow_in(shown.physics), visuals.reward_color(reward / 4.0), rtol=1e-6)
    before, after = (environment.physics.render(90, 120, "profile") for environment in (plain, shown))
    assert (before != after).any()
    shown.reset()
    np.testing.assert_array_equal(glow_in(shown.physics), own)


def test_reward_colors_go_from_red_to_green():
    red, middle, green = (visuals.reward_color(share) for share in (0.0, 0.5, 1.0))
    assert red[0] > 5 * red[1]
    assert green[1] > 5 * green[0]
    np.testing.assert_allclose(middle, (red + green) / 2.0)
    np.testing.assert_array_equal(visuals.reward_color(-3.0), red)
    np.testing.assert_array_equal(visuals.reward_color(7.0), green)


def test_a_palette_colors_the_materials_by_name_or_by_seed():
    def seen(palette):
        model = compiled(STRANGER.replace(palette=palette), True)
        return {name: tuple(map(float, model.material(name).rgba[:3])) for name in ("shell", "limb", "glow")}

    assert seen("moss")["shell"] == pytest.approx((0.42, 0.52, 0.28), abs=1e-6)
    colors = [seen(palette) for palette in (None, "moss", "night", 1, 2)]
    assert len({tuple(each.values()) for each in colors}) == len(colors)
    assert seen(1) == colors[3]
    for palette in ("mos", -1, 1.5, True):
        with pytest.raises(ValueError, match=r"palette: expected one of moss, rust, bone, coral, night, or a seed"):
            STRANGER.replace(palette=palette)


def test_a_palette_of_colors_shows_them_and_others_that_suit_the_first():
    def seen(palette):
        model = compiled(STRANGER.replace(palette=palette), True)
        return {name: (255.0 * model.material(name).rgba[:3]).round().astype(int).tolist() for name in MATERIALS}

    assert seen("#3a5f2b,#D8C48A,#0102ff,#808080,#ffffff") == {
        "shell": [0x3A, 0x5F, 0x2B],
        "limb": [0xD8, 0xC4, 0x8A],
        "glow": [0x01, 0x02, 0xFF],
        "frame": [0x80, 0x80, 0x80],
        "trim": [0xFF, 0xFF, 0xFF],
    }
    one, two = seen("#3a5f2b"), seen("#3a5f2b,#d8c48a")
    assert one | {"limb": [0xD8, 0xC4, 0x8A]} == two
    assert one["shell"] == [0x3A, 0x5F, 0x2B]
    assert max(one["frame"]) < max(one["limb"]) < max(one["trim"]) < max(one["shell"])  # darker, with a green hue
    assert one["limb"][1] == max(one["limb"]) and one["trim"][1] == max(one["trim"])
    assert one["glow"][1] == min(one["glow"])  # of the opposite hue
    assert seen("#000000")["shell"] == [0, 0, 0] and seen("#ffffff")["shell"] == [255, 255, 255]
