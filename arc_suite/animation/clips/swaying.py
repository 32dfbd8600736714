"""How a torso sways in a gait: the character of a body, and offsets of the torso by the phase of the gait.

In a gait the torso sinks after touchdowns, twice a cycle, and rolls towards the feet that stand. The faster it is than
a walk, the more it sinks, and leans ahead. It banks in turns. A damped spring delays all of this. In a turn on the spot
the torso sinks after touchdowns, too.

Lengths are in standing heights h, times in sqrt(h / g).
"""

import math
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.foot_contacts import TOUCH_DOWN, find_foot_contacts, sole_heights
from arc_suite.animation.clips.root_motion import away_from_ends, share_of_largest
from arc_suite.animation.clips.standing_legs import HEIGHT
from arc_suite.models import posture
from arc_suite.models.standing import GRAVITY, time_unit
from arc_suite.robots.spec import Body

MAX_WEIGHT = 2.0

_ROLL = posture.POSE_NAMES.index("roll")

_BOB_OF_RUN = 2.3  # times that of a walk
MAX_TILT = np.radians(8.0)  # rad, of the bank, and of the pitch in starts and stops

# In a trot diagonal feet stand, and as many on the left as on the right. The body rolls to the side of its front feet.
_FRONT_SHARE = 0.3  # by which the foremost feet count more than those in the middle, in the side that stands
_MIN_COHERENCE = 0.2  # of touchdowns in half a cycle: below, that of the first foot, at phase 0, sets the phase
_MIN_SIDE = 0.001  # of the sum of all distances of feet from the middle: below, the first foot sets the side

_FADE_SHARE = 0.2  # of a turn on the spot, at either end, in which the torso does not sink as deep


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
        ratio = frequencies * time_unit(body) / self.frequency
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


def choose_character(weight: float | str) -> Character:
    """Return the character of a name, or a multiple of the usual one.

    Raises:
        ValueError: neither a name nor a number from 0 to `MAX_WEIGHT`.
    """
    if not isinstance(weight, str):
        return USUAL._replace(amplitude=checks.number("weight", weight, 0.0, MAX_WEIGHT))
    if "," in weight:
        raise ValueError(f"weight: expected one name or one number, got {checks.preview(weight)}")
    name = checks.name(weight, CHARACTERS, "weight", descriptions=(f"a number from 0 to {MAX_WEIGHT:g}",))
    return CHARACTERS[name]


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


def find_sway(body: Body, loop: Draft, character: Character, haste: float) -> Sway:
    """Return the offsets with which the torso of a loop moves as its character says.

    The range of the height is that of the character, what the loop has included.

    Args:
        body: the spec.
        loop: loop of a gait.
        character: how the body carries its weight.
        haste: 0 for a walk, 1 for a run.
    """
    heights = sole_heights(body, loop.motion.poses())
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
    phases = loop_phases(loop)[:-1]
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
    turns = np.exp(-2.0j * np.pi * loop_phases(loop)[:-1])  # once a cycle, see `_find_bob`
    side_of_first_foot = float(np.sign(y[0]))  # it touches down at phase 0
    side = _direction(
        ((stance[:-1] @ distances) * turns).mean(), _MIN_SIDE * abs(distances).sum(), default=side_of_first_foot
    )
    frequency = 2.0 * np.pi / loop.cycle  # rad/s
    return -character.roll * side * character.direction(body, frequency)


def _find_bank(loop: Draft, character: Character) -> float:
    """Return the roll that stays in a turn, rad."""
    forward, _, turning = loop.motion.twist
    bank = -character.bank * math.atan(forward * turning / GRAVITY)
    return float(np.clip(bank, -MAX_TILT, MAX_TILT))


def _direction(number: complex, least: float, default: complex) -> complex:
    """Return a complex number of size 1 in the direction of another; a default where that is small."""
    return number / abs(number) if abs(number) > least else default


def sink_in_turn(body: Body, draft: Draft, character: Character) -> np.ndarray:
    """Return offsets (samples, 6) of the torso in a turn on the spot, which sinks after touchdowns; 0 at both ends."""
    _, contacts = draft.stance_height_and_contacts(body)
    samples = len(draft.motion.joints)
    landed_feet = np.zeros(samples)  # at each sample
    for contact in contacts:
        landed_feet[contact.sample] += contact.event == TOUCH_DOWN
    depth = share_of_largest(character.follow(body, landed_feet, draft.motion.time_step))
    shares = np.linspace(0.0, 1.0, samples)
    weights = away_from_ends(shares / _FADE_SHARE, (1.0 - shares) / _FADE_SHARE)
    poses = np.zeros((samples, len(posture.POSE_NAMES)))
    poses[:, HEIGHT] = -character.amplitude * character.bob * weights * depth
    return poses


def loop_phases(loop: Draft) -> np.ndarray:
    """Return the phases (samples,) of a loop, cycles; that of the last sample is that of the first."""
    intervals = len(loop.motion.joints) - 1
    return loop.cycles / intervals * (np.arange(intervals + 1) % intervals)
