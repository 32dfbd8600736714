"""Imported bodies of other sizes and with links of other lengths."""

import math
import pathlib
import re
import tempfile
import xml.etree.ElementTree as ElementTree

import imports
import mujoco
import numpy as np
import pytest
import sprung_robots
from refusals import refused

from arc_suite import rotations
from arc_suite.bodies import generator
from arc_suite.bodies.shaping import link_ends, parts_with_lengths, shaped
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.importing import import_robot
from arc_suite.models.soundness import flaws
from arc_suite.models.source import compile_source
from arc_suite.models.standing import measure_standing, standing_qpos

DIRECT = 'solref="-4000 -120"'  # stiffness and damping in place of times


def made(name, **parts):
    """Import one of the robots with passive joints."""
    with tempfile.TemporaryDirectory() as folder:
        return import_robot(sprung_robots.write(pathlib.Path(folder), **parts)).body.replace(name=name)


def with_mesh():
    """Import the quadruped with a mesh for a front thigh, which has its weight and inertia, and is shown, too."""
    text = (imports.FILES / "go2_like.xml").read_text(encoding="utf-8")
    points = ["0 0 0", "0.05 0 0", "0 0.02 0", "0 0 -0.1", "0.05 0 -0.1", "0 0.02 -0.1"]
    faces = ("1 3 2", "4 5 6", "1 2 5", "1 5 4", "2 3 6", "2 6 5", "3 1 4", "3 4 6")
    like = 'scale="1 2 1.5" refpos="0.01 0 0"'
    meshes = f'<mesh name="wedge" {like} vertex="{" ".join(points)}"/><mesh name="shown" {like} file="shown.obj"/>'
    text = text.replace("</asset>", f"{meshes}</asset>")
    pose = 'type="mesh" pos="0.01 0.02 0" euler="0.1 0.3 0.2"'
    thigh = re.compile(r'<inertial[^>]*>\s*(<joint name="FL_thigh_joint"[^>]*>)\s*<geom[^>]*>')
    text, count = thigh.subn(
        rf'\1<geom {pose} mesh="wedge" density="800"/><geom class="looks" {pose} mesh="shown"/>', text
    )
    assert count == 1
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "with_mesh.xml"
        path.write_text(text, encoding="utf-8")
        lines = [f"v {point}" for point in points] + [f"f {face}" for face in faces]
        path.with_name("shown.obj").write_text("\n".join(lines), encoding="utf-8")
        return import_robot(path).body.replace(name="with_mesh")


BODIES = [
    imports.quadruped(),
    imports.hexapod(),
    imports.with_arm(),
    imports.on_its_floor(),
    with_mesh(),
    made("slides", **sprung_robots.CASES["sprung shanks"]),
    made("rods", **sprung_robots.CASES["rods that connections close"]),
    made("welds", **sprung_robots.CASES["ankles that welds hold"]),
    made("direct", foot=sprung_robots.FOOT.replace("/>", f" {DIRECT}/>"), further=sprung_robots.TAIL),
]
by_name = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
by_scale = pytest.mark.parametrize("scale", [0.3, 2.0])


def fall(body, substeps):
    """Positions and velocities of a body that falls by 0.05 standing heights under random controls, after substeps."""
    _, model = Setup.of(body).prepare()
    data = mujoco.MjData(model)
    data.qpos[:] = standing_qpos(model)
    data.qpos[2] += 0.05 * body.torso.standing_height
    data.qvel[0] = 0.2 * np.sqrt(9.81 * body.torso.standing_height)
    random = np.random.default_rng(0)
    controls = [index for index in range(model.nu) if "-" not in model.actuator(index).name]
    states = []
    for _ in range(substeps):
        data.ctrl[controls] = random.uniform(-0.3, 0.3, len(controls))
        mujoco.mj_step(model, data)
        states.append((data.qpos.copy(), data.qvel.copy()))
    return states


@by_scale
@by_name
def test_a_scaled_body_moves_like_the_first_one(body, scale):
    """Contacts and springs, slides, loops, servos and friction: lengths have the factor, times its square root.

    MuJoCo's welds add lengths and angles, which no factor suits: they are similar for a short time.
    """
    substeps, tolerance = (15, 2e-3) if "weld" in body.source else (120, 1e-5)
    scaled = shaped(body, scale=scale)
    assert scaled.torso.standing_height == pytest.approx(scale * body.torso.standing_height)
    model = compile_source(body)
    slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    for (qpos, qvel), (scaled_qpos, scaled_qvel) in zip(fall(body, substeps), fall(scaled, substeps), strict=True):
        lengths, speeds = np.ones(model.nq), np.ones(model.nv)
        lengths[[0, 1, 2, *model.jnt_qposadr[slides]]] = speeds[[0, 1, 2, *model.jnt_dofadr[slides]]] = scale
        np.testing.assert_allclose(scaled_qpos, qpos * lengths, atol=tolerance * max(scale, 1.0))
        np.testing.assert_allclose(scaled_qvel * scale**0.5, qvel * speeds, atol=100.0 * tolerance * max(scale, 1.0))


def test_weights_and_motors_have_powers_of_the_factor():
    body = imports.quadruped()
    scaled = generator.scaled(body, 2.0)
    assert scaled.name == "quadruped_15_kg_scaled"
    masses = [compile_source(each).body_mass for each in (body, scaled)]
    np.testing.assert_allclose(masses[1], 8.0 * masses[0])
    servos = [each.legs[0].joints[0].servo for each in (body, scaled)]
    assert servos[1].limit == pytest.approx(16.0 * servos[0].limit)
    assert servos[1].damping == pytest.approx(2.0**4.5 * servos[0].damping)
    assert scaled.simulation.timestep == pytest.approx(2.0**0.5 * body.simulation.timestep)


def anchors(body):
    """Anchors of the joints of legs by name, and places of feet, m, from the torso in the standing pose; joint axes."""
    model = compile_source(body)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    origin = data.site("torso").xpos
    places = {name: data.joint(name).xanchor - origin for name in body.joint_names}
    places |= {name: data.site(name).xpos - origin for name in body.foot_names}
    return places, {name: data.joint(name).xaxis for name in body.joint_names}


@by_name
def test_links_of_other_lengths_and_directions(body):
    """Each joint and foot is where the links before it end, axes stay, and the lowest foot stands on the floor."""
    parts = parts_with_lengths(body)
    ends = dict(link_ends(body))
    random = np.random.default_rng(1)
    for part in parts:
        ends[part] = tuple(np.array(ends[part]) * random.uniform(0.8, 1.3) + 0.02 * random.uniform(-1.0, 1.0, 3))
    changed = shaped(body, ends=ends) if parts else body
    (before, axes_before), (after, axes) = anchors(body), anchors(changed)
    for leg in body.legs:
        names = [*leg.joint_names, leg.part_names[-1]]
        moved = np.zeros(3)
        for index, part in enumerate(leg.part_names[:-1]):
            moved = moved + np.subtract(ends[part], link_ends(body)[part])
            np.testing.assert_allclose(after[names[index + 1]] - before[names[index + 1]], moved, atol=1e-4)
            np.testing.assert_allclose(axes[names[index]], axes_before[names[index]], atol=1e-6)
    soles = [measure_standing(each).soles[:, 2].min() + each.torso.standing_height for each in (body, changed)]
    assert soles[1] == pytest.approx(soles[0], abs=1e-4)


def test_what_cannot_become_longer_is_named():
    assert parts_with_lengths(BODIES[0]) == tuple(link_ends(BODIES[0]))
    slides, rods = (body for body in BODIES if body.name in ("slides", "rods"))
    assert {part.partition("_")[2] for part in parts_with_lengths(slides)} == {"link2", "link3"}  # of a cardan joint
    assert parts_with_lengths(rods) == ()
    with refused("links: l1_link1 of rods has no length of its own (those with one: none)"):
        shaped(rods, links={"link1": 1.5})
    for change in ({"length": 2.0}, {"fan": 5.0}, {"head": "ball"}):
        (field,) = change
        with refused(f"{field}: rods was imported, and keeps its torso; scale, links, ends change"):
            shaped(rods, **change)


def test_a_link_takes_its_weight_along():
    """A mesh and its inertia are those that MuJoCo computes of the longer mesh."""
    body = with_mesh()
    changed = shaped(body, links={"l1_link2": 1.4})
    for each in (body, changed):
        root = ElementTree.fromstring(each.source)
        root.find("compiler").set("inertiafromgeom", "auto")
        (thigh,) = (part for part in root.iter("body") if part.get("name") == "l1_link2")
        for geom in thigh.findall("geom"):
            geom.attrib |= {"density": "800"} if geom.get("contype") == "1" else {}
            geom.attrib.pop("mass")
            if geom.get("group") == "2":
                thigh.remove(geom)
        thigh.remove(thigh.find("inertial"))
        computed = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode")).body("l1_link2")
        own = compile_source(each).body("l1_link2")
        assert own.mass == pytest.approx(computed.mass, rel=1e-4)
        np.testing.assert_allclose(own.ipos, computed.ipos, atol=1e-6)
        tensors = []
        for inertia, quaternion in ((own.inertia, own.iquat), (computed.inertia, computed.iquat)):
            turn = rotations.matrix(quaternion)
            tensors.append(turn @ np.diag(inertia) @ turn.T)
        np.testing.assert_allclose(tensors[0], tensors[1], atol=1e-4 * tensors[1].max())
    assert compile_source(changed).body("l1_link2").mass == pytest.approx(
        1.4 * compile_source(body).body("l1_link2").mass, rel=1e-6
    )


def test_a_shown_mesh_stretches_with_its_link():
    bodies = [with_mesh(), shaped(with_mesh(), links={"link2": 2.0})]
    lows = []
    for body in bodies:
        model = mujoco.MjModel.from_xml_string(body.source)
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_kinematics(model, data)
        reaches = []
        for geom in np.flatnonzero(model.geom_bodyid == model.body("l1_link2").id):
            first = model.mesh_vertadr[model.geom_dataid[geom]]
            vertices = model.mesh_vert[first : first + 6] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            axis = np.array(link_ends(bodies[0])["l1_link2"])
            reaches.append(((vertices - data.joint("l1_joint2").xanchor) @ axis).max())
        assert len(reaches) == 2 and reaches[0] == pytest.approx(reaches[1], rel=1e-3)
        lows.append(reaches[0])
    assert lows[1] == pytest.approx(2.0 * lows[0], rel=1e-5)


@pytest.mark.parametrize("links", [{"link3": 1.2}, {"link2": 0.85}, {"l1_link3": 1.05}], ids=str)
def test_a_changed_robot_stands_and_walks(links):
    body = shaped(imports.quadruped(), links=links)
    assert body.name == "quadruped_15_kg_shaped"
    assert not [flaw for flaw in flaws(body) if "l1_link3" not in links]
    environment = Setup.of(body).load(seed=0)
    policy = Demonstrator(environment.task.definition)
    timestep = environment.reset()
    for _ in range(150):
        timestep = environment.step(policy(timestep))
        assert not timestep.last()
    assert environment.physics.data.qpos[0] > 0.5


@by_name
def test_variants_keep_feet_level_motors_and_torso(body):
    count = len(generator.list_deformations(body))
    assert bool(count) == bool(parts_with_lengths(body))
    if not count:
        return
    assert generator.mutated(body, 1, amount=0.0) == body.replace(name=f"{body.name}_mutated")
    variant = generator.deform_legs(body, np.linspace(-0.2, 0.2, count))
    depths = [[leg.foot_depth for leg in legs] for legs in (body.legs, variant.legs)]
    assert np.allclose(np.ptp(np.subtract(*depths)), 0.0, atol=1e-9) and not np.allclose(*depths)
    assert [joint.servo for joint in variant.joints] == [joint.servo for joint in body.joints]
    assert not flaws(variant)


def test_legs_that_are_mirror_images_change_alike():
    body = imports.quadruped()
    longer = generator.deform_legs(body, np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]))
    is_same = {part: end == link_ends(body)[part] for part, end in link_ends(longer).items()}
    pairs = [(part, f"r{part[1:]}") for part in is_same if part.startswith("l")]
    assert all(is_same[left] == is_same[right] for left, right in pairs)
    lengths = [math.hypot(*link_ends(each)["l1_link2"]) for each in (body, longer)]
    assert lengths[1] > lengths[0]
    assert measure_standing(longer).mass > measure_standing(body).mass
