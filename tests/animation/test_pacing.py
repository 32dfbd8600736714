"""Demonstrators of pages and of the studio lift their feet by the speed, as clips do."""

import imports
import numpy as np
import pytest

from arc_suite.animation import player_controls
from arc_suite.animation.pacing import paced_demonstrator
from arc_suite.animation.studio.creature import load_environment, load_policy
from arc_suite.animation.studio.sketch import Sketch, make_setup
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS, gaits


def walk(environment, policy, forward, steps=240):
    """Height to which feet rise in their swings, standing heights, at a command; the body does not fall."""
    task, body = environment.task.definition, environment.task.definition.scene.body
    timestep = environment.reset()
    commands = player_controls.commands(task, (forward, 0.0, 0.0), np.zeros(6), player_controls.OWN_GAIT)
    for name, value in commands.items():
        environment.command(name, value)
    feet = [environment.physics.model.ptr.body(name).id for name in body.foot_names]
    heights = []
    for _ in range(steps):
        timestep = environment.step(policy(timestep))
        assert not timestep.last()
        heights.append(environment.physics.data.xpos[feet, 2] - [leg.foot.radius for leg in body.legs])
    return np.quantile(heights[steps // 3 :], 0.98, axis=0).mean() / body.torso.standing_height


@pytest.mark.parametrize(
    "body",
    [
        ROBOTS["tick"],
        *(pytest.param(body, marks=pytest.mark.release) for body in (ROBOTS["queen"], imports.quadruped())),
    ],
    ids=lambda body: body.name,
)
def test_feet_rise_with_the_speed(body):
    environment = Setup.of(body, "directed").load(seed=0)
    policy = paced_demonstrator(environment.task.definition)
    slow, usual, run = (walk(environment, policy, speed) for speed in (0.6, 1.0, 1.75))
    assert slow < 0.95 * usual and run > 1.04 * usual


def test_a_body_of_two_joints_a_leg_walks_as_usual():
    law = paced_demonstrator(Setup.of(ROBOTS["bastion"], "directed").definition).law
    assert not law.parameters.lift_by_pace


def test_the_slider_of_the_speed_lifts_feet_too():
    def law(**fields):
        sketch = Sketch(source="tick", **fields)
        return load_policy(sketch, load_environment(make_setup(sketch))).law

    for speed in (0.6, 1.75):
        lift = gaits.pace_at(speed).height * law().foot_lift
        assert law(speed=speed).foot_lift == pytest.approx(lift) and law(speed=speed).parameters.lift_by_pace
