"""Drafts of clips: motions at the pace of the physics, made of recordings, which connect."""

import math
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import planting, root_motion
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
    recordings_for_clips,
)
from arc_suite.animation.clips.foot_contacts import (
    MIN_RISE,
    MIN_RISE_IN_GESTURE,
    TOUCH_DOWN,
    FootContact,
    count_odd_feet,
    find_foot_contacts,
    sole_heights,
)
from arc_suite.animation.clips.loops import (
    GOOD_SEAM,
    MAX_SEAM,
    choose_cycles,
    choose_start,
    cut_loop,
    find_closings,
    find_starts,
    straighten_loop,
)
from arc_suite.animation.clips.recorder import GaitRecording, Recorder, TransitionRecording, TurnRecording
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.motions.ground_poses import twist_to
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model

_MAX_CYCLES_IN_STEP = 4  # gait cycles of loops that stay in step
_MAX_CYCLES_ALONE = 12  # gait cycles of a loop with a gait of its own
_MIN_SPEED_SHARE = 0.25  # of its command's velocity, that a loop has at least
_MAX_SOLE_DEPTH = 0.025  # standing heights, that a sole is below the ground where others are on it
_MAX_MEETING_SEAM = np.radians(20.0)  # rad: a stop or a start that is farther from walk or idle is left out
_CONJUGATE = (1.0, -1.0, -1.0, -1.0)  # times a quaternion: the inverse rotation


class Draft(NamedTuple):
    """A motion with a sample for every substep.

    Attributes:
        motion: motion of the body.
        cycles: gait cycles that it holds; 0 without a gait.
        cycle: duration of a gait cycle, s; NaN without a gait.
        loops: whether its last pose is its first one.
        stands: whether all feet stay on the ground, so that there are no foot contact events.
    """

    motion: ClipMotion
    cycles: int = 0
    cycle: float = math.nan
    loops: bool = True
    stands: bool = False

    @property
    def start(self) -> Pose:
        """First pose."""
        return self.motion.pose(0)

    @property
    def cycle_samples(self) -> int:
        """Samples in a gait cycle."""
        return round(self.cycle / self.motion.time_step)

    def stance_height_and_contacts(self, body: Body) -> tuple[float, list[FootContact]]:
        """Return the median height of soles in stance, m, and the foot contact events; none without a gait."""
        heights = sole_heights(compile_model(body), body, self.motion.poses())
        if self.stands:
            return float(np.median(heights)), []
        min_rise = MIN_RISE if self.cycles else MIN_RISE_IN_GESTURE
        contacts, stance = find_foot_contacts(self.motion, body, heights, self.cycle, self.loops, min_rise)
        if not stance.any():
            return 0.0, contacts
        return float(np.median(heights[stance])), contacts

    def plant_feet(self, body: Body) -> "Draft":
        """Return the draft with feet in stance that do not slide; see `planting.plant_feet`."""
        return self._replace(motion=planting.plant_feet(body, self.motion, self.cycle, self.loops))

    def put_on_ground(self, body: Body) -> "Draft":
        """Return the draft with soles in stance on the ground, and none deep in it."""
        lowest = float(sole_heights(compile_model(body), body, self.motion.poses()).min())
        stance_height, _ = self.stance_height_and_contacts(body)
        height = min(stance_height, lowest + _MAX_SOLE_DEPTH * body.torso.standing_height)
        return self._replace(motion=self.motion.lower(height))


def make_drafts(
    recorder: Recorder,
    names: Sequence[str],
    progress: Callable[[Iterable], Iterable],
    left_out: MutableMapping[str, str],
    straight: bool = False,
    plant: bool = False,
) -> dict[str, Draft]:
    """Record what clips need, and return their drafts by name, with those of the clips that they connect to.

    Args:
        recorder: recorder of the body.
        names: see `catalog.clip_of`, without modules.
        progress: wraps the recordings.
        left_out: takes the reasons why clips cannot be made, by name.
        straight: whether loops that do not turn go exactly where their commands say.
        plant: whether feet in stance do not slide.
    """
    body = recorder.body
    gaits, transition, turns = _make_recordings(recorder, names, progress, left_out)
    drafts = _cut_loops(body, gaits, left_out)
    for name, draft in list(drafts.items()):
        reason = _refusal_reason(name, draft, recorder.velocity_units, drafts.get("walk"))
        if reason:
            left_out[name] = reason
    drafts = {name: draft for name, draft in drafts.items() if name not in left_out}
    if straight:
        drafts = {name: draft._replace(motion=_straighten(name, draft.motion)) for name, draft in drafts.items()}

    walk = drafts.get("walk")
    planted_walk = None
    if plant:
        drafts = {name: draft.plant_feet(body) for name, draft in drafts.items()}
        planted_walk = drafts.get("walk")
    if transition is not None:
        drafts |= _make_clips_from_rest(body, transition, turns, names, walk, planted_walk, left_out)
    for name in names:
        clip = clip_of(name)
        if not isinstance(clip, Difference) or name in left_out:
            continue
        if {clip.loop, clip.base, "idle"} <= drafts.keys():
            drafts[name] = _make_difference(drafts[clip.loop], drafts[clip.base], drafts["idle"].start)
        else:
            left_out[name] = left_out.get(clip.loop, f"there is no {clip.base} that it differs from")
    return drafts


# Recordings.


def _make_recordings(
    recorder: Recorder, names, progress, left_out
) -> tuple[dict[str, GaitRecording], TransitionRecording | None, dict[str, TurnRecording]]:
    """Return recordings of gaits by name, of the stop and the start, and of turns by name.

    Reasons of failures go to `left_out`, for all clips that need the recording.
    """
    gaits = {}
    transition = None
    turns = {}
    for source, dependent_clips in progress(list(recordings_for_clips(names).items())):
        try:
            if source == REST:
                transition = recorder.record_transition(WALK.command)
                continue
            clip = clip_of(source)
            if isinstance(clip, Turn):
                turns[source] = recorder.record_turn(math.radians(clip.angle))
            else:
                gaits[source] = _record_gait(recorder, source)
        except ValueError as error:
            left_out |= dict.fromkeys(dependent_clips, str(error))
    return gaits, transition, turns


def _record_gait(recorder: Recorder, name: str) -> GaitRecording:
    clip = clip_of(name)
    if isinstance(clip, Showcase):
        return recorder.record_showcase(clip.preset)
    if not isinstance(clip, WalkLoop):
        raise ValueError(f"{name} is no loop that is recorded")  # of a difference of another package
    if name == "walk" and not recorder.has_command:
        return recorder.record_free_walk()
    return recorder.record_walk(clip.command, clip.failing, clip.crouch)


# Loops.


def _cut_loops(body: Body, gaits: Mapping[str, GaitRecording], left_out) -> dict[str, Draft]:
    """Return loops of recordings on the ground; those with a gait clock stay in step."""
    with_clock = {name: gait for name, gait in gaits.items() if gait.phase is not None}
    drafts = {}
    if with_clock:
        drafts = _cut_loops_in_step(body, with_clock, _MAX_CYCLES_IN_STEP, MAX_SEAM, left_out)
    for name in gaits.keys() - with_clock.keys():
        drafts |= _cut_loops_in_step(body, {name: gaits[name]}, _MAX_CYCLES_ALONE, GOOD_SEAM, left_out)
    return drafts


def _cut_loops_in_step(
    body: Body, gaits: Mapping[str, GaitRecording], most_cycles: int, good_seam: float, left_out
) -> dict[str, Draft]:
    """Return loops of recordings that hold the same number of cycles and begin at the same phase, on the ground.

    Args:
        body: the spec.
        gaits: recordings by name.
        most_cycles: in a loop.
        good_seam: rad; see `choose_cycles`.
        left_out: takes the reasons why loops do not close.
    """
    closings = {name: find_closings(gait.recording, gait.cycle, most_cycles) for name, gait in gaits.items()}
    cycles = choose_cycles(closings, good_seam)
    drafts = {}
    for name, gait in gaits.items():
        closing = closings[name][cycles]
        if closing.seam > MAX_SEAM:
            max_degrees = np.degrees(MAX_SEAM)
            degrees = np.degrees(closing.seam)
            left_out[name] = (
                f"the pose does not return within {max_degrees:.0f} degrees: {degrees:.1f} after {cycles} cycles"
            )
            continue
        starts = _keep_regular_starts(body, gait.recording, closing.samples, cycles)
        first = choose_start(gait.recording, closing.samples, starts)
        motion = cut_loop(gait.recording, first, closing.samples)
        draft = Draft(motion, cycles, gait.cycle).put_on_ground(body)
        has_clock = gait.phase is not None
        begin = gait.samples_to_touchdown(first) if has_clock else _find_first_touchdown(body, draft)
        drafts[name] = draft._replace(motion=draft.motion.start_at(begin))
    return drafts


def _keep_regular_starts(body: Body, recording: Recording, samples: int, cycles: int) -> np.ndarray:
    """Return starts (n,) of loops that close, those in which the fewest feet step other than once a gait cycle."""
    starts = find_starts(recording, samples)
    heights = sole_heights(compile_model(body), body, recording.poses)
    odd_feet = [
        count_odd_feet(heights[start : start + samples], cycles, body.torso.standing_height) for start in starts
    ]
    return starts[odd_feet == np.min(odd_feet)]


def _find_first_touchdown(body: Body, draft: Draft) -> int:
    """Return the sample in which the first foot that steps touches down first; 0 if no foot does."""
    _, contacts = draft.stance_height_and_contacts(body)
    for foot in body.foot_names:
        samples = [contact.sample for contact in contacts if contact.event == TOUCH_DOWN and contact.foot == foot]
        if samples:
            return min(samples)
    return 0


def _straighten(name: str, motion: ClipMotion) -> ClipMotion:
    """Return a loop that goes where its command says, unless that is a turn."""
    clip = clip_of(name)
    command = clip.command if isinstance(clip, WalkLoop) else WALK.command
    forward, left, turning = command
    if turning:
        return motion
    return straighten_loop(motion, course=math.atan2(left, forward))


def _refusal_reason(name: str, draft: Draft, velocity_units: np.ndarray | None, walk: Draft | None) -> str:
    """Return why a loop is not what its name says: it does not follow its command, or is as fast as the walk; or ""."""
    clip = clip_of(name)
    if velocity_units is not None and isinstance(clip, WalkLoop):
        command = np.array(clip.command)
        # The velocity in the direction of the command, as a share of the command.
        share = command @ (draft.motion.twist / velocity_units) / (command @ command)
        if share < _MIN_SPEED_SHARE:
            percent = round(100.0 * share)
            return f"the policy moves at {percent} % of its command, less than {100.0 * _MIN_SPEED_SHARE:.0f} %"
    if name in SPEED_RATIOS and walk is not None:
        min_ratio, max_ratio = SPEED_RATIOS[name]
        speed = np.hypot(*draft.motion.twist[:2])
        walk_speed = np.hypot(*walk.motion.twist[:2])
        if not min_ratio <= speed / walk_speed <= max_ratio:
            rule = f"{min_ratio:g} times that or more" if min_ratio else f"{max_ratio:.2g} times that or less"
            return f"its speed is {speed:.3f} m/s, and that of the walk {walk_speed:.3f}: {name} has {rule}"
    return ""


def _make_difference(draft: Draft, base: Draft, pose: Pose) -> Draft:
    """Return how a loop differs from another in step with it, added to a pose; its root stays."""
    base_motion = base.motion
    times = np.linspace(0.0, base_motion.seconds, len(base_motion.joints))
    motion = draft.motion.sample_at(times * draft.motion.seconds / base_motion.seconds)
    turns = rotations.product(motion.quaternions, base_motion.quaternions * _CONJUGATE)
    difference = motion._replace(
        time_step=base_motion.time_step,
        root=np.zeros_like(base_motion.root),
        positions=pose.position + motion.positions - base_motion.positions,
        quaternions=rotations.product(turns, np.broadcast_to(pose.quaternion, turns.shape)),
        joints=pose.joints + motion.joints - base_motion.joints,
        twist=np.zeros(3),
    )
    return draft._replace(motion=difference, cycle=base.cycle, stands=True)


# Clips that connect to idle, and some to the walk.


def _make_clips_from_rest(
    body: Body,
    transition: TransitionRecording,
    turns: Mapping[str, TurnRecording],
    names: Sequence[str],
    walk: Draft | None,
    planted_walk: Draft | None,
    left_out,
) -> dict[str, Draft]:
    """Return the draft of idle, and those of the named clips that connect to it.

    Args:
        body: the spec.
        transition: transition from which rest, stops and starts are taken.
        turns: recordings by name.
        names: names of the clips.
        walk: clip that stops and starts connect to, with feet as in the physics.
        planted_walk: the same with planted feet; None if feet are not to be planted.
        left_out: takes the reasons why clips cannot be made.
    """
    rest_pose = root_motion.stay_at_start(transition.gait.recording, transition.start, samples=1).pose(0)
    idle_clip = cast(Acted, clip_of("idle"))
    idle = _play(body, idle_clip, rest_pose).put_on_ground(body)
    drafts = {"idle": idle}
    for name in names:
        try:
            match clip_of(name):
                case Acted() as clip if name != "idle":
                    drafts[name] = _act(body, clip, rest_pose, idle.start)
                case Turn() as clip if name in turns:
                    draft = _make_turn(body, math.radians(clip.angle), turns[name], idle.start)
                    if planted_walk is not None:
                        draft = _plant_turn(body, draft, idle.start)
                    drafts[name] = draft
                case Passage() as clip:
                    draft = _make_passage(body, clip, transition, idle.start, walk)
                    if planted_walk is not None:
                        draft = _plant_passage(body, clip, draft, idle.start, walk, planted_walk)
                    drafts[name] = draft
        except ValueError as error:
            left_out[name] = str(error)
    return drafts


def _play(body: Body, clip: Acted, rest: Pose) -> Draft:
    """Return a motion from the pose at rest.

    Raises:
        ValueError: the clip plays no motion, as one of another package may.
    """
    motion = clip.play(body, rest)
    if not isinstance(motion, ClipMotion):
        raise ValueError(f"expected a ClipMotion of its play, got {type(motion).__name__}")
    return Draft(motion, loops=clip.loops, stands=not clip.steps)


def _act(body: Body, clip: Acted, rest: Pose, idle: Pose) -> Draft:
    """Return a motion from the pose at rest, which meets idle; see `Acted`."""
    draft = _play(body, clip, rest)
    motion = draft.motion.lower(rest.position[2] - idle.position[2])  # as idle was, for its soles to be on the ground
    for end in clip.ends:
        motion = motion.end_with(idle, end, samples=len(motion.joints) // 3)
    return draft._replace(motion=motion)


def _make_turn(body: Body, angle: float, turn: TurnRecording, idle: Pose) -> Draft:
    """Return a turn from idle to idle by exactly an angle, rad; the root takes up what the recording lacks."""
    recording = turn.gait.recording
    cycle_samples = round(turn.gait.cycle / recording.time_step)
    motion = root_motion.follow_mean_path(recording, turn.first, turn.samples, window=cycle_samples)
    cycles = round(turn.samples / cycle_samples)
    draft = Draft(motion, cycles, turn.gait.cycle, loops=False).put_on_ground(body)
    motion = draft.motion.meet(idle, 0, cycle_samples).meet(idle, -1, cycle_samples)
    missing_angles = (angle - motion.root[-1, 2]) * np.linspace(0.0, 1.0, len(motion.root))
    root = motion.root + missing_angles[:, None] * (0.0, 0.0, 1.0)
    twist = twist_to(root[-1]) / motion.seconds
    return draft._replace(motion=motion._replace(root=root, twist=twist))


def _plant_turn(body: Body, draft: Draft, idle: Pose) -> Draft:
    """Return a turn with planted feet, which meets idle."""
    motion = draft.plant_feet(body).motion
    motion = motion.end_with(idle, 0, draft.cycle_samples)
    motion = motion.end_with(idle, -1, draft.cycle_samples)
    return draft._replace(motion=motion)


def cut_passage(body: Body, clip: Passage, transition: TransitionRecording) -> Draft:
    """Return a stop or a start as it was recorded, with soles in stance on the ground."""
    gait = transition.gait
    cycle_samples = round(gait.cycle / gait.recording.time_step)
    samples = clip.cycles * cycle_samples
    if clip.starts:
        first = transition.start
        samples -= transition.delay  # so that it ends at a scheduled touchdown
    else:
        first = transition.stop
    motion = root_motion.follow_mean_path(gait.recording, first, samples, window=cycle_samples)
    return Draft(motion, clip.cycles, gait.cycle, loops=False).put_on_ground(body)


def _make_passage(body: Body, clip: Passage, transition: TransitionRecording, idle: Pose, walk: Draft | None) -> Draft:
    """Return a stop or a start, which meets idle and the walk.

    Raises:
        ValueError: there is no walk, or its pose is far from that of the passage.
    """
    if walk is None:
        raise ValueError("there is no walk that it connects to")
    draft = cut_passage(body, clip, transition)
    idle_end, walk_end = _ends_of_passage(clip)
    motion = draft.motion.meet(idle, idle_end, draft.cycle_samples)
    motion = motion.meet(walk.start, walk_end, draft.cycle_samples)
    if motion.seam > _MAX_MEETING_SEAM:
        seam = np.degrees(motion.seam)
        max_seam = np.degrees(_MAX_MEETING_SEAM)
        raise ValueError(f"its pose is {seam:.0f} degrees from that of the walk or of idle, more than {max_seam:.0f}")
    return draft._replace(motion=motion)


def _plant_passage(body: Body, clip: Passage, draft: Draft, idle: Pose, walk: Draft, planted_walk: Draft) -> Draft:
    """Return a stop or a start with planted feet, which meets idle, and the planted walk in pose and velocity.

    The passage is planted together with the walk, so that a foot whose stance goes on in the walk stays in one place.

    Args:
        body: the spec.
        clip: the stop or the start.
        draft: its draft with feet as in the physics, which meets idle and the walk.
        idle: first pose of idle.
        walk: with feet as in the physics.
        planted_walk: the same with planted feet.
    """
    samples = len(draft.motion.joints)
    if clip.starts:
        motion_with_walk = draft.motion.append(walk.motion)
        passage_samples = slice(None, samples)
    else:
        motion_with_walk = walk.motion.append(draft.motion)
        passage_samples = slice(-samples, None)
    planted_with_walk = draft._replace(motion=motion_with_walk).plant_feet(body).motion
    idle_end, walk_end = _ends_of_passage(clip)
    motion = draft.motion._replace(joints=planted_with_walk.joints[passage_samples])
    motion = motion.end_with(idle, idle_end, draft.cycle_samples)
    motion = motion.end_with(planted_walk.start, walk_end, draft.cycle_samples)
    return draft._replace(motion=motion)


def _ends_of_passage(clip: Passage) -> tuple[int, int]:
    """Return the end, 0 or -1, at which a passage meets idle, and that at which it meets the walk."""
    if clip.starts:
        return 0, -1
    return -1, 0
