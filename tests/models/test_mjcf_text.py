"""The text of a model, in MuJoCo, in dm_control's PyMJCF, and in scenes of others."""

import imports
import mujoco
import numpy as np
import pytest
from dm_control import mjcf
from refusals import refused
from saved_models import saved, without_keyframe

from arc_suite import models, registry
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.models.sizing import size_body
from arc_suite.robots import ROBOTS

BODIES = [*ROBOTS, "spider", "random:3"]


def by_pymjcf(text):
    return mjcf.Physics.from_mjcf_model(mjcf.from_xml_string(text)).model.ptr


def accelerations(model, joints):
    """Those of the named joints, and of the root, in 20 random states near the floor: (20, nv of them)."""
    data, random, found = mujoco.MjData(model), np.random.RandomState(0), []
    free = model.joint(joints[0])
    addresses = [free.dofadr[0] + axis for axis in range(6)] + [model.joint(name).dofadr[0] for name in joints[1:]]
    places = [free.qposadr[0] + axis for axis in range(7)] + [model.joint(name).qposadr[0] for name in joints[1:]]
    for _ in range(20):
        mujoco.mj_resetData(model, data)
        data.qpos[places] += random.uniform(-0.1, 0.1, len(places))
        data.qvel[addresses] = random.normal(size=len(addresses))
        mujoco.mj_forward(model, data)
        found.append(data.qacc[addresses])
    return np.array(found)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("decorated", [False, True])
def test_pymjcf_and_mujoco_read_the_same_model(name, decorated):
    root = models.assemble(registry.body_of(name), decorated=decorated)
    text, before = models.to_mjcf(root), mujoco.MjModel.from_xml_string(root.to_xml_string())
    assert saved(by_pymjcf(text)) == saved(mujoco.MjModel.from_xml_string(text))
    assert saved(without_keyframe(text)) == saved(before)
    assert "class=" not in text


@pytest.mark.parametrize("arena", ARENAS)
def test_arenas_are_in_the_text(arena, tmp_path):
    body = size_body(registry.body_of("tick"))
    root, path = models.assemble(body, ARENAS[arena](body)), tmp_path / "model.xml"
    path.write_text(models.to_mjcf(root))
    assert saved(without_keyframe(path.read_text())) == saved(mujoco.MjModel.from_xml_string(root.to_xml_string()))
    grounds = [geom.name for geom in mjcf.from_path(path).worldbody.geom]
    assert grounds and all(name.startswith("floor") for name in grounds)


@pytest.mark.parametrize("name", BODIES)
def test_home_is_the_standing_pose(name):
    body = registry.body_of(name)
    model = mujoco.MjModel.from_xml_string(models.to_mjcf(models.assemble(body)))
    assert model.key("home").qpos == pytest.approx([0.0, 0.0, body.torso.standing_height, 1.0, *[0.0] * (model.nq - 4)])


@pytest.mark.parametrize("decorated", [False, True])
def test_a_scene_of_dm_control_takes_a_body_without_arena(decorated):
    body = registry.body_of("queen")
    scene = mjcf.RootElement("scene")
    scene.compiler.angle = "radian"
    scene.option.set_attributes(integrator="implicitfast", iterations=200, timestep=0.004)
    scene.asset.add("texture", name="sky", type="skybox", builtin="flat", width=8, height=48)
    scene.worldbody.add("light", name="sun", pos=(0.0, 0.0, 3.0))
    floor = models.assemble(body).find("geom", "floor")
    scene.worldbody.add("geom", **floor.get_attributes())
    for name in ("first", "second"):
        text = models.to_mjcf(models.assemble(body.replace(name=name), None, decorated))
        site = scene.worldbody.add("site", pos=(0.0, 9.0 * (name == "second"), 0.0))
        site.attach(mjcf.from_xml_string(text)).add("freejoint", name="root")
    model = mjcf.Physics.from_mjcf_model(scene).model.ptr
    assert (model.nq, model.nu, model.nsensor, model.nkey, model.opt.timestep) == (2 * 25, 2 * 18, 2, 0, 0.004)
    data = mujoco.MjData(model)
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert data.body("first/torso").xpos[2] == pytest.approx(body.torso.standing_height, rel=0.15)


@pytest.mark.filterwarnings("error")
def test_a_spec_of_mujoco_takes_a_body_without_arena_and_its_dynamics_stay():
    body = registry.body_of("queen")
    whole = models.to_mjcf(models.assemble(body))
    scene = mujoco.MjSpec.from_string(whole)
    scene.delete(scene.body("torso"))
    child = mujoco.MjSpec.from_string(models.to_mjcf(models.assemble(body, None)))
    scene.attach(child, frame=scene.worldbody.add_frame(), prefix="queen-")
    scene.body("queen-torso").add_freejoint().name = "queen-root"
    model = scene.compile()
    assert (model.nq, model.nu) == (25, 18)
    before = mujoco.MjModel.from_xml_string(whole)
    joints = ["root", *body.joint_names]
    now = accelerations(model, [f"queen-{name}" for name in joints])
    assert np.array_equal(now, accelerations(before, joints))
    assert np.abs(now).max() > 10.0


def test_a_body_without_arena_leaves_the_rest_to_the_scene():
    text = models.to_mjcf(models.assemble(registry.body_of("tick"), None, decorated=True))
    model = mujoco.MjModel.from_xml_string(text)
    assert (model.nq, model.nu, model.nlight, model.ntex, model.nkey) == (18, 18, 0, 0, 0)
    assert (model.geom_bodyid > 0).all()
    assert "<option" not in text and "<visual>" not in text
    assert "<option" in models.to_mjcf(models.assemble(registry.body_of("tick"), FLAT))


@pytest.mark.parametrize("body", [imports.hexapod, imports.with_arm])
@pytest.mark.parametrize("decorated", [False, True])
def test_the_text_of_an_imported_body_has_its_bits(body, decorated):
    """PyMJCF reads it, too; what weakens motors in simulations is not in it."""
    body = body()
    text = models.text(body, FLAT, decorated)
    model, parsed = mujoco.MjModel.from_xml_string(text), models.model_spec(body, FLAT, decorated).compile()
    servos = {name: joint.servo for name, joint in zip(body.joint_names, body.joints, strict=True)}
    servos |= {joint.name: joint.servo for joint in body.held}
    drags = [f"{name}-drag" for name, servo in servos.items() if servo.drag is not None]
    assert [model.actuator(index).name for index in range(model.nu)] == [*servos, *drags]
    for name in ("qpos0", "key_qpos", "body_mass", "body_inertia", "geom_pos", "geom_quat", "mesh_vert", "cam_pos"):
        np.testing.assert_array_equal(getattr(model, name), getattr(parsed, name))
    states = accelerations(model, ["root", *body.joint_names]), accelerations(parsed, ["root", *body.joint_names])
    np.testing.assert_array_equal(*states)
    assert by_pymjcf(text).nv == model.nv


def test_releases_stand_before_the_servos_of_an_arm():
    body = imports.with_arm()
    model, joints = models.model_spec(body).compile(), list(body.joint_names)
    names = [model.actuator(index).name for index in range(model.nu)]
    assert names == [*joints, *(f"{joint}-release" for joint in joints), "arm"]


@pytest.mark.parametrize("decorated", [False, True])
def test_a_scene_takes_an_imported_body_without_arena(decorated):
    text = models.text(imports.with_arm(), None, decorated)
    scene, body = mujoco.MjSpec(), mujoco.MjSpec.from_string(text)
    scene.attach(body, prefix="other/", frame=scene.worldbody.add_frame(pos=(0.0, 0.0, 1.0)))
    model = scene.compile()
    assert model.nq == 13 and model.nkey == 0 and "floor" not in text


def test_an_imported_body_has_no_root_element():
    with refused("hexapod_2kg was imported: `models.text` has its MJCF"):
        models.assemble(imports.hexapod())
