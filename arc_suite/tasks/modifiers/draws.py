"""The random numbers of the suite's own modifiers in one episode: all are drawn, always, in one order.

The first ones are drawn from the random stream of episodes. The last of these is a key, and all other numbers follow
from the key. So a new modifier draws nothing from the stream, and the episodes of a seed stay as they are.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from arc_suite.tasks import noise
from arc_suite.tasks.scene import Scene

SCHEDULE = 25  # number of kicks, or of pushes, in a schedule
MIN_INTERVAL = 40  # control steps from a kick or push to the next
INTERVAL_BOUND = 121  # control steps; intervals are shorter than this

# The step of the noise's generator from which an episode draws; no episode is long enough to reach this step itself.
_DRAWING_STEP = np.array([2**32 - 1], np.uint32)


class StreamDraws(NamedTuple):
    """Numbers from the stream of seeds, in the order in which they are drawn.

    Attributes:
        kick_steps: (SCHEDULE,) control steps before which kicks come, each 40 to 120 after the one before.
        kick_sizes: (SCHEDULE,) uniform in [0, 1).
        kick_directions: (SCHEDULE,) rad, uniform in [0, 2 pi).
        failing_leg: index of the leg whose motors may fail.
        motor_strength: position of the motors' strength in its range, uniform in [0, 1).
        friction: position of the friction in its range, uniform in [0, 1).
        mass: position of the mass in its range, uniform in [0, 1).
        delay: position of the delay in its range, uniform in [0, 1).
        noise_key: an integer of 32 bits, from which `KeyedDraws` and the noise of observations follow.
    """

    kick_steps: np.ndarray
    kick_sizes: np.ndarray
    kick_directions: np.ndarray
    failing_leg: int
    motor_strength: float
    friction: float
    mass: float
    delay: float
    noise_key: int


class KeyedDraws(NamedTuple):
    """Numbers that follow from the key of the noise, each uniform in [0, 1).

    Attributes:
        payload: position of the payload's mass in its range.
        payload_place: (3,) position of the payload in the box around the torso.
        center_of_mass: (3,) position of the torso's center of mass in the range of its displacements.
        gains: (2,) positions of stiffness and of damping in their range.
        armature: position of the armature in its range.
        push_intervals: (SCHEDULE,) positions of the time before each push in its range.
        push_durations: (SCHEDULE,) positions of the time that each push lasts in its range.
        push_sizes: (SCHEDULE,) shares of the greatest force.
        push_directions: (SCHEDULE,) turns.
        joint_strengths: (joints,) positions of each joint's strength in its range.
        joint_offsets: (joints,) positions of each sensor's offset in its range.
    """

    payload: float
    payload_place: np.ndarray
    center_of_mass: np.ndarray
    gains: np.ndarray
    armature: float
    push_intervals: np.ndarray
    push_durations: np.ndarray
    push_sizes: np.ndarray
    push_directions: np.ndarray
    joint_strengths: np.ndarray
    joint_offsets: np.ndarray


class Episode(NamedTuple):
    """What modifiers draw from in an episode.

    Attributes:
        scene: scene of the task.
        stream: numbers from the stream of seeds.
        keyed: numbers from the key of the noise.
    """

    scene: Scene
    stream: StreamDraws
    keyed: KeyedDraws

    def generator(self, name: str) -> np.random.Generator:
        """Return a generator for a modifier of another package, given its name; it takes nothing from the stream."""
        return np.random.default_rng((int(self.stream.noise_key), *name.encode()))


def draw_episode(scene: Scene, random: np.random.RandomState) -> Episode:
    """Draw the numbers of an episode."""
    stream = draw_from_stream(random, len(scene.body.legs))
    keyed = draw_by_key(stream.noise_key, len(scene.body.joint_names))
    return Episode(scene, stream, keyed)


def draw_from_stream(random: np.random.RandomState, legs: int) -> StreamDraws:
    """Draw the numbers that come from the stream of seeds, for a body with a number of legs."""
    intervals = random.randint(MIN_INTERVAL, INTERVAL_BOUND, SCHEDULE)
    kick_sizes = random.uniform(size=SCHEDULE)
    kick_directions = random.uniform(0.0, 2.0 * math.pi, SCHEDULE)
    failing_leg = random.randint(legs)
    motor_strength, friction, mass, delay = random.uniform(size=4)
    return StreamDraws(
        kick_steps=intervals.cumsum(),
        kick_sizes=kick_sizes,
        kick_directions=kick_directions,
        failing_leg=failing_leg,
        motor_strength=motor_strength,
        friction=friction,
        mass=mass,
        delay=delay,
        noise_key=random.randint(2**32, dtype=np.uint32),
    )


def draw_by_key(noise_key: int, joints: int) -> KeyedDraws:
    """Draw the numbers that follow from the key of the noise, for a body with a number of joints."""
    counts = {
        "payload": 1,
        "payload_place": 3,
        "center_of_mass": 3,
        "gains": 2,
        "armature": 1,
        "push_intervals": SCHEDULE,
        "push_durations": SCHEDULE,
        "push_sizes": SCHEDULE,
        "push_directions": SCHEDULE,
        "joint_strengths": joints,
        "joint_offsets": joints,
    }
    key = np.array([noise_key], np.uint32)
    uniform = 0.5 + 0.5 * noise.noise(key, _DRAWING_STEP, sum(counts.values()))
    draws: dict[str, Any] = {}
    start = 0
    for name, count in counts.items():
        draws[name] = uniform[start : start + count]
        start += count
    draws["payload"] = draws["payload"][0]
    draws["armature"] = draws["armature"][0]
    return KeyedDraws(**draws)


def interpolate(span: tuple[Any, Any], share):
    """Return the number (...) that lies at a share (...) of the way from the low end of a range to its high end."""
    low, high = span
    return low + share * (high - low)
