"""Animation clips: named motions of one body, which loop and stay in step with one another."""

import collections
import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite import checks
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.dm import load
from arc_suite.export import motions
from arc_suite.export.footfalls import TOUCH_DOWN, Footfall, footfalls, sole_heights
from arc_suite.export.idle import idle
from arc_suite.export.motions import Motion, Stretch
from arc_suite.export.recordings import Recording, record
from arc_suite.models.sizing import SUBSTEPS
from arc_suite.policies import policy as named_policy
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled

FPS = 60

_SETTLE = 200  # control steps, after which starts and changes of command are forgotten
_WALKED = 700  # control steps: most of an episode, as the speed of feet that slip takes that long to be known
_STEERED = 300  # control steps: longer than the longest loop of any body, by some cycles to choose from
_BEFORE_STOP, _AFTER_STOP = 3, 5  # gait cycles of a recorded stop, before and after the command
_STOPPING = 3  # gait cycles of the clip


class Shot(NamedTuple):
    """How a clip is made.

    Attributes:
        preset: of the demonstrator; None for the policy that is asked for.
        command: that the demonstrator `steered` follows, forward, left and turning in units of `steer`; None
            for a clip of the policy.
        stops: whether the command ends, and with it the clip.
    """

    preset: str | None = None
    command: tuple[float, float, float] | None = None
    stops: bool = False


CLIPS = {
    "walk": Shot(),
    "slow": Shot(preset="slow"),
    "fast": Shot(preset="fast"),
    "turn_left": Shot(command=(0.5, 0.0, 0.5)),
    "turn_right": Shot(command=(0.5, 0.0, -0.5)),
    "strafe_left": Shot(command=(0.0, 0.5, 0.0)),
    "strafe_right": Shot(command=(0.0, -0.5, 0.0)),
    "back": Shot(command=(-0.5, 0.0, 0.0)),
    "stop": Shot(command=(1.0, 0.0, 0.0), stops=True),
    "idle": None,  # no recording, which would creep
}
DEFAULT = ("walk", "slow", "fast", "turn_left", "turn_right", "idle")


class Clip(NamedTuple):
    """A named motion, sampled at the frames of a clip.

    Attributes:
        name: of `CLIPS`.
        motion: a sample for each frame, both ends included.
        loops: whether the last pose is the first one.
        cycles: of the gait.
        footfalls: in the order of time.
    """

    name: str
    motion: Motion
    loops: bool
    cycles: int
    footfalls: tuple[Footfall, ...]

    @property
    def times(self) -> np.ndarray:
        """Times (frames,) of the frames, s."""
        return self.motion.step * np.arange(len(self.motion.joints))

    @property
    def moves(self) -> bool:
        """Whether the root moves."""
        return bool(self.motion.root.any())


def clips(
    body: Body,
    names: Sequence[str],
    policy: str = "cpg",
    preset: str | None = None,
    task: str = "walk",
    task_kwargs: Mapping[str, Any] | None = None,
    fps: float = FPS,
    progress: Callable[[Iterable[str]], Iterable[str]] = iter,
) -> list[Clip]:
    """Make clips of a body.

    All loops hold the same number of gait cycles: the least with which every pose returns within half a degree and
    every root goes as fast as its walk does on the mean, to 1 %; where there is none, the least with which poses
    return, or the one that comes nearest to it. Loops begin as the first leg that steps in all of them touches down.
    A clip has the whole number of frames that comes nearest to the rate, evenly over its duration. Soles in stance
    lie at 0 in the median.

    Args:
        body: any body.
        names: of `CLIPS`.
        policy: of the clip walk, as `policies.policy` takes it.
        preset: of the policy; None for tuned, or medium for a body that has no tuned one.
        task: in which the policy walks, by name.
        task_kwargs: its settings, as in `arc_suite.load`.
        fps: frames a second.
        progress: is given the names, and hands them on as the work on each begins.

    Raises:
        ValueError: an unknown name, a value out of range, a policy that falls or whose pose does not return
            within two degrees; one line.
        OSError: a file cannot be read.
    """
    checks.number("fps", fps, 1.0, 1000.0)
    for name in names:
        checks.name(name, CLIPS, "clip")
    if len(set(names)) < len(names):
        raise ValueError(f"clips: expected each once, got {', '.join(names)}")
    if preset is None:
        preset = "tuned" if "tuned" in presets_of(body) else "medium"
    model, takes = compiled(body), {}
    for name in progress(list(names)):
        shot = CLIPS[name]
        if shot is not None:
            try:
                takes[name] = _taken(body, shot, policy, preset, task, task_kwargs)
            except ValueError as error:
                raise ValueError(f"{body.name}, clip {name}: {error}") from None
    drafts = _loops(body, takes) | {name: _stop(take) for name, take in takes.items() if take.stop is not None}
    if "idle" in names:
        drafts["idle"] = _Draft(idle(body), True, 0)
    drafts = _in_step(model, body, drafts)
    return [_framed(name, model, body, drafts[name], fps) for name in names]


class _Take(NamedTuple):
    """A recording, the gait cycle in it, s, and the sample at which it is told to stop, if it is."""

    recording: Recording
    cycle: float
    stop: int | None = None


class _Draft(NamedTuple):
    """A motion with a sample for every substep, on its way to a clip.

    Attributes:
        motion: of the body.
        loops: whether its last pose is its first one.
        cycles: of the gait, that the clip holds.
        cycle: s.
        stop: of a motion that is longer than the clip, the sample before which that begins, and how many samples
            it has; None for a loop.
    """

    motion: Motion
    loops: bool
    cycles: int
    cycle: float = math.nan
    stop: tuple[int, int] | None = None


def _taken(body: Body, shot: Shot, policy, preset, task, task_kwargs) -> _Take:
    """Record what a clip needs."""
    if shot.command is None:
        environment = load(body, task, {"random": 0, **(task_kwargs or {})})
        name, chosen = "cpg" if shot.preset else policy, shot.preset or preset
        actor = named_policy(name, body, chosen, task=environment.task.definition)
        recording = record(environment, actor, _SETTLE, _WALKED)
        cycle = motions.period(recording)
        if cycle is None:
            seconds = len(recording.qpos) * recording.step / 2.0
            raise ValueError(f"the pose does not return within {seconds:.3g} s")
        return _Take(recording, cycle)
    environment = load(body, "steer", {"random": 0})
    actor = Demonstrator(environment, "steered")
    # It walks by the task's clock; some bodies take every other stride differently.
    cycle = 1.0 / environment.task.definition.parameters.gait_frequency
    if not shot.stops:
        return _Take(record(environment, actor, _SETTLE, _STEERED, [(0, shot.command)]), cycle)
    before, after = (round(cycles * cycle / environment.control_timestep()) for cycles in (_BEFORE_STOP, _AFTER_STOP))
    commands = [(0, shot.command), (_SETTLE + before, (0.0, 0.0, 0.0))]
    return _Take(record(environment, actor, _SETTLE, before + after, commands), cycle, before * SUBSTEPS)


def _loops(body: Body, takes: Mapping[str, _Take]) -> dict[str, _Draft]:
    """Return the loops among recordings, with the same number of cycles in all of them."""
    takes = {name: take for name, take in takes.items() if take.stop is None}
    if not takes:
        return {}
    closings = {name: motions.closings(take.recording, take.cycle) for name, take in takes.items()}
    common = sorted(set.intersection(*map(set, closings.values())))
    worst = {cycles: max(closing[cycles].seam for closing in closings.values()) for cycles in common}
    closed = [cycles for cycles in common if worst[cycles] <= motions.CLOSED] or [min(common, key=worst.get)]
    for name, closing in closings.items():
        cycles, seam = closed[0], closing[closed[0]].seam
        if seam > motions.OPEN:
            raise ValueError(
                f"{body.name}, clip {name}: the pose does not return within {np.degrees(motions.OPEN):.0f} degrees: "
                f"{np.degrees(seam):.1f} after {cycles} cycles"
            )

    @functools.cache
    def chosen(cycles: int) -> dict[str, Stretch]:
        return {name: motions.usual(take.recording, closings[name][cycles].samples) for name, take in takes.items()}

    cycles = next((some for some in closed if all(each.usual for each in chosen(some).values())), closed[0])
    return {
        name: _Draft(motions.loop(take.recording, chosen(cycles)[name]), True, cycles, take.cycle)
        for name, take in takes.items()
    }


def _stop(take: _Take) -> _Draft:
    """Return a recorded stop, but for a cycle at both ends, of which the root's path is a mean."""
    window = round(take.cycle / take.recording.step)
    motion = motions.passage(take.recording, window, len(take.recording.qpos) - 2 * window - 1, window)
    return _Draft(motion, False, _STOPPING, take.cycle, (take.stop - window, _STOPPING * window))


def _feet(model: mujoco.MjModel, body: Body, draft: _Draft) -> tuple[float, list[Footfall]]:
    """Return the median height of soles in stance, m, and the footfalls, of which one that stands has none."""
    heights = sole_heights(model, body, draft.motion.qpos())
    if not draft.cycles:
        return float(np.median(heights)), []
    found, stance = footfalls(draft.motion, body, heights, draft.cycle, draft.loops)
    return float(np.median(heights[stance])) if stance.any() else 0.0, found


def _in_step(model: mujoco.MjModel, body: Body, drafts: Mapping[str, _Draft]) -> dict[str, _Draft]:
    """Return the motions so that all that walk begin with a touch-down of the same foot, the first that can."""
    downs = {}
    for name, draft in drafts.items():
        downs[name] = collections.defaultdict(list)
        for footfall in _feet(model, body, draft)[1]:
            if footfall.event == TOUCH_DOWN and (draft.loops or footfall.sample <= draft.stop[0]):
                downs[name][footfall.foot].append(footfall.sample)
    walking = [downs[name] for name, draft in drafts.items() if draft.cycles]
    foot = next((foot for foot in body.foot_names if all(foot in down for down in walking)), None)
    return {name: _begun(draft, downs[name].get(foot)) for name, draft in drafts.items()}


def _begun(draft: _Draft, downs: Sequence[int] | None) -> _Draft:
    """Return a motion as it begins with a touch-down: a loop with the first, a stop with the last of some samples."""
    if draft.loops:
        return draft._replace(motion=draft.motion.begun(downs[0])) if downs else draft
    latest, samples = draft.stop
    return draft._replace(motion=draft.motion.part(downs[-1] if downs else latest, samples))


def _framed(name: str, model: mujoco.MjModel, body: Body, draft: _Draft, fps: float) -> Clip:
    """Return a motion on the ground, as frames."""
    hover, found = _feet(model, body, draft)
    motion = draft.motion.lowered(hover)
    frames = max(1, round(motion.seconds * fps))
    return Clip(
        name=name,
        motion=motion.at(np.linspace(0.0, motion.seconds, frames + 1)),
        loops=draft.loops,
        cycles=draft.cycles,
        footfalls=tuple(found),
    )
