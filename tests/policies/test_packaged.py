"""Policies that come with the package: small, the ones that policies.json names, and as good as it says."""

import json

import numpy as np
import pytest
from tiers import never, tiers

from arc_suite import evaluation, policies
from arc_suite.bodies import generator, universal
from arc_suite.envs.setup import Setup
from arc_suite.policies.network import PACKAGED

INDEX = json.loads((PACKAGED / "policies.json").read_text())


def test_all_are_listed_and_small():
    files = {path.stem: path for path in PACKAGED.glob("*.npz")}
    assert files.keys() == INDEX.keys()
    assert sum(path.stat().st_size for path in files.values()) < 1_000_000
    for name, path in files.items():
        assert INDEX[name]["sha256"] == policies.digest(str(path))
        robot = name.partition("-")[0]
        assert INDEX[name]["command"].startswith(f"arc-suite train --robot={robot.replace('universal', 'varied:')}")


ROBOTS = [name for name in INDEX if not name.startswith("universal")]


@pytest.mark.parametrize("name", tiers(ROBOTS, never, lambda name: name == "tick-walk"))
def test_they_earn_what_is_listed(name):
    robot, _, task = name.partition("-")
    environment = Setup.of(robot, task).make_vec(10, autoreset_mode="Disabled")
    policy = policies.policy("ppo", robot, task=environment.task.definition, num_envs=10)
    returns = [episode.total for episode in evaluation.episodes_in_batch(environment, policy)]
    spread = 0.03 if task == "recover" else 0.01  # falls differ, and tests draw from few
    assert np.mean(returns) == pytest.approx(INDEX[name]["return"], rel=spread)  # which is of a hundred episodes


@pytest.mark.release
@pytest.mark.parametrize("task", ["walk", "steer"])
def test_those_of_any_body_earn_what_is_listed(task):
    packaged = universal.load("universal", Setup.of("queen", task).definition)
    count = evaluation.EPISODES  # as many bodies; fewer are others
    environment = packaged.setup.validation(count).make_vec(count, autoreset_mode="Disabled")
    returns = [episode.total for episode in evaluation.episodes_in_batch(environment, packaged)]
    assert np.mean(returns) == pytest.approx(INDEX[f"universal-{task}"]["return"], rel=0.01)


BODIES = [
    generator.generate(8, 3),
    generator.random_body(200_003),
    generator.generate(5, 3).replace(name="strong", agility=3.0),
    generator.generate(5, 3).replace(name="weak", agility=0.5),
]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
@pytest.mark.parametrize("task", ["walk", "steer"])
def test_any_body_walks_by_it(body, task):
    """Bodies that it was not trained with."""
    environment = Setup.of(body, task).load()
    policy = policies.policy("universal", body, task=environment.task.definition)
    assert evaluation.run(environment, policy, 0, 100).length == 100
    assert environment.task.progress["speed" if task == "walk" else "tracking"] > 0.1


def test_bodies_with_motors_of_their_own_are_warned_of():
    line = r"^policy universal: may fall or hardly walk, as queen brings motors or timesteps of its own$"
    with pytest.warns(UserWarning, match=line):
        policies.policy("universal", "queen")


def test_of_another_robot_task_or_body():
    line = r"^policy ppo: none for tick-gaps \(there are: .*tick-walk.*\); arc-suite train .*universal"
    with pytest.raises(ValueError, match=line):
        policies.policy("ppo", "tick", task=Setup.of("tick", "gaps").definition)
    with pytest.raises(ValueError, match=r"^policy ppo: none for walker_5x2-walk \(there are: "):
        policies.policy("ppo", generator.generate(5, 2))
