"""The demonstrator that limps: who takes it, which leg fails, and that a robot stays up."""

import imports
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator, limping
from arc_suite.cpg.selection import presets_of, suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS

QUADRUPED = imports.quadruped()
NUM_ENVS = 8


def test_imported_robots_limp_and_others_brace():
    assert suited_preset(Setup.of(QUADRUPED, "limp").definition) == "limping"
    assert suited_preset(Setup.of(QUADRUPED, "shoved").definition) == "braced"
    assert suited_preset(Setup.of(ROBOTS["queen"], "limp").definition) == "braced"
    assert suited_preset(Setup.of(imports.hexapod(), "limp").definition) == "braced"
    assert "limping" not in presets_of(ROBOTS["queen"])


@pytest.mark.parametrize(
    ("errors", "failure"),
    [
        ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        ((0.2, 0.2, 0.2, 0.2), (0.0, 0.0, 0.0, 0.0)),  # a kick
        ((0.1, 0.3, 0.1, 0.1), (0.0, 1.0, 0.0, 0.0)),
        ((0.1, 0.1, 0.25, 0.1), (0.0, 0.0, 0.5, 0.0)),
        ((0.5, 0.5, 0.1, 0.1), (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_a_leg_fails_whose_joints_err_more_than_all_others(errors, failure):
    assert_allclose(limping.find_failure(np.array([errors]) ** 2), [failure], atol=1e-12)


def test_a_body_of_one_leg_cannot_limp():
    body = generator.generate(4, 3)
    task = Setup.of(body.replace(name="hopper", legs=body.legs[:1]), "limp").definition
    with refused("preset: hopper has one leg, and limping is for two or more; see braced"):
        limping.Limping(task, presets_of(QUADRUPED)["limping"])
    two_legs = Setup.of(body.replace(name="biped", legs=body.legs[::2]), "limp").definition
    assert np.isfinite(limping.Limping(two_legs, presets_of(QUADRUPED)["limping"]).ways_from_legs).all()


@pytest.mark.slow
def test_a_robot_stays_up_with_a_failed_leg():
    """With its front leg on the right failed from step 40 on, the robot falls in all episodes by `braced`."""
    environments = VectorEnv(QUADRUPED, "limp", NUM_ENVS, task_kwargs={"actuator_failure": 1})
    demonstrator = Demonstrator(environments, "limping")
    observation, _ = environments.reset(seed=0)
    has_fallen = np.zeros(NUM_ENVS, bool)
    for _ in range(160):
        actions = demonstrator.act(environments.task.split(observation))
        observation, _, fell, *_ = environments.step(actions)
        has_fallen |= fell
    assert has_fallen.mean() <= 0.25
