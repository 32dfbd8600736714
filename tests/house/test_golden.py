"""Golden numbers: compiled models exact, short walks at 1e-9; on every platform the first step at 1e-6."""

import golden
import numpy as np
import platforms
import pytest

from arc_suite.robots import ROBOTS


@platforms.golden
@pytest.mark.parametrize("robot", ROBOTS)
def test_numbers_are_the_accepted_ones(robot):
    now, before = golden.present(robot), golden.stored(robot)
    assert now.keys() == before.keys()
    for name, expected in before.items():
        if name.startswith("walk/"):
            np.testing.assert_allclose(now[name], expected, rtol=1e-9, atol=1e-9, err_msg=name)
        else:
            np.testing.assert_array_equal(now[name], expected, err_msg=name)


@pytest.mark.parametrize("robot", ROBOTS)
def test_one_step_is_the_accepted_one_on_every_platform(robot):
    before = golden.stored(robot)
    for name, now in golden.walked(robot, steps=1).items():
        np.testing.assert_allclose(now, before[name][:1], rtol=1e-6, atol=1e-6, err_msg=name)
