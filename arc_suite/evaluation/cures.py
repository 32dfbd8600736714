"""First walks of bodies: whether the demonstrator can walk a body, and what would help if not."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.evaluation.walking import Verdict, WalkWatcher
from arc_suite.robots.spec import Body, Joint, Link

_STEPS = 100  # control steps; 5 s of the four robots, of which the first 2 s are the start
_STEPS_OF_IMPORTED = 1000  # control steps, as some imported robots fall late
PRESET = "medium"  # of the demonstrator that walks: all bodies have it
FIELDS = ("motor", "damping", "armature")  # of joints; where a spec leaves them out, they are sized
FACTORS = (1.25, 1.5, 2.0, 3.0, 5.0)  # of the torques and gains of motors, or of gains alone, that are tried


class FirstWalk(NamedTuple):
    """A walk of the demonstrator from seed 0 in the task walk.

    Attributes:
        length: control steps until a fall or divergence, or of the whole walk.
        verdict: on the walk.
        target: target velocity of the task, m/s.
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
        if self.verdict.fell:
            return 0
        return 2 if self.verdict.walks else 1


def walk(body: Body, preset: str = PRESET) -> FirstWalk:
    """Let a demonstrator walk a body.

    Args:
        body: any.
        preset: of the demonstrator.

    Raises:
        ValueError: a body that no demonstrator can walk.
    """
    environment = Setup.of(body, "walk", {"on_divergence": "truncate"}).load()
    steps = _STEPS_OF_IMPORTED if body.source else _STEPS
    watcher = WalkWatcher(environment)
    protocol.run(environment, Demonstrator(environment, preset), 0, steps, [watcher])
    target = environment.task.definition.parameters.target_velocity
    return FirstWalk(watcher.length, watcher.verdict(steps), target)


def given_fields(body: Body) -> list[str]:
    """Return the names of `FIELDS` that a joint of a body's spec has; none for an imported body."""
    joints = () if body.source else body.joints
    return [name for name in FIELDS if any(getattr(joint, name) is not None for joint in joints)]


def left_out(body: Body, quality: int) -> tuple[tuple[str, ...], FirstWalk] | None:
    """Return the fields of joints without which a body walks best, and that walk; None if no walk is better.

    The best walk has the highest quality; among these, that with the fewest fields left out, then the fastest.

    Args:
        body: any.
        quality: `FirstWalk.quality` of its walk with all fields.
    """
    names_in_spec = given_fields(body)
    better_walks = {}
    for count in range(1, len(names_in_spec) + 1):
        for names in itertools.combinations(names_in_spec, count):
            first_walk = walk(_leave_out(body, names))
            if first_walk.quality > quality:
                better_walks[names] = first_walk
        if any(first_walk.quality == 2 for first_walk in better_walks.values()):
            break  # a walk of quality 2 with more fields left out would rank lower

    def rank(item: tuple[tuple[str, ...], FirstWalk]) -> tuple:
        names, first_walk = item
        return first_walk.quality, -len(names), first_walk.speed

    return max(better_walks.items(), key=rank, default=None)


def multiply_motors(body: Body, factor: float) -> Body:
    """Return an imported body whose motors have a multiple of their torques and gains."""
    return _multiply_servos(body, factor, ("limit", "stall", "stiffness", "damping"))


def multiply_gains(body: Body, factor: float) -> Body:
    """Return an imported body whose servos have a multiple of their gains, and their torques."""
    return _multiply_servos(body, factor, ("stiffness", "damping"))


def _multiply_servos(body: Body, factor: float, names: tuple[str, ...]) -> Body:
    """Return an imported body whose servos have a multiple of the values that are named, except of None."""

    def multiply(joint: Joint) -> Joint:
        values = {name: getattr(joint.servo, name) for name in names}
        changes = {name: factor * value for name, value in values.items() if value is not None}
        return joint.replace(servo=joint.servo.replace(**changes))

    return _change_joints(body, multiply)


def _leave_out(body: Body, names: tuple[str, ...]) -> Body:
    """Return a body whose joints leave out fields."""
    return _change_joints(body, lambda joint: joint.replace(**dict.fromkeys(names)))


def _change_joints(body: Body, change: Callable[[Joint], Joint]) -> Body:
    """Return a body with each joint changed."""

    def change_link(link: Link) -> Link:
        return link if link.joint is None else link.replace(joint=change(link.joint))

    return body.replace(legs=tuple(leg.replace(links=tuple(map(change_link, leg.links))) for leg in body.legs))
