"""A page of each task: the text of docs/, then tables of the code."""

import math
import re
from collections.abc import Callable, Mapping

import arc_suite
from arc_suite.arenas import terrain
from arc_suite.cpg.selection import suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, ground, setting_table
from arc_suite.tasks.command_task import CommandTask
from arc_suite.tasks.contract import STEPS, Task
from website import markdown, observations, returns, settings

# Definitions of the reward's terms by name: of costs, of the other terms of `walk`, and of tasks with commands.
_COSTS = {
    "gait_cost": "number of contact schedule errors",
    "control": "squared action",
    "smoothness": "squared change of the action",
    "contact": "squared contact forces, each clipped to [-1, 1]",
    "angular_velocity": "squared roll and pitch rates",
    "vertical_velocity": "squared vertical velocity of the torso",
    "posture": "squared distance of the joint angles from `default_angles`",
}
_WALK_TERMS = {
    "forward": "1 at the target velocity, 0 from the edge of `velocity_band` on",
    "healthy": "1 while the torso's height is in `healthy_range`",
    "gait_bonus": "share of the feet in stance or swing as the gait prescribes",
}
_COMMAND_TERMS = {
    "tracking": "triangular kernel of the velocity error times that of the turning error",
    "progress": "velocity toward the end of the lane, or the goal, by v*: a leaky mean, at most 1, times the cosine of "
    "the tilt",
    "healthy": "1 while the body has not fallen",
    "obedient_gait": "what the step earns for following the command, times the share of feet as prescribed",
    "obedience": "what the step earns for following the velocity, times that for the pose, times 1 where all feet keep "
    "to the gait, 0 where 0.7 of them do, a leaky mean",
    "goal": "1 in the step that reaches a goal",
    "transport": "work of the motors by weight, over the displacement at v*",
}
_MIMIC_TERMS = {
    "pose": "1 where joint angles are those of the motion",
    "joint_speed": "1 where joints move as fast as those of the motion",
    "feet": "1 where feet are in the places of the motion's, seen from the torso",
    "place": "1 where the torso is at the place and height of the motion's",
    "attitude": "1 where the torso has the orientation of the motion's",
}
_RECOVER_TERMS = {
    "upright": "share of the way from upside down to upright",
    "height": "height of the torso by h, at most 1, times the same share",
    "up": "1 while the torso is high and upright",
    "pose": "of a body that is up: 1 in the standing pose",
    "rest": "of a body that is up: 1 where nothing moves",
    "control": "mean squared torque, as shares of the largest",
    "smoothness": "mean squared change of the torques",
}
# Of tasks without a command, by name.
_TERMS = {"walk": _WALK_TERMS | _COSTS, "mimic": _COSTS | _MIMIC_TERMS, "recover": _RECOVER_TERMS}
_ENDS = {
    "mimic": "The discount is 0 where the torso is further than half a standing height, or about 60 degrees, from the "
    "motion, and 1 at the time limit.",
    "recover": "The discount is 1 at the time limit. Nothing ends an episode before.",
}
_GUIDES = {"mimic": "motions", "recover": "motions"}  # pages in docs/ that explain tasks without a page of their own
# Definitions of metrics by name.
METRICS = {
    "speed": "mean velocity along world x, m/s",
    "distance": "distance along the lane, as a share of that at the target velocity over the whole episode",
    "goals": "number of goals reached",
    "tracking": "mean of what the steps earn for following the command, at most 1",
    "pose_tracking": "mean of what the steps earn for keeping the pose, at most 1",
    "level": "of the curriculum",
    "fell": "1 if the body fell",
    "sank": "1 if a foot got stuck under the ground, a contact artifact",
    "gait_compliance": "share of foot samples that agree with the prescribed contact schedule",
    "cost_of_transport": "positive work of the motors and their heat, by weight and path",
    "joint_error": "root of the mean square error of joint angles, rad",
    "torso_error": "root of the mean square distance of the torso from that of the motion, standing heights",
    "up": "1 if the body got up",
    "time_to_get_up": "s, or the time so far",
    "collisions": "ways from goal to goal on which a pillar was touched",
}


def terms(task_class: type[Task]) -> dict[str, str]:
    """Return definitions of the reward's terms of a task, by name."""
    if not issubclass(task_class, CommandTask):
        return _TERMS[task_class.name]
    velocity_costs = {
        name: f"{_COSTS[name]}, in units of h and g" for name in ("angular_velocity", "vertical_velocity")
    }
    return _COSTS | velocity_costs | _COMMAND_TERMS


def page(name: str, written: str = "") -> str:
    """Return the page of a task.

    Args:
        name: name of the task.
        written: text of its page in docs/; empty for a task on ground, which docs/ground.md explains.
    """
    tasks = {robot: Setup.of(robot, name).definition for robot in ROBOTS}
    return "\n\n".join([written.strip() or _introduction(name), _tables(name, TASKS[name], tasks)])


def _introduction(name: str) -> str:
    """Return the beginning of the page of a task that has no page in docs/."""
    guide = _GUIDES.get(name, "ground")
    sentences = f"{markdown.summary(TASKS[name])} [{guide.capitalize()}]({guide}.md) explains it."
    return f"# {name.capitalize()}\n\n![{name}](films/{name}.webp)\n\n{sentences}"


def _tables(name: str, task_class: type[Task], tasks: Mapping[str, Task]) -> str:
    """Return the sections of a task's page with tables of the code, given the task of each robot."""
    return markdown.join_parts(
        "## Parts",
        _parts(task_class),
        f"An episode has {STEPS} control steps: {_text_by_robot(tasks, _duration)}. "
        f"Ids: {', '.join(f'`{Setup.of(robot, name).env_id}`' for robot in ROBOTS)}.",
        "## Observation",
        _observation(tasks),
        "## Reward",
        _reward(task_class, tasks),
        "## End",
        _end(task_class, tasks),
        "## Metrics",
        "In `environment.task.progress`, and in Gymnasium's infos as `progress_...`.",
        _metrics(name),
        "## Settings",
        "Keys of `task_kwargs`, and of `--set name=value`. [All tasks](reference/settings.md) have some more.",
        settings.table_of_task(task_class),
        "## Demonstrators",
        f"Presets that suit the task, the best first: {_text_by_robot(tasks, _presets)}.",
        returns.demonstrators(tasks=(name,)),
        _measured_demonstrators(name),
        "## Learners",
        returns.learners(tasks=(name,), studies="../studies/") or "No committed study has runs of this task.",
    )


def _text_by_robot(tasks: Mapping[str, Task], describe: Callable[[Task], str]) -> str:
    """Return a text about the task of each robot; only one if it is the same for all.

    Args:
        tasks: by name of the robot.
        describe: function from a task to the text.
    """
    texts = {robot: describe(task) for robot, task in tasks.items()}
    if len(set(texts.values())) == 1:
        return next(iter(texts.values()))
    return "; ".join(f"{robot} {text}" for robot, text in texts.items())


def _duration(task: Task) -> str:
    return f"{setting_table.format_value(STEPS * task.scene.control_timestep)} s"


def _presets(task: Task) -> str:
    return ", ".join(f"`{name}`" for name in suited_presets(task))


def _parts(task_class: type[Task]) -> str:
    """Return the table of a task's command, ground and modifiers; empty for a task without commands."""
    if not issubclass(task_class, CommandTask):
        return ""
    lines = [
        ("command", markdown.summary(type(task_class.command))),
        ("ground", markdown.summary(type(task_class.ground))),
    ]
    meanings = setting_table.modifier_meanings()
    for name, value in task_class.modifiers.items():
        lines.append((f"`{name}`", f"{setting_table.format_value(value)}: {meanings[name]}"))
    return table(("part", "what it is"), lines)


def _observation(tasks: Mapping[str, Task]) -> str:
    """Return the table of the observation's blocks, and the table of all entries for the first robot."""
    first_robot = next(iter(tasks))
    first_task = tasks[first_robot]
    lines = []
    for block in first_task.blocks:
        sizes = [str(task.sizes[block]) for task in tasks.values()]
        lines.append([f"`{block}`", *sizes, observations.BLOCK_CONTENTS[block]])
    total_sizes = [str(task.size) for task in tasks.values()]
    lines.append(["in all", *total_sizes, ""])
    block_table = table(("block", *tasks, "content"), lines)
    return f"{block_table}\n\n{observations.entries_table(first_task, f'Every index, of {first_robot}')}"


def _reward(task_class: type[Task], tasks: Mapping[str, Task]) -> str:
    """Return the table of the reward's terms."""
    definitions = terms(task_class)
    first_task = next(iter(tasks.values()))
    lines = []
    for term in first_task.settings.weights:
        weight = _text_by_robot(tasks, lambda task, term=term: setting_table.format_value(task.settings.weights[term]))
        lines.append([f"`{term}`", weight, definitions[term]])
    text = "The sum of weighted terms. Infos have the terms as `reward_...`, without weights."
    if issubclass(task_class, CommandTask):
        text += (
            " A weighted sum s of the costs, whose weights are negative, becomes s / sqrt(1 + (s / `cost_limit`)^2)."
        )
    return f"{text}\n\n{table(('term', 'weight', 'definition'), lines)}"


def _end(task_class: type[Task], tasks: Mapping[str, Task]) -> str:
    """Return the table, or a sentence, about the discounts at the end of an episode."""
    if not issubclass(task_class, CommandTask):
        if task_class.name in _ENDS:
            return _ENDS[task_class.name]
        heights = _text_by_robot(tasks, lambda task: f"{setting_table.format_value(task.settings.healthy_range)} m")
        return f"The discount is 0 where the torso leaves its healthy heights ({heights}), and 1 at the time limit."
    health = task_class.health
    tilt = f"{math.degrees(math.acos(health.least_upright)):.0f} degrees"
    lines = [
        ("0", f"the torso is lower than {health.lowest:g} h over the ground, or tilted by more than {tilt}"),
        ("0", f"the ground carries the torso with more than {health.lying:g} of the weight"),
    ]
    if isinstance(task_class.ground, ground.Lanes):
        lines.append(("0", f"a foot stays under the ground for {ground.SUNK_STEPS} steps, a contact artifact"))
        edge = f"{ground.OFF_LANE:g} h from the lane's middle"
        if task_class.ground.roams:
            edge = f"{terrain.SIDE_MARGIN:g} h from the outermost lane's edge"
        lines.append(("1", f"the torso is {edge}, or {terrain.END_MARGIN:g} h from an end"))
    return table(("discount", "where"), [*lines, ("1", "the time limit is reached")])


def _metrics(name: str) -> str:
    """Return the table of a task's metrics."""
    return table(("metric", "meaning"), [[f"`{metric}`", METRICS[metric]] for metric in _metric_names(name)])


def metrics_of_all_tasks() -> str:
    """Return the table of all metrics, and of the tasks that have each."""
    names_of_task = {task: _metric_names(task) for task in TASKS}
    rows = []
    for metric in sorted({name for names in names_of_task.values() for name in names}, key=list(METRICS).index):
        tasks = [f"`{task}`" for task, names in names_of_task.items() if metric in names]
        rows.append([f"`{metric}`", METRICS[metric], ", ".join(tasks)])
    return table(("metric", "meaning", "tasks"), rows)


def _metric_names(task: str) -> list[str]:
    """Return the names of a task's metrics."""
    first_robot = next(iter(ROBOTS))
    environment = arc_suite.load(first_robot, task)
    environment.reset()
    return list(environment.task.progress)


def _measured_demonstrators(name: str) -> str:
    """Return the tables of a task in studies/demonstrators.md, or a link to that page if it has none."""
    text = (returns.ROOT / "studies" / "demonstrators.md").read_text(encoding="utf-8")
    match = re.search(rf"<!-- {name} -->\n(.*?)<!-- end -->", text, re.DOTALL)
    if match is None:
        return "[Demonstrators, measured](../studies/demonstrators.md) has further demonstrators."
    caption = (
        "Return, and the task's first metric of distance, goals, tracking; by preset (and difficulty of the ground):"
    )
    return f"{caption}\n\n{match[1].strip()}"
