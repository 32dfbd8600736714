"""Golden numbers: compiled models exact, short walks at 1e-9."""

import golden
import numpy as np
import pytest

from arc_suite.robots import ROBOTS


@pytest.mark.parametrize("robot", ROBOTS)
def test_numbers_are_the_accepted_ones(robot):
    now, before = golden.present(robot), golden.stored(robot)
    assert now.keys() == before.keys()
    for name, expected in before.items():
        if name.startswith("walk/"):
            np.testing.assert_allclose(now[name], expected, rtol=1e-9, atol=1e-9, err_msg=name)
        else:
            np.testing.assert_array_equal(now[name], expected, err_msg=name)
