"""Evaluation of bodies: a fitted demonstrator walks each body, and a goal says what the walk is worth."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, evaluation, policies, registry
from arc_suite.animation.design.genes import Budget
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import walking
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import GRAVITY
from arc_suite.policies import Policy
from arc_suite.robots.spec import Body
from arc_suite.tasks import energy

_DIVERGENCE_SETTINGS = {"on_divergence": "truncate"}  # the end of an episode, which counts as a fall
_NUM_TERRAIN_SEEDS = 2**32


class WalkMeans(NamedTuple):
    """Means over episodes.

    Attributes:
        speed: along world x, m/s; a body that has fallen counts as standing still.
        achieved: share of the command that is achieved. In tasks that lead along x, it is the displacement, divided by
            that at the target velocity; in other tasks, it is `tracking`.
        tracking: mean of the task's tracking over all steps, 0 after a fall; NaN in a task without tracking.
        cost_of_transport: positive work of the motors and heat of their windings, divided by weight and path.
        power: the same work and heat until the end of an episode, divided by mass and time, W/kg.
        falls: share of the episodes that ended early in a fall.
    """

    speed: float
    achieved: float
    tracking: float
    cost_of_transport: float
    power: float
    falls: float


class Goal(NamedTuple):
    """What bodies are searched for.

    Attributes:
        metric: name of the metric of a walk; a field of `WalkMeans` unless there is `measure`.
        sign: 1 for a metric to be raised, -1 for a metric to be lowered.
        task: name of the default task.
        preset: preset of the demonstrator; None for the one that suits task and body.
        may_fall: whether a fall lowers the metric only, and does not exclude the body.
        unit: unit of the metric, with the space before it.
        measure: returns the metric of a walk; None for the field of `WalkMeans` that `metric` names.
    """

    metric: str
    sign: float
    task: str
    preset: str | None = None
    may_fall: bool = False
    unit: str = ""
    measure: Callable[[WalkMeans], float] | None = None

    @property
    def metric_text(self) -> str:
        """Return the metric in words."""
        return self.metric.replace("_", " ")

    def measure_metric(self, walk: WalkMeans) -> float:
        """Return the metric of a walk.

        Raises:
            ValueError: `measure` returns no number, or divides by zero.
        """
        if self.measure is None:
            return getattr(walk, self.metric)
        try:
            return float(self.measure(walk))
        except (TypeError, ZeroDivisionError) as error:
            raise ValueError(f"metric {self.metric}: {error}") from None

    def value(self, walk: WalkMeans) -> float:
        """Return the metric of a walk as a number to be raised; see `measure_metric`."""
        return self.sign * self.measure_metric(walk)


GOALS: Mapping[str, Goal] = {
    "transport": Goal("cost_of_transport", -1.0, "walk"),
    "speed": Goal("speed", 1.0, "walk", preset="fast", unit=" m/s"),
    "progress": Goal("speed", 1.0, "stairs", unit=" m/s"),
    "tracking": Goal("tracking", 1.0, "steer"),
    "robustness": Goal("tracking", 1.0, "shoved", may_fall=True),
}


def goal_of(name: str) -> Goal:
    """Return the goal of a name, or of `module:name`, which another package registers.

    Raises:
        ValueError: an unknown name, or no goal.
    """
    return registry.find_instance("goal", name, GOALS, Goal)


class Round(NamedTuple):
    """The episodes of one evaluation.

    Attributes:
        settings: settings of the task.
        seeds: seeds of the episodes.
        steps: control steps of each.
    """

    settings: Mapping[str, Any]
    seeds: Sequence[int]
    steps: int


class Trial(NamedTuple):
    """How a body is evaluated.

    Attributes:
        task: its name.
        goal: its name; see `goal_of`.
        budget: budget that the body keeps.
        first: episodes of all bodies.
        second: episodes of the bodies that challenge the elite of their cell.
    """

    task: str
    goal: str
    budget: Budget
    first: Round
    second: Round

    @classmethod
    def of(cls, task: str, settings: Mapping[str, Any], goal: str, budget: Budget, steps: int) -> "Trial":
        """Return the trial whose second evaluation has another seed, twice the steps and the ground's next seed."""
        ground = getattr(registry.task_of(task), "ground", None)
        second_settings = dict(settings)
        if ground is not None and "terrain_seed" in ground.settings:
            terrain_seed = settings.get("terrain_seed", ground.terrain_seed)
            terrain_seed = checks.integer("terrain_seed", terrain_seed, 0, _NUM_TERRAIN_SEEDS - 1)
            second_settings["terrain_seed"] = (terrain_seed + 1) % _NUM_TERRAIN_SEEDS
        first = Round(settings, seeds=(0,), steps=steps)
        second = Round(second_settings, seeds=(1,), steps=2 * steps)
        return cls(task, goal, budget, first, second)


class Outcome(NamedTuple):
    """The result of evaluating a body.

    Attributes:
        reason: why the body is excluded; empty if it is not.
        first: its first walk; None for a body that could not walk.
        second: its second walk, from another seed and on other ground, twice as long; None for a body that did not
            challenge the elite of its cell.
    """

    reason: str = ""
    first: WalkMeans | None = None
    second: WalkMeans | None = None


def evaluate(trial: Trial, body: Body | str, elite_value: float) -> Outcome:
    """Evaluate a body, and a second time if the first value is above that of the elite of its cell.

    Args:
        trial: how to evaluate.
        body: body to evaluate, or the reason why there is no body.
        elite_value: value of the metric; see `Goal.value`.
    """
    if isinstance(body, str):
        return Outcome(body)
    body_flaws = flaws(body)
    if body_flaws:
        return Outcome(f"unsound: {body_flaws[0].text}")
    goal = goal_of(trial.goal)
    try:
        first = measure_walk(body, trial.task, trial.first, goal.preset)
        first_reason = exclusion_reason(goal, trial.budget, first)
        if first_reason or goal.value(first) <= elite_value:
            return Outcome(first_reason, first)
        second = measure_walk(body, trial.task, trial.second, goal.preset)
        second_reason = exclusion_reason(goal, trial.budget, second)
    except ValueError as error:
        return Outcome(f"refused: {error}")
    return Outcome(f"evaluated again: {second_reason}" if second_reason else "", first, second)


def exclusion_reason(goal: Goal, budget: Budget, walk: WalkMeans) -> str:
    """Return why a walk excludes its body; empty if it does not."""
    if walk.falls and not goal.may_fall:
        return "fell"
    if walk.power > budget.power:
        return f"power: {walk.power:.3g} W/kg"
    if goal.metric == "cost_of_transport" and walking.is_slow(walk.achieved):
        return f"slow: {walk.achieved:.2f} of the command"
    if not math.isfinite(goal.value(walk)):
        return "no finite metric"
    return ""


def measure_walk(body: Body, task: str, episodes: Round, preset: str | None = None) -> WalkMeans:
    """Let the demonstrator walk a body and return means over the episodes.

    Args:
        body: any body.
        task: name of the task.
        episodes: settings, seeds and control steps of the episodes.
        preset: preset of the demonstrator; None for the one that suits task and body.

    Raises:
        ValueError: a setting that does not fit, a task without a gait, or a body that no demonstrator walks.
    """
    environment, policy = open_walk(body, task, episodes, preset)
    try:
        walks = [_walk_episode(environment, policy, seed, episodes.steps) for seed in episodes.seeds]
    finally:
        environment.close()
    means = np.mean(walks, axis=0)
    return WalkMeans(*means.tolist())


def open_walk(body: Body, task: str, episodes: Round, preset: str | None) -> tuple[Environment, Policy]:
    """Open an environment of a body, fit the demonstrator, and return both.

    Raises:
        ValueError: as `measure_walk`.
    """
    settings = {**episodes.settings, **_DIVERGENCE_SETTINGS}
    environment = Setup.of(body, task, settings).load(episodes.seeds[0])
    if environment.task.definition.parameters is None:
        environment.close()
        raise ValueError(f"task {task}: expected one that prescribes a gait")
    policy = policies.policy("cpg", body, preset, task=environment.task.definition)
    return environment, policy


def _walk_episode(environment: Environment, policy: Policy, seed: int, steps: int) -> WalkMeans:
    """Return the means of one episode."""
    data = environment.physics.data.ptr  # MuJoCo's arrays, which the episode changes
    task = environment.task.definition
    body = task.scene.body
    control_timestep = task.scene.control_timestep
    torques = energy.torques(body)
    heat = energy.heat(body)
    work = energy.start(len(body.joint_names))  # of the motors, divided by weight, m
    for timestep in evaluation.rollout(environment, policy, seed, steps):
        readings = task.read(data)
        if timestep.first():
            start_x = float(readings.torso_position[0])
            steps_taken = 0
            fell = False
            work = energy.begin(work, readings.joint_angles)
        else:
            steps_taken += 1
            has_diverged = environment.physics.divergence is not None
            fell |= has_diverged or walking.has_fallen(timestep.discount == 0.0, data.qpos[3:7])
            efforts = readings.effort(data.ctrl[: len(torques)])
            work = energy.after(work, torques, heat, efforts, readings.joint_angles)
    progress = environment.task.progress  # the task's metrics of the episode
    displacement = float(readings.torso_position[0]) - start_x
    counted_steps = steps if fell else steps_taken  # a fall counts as standing still; the time limit ends both
    seconds = counted_steps * control_timestep
    tracking = progress.get("tracking", math.nan) * steps_taken / counted_steps
    if "distance" in progress or math.isnan(tracking):
        achieved = displacement / (task.parameters.target_velocity * seconds)
    else:
        achieved = tracking
    return WalkMeans(
        speed=displacement / seconds,
        achieved=achieved,
        tracking=tracking,
        cost_of_transport=progress.get("cost_of_transport", math.nan),
        power=float(work.total * GRAVITY / (steps_taken * control_timestep)),
        falls=fell,
    )
