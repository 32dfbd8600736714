"""The clips that a body can have, by name."""

import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, get_args

from arc_suite import checks, files, registry
from arc_suite.animation.clips import acting, gestures, getting_up
from arc_suite.animation.clips.blows import DIRECTIONS
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.motions import motion_files
from arc_suite.motions.skeletons import clip_of_animation
from arc_suite.robots.gaits import PACES, Pace
from arc_suite.robots.spec import Body


class WalkLoop(NamedTuple):
    """A loop under a command.

    Attributes:
        command: forward, left and turning, in units of the task, which are speeds that suit the body.
        failing: index of a leg whose motors fail; None for a sound body.
        crouch: distance by which the torso is lowered, standing heights, as far as the legs fold.
        pace: speed and gait of demonstrators, None for those of the task.
    """

    command: tuple[float, float, float]
    failing: int | None = None
    crouch: float = 0.0
    pace: Pace | None = None


class Passage(NamedTuple):
    """A clip between the walk and rest.

    Attributes:
        starts: whether it begins at rest.
        cycles: cycles of the gait.
    """

    starts: bool
    cycles: int


class Turn(NamedTuple):
    """A turn on the spot, from rest to rest, drawn; see `turning`.

    Attributes:
        angle: degrees, to the left.
    """

    angle: float


class Acted(NamedTuple):
    """A motion from rest, simulated or drawn.

    Attributes:
        play: makes the motion, given the body and its pose at rest.
        ends: ends at which it has the first pose of idle: the first sample, 0, the last one, -1, or both.
        loops: whether it is a loop.
        steps: whether feet step in it.
        additive: whether it is added to other clips, as its difference from the first pose of idle.
        planted: whether standing feet are to stay where they are; not in falls and jumps, which are simulated.
        unlike: names of clips whose last pose its own must differ from.
    """

    play: Callable[[Body, Pose], ClipMotion]
    ends: tuple[int, ...]
    loops: bool = False
    steps: bool = False
    additive: bool = False
    planted: bool = True
    unlike: tuple[str, ...] = ()


class BlowClip(NamedTuple):
    """A blow to a body at rest, which stays on its feet, recorded.

    Attributes:
        side: side from which the blow comes; see `blows.DIRECTIONS`.
        max_tilt: degrees, by which the blow tilts the torso at most; it is the strongest that does not tilt it more.
        min_tilt: degrees, by which the torso is to tilt; a blow that tilts it less comes higher. 0 for the lowest blow.
        cycles: gait cycles in which it steps after the blow; 0 for feet that stay where they are. Without steps the
            clip is added to others, as its difference from the first pose of idle.
    """

    side: str
    max_tilt: float
    min_tilt: float = 0.0
    cycles: int = 0


class Difference(NamedTuple):
    """How a loop differs from another, added to the first pose of idle.

    Attributes:
        loop: name of the loop.
        base: name of the loop that it differs from.
    """

    loop: str
    base: str


class Showcase(NamedTuple):
    """A loop of a preset of the demonstrator, in a gait of its own.

    Attributes:
        preset: name of the preset.
    """

    preset: str


Kind = WalkLoop | Passage | Turn | Acted | BlowClip | Difference | Showcase


def _fall(side: str, unlike: tuple[str, ...] = ()) -> Acted:
    """Return a death by a blow from a side."""
    return Acted(functools.partial(acting.death, side=side), ends=(0,), planted=False, unlike=unlike)


def _get_up(lies_on: str) -> Acted:
    """Return how a body gets up from a fall on its belly, side or back."""
    play = functools.partial(getting_up.get_up, lies_on=lies_on)
    return Acted(play, ends=(-1,), steps=True, planted=False)


WALK = WalkLoop((1.0, 0.0, 0.0))
BOTH_ENDS = (0, -1)  # of `Acted.ends`: the first and the last sample
CLIPS: dict[str, Kind] = {
    "walk": WALK,
    **{name: WalkLoop((pace.speed, 0.0, 0.0), pace=pace) for name, pace in PACES.items()},
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
    "turn_90": Turn(90.0),
    "turn_180": Turn(180.0),
    "idle": Acted(gestures.idle, ends=(0,), loops=True),
    "idle_look": Acted(gestures.glance, BOTH_ENDS, loops=True),
    "idle_settle": Acted(gestures.settle, BOTH_ENDS, loops=True, steps=True),
    "crouch_walk": WalkLoop((0.6, 0.0, 0.0), crouch=0.3),
    "lean_left": Acted(functools.partial(gestures.turn_torso, number="roll", sign=-1.0), BOTH_ENDS),
    "lean_right": Acted(functools.partial(gestures.turn_torso, number="roll", sign=1.0), BOTH_ENDS),
    "look_up": Acted(functools.partial(gestures.turn_torso, number="pitch", sign=-1.0), BOTH_ENDS),
    "look_down": Acted(functools.partial(gestures.turn_torso, number="pitch", sign=1.0), BOTH_ENDS),
    "limp_walk": WalkLoop((1.0, 0.0, 0.0), failing=0),
    "limp": Difference(loop="limp_walk", base="walk"),
    **{f"hit_{side}": BlowClip(side, max_tilt=10.0, min_tilt=5.0) for side in DIRECTIONS},
    **{f"stagger_{side}": BlowClip(side, max_tilt=30.0, cycles=2) for side in DIRECTIONS},
    "attack": Acted(gestures.strike, BOTH_ENDS, steps=True),
    "rise": Acted(acting.rise, ends=(-1,), planted=False),
    "get_up": _get_up(lies_on="back"),
    "get_up_side": _get_up(lies_on="side"),
    "get_up_belly": _get_up(lies_on="belly"),
    "jump": Acted(acting.jump, BOTH_ENDS, planted=False),
    "leap": Acted(acting.leap, BOTH_ENDS, planted=False),
    "death": _fall("front"),
    "death_back": _fall("back", unlike=("death",)),
    "death_left": _fall("left", unlike=("death", "death_back")),
    "tuned": Showcase("tuned"),
    "refined": Showcase("refined"),
}
DEFAULT = ("walk", "slow", "fast", "turn_left", "turn_right", "start", "stop", "idle")
ALL = "all"  # what users write in place of all names
REST = "rest"  # name of the recording of a stop, of rest and of a start

# The least and the greatest speed of loops that are left out otherwise, of the speed of the walk.
SPEED_RATIOS = {"slow": (0.0, 1.0 / 1.1), "fast": (1.1, math.inf), "run": (1.4, math.inf)}


def clip_names() -> list[str]:
    """Return the names of all clips, those of other packages included."""
    return [*CLIPS, *registry.ADDITIONS["clip"]]


def clip_of(name: str) -> Kind:
    """Return the clip of a name, or of `module:name`, which another package registers.

    Raises:
        ValueError: an unknown name, or no clip.
    """
    is_unknown = name not in clip_names() and ":" not in name
    if is_unknown and Path(name).suffix:
        cure = "arc-suite motion makes one of a .glb, a .bvh or a table"
        raise ValueError(f"clip {checks.preview(name)}: expected a name, or a motion, .npz; {cure}")
    file_cure = files.suggest_extension(name, (motion_files.EXTENSION,)) if is_unknown else ""
    if file_cure:
        raise ValueError(f"unknown clip {checks.preview(name)}{file_cure}")
    if is_unknown and clip_of_animation(name) in clip_names():
        raise ValueError(f"unknown clip {checks.preview(name)}; did you mean {clip_of_animation(name)!r}?")
    clip = registry.find("clip", name, CLIPS)
    if not isinstance(clip, Kind):
        kinds = ", ".join(kind.__name__ for kind in get_args(Kind))
        raise ValueError(f"clip {registry.bare_name(name)!r}: expected one of {kinds}, got {type(clip).__name__}")
    return clip


def is_additive(name: str) -> bool:
    """Return whether a clip is added to others, as its difference from the first pose of idle."""
    match clip_of(name):
        case Acted() as clip:
            return clip.additive
        case BlowClip() as clip:
            return clip.cycles == 0
        case clip:
            return isinstance(clip, Difference)


def check_is_motion(name: str) -> None:
    """Check that a clip is a motion by itself.

    Raises:
        ValueError: an additive clip. The text names the clip that is the motion, if there is one.
    """
    if not is_additive(name):
        return
    match clip_of(name):
        case Difference() as clip:
            cure = f": take {clip.loop}"
        case BlowClip() as clip:
            cure = f": take stagger_{clip.side}"
        case _:
            cure = ""
    raise ValueError(f"clips: {name} is added to another clip, and is no motion by itself{cure}")


def recordings_for_clips(names: Sequence[str]) -> dict[str, list[str]]:
    """Return the names of the recordings that clips use, each with the clips that cannot be made without it.

    A clip that compares itself with the walk uses its recording, but can be made without it.
    """
    clips_of_recording: dict[str, list[str]] = {}
    for name in names:
        clip = clip_of(name)
        for recording in _required_recordings(name, clip):
            clips_of_recording.setdefault(recording, []).append(name)
        if isinstance(clip, Difference):
            clips_of_recording.setdefault(clip.base, [])
        if isinstance(clip, Passage) or name in SPEED_RATIOS:
            clips_of_recording.setdefault("walk", [])
    return clips_of_recording


def _required_recordings(name: str, clip: Kind) -> tuple[str, ...]:
    """Return the names of the recordings without which a clip cannot be made."""
    match clip:
        case Difference():
            return clip.loop, REST
        case WalkLoop() | Showcase():
            return (name,)
        case _:
            return (REST,)
