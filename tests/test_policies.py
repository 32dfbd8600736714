"""Untrained policies by name."""

import numpy as np
import pytest

import arc_suite
from arc_suite.policies import POLICIES, policy


@pytest.mark.parametrize("name", POLICIES)
def test_policies_act_on_time_steps(name):
    environment = arc_suite.load("leaper", "walk", {"random": 0})
    time_step = environment.reset()
    first, second = (policy(name, "leaper", seed=1)(time_step) for _ in range(2))
    environment.action_spec().validate(first)
    np.testing.assert_array_equal(first, second)
    assert (name == "zero") == (not first.any())


def test_random_policies_differ_by_seed():
    assert (policy("random", "tick", seed=1)(None) != policy("random", "tick", seed=2)(None)).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cgp", "queen"), "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random)"),
        (
            ("zero", "quen"),
            "unknown robot 'quen'; did you mean 'queen'? (there are: queen, bastion, tick, leaper)",
        ),
        (
            ("cpg", "queen", "midium"),
            "unknown preset 'midium'; did you mean 'medium'? (there are: slow, medium, fast)",
        ),
    ],
)
def test_unknown_names_are_named(arguments, message):
    with pytest.raises(ValueError) as error:
        policy(*arguments)
    assert str(error.value) == message
