"""The terms: their kernels, in batches, and those of classes of tasks from outside; their values are in test_parity."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

from arc_suite.envs import dm
from arc_suite.envs.prepare import prepare_task
from arc_suite.robots import ROBOTS
from arc_suite.simulation.physics import Physics
from arc_suite.tasks import terms
from arc_suite.tasks.suite import Steer


@pytest.mark.filterwarnings("error")
def test_an_infinite_velocity_earns_nothing():
    for velocities in (np.float64(np.inf), np.float64(-np.inf), np.array([np.inf, -np.inf])):
        assert_array_equal(terms.triangle(velocities - 0.5, 0.3), 0.0)


class Longer(Steer):
    """Steer with one more bonus."""

    weights = Steer.weights | {"lower": 0.5}

    def terms(self, memory, readings):
        return super().terms(memory, readings) | {"lower": 1.0 - readings.torso_height}


def reward_of_a_step(kind):
    """The reward of a step of a class of tasks, and its terms."""
    plain, _ = prepare_task("tick", "steer")
    task = kind(plain.scene, kind.settings_for(plain.scene.body, {}))
    run = dm.TaskRun(task, 0)
    environment = dm.Environment(Physics.from_body(task.scene.body, task.scene.arena), run, {})
    environment.reset()
    return environment.step(np.full(18, 0.5)).reward, run.terms


def test_a_term_from_outside_counts_and_costs_are_limited_after_it():
    plain, terms_of_plain = reward_of_a_step(Steer)
    reward, found = reward_of_a_step(Longer)
    assert_allclose(reward, plain + 0.5 * found["lower"], rtol=1e-12)
    assert found == terms_of_plain | {"lower": found["lower"]}
    costs = sum(Longer.weights[name] * found[name] for name in found if Longer.weights[name] < 0.0)
    assert 0.1 < -costs < Steer.settings_for(ROBOTS["tick"], {}).cost_limit


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            Steer.weights | {"lowre": 0.5},
            "unknown term of weights 'lowre'; did you mean 'lower'? (there are: gait_cost, ",
        ),
        (Steer.weights, "term 'lower' has no weight (there are: progress, tracking, "),
    ],
    ids=["a weight without a term", "a term without a weight"],
)
def test_terms_and_weights_that_do_not_pair_are_one_line(weights, message):
    with refused(message, begins=True):
        reward_of_a_step(type("Unpaired", (Longer,), {"weights": weights}))
