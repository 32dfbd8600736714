"""Drafts of clips: motions at the pace of the physics, made of recordings, which connect."""

import math
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bounds, weight
from arc_suite.animation.clips.catalog import (
    REST,
    SPEED_RATIOS,
    WALK,
    Difference,
    Showcase,
    WalkLoop,
    clip_of,
    recordings_for_clips,
)
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.foot_contacts import (
    TOUCH_DOWN,
    count_odd_feet,
    sole_heights,
)
from arc_suite.animation.clips.from_rest import make_clips_from_rest
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
from arc_suite.animation.clips.recorder import GaitRecording, Recorder, TransitionRecording
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.animation.clips.swaying import USUAL, Character
from arc_suite.robots.spec import Body

_MAX_CYCLES_IN_STEP = 4  # gait cycles of loops that stay in step
_MAX_CYCLES_ALONE = 12  # gait cycles of a loop with a gait of its own
_MIN_SPEED_SHARE = 0.25  # of its command's velocity, that a loop has at least


def make_drafts(
    recorder: Recorder,
    names: Sequence[str],
    progress: Callable[[Iterable], Iterable],
    left_out: MutableMapping[str, str],
    straight: bool = False,
    plant: bool = False,
    character: Character = USUAL,
) -> dict[str, Draft]:
    """Record what clips need, and return their drafts by name, with those of the clips that they connect to.

    Args:
        recorder: recorder of the body.
        names: see `catalog.clip_of`, without modules.
        progress: wraps the recordings.
        left_out: takes the reasons why clips cannot be made, by name.
        straight: whether loops that do not turn, starts and stops go exactly where their commands say.
        plant: whether feet in stance do not slide.
        character: how the body carries its weight.
    """
    body = recorder.body
    gaits, transition = _make_recordings(recorder, names, progress, left_out)
    drafts = _cut_loops(body, gaits, left_out)
    for name, draft in list(drafts.items()):
        reason = _refusal_reason(name, draft, recorder.velocity_units, drafts.get("walk"))
        if reason:
            left_out[name] = reason
    drafts = {name: draft for name, draft in drafts.items() if name not in left_out}
    if straight:
        drafts = {name: draft._replace(motion=_straighten(name, draft.motion)) for name, draft in drafts.items()}

    unplanted_drafts = drafts
    if plant:
        drafts = {name: draft.plant_feet(body) for name, draft in drafts.items()}
    drafts = _keep_within_bounds(body, drafts, left_out)
    walk = unplanted_drafts["walk"] if "walk" in drafts else None
    planted_walk = drafts.get("walk") if plant else None
    if transition is not None:
        drafts |= make_clips_from_rest(recorder, transition, names, walk, planted_walk, left_out, straight)
        drafts = _keep_within_bounds(body, drafts, left_out)
    drafts = weight.add_weight(body, drafts, character)
    for name in names:
        clip = clip_of(name)
        if not isinstance(clip, Difference) or name in left_out:
            continue
        if {clip.loop, clip.base, "idle"} <= drafts.keys():
            drafts[name] = _make_difference(drafts[clip.loop], drafts[clip.base], drafts["idle"].start)
        else:
            left_out[name] = left_out.get(clip.loop, f"there is no {clip.base} that it differs from")
    return drafts


def _keep_within_bounds(body: Body, drafts: Mapping[str, Draft], left_out) -> dict[str, Draft]:
    """Return the drafts that keep to the bounds of their clips; the reasons of others go to `left_out`."""
    kept_drafts = {}
    for name, draft in drafts.items():
        excess = bounds.find_excess(body, clip_of(name), draft.motion)
        if excess:
            left_out[name] = excess
        else:
            kept_drafts[name] = draft
    return kept_drafts


# Recordings.


def _make_recordings(
    recorder: Recorder, names, progress, left_out
) -> tuple[dict[str, GaitRecording], TransitionRecording | None]:
    """Return recordings of gaits by name, and of the stop and the start.

    Reasons of failures go to `left_out`, for all clips that need the recording.
    """
    gaits = {}
    transition = None
    for source, dependent_clips in progress(list(recordings_for_clips(names).items())):
        try:
            if source == REST:
                transition = recorder.record_transition(WALK.command)
            else:
                gaits[source] = _record_gait(recorder, source)
        except ValueError as error:
            left_out |= dict.fromkeys(dependent_clips, str(error))
    return gaits, transition


def _record_gait(recorder: Recorder, name: str) -> GaitRecording:
    clip = clip_of(name)
    if isinstance(clip, Showcase):
        return recorder.record_showcase(clip.preset)
    if not isinstance(clip, WalkLoop):
        raise ValueError(f"{name} is no loop that is recorded")  # of a difference of another package
    if name == "walk" and not recorder.has_command:
        return recorder.record_free_walk()
    return recorder.record_walk(clip.command, clip.failing, clip.crouch, clip.pace)


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
    heights = sole_heights(body, recording.poses)
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
    turns = rotations.product(motion.quaternions, rotations.inverse(base_motion.quaternions))
    difference = motion._replace(
        time_step=base_motion.time_step,
        root=np.zeros_like(base_motion.root),
        positions=pose.position + motion.positions - base_motion.positions,
        quaternions=rotations.product(turns, np.broadcast_to(pose.quaternion, turns.shape)),
        joints=pose.joints + motion.joints - base_motion.joints,
        twist=np.zeros(3),
    )
    return draft._replace(motion=difference, cycle=base.cycle, stands=True)
