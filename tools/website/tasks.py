"""A page of each task: what is written by hand, then tables of the code."""

import math
import re

import arc_suite
from arc_suite.cpg.selection import suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS, ground
from arc_suite.tasks.command_task import CommandTask
from arc_suite.tasks.contract import STEPS, Task
from website import markdown, observations, returns, settings

_COSTS = {
    "gait_cost": "number of contact schedule errors",
    "control": "squared action",
    "smoothness": "squared change of the action",
    "contact": "squared contact forces, each clipped to [-1, 1]",
    "angular_velocity": "squared roll and pitch rates",
    "vertical_velocity": "squared vertical velocity of the torso",
    "posture": "squared distance of the joint angles from `default_angles`",
}
_WALK = {
    "forward": "1 at the target velocity, 0 from the edge of `velocity_band` on",
    "healthy": "1 while the torso's height is in `healthy_range`",
    "gait_bonus": "share of the feet in stance or swing as the gait prescribes",
}
_COMMAND = {
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
METRICS = {
    "speed": "mean velocity along world x, m/s",
    "distance": "distance along the lane, as a share of that at v*, over the whole episode",
    "goals": "number of goals reached",
    "tracking": "mean of what the steps earn for following the command, at most 1",
    "pose_tracking": "mean of what the steps earn for keeping the pose, at most 1",
    "level": "of the curriculum",
    "fell": "1 if the body fell",
    "sank": "1 if a foot got stuck under the ground, a contact artifact",
    "gait_compliance": "share of foot samples that agree with the prescribed contact schedule",
    "cost_of_transport": "positive work of the motors by weight and path",
    "collisions": "ways from goal to goal on which a pillar was touched",
}


def terms(kind: type[Task]) -> dict[str, str]:
    """Return definitions of the reward's terms of a task, by name."""
    if not issubclass(kind, CommandTask):
        return _WALK | _COSTS
    rates = {name: f"{_COSTS[name]}, in units of h and g" for name in ("angular_velocity", "vertical_velocity")}
    return _COSTS | rates | _COMMAND


def page(name: str, written: str = "") -> str:
    """Return the page of a task.

    Args:
        name: of the task.
        written: what docs/ has of it; empty for a task on ground, which docs/ground.md explains.
    """
    kind, tasks = TASKS[name], {robot: Setup.of(robot, name).definition for robot in ROBOTS}
    return "\n\n".join([written.strip() or _introduced(name), _tables(name, kind, tasks)])


def _introduced(name: str) -> str:
    explained = f"{markdown.summary(TASKS[name])} [Ground](ground.md) explains it."
    return f"# {name.capitalize()}\n\n![{name}](films/{name}.webp)\n\n{explained}"


def _tables(name: str, kind: type[Task], tasks) -> str:
    return markdown.joined(
        "## Parts",
        _parts(kind),
        f"An episode has {STEPS} control steps: {_each(tasks, _duration)}. "
        f"Ids: {', '.join(f'`{Setup.of(robot, name).env_id}`' for robot in ROBOTS)}.",
        "## Observation",
        _observation(tasks),
        "## Reward",
        _reward(kind, tasks),
        "## End",
        _end(kind, tasks),
        "## Metrics",
        "In `environment.task.progress`, and in Gymnasium's infos as `progress_...`.",
        _metrics(name),
        "## Settings",
        "Keys of `task_kwargs`, and of `--set name=value`. [All tasks](reference/settings.md) have some more.",
        settings.of_task(kind),
        "## Demonstrators",
        f"Presets that suit the task, the best first: {_each(tasks, _presets)}.",
        returns.demonstrators(tasks=(name,)),
        _measured(name),
        "## Learners",
        returns.learners(tasks=(name,), studies="../studies/") or "No committed study has runs of this task.",
    )


def _each(tasks, text) -> str:
    """A text of all robots where it is the same, else of each."""
    found = {robot: text(task) for robot, task in tasks.items()}
    same = len(set(found.values())) == 1
    return next(iter(found.values())) if same else "; ".join(f"{robot} {value}" for robot, value in found.items())


def _duration(task: Task) -> str:
    return f"{markdown.number(STEPS * task.scene.control_timestep)} s"


def _presets(task: Task) -> str:
    return ", ".join(f"`{name}`" for name in suited_presets(task))


def _parts(kind: type[Task]) -> str:
    if not issubclass(kind, CommandTask):
        return ""
    lines = [("command", markdown.summary(type(kind.command))), ("ground", markdown.summary(type(kind.ground)))]
    lines += [
        (f"`{name}`", f"{markdown.number(value)}: {settings.MEANINGS[name]}") for name, value in kind.modifiers.items()
    ]
    return table(("part", "what it is"), lines)


def _observation(tasks) -> str:
    lines = []
    for block in next(iter(tasks.values())).blocks:
        sizes = [str(task.sizes[block]) for task in tasks.values()]
        lines.append([f"`{block}`", *sizes, observations.BLOCKS[block]])
    lines.append(["in all", *(str(task.size) for task in tasks.values()), ""])
    robot, task = next(iter(tasks.items()))
    listed = table(("block", *tasks, "content"), lines)
    return f"{listed}\n\n{observations.listed(task, f'Every index, of {robot}')}"


def _reward(kind: type[Task], tasks) -> str:
    definitions = terms(kind)
    lines = []
    for term in next(iter(tasks.values())).settings.weights:
        weight = _each(tasks, lambda task, term=term: markdown.number(task.settings.weights[term]))
        lines.append([f"`{term}`", weight, definitions[term]])
    text = "The sum of weighted terms. Infos have the terms as `reward_...`, without weights."
    if issubclass(kind, CommandTask):
        text += (
            " A weighted sum s of the costs, whose weights are negative, becomes s / sqrt(1 + (s / `cost_limit`)^2)."
        )
    return f"{text}\n\n{table(('term', 'weight', 'definition'), lines)}"


def _end(kind: type[Task], tasks) -> str:
    if not issubclass(kind, CommandTask):
        heights = _each(tasks, lambda task: f"{markdown.number(task.settings.healthy_range)} m")
        return f"The discount is 0 where the torso leaves its healthy heights ({heights}), and 1 at the time limit."
    health = kind.health
    tilt = f"{math.degrees(math.acos(health.least_upright)):.0f} degrees"
    lines = [
        ("0", f"the torso is lower than {health.lowest:g} h over the ground, or tilted by more than {tilt}"),
        ("0", f"the ground carries the torso with more than {health.lying:g} of the weight"),
    ]
    if isinstance(kind.ground, ground.Lanes):
        lines.append(("0", f"a foot stays under the ground for {ground.SINKING} steps, a contact artifact"))
        lines.append(
            ("1", f"the torso is {ground.OFF_LANE:g} h from the lane's middle, or {ground.END:g} h from an end")
        )
    return table(("discount", "where"), [*lines, ("1", "the time limit is reached")])


def _metrics(name: str) -> str:
    environment = arc_suite.load(next(iter(ROBOTS)), name)
    environment.reset()
    return table(("metric", "meaning"), ([f"`{key}`", METRICS[key]] for key in environment.task.progress))


def _measured(name: str) -> str:
    """The tables of a task in studies/demonstrators.md."""
    text = (returns.ROOT / "studies" / "demonstrators.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- {name} -->\n(.*?)<!-- end -->", text, re.DOTALL)
    if not found:
        return "[Demonstrators, measured](../studies/demonstrators.md) has further demonstrators."
    about = (
        "Return, and the task's first metric of distance, goals, tracking; by preset (and difficulty of the ground):"
    )
    return f"{about}\n\n{found[1].strip()}"
