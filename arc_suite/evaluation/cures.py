"""First walks of bodies: whether the demonstrator walks one, and which fields of its spec keep it from that."""

import itertools
from typing import NamedTuple

from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.evaluation.walking import Verdict, WalkWatcher
from arc_suite.robots.spec import Body, Link

_STEPS = 100  # control steps: five seconds of the four robots; the first two are a start
_STEPS_OF_IMPORTED = 1000  # 20 s, as some of their robots fall late
FIELDS = ("motor", "damping", "armature")  # of joints, which are sized where a spec leaves them out


class FirstWalk(NamedTuple):
    """A walk of the demonstrator from seed 0 in the task walk.

    Attributes:
        length: control steps until a fall or divergence, or of the whole walk.
        verdict: what it came to.
        target: m/s that the task wants.
    """

    length: int
    verdict: Verdict
    target: float

    @property
    def speed(self) -> float:
        """The speed forward, m/s."""
        return self.verdict.speed * self.target

    @property
    def quality(self) -> int:
        """2 for what counts as walking, 1 for what is too slow or drags the torso, 0 for a fall."""
        return 0 if self.verdict.fell else 1 + self.verdict.walks


def walk(body: Body) -> FirstWalk:
    """Let the demonstrator `medium` walk a body.

    Raises:
        ValueError: a body that cannot walk whatever the demonstrator does.
    """
    environment = Setup.of(body, "walk", {"on_divergence": "terminate"}).load()
    steps = _STEPS_OF_IMPORTED if body.source else _STEPS
    watcher = WalkWatcher(environment)
    protocol.run(environment, Demonstrator(environment, "medium"), 0, steps, [watcher])
    target = environment.task.definition.parameters.target_velocity
    return FirstWalk(watcher.length, watcher.verdict(steps), target)


def given_fields(body: Body) -> list[str]:
    """Return the fields of joints that a spec has and could leave out: none of an imported body."""
    joints = () if body.source else body.joints
    return [name for name in FIELDS if any(getattr(joint, name) is not None for joint in joints)]


def left_out(body: Body, quality: int) -> tuple[tuple[str, ...], FirstWalk] | None:
    """Return the fields of joints without which a body walks best, and that walk.

    The best walk has the highest quality; among equals, the fewest fields are left out, then the speed counts.

    Args:
        body: to leave fields out of.
        quality: of its own walk; None is returned if no other has a higher one.
    """
    given, better = given_fields(body), {}
    for count in range(1, len(given) + 1):
        walks = {names: walk(_leaving_out(body, names)) for names in itertools.combinations(given, count)}
        better |= {names: each for names, each in walks.items() if each.quality > quality}
        if any(each.quality == 2 for each in better.values()):  # larger sets are no better
            break
    return max(better.items(), key=lambda item: (item[1].quality, -len(item[0]), item[1].speed), default=None)


def _leaving_out(body: Body, names: tuple[str, ...]) -> Body:
    """Return a body whose joints leave out fields."""

    def changed(link: Link) -> Link:
        return link.replace(joint=link.joint and link.joint.replace(**dict.fromkeys(names)))

    return body.replace(legs=tuple(leg.replace(links=tuple(map(changed, leg.links))) for leg in body.legs))
