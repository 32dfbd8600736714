"""Animation clips: named motions of one body, which loop and stay in step with one another."""

import collections
import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import checks
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.export import root_motion
from arc_suite.export.foot_contacts import TOUCH_DOWN, FootContact, foot_contacts, sole_heights
from arc_suite.export.idle import idle
from arc_suite.export.recordings import Recording, record
from arc_suite.export.root_motion import Motion, Stretch
from arc_suite.models.sizing import SUBSTEPS
from arc_suite.policies import policy as named_policy
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled

FPS = 60

_SETTLE = 200  # control steps, after which starts and changes of command are forgotten
_WALKED = 700  # control steps: most of an episode, as the speed of feet that slip recorded that long to be known
_STEERED = 300  # control steps: longer than the longest loop of any body, by some cycles to choose from
_BEFORE_STOP, _AFTER_STOP = 3, 5  # gait cycles of a recorded stop, before and after the command
_STOPPING = 3  # gait cycles of the clip


class RecordingSpec(NamedTuple):
    """What is recorded for a clip.

    Attributes:
        preset: of the demonstrator; None for the caller's policy.
        command: forward, left and turning in units of `steer`, which the demonstrator `steered` follows; None for a
            clip of the policy.
        stops: whether the command ends within the clip.
    """

    preset: str | None = None
    command: tuple[float, float, float] | None = None
    stops: bool = False


CLIPS = {
    "walk": RecordingSpec(),
    "slow": RecordingSpec(preset="slow"),
    "fast": RecordingSpec(preset="fast"),
    "turn_left": RecordingSpec(command=(0.5, 0.0, 0.5)),
    "turn_right": RecordingSpec(command=(0.5, 0.0, -0.5)),
    "strafe_left": RecordingSpec(command=(0.0, 0.5, 0.0)),
    "strafe_right": RecordingSpec(command=(0.0, -0.5, 0.0)),
    "back": RecordingSpec(command=(-0.5, 0.0, 0.0)),
    "stop": RecordingSpec(command=(1.0, 0.0, 0.0), stops=True),
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
        foot_contacts: events, in the order of time.
    """

    name: str
    motion: Motion
    loops: bool
    cycles: int
    foot_contacts: tuple[FootContact, ...]

    @property
    def times(self) -> np.ndarray:
        """Times (frames,) of the frames, s."""
        return self.motion.step * np.arange(len(self.motion.joints))

    @property
    def moves(self) -> bool:
        """Whether the root moves."""
        return bool(self.motion.root.any())


def clips(
    setup: Setup,
    names: Sequence[str],
    policy: str = "cpg",
    preset: str | None = None,
    fps: float = FPS,
    progress: Callable[[Iterable[str]], Iterable[str]] = iter,
) -> list[Clip]:
    """Make clips of a body.

    All loops hold the same number of gait cycles: the least with which every pose returns within half a degree and
    every root has the mean speed of its walk, to 1 %. Without one, it is the least with which poses return, or else
    the closest. Loops begin with a touchdown of the same foot, the first that steps in all of them. A clip has the
    number of frames that is closest to the rate, evenly over its duration. The median height of soles in stance is 0.

    Args:
        setup: body, and the task of the clips that follow no command.
        names: of `CLIPS`.
        policy: of the clip walk; see `policies.policy`.
        preset: of the policy; None for tuned, or medium for a body that has no tuned one.
        fps: frames a second.
        progress: wraps the names, such as `tqdm`.

    Raises:
        ValueError: no name, an unknown one, a value out of range, a policy that falls or whose pose does not return
            within two degrees.
        OSError: a file cannot be read.
    """
    checks.number("fps", fps, 1.0, 1000.0)
    if not names:
        raise ValueError(f"clips: expected one or more of {', '.join(CLIPS)}, got none")
    for name in names:
        checks.name(name, CLIPS, "clip")
    if len(set(names)) < len(names):
        raise ValueError(f"clips: expected each once, got {', '.join(names)}")
    body = setup.body
    if preset is None:
        preset = "tuned" if "tuned" in presets_of(body) else "medium"
    model, recorded = compiled(body), {}
    for name in progress(list(names)):
        spec = CLIPS[name]
        if spec is not None:
            try:
                recorded[name] = _recorded(setup, spec, policy, preset)
            except ValueError as error:
                raise ValueError(f"{body.name}, clip {name}: {error}") from None
    drafts = _loops(body, recorded) | {name: _stop(each) for name, each in recorded.items() if each.stop is not None}
    if "idle" in names:
        drafts["idle"] = _Draft(idle(body), True, 0)
    drafts = _in_step(model, body, drafts)
    return [_framed(name, model, body, drafts[name], fps) for name in names]


class _Recorded(NamedTuple):
    """A recording with its gait cycle, s, and the sample at which the command ends, if it does."""

    recording: Recording
    cycle: float
    stop: int | None = None


class _Draft(NamedTuple):
    """A motion with a sample for every substep: the source of a clip.

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


def _recorded(setup: Setup, spec: RecordingSpec, policy, preset) -> _Recorded:
    """Record a policy for a clip."""
    if spec.command is None:
        environment = setup.load(seed=0)
        name, chosen = "cpg" if spec.preset else policy, spec.preset or preset
        actor = named_policy(name, setup.body, chosen, task=environment.task.definition)
        recording = record(environment, actor, _SETTLE, _WALKED)
        cycle = root_motion.period(recording)
        if cycle is None:
            seconds = len(recording.qpos) * recording.step / 2.0
            raise ValueError(f"the pose does not return within {seconds:.3g} s")
        return _Recorded(recording, cycle)
    environment = Setup.of(setup.body, "steer").load(seed=0)
    actor = Demonstrator(environment, "steered")
    # It walks by the task's clock; some bodies take every other stride differently.
    cycle = 1.0 / environment.task.definition.parameters.gait_frequency
    if not spec.stops:
        return _Recorded(record(environment, actor, _SETTLE, _STEERED, [(0, spec.command)]), cycle)
    before, after = (round(cycles * cycle / environment.control_timestep()) for cycles in (_BEFORE_STOP, _AFTER_STOP))
    commands = [(0, spec.command), (_SETTLE + before, (0.0, 0.0, 0.0))]
    return _Recorded(record(environment, actor, _SETTLE, before + after, commands), cycle, before * SUBSTEPS)


def _loops(body: Body, recorded: Mapping[str, _Recorded]) -> dict[str, _Draft]:
    """Return the loops among recordings, with the same number of cycles in all of them."""
    recorded = {name: each for name, each in recorded.items() if each.stop is None}
    if not recorded:
        return {}
    closings = {name: root_motion.closings(each.recording, each.cycle) for name, each in recorded.items()}
    common = sorted(set.intersection(*map(set, closings.values())))
    worst = {cycles: max(closing[cycles].seam for closing in closings.values()) for cycles in common}
    closed = [cycles for cycles in common if worst[cycles] <= root_motion.CLOSED] or [min(common, key=worst.get)]
    for name, closing in closings.items():
        cycles, seam = closed[0], closing[closed[0]].seam
        if seam > root_motion.OPEN:
            most, found = np.degrees((root_motion.OPEN, seam))
            missed = f"the pose does not return within {most:.0f} degrees: {found:.1f} after {cycles} cycles"
            raise ValueError(f"{body.name}, clip {name}: {missed}")

    @functools.cache
    def chosen(cycles: int) -> dict[str, Stretch]:
        return {
            name: root_motion.usual(each.recording, closings[name][cycles].samples) for name, each in recorded.items()
        }

    cycles = next((some for some in closed if all(each.usual for each in chosen(some).values())), closed[0])
    return {
        name: _Draft(root_motion.loop(each.recording, chosen(cycles)[name]), True, cycles, each.cycle)
        for name, each in recorded.items()
    }


def _stop(recorded: _Recorded) -> _Draft:
    """Return a recorded stop without a cycle at both ends, which the moving average of the root's path uses up."""
    window = round(recorded.cycle / recorded.recording.step)
    motion = root_motion.passage(recorded.recording, window, len(recorded.recording.qpos) - 2 * window - 1, window)
    return _Draft(motion, False, _STOPPING, recorded.cycle, (recorded.stop - window, _STOPPING * window))


def _feet(model: mujoco.MjModel, body: Body, draft: _Draft) -> tuple[float, list[FootContact]]:
    """Return the median height of soles in stance, m, and the foot contact events; none of a body that stands."""
    heights = sole_heights(model, body, draft.motion.qpos())
    if not draft.cycles:
        return float(np.median(heights)), []
    found, stance = foot_contacts(draft.motion, body, heights, draft.cycle, draft.loops)
    return float(np.median(heights[stance])) if stance.any() else 0.0, found


def _in_step(model: mujoco.MjModel, body: Body, drafts: Mapping[str, _Draft]) -> dict[str, _Draft]:
    """Shift the motions so that all walks begin with a touchdown of the same foot, the first that can."""
    downs = {}
    for name, draft in drafts.items():
        downs[name] = collections.defaultdict(list)
        for contact in _feet(model, body, draft)[1]:
            if contact.event == TOUCH_DOWN and (draft.loops or contact.sample <= draft.stop[0]):
                downs[name][contact.foot].append(contact.sample)
    walking = [downs[name] for name, draft in drafts.items() if draft.cycles]
    foot = next((foot for foot in body.foot_names if all(foot in down for down in walking)), None)
    return {name: _begun(draft, downs[name].get(foot)) for name, draft in drafts.items()}


def _begun(draft: _Draft, downs: Sequence[int] | None) -> _Draft:
    """Shift a motion to begin with a touchdown: a loop with the first, a stop with the last of the given samples."""
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
        foot_contacts=tuple(found),
    )
