"""Setups of several bodies: names, what files hold, and the environments that they open."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from arc_suite.envs.bodies import bodies_setup
from arc_suite.envs.bodies.bodies_setup import BodiesSetup
from arc_suite.envs.setup import Setup

SHORT = {"time_limit": 0.5}


@pytest.mark.parametrize(
    ("robot", "several"),
    [
        ("varied:0-3", True),
        ("queen,tick", True),
        ("random:0,varied:1", True),
        ("varied:7", False),
        ("queen", False),
        ("module:family:3", False),
        ("module:family:3-4", True),
        ('{"name": "a,b:1-2"}', False),
    ],
)
def test_names_of_several_bodies(robot, several):
    assert bodies_setup.is_several(robot) is several


def test_it_goes_into_files_and_comes_back():
    setup = BodiesSetup.of("random:0-1,queen", "steer", SHORT)
    assert [body.name for body in setup.bodies] == ["random_0", "random_1", "queen"]
    assert setup.name == "random.0-1+queen" and str(setup) == 'random:0-1,queen, steer, {"time_limit": 0.5}'
    assert bodies_setup.from_dict(setup.to_dict()) == setup
    assert bodies_setup.from_dict(Setup.of("queen").to_dict()) == Setup.of("queen")
    assert bodies_setup.of_any("queen", "steer") == Setup.of("queen", "steer")
    assert setup.provenance()["body_sha256"] != BodiesSetup.of("random:0-2").provenance()["body_sha256"]


def test_bodies_of_validation_are_of_other_seeds():
    assert BodiesSetup.of("varied:0-3").validation(10).robot == "varied:100000-100009"
    assert BodiesSetup.of("varied:0-3,random:0-3").validation(10).robot == "varied:100000-100004,random:100000-100004"
    assert BodiesSetup.of("queen,tick").validation(1).robot == "queen"


def test_flat_environments_go_on_bit_exactly_with_other_ages():
    setup, one, other = BodiesSetup.of("random:0-1", "walk", SHORT), [], []
    environment = setup.make_vec(2, seed=0, autoreset_mode="SameStep")
    environment.reset()
    snapshot = environment.snapshot()
    assert_array_equal(snapshot["steps"], [0, 0])
    environment.restore(snapshot | {"steps": np.array([0, 8])})
    actions = 0.2 * np.random.default_rng(0).standard_normal((6, 2, 48))
    for action in actions[:3]:
        environment.step(action)
    middle = environment.snapshot()
    for found in (one, other):
        environment.restore(middle)
        found += [environment.step(action) for action in actions[3:]]
    for first, second in zip(one, other, strict=True):
        for left, right in zip(first[:4], second[:4], strict=True):
            assert_array_equal(left, right)
    assert not one[0][3].any() or one[0][3][1]
    assert environment.step_limit == environment.task.step_limit


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("random:0-1,quen",), "unknown domain 'quen'; did you mean 'queen'?"),
        (("random:0-1", "wlak"), "unknown task 'wlak'; did you mean 'walk'?"),
        (("random:0-1", "walk", {"actions": "torque"}), "unknown actions of different bodies 'torque'"),
        (("random:3-1",), "domain 'random:3-1': expected seeds in ascending order"),
    ],
)
def test_what_does_not_fit_is_one_line(arguments, message):
    with pytest.raises(ValueError) as error:
        BodiesSetup.of(*arguments)
    assert str(error.value).startswith(message)


def test_flat_tasks_have_no_mirror_image():
    task = BodiesSetup.of("random:0-1").make_vec(2).task
    assert task.size == 664 and task.definition is task
    with pytest.raises(ValueError, match="different bodies have no common mirror image"):
        _ = task.symmetry
