"""Weight: the torso of walks, starts and stops moves as on a damped spring, and feet stay where they were.

In a gait the torso sinks after touchdowns, twice a cycle, and rolls towards the feet that stand. The faster it is than
a walk, the more it sinks, and leans ahead. It banks in turns, and pitches into the acceleration of starts and stops. It
moves back before a start, a jump and a strike, and swings on after a stop, a landing and a strike; see `transients`.
Legs follow by inverse kinematics about the feet of each sample. What they do not allow is made smaller. The sway of a
gait is a function of its phase, and all else is 0 at both ends of a clip. So loops close and clips connect as without
weight.

Lengths are in standing heights h, times in sqrt(h / g).
"""

import itertools
import math
from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.animation.clips import bounds, planting, transients
from arc_suite.animation.clips.catalog import Acted, Kind, Passage, WalkLoop, clip_of
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.foot_contacts import TOUCH_DOWN, find_foot_contacts, sole_heights
from arc_suite.animation.clips.root_motion import ClipMotion, fade_out, share_of_largest
from arc_suite.animation.clips.standing_legs import (
    HEIGHT,
    TRIED_SHARES,
    has_free_feet,
    lower_poses,
    move_legs_in_stages,
    move_torso,
)
from arc_suite.models import posture, sizing
from arc_suite.models.kinematics import Legs
from arc_suite.robots.gaits import PACES
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model

MAX_WEIGHT = 2.0

_ROLL = posture.POSE_NAMES.index("roll")
_PITCH = posture.POSE_NAMES.index("pitch")

# The largest share of the sway that legs can follow is taken, with a torso that sinks least: stretched legs cannot
# follow a tilt.
_SINKS = (0.0, 0.05, 0.1)  # h
_PITCH_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2)
_DIPS = (0.0, 0.06)  # h, further, while a body pitches in a start or a stop
_SINKS_OF_RUN = (*_SINKS, -0.05, -0.1)  # h: a body with knees that are folded as far as they go rises
_LEAN_SINKS = (0.0, 0.05, 0.1, 0.15, -0.025, -0.05, -0.1)  # h, further, of a body that leans
_BOB_OF_RUN = 2.3  # times that of a walk
_MAX_TILT = np.radians(8.0)  # rad, of the pitch in starts and stops, and of the bank

# In a trot diagonal feet stand, and as many on the left as on the right. The body rolls to the side of its front feet.
_FRONT_SHARE = 0.3  # by which the foremost feet count more than those in the middle, in the side that stands
_MIN_COHERENCE = 0.2  # of touchdowns in half a cycle: below, that of the first foot, at phase 0, sets the phase
_MIN_SIDE = 0.001  # of the sum of all distances of feet from the middle: below, the first foot sets the side
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


class Character(NamedTuple):
    """How a body carries its weight.

    Attributes:
        bob: range of the torso's height in a gait, h.
        roll: amplitude of its roll in a gait, rad.
        pitch: rad, for an acceleration of g.
        bank: share of the roll at which weight acts along the torso's vertical in a turn.
        lean: pitch ahead in a run, rad.
        frequency: frequency of the spring, rad / sqrt(h / g).
        damping: damping ratio of the spring.
        amplitude: multiple of all offsets of the torso.
    """

    bob: float
    roll: float
    pitch: float
    bank: float
    lean: float
    frequency: float
    damping: float
    amplitude: float = 1.0

    def response(self, body: Body, frequencies):
        """Return what a path is multiplied by, at frequencies in rad/s, where the spring follows it; complex."""
        ratio = frequencies * sizing.time_unit(body) / self.frequency
        return 1.0 / (1.0 - ratio**2 + 2.0j * self.damping * ratio)

    def direction(self, body: Body, frequency: float) -> complex:
        """Return the response at a frequency, rad/s, without its size: a delay."""
        response = self.response(body, frequency)
        return response / abs(response)

    def follow(self, body: Body, path: np.ndarray, time_step: float) -> np.ndarray:
        """Return how the spring follows a path (samples,) from rest."""
        padded = 4 * len(path)  # samples, so that the end does not act on the start
        frequencies = 2.0 * np.pi * np.fft.rfftfreq(padded, time_step)
        spectrum = np.fft.rfft(path, padded) * self.response(body, frequencies)
        return np.fft.irfft(spectrum, padded)[: len(path)]


USUAL = Character(bob=0.035, roll=0.03, pitch=0.9, bank=1.0, lean=0.14, frequency=5.0, damping=0.5)
CHARACTERS = {
    "heavy": Character(bob=0.05, roll=0.045, pitch=1.2, bank=0.7, lean=0.12, frequency=3.5, damping=0.4),
    "nervous": Character(bob=0.025, roll=0.02, pitch=1.1, bank=1.5, lean=0.17, frequency=9.0, damping=0.3),
    "old": Character(bob=0.03, roll=0.06, pitch=0.6, bank=0.3, lean=0.07, frequency=4.0, damping=0.9),
}


class Sway(NamedTuple):
    """Offsets of the torso in a gait. Complex numbers are amplitudes over the phase of the gait.

    Attributes:
        bob: amplitude of the height, twice a cycle, h.
        roll: amplitude of the roll, once a cycle, rad.
        bank: roll that stays, rad.
        lean: pitch that stays, rad; as much of it as legs allow is added to the rest.
        sink: height by which the torso is lower, h.
    """

    bob: complex
    roll: complex
    bank: float
    lean: float = 0.0
    sink: float = 0.0

    def scale(self, factor: float, sink: float = 0.0) -> Self:
        """Return a multiple of the sway, of a torso that sinks."""
        return self._replace(
            bob=factor * self.bob,
            roll=factor * self.roll,
            bank=factor * self.bank,
            lean=factor * self.lean,
            sink=sink,
        )

    def poses(self, phases: np.ndarray) -> np.ndarray:
        """Return offsets (samples, 6) at phases (samples,), in cycles, without the lean; see `posture`.

        The torso is never higher, unless its sink is negative.
        """
        turns = np.exp(2.0j * np.pi * phases)
        poses = np.zeros((len(phases), 6))
        poses[:, HEIGHT] = (self.bob * turns**2).real - abs(self.bob) - self.sink
        poses[:, _ROLL] = (self.roll * turns).real + self.bank
        return poses


def choose_character(weight: float | str) -> Character:
    """Return the character of a name, or a multiple of the usual one.

    Raises:
        ValueError: neither a name nor a number from 0 to `MAX_WEIGHT`.
    """
    if not isinstance(weight, str):
        return USUAL._replace(amplitude=checks.number("weight", weight, 0.0, MAX_WEIGHT))
    name = checks.name(weight, CHARACTERS, "weight", descriptions=(f"a number from 0 to {MAX_WEIGHT:g}",))
    return CHARACTERS[name]


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
        if isinstance(clip, Acted):
            weighted_drafts[name] = _weigh_action(body, name, draft, character)
        if isinstance(clip, WalkLoop):
            passages = _plan_passages(body, drafts, character) if name == "walk" else {}
            weighted_drafts |= _weigh_gait(body, name, clip, draft, passages, character)
    return weighted_drafts


def _weigh_action(body: Body, name: str, draft: Draft, character: Character) -> Draft:
    """Return a jump or a strike, with the largest anticipation and follow-through that legs can follow."""
    transient = transients.make_action_offsets(body, name, draft, character.frequency, character.damping)
    if transient is None:
        return draft
    clip = clip_of(name)
    for share in TRIED_SHARES:
        poses = share * character.amplitude * transient
        weighted_draft = _move_torso(body, clip, draft, poses) if _can_follow(body, clip, draft, poses) else None
        if weighted_draft is not None:
            return weighted_draft._replace(weight=share)
    return draft._replace(weight=0.0)


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
    pitch = character.pitch / sizing.GRAVITY * np.gradient(speed, motion.time_step)
    lowest, highest = (0.0, _MAX_TILT) if clip.starts else (-_MAX_TILT, 0.0)
    cycles = _cycles(draft)
    away_from_ends = (1.0 - fade_out(cycles / _FADE_CYCLES)) * (1.0 - fade_out(cycles[::-1] / _FADE_CYCLES))
    return character.amplitude * away_from_ends * character.follow(body, pitch.clip(lowest, highest), motion.time_step)


def _weigh_gait(
    body: Body,
    name: str,
    clip: WalkLoop,
    loop: Draft,
    passages: Mapping[str, _ConnectedPassage],
    character: Character,
) -> dict[str, Draft]:
    """Return a loop, and the starts and stops that connect to it, with the largest sway that all of them can follow."""
    drafts = {name: loop} | {passage_name: passage.draft for passage_name, passage in passages.items()}
    full_sway = find_sway(body, loop, character, _measure_haste(clip))
    # A body that follows no share at all is known at once by the smallest.
    shares = TRIED_SHARES if _plan_gait(body, name, loop, passages, full_sway, TRIED_SHARES[-1]) else ()
    for share in shares:
        plan = _plan_gait(body, name, loop, passages, full_sway, share)
        weighted_drafts = _follow_plan(body, drafts, plan)
        if not weighted_drafts:
            continue
        if full_sway.lean:
            leaning_loop = _lean_ahead(body, clip, loop, plan[name].poses, full_sway.lean)
            if leaning_loop is not None:
                weighted_drafts[name] = leaning_loop._replace(weight=share)
        return weighted_drafts
    return {clip_name: draft._replace(weight=0.0) for clip_name, draft in drafts.items()}


def _plan_gait(
    body: Body, name: str, loop: Draft, passages: Mapping[str, _ConnectedPassage], full_sway: Sway, share: float
) -> dict[str, _Movement]:
    """Return movements of a loop and its passages with a share of the sway, by name; none if legs cannot follow."""
    sinks = _SINKS_OF_RUN if full_sway.lean else _SINKS
    for sink in sinks:
        plan = _plan_with_sway(body, name, loop, passages, full_sway.scale(share, sink), share)
        if plan:
            return plan
    return {}


def _plan_with_sway(
    body: Body, name: str, loop: Draft, passages: Mapping[str, _ConnectedPassage], sway: Sway, share: float
) -> dict[str, _Movement]:
    """Return movements of a loop and its passages with a sway, by name; none if legs cannot follow one of them."""
    loop_poses = sway.poses(_loop_phases(loop))
    if not _can_follow(body, clip_of(name), loop, loop_poses):
        return {}
    plan = {name: _Movement(loop_poses, share)}
    for passage_name, passage in passages.items():
        movement = _plan_passage(body, passage, sway)
        if movement is None:
            return {}
        plan[passage_name] = movement
    return plan


def _plan_passage(body: Body, passage: _ConnectedPassage, sway: Sway) -> _Movement | None:
    """Return the movement of a start or a stop with the walk's sway and the largest transient that legs can follow.

    Returns:
        The movement; None if legs cannot follow the sway.
    """
    clip, draft, transient = passage
    cycles = _cycles(draft)
    cycles_from_rest = cycles if clip.starts else cycles[::-1]
    phases = cycles - cycles[-1] if clip.starts else cycles  # 0 where it meets the walk
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


def _loop_phases(loop: Draft) -> np.ndarray:
    """Return the phases (samples,) of a loop, cycles; that of the last sample is that of the first."""
    intervals = len(loop.motion.joints) - 1
    return loop.cycles / intervals * (np.arange(intervals + 1) % intervals)


# The sway of a gait.


def _measure_haste(clip: Kind) -> float:
    """Return how far a clip is from a walk, 0, to a run, 1, by its speed."""
    if not isinstance(clip, WalkLoop) or clip.pace is None:
        return 0.0
    return float(np.clip((clip.pace.speed - 1.0) / (PACES["run"].speed - 1.0), 0.0, 1.0))


def find_sway(body: Body, loop: Draft, character: Character, haste: float) -> Sway:
    """Return the offsets with which the torso of a loop moves as its character says.

    The range of the height is that of the character, what the loop has included.

    Args:
        body: the spec.
        loop: loop of a gait.
        character: how the body carries its weight.
        haste: 0 for a walk, 1 for a run.
    """
    heights = sole_heights(compile_model(body), body, loop.motion.poses())
    contacts, stance = find_foot_contacts(loop.motion, body, heights, loop.cycle, loops=True)
    touchdowns = [contact.sample for contact in contacts if contact.event == TOUCH_DOWN]
    sway = Sway(
        bob=_find_bob(body, loop, touchdowns, character, haste),
        roll=_find_roll(body, loop, stance, character),
        bank=_find_bank(loop, character),
        lean=haste * character.lean,
    )
    return sway.scale(character.amplitude)


def _find_bob(body: Body, loop: Draft, touchdowns: list[int], character: Character, haste: float) -> complex:
    """Return the amplitude of the height, twice a cycle, h: the torso falls after touchdowns, given as samples."""
    phases = _loop_phases(loop)[:-1]
    # Numbers that turn back twice a cycle: the mean of a path times these is a half of its amplitude at that frequency.
    turns = np.exp(-4.0j * np.pi * phases)
    fall = _direction(turns[touchdowns].sum(), _MIN_COHERENCE * len(touchdowns), default=1.0)
    growth = 1.0 + haste * (_BOB_OF_RUN - 1.0)
    frequency = 4.0 * np.pi / loop.cycle  # rad/s
    full_bob = -0.5 * growth * character.bob * fall * character.direction(body, frequency)
    present_bob = 2.0 * (loop.motion.positions[:-1, 2] * turns).mean()
    return full_bob - present_bob / body.torso.standing_height


def _find_roll(body: Body, loop: Draft, stance: np.ndarray, character: Character) -> complex:
    """Return the amplitude of the roll, once a cycle, rad: the torso falls to the side of its feet in stance."""
    x, y = np.array([leg.mount[:2] for leg in body.legs]).T
    distances = y * (1.0 + _FRONT_SHARE * share_of_largest(x))  # to the left of the middle
    turns = np.exp(-2.0j * np.pi * _loop_phases(loop)[:-1])  # once a cycle, see `_find_bob`
    side_of_first_foot = float(np.sign(y[0]))  # it touches down at phase 0
    side = _direction(
        ((stance[:-1] @ distances) * turns).mean(), _MIN_SIDE * abs(distances).sum(), default=side_of_first_foot
    )
    frequency = 2.0 * np.pi / loop.cycle  # rad/s
    return -character.roll * side * character.direction(body, frequency)


def _find_bank(loop: Draft, character: Character) -> float:
    """Return the roll that stays in a turn, rad."""
    forward, _, turning = loop.motion.twist
    bank = -character.bank * math.atan(forward * turning / sizing.GRAVITY)
    return float(np.clip(bank, -_MAX_TILT, _MAX_TILT))


def _direction(number: complex, least: float, default: complex) -> complex:
    """Return a complex number of size 1 in the direction of another; a default where that is small."""
    return number / abs(number) if abs(number) > least else default


# Legs.


def _can_follow(body: Body, clip: Kind, draft: Draft, poses: np.ndarray) -> bool:
    """Return whether legs follow offsets (samples, 6) of the torso within their bounds, by some of the samples."""
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
    feet, _ = legs.to_foot_centers().soles(legs.by_leg(motion.joints))  # in the torso's frame
    feet_from_torso = feet @ rotations.matrix(motion.quaternions).swapaxes(-1, -2)
    soles = motion.positions[:, None, 2] + feet_from_torso[..., 2] - legs.radii
    max_stance_miss = _MAX_MISS if has_free_feet(body) else _MAX_MISS_OF_FEW_JOINTS
    return np.where(soles > _SWING_HEIGHT * body.torso.standing_height, _MAX_SWING_MISS, max_stance_miss)


def _largest_joint_step(joints: np.ndarray) -> float:
    """Return the largest turn of a joint between two of the samples (samples, joints), rad."""
    return abs(np.diff(joints, axis=0)).max()
