"""A page of each robot."""

import importlib
import math

from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.tasks import setting_table
from website import markdown, observations, players, returns


def page(robot: str, player: str = "") -> str:
    """Return the page of a robot.

    Args:
        robot: name of the robot.
        player: HTML that shows a page in which the robot walks; if empty, the page has a moving picture.
    """
    setup = Setup.of(robot)
    task, model = setup.prepare()
    return markdown.page(
        f"`{robot}`",
        f"{description(robot)} Gymnasium id: `{setup.env_id}`; each task has one.",
        player or f"![{robot}](../films/{robot}.webp)",
        "## Body",
        _body(setup, model),
        "## Joints and actions",
        "An action has one number in [-1, 1] for each joint. It is the share of the joint's greatest torque.",
        _joints(model),
        "## Observation",
        f"Of `walk`: {task.size} numbers. Other tasks add blocks at the end; see the page of each task.",
        observations.entries_table(task, "Every index"),
        "## Reward",
        "Weights of `walk`. The [page of the task](../walk.md) defines the terms.",
        _weights(task),
        "## Gait",
        "What `walk` prescribes.",
        _gait(task),
        "## Returns",
        "Means and standard deviations, by the [evaluation protocol](../results.md).",
        returns.demonstrators(robots=(robot,)),
        "What the paper publishes for `walk`, and the policy in the package:",
        returns.paper_table(robot),
        "Learners in the committed [studies](../../studies/README.md):",
        returns.learners(robots=(robot,)),
    )


def description(robot: str) -> str:
    """Return what a robot is, in a sentence."""
    module = importlib.import_module(f"arc_suite.robots.{robot}")
    return markdown.summary(module)


def _body(setup: Setup, model) -> str:
    """Return the table of the body's sizes and numbers of parts."""
    body = setup.body
    legs = ", ".join(leg.name for leg in body.legs)
    return table(
        ("quantity", "value"),
        [
            ("legs", f"{len(body.legs)}: {legs}"),
            ("joints", f"{model.nu}"),
            ("rigid parts", f"{len(body.part_names)}"),
            ("mass", f"{setting_table.format_value(model.body_mass.sum())} kg"),
            ("standing height h", f"{setting_table.format_value(body.torso.standing_height)} m"),
            ("control step", f"{setting_table.format_value(setup.definition.scene.control_timestep)} s"),
        ],
    )


def _joints(model) -> str:
    """Return the table of the joints, in the order of the action."""
    lines = []
    for index in range(model.nu):
        joint = model.joint(model.actuator_trnid[index, 0])
        low, high = joint.range  # rad
        line = [
            str(index),
            f"`{joint.name}`",
            f"{math.degrees(low):.0f} to {math.degrees(high):.0f}",
            f"{low:.3f} to {high:.3f}",
            setting_table.format_value(model.actuator_gear[index, 0]),
            setting_table.format_value(joint.damping[0]),
            setting_table.format_value(joint.armature[0]),
        ]
        lines.append(line)
    heads = ("index", "joint", "range, degrees", "range, rad", "torque, N m", "damping, N m s/rad", "armature, kg m^2")
    return table(heads, lines)


def _weights(task) -> str:
    """Return the table of the weights of the reward's terms."""
    lines = [[f"`{term}`", setting_table.format_value(weight)] for term, weight in task.settings.weights.items()]
    return table(("term", "weight"), lines)


def _gait(task) -> str:
    """Return the table of the gait and the heights that a task prescribes."""
    parameters = task.parameters
    settings = task.settings
    offsets = {}  # cycles, by name of the leg
    for leg, phase in zip(task.scene.body.legs, parameters.phase_offsets, strict=True):
        offsets[leg.name] = phase / math.tau
    return table(
        ("quantity", "value"),
        [
            ("target velocity v*", f"{setting_table.format_value(parameters.target_velocity)} m/s"),
            ("velocity band", f"{setting_table.format_value(settings.velocity_band)} m/s"),
            ("frequency", f"{setting_table.format_value(parameters.gait_frequency)} Hz"),
            ("duty factor", setting_table.format_value(parameters.duty_factor)),
            ("phase offsets, cycles", setting_table.format_value(offsets)),
            ("a foot stands below", f"{setting_table.format_value(parameters.stance_threshold)} m"),
            ("healthy heights of the torso", f"{setting_table.format_value(settings.healthy_range)} m"),
        ],
    )


def gallery(frame: str) -> str:
    """Return the page of generated creatures.

    Args:
        frame: HTML that shows a page to play in; empty if there is none.
    """
    return markdown.page(
        "24 generated creatures",
        f"Every program takes these names: `arc-suite render --robot {players.CREATURES[0]} -o a.mp4` renders a walk, "
        f"and `arc-suite animate --robot {players.CREATURES[0]} -o a.glb` exports clips. "
        "Nothing was trained or tuned for them.",
        frame,
        table(
            ("body", "legs", "joints", "mass, kg", "standing height, m", "v*, m/s", "frequency, Hz", "duty factor"),
            [_creature_cells(name) for name in players.CREATURES],
        ),
    )


def _creature_cells(name: str) -> list[str]:
    """Return the cells of a creature's line in the table of creatures."""
    task, model = Setup.of(name).prepare()
    body = task.scene.body
    return [
        f"`{name}`",
        f"{len(body.legs)}",
        f"{model.nu}",
        setting_table.format_value(model.body_mass.sum()),
        setting_table.format_value(body.torso.standing_height),
        setting_table.format_value(task.parameters.target_velocity),
        setting_table.format_value(task.parameters.gait_frequency),
        setting_table.format_value(task.parameters.duty_factor),
    ]
