"""The program that gives settings absurd values tells what has an effect from what has none."""

import absurd
import numpy as np
import pytest
from absurd import DEFAULT, EFFECT, IDLE, NAMELESS, REFUSED, TRACEBACK, Case

from arc_suite.tasks import TASKS
from arc_suite.tasks.modifiers import MODIFIERS


@pytest.mark.parametrize(
    ("setting", "value", "expected"),
    [
        ("kicks", 2.0, EFFECT),
        ("kicks", np.uint8(1), EFFECT),
        ("time_limit", 1e6, EFFECT),
        ("actuator_failure", 3, EFFECT),
        ("on_divergence", "truncate", EFFECT),
        ("kicks", 0, DEFAULT),
        ("mass", [1, 1.0], DEFAULT),
        ("weights", {"control": -0.05}, DEFAULT),
        ("gait", None, DEFAULT),
        ("kicks", "1", REFUSED),
        ("random", -1, REFUSED),
        ("time_limit", np.array([1.0, np.inf]), REFUSED),
        ("gait", np.array([]), REFUSED),
        ("palette", "9" * 5000, REFUSED),
    ],
)
def test_what_comes_of_a_value_is_told(setting, value, expected):
    assert absurd.outcome(Case("tick", "walk", setting, value)) == expected


def test_defaults_of_all_tasks_are_known():
    noises = {task: absurd.default_values("tick", task).get("base_noise") for task in TASKS}
    assert noises["walk"] == 0.02 and noises["mimic"] == 0.006 and noises["recover"] is None


def test_faults_are_told(monkeypatch):
    case = Case("tick", "walk", "kicks", 3.0)
    monkeypatch.setitem(MODIFIERS["kicks"].defaults, "kicks", 0.0)
    monkeypatch.setattr(absurd, "has_effect", lambda case, seed: False)
    assert absurd.outcome(case) == IDLE
    for error, expected in (
        (ValueError("kicks: expected"), REFUSED),
        (TypeError("kicks: expected"), REFUSED),
        (ValueError("no number"), NAMELESS),
        (ValueError("kicks:\nexpected"), TRACEBACK),
        (ValueError("kicks" * 1000), TRACEBACK),
        (KeyError("kicks"), TRACEBACK),
    ):

        def raise_error(case, seed, error=error):
            raise error

        monkeypatch.setattr(absurd, "has_effect", raise_error)
        assert absurd.outcome(case) == expected


def test_all_settings_of_all_tasks_take_turns():
    count = sum(len(absurd.names_of_settings(task)) for task in TASKS)
    cases = [absurd.draw_case(0, index) for index in range(count)]
    assert len({(case.task, case.setting) for case in cases}) == count
    assert {case.setting for case in cases} >= {"time_limit", "random", "arena", "on_divergence", *MODIFIERS}
    assert repr(absurd.draw_case(3, 7)) == repr(absurd.draw_case(3, 7)) != repr(absurd.draw_case(4, 7))


@pytest.mark.parametrize("index", range(0, 10_000, 80))
def test_some_values(index):
    assert absurd.outcome(absurd.draw_case(0, index)) not in absurd.FAULTS
