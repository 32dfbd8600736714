"""A page of each robot."""

import importlib
import math

from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from website import markdown, observations, players, returns


def page(robot: str, player: str = "") -> str:
    """Return the page of a robot.

    Args:
        robot: its name.
        player: Markdown of a page in which it walks; without one there is a film.
    """
    setup = Setup.of(robot)
    task, model = setup.prepare()
    return markdown.page(
        f"`{robot}`",
        f"{about(robot)} Gymnasium id: `{setup.env_id}`; each task has one.",
        player or f"![{robot}](../films/{robot}.webp)",
        "## Body",
        _body(setup, model),
        "## Joints and actions",
        "An action has one number in [-1, 1] for each joint. It is the share of the joint's greatest torque.",
        _joints(model),
        "## Observation",
        f"Of `walk`: {task.size} numbers. Other tasks add blocks at the end; see the page of each task.",
        observations.listed(task, "Every index"),
        "## Reward",
        "Weights of `walk`. The [page of the task](../walk.md) defines the terms.",
        table(("term", "weight"), ([f"`{k}`", markdown.number(v)] for k, v in task.settings.weights.items())),
        "## Gait",
        "What `walk` prescribes.",
        _gait(task),
        "## Returns",
        "Means and standard deviations, by the [evaluation protocol](../results.md).",
        returns.demonstrators(robots=(robot,)),
        "What the paper publishes for `walk`, and the policy in the package:",
        returns.published(robot),
        "Learners in the committed [studies](../../studies/README.md):",
        returns.learners(robots=(robot,)),
    )


def about(robot: str) -> str:
    """Return what a robot is, in a sentence."""
    return markdown.summary(importlib.import_module(f"arc_suite.robots.{robot}"))


def _body(setup: Setup, model) -> str:
    body = setup.body
    legs = ", ".join(leg.name for leg in body.legs)
    return table(
        ("quantity", "value"),
        [
            ("legs", f"{len(body.legs)}: {legs}"),
            ("joints", f"{model.nu}"),
            ("rigid parts", f"{len(body.part_names)}"),
            ("mass", f"{markdown.number(model.body_mass.sum())} kg"),
            ("standing height h", f"{markdown.number(body.torso.standing_height)} m"),
            ("control step", f"{markdown.number(setup.definition.scene.control_timestep)} s"),
        ],
    )


def _joints(model) -> str:
    lines = []
    for index in range(model.nu):
        joint = model.joint(model.actuator_trnid[index, 0])
        low, high = joint.range
        span = f"{math.degrees(low):.0f} to {math.degrees(high):.0f}"
        numbers = model.actuator_gear[index, 0], joint.damping[0], joint.armature[0]
        lines.append([str(index), f"`{joint.name}`", span, f"{low:.3f} to {high:.3f}", *map(markdown.number, numbers)])
    heads = ("index", "joint", "range, degrees", "range, rad", "torque, N m", "damping, N m s/rad", "armature, kg m^2")
    return table(heads, lines)


def _gait(task) -> str:
    values, settings = task.parameters, task.settings
    offsets = {
        leg.name: phase / math.tau for leg, phase in zip(task.scene.body.legs, values.phase_offsets, strict=True)
    }
    return table(
        ("quantity", "value"),
        [
            ("target velocity v*", f"{markdown.number(values.target_velocity)} m/s"),
            ("velocity band", f"{markdown.number(settings.velocity_band)} m/s"),
            ("frequency", f"{markdown.number(values.gait_frequency)} Hz"),
            ("duty factor", markdown.number(values.duty_factor)),
            ("phase offsets, cycles", markdown.number(offsets)),
            ("a foot stands below", f"{markdown.number(values.stance_threshold)} m"),
            ("healthy heights of the torso", f"{markdown.number(settings.healthy_range)} m"),
        ],
    )


def gallery(frame: str) -> str:
    """Return the page of generated creatures.

    Args:
        frame: Markdown of a page to play in; empty without one.
    """
    return markdown.page(
        "24 generated creatures",
        f"Every program takes these names: `arc-suite render --robot {players.CREATURES[0]} -o a.mp4` renders a walk, "
        f"and `arc-suite animate --robot {players.CREATURES[0]} -o a.glb` exports clips. "
        "Nothing was trained or tuned for them.",
        frame,
        table(
            ("body", "legs", "joints", "mass, kg", "standing height, m", "v*, m/s", "frequency, Hz", "duty factor"),
            map(_creature, players.CREATURES),
        ),
    )


def _creature(name: str) -> list[str]:
    task, model = Setup.of(name).prepare()
    body, gait = task.scene.body, task.parameters
    numbers = model.body_mass.sum(), body.torso.standing_height, *gait[:3]
    return [f"`{name}`", f"{len(body.legs)}", f"{model.nu}", *map(markdown.number, numbers)]
