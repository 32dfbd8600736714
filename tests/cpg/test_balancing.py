"""The demonstrator that keeps its balance: Leaper over ground, and rows as single ones."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import arc_suite
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.balancing import BALANCES, Balanced
from arc_suite.cpg.demonstrator import presets_of
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS, generator


def walked(law, task, difficulty, steps, rows=6):
    """Mean share of the distance asked for, of all rows on ground of seed 1, and the share of them that fell."""
    environment = VectorEnv(
        "leaper", task, rows, autoreset_mode="Disabled", task_kwargs={"difficulty": difficulty, "terrain_seed": 1}
    )
    step, observations = environment.task.scene.control_timestep, environment.reset(seed=100)[0]
    law.begin(range(rows))
    way, fell, over = np.zeros(rows), np.zeros(rows, bool), np.zeros(rows, bool)
    for _ in range(steps):
        observations, _, terminated, truncated, _ = environment.step(law.act(environment.task.split(observations)))
        fell |= terminated & ~over
        over |= terminated | truncated
        way += ~over * environment.task.split(observations)["command"][:, 3] * step
    environment.close()
    return way.mean() / (steps * step), fell.mean()


@pytest.mark.slow
@pytest.mark.parametrize(("task", "difficulty", "further"), [("rough", 1.0 / 3.0, 0.05), ("slopes", 2.0 / 3.0, 0.2)])
def test_balance_takes_leaper_further(task, difficulty, further):
    body = ROBOTS["leaper"]
    before, _ = walked(Demonstrator(body, "surefooted"), task, difficulty, 400)
    after, fell = walked(Demonstrator(body, "balanced"), task, difficulty, 400)
    assert after >= before + further and not fell, (before, after, fell)


def test_leaper_lifts_its_rear_feet():
    body, law = ROBOTS["leaper"], Balanced(ROBOTS["leaper"], BALANCES["leaper"])
    cycle = np.tile(np.linspace(0.0, 1.0, 21)[:, None], (1, len(body.legs)))
    rest = np.zeros((len(cycle), 3))
    feet = law._planned(cycle, rest, rest[:, :2], np.ones((len(cycle), 1)), rest)
    weights = np.tile(np.eye(3), (len(body.legs), 1, 1))
    angles = np.tile(law._first, (len(cycle), 1, 1))
    soles, _ = law._legs.soles(law._legs.reached(angles, feet, weights, 0.01, 20))
    assert np.ptp(soles[:, 2:, 2], axis=0).min() >= 0.2 * body.torso.standing_height


def test_rows_are_single_demonstrators():
    rows, policy = VectorEnv("leaper", "rough", 3), Demonstrator("leaper", "balanced")
    single, alone = arc_suite.load("leaper", "rough"), Demonstrator("leaper", "balanced")
    observations, timestep = rows.reset(seed=4)[0], single.reset(5)
    for step in range(40):
        actions = policy.act({name: block.astype(float) for name, block in rows.task.split(observations).items()})
        blocks = {name: block.astype(np.float32) for name, block in timestep.observation.items()}
        assert_array_equal(actions[1], alone(timestep._replace(observation=blocks)), err_msg=f"step {step}")
        observations, *_ = rows.step(actions)
        timestep = single.step(actions[1])
    rows.close()


def test_a_row_that_begins_again_does_as_the_first_time():
    rows, policy = VectorEnv("leaper", "rough", 2), Demonstrator("leaper", "balanced")

    def acted():
        observations = rows.reset(seed=4)[0]
        policy.begin([0, 1])
        for _ in range(20):
            actions = policy.act(rows.task.split(observations))
            observations = rows.step(actions)[0]
        return actions

    assert_array_equal(acted(), acted())
    rows.close()


def test_it_is_a_preset_of_leaper_alone():
    assert presets_of(ROBOTS["leaper"])["balanced"] == BALANCES["leaper"]
    for body in (ROBOTS["queen"], ROBOTS["bastion"], ROBOTS["tick"], generator.random_body(4)):
        assert "balanced" not in presets_of(body)
    with pytest.raises(ValueError, match="^unknown preset 'balanced'; did you mean 'planned'.*sighted, planned.$"):
        Demonstrator("queen", "balanced")


def test_balance_has_no_scale():
    """A body ten times as large, of other joints' strength, plans the same angles for its feet."""
    laws = [Balanced(body, BALANCES["leaper"]) for body in (ROBOTS["leaper"], generator.scaled(ROBOTS["leaper"], 10.0))]
    assert_allclose(*(law._first for law in laws), atol=1e-6)
    assert_allclose(10.0 * laws[0]._places, laws[1]._places)
