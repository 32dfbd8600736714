"""Imitation of demonstrators."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_array_equal

pytest.importorskip("jax", reason="of the extra agents: make check-agents")

from arc_suite.agents import dagger, run_folder
from arc_suite.agents.algorithms import ALGORITHMS
from arc_suite.agents.hyperparameters import Imitation
from arc_suite.agents.learner import Stage
from arc_suite.agents.training import Run, train
from arc_suite.cpg import Demonstrator
from arc_suite.policies import network
from arc_suite.robots import ROBOTS, generator

SMALL = Imitation(rows=8, round=10, left_out=2, updates=20, last_updates=40, batch=64, hidden=16)


def stage(tmp_path, robot="leaper", task="walk", steps=240, **settings):
    body = ROBOTS[robot] if isinstance(robot, str) else robot
    return Stage(body, task, settings, 3, steps, tmp_path)


def learned(learner, steps):
    figures = []
    while learner.step < steps:
        figures.append(learner.advance(steps))
    return figures


@pytest.mark.parametrize(("robot", "task"), [("leaper", "walk"), ("tick", "steer")])
def test_it_goes_on_to_the_bit(tmp_path, robot, task):
    """The demonstrators of steer remember what they felt; episodes of 11 steps begin and end meanwhile."""
    given = stage(tmp_path, robot, task, time_limit=0.55)
    whole, first, second = (dagger.begin(SMALL, given) for _ in range(3))
    learned(whole, 240)
    learned(first, 80)
    arrays = {name: array.copy() for name, array in first.arrays().items()}
    learned(first, 240)
    second.restore(arrays)
    assert second.step == 80
    learned(second, 240)
    for other in (first, second):
        for name, array in whole.arrays().items():
            assert_array_equal(other.arrays()[name], array, err_msg=name)
    assert whole.arrays()["ages"].max() == 10


def test_where_positions_are_taken_they_are_what_is_imitated(tmp_path):
    """The labels are those for which motors that hold positions give the demonstrator's torques."""
    torques, positions = (
        dagger.begin(SMALL, stage(tmp_path, steps=80, **settings)) for settings in ({}, {"actions": "position"})
    )
    learned(torques, 80), learned(positions, 80)
    task, first = positions._environment.task, positions._observations[0]
    angles, speeds = first[:, 5:17], first[:, 17 + 6 : 17 + 18]
    assert_array_equal(first, torques._observations[0])
    expected = task.positions(torques._labels[0].astype(float), angles, speeds)
    np.testing.assert_allclose(positions._labels[0], expected, atol=1e-4)
    assert abs(positions._labels[0] - torques._labels[0]).max() > 0.1


def test_what_it_says_comes_near_to_what_the_demonstrator_does(tmp_path):
    row = dataclasses.replace(SMALL, hidden=64, updates=60, last_updates=200)
    figures = learned(dagger.begin(row, stage(tmp_path, steps=640)), 640)
    errors = [each["error"] for each in figures]
    assert errors[-1] < 0.3 * errors[0] < 0.03


def test_a_run_too_short_to_learn_from_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^steps: expected more than 16, as the first 2 control steps of an episode "):
        dagger.begin(SMALL, stage(tmp_path, steps=16))


def test_any_number_of_updates_is_made(tmp_path):
    """Compiled for a number of updates at a time, into which not all fit."""
    row = dataclasses.replace(SMALL, updates=dagger.CHUNK + 3, last_updates=7, round=15)
    learner = dagger.begin(row, stage(tmp_path))
    learned(learner, 120)
    assert int(learner.arrays()["state/moments/count"]) == dagger.CHUNK + 3
    learned(learner, 240)
    assert int(learner.arrays()["state/moments/count"]) == dagger.CHUNK + 3 + 7


def test_half_of_the_rows_act_by_the_demonstrator_and_all_are_labelled(tmp_path):
    learner = dagger.begin(dataclasses.replace(SMALL, noise=0.0), stage(tmp_path))
    environment, acted = learner._environment, []
    step = environment.step
    environment.step = lambda actions: acted.append(actions.copy()) or step(actions)
    learner.advance(80)
    labels, actions = learner.arrays()["labels"], np.array(acted)
    assert_array_equal(actions[:, :4].astype(np.float32), labels[:, :4])
    assert (abs(actions[:, 4:] - labels[:, 4:]).max(axis=-1) > 1e-3).all()
    demonstrator = Demonstrator("leaper", "refined")
    for observation, label in zip(learner.arrays()["observations"], labels, strict=True):
        said = demonstrator.act(environment.task.split(observation))
        assert_array_equal(said.astype(np.float32), label)


def test_an_unknown_demonstrator_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^unknown preset 'tunde'; did you mean 'tuned'"):
        dagger.begin(dataclasses.replace(SMALL, preset="tunde"), stage(tmp_path))


def test_a_run_of_any_body(tmp_path):
    definition = ALGORITHMS["imitation"]._replace(row=SMALL)
    body, folder = generator.random_body(0), tmp_path / "run"
    settings = {"time_limit": 1.0}
    assert train(Run(body, "imitation", definition, "walk", settings, steps=160, evaluate_every=160), folder)
    assert len(run_folder.table(folder, "evaluations")["return"]) == 10
    assert network.load(folder).task == "walk"
