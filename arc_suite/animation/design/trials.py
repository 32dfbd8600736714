"""Evaluation of bodies: a demonstrator, fitted to each, walks it; a goal says what the walk is worth."""

import math
from collections.abc import Mapping, Sequence
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

_TERMINATING = {"on_divergence": "terminate"}  # counts as a fall
_SEEDS = 2**32  # of a ground


class WalkMeans(NamedTuple):
    """Means over episodes.

    Attributes:
        speed: along world x, m/s; a body that has fallen rests.
        achieved: share of what is commanded: tracking, or in tasks that lead along x the displacement by that at the
            target velocity.
        tracking: mean over all steps, 0 after a fall; NaN in a task without.
        cost_of_transport: positive work of the motors by weight and path.
        power: mean positive power of the motors until the end of an episode, W/kg.
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
        metric: of a walk, named as in `WalkMeans`.
        sign: 1 for a metric to be raised, -1 for one to be lowered.
        task: by default.
        preset: of the demonstrator; None for the one that suits task and body.
        may_fall: whether a fall only lowers the metric, and does not exclude the body.
        unit: of the metric.
    """

    metric: str
    sign: float
    task: str
    preset: str | None = None
    may_fall: bool = False
    unit: str = ""

    def value(self, walk: WalkMeans) -> float:
        """Return the metric as a number to be raised."""
        return self.sign * getattr(walk, self.metric)


GOALS: Mapping[str, Goal] = {
    "transport": Goal("cost_of_transport", -1.0, "walk"),
    "speed": Goal("speed", 1.0, "walk", preset="fast", unit=" m/s"),
    "progress": Goal("speed", 1.0, "stairs", unit=" m/s"),
    "tracking": Goal("tracking", 1.0, "steer"),
    "robustness": Goal("tracking", 1.0, "shoved", may_fall=True),
}


class Round(NamedTuple):
    """Episodes of an evaluation.

    Attributes:
        settings: of the task.
        seeds: of the episodes.
        steps: control steps of each.
    """

    settings: Mapping[str, Any]
    seeds: Sequence[int]
    steps: int


class Trial(NamedTuple):
    """How a body is evaluated.

    Attributes:
        task: its name.
        goal: a name of `GOALS`.
        budget: that the body keeps.
        first: of all bodies.
        second: of those that challenge the elite of their cell.
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
        other = dict(settings)
        if ground is not None and "terrain_seed" in ground.settings:
            seed = settings.get("terrain_seed", ground.terrain_seed)
            other["terrain_seed"] = (checks.integer("terrain_seed", seed, 0, _SEEDS - 1) + 1) % _SEEDS
        return cls(task, goal, budget, Round(settings, (0,), steps), Round(other, (1,), 2 * steps))


class Outcome(NamedTuple):
    """What a body came to.

    Attributes:
        reason: why it is excluded; empty if it is not.
        first: its walk; None for a body that was not let walk.
        second: from another seed and on other ground, twice as long; None for one that did not challenge its cell's
            elite.
    """

    reason: str = ""
    first: WalkMeans | None = None
    second: WalkMeans | None = None


def evaluate(trial: Trial, body: Body | str, elite: float) -> Outcome:
    """Evaluate a body, and a second time if the first value is above that of the elite of its cell.

    Args:
        trial: how.
        body: to evaluate, or in its place the reason why there is none.
        elite: value of the elite's metric; see `Goal.value`.
    """
    if isinstance(body, str):
        return Outcome(body)
    if found := flaws(body):
        return Outcome(f"unsound: {found[0].text}")
    goal = GOALS[trial.goal]
    try:
        first = measure_walk(body, trial.task, trial.first, goal)
        reason = exclusion_reason(goal, trial.budget, first)
        if reason or goal.value(first) <= elite:
            return Outcome(reason, first)
        second = measure_walk(body, trial.task, trial.second, goal)
    except ValueError as error:
        return Outcome(f"refused: {error}")
    reason = exclusion_reason(goal, trial.budget, second)
    return Outcome(f"evaluated again: {reason}" if reason else "", first, second)


def exclusion_reason(goal: Goal, budget: Budget, walk: WalkMeans) -> str:
    """Return why a walk counts for nothing; empty if it counts."""
    if walk.falls and not goal.may_fall:
        return "fell"
    if walk.power > budget.power:
        return f"power: {walk.power:.3g} W/kg"
    if goal.metric == "cost_of_transport" and walking.is_slow(walk.achieved):
        return f"slow: {walk.achieved:.2f} of the command"
    return "" if math.isfinite(goal.value(walk)) else "no finite metric"


def measure_walk(body: Body, task: str, episodes: Round, goal: Goal) -> WalkMeans:
    """Let the demonstrator walk a body and return means over the episodes.

    Raises:
        ValueError: a setting that does not fit, or a body that no demonstrator walks.
    """
    environment, policy = open_walk(body, task, episodes, goal)
    try:
        walks = [_episode(environment, policy, seed, episodes.steps) for seed in episodes.seeds]
    finally:
        environment.close()
    return WalkMeans(*map(float, np.mean(walks, axis=0)))


def open_walk(body: Body, task: str, episodes: Round, goal: Goal) -> tuple[Environment, Policy]:
    """Open an environment and fit the demonstrator.

    Raises:
        ValueError: as `walk`.
    """
    environment = Setup.of(body, task, {**episodes.settings, **_TERMINATING}).load(episodes.seeds[0])
    return environment, policies.policy("cpg", body, goal.preset, task=environment.task.definition)


def _episode(environment, policy, seed: int, steps: int) -> WalkMeans:
    data, task = environment.physics.data.ptr, environment.task.definition
    body, seconds = task.scene.body, steps * task.scene.control_timestep
    torques, spent = energy.torques(body), energy.start(len(body.joint_names))
    for timestep in evaluation.rollout(environment, policy, seed, steps):
        if timestep.first():
            start, length, spent = data.qpos[0], 0, energy.begin(spent, data.qpos[7:])
            fell = False
        else:
            length, spent = length + 1, energy.after(spent, torques, data.ctrl, data.qpos[7:])
            fell |= walking.has_fallen(timestep.discount == 0.0, data.qpos[3:7])
    progress, way = environment.task.progress, data.qpos[0] - start
    tracking = progress.get("tracking", math.nan) * length / steps
    target = task.parameters.target_velocity * seconds
    achieved = way / target if "distance" in progress or math.isnan(tracking) else tracking
    power = spent.total * GRAVITY / (length * task.scene.control_timestep)
    return WalkMeans(way / seconds, achieved, tracking, progress.get("cost_of_transport", math.nan), power, fell)
