"""How a policy of many bodies does on bodies that it has not seen, by family.

Each body plays one episode by the policy, by its own demonstrator, and standing still, from the same start. A raw
return says nothing across bodies, as costs are sums over feet and joints: scores are shares of the way from standing
still, 0, to the body's own demonstrator, 1.
"""

import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite.bodies import BodiesEnv, generator
from arc_suite.bodies.families import sound_body, varied_body
from arc_suite.evaluation import protocol, walking
from arc_suite.learning.teachers import Teacher
from arc_suite.policies import Policy, Script
from arc_suite.policies.network import Network
from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Body

TEST = 200_000  # first seed of the bodies of a family that test a policy; nobody trains or validates with them
STEPS = 400  # control steps of an episode
_WORST = 0.1  # share of the bodies whose mean is told too
_ROBOTS = (queen.BODY, bastion.BODY, tick.BODY, leaper.BODY)  # never more, as an index stands for a body


def _robot(index: int) -> Body:
    """A robot of the suite with motors sized anew."""
    body = generator.scaled(_ROBOTS[index % len(_ROBOTS)], 1.0)
    return body.replace(torso=body.torso.replace(standing_height=None))


def _mutant(index: int) -> Body:
    body = generator.mutated(_robot(index), index, 0.2)
    return body.replace(torso=body.torso.replace(standing_height=None))


# Bodies that test a policy: what makes one of an index from 0 on, and how many there are.
FAMILIES: dict[str, tuple[Callable[[int], Body], int]] = {
    "random": (lambda index: sound_body(TEST + index), 50),
    "varied": (lambda index: varied_body(TEST + index), 50),
    "robots": (_robot, 4),
    "mutants": (_mutant, 20),
    "many_legs": (lambda index: sound_body(TEST + index, legs=9 + index % 4), 20),
    "four_links": (lambda index: sound_body(TEST + index, links=4), 20),
    "small": (lambda index: generator.scaled(sound_body(TEST + index), 0.25), 10),
    "large": (lambda index: generator.scaled(sound_body(TEST + index), 10.0), 10),
}


class Judged(NamedTuple):
    """One episode of a body.

    Attributes:
        total: its return.
        walked: whether the body walked: no fall, speed, torso off the ground; see `walking.failures`.
        speed: as a share of the target speed; see `walking.shares`.
        tracking: how well it followed the command, 1 at best; NaN in tasks without this metric.
    """

    total: float
    walked: bool
    speed: float
    tracking: float


class Comparison(NamedTuple):
    """The episodes of one body.

    Attributes:
        body: name of the body.
        policy: its episode by the policy.
        demonstrator: by its own demonstrator.
        zero: standing still.
    """

    body: str
    policy: Judged
    demonstrator: Judged
    zero: Judged

    @property
    def score(self) -> float:
        """(policy - standing still) / (demonstrator - standing still); NaN where that one earns no more."""
        gain = self.demonstrator.total - self.zero.total
        return (self.policy.total - self.zero.total) / gain if gain > 0.0 else math.nan


class TransferResult(NamedTuple):
    """The results of a family.

    Attributes:
        count: of the bodies.
        walk: share of the bodies that walk.
        demonstrated: share of the bodies that their demonstrators walk.
        speed: mean of the policy's speeds, as shares of the target speed.
        score: gain of the policy over standing still, as a share of the demonstrators': sums over bodies.
        worst: the same of the tenth of the bodies with the lowest scores.
        tracking: mean tracking as a share of the demonstrators' mean; NaN in tasks without this metric.
    """

    count: int  # type: ignore[assignment]  # hides the method of tuples
    walk: float
    demonstrated: float
    speed: float
    score: float
    worst: float
    tracking: float


def compare(network: Network, bodies: Iterable[Body], task: str, settings: Mapping | None = None) -> list[Comparison]:
    """Play the episodes of bodies, body i from seed i.

    Args:
        network: a policy of many bodies.
        bodies: to play with.
        task: name of the task.
        settings: of the task.

    Raises:
        ValueError: a task or a body that does not fit.
    """
    bodies = list(bodies)
    options: dict[str, Any] = {"num_threads": 1, "autoreset_mode": AutoresetMode.DISABLED, "task_kwargs": settings}
    environment = BodiesEnv(task, len(bodies), bodies, max_episode_steps=STEPS, flat=True, **options)
    with contextlib.closing(environment):
        zero = Script(lambda seed: (), *environment.action_space.shape)
        played = [_episodes(environment, policy) for policy in (network, Teacher(environment), zero)]
    return [Comparison(*each) for each in zip([body.name for body in bodies], *played, strict=True)]


def of_family(name: str, network: Network, task: str, settings: Mapping | None = None) -> list[Comparison]:
    """Play the episodes of a family of `FAMILIES`; see `compare`."""
    made, count = FAMILIES[name]
    bodies = [made(index) for index in range(count)]
    return compare(network, tqdm(bodies, desc=name, unit="body", leave=False, disable=None), task, settings)


def result(played: list[Comparison]) -> TransferResult:
    """Return the results of comparisons; bodies whose demonstrators gain nothing count in no score."""
    scored = sorted((each for each in played if not math.isnan(each.score)), key=lambda each: each.score)
    worst = scored[: max(1, round(_WORST * len(scored)))]
    tracking = [[episode.tracking for episode in (each.policy, each.demonstrator)] for each in played]
    policy, demonstrator = np.mean(tracking, axis=0)
    return TransferResult(
        count=len(played),
        walk=float(np.mean([each.policy.walked for each in played])),
        demonstrated=float(np.mean([each.demonstrator.walked for each in played])),
        speed=float(np.mean([each.policy.speed for each in played])),
        score=_gain(scored),
        worst=_gain(worst),
        tracking=float(policy / demonstrator),
    )


def _gain(played: list[Comparison]) -> float:
    """The policy's gain over standing still as a share of the demonstrators'; NaN without comparisons.

    Sums, as the gain of a single demonstrator may be small.
    """
    gains = [[each.policy.total - each.zero.total, each.demonstrator.total - each.zero.total] for each in played]
    return float(np.divide(*np.sum(gains, axis=0))) if gains else math.nan


def _episodes(environment: BodiesEnv, policy: Policy) -> list[Judged]:
    """Play an episode in every environment, from the seed of its index, and judge the walks."""
    places, targets, touching, fallen = [], [], [], []  # at the start, and after every control step

    def watch(playing, terminated):
        own = zip(environment.tasks, environment.own_observations(), strict=True)
        blocks = [task.split(vector) for task, vector in own]
        places.append(environment.places())
        targets.append([walking.target(*each) for each in zip(environment.tasks, blocks, places[-1], strict=True)])
        # A batch has no list of its contacts; the observed forces on the torso are those of the ground.
        touching.append(playing & [block["contact_forces"][:6].any() for block in blocks])
        fallen.append(playing & walking.has_fallen(terminated, environment.quaternions()))

    played = protocol.episodes_in_batch(environment, policy, range(environment.num_envs), watch)
    moved = np.diff(np.array(places)[..., :2], axis=0)
    targets, touching, fallen = map(np.array, (targets, touching, fallen))
    episodes = []
    for index, episode in enumerate(played):
        fell = fallen[:, index].any()
        length = fallen[:, index].argmax() if fell else episode.length
        verdict = walking.assess(
            targets[:length, index],
            moved[:length, index],
            touching[: length + 1, index],
            STEPS,
            walking.FALL if fell else walking.TIME,
        )
        tracking = episode.progress.get("tracking", math.nan)
        episodes.append(Judged(episode.total, verdict.walks, verdict.speed, tracking))
    return episodes
