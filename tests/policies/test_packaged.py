"""Policies that come with the package: small, the ones that policies.json names, and as good as it says."""

import json

import numpy as np
import pytest
from tiers import never, tiers

from arc_suite import evaluation, policies
from arc_suite.envs.setup import Setup
from arc_suite.policies.named import PACKAGED
from arc_suite.robots import generator

INDEX = json.loads((PACKAGED / "policies.json").read_text())


def test_all_are_listed_and_small():
    files = {path.stem: path for path in PACKAGED.glob("*.npz")}
    assert files.keys() == INDEX.keys()
    assert sum(path.stat().st_size for path in files.values()) < 600_000
    for name, path in files.items():
        assert INDEX[name]["sha256"] == policies.digest(str(path))
        assert INDEX[name]["command"].startswith(f"arc-suite train --robot={name.partition('-')[0]} ")


@pytest.mark.parametrize("name", tiers(INDEX, never, lambda name: name == "tick-walk"))
def test_they_earn_what_is_listed(name):
    robot, _, task = name.partition("-")
    environment = Setup.of(robot, task).make_vec(10, autoreset_mode="Disabled")
    policy = policies.policy("ppo", robot, task=environment.task.definition, num_envs=10)
    returns = [episode.total for episode in evaluation.episodes_in_batch(environment, policy)]
    assert np.mean(returns) == pytest.approx(INDEX[name]["return"], rel=0.01)


def test_of_another_robot_or_task():
    with pytest.raises(
        ValueError, match=r"^policy ppo: none for tick-gaps \(there are: .*tick-walk.*\); arc-suite train"
    ):
        policies.policy("ppo", "tick", task=Setup.of("tick", "gaps").definition)


def test_of_a_body_made_to_order():
    with pytest.raises(ValueError, match=r"^policy ppo: none for walker_5x2-walk \(there are: "):
        policies.policy("ppo", generator.generate(5, 2))
