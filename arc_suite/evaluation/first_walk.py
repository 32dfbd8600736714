"""First walks of bodies: whether the demonstrator walks one, and which fields of its spec keep it from that."""

import itertools
from typing import NamedTuple

from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.robots.spec import Body, Link

STEPS = 100  # control steps: five seconds of the four robots; the first two are a start
FIELDS = ("motor", "damping", "armature")  # of joints, which are sized where a spec leaves them out


class FirstWalk(NamedTuple):
    """A walk of the demonstrator from seed 0 in the task walk.

    Attributes:
        length: control steps until a fall, `STEPS` without one.
        speed: m/s forward.
        target: m/s that the task wants.
    """

    length: int
    speed: float
    target: float

    @property
    def fell(self) -> bool:
        """Whether the walk ended in a fall."""
        return self.length < STEPS


def walk(body: Body) -> FirstWalk:
    """Let the demonstrator `medium` walk a body.

    Raises:
        ValueError: a body that cannot walk whatever the demonstrator does.
    """
    environment = Setup.of(body).load()
    episode = protocol.run(environment, Demonstrator(environment, "medium"), 0, STEPS)
    return FirstWalk(episode.length, episode.progress["speed"], environment.task.definition.parameters.target_velocity)


def left_out(body: Body) -> tuple[tuple[str, ...], FirstWalk] | None:
    """Return the fewest fields of joints without which a body does not fall, and that walk; None if none help.

    Of several sets of as many fields it is the one with the fastest walk.
    """
    joints = [joint for leg in body.legs for joint in leg.joints]
    given = [name for name in FIELDS if any(getattr(joint, name) is not None for joint in joints)]
    for count in range(1, len(given) + 1):
        walks = {names: walk(_leaving_out(body, names)) for names in itertools.combinations(given, count)}
        if upright := {names: each for names, each in walks.items() if not each.fell}:
            return max(upright.items(), key=lambda item: item[1].speed)
    return None


def _leaving_out(body: Body, names: tuple[str, ...]) -> Body:
    """Return a body whose joints leave out fields."""

    def changed(link: Link) -> Link:
        return link.replace(joint=link.joint and link.joint.replace(**dict.fromkeys(names)))

    return body.replace(legs=tuple(leg.replace(links=tuple(map(changed, leg.links))) for leg in body.legs))
