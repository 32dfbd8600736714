"""Results of a policy of many bodies on bodies that it was not trained with, by family.

Each body has three episodes from the same start: by the policy, by its own demonstrator, and standing still. Returns
of different bodies are not comparable, as costs are sums over feet and joints. A score is 0 for standing still, and 1
for the body's own demonstrator.
"""

import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import checks, registry
from arc_suite.bodies import BodiesEnv, generator
from arc_suite.bodies.families import sound_body, varied_body
from arc_suite.evaluation import protocol, walking
from arc_suite.learning.teachers import Teacher
from arc_suite.policies import Policy, Script
from arc_suite.policies.network import Network
from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Body

FIRST_TEST_SEED = 200_000  # of the bodies that test a policy; seeds of training and validation are lower
STEPS = 400  # control steps of an episode, unless the task's limit is shorter
_WORST_SHARE = 0.1  # share of the bodies that count in the worst score
_ROBOTS = (queen.BODY, bastion.BODY, tick.BODY, leaper.BODY)  # stays as it is, as results name a body by its index


def _resized_robot(index: int) -> Body:
    """Return a robot of the suite whose motors and standing height are computed anew."""
    body = generator.scaled(_ROBOTS[index % len(_ROBOTS)], 1.0)
    return body.replace(torso=body.torso.replace(standing_height=None))


def _mutant(index: int) -> Body:
    """Return a mutant of a robot of the suite."""
    body = generator.mutated(_resized_robot(index), index, 0.2)
    return body.replace(torso=body.torso.replace(standing_height=None))


Family = tuple[Callable[[int], Body], int]  # a function of an index from 0 on, and the number of bodies
# Bodies that test a policy.
FAMILIES: dict[str, Family] = {
    "random": (lambda index: sound_body(FIRST_TEST_SEED + index), 50),
    "varied": (lambda index: varied_body(FIRST_TEST_SEED + index), 50),
    "robots": (_resized_robot, 4),
    "mutants": (_mutant, 20),
    "many_legs": (lambda index: sound_body(FIRST_TEST_SEED + index, legs=9 + index % 4), 20),
    "four_links": (lambda index: sound_body(FIRST_TEST_SEED + index, links=4), 20),
    "small": (lambda index: generator.scaled(sound_body(FIRST_TEST_SEED + index), 0.25), 10),
    "large": (lambda index: generator.scaled(sound_body(FIRST_TEST_SEED + index), 10.0), 10),
}


class Judged(NamedTuple):
    """One episode of a body.

    Attributes:
        total: return.
        walked: whether the body walked: no fall, enough speed, torso off the ground; see `walking.failures`.
        speed: share of the target speed; see `walking.shares`.
        tracking: share of the command that the body followed, 1 at best; NaN in tasks without this metric.
    """

    total: float
    walked: bool
    speed: float
    tracking: float


class Comparison(NamedTuple):
    """The episodes of one body.

    Attributes:
        body: name of the body.
        policy: episode by the policy.
        demonstrator: episode by the body's demonstrator.
        zero: episode of standing still.
    """

    body: str
    policy: Judged
    demonstrator: Judged
    zero: Judged

    @property
    def score(self) -> float:
        """Gain of the policy over standing still by that of the demonstrator; NaN if the demonstrator gains nothing."""
        return self.policy_gain / self.demonstrator_gain if self.demonstrator_gain > 0.0 else math.nan

    @property
    def policy_gain(self) -> float:
        """Return of the policy minus that of standing still."""
        return self.policy.total - self.zero.total

    @property
    def demonstrator_gain(self) -> float:
        """Return of the demonstrator minus that of standing still."""
        return self.demonstrator.total - self.zero.total


class TransferResult(NamedTuple):
    """The results of a family.

    Attributes:
        count: number of bodies.
        walk: share of the bodies that walk by the policy.
        demonstrated: share of the bodies that walk by their demonstrators.
        speed: mean over bodies of the policy's share of the target speed.
        score: summed gains of the policy over standing still by summed gains of the demonstrators.
        worst: the same for the tenth of the bodies with the lowest scores.
        tracking: mean tracking of the policy by that of the demonstrators; NaN in tasks without this metric.
    """

    count: int  # type: ignore[assignment]  # hides the method of tuples
    walk: float
    demonstrated: float
    speed: float
    score: float
    worst: float
    tracking: float


def compare(network: Network, bodies: Iterable[Body], task: str, settings: Mapping | None = None) -> list[Comparison]:
    """Play the episodes of bodies; the seed of a body is its index.

    Args:
        network: policy of many bodies.
        bodies: bodies to play with.
        task: name of the task.
        settings: settings of the task.

    Raises:
        ValueError: a task or a body that does not fit.
    """
    bodies = list(bodies)
    environment = BodiesEnv(
        task,
        len(bodies),
        bodies,
        max_episode_steps=STEPS,
        flat=True,
        num_threads=1,
        autoreset_mode=AutoresetMode.DISABLED,
        task_kwargs=settings,
    )
    with contextlib.closing(environment), tqdm(total=3 * STEPS, desc="control steps", leave=False, disable=None) as bar:
        standing_still = Script(lambda seed: (), *environment.action_space.shape)
        policy_episodes = _play_episodes(environment, network, bar)
        demonstrator_episodes = _play_episodes(environment, Teacher(environment), bar)
        zero_episodes = _play_episodes(environment, standing_still, bar)
    names = [body.name for body in bodies]
    episodes = zip(names, policy_episodes, demonstrator_episodes, zero_episodes, strict=True)
    return [Comparison(*body_episodes) for body_episodes in episodes]


def compare_family(
    name: str, family: Family, network: Network, task: str, settings: Mapping | None = None
) -> list[Comparison]:
    """Play the episodes of a family; see `compare`."""
    make_body, count = family
    bodies = map(make_body, tqdm(range(count), desc=name, unit="body", leave=False, disable=None))
    return compare(network, bodies, task, settings)


def find_family(name: str) -> Family:
    """Return the family of `FAMILIES`, or that of the bodies of a file or `module:name`.

    Raises:
        ValueError: an unknown name, or as `registry.bodies_of`.
    """
    if registry.is_file_or_module(name):
        bodies = registry.bodies_of(name)
        return bodies.__getitem__, len(bodies)
    return FAMILIES[checks.name(name, FAMILIES, "family")]


def result(comparisons: list[Comparison]) -> TransferResult:
    """Return the results of comparisons; bodies whose demonstrators gain nothing count in no score."""
    with_score = [comparison for comparison in comparisons if not math.isnan(comparison.score)]
    with_score.sort(key=lambda comparison: comparison.score)
    worst = with_score[: max(1, round(_WORST_SHARE * len(with_score)))]
    tracking = [[comparison.policy.tracking, comparison.demonstrator.tracking] for comparison in comparisons]
    policy_tracking, demonstrator_tracking = np.mean(tracking, axis=0)
    return TransferResult(
        count=len(comparisons),
        walk=float(np.mean([comparison.policy.walked for comparison in comparisons])),
        demonstrated=float(np.mean([comparison.demonstrator.walked for comparison in comparisons])),
        speed=float(np.mean([comparison.policy.speed for comparison in comparisons])),
        score=_summed_score(with_score),
        worst=_summed_score(worst),
        tracking=float(policy_tracking / demonstrator_tracking),
    )


def _summed_score(comparisons: list[Comparison]) -> float:
    """Return the summed gains of the policy by those of the demonstrators; NaN without comparisons.

    Gains are summed before the division, as the gain of a single demonstrator may be small.
    """
    if not comparisons:
        return math.nan
    gains = [[comparison.policy_gain, comparison.demonstrator_gain] for comparison in comparisons]
    policy_gain, demonstrator_gain = np.sum(gains, axis=0)
    return float(policy_gain / demonstrator_gain)


def _play_episodes(environment: BodiesEnv, policy: Policy, bar: tqdm) -> list[Judged]:
    """Play an episode in every environment, from the seed of its index, and judge the walks.

    Args:
        environment: environments of all bodies.
        policy: made for them.
        bar: progress bar, which counts control steps.
    """
    # Lists of arrays (num_envs, ...) at the start and after every control step.
    step_positions = []
    step_targets = []
    step_touching = []
    step_fallen = []

    def watch(playing, terminated):
        observations = environment.own_observations()
        blocks = [task.split(vector) for task, vector in zip(environment.tasks, observations, strict=True)]
        positions = environment.places()
        step_positions.append(positions)
        step_targets.append(list(map(walking.target, environment.tasks, blocks, positions)))
        # A batch has no list of its contacts; the observed forces on the torso are those of the ground.
        step_touching.append(playing & [block["contact_forces"][:6].any() for block in blocks])
        bar.update(int(playing.any()))
        step_fallen.append(playing & walking.has_fallen(terminated, environment.quaternions()))

    episodes = protocol.episodes_in_batch(environment, policy, range(environment.num_envs), watch)
    displacements = np.diff(np.array(step_positions)[..., :2], axis=0)  # (steps, num_envs, 2), m
    targets = np.array(step_targets)
    touching = np.array(step_touching)
    fallen = np.array(step_fallen)
    judged_episodes = []
    for index, episode in enumerate(episodes):
        fell = fallen[:, index].any()
        length = fallen[:, index].argmax() if fell else episode.length
        verdict = walking.assess(
            targets[:length, index],
            displacements[:length, index],
            touching[: length + 1, index],
            min(STEPS, environment.tasks[index].step_limit),
            walking.FALL if fell else walking.TIME,
        )
        tracking = episode.progress.get("tracking", math.nan)
        judged_episodes.append(Judged(episode.total, verdict.walks, verdict.speed, tracking))
    return judged_episodes
