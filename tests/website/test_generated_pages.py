"""Pages of robots and tasks follow from the code's own tables."""

import re

import numpy as np
import pytest
from website import observations, reference, robots, sources, tasks

import arc_suite
from arc_suite import registry
from arc_suite.cli.programs import PROGRAMS
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, modifiers, setting_table, walk


def row(page, first, section=""):
    """The further cells of the row of a page, or of a section of it, whose first cell is given."""
    page = page.partition(f"\n## {section}\n")[2].partition("\n## ")[0] if section else page
    (found,) = re.findall(rf"^\| {re.escape(first)} \| (.*) \|$", page, re.MULTILINE)
    return found.split(" | ")


def test_a_changed_weight_changes_the_pages(monkeypatch):
    before = tasks.page("walk"), robots.page("tick")
    assert [row(page, "`gait_bonus`")[0] for page in before] == ["1.5", "1.5"]
    monkeypatch.setitem(walk.Walk.weights, "gait_bonus", 2.25)
    after = tasks.page("walk"), robots.page("tick")
    assert [row(page, "`gait_bonus`")[0] for page in after] == ["2.25", "2.25"]


@pytest.mark.parametrize("task", ["walk", "steer", "navigate", "rough"])
@pytest.mark.parametrize("robot", ["queen", "leaper"])
def test_every_entry_of_an_observation_has_its_name(robot, task):
    definition = Setup.of(robot, task).definition
    entries = observations.entries(definition)
    sizes = {block: sum(entry.block == block for entry in entries) for block in definition.sizes}
    assert sizes == definition.sizes
    assert len({(entry.block, entry.name) for entry in entries}) == len(entries)


def test_the_named_entries_hold_what_they_say():
    environment = arc_suite.load("tick", "walk", {"random": 1}, {"flat_observation": True})
    timestep = environment.reset()
    for _ in range(5):
        timestep = environment.step(np.full(18, 0.3))
    entries, physics = observations.entries(environment.task.definition), environment.physics
    vector = timestep.observation["observations"]
    value = {entry.name: vector[index] for index, entry in enumerate(entries)}
    joints = environment.task.body.joint_names
    assert [value[f"angle of {name}"] for name in joints] == [physics.named.data.qpos[name][0] for name in joints]
    assert [value[f"velocity of {name}"] for name in joints] == [physics.named.data.qvel[name][0] for name in joints]
    force = physics.named.data.cfrc_ext["l1_foot"][5]
    assert value["force on l1_foot, z"] == np.clip(force, -1.0, 1.0)


@pytest.mark.parametrize("name", TASKS)
def test_the_page_of_a_task_is_complete(name):
    """Every block, term, metric and setting has a row; a new one without a text fails here."""
    page, task = tasks.page(name), Setup.of("bastion", name).definition
    for block, size in task.sizes.items():
        assert row(page, f"`{block}`", "Observation")[1] == str(size)
    for term in task.settings.weights:
        assert row(page, f"`{term}`", "Reward")[-1]
    for setting in TASKS[name].names():
        assert row(page, f"`{setting}`", "Settings")[-1]
    headings = re.findall("^## (.*)$", page, re.MULTILINE)
    assert headings == ["Parts", "Observation", "Reward", "End", "Metrics", "Settings", "Demonstrators", "Learners"]


def test_the_page_of_settings_names_every_modifier():
    page = reference.settings_page()
    assert all(row(page, f"`{name}`")[-1] for name in (*modifiers.MODIFIERS, "time_limit", "arena", "random"))


BOUNDED = [
    ("rough", "difficulty"), ("rough", "level"), ("rough", "terrain_seed"), ("rough", "rise"), ("slopes", "slope"),
    ("walk", "duty_factor"), ("walk", "gait_frequency"), ("walk", "joint_angle_noise"), ("walk", "kicks"),
    ("walk", "motor_strength"), ("walk", "friction"), ("walk", "mass"), ("walk", "observation_noise"),
    ("walk", "delay"), ("steer", "cost_limit"),
]  # fmt: skip


@pytest.mark.parametrize(("task", "name"), BOUNDED)
def test_bounds_are_those_of_the_task(task, name):
    definition = Setup.of("tick", task).definition
    settings = [*setting_table.own_settings(definition), *setting_table.shared_settings()]
    (limits,) = [setting.bounds for setting in settings if setting.name == name]
    low, _, high = limits.removeprefix("from ").removeprefix("above ").partition(" to ")
    outside = [float(low) - 1, *([float(high) + 1] if high else [])]
    for value in outside:
        with pytest.raises(ValueError, match=name):
            Setup.of("tick", task, {name: int(value) if value == int(value) else value}).prepare()


def test_robots_have_the_torques_and_ranges_of_their_specs():
    for robot, body in ROBOTS.items():
        page = robots.page(robot)
        for index, joint in enumerate(joint for leg in body.legs for joint in leg.joints):
            name, degrees, _, torque, *_ = row(page, str(index), "Joints and actions")
            assert name.strip("`") == body.joint_names[index]
            assert degrees == f"{joint.range_deg[0]:.0f} to {joint.range_deg[1]:.0f}"
            assert float(torque) == pytest.approx(joint.motor.gear, rel=1e-3)


def test_the_gallery_has_bodies_of_the_family():
    page = robots.gallery("")
    legs, joints, mass, *_ = row(page, "`varied:7`")
    body = registry.body_of("varied:7")
    assert (int(legs), int(joints)) == (len(body.legs), len(body.joint_names))
    assert float(mass) > 0.0


def test_the_front_page_has_every_page():
    page = sources.front_page(walks=False)
    listed = set(re.findall(r"^[\w./-]+$", page, re.MULTILINE))
    expected = {path.stem for path in (sources.ROOT / "docs").glob("*.md")} - {"README", *TASKS}
    assert {f"docs/{name}" for name in expected} <= listed
    assert set(sources.BELOW["docs/tasks.md"]) == set(TASKS)
    assert "iframe" in sources.front_page(walks=True)
    pages_of_studies = {path.stem for path in (sources.ROOT / "studies").glob("*.md")} - {"README"}
    assert pages_of_studies <= set(sources.BELOW["studies/README.md"])


def test_links_that_sphinx_can_follow():
    docs = sources.ROOT / "docs"
    text = (
        "[a](README.md), [b](../README.md#tasks), [c](../examples/godot), [d](../tests), [e](walk.md#end), ![f](x.png)"
    )
    front = "[a](../index.md), [b](../index.md), [c](../examples/godot/README.md), d, [e](walk.md#end), ![f](x.png)"
    assert sources.resolve_links(text, docs) == front


@pytest.mark.release
def test_the_command_line_has_every_program():
    page = reference.commands_page()
    assert re.findall("^## `(.*)`$", page, re.MULTILINE) == list(PROGRAMS)
    assert page.count("  -h, --help ") == len(PROGRAMS)
