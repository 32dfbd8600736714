"""Drafts of clips: motions at the pace of the physics, made of recordings, which connect."""

import math
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.export import in_place, loops, root_motion
from arc_suite.export.catalogue import CLIPS, FASTER, REST, Passage, Showcase, Walk, sources
from arc_suite.export.foot_contacts import TOUCH_DOWN, FootContact, foot_contacts, sole_heights
from arc_suite.export.recorder import Recorded, Recorder, Transition
from arc_suite.export.root_motion import Motion, Pose
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled

_MOST_CYCLES = 4  # of loops that stay in step
_MOST_ALONE = 12  # of a loop with a gait of its own
_FOLLOWS = 0.25  # of its command's velocity, that a loop has at least
_APART = 1.1  # ratio of the speeds of two clips, one of which is called faster


class Draft(NamedTuple):
    """A motion with a sample for every substep.

    Attributes:
        motion: of the body.
        cycles: of the gait; 0 without a gait.
        cycle: s.
        loops: whether its last pose is its first one.
    """

    motion: Motion
    cycles: int = 0
    cycle: float = math.nan
    loops: bool = True

    @property
    def start(self) -> Pose:
        """First pose."""
        return self.motion.pose(0)

    def contacts(self, body: Body) -> tuple[float, list[FootContact]]:
        """Return the median height of soles in stance, m, and the foot contact events; none without a gait."""
        heights = sole_heights(compiled(body), body, self.motion.qpos())
        if not self.cycles:
            return float(np.median(heights)), []
        found, stance = foot_contacts(self.motion, body, heights, self.cycle, self.loops)
        return float(np.median(heights[stance])) if stance.any() else 0.0, found

    def grounded(self, body: Body) -> "Draft":
        """Return the draft with soles in stance on the ground."""
        return self._replace(motion=self.motion.lowered(self.contacts(body)[0]))


def drafts(
    recorder: Recorder,
    names: Sequence[str],
    progress: Callable[[Iterable], Iterable],
    left_out: MutableMapping[str, str],
) -> dict[str, Draft]:
    """Record what clips need and return their drafts by name, and those of clips that these connect to.

    Args:
        recorder: of the body.
        names: of `catalogue.CLIPS`.
        progress: wraps the recordings.
        left_out: takes the reasons why clips cannot be made, by name.
    """
    body, recorded = recorder.body, _recordings(recorder, names, progress, left_out)
    gaits = {name: each for name, each in recorded.items() if name != REST}
    clocked = {name: each for name, each in gaits.items() if each.phase is not None}
    found = _in_step(body, clocked, _MOST_CYCLES, loops.OPEN, left_out) if clocked else {}
    for name in gaits.keys() - clocked.keys():
        found |= _in_step(body, {name: gaits[name]}, _MOST_ALONE, loops.CLOSED, left_out)
    _check_commands(found, recorder.units, left_out)
    _check_speeds(found, left_out)
    if REST in recorded:
        found |= _connected(body, recorded[REST], names, found.get("walk"), left_out)
    return found


def _recordings(recorder: Recorder, names, progress, left_out) -> dict[str, Recorded | Transition]:
    """Return recordings by name; reasons of failures go to `left_out`."""
    found = {}
    for source, needed_by in progress(list(sources(names).items())):
        try:
            found[source] = _recording(recorder, source)
        except ValueError as error:
            left_out |= dict.fromkeys(needed_by, str(error))
    return found


def _recording(recorder: Recorder, source: str) -> Recorded | Transition:
    if source == REST:
        return recorder.transition(CLIPS["walk"].command)
    spec = CLIPS[source]
    if isinstance(spec, Showcase):
        return recorder.showcase(spec.preset)
    return recorder.alone() if source == "walk" and not recorder.follows else recorder.walk(spec.command)


def _in_step(body: Body, recorded: Mapping[str, Recorded], most: int, bound: float, left_out) -> dict[str, Draft]:
    """Return loops of recordings that hold the same number of cycles and begin at the same phase, on the ground."""
    closings = {name: loops.closings(each.recording, each.cycle, most) for name, each in recorded.items()}
    cycles, found = loops.best(closings, bound), {}
    for name, each in recorded.items():
        closing = closings[name][cycles]
        if closing.seam > loops.OPEN:
            bound, seam = np.degrees((loops.OPEN, closing.seam))
            left_out[name] = f"the pose does not return within {bound:.0f} degrees: {seam:.1f} after {cycles} cycles"
            continue
        first = loops.usual(each.recording, closing.samples)
        draft = Draft(loops.loop(each.recording, first, closing.samples), cycles, each.cycle)
        begin = _first_touchdown(body, draft) if each.phase is None else each.wait(first)
        found[name] = draft._replace(motion=draft.motion.begun(begin)).grounded(body)
    return found


def _first_touchdown(body: Body, draft: Draft) -> int:
    """Return the sample in which the first foot that steps touches down; 0 if none does."""
    downs = [contact for contact in draft.contacts(body)[1] if contact.event == TOUCH_DOWN]
    return min(downs, key=lambda contact: (body.foot_names.index(contact.foot), contact.sample)).sample if downs else 0


def _check_commands(found: dict[str, Draft], units: np.ndarray | None, left_out) -> None:
    """Leave out loops that do not follow their commands."""
    for name, draft in list(found.items()):
        if units is not None and isinstance(spec := CLIPS[name], Walk):
            command = np.array(spec.command)
            share = command @ (draft.motion.twist / units) / (command @ command)
            if share < _FOLLOWS:
                left_out[name] = f"the policy moves by {share:.2f} of its command"
                del found[name]


def _check_speeds(found: dict[str, Draft], left_out) -> None:
    """Leave out loops whose speed is not what their names say, given that of the walk."""
    if "walk" not in found:
        return
    usual = np.hypot(*found["walk"].motion.twist[:2])
    for name, sign in FASTER.items():
        if name in found:
            speed = np.hypot(*found[name].motion.twist[:2])
            if (speed / usual) ** sign < _APART:
                left_out[name] = f"its speed is {speed:.3f} m/s, and that of the walk {usual:.3f}"
                del found[name]


def _connected(
    body: Body, transition: Transition, names: Sequence[str], walk: Draft | None, left_out
) -> dict[str, Draft]:
    """Return the draft of idle, and of stop and start where they are asked for, which meet the walk and idle."""
    recorded = transition.recorded
    cycle = round(recorded.cycle / recorded.recording.step)
    rest = root_motion.standing(recorded.recording, transition.start, 1).pose(0)
    found = {"idle": Draft(in_place.idle(body, rest)).grounded(body)}
    for name in names:
        spec = CLIPS[name]
        if isinstance(spec, Passage) and walk is None:
            left_out[name] = "there is no walk that it connects to"
        elif isinstance(spec, Passage):
            first = transition.start if spec.starts else transition.stop
            samples = spec.cycles * cycle - transition.late * spec.starts
            motion = root_motion.passage(recorded.recording, first, samples, cycle)
            draft = Draft(motion, spec.cycles, recorded.cycle, loops=False).grounded(body)
            ends = {0 if spec.starts else -1: found["idle"].start, -1 if spec.starts else 0: walk.start}
            for end, pose in ends.items():
                draft = draft._replace(motion=draft.motion.meeting(pose, end, cycle))
            found[name] = draft
    return found
