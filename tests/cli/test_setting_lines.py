"""`arc-suite settings` prints value, bounds and meaning of every setting of a task."""

import re

import programs
import pytest

import arc_suite
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, setting_table
from arc_suite.tasks.modifiers import MODIFIERS
from arc_suite.tasks.parameters import PARAMETERS

_LINE = re.compile(r"^(\w+) = (.*?)(?:  \[(.*)\])?\n    (.*)$", re.MULTILINE)


def read_settings(*arguments, **keywords):
    """Return (value, bounds, first line of the meaning) by name of the setting."""
    text = programs.passed(programs.arc_suite("settings", *arguments, **keywords))
    return {name: (value, bounds, meaning) for name, value, bounds, meaning in _LINE.findall(text)}


@pytest.mark.parametrize("task", ["walk", "mimic", "recover", pytest.param("stairs", marks=pytest.mark.slow)])
def test_every_setting_has_a_meaning(task):
    settings = read_settings(f"--task={task}")
    names = (*TASKS[task].names(), "random", "time_limit", "arena", "on_divergence", *MODIFIERS)
    assert list(settings) == list(dict.fromkeys(names))
    assert all(meaning.strip() for _, _, meaning in settings.values())


@pytest.mark.parametrize("robot", ["tick", "leaper"])
def test_values_are_those_of_the_robot(robot):
    settings = read_settings(f"--robot={robot}")
    published = PARAMETERS["walk"][robot]
    for name in ("target_velocity", "gait_frequency", "stance_threshold", "velocity_band"):
        assert float(settings[name][0]) == published[name]
    assert settings["duty_factor"] == ("0.6", "0 to 1", "share of a cycle that a foot spends in stance")
    assert settings["time_limit"][0] == "50"


def test_a_setting_shows_what_follows_from_it():
    settings = read_settings("--robot=tick", "--set=gait=wave", "--set=friction=0.5,1")
    assert settings["gait"][0] == "wave" and settings["friction"][0] == "(0.5, 1)"
    assert float(settings["duty_factor"][0]) == pytest.approx(5 / 6, abs=1e-4)


@pytest.mark.parametrize(
    ("task", "name", "lowest", "refused_value", "text"),
    [
        ("steer", "target_velocity", 0.001, 0.0009, "0.001 to 1000"),
        ("walk", "target_velocity", -1000.0, -1001.0, "-1000 to 1000"),
        ("leap", "width", 0.0225, 0.022, "0.0225 to 1000"),
        ("steer", "cost_limit", 1e-6, 0.0, "above 0"),
        ("walk", "velocity_band", 1e-6, 0.0, "above 0"),
        ("walk", "time_limit", 1e-6, 0.0, "above 0"),
    ],
)
def test_bounds_are_those_that_the_task_takes(task, name, lowest, refused_value, text):
    definition = arc_suite.load("tick", task).task.definition
    settings = [*setting_table.own_settings(definition), *setting_table.shared_settings()]
    assert {setting.name: setting.bounds for setting in settings}[name] == text
    arc_suite.load("tick", task, {name: lowest})
    with pytest.raises(ValueError, match=f"^{name}: expected a"):
        arc_suite.load("tick", task, {name: refused_value})


def test_settings_of_bodies_and_tasks_of_users(tmp_path):
    (tmp_path / "ice.py").write_text(
        "import arc_suite\nfrom arc_suite.tasks.walk import Walk\n\n\nclass Ice(Walk):\n"
        '    name = "ice"\n    modifiers = {"friction": (0.05, 0.2)}\n\n\n'
        "arc_suite.register(module=__name__, tasks=(Ice,))\n"
    )
    settings = read_settings("--spec=spider", "--task=ice:ice", cwd=tmp_path)
    assert settings["friction"][0] == "(0.05, 0.2)"
    step = arc_suite.load("spider", "walk").control_timestep()
    assert float(settings["time_limit"][0]) == pytest.approx(1000 * step, rel=1e-3)
    assert float(settings["target_velocity"][0]) not in [PARAMETERS["walk"][name]["target_velocity"] for name in ROBOTS]


def test_meanings_come_from_a_class_and_its_bases():
    class Base:
        """Base.

        Attributes:
            first: one
                of two lines.
            second, third: m.
        """

    class Derived(Base):
        """Derived.

        Attributes:
            second: rad.
        """

    expected = {"first": "one of two lines", "second": "rad", "third": "m"}
    assert setting_table.attribute_meanings(Derived) == expected
