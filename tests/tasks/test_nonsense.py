"""Values of any origin in settings: one short line says what is wrong, however deep or long they are."""

import numpy as np
import pytest

import arc_suite
from arc_suite import checks
from arc_suite.envs.setup import Setup
from arc_suite.tasks import TASKS, modifiers, parameters


def nested(levels=3000):
    value = 0
    for _ in range(levels):
        value = [value]
    return value


def deep(levels=3000):
    value = {}
    for _ in range(levels):
        value = {"a": value}
    return value


NONSENSE = {"nested": nested(), "deep": deep(), "long": "x" * 10**6, "many": [0] * 10**5, "object": object()}
TOGETHER = ("time_limit", "arena", "on_divergence", "random", *modifiers.MODIFIERS)


def assert_one_line(error):
    assert "\n" not in str(error) and len(str(error)) < 1500, str(error)[:2000]


@pytest.mark.parametrize("kind", NONSENSE)
@pytest.mark.parametrize("task", ["walk", "rough"])
def test_settings(task, kind):
    for name in (*TASKS[task].names(), *TOGETHER):
        with pytest.raises(ValueError) as caught:
            arc_suite.load("tick", task, {name: NONSENSE[kind]})
        assert_one_line(caught.value)
        named = {"random": "seed", "exclude_blocks": "block", "observation_noise": "noise"}.get(name, name)
        assert named in str(caught.value) or name in parameters.SHARED_NOISE


@pytest.mark.parametrize("kind", NONSENSE)
def test_arguments(kind):
    value = NONSENSE[kind]
    environment = arc_suite.load("tick", "steer")
    environment.reset(seed=0)
    for call in (
        lambda: Setup.of("tick", "walk", {"gait": value}).definition,
        lambda: environment.command("command", value),
        lambda: environment.change_model({"gravity": value}),
        lambda: environment.change_settings({"gait": value}),
        lambda: environment.reset(seed=value),
        lambda: environment.step(value),
        lambda: checks.name(value, ["walk"], "task"),
        lambda: checks.number("n", value),
        lambda: checks.boolean("b", value),
        lambda: checks.mapping("m", [value]),
    ):
        with pytest.raises(ValueError) as caught:
            call()
        assert_one_line(caught.value)


def test_messages_show_the_beginning_of_values():
    assert checks.preview(3) == "3" and checks.preview("walk") == "'walk'"
    assert checks.preview(np.zeros((2, 2))) == "array([[0., 0.], [0., 0.]])"
    assert checks.preview(nested()) == "a list that cannot be shown"
    assert checks.preview("x" * 10**6) == "'" + "x" * 299


def test_errors_of_a_family_name_family_and_seed():
    def broken(seed):
        raise ValueError("no legs")

    from arc_suite.registry import FAMILIES

    FAMILIES["broken"] = broken
    try:
        with pytest.raises(ValueError) as caught:
            arc_suite.load("broken:7", "walk")
    finally:
        del FAMILIES["broken"]
    assert str(caught.value) == "robot 'broken:7': no legs"
