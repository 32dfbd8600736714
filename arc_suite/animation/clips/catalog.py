"""The clips that a body can have, by name."""

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, get_args

from arc_suite import registry
from arc_suite.animation.clips import acting, gestures
from arc_suite.animation.clips.root_motion import Motion, Pose
from arc_suite.robots.spec import Body


class WalkLoop(NamedTuple):
    """A loop under a command.

    Attributes:
        command: forward, left and turning, in units of the task: the body's own speed.
        failing: index of a leg whose motors fail; None for a sound body.
        crouch: by which the torso is lowered, standing heights, as far as the legs fold.
    """

    command: tuple[float, float, float]
    failing: int | None = None
    crouch: float = 0.0


class Passage(NamedTuple):
    """A clip between the walk and rest.

    Attributes:
        starts: whether it begins at rest.
        cycles: of the gait.
    """

    starts: bool
    cycles: int


class Turn(NamedTuple):
    """A turn on the spot, from rest to rest.

    Attributes:
        angle: degrees, to the left.
    """

    angle: float


class Acted(NamedTuple):
    """A motion from rest, simulated or drawn.

    Attributes:
        play: makes it of the body and its pose at rest.
        ends: those at which it has the first pose of idle: 0 and -1.
        loops: whether it is a loop.
        steps: whether feet step in it.
        additive: whether it is added to other clips, as its difference from the first pose of idle.
    """

    play: Callable[[Body, Pose], Motion]
    ends: tuple[int, ...]
    loops: bool = False
    steps: bool = False
    additive: bool = False


class Difference(NamedTuple):
    """How a loop differs from another, added to the first pose of idle.

    Attributes:
        loop: its name.
        base: name of the other.
    """

    loop: str
    base: str


class Showcase(NamedTuple):
    """A loop of a preset of the demonstrator, in a gait of its own.

    Attributes:
        preset: its name.
    """

    preset: str


Kind = WalkLoop | Passage | Turn | Acted | Difference | Showcase

WALK = WalkLoop((1.0, 0.0, 0.0))
CLIPS: dict[str, Kind] = {
    "walk": WALK,
    "slow": WalkLoop((0.6, 0.0, 0.0)),
    "fast": WalkLoop((1.25, 0.0, 0.0)),
    "run": WalkLoop((1.75, 0.0, 0.0)),
    "turn_left": WalkLoop((0.5, 0.0, 0.5)),
    "turn_right": WalkLoop((0.5, 0.0, -0.5)),
    "forward_left": WalkLoop((0.7, 0.0, 0.3)),
    "forward_right": WalkLoop((0.7, 0.0, -0.3)),
    "turn_in_place_left": WalkLoop((0.0, 0.0, 1.0)),
    "turn_in_place_right": WalkLoop((0.0, 0.0, -1.0)),
    "strafe_left": WalkLoop((0.0, 0.5, 0.0)),
    "strafe_right": WalkLoop((0.0, -0.5, 0.0)),
    "back": WalkLoop((-0.5, 0.0, 0.0)),
    "start": Passage(starts=True, cycles=3),
    "stop": Passage(starts=False, cycles=3),
    "turn_180": Turn(180.0),
    "idle": Acted(gestures.idle, (0,), loops=True),
    "idle_look": Acted(gestures.glance, (0, -1), loops=True),
    "idle_settle": Acted(gestures.settle, (0, -1), loops=True, steps=True),
    "crouch_walk": WalkLoop((0.6, 0.0, 0.0), crouch=0.3),
    "lean_left": Acted(functools.partial(gestures.turn_torso, number="roll", sign=-1.0), (0, -1)),
    "lean_right": Acted(functools.partial(gestures.turn_torso, number="roll", sign=1.0), (0, -1)),
    "look_up": Acted(functools.partial(gestures.turn_torso, number="pitch", sign=-1.0), (0, -1)),
    "look_down": Acted(functools.partial(gestures.turn_torso, number="pitch", sign=1.0), (0, -1)),
    "limp_walk": WalkLoop((1.0, 0.0, 0.0), failing=0),
    "limp": Difference("limp_walk", "walk"),
    **{
        f"hit_{side}": Acted(functools.partial(gestures.hit, side=side), (0, -1), additive=True)
        for side in gestures.HIT_DIRECTIONS
    },
    "attack": Acted(gestures.strike, (0, -1), steps=True),
    "rise": Acted(acting.rise, (-1,)),
    "jump": Acted(acting.jump, (0, -1)),
    "leap": Acted(acting.leap, (0, -1)),
    "death": Acted(acting.death, (0,)),
    "tuned": Showcase("tuned"),
    "refined": Showcase("refined"),
}
DEFAULT = ("walk", "slow", "fast", "turn_left", "turn_right", "start", "stop", "idle")
SPEED_RATIOS = {
    "slow": (0.0, 1.0 / 1.1),
    "fast": (1.1, math.inf),
    "run": (1.4, math.inf),
}  # speeds, of that of the walk
ALL = "all"  # in place of all names
REST = "rest"  # the recording of a stop, of rest and of a start


def clip_names() -> list[str]:
    """Return the names of all clips, those of other packages included."""
    return [*CLIPS, *registry.ADDITIONS["clip"]]


def clip_of(name: str) -> Kind:
    """Return the clip of a name, or of `module:name`, which another package registers.

    Raises:
        ValueError: an unknown name, or no clip.
    """
    clip = registry.find("clip", name, CLIPS)
    if not isinstance(clip, Kind):
        kinds = ", ".join(kind.__name__ for kind in get_args(Kind))
        raise ValueError(f"clip {registry.bare_name(name)!r}: expected one of {kinds}, got {type(clip).__name__}")
    return clip


def is_additive(name: str) -> bool:
    """Return whether a clip is added to others, as its difference from the first pose of idle."""
    clip = clip_of(name)
    return isinstance(clip, Difference) or (isinstance(clip, Acted) and clip.additive)


def recordings_needed(names: Sequence[str]) -> dict[str, list[str]]:
    """Return the names of the recordings that clips are made of, each with the clips that cannot be made without it."""
    found: dict[str, list[str]] = {}
    for name in names:
        clip = clip_of(name)
        match clip:
            case Difference():
                needs = clip.loop, REST
            case Turn():
                needs = name, REST
            case WalkLoop() | Showcase():
                needs = (name,)
            case _:
                needs = (REST,)
        for source in needs:
            found.setdefault(source, []).append(name)
        if isinstance(clip, Difference):
            found.setdefault(clip.base, [])
        if isinstance(clip, Passage) or name in SPEED_RATIOS:
            found.setdefault("walk", [])
    return found
