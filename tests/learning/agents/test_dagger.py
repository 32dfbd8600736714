"""DAgger: imitation of demonstrators."""

import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning.agents import dagger, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.policies import network
from arc_suite.tasks.modifiers import Control

SMALL = {"num_envs": 8, "round": 10, "left_out": 2, "updates": 20, "last_updates": 40, "batch": 64, "hidden": 16}


@pytest.fixture
def begun(tmp_path):
    """A function that begins to learn."""

    def begin(robot="leaper", task="walk", changes=(), steps=240, checkpoint=None, steps_before=0, **settings):
        setup, context = Setup.of(robot, task, settings), {"seed": 3, "checkpoint": checkpoint}
        return learning("dagger", SMALL | dict(changes), tmp_path, setup, steps, steps, steps_before, **context)

    return begin


@pytest.mark.parametrize(("robot", "task"), [("leaper", "walk"), ("tick", "steer")])
def test_it_resumes_bit_exactly(begun, robot, task):
    """The demonstrators of steer have a memory; episodes of 11 steps begin and end meanwhile."""
    whole, first = (begun(robot, task, time_limit=0.55) for _ in range(2))
    arrays = {name: array.copy() for name, array in first.until(80).checkpoint.items()}
    second = begun(robot, task, time_limit=0.55, checkpoint=arrays, steps_before=80)
    second.advance()
    assert second.step == 160
    for other in (first, second):
        for name, array in whole.until(240).checkpoint.items():
            assert_array_equal(other.until(240).checkpoint[name], array, err_msg=name)
    assert whole.latest.checkpoint["ages"].max() == 10


def test_labels_are_positions_where_actions_are(begun):
    """Those for which motors that hold positions give the demonstrator's torques."""
    torques, positions = (begun(steps=80, **settings) for settings in ({}, {"actions": "position"}))
    one, other = torques.until(80).checkpoint, positions.until(80).checkpoint
    first = other["observations"][0]
    assert_array_equal(first, one["observations"][0])
    expected = positions.environment.task.definition.modifier(Control).positions(
        one["labels"][0].astype(float), first[:, 5:17], first[:, 17 + 6 : 17 + 18]
    )
    assert_allclose(other["labels"][0], expected, atol=1e-4)
    assert abs(other["labels"][0] - one["labels"][0]).max() > 0.1


def test_the_error_falls(begun):
    agent = begun(changes={"hidden": 64, "updates": 60, "last_updates": 200}, steps=640)
    first = agent.advance().metrics["error"]
    assert agent.until(640).metrics["error"] < 0.4 * first < 0.04


def test_a_run_too_short_to_learn_from_is_refused(begun):
    with pytest.raises(ValueError, match=r"^steps: expected more than 16, as the first 2 control steps of an episode "):
        begun(steps=16).advance()


@pytest.mark.parametrize("robot", ["leaper", "leaper,tick"])
def test_episodes_too_short_to_learn_from_are_refused(begun, robot):
    """Without the refusal such a run makes no update and says nothing."""
    settings = {"robot": robot, "time_limit": 0.5, "steps": 320}
    with pytest.raises(ValueError, match=r"^left_out: expected fewer than the 10 control steps of an episode, got 10$"):
        begun(changes={"left_out": 10}, **settings).advance()
    assert int(begun(changes={"left_out": 9}, **settings).until(320).checkpoint["state/moments/count"])


def test_any_number_of_updates_is_made(begun):
    """Also one that no whole number of compiled calls makes."""
    agent = begun(changes={"updates": dagger.UPDATES_PER_CALL + 3, "last_updates": 7, "round": 15})
    for step, count in ((120, dagger.UPDATES_PER_CALL + 3), (240, dagger.UPDATES_PER_CALL + 3 + 7)):
        assert int(agent.until(step).checkpoint["state/moments/count"]) == count


def test_the_demonstrator_acts_in_half_of_the_environments_and_labels_all(begun, monkeypatch):
    acted, step = [], VectorEnv.step
    monkeypatch.setattr(VectorEnv, "step", lambda self, actions: acted.append(actions.copy()) or step(self, actions))
    agent = begun(changes={"noise": 0.0})
    arrays, actions = agent.advance().checkpoint, np.array(acted)
    labels = arrays["labels"]
    assert_array_equal(actions[:, :4].astype(np.float32), labels[:, :4])
    assert (abs(actions[:, 4:] - labels[:, 4:]).max(axis=-1) > 1e-3).all()
    demonstrator = Demonstrator("leaper", "refined")
    for count, (observation, label) in enumerate(zip(arrays["observations"], labels, strict=True)):
        expected = demonstrator.act(agent.environment.task.split(observation)).astype(np.float32)
        going = arrays["ages"][count] == count  # elsewhere the body fell, and the demonstrator began again
        assert going[:4].all()
        assert_array_equal(expected[going], label[going])


def test_an_unknown_demonstrator_is_refused(begun):
    with pytest.raises(ValueError, match=r"^unknown preset 'tunde'; did you mean 'tuned'"):
        begun(changes={"preset": "tunde"}).advance()


def test_a_run_of_any_body(tmp_path):
    setup, folder = Setup.of(generator.random_body(0), "walk", {"time_limit": 1.0}), tmp_path / "run"
    assert train(Configuration.of(setup, "dagger", SMALL, steps=160, evaluate_every=160), folder)
    assert len(run_folder.table(folder, "evaluations")["return"]) == 10
    assert network.load(folder).setup == setup.with_settings({"exclude_blocks": ["contact_forces"]})


def test_a_run_on_trenches(tmp_path):
    """The demonstrator remembers the ground as it saw it: at -inf where it has seen none yet."""
    setup, folder = Setup.of("tick", "gaps", {"time_limit": 1.0}), tmp_path / "run"
    assert train(Configuration.of(setup, "dagger", SMALL, steps=40, evaluate_every=40), folder)
    with np.load(folder / run_folder.CHECKPOINT) as checkpoint:
        assert any(np.isneginf(array).any() for name, array in checkpoint.items() if name.startswith("teacher/"))
