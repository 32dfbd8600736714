"""Golden numbers: compiled models exact, short walks at 1e-9; on every platform the first step at 1e-6.

Digests of every task and demonstrator; see tests/digests.py.
"""

import functools

import digests
import golden
import numpy as np
import platforms
import pytest
from tiers import turn

from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

QUICK = ("tick steer", "leaper roam")


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


@functools.cache
def accepted():
    return digests.stored()


@functools.cache
def same_arithmetic():
    return accepted()["arithmetic"] == digests.arithmetic()


def marked(name, case):
    """`make check` has two cases, `make test` each task on robots in turn, `make check-release` the rest."""
    plain = not case.task_kwargs and case.command is None and case.preset is None
    slow = plain and turn(case.robot, ROBOTS, list(TASKS).index(case.task))
    marks = [] if name in QUICK else pytest.mark.slow if slow else pytest.mark.release
    return pytest.param(name, case, marks=marks, id=name)


def test_every_case_is_stored():
    assert accepted()["cases"].keys() == digests.cases().keys()


# Cases of a new robot or task have no digest yet: the test above alone tells.
@pytest.mark.parametrize(
    ("name", "case"), [marked(*item) for item in digests.cases().items() if item[0] in accepted()["cases"]]
)
def test_digests_are_the_accepted_ones(name, case):
    now, before = digests.digested(case), dict(accepted()["cases"][name])
    if same_arithmetic():
        assert now == before
    else:  # bits differ from processor to processor, and soon so do walks
        # Without a golden platform a reset, which has no reward, and one step.
        steps = digests.FIRST // 2 if platforms.GOLDEN else 2
        first = [[np.nan if reward is None else reward for reward in run["first"][:steps]] for run in (now, before)]
        np.testing.assert_allclose(*first, rtol=1e-6, atol=1e-6)
