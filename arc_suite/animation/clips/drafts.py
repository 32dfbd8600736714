"""Drafts of clips: motions at the pace of the physics, made of recordings, which connect."""

import math
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import loops, planting, root_motion
from arc_suite.animation.clips.catalog import (
    REST,
    SPEED_RATIOS,
    WALK,
    Acted,
    Difference,
    Passage,
    Showcase,
    Turn,
    WalkLoop,
    clip_of,
    recordings_needed,
)
from arc_suite.animation.clips.foot_contacts import MIN_RISE, TOUCH_DOWN, FootContact, find_foot_contacts, sole_heights
from arc_suite.animation.clips.recorder import GaitRecording, Recorder, TransitionRecording, TurnRecording
from arc_suite.animation.clips.root_motion import Motion, Pose
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled

_MOST_CYCLES = 4  # of loops that stay in step
_MOST_ALONE = 12  # of a loop with a gait of its own
_FOLLOWS = 0.25  # of its command's velocity, that a loop has at least
_DEEPEST = 0.025  # of the standing height, that a sole is below the ground where others are on it
_RAISED = 0.05  # of the standing height, that a foot which steps rises in a gesture
_FAR = np.radians(20.0)  # from the pose of a clip, from which a stop or a start is not made to meet it


class Draft(NamedTuple):
    """A motion with a sample for every substep.

    Attributes:
        motion: of the body.
        cycles: of the gait; 0 without a gait.
        cycle: s.
        loops: whether its last pose is its first one.
        stands: whether there is nothing to tell of feet.
    """

    motion: Motion
    cycles: int = 0
    cycle: float = math.nan
    loops: bool = True
    stands: bool = False

    @property
    def start(self) -> Pose:
        """First pose."""
        return self.motion.pose(0)

    def find_foot_contacts(self, body: Body) -> tuple[float, list[FootContact]]:
        """Return the median height of soles in stance, m, and the foot contact events; none without a gait."""
        heights = sole_heights(compiled(body), body, self.motion.poses())
        if self.stands:
            return float(np.median(heights)), []
        least = MIN_RISE if self.cycles else _RAISED
        found, stance = find_foot_contacts(self.motion, body, heights, self.cycle, self.loops, least)
        return float(np.median(heights[stance])) if stance.any() else 0.0, found

    def plant_feet(self, body: Body) -> "Draft":
        """Return the draft with feet in stance that do not slide; see `planting.plant_feet`."""
        return self._replace(motion=planting.plant_feet(body, self.motion, self.cycle, self.loops))

    def put_on_ground(self, body: Body) -> "Draft":
        """Return the draft with soles in stance on the ground, and none deep in it."""
        lowest = float(sole_heights(compiled(body), body, self.motion.poses()).min())
        height = min(self.find_foot_contacts(body)[0], lowest + _DEEPEST * body.torso.standing_height)
        return self._replace(motion=self.motion.lower(height))


def make_drafts(
    recorder: Recorder,
    names: Sequence[str],
    progress: Callable[[Iterable], Iterable],
    left_out: MutableMapping[str, str],
    straight: bool = False,
    plant: bool = False,
) -> dict[str, Draft]:
    """Record what clips need and return their drafts by name, and those of clips that these connect to.

    Args:
        recorder: of the body.
        names: see `catalog.clip_of`, without modules.
        progress: wraps the recordings.
        left_out: takes the reasons why clips cannot be made, by name.
        straight: whether loops that do not turn go exactly where their commands say.
        plant: whether feet in stance do not slide.
    """
    body, recorded = recorder.body, _recordings(recorder, names, progress, left_out)
    gaits = {name: each for name, each in recorded.items() if isinstance(each, GaitRecording)}
    clocked = {name: each for name, each in gaits.items() if each.phase is not None}
    found = _in_step(body, clocked, _MOST_CYCLES, loops.MAX_SEAM, left_out) if clocked else {}
    for name in gaits.keys() - clocked.keys():
        found |= _in_step(body, {name: gaits[name]}, _MOST_ALONE, loops.GOOD_SEAM, left_out)
    reasons = {name: _unfit(name, draft, recorder.velocity_units, found.get("walk")) for name, draft in found.items()}
    left_out.update({name: reason for name, reason in reasons.items() if reason})
    found = {name: draft for name, draft in found.items() if not reasons[name]}
    if straight:
        found = {name: draft._replace(motion=_straight(name, draft.motion)) for name, draft in found.items()}
    walk = found.get("walk")
    if plant:
        found = {name: draft.plant_feet(body) for name, draft in found.items()}
    if isinstance(transition := recorded.get(REST), TransitionRecording):
        turns = {name: each for name, each in recorded.items() if isinstance(each, TurnRecording)}
        found |= _connected(body, transition, turns, names, walk, found.get("walk") if plant else None, left_out)
    for name in names:
        if isinstance(spec := clip_of(name), Difference) and name not in left_out:
            if {spec.loop, spec.base, "idle"} <= found.keys():
                found[name] = _difference(found[spec.loop], found[spec.base], found["idle"].start)
            else:
                left_out[name] = left_out.get(spec.loop, f"there is no {spec.base} that it differs from")
    return found


def _recordings(
    recorder: Recorder, names, progress, left_out
) -> dict[str, GaitRecording | TransitionRecording | TurnRecording]:
    """Return recordings by name; reasons of failures go to `left_out`."""
    found = {}
    for source, needed_by in progress(list(recordings_needed(names).items())):
        try:
            found[source] = _recording(recorder, source)
        except ValueError as error:
            left_out |= dict.fromkeys(needed_by, str(error))
    return found


def _recording(recorder: Recorder, source: str) -> GaitRecording | TransitionRecording | TurnRecording:
    if source == REST:
        return recorder.record_transition(WALK.command)
    match clip_of(source):
        case Turn() as turn:
            return recorder.record_turn(math.radians(turn.angle))
        case Showcase() as showcase:
            return recorder.record_showcase(showcase.preset)
        case WalkLoop() as loop:
            return (
                recorder.record_without_command()
                if source == "walk" and not recorder.has_command
                else recorder.record_walk(*loop)
            )
    raise ValueError(f"{source} is no loop that is recorded")  # of a difference of another package


def _in_step(body: Body, recorded: Mapping[str, GaitRecording], most: int, bound: float, left_out) -> dict[str, Draft]:
    """Return loops of recordings that hold the same number of cycles and begin at the same phase, on the ground."""
    closings = {name: loops.find_closings(each.recording, each.cycle, most) for name, each in recorded.items()}
    cycles, found = loops.choose_cycles(closings, bound), {}
    for name, each in recorded.items():
        closing = closings[name][cycles]
        if closing.seam > loops.MAX_SEAM:
            bound, seam = np.degrees((loops.MAX_SEAM, closing.seam))
            left_out[name] = f"the pose does not return within {bound:.0f} degrees: {seam:.1f} after {cycles} cycles"
            continue
        first = loops.choose_start(each.recording, closing.samples)
        draft = Draft(loops.cut_loop(each.recording, first, closing.samples), cycles, each.cycle).put_on_ground(body)
        begin = _first_touchdown(body, draft) if each.phase is None else each.wait(first)
        found[name] = draft._replace(motion=draft.motion.start_at(begin))
    return found


def _straight(name: str, motion: Motion) -> Motion:
    """Return a loop that goes where its command says, unless that is a turn."""
    spec = clip_of(name)
    forward, left, turning = spec.command if isinstance(spec, WalkLoop) else (1.0, 0.0, 0.0)
    return motion if turning else loops.straighten_loop(motion, math.atan2(left, forward))


def _first_touchdown(body: Body, draft: Draft) -> int:
    """Return the sample in which the first foot that steps touches down; 0 if none does."""
    downs = [contact for contact in draft.find_foot_contacts(body)[1] if contact.event == TOUCH_DOWN]
    return min(downs, key=lambda contact: (body.foot_names.index(contact.foot), contact.sample)).sample if downs else 0


def _unfit(name: str, draft: Draft, units: np.ndarray | None, walk: Draft | None) -> str:
    """Return why a loop is not what its name says: it does not follow its command, or is as fast as the walk; or ""."""
    if units is not None and isinstance(spec := clip_of(name), WalkLoop):
        command = np.array(spec.command)
        share = command @ (draft.motion.twist / units) / (command @ command)
        if share < _FOLLOWS:
            return f"the policy moves at {round(100.0 * share)} % of its command, less than {100.0 * _FOLLOWS:.0f} %"
    if name in SPEED_RATIOS and walk is not None:
        (low, high), (speed, usual) = SPEED_RATIOS[name], (np.hypot(*each.motion.twist[:2]) for each in (draft, walk))
        if not low <= speed / usual <= high:
            rule = f"{low:g} times that or more" if low else f"{high:.2g} times that or less"
            return f"its speed is {speed:.3f} m/s, and that of the walk {usual:.3f}: {name} has {rule}"
    return ""


def _connected(
    body: Body,
    transition: TransitionRecording,
    turns: Mapping[str, TurnRecording],
    names: Sequence[str],
    walk: Draft | None,
    planted: Draft | None,
    left_out,
) -> dict[str, Draft]:
    """Return the draft of idle, and of the clips that connect to it where they are asked for.

    Args:
        body: the spec.
        transition: from which rest is taken, and stops and starts.
        turns: recordings by name.
        names: of the clips.
        walk: that stops and starts connect to, with feet as in the physics.
        planted: the same with planted feet; None if feet are not to be planted.
        left_out: takes the reasons why clips cannot be made.
    """
    rest = root_motion.stay_at_start(transition.recorded.recording, transition.start, 1).pose(0)
    idle = _played(body, cast(Acted, clip_of("idle")), rest).put_on_ground(body)
    found = {"idle": idle}
    for name in names:
        try:
            match clip_of(name):
                case Acted() as spec if name != "idle":
                    found[name] = _acted(body, spec, rest, idle.start)
                case Turn() as spec if name in turns:
                    draft = _turn(body, math.radians(spec.angle), turns[name], idle.start)
                    found[name] = _planted_turn(body, draft, idle.start) if planted else draft
                case Passage() as spec:
                    draft = _passage(body, spec, transition, idle.start, walk)
                    found[name] = _planted_passage(body, spec, draft, idle.start, walk, planted) if planted else draft
        except ValueError as error:
            left_out[name] = str(error)
    return found


def _played(body: Body, spec: Acted, rest: Pose) -> Draft:
    """Return a motion from the pose at rest.

    Raises:
        ValueError: the clip plays no motion, as one of another package may.
    """
    motion = spec.play(body, rest)
    if not isinstance(motion, Motion):
        raise ValueError(f"expected a Motion of its play, got {type(motion).__name__}")
    return Draft(motion, loops=spec.loops, stands=not spec.steps)


def _acted(body: Body, spec: Acted, rest: Pose, idle: Pose) -> Draft:
    """Return a motion from the pose at rest, which meets idle; see `Acted`."""
    draft = _played(body, spec, rest)
    motion = draft.motion.lower(rest.position[2] - idle.position[2])
    for end in spec.ends:
        motion = motion.end_with(idle, end, len(motion.joints) // 3)
    return draft._replace(motion=motion)


def _turn(body: Body, angle: float, turned: TurnRecording, idle: Pose) -> Draft:
    """Return a turn from idle to idle by exactly an angle, rad, which the root takes up."""
    recorded = turned.recorded
    cycle = round(recorded.cycle / recorded.recording.time_step)
    motion = root_motion.follow_mean_path(recorded.recording, turned.first, turned.samples, cycle)
    draft = Draft(motion, round(turned.samples / cycle), recorded.cycle, loops=False).put_on_ground(body)
    motion = draft.motion.meet(idle, 0, cycle).meet(idle, -1, cycle)
    missing = (angle - motion.root[-1, 2]) * np.linspace(0.0, 1.0, len(motion.root))
    root = motion.root + missing[:, None] * (0.0, 0.0, 1.0)
    return draft._replace(motion=motion._replace(root=root, twist=root_motion.twist_to(root[-1]) / motion.seconds))


def _passage(body: Body, spec: Passage, transition: TransitionRecording, idle: Pose, walk: Draft | None) -> Draft:
    """Return a stop or a start, which meets idle and the walk.

    Raises:
        ValueError: there is no walk, or its pose is far from that of the passage.
    """
    if walk is None:
        raise ValueError("there is no walk that it connects to")
    draft = cut_passage(body, spec, transition)
    cycle, still, going = round(draft.cycle / draft.motion.time_step), *((0, -1) if spec.starts else (-1, 0))
    motion = draft.motion.meet(idle, still, cycle).meet(walk.start, going, cycle)
    if motion.seam > _FAR:
        seam, most = np.degrees((motion.seam, _FAR))
        raise ValueError(f"its pose is {seam:.0f} degrees from that of the walk or of idle, more than {most:.0f}")
    return draft._replace(motion=motion)


def _planted_turn(body: Body, draft: Draft, idle: Pose) -> Draft:
    """Return a turn with planted feet, which meets idle."""
    motion, cycle = draft.plant_feet(body).motion, round(draft.cycle / draft.motion.time_step)
    return draft._replace(motion=motion.end_with(idle, 0, cycle).end_with(idle, -1, cycle))


def _planted_passage(body: Body, spec: Passage, draft: Draft, idle: Pose, walk: Draft, planted: Draft) -> Draft:
    """Return a stop or a start with planted feet, which meets idle, and the planted walk in pose and velocity.

    It is planted together with the walk, so that a stance that lasts beyond its end has one place.

    Args:
        body: the spec.
        spec: of the clip.
        draft: the clip before, which meets idle and the walk.
        idle: first pose of idle.
        walk: with feet as in the physics.
        planted: the same with planted feet.
    """
    motion, count = draft.motion, len(draft.motion.joints)
    parts = (motion, walk.motion) if spec.starts else (walk.motion, motion)
    joints = draft._replace(motion=parts[0].append(parts[1])).plant_feet(body).motion.joints
    motion = motion._replace(joints=joints[:count] if spec.starts else joints[-count:])
    cycle, still, going = round(draft.cycle / motion.time_step), *((0, -1) if spec.starts else (-1, 0))
    return draft._replace(motion=motion.end_with(idle, still, cycle).end_with(planted.start, going, cycle))


def cut_passage(body: Body, spec: Passage, transition: TransitionRecording) -> Draft:
    """Return a stop or a start as it was recorded, with soles in stance on the ground."""
    recorded = transition.recorded
    cycle = round(recorded.cycle / recorded.recording.time_step)
    first = transition.start if spec.starts else transition.stop
    samples = spec.cycles * cycle - transition.late * spec.starts
    motion = root_motion.follow_mean_path(recorded.recording, first, samples, cycle)
    return Draft(motion, spec.cycles, recorded.cycle, loops=False).put_on_ground(body)


def _difference(draft: Draft, usual: Draft, pose: Pose) -> Draft:
    """Return how a loop differs from another in step with it, added to a pose; its root stays."""
    times = np.linspace(0.0, usual.motion.seconds, len(usual.motion.joints))
    motion, same = draft.motion.sample_at(times * draft.motion.seconds / usual.motion.seconds), usual.motion
    turns = rotations.product(motion.quaternions, same.quaternions * (1.0, -1.0, -1.0, -1.0))
    motion = motion._replace(
        time_step=same.time_step,
        root=np.zeros_like(same.root),
        positions=pose.position + motion.positions - same.positions,
        quaternions=rotations.product(turns, np.broadcast_to(pose.quaternion, turns.shape)),
        joints=pose.joints + motion.joints - same.joints,
        twist=np.zeros(3),
    )
    return draft._replace(motion=motion, cycle=usual.cycle, stands=True)
