"""The random numbers of the suite's own modifiers in one episode: all are drawn, always, in one order.

The first ones come from the stream of seeds, the others from a key among these. So the stream is not longer than it was
when there were fewer modifiers.
"""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.tasks import noise
from arc_suite.tasks.scene import Scene

SCHEDULE = 25  # kicks or pushes of a schedule
SHORTEST = 40  # control steps from one to the next
LONGEST = 121  # one more than the most control steps from one to the next

_STEP = np.array([2**32 - 1], np.uint32)  # of the noise's generator, to which no episode counts


class StreamDraws(NamedTuple):
    """Numbers from the stream of seeds, in the order in which they are drawn.

    Attributes:
        kick_steps: (SCHEDULE,) control steps before which kicks come, each 40 to 120 after the one before.
        kick_sizes: (SCHEDULE,) uniform in [0, 1).
        kick_directions: (SCHEDULE,) rad, uniform in [0, 2 pi).
        leg: index of one.
        strength: position of the motors' strength in its range, uniform in [0, 1).
        friction: position of the friction in its range, uniform in [0, 1).
        mass: position of the mass in its range, uniform in [0, 1).
        delay: position of the delay in its range, uniform in [0, 1).
        noise_key: an integer of 32 bits.
    """

    kick_steps: np.ndarray
    kick_sizes: np.ndarray
    kick_directions: np.ndarray
    leg: int
    strength: float
    friction: float
    mass: float
    delay: float
    noise_key: int


class KeyedDraws(NamedTuple):
    """Numbers that follow from the key of the noise, each uniform in [0, 1).

    Attributes:
        payload: position of its mass in the range.
        place: (3,) of the payload in the box around the torso.
        center: (3,) of mass in the range of its displacements.
        gains: (2,) positions of stiffness and of damping in their range.
        armature: position in its range.
        pauses: (SCHEDULE,) before pushes.
        lengths: (SCHEDULE,) of pushes in time.
        sizes: (SCHEDULE,) of pushes.
        directions: (SCHEDULE,) of pushes.
        strengths: (joints,) positions of each joint's strength in the range.
        offsets: (joints,) positions of the sensors' offsets in their range.
    """

    payload: float
    place: np.ndarray
    center: np.ndarray
    gains: np.ndarray
    armature: float
    pauses: np.ndarray
    lengths: np.ndarray
    sizes: np.ndarray
    directions: np.ndarray
    strengths: np.ndarray
    offsets: np.ndarray


class Episode(NamedTuple):
    """What modifiers draw from in an episode.

    Attributes:
        scene: of the task.
        stream: numbers from the stream of seeds.
        keyed: numbers from the key of the noise.
    """

    scene: Scene
    stream: StreamDraws
    keyed: KeyedDraws

    def generator(self, name: str) -> np.random.Generator:
        """Return a generator for a modifier of another package, by its name; it takes nothing from the stream."""
        return np.random.default_rng((int(self.stream.noise_key), *name.encode()))


def draw_episode(scene: Scene, random: np.random.RandomState) -> Episode:
    """Draw the numbers of an episode."""
    stream = draw_from_stream(random, len(scene.body.legs))
    return Episode(scene, stream, draw_by_key(stream.noise_key, len(scene.body.joint_names)))


def draw_from_stream(random: np.random.RandomState, legs: int) -> StreamDraws:
    """Draw the numbers that come from the stream of seeds, for a body with a number of legs."""
    return StreamDraws(
        random.randint(SHORTEST, LONGEST, SCHEDULE).cumsum(),
        random.uniform(size=SCHEDULE),
        random.uniform(0.0, 2.0 * math.pi, SCHEDULE),
        random.randint(legs),
        *random.uniform(size=4),
        random.randint(2**32, dtype=np.uint32),
    )


def draw_by_key(noise_key: int, joints: int) -> KeyedDraws:
    """Draw the numbers that follow from the key of the noise, for a body with a number of joints."""
    sizes = (1, 3, 3, 2, 1, *[SCHEDULE] * 4, joints, joints)
    uniform = 0.5 + 0.5 * noise.noise(np.array([noise_key], np.uint32), _STEP, sum(sizes))
    draws = KeyedDraws(*np.split(uniform, np.cumsum(sizes)[:-1]))
    return draws._replace(payload=draws.payload[0], armature=draws.armature[0])


def within(span: tuple[float, float], share):
    """Return the number (...) that lies at a share (...) of a range."""
    low, high = span
    return low + share * (high - low)
