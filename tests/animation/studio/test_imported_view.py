"""What the studio shows of an imported body is what is simulated."""

import imports
import mujoco
import numpy as np
import pytest

from arc_suite import rotations
from arc_suite.animation.parts import part_frames
from arc_suite.animation.studio.creature import open_creature
from arc_suite.animation.studio.sketch import Sketch, drag_end, open_body
from arc_suite.models.standing import standing_qpos
from arc_suite.tasks import readings

viser = pytest.importorskip("viser", reason="no viser here: make check-studio")
from arc_suite.animation.studio.view import View  # noqa: E402


@pytest.fixture
def server():
    made = viser.ViserServer(port=8190, verbose=False)
    yield made
    made.stop()


@pytest.mark.parametrize("body", [imports.hexapod(), imports.with_arm()], ids=["six legs", "an arm"])
def test_frames_are_where_the_simulation_has_the_feet(server, body):
    view, creature = View(server), open_creature(open_body(Sketch(task="steer"), body))
    view.show(creature)
    physics, layout = creature.environment.physics, creature.environment.task.definition.scene.layout
    model, data = physics.model.ptr, physics.data.ptr
    angles = np.random.default_rng(0).uniform(-0.3, 0.3, len(body.joint_names))
    pose = np.concatenate([(0.1, 0.2, 0.5, 1.0, 0.0, 0.0, 0.0), angles])
    data.qpos[:] = readings.positions(pose, layout, standing_qpos(model))
    mujoco.mj_kinematics(model, data)
    view.pose(data.qpos.copy(), [])
    places, turns = [], []
    for part, frame in zip(creature.parts, view._figure._frames, strict=True):
        place, turn = (np.zeros(3), np.eye(3)) if part.parent is None else (places[part.parent], turns[part.parent])
        places.append(place + turn @ frame.position * creature.reach)
        turns.append(turn @ rotations.matrix(np.array(frame.wxyz)))
    shown = [places[body.part_names.index(name)] for name in body.foot_names]
    np.testing.assert_allclose(shown, data.xpos[layout.feet], atol=1e-6)


def test_the_ball_at_the_end_of_a_link_drags_its_end(server):
    """Balls are at the ends of links, and a shift in the scene moves the end by as much in the model."""
    view, robot = View(server), imports.quadruped()
    creature = open_creature(open_body(Sketch(task="steer"), robot))
    view.show(creature)
    dragged = {}
    view.show_handles(lambda part, shift: dragged.update({part: shift}))
    figure = view._figure
    positions, turns = part_frames(creature.parts)
    model = creature.environment.physics.model.ptr
    data = mujoco.MjData(model)
    data.qpos[:] = standing_qpos(model)
    mujoco.mj_kinematics(model, data)
    index = robot.part_names.index("r1_link2")
    (ball,) = (ball for ball in figure._balls if ball.name.endswith("r1_link2/end"))
    place = positions[index] + turns[index] @ np.array(ball.position) * creature.reach
    knee = data.joint("r1_joint3").xanchor - data.xpos[1]
    np.testing.assert_allclose(place - positions[0], knee, atol=1e-4)
    changed = drag_end(creature.sketch, "r1_link2", np.array((0.03, 0.0, -0.02)), symmetric=False)
    after = open_creature(changed).environment.physics
    after.data.qpos[:] = standing_qpos(after.model.ptr)
    mujoco.mj_kinematics(after.model.ptr, after.data.ptr)
    moved = after.data.ptr.joint("r1_joint3").xanchor - after.data.xpos[1] - knee
    np.testing.assert_allclose(moved, (0.03, 0.0, -0.02), atol=1e-4)
