"""Robots whose root frame lies away from the trunk: heights, speeds and forces are those of the torso."""

import imports
import mujoco
import numpy as np
import pytest
from robots_of_others import reference

import arc_suite
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.importing import import_robot
from arc_suite.tasks import readings

PLACES = {
    "a footprint": ("a1_like.urdf", (0.0, 0.0, 0.275)),
    "a frame on the belly": ("a1_like.urdf", (0.0, 0.0, 0.1)),
    "a sensor in front and above": ("a1_like.urdf", (-0.25, 0.0, -0.06)),
    "a frame beside the trunk": ("go2_like.xml", (0.02, 0.15, 0.0)),
    "a footprint without mass": ("go2_like.xml", (0.0, 0.0, 0.275)),
}
ALL = pytest.mark.parametrize("case", PLACES)


@pytest.fixture
def moved(case, tmp_path):
    """Return the path of a file with its root frame elsewhere, the robot of it, and the body without that."""
    name, place = PLACES[case]
    path = imports.move_root(tmp_path, name, place)
    return path, import_robot(path), imports.body(name)


@ALL
def test_the_torso_is_at_the_hips(case, moved):
    _, (body, notes), original = moved
    assert body.torso.standing_height == pytest.approx(original.torso.standing_height, rel=1e-9)
    for leg, original_leg in zip(body.legs, original.legs, strict=True):
        np.testing.assert_allclose(leg.points, original_leg.points, atol=1e-9)
    place = ", ".join(f"{coordinate:.3g}" for coordinate in PLACES[case][1])
    (note,) = [note for note in notes if note.startswith("torso:")]
    assert f"at the hips, ({place}) m from the frame of base" in note


@pytest.mark.slow
@ALL
def test_the_physics_are_the_files_to_the_last_bit(case, moved):
    path, (body, _), _ = moved
    assert reference.same_bits(path, body) == reference.STATES


@ALL
@pytest.mark.parametrize("task", ["walk", pytest.param("rough", marks=pytest.mark.slow)])
def test_episodes_are_those_of_the_robot_with_its_frame_at_the_trunk(case, moved, task):
    """Starts are the same with all noise. Steps differ a little, as the simulation integrates another point."""
    _, (body, _), original = moved
    settings = {"payload": 0.2, "center_of_mass": 0.1}
    both = [VectorEnv(robot, task, 2, task_kwargs=settings, privileged=True) for robot in (body, original)]
    starts = [environments.reset(seed=4) for environments in both]
    np.testing.assert_allclose(starts[0][0], starts[1][0], atol=1e-4)
    np.testing.assert_allclose(starts[0][1]["privileged"], starts[1][1]["privileged"], atol=1e-5)
    steps = [environments.step(np.zeros(environments.action_space.shape)) for environments in both]
    blocks = [environments.task.split(step[0]) for environments, step in zip(both, steps, strict=True)]
    np.testing.assert_allclose(blocks[0]["posture"], blocks[1]["posture"], atol=3e-4)
    np.testing.assert_allclose(blocks[0]["velocities"], blocks[1]["velocities"], atol=3e-2)


@ALL
def test_readings_are_those_of_the_place_of_the_torso(case, moved):
    _, (body, _), _ = moved
    environment = arc_suite.load(body, "walk")
    task, model, data = environment.task.definition, environment.physics.model.ptr, environment.physics.data.ptr
    random = np.random.default_rng(0)
    data.qpos[:] += random.normal(0.0, 0.3, model.nq)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qvel[:] = random.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    found, site = task.read(data), model.site("torso").id
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site, velocity, 0)
    for position in (found.frame_position, found.torso_position, found.qpos[:3]):
        np.testing.assert_allclose(position, data.site_xpos[site], atol=1e-12)
    assert found.torso_height == pytest.approx(data.site_xpos[site][2])
    np.testing.assert_allclose(found.velocities[:3], velocity[3:], atol=1e-12)
    layout = task.scene.layout
    poses = readings.pose(data.qpos, layout)
    np.testing.assert_allclose(readings.positions(poses, layout, data.qpos), data.qpos, atol=1e-12)
    qvel = readings.root_qvel(readings.torso_qvel(data.qvel, data.qpos, layout), data.qpos, layout)
    np.testing.assert_allclose(qvel, data.qvel, atol=1e-12)


@pytest.mark.parametrize("name", ["a1_like.urdf", "go2_like.xml"])
def test_a_root_frame_near_the_trunk_stays(name, tmp_path):
    body, notes = import_robot(imports.move_root(tmp_path, name, (0.01, 0.0, 0.02)))
    assert body.torso.standing_height == pytest.approx(imports.body(name).torso.standing_height - 0.02, rel=1e-6)
    assert not [note for note in notes if note.startswith("torso:")]


def test_what_touches_the_trunk_is_seen_where_the_root_body_is_empty():
    layout = arc_suite.load(imports.on_its_floor(), "walk").task.definition.scene.layout
    model = arc_suite.load(imports.on_its_floor(), "walk").physics.model.ptr
    assert model.body(layout.torso).mass > 6.0
    assert layout.parts[0] == layout.torso != layout.torso_place.root


@pytest.mark.slow
def test_a_robot_on_its_footprint_walks(tmp_path):
    path = imports.move_root(tmp_path, "go2_like.xml", (0.0, 0.0, 0.275))
    both = [arc_suite.load(robot, "walk") for robot in (path, imports.quadruped())]
    speeds = []
    for environment in both:
        act = Demonstrator(environment, "medium")
        timestep = environment.reset()
        for _ in range(200):
            timestep = environment.step(act(timestep))
            assert not timestep.last()
        speeds.append(environment.task.progress["speed"])
    assert speeds[0] == pytest.approx(speeds[1], rel=0.1)
