"""Weight: the torso of walks, starts and stops moves as on a damped spring, and feet stay where they were.

The torso sways in a gait and in turns, see `swaying`, and pitches into the acceleration of starts and stops. It moves
back before a start, a jump and a strike, and swings on after a stop, a landing and a strike; see `transients`. Legs
follow by inverse kinematics about the feet of each sample. What they do not allow is made smaller.

Loops close and clips connect as without weight: the sway depends on the phase of the gait alone, and all other offsets
are 0 at both ends of a clip.

Lengths are in standing heights h, times in sqrt(h / g).
"""

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bounds, planting, transients
from arc_suite.animation.clips.catalog import Acted, Kind, Passage, Turn, WalkLoop, clip_of
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.root_motion import ClipMotion, away_from_ends, fade_out, share_of_largest
from arc_suite.animation.clips.standing_legs import (
    TRIED_SHARES,
    has_free_feet,
    lower_poses,
    move_legs_in_stages,
    move_torso,
)
from arc_suite.animation.clips.swaying import MAX_TILT, Character, Sway, find_sway, loop_phases, sink_in_turn
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.gaits import PACES
from arc_suite.robots.spec import Body

_PITCH = posture.POSE_NAMES.index("pitch")

# The largest share of the sway that legs can follow is taken, with a torso that sinks least: stretched legs cannot
# follow a tilt.
_SINKS = (0.0, 0.05, 0.1)  # h
_PITCH_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
_DIPS = (0.0, 0.06)  # h, further, while a body pitches in a start or a stop
_SINKS_OF_RUN = (*_SINKS, -0.05, -0.1)  # h: a body with knees that are folded as far as they go rises
_LEAN_SINKS = (0.0, 0.05, 0.1, 0.15, -0.025, -0.05, -0.1)  # h, further, of a body that leans

_GROWTH_CYCLES = 1.5  # in which the sway grows in a start, and fades in a stop
_FADE_CYCLES = 0.5  # at either end, in which the pitch of a start or a stop fades

# Inverse kinematics.
_SEARCH_STRIDE = 8  # samples, of which one is solved while shares are tried
_STAGES = 3
_ITERATIONS_PER_STAGE = 4
_SWING_HEIGHT = 0.02  # h: a higher sole is in swing
_MAX_MISS = 0.01  # h, by which a foot in stance may miss its place
_MAX_MISS_OF_FEW_JOINTS = 0.03  # h
_MAX_SWING_MISS = 0.08  # h
_MAX_MORE_SLIP = 0.02  # m a meter, that a loop has more than without weight
_MAX_SPEED_RATIO = 1.5  # of the fastest joint, with and without weight
_MAX_SPEED_RATIO_OF_RUN = 2.0


def add_weight(body: Body, drafts: Mapping[str, Draft], character: Character) -> dict[str, Draft]:
    """Return drafts by name, in which walks, starts and stops have weight as far as legs and bounds allow.

    Args:
        body: the spec.
        drafts: drafts that keep to their bounds.
        character: how the body carries its weight.
    """
    weighted_drafts = dict(drafts)
    if not character.amplitude:
        return weighted_drafts
    for name, draft in drafts.items():
        clip = clip_of(name)
        if isinstance(clip, Acted | Turn):
            weighted_drafts[name] = _weigh_action(body, name, draft, character)
        if isinstance(clip, WalkLoop):
            passages = _plan_passages(body, drafts, character) if name == "walk" else {}
            weighted_drafts |= _weigh_gait(body, _ConnectedGait(name, clip, draft, passages), character)
    return weighted_drafts


def _weigh_action(body: Body, name: str, draft: Draft, character: Character) -> Draft:
    """Return a jump, a strike or a turn on the spot, with the largest of its offsets that legs can follow."""
    clip = clip_of(name)
    offsets = _plan_action(body, name, clip, draft, character)
    if offsets is None:
        return draft
    for share in TRIED_SHARES:
        poses = share * offsets
        if not _can_follow(body, clip, draft, poses):
            continue
        weighted_draft = _move_torso(body, clip, draft, poses)
        if weighted_draft is not None:
            return weighted_draft._replace(weight=share)
    return draft._replace(weight=0.0)


def _plan_action(body: Body, name: str, clip: Kind, draft: Draft, character: Character) -> np.ndarray | None:
    """Return offsets (samples, 6) of the torso in an action, at full size; None for one without weight."""
    if isinstance(clip, Turn):
        return sink_in_turn(body, draft, character)
    offsets = transients.make_action_offsets(body, name, draft, character.frequency, character.damping)
    return None if offsets is None else character.amplitude * offsets


# Gaits.


class _ConnectedPassage(NamedTuple):
    """A start or a stop of the walk.

    Attributes:
        clip: the clip.
        draft: its draft, without weight.
        transient: (samples, 6) offsets of the torso at full size, without those of the gait; 0 at both ends.
    """

    clip: Passage
    draft: Draft
    transient: np.ndarray


class _ConnectedGait(NamedTuple):
    """A loop of a gait, with the starts and stops that connect to it.

    Attributes:
        name: name of the loop.
        clip: clip of the loop.
        loop: its draft, without weight.
        passages: starts and stops by name; only the walk has some.
    """

    name: str
    clip: WalkLoop
    loop: Draft
    passages: Mapping[str, _ConnectedPassage]

    @property
    def drafts(self) -> dict[str, Draft]:
        """Drafts of all its clips, by name, without weight."""
        return {self.name: self.loop} | {name: passage.draft for name, passage in self.passages.items()}


class _Movement(NamedTuple):
    """Offsets (samples, 6) of the torso in a clip, and the share of the weight that they are."""

    poses: np.ndarray
    share: float


def _plan_passages(body: Body, drafts: Mapping[str, Draft], character: Character) -> dict[str, _ConnectedPassage]:
    """Return the starts and stops among drafts, by name."""
    passages = {}
    for name, draft in drafts.items():
        clip = clip_of(name)
        if isinstance(clip, Passage):
            passages[name] = _ConnectedPassage(clip, draft, _plan_transient(body, clip, draft, character))
    return passages


def _plan_transient(body: Body, clip: Passage, draft: Draft, character: Character) -> np.ndarray:
    """Return offsets (samples, 6) of the torso in a start or a stop, without those of the gait; 0 at both ends."""
    offsets = transients.make_passage_offsets(body, clip, draft, character.frequency, character.damping)
    poses = character.amplitude * offsets
    poses[:, _PITCH] += _follow_acceleration(body, clip, draft, character)
    return poses


def _follow_acceleration(body: Body, clip: Passage, draft: Draft, character: Character) -> np.ndarray:
    """Return the pitch (samples,), rad, of a torso that leans into the acceleration of its root; 0 at both ends."""
    motion = draft.motion
    velocities = np.gradient(motion.root[:, :2], motion.time_step, axis=0)
    speed = rotations.to_heading_frame(velocities, motion.root[:, 2])[:, 0]
    pitch = character.pitch / GRAVITY * np.gradient(speed, motion.time_step)
    lowest, highest = (0.0, MAX_TILT) if clip.starts else (-MAX_TILT, 0.0)
    cycles = _cycles(draft)
    weights = away_from_ends(cycles / _FADE_CYCLES, cycles[::-1] / _FADE_CYCLES)
    return character.amplitude * weights * character.follow(body, pitch.clip(lowest, highest), motion.time_step)


def _weigh_gait(body: Body, gait: _ConnectedGait, character: Character) -> dict[str, Draft]:
    """Return the drafts of a gait, by name, with the largest sway that all of them can follow."""
    full_sway = find_sway(body, gait.loop, character, _measure_haste(gait.clip))
    can_sway = bool(_plan_gait(body, gait, full_sway, TRIED_SHARES[-1]))  # else larger shares are not tried
    for share in TRIED_SHARES if can_sway else ():
        plan = _plan_gait(body, gait, full_sway, share)
        weighted_drafts = _follow_plan(body, gait.drafts, plan)
        if not weighted_drafts:
            continue
        if full_sway.lean:
            leaning_loop = _lean_ahead(body, gait.clip, gait.loop, plan[gait.name].poses, full_sway.lean)
            if leaning_loop is not None:
                weighted_drafts[gait.name] = leaning_loop._replace(weight=share)
        return weighted_drafts
    return {name: draft._replace(weight=0.0) for name, draft in gait.drafts.items()}


def _plan_gait(body: Body, gait: _ConnectedGait, full_sway: Sway, share: float) -> dict[str, _Movement]:
    """Return movements of a gait's clips with a share of the sway, by name; none if legs cannot follow."""
    sinks = _SINKS_OF_RUN if full_sway.lean else _SINKS
    for sink in sinks:
        sway = full_sway.scale(share, sink)
        loop_poses = sway.poses(loop_phases(gait.loop))
        if not _can_follow(body, gait.clip, gait.loop, loop_poses):
            continue
        plan = {gait.name: _Movement(loop_poses, share)}
        for name, passage in gait.passages.items():
            movement = _plan_passage(body, passage, sway)
            if movement is None:
                break
            plan[name] = movement
        else:
            return plan
    return {}


def _plan_passage(body: Body, passage: _ConnectedPassage, sway: Sway) -> _Movement | None:
    """Return the movement of a start or a stop with the walk's sway and the largest transient that legs can follow.

    Returns:
        The movement; None if legs cannot follow the sway.
    """
    clip, draft, transient = passage
    cycles = _cycles(draft)
    if clip.starts:
        cycles_from_rest = cycles
        phases = cycles - cycles[-1]  # 0 where it meets the walk
    else:
        cycles_from_rest = cycles[::-1]
        phases = cycles
    growth = 1.0 - fade_out(cycles_from_rest / _GROWTH_CYCLES)
    poses = growth[:, None] * sway.poses(phases)
    if not _can_follow(body, clip, draft, poses):
        return None
    dip = share_of_largest(abs(transient[:, _PITCH]))
    for share, depth in itertools.product(_PITCH_SHARES, _DIPS):
        pitched_poses = lower_poses(poses + share * transient, depth * dip)
        if not _can_follow(body, clip, draft, pitched_poses):
            continue
        if _move_torso(body, clip, draft, pitched_poses) is not None:  # by all samples
            return _Movement(pitched_poses, share)
    return _Movement(poses, 0.0)


def _follow_plan(body: Body, drafts: Mapping[str, Draft], plan: Mapping[str, _Movement]) -> dict[str, Draft]:
    """Return drafts that move as in a plan, by name; none if one of them cannot."""
    weighted_drafts = {}
    for name, movement in plan.items():
        weighted_draft = _move_torso(body, clip_of(name), drafts[name], movement.poses)
        if weighted_draft is None:
            return {}
        weighted_drafts[name] = weighted_draft._replace(weight=movement.share)
    return weighted_drafts


def _lean_ahead(body: Body, clip: WalkLoop, loop: Draft, poses: np.ndarray, lean: float) -> Draft | None:
    """Return a loop with offsets (samples, 6) of the torso and the largest lean, rad, that legs can follow."""
    for share, depth in itertools.product(_PITCH_SHARES, _LEAN_SINKS):
        leaning_poses = lower_poses(poses, depth)
        leaning_poses[:, _PITCH] += share * lean
        if _can_follow(body, clip, loop, leaning_poses):
            leaning_loop = _move_torso(body, clip, loop, leaning_poses)
            if leaning_loop is not None:
                return leaning_loop
    return None


def _cycles(draft: Draft) -> np.ndarray:
    """Return the times (samples,) of a draft, gait cycles."""
    return np.arange(len(draft.motion.joints)) * draft.motion.time_step / draft.cycle


# Legs.


def _measure_haste(clip: Kind) -> float:
    """Return how far a clip is from a walk, 0, to a run, 1, by its speed."""
    if not isinstance(clip, WalkLoop) or clip.pace is None:
        return 0.0
    return float(np.clip((clip.pace.speed - 1.0) / (PACES["run"].speed - 1.0), 0.0, 1.0))


def _can_follow(body: Body, clip: Kind, draft: Draft, poses: np.ndarray) -> bool:
    """Return whether legs follow offsets (samples, 6) of the torso within their bounds, by few of the samples."""
    intervals = len(poses) - 1
    samples = np.linspace(0, intervals, intervals // _SEARCH_STRIDE + 1).round().astype(int)
    motion = draft.motion.map_arrays(lambda values: values[samples])
    motion = motion._replace(root=motion.root[samples], time_step=draft.motion.seconds / (len(samples) - 1))
    thin_draft = draft._replace(motion=motion)
    weighted_draft = _move_torso(body, clip, thin_draft, poses[samples])
    if weighted_draft is None:
        return False
    slip = planting.slip(body, motion) if draft.loops else None
    return slip is None or planting.slip(body, weighted_draft.motion) <= slip + _MAX_MORE_SLIP


def _move_torso(body: Body, clip: Kind, draft: Draft, poses: np.ndarray) -> Draft | None:
    """Return a clip whose torso is moved by offsets (samples, 6) over its feet; None if legs or bounds forbid it."""
    motion = draft.motion
    attitudes = rotations.matrix(motion.quaternions)
    joints, misses = move_legs_in_stages(
        body, motion.joints, attitudes, poses, lifts=0.0, stages=_STAGES, iterations=_ITERATIONS_PER_STAGE
    )
    distances = np.linalg.norm(misses, axis=-1) / body.torso.standing_height
    if (distances > _find_max_misses(body, motion)).any():
        return None
    max_speed_ratio = _MAX_SPEED_RATIO_OF_RUN if _measure_haste(clip) else _MAX_SPEED_RATIO
    if _largest_joint_step(joints) > max_speed_ratio * _largest_joint_step(motion.joints):
        return None
    moved_motion = move_torso(body, motion, poses)._replace(joints=joints)
    if bounds.find_excess(body, clip, moved_motion):
        return None
    return draft._replace(motion=moved_motion)


def _find_max_misses(body: Body, motion: ClipMotion) -> np.ndarray:
    """Return by how much feet may miss their places (samples, legs), h: in swing more than in stance."""
    legs = Legs.of(body, used=1.0)
    feet = legs.foot_centers(legs.by_leg(motion.joints))  # in the torso's frame
    feet_from_torso = feet @ rotations.matrix(motion.quaternions).swapaxes(-1, -2)
    soles = motion.positions[:, None, 2] + feet_from_torso[..., 2] - legs.radii
    max_stance_miss = _MAX_MISS if has_free_feet(body) else _MAX_MISS_OF_FEW_JOINTS
    return np.where(soles > _SWING_HEIGHT * body.torso.standing_height, _MAX_SWING_MISS, max_stance_miss)


def _largest_joint_step(joints: np.ndarray) -> float:
    """Return the largest turn of a joint between two of the samples (samples, joints), rad."""
    return abs(np.diff(joints, axis=0)).max()
