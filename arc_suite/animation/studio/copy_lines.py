"""Lines to copy: Python and a command that make the creature of a sketch outside of the studio."""

import json
import shlex
from typing import Any

from arc_suite.animation.studio.sketch import (
    DEFAULT_CHOICE,
    FILE,
    LEGS,
    RANDOM,
    Sketch,
    chosen_preset,
    make_body,
    make_settings,
    shape_changes,
    source_body,
    visual_changes,
)
from arc_suite.bodies import generator
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import EXAMPLES


def spec_file_name(body: Body) -> str:
    """Return the name of a body's spec file."""
    return f"{body.name}.json"


def python_lines(sketch: Sketch) -> str:
    """Return Python that opens the same environment and policy.

    A body from a file is read from its saved spec, `spec_file_name`, ground from the file that it came from.
    """
    code, names_of_body = _body_code(sketch)
    policy_code, names_of_policy = _policy_code(sketch)
    names_by_package = {**names_of_policy, **names_of_body}
    settings = _settings_with_files(sketch, make_body(sketch))
    settings_argument = f", {settings!r}" if settings else ""
    imports = "".join(
        f"from {package} import {', '.join(names)}\n" for package, names in names_by_package.items() if names
    )
    return (
        f"import arc_suite\n{imports}\n"
        f"body = {code}\n"
        f'environment = arc_suite.load(body, "{sketch.task}"{settings_argument})\n'
        f"policy = {policy_code}\n"
    )


def _policy_code(sketch: Sketch) -> tuple[str, dict[str, list[str]]]:
    """Return a Python expression that makes the policy of `creature.load_policy`, and names to import by package."""
    preset = chosen_preset(sketch)
    task = "environment.task.definition"
    if sketch.policy == "cpg":
        code = f"paced_demonstrator({task}, {preset!r}, {sketch.speed!r})"
        return code, {"arc_suite.animation.pacing": ["paced_demonstrator"]}
    return f"policies.policy({sketch.policy!r}, body, {preset!r}, task={task})", {"arc_suite": ["policies"]}


def _body_code(sketch: Sketch) -> tuple[str, dict[str, list[str]]]:
    """Return a Python expression that makes the body, and the names that the lines import, by package."""
    original_body = source_body(sketch)
    bodies_names: list[str] = []  # of the package arc_suite.bodies
    robots_names: list[str] = []  # of the package arc_suite.robots
    if sketch.source == LEGS:
        layout_argument = "" if sketch.layout == DEFAULT_CHOICE else f', "{sketch.layout}"'
        bodies_names.append("generator")
        code = f"generator.generate({sketch.legs}, {sketch.links}{layout_argument})"
    elif sketch.source == RANDOM:
        bodies_names.append("families")
        code = f"families.sound_body({sketch.seed})"
    elif sketch.source in ROBOTS:
        robots_names.append("ROBOTS")
        code = f'ROBOTS["{sketch.source}"]'
    elif sketch.source == FILE:
        return f'spec_files.load_body("{spec_file_name(make_body(sketch))}")', {"arc_suite.robots": ["spec_files"]}
    else:
        robots_names.append("spec_files")
        code = f'spec_files.load_body("{sketch.source}")'
    changes = shape_changes(sketch, original_body)
    if changes:
        arguments = ", ".join(f"{name}={value!r}" for name, value in changes.items())
        bodies_names.append("shaping")
        code = f"shaping.shaped({code}, {arguments})"
    looks = visual_changes(sketch, original_body)
    if looks:
        code = f"{code}.replace({', '.join(f'{name}={value!r}' for name, value in looks.items())})"
    return code, {"arc_suite.bodies": bodies_names, "arc_suite.robots": robots_names}


def command_line(sketch: Sketch) -> str:
    """Return the command that shows the same creature in a window.

    A body that the program cannot name or make is read from its saved spec, `spec_file_name`.
    """
    body = make_body(sketch)
    is_unchanged = body == source_body(sketch)
    if sketch.source in ROBOTS and is_unchanged:
        body_flags = ["--robot", sketch.source]
    elif sketch.source in EXAMPLES and is_unchanged:
        body_flags = ["--spec", sketch.source]
    elif sketch.source == LEGS and body == generator.generate(sketch.legs, sketch.links):
        body_flags = ["--legs", str(sketch.legs), "--links", str(sketch.links)]
    else:
        body_flags = ["--spec", spec_file_name(body)]
    setting_flags = [f"--set={name}={_flag_value(value)}" for name, value in _settings_with_files(sketch, body).items()]
    policy_flags = [] if sketch.policy == "cpg" else ["--policy", sketch.policy]
    preset_flags = [] if chosen_preset(sketch) is None else ["--preset", sketch.preset]
    task_flags = ["--task", sketch.task, *setting_flags]
    return shlex.join(["arc-suite", "view", *body_flags, *task_flags, *policy_flags, *preset_flags])


def _settings_with_files(sketch: Sketch, body: Body) -> dict[str, Any]:
    """Return all settings of the task, with the file in place of its ground."""
    settings = make_settings(sketch, body)
    if sketch.ground_file and settings.get("arena") == sketch.ground_file:
        settings["arena"] = sketch.ground
    return settings


def _flag_value(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
