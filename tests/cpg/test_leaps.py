"""Leaps: keyframes of joints, what a trial tells, and the demonstrator over a trench."""

import numpy as np
import pytest

from arc_suite.cpg import Demonstrator, leaps
from arc_suite.envs.vector import VectorEnv
from arc_suite.models.kinematics import Legs
from arc_suite.models.sizing import size_body
from arc_suite.robots import ROBOTS


def test_keyframes_crouch_and_come_back():
    body = size_body(ROBOTS["queen"])
    legs = Legs.of(body)
    rest = legs.by_leg(np.zeros(len(body.joint_names)))
    angles = leaps.leap_targets(body, legs, rest, leaps.Leap())
    made = leaps.lay_out_movement(body, legs, rest, leaps.Leap())
    assert made.crouch_end < made.stretch_end < made.landing_step < len(angles) == len(made.sole_offsets)
    low = legs.soles(legs.by_leg(angles[made.crouch_end - 1]))[0] - legs.soles(rest)[0]
    assert low[:, 2].min() > 0.3 * body.torso.standing_height  # soles come up to the torso
    np.testing.assert_allclose(angles[-1], legs.by_joint(rest), atol=0.05)


def test_a_jump_leaves_the_ground_and_lands():
    rest = (0.0,) * len(ROBOTS["queen"].joint_names)
    (flight,) = leaps._try_leaps(ROBOTS["queen"], rest, (leaps.choose_jump(ROBOTS["queen"], rest),))
    assert flight.landed and flight.air_time > 0.2 and flight.clearance > 0.2
    assert flight.rise > 0.2 and flight.drift < 0.1 and abs(flight.distance) < 0.1


def test_queen_leaps_over_a_trench():
    """In the lane that seed 0 draws; by steps alone she falls."""
    environment = VectorEnv("queen", "leap", 1, 1, "Disabled", task_kwargs={"width": 0.75})
    law, leapt = Demonstrator(environment, "leaping").law, False
    observation, _ = environment.reset(seed=0)
    legs, state = law.legs, law.initial(1)
    for _ in range(370):
        state, actions = law(state, environment.task.split(observation))
        observation, _, ended, *_ = environment.step(actions)
        angles, leapt = state.paths.walk.angles, leapt or state.paths.step[0] > 1
        assert (angles >= legs.low).all() and (angles <= legs.high).all(), "legs would bend the other way"
    assert not ended.any() and leapt and law.flight.landed
    assert environment.batch.data.qpos[0, 0] > 12.5 * ROBOTS["queen"].torso.standing_height


def test_a_leap_carries_as_far_from_a_start_that_differs():
    law = Demonstrator(VectorEnv("bastion", "leap", 1, 1), "leaping").law
    rest = law._first_state.angles
    targets = leaps.leap_targets(law.body, law.legs, rest, law.leap)[None]
    crouch_end = law._movement.crouch_end
    differences = 0.03 * np.random.default_rng(5).standard_normal((8, targets.shape[-1]))  # rad
    starts = law.legs.by_joint(rest) + differences
    flights = [leaps.simulate_flights(law.body, start, targets, [crouch_end])[0] for start in starts]
    assert all(flight.landed for flight in flights)
    np.testing.assert_allclose([flight.distance for flight in flights], law.flight.distance, atol=0.2)


def test_a_leap_begins_when_feet_stand_though_they_swing_at_the_ends_of_cycles():
    law = Demonstrator(VectorEnv("bastion", "leap", 1, 1), "leaping").law
    step = law._next_step(np.array([0]), np.array([True]))
    while step[0] < 0:
        stands = step % law._cycle_steps < law._cycle_steps - 2
        step = law._next_step(step, stands)
    assert step[0] == 1


@pytest.mark.release
def test_bastion_leaps_over_trenches():
    height = ROBOTS["bastion"].torso.standing_height
    environment = VectorEnv("bastion", "leap", 40, 1, "Disabled", task_kwargs={"width": 0.8 * height})
    observation, _ = environment.reset(seed=list(range(9000, 9040)))
    policy = Demonstrator(environment, "leaping")
    fell = np.zeros(40, bool)
    for _ in range(330):
        observation, _, ended, *_ = environment.step(policy.act(environment.task.split(observation)))
        fell |= ended
    assert fell.mean() <= 0.15


def test_who_cannot_leap_is_told():
    with pytest.warns(
        UserWarning, match="^tick cannot leap: its feet get .* h ahead, and 0.8 h are needed; leaping walks"
    ):
        Demonstrator(VectorEnv("tick", "leap", 1, 1), "leaping")
