"""Motions drawn over standing feet, from the pose at rest: breaths, looks, leans, blows, strikes.

A gesture is a table of tracks. A track has keys of time and value; between keys the value is eased. Lengths are in
standing heights h, times in sqrt(h / g).
"""

import itertools
import math
from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import Motion, Pose, fade_out
from arc_suite.models import posture, sizing
from arc_suite.models.kinematics import Legs
from arc_suite.robots.spec import Body

_STAGES, _ROUNDS = 8, 6  # in which poses grow from rest, so that no leg folds the other way; searches in each
_FASTEST = 7.0  # rad / sqrt(h / g), that a joint turns
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a sole's place: legs of two joints slide rather than sink
_ASTRAY = 0.0055  # standing heights, by which a sole may be from its place in a gesture at full size
_SHARES = (1.0, 0.8, 0.6, 0.4, 0.25, 0.15)  # of a gesture's size: the largest is taken that the legs can follow
_DEEPER = (1.0, 1.6)  # times the height it sinks by, as stretched legs cannot follow a tilt
_SINKS, _SLIDES = 0.01, 0.08  # standing heights, by which a sole may then miss its place in height and on the ground
_SAMPLES = 4  # of a control step
_SMOOTHING = 3  # rounds of a mean over three samples

_TURN, _OF_ROOM, _LEAST_TURN = 0.2, 0.8, 0.03  # rad, that a torso turns, at most a share of its room, and at least
_EASE, _SHOWN = 3.0, 4.0  # durations of a turn, and of the pose after it

_BREATH, _PERIOD = 0.012, 12.0  # how far a torso sinks in a breath, and how long that takes
_SWAY, _ROLL = 0.02, 0.012  # to the side, and rad about the forward axis, in two breaths

_LOOKS = {
    "yaw": ((1.0, 0.0), (4.0, 0.24), (7.5, 0.24), (11.5, -0.24), (15.5, -0.24), (19.0, 0.0)),
    "roll": ((1.5, 0.0), (4.5, -0.05), (7.5, -0.03), (11.5, 0.05), (15.0, 0.03), (18.5, 0.0)),
    "pitch": ((3.0, 0.0), (5.5, 0.07), (8.5, 0.0), (12.0, -0.07), (14.0, 0.06), (16.0, 0.0)),
    "left": ((0.5, 0.0), (3.5, -0.03), (7.0, -0.03), (11.0, 0.03), (15.5, 0.03), (19.5, 0.0)),
}
_LOOK = 24.0

# A weight that goes to the other feet, and a foot that rises and settles again, twice.
_SETTLE = 24.0
_LIFTS = ((3.0, 0.0), (4.6, 0.16), (5.0, 0.16), (6.6, 0.0))
_SHIFT = ((0.5, 0.0), (2.8, 0.06), (6.6, 0.06), (9.0, -0.02), (11.5, 0.0))

_BLOW, _PEAK, _REBOUND = 7.0, 0.9, 0.3  # times of the whole and of the peak; share of the sway back
_PITCH, _PUSH, _GIVE = 0.2, 0.07, 0.1  # rad, and how far a blow moves a torso along its way, and down
HIT_DIRECTIONS = {
    "front": (-1.0, 0.0),
    "back": (1.0, 0.0),
    "left": (0.0, -1.0),
    "right": (0.0, 1.0),
}  # ways of the torso

_STRIKE = 9.0
_RAISED = {  # of the torso, and of the foot ahead and upwards
    "forward": ((0.3, 0.0), (2.2, -0.08), (3.0, -0.08), (3.8, 0.1), (4.6, 0.1), (7.5, 0.0)),
    "pitch": ((0.3, 0.0), (2.2, -0.14), (3.0, -0.15), (3.8, 0.12), (4.6, 0.1), (7.5, 0.0)),
    "height": ((0.3, 0.0), (2.0, -0.03), (3.0, 0.0), (3.8, -0.08), (4.6, -0.06), (7.5, 0.0)),
}
_AHEAD = ((0.8, 0.0), (2.4, 0.1), (3.0, 0.12), (3.8, 0.4), (4.8, 0.4), (6.6, 0.0))
_UP = ((0.8, 0.0), (2.4, 0.7), (3.0, 0.72), (3.8, 0.0), (4.8, 0.0), (5.7, 0.15), (6.6, 0.0))


def hold_pose(pose: Pose, samples: int, step: float) -> Motion:
    """Return a pose held for a number of samples after the first one, with a root that stays."""
    positions, quaternions, joints = (np.tile(values, (samples + 1, 1)) for values in pose)
    return Motion(step, np.zeros((samples + 1, 3)), positions, quaternions, joints, np.zeros(3))


def torso_gesture(body: Body, rest: Pose, tracks: Mapping[str, tuple], duration: float) -> Motion:
    """Return a torso that moves over standing feet, as far as the legs can follow.

    Args:
        body: the spec.
        rest: pose from which it moves.
        tracks: by a number of the pose, see `posture.NAMES`: pairs of a time, sqrt(h / g), and a value, standing
            heights or rad.
        duration: sqrt(h / g).

    Raises:
        ValueError: the legs leave no room for it.
    """
    return _followed(body, rest, _poses(_times(body, duration), tracks), "move so")


def idle(body: Body, rest: Pose) -> Motion:
    """Return a standing body as a loop that begins with the pose at rest: two breaths, and weight that shifts.

    The torso sinks and rises, and goes to either side, while joints bend so that the soles stay where they are; less
    where legs have too few joints for that.
    """
    times = _times(body, 2.0 * _PERIOD)
    turn = 2.0 * np.pi * times / times[-1]
    sway = np.sin(turn) * np.sin(0.5 * turn) ** 2  # at rest at both ends
    poses = _poses(times, {}) + _breath(times)
    poses[:, posture.NAMES.index("left")] = _SWAY * sway
    poses[:, posture.NAMES.index("roll")] = -_ROLL * sway
    _, astray = keep_feet_in_place(body, rest, poses)
    poses *= min(1.0, _ASTRAY * body.torso.standing_height / max(astray.max(), 1e-9))
    return _looped(_posed(body, rest, poses, keep_feet_in_place(body, rest, poses)[0]))


def glance(body: Body, rest: Pose) -> Motion:
    """Return a standing body that looks to either side and down, as a loop.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times = _times(body, _LOOK)
    return _looped(_followed(body, rest, _poses(times, _LOOKS) + _breath(times), "look around"))


def settle(body: Body, rest: Pose) -> Motion:
    """Return a standing body that shifts its weight and sets two feet anew, one after the other, as a loop.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times, feet = _times(body, _SETTLE), _feet(body, rest)
    poses, lifts = _breath(times), np.zeros((len(times), len(feet), 3))
    first = 0
    last = int(np.linalg.norm(feet - feet[first], axis=-1).argmax())
    for leg, start in ((first, 0.0), (last, 0.5 * _SETTLE)):
        way = -feet[leg, :2] / np.linalg.norm(feet[leg, :2])
        shift = _track(times - start, _SHIFT)
        poses[:, 1:3] += shift[:, None] * way
        poses[:, 3:5] += shift[:, None] * (-way[1], way[0])  # the torso leans to where its weight goes
        lifts[:, leg, 2] = _track(times - start, _LIFTS)
    return _looped(_followed(body, rest, poses, "shift its weight", lifts))


def hit(body: Body, rest: Pose, side: str) -> Motion:
    """Return how a body sways under a blow over planted feet: pushed and tilted along its way, while the knees give.

    Args:
        body: the spec.
        rest: pose from which it sways.
        side: from which the blow comes, of `HITS`.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times = _times(body, _BLOW)
    forward, left = HIT_DIRECTIONS[side]

    def impulse(start):
        share = (times - start).clip(0.0) / _PEAK
        return share**2 * np.exp(2.0 - 2.0 * share)

    sway = (impulse(0.0) - _REBOUND * impulse(2.0 * _PEAK)) * fade_out(times / _BLOW * 2.0 - 1.0)
    give = (impulse(0.2 * _PEAK) + 0.3 * impulse(_PEAK)) * fade_out(times / _BLOW * 2.0 - 1.0)
    poses = sway[:, None] * np.array((0.0, _PUSH * forward, _PUSH * left, -_PITCH * left, _PITCH * forward, 0.0))
    poses[:, 0] = -_GIVE * give
    return _followed(body, rest, poses, "sway")


def strike(body: Body, rest: Pose) -> Motion:
    """Return how a body raises its front leg and strikes the ground ahead.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times, feet = _times(body, _STRIKE), _feet(body, rest)
    leg = int(feet[:, 0].argmax())
    lifts = np.zeros((len(times), len(feet), 3))
    lifts[:, leg, 0], lifts[:, leg, 2] = _track(times, _AHEAD), _track(times, _UP)
    return _followed(body, rest, _poses(times, _RAISED), "strike", lifts)


def turn_torso(body: Body, rest: Pose, number: str, sign: float) -> Motion:
    """Return how a torso turns over its feet, stays so, and turns back.

    Args:
        body: the spec.
        rest: pose from which it turns.
        number: of the pose that changes; see `posture.NAMES`.
        sign: of the change.

    Raises:
        ValueError: the legs have no room for it.
    """
    bounds = posture.room(body, planted=False)[posture.NAMES.index(number)]
    size = sign * min(_TURN, _OF_ROOM * abs(bounds[int(sign > 0.0)]))
    if abs(size) < _LEAST_TURN:
        raise ValueError(f"the legs leave the torso no room to {number}")
    end = _EASE + _SHOWN
    times = _times(body, end + _EASE)
    poses = _poses(times, {number: ((0.0, 0.0), (_EASE, size), (end, size), (end + _EASE, 0.0))})
    return _posed(body, rest, poses, keep_feet_in_place(body, rest, poses)[0])


def lower_torso(body: Body, rest: Pose, depths: np.ndarray) -> np.ndarray:
    """Return joint angles (samples, joints), rad, that keep soles in place while the torso sinks.

    Args:
        body: the spec.
        rest: pose from which it sinks.
        depths: (samples,) m.
    """
    return keep_feet_in_place(body, rest, -depths[:, None] / body.torso.standing_height * np.eye(6)[0])[0]


def keep_feet_in_place(body: Body, rest: Pose, poses: np.ndarray, lifts: np.ndarray | None = None):
    """Return joint angles (samples, joints), rad, that hold feet under a posed torso, and how far they miss, m.

    Args:
        body: the spec.
        rest: pose from which the torso moves.
        poses: (samples, 6) from there; see `posture`.
        lifts: (samples, legs, 3) by which feet leave their places, standing heights; None for feet that stay.

    Returns:
        Angles, and (samples, legs, 3) by which feet miss their places.
    """
    height, frame = body.torso.standing_height, rotations.matrix(rest.quaternion)
    legs = _legs(body)
    angles = legs.by_leg(rest.joints)
    # A joint at rest may be a little beyond its range, as limits are soft.
    legs = legs._replace(low=np.minimum(legs.low, angles), high=np.maximum(legs.high, angles))
    places, lifts = legs.soles(angles)[0] @ frame.T, height * (np.zeros(3) if lifts is None else lifts)
    angles = np.tile(angles, (len(poses), 1, 1))
    for share in np.linspace(0.0, 1.0, _STAGES + 1)[1:]:
        goals = posture.moved(places + share * lifts, share * poses, height) @ frame
        angles = legs.reached(angles, goals, _WEIGHTS, posture.DAMPING * height, _ROUNDS)
    missed = (legs.soles(angles)[0] - goals) @ frame.T @ posture.attitude(poses[:, 3:]).swapaxes(-1, -2)
    return legs.by_joint(angles), abs(missed)


def _followed(body: Body, rest: Pose, poses: np.ndarray, act: str, lifts: np.ndarray | None = None) -> Motion:
    """Return a gesture as large as standing legs can follow; a ValueError, which names the act, if they cannot."""
    height, lifts = body.torso.standing_height, np.zeros((1, len(body.legs), 3)) if lifts is None else lifts
    stays, low = ~lifts.any(axis=-1, keepdims=True), lifts[..., 2:] == 0.0
    bounds = height * np.where(np.concatenate([stays, stays, low], axis=-1), (_SLIDES, _SLIDES, _SINKS), np.inf)
    fastest = _FASTEST * math.sqrt(sizing.GRAVITY / height) * _step(body)
    for share, deeper in itertools.product(_SHARES, _DEEPER):
        tried = share * poses * (deeper, 1.0, 1.0, 1.0, 1.0, 1.0)
        joints, missed = keep_feet_in_place(body, rest, tried, share * lifts)
        joints = _smooth(joints)
        if (missed <= bounds).all() and abs(np.diff(joints, axis=0)).max() <= fastest:
            return _posed(body, rest, tried, joints)
    raise ValueError(f"the legs leave the torso no room to {act}")


def _posed(body: Body, rest: Pose, poses: np.ndarray, joints: np.ndarray) -> Motion:
    """Return a motion of the torso (samples, 6) from rest, and of joints (samples, joints), rad."""
    forward_left_up = body.torso.standing_height * poses[:, [1, 2, 0]]
    quaternions, half = np.broadcast_to(rest.quaternion, (len(poses), 4)), 0.5 * poses[:, 3:]
    for axis in range(3):
        turn = np.concatenate([np.cos(half[:, [axis]]), np.sin(half[:, [axis]]) * np.eye(3)[axis]], axis=-1)
        quaternions = rotations.product(turn, quaternions)
    motion = hold_pose(rest, len(poses) - 1, _step(body))
    return motion._replace(positions=rest.position + forward_left_up, quaternions=quaternions, joints=joints)


def _smooth(joints: np.ndarray) -> np.ndarray:
    """Return joint angles (samples, joints) without jerks, such as of a leg that stretches; both ends stay."""
    for _ in range(_SMOOTHING):
        joints[1:-1] = 0.25 * (joints[:-2] + 2.0 * joints[1:-1] + joints[2:])
    return joints


def _looped(motion: Motion) -> Motion:
    return motion.map_arrays(lambda values: np.concatenate([values[:-1], values[:1]]))


def _legs(body: Body) -> Legs:
    """Return the legs with the centers of feet for soles, over which a torso tilts."""
    legs = Legs.of(body, used=1.0)
    return legs._replace(radii=np.zeros_like(legs.radii))


def _feet(body: Body, rest: Pose) -> np.ndarray:
    """Return the places (legs, 3) of the feet from the torso, in the root's axes, m."""
    legs = _legs(body)
    return legs.soles(legs.by_leg(rest.joints))[0] @ rotations.matrix(rest.quaternion).T


def _times(body: Body, duration: float) -> np.ndarray:
    """Return the times (samples,) of a duration, both ends included."""
    step = _step(body) * math.sqrt(sizing.GRAVITY / body.torso.standing_height)
    return np.linspace(0.0, duration, 1 + max(2, round(duration / step)))


def _step(body: Body) -> float:
    """Return the time between two samples, s."""
    return sizing.control_timestep(body) / _SAMPLES


def _poses(times: np.ndarray, tracks: Mapping[str, tuple]) -> np.ndarray:
    """Return poses (samples, 6) of the torso by tracks of their numbers."""
    zero = ((0.0, 0.0),)
    return np.stack([_track(times, tracks.get(name, zero)) for name in posture.NAMES], axis=-1)


def _breath(times: np.ndarray) -> np.ndarray:
    """Return poses (samples, 6) of a torso that sinks and rises in each breath."""
    return -_BREATH * (0.5 - 0.5 * np.cos(2.0 * np.pi * times / _PERIOD))[:, None] * np.eye(6)[0]


def _track(times: np.ndarray, keys: tuple) -> np.ndarray:
    """Return the values (samples,) of a track."""
    at, values = np.array(keys).T
    before = np.searchsorted(at[1:-1], times, side="right") if len(at) > 2 else np.zeros(len(times), int)
    after = np.minimum(before + 1, len(at) - 1)
    share = (times - at[before]) / np.maximum(at[after] - at[before], 1e-9)
    return values[after] + (values[before] - values[after]) * fade_out(share)
