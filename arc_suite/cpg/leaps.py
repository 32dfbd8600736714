"""Jumps and leaps: keyframes of joints by inverse kinematics, and how a body flies by them, measured by trial.

A body crouches, draws back, stretches with all that its motors give, draws its feet up in the air, and
lands on feet that reach ahead. Lengths are multiples of the standing height h, durations of sqrt(h / g).
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.drives import drive
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.sizing import GRAVITY, control_timestep, simulation, size_body
from arc_suite.models.standing import pose_mechanics, standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import readings


class Leap(NamedTuple):
    """How a body leaps.

    Attributes:
        crouch: by which the torso sinks.
        back: by which it is drawn back meanwhile.
        forward: by which legs stretch it ahead of its feet.
        drive: how far joints are driven, by the way from the crouch to the stretch: motors of position control
            give the more, the further the target is.
        tuck: by which feet are drawn up in the air.
        ahead: by which they land ahead of their places.
        stretch: duration of the stretch.
        fly: duration from the stretch to the landing.
    """

    crouch: float = 0.5
    back: float = 0.5
    forward: float = 0.3
    drive: float = 2.5
    tuck: float = 0.2
    ahead: float = 0.25
    stretch: float = 1.0
    fly: float = 2.0


_JUMP = Leap(back=0.0, forward=0.0, ahead=0.0)
MIN_BY_MEASURE = {"clearance": 0.1, "distance": 0.8}  # standing heights: of feet in a jump and in a leap
JUMPS = tuple(_JUMP._replace(crouch=crouch, drive=drive) for crouch in (0.35, 0.5) for drive in (1.5, 2.5, 4.0))

_SINK, _HOLD, _SETTLE = 2.0, 0.5, 3.0  # durations of the crouch, of the wait in it, and of the landing
_UP = 0.6  # by which legs are to stretch, which none can
_PLANE = 0.45  # weight of a sole's place in the plane against its height: feet may slide rather than stay behind
_ROUNDS = 40  # of it, for a pose
_OFF = 0.03  # of the standing height: soles that are higher have left the ground
_UPRIGHT = 0.7  # least cosine of the torso's tilt in a leap that lands
_HIGH = 0.6  # least height of the torso, by that at rest, at its end


class Movement(NamedTuple):
    """A leap of one body. Control steps count from 1.

    Attributes:
        offsets: (steps, 3) m, of soles from where they were at rest, as the torso sees them.
        driven: (legs, links) rad, added to the angles of the crouch while legs stretch.
        crouched: control step at which the crouch ends.
        stretched: at which the stretch ends.
        landed: at which feet are to be on the ground.
    """

    sole_offsets: np.ndarray
    joint_drive: np.ndarray
    crouch_end: int
    stretch_end: int
    landing_step: int


def plan_movement(body: Body, legs: Legs, rest: np.ndarray, leap: Leap) -> Movement:
    """Return the plan of a leap from a pose (legs, links), rad, in which soles are level."""
    height = body.torso.standing_height
    unit = math.sqrt(height / GRAVITY) / control_timestep(body)
    sink, hold, stretch, fly, settle = (
        max(1, round(unit * part)) for part in (_SINK, _HOLD, leap.stretch, leap.fly, _SETTLE)
    )
    low, reach = np.array((leap.back, 0.0, leap.crouch)), np.array((leap.ahead, 0.0, 0.0))
    air = np.sin(np.pi * np.arange(1, fly + 1) / fly)[:, None] * (0.0, 0.0, leap.tuck)
    parts = [_eased(sink) * low, np.tile(low, (hold + stretch, 1)), air + reach, (1.0 - _eased(settle)) * reach]
    soles, weights = legs.soles(rest)[0], sole_weights(len(rest))

    def reached(angles, offset):
        return legs.solve_joint_angles(angles, soles + offset * height, weights, posture.IK_DAMPING * height, _ROUNDS)

    crouched = reached(rest, low)
    stretched = reached(crouched, np.array((-leap.forward, 0.0, -_UP)))
    ends = np.cumsum([sink + hold, stretch, fly]).tolist()
    return Movement(height * np.concatenate(parts), leap.drive * (stretched - crouched), *ends)


def sole_weights(legs: int) -> np.ndarray:
    """Return the weights (legs, 3, 3) of the soles' places in inverse kinematics."""
    return np.tile(np.diag((_PLANE, _PLANE, 1.0)), (legs, 1, 1))


def _eased(steps: int) -> np.ndarray:
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(1, steps + 1) / steps)[:, None]


def leap_targets(body: Body, legs: Legs, rest: np.ndarray, leap: Leap) -> np.ndarray:
    """Return the targets (steps, joints) of joints in the control steps of a leap from a pose (legs, links), rad."""
    made, soles, height = plan_movement(body, legs, rest, leap), legs.soles(rest)[0], body.torso.standing_height
    goals = soles + made.sole_offsets[:, None]
    angles = legs.solve_joint_angles(
        np.tile(rest, (len(goals), 1, 1)), goals, sole_weights(len(rest)), posture.IK_DAMPING * height, _ROUNDS
    )
    stretch = slice(made.crouch_end, made.stretch_end)
    angles[stretch] += made.joint_drive
    return legs.by_joint(angles)


class Flight(NamedTuple):
    """What a leap does to a body on level ground; lengths in standing heights.

    Attributes:
        distance: by which feet stand ahead of where they took off.
        moved: of the torso while no foot is on the ground.
        seconds: for which none is.
        clearance: the most that the lowest foot is over the ground.
        rise: of the torso.
        landed: whether the torso stays upright and stands at the end.
    """

    distance: float
    torso_distance: float
    air_time: float
    clearance: float
    rise: float
    landed: bool


def simulate_flights(body: Body, rest: np.ndarray, angles: np.ndarray, crouched: Sequence[int]) -> list[Flight]:
    """Return what leaps do to a body, by simulation.

    Args:
        body: any.
        rest: (joints,) pose from which they start, rad.
        angles: (leaps, steps, joints) targets by control step, rad; the last one is held.
        crouched: control step of each at which its crouch ends.
    """
    body = size_body(body)
    places, tilts, soles = _simulated(body, rest, angles)
    return [_measured(body, *each, control_timestep(body)) for each in zip(places, tilts, soles, crouched, strict=True)]


def _simulated(body: Body, rest: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of torsos (leaps, steps, 3) and of soles (leaps, steps, legs, 3), m, and cosines of tilts between."""
    model, pose, count = compile_model(body), pose_mechanics(body, rest), len(rest)
    layout, driven = readings.layout(model, body), drive(body, pose.inertias)
    batch = Batch(model, len(angles), 1)
    data, every = batch.data, np.ones(len(angles), bool)
    start = np.concatenate([(0.0, 0.0, -pose.soles[:, 2].min(), 1.0, 0.0, 0.0, 0.0), rest])
    qpos = np.tile(readings.positions(start, layout, standing_qpos(model)), (len(angles), 1))
    batch.reset(every, qpos, np.zeros_like(data.qvel))
    radii, found = np.array([leg.foot.radius for leg in body.legs])[:, None] * (0.0, 0.0, 1.0), []
    for target, later in zip(angles.swapaxes(0, 1)[:-1], angles.swapaxes(0, 1)[1:], strict=True):
        now, velocities = readings.pose(data.qpos, layout)[:, 7:], data.qvel[:, layout.joint_velocities]
        speeds = (later - target) / control_timestep(body)
        data.ctrl[:, :count] = driven.actions(target, speeds, now, velocities)
        batch.step(simulation(body).substeps, every)
        torso = readings.pose(data.qpos, layout)[:, :7].copy()
        found.append((torso[:, :3], rotations.upright(torso[:, 3:]), data.xpos[:, layout.feet] - radii))
    return tuple(np.stack(each, axis=1) for each in zip(*found, strict=True))


def _measured(body: Body, places, tilts, soles, crouched: int, step: float) -> Flight:
    height = body.torso.standing_height
    off = (soles[crouched:, :, 2] > _OFF * height).all(axis=-1)
    first = crouched + int(off.argmax())
    last = first + int(np.append(~off, True)[first - crouched :].argmax())
    landed = (tilts[crouched:] >= _UPRIGHT).all() and places[-1, 2] >= _HIGH * places[0, 2]
    ahead = (soles[-1] - soles[crouched - 1])[:, 0].mean()
    return Flight(
        distance=float(ahead / height) if off.any() else 0.0,
        torso_distance=float((places[max(last - 1, first), 0] - places[first, 0]) / height),
        air_time=step * (last - first),
        clearance=float((soles[crouched:, :, 2].min(axis=-1)).max() / height),
        rise=float((places[:, 2].max() - places[0, 2]) / height),
        landed=bool(landed),
    )


@functools.lru_cache(maxsize=64)
def find_best_leap(body: Body, rest: tuple[float, ...], choice: tuple[Leap, ...], measure: str = "distance"):
    """Return the leap of a choice by which a body lands and gets farthest or highest, and its flight.

    Args:
        body: any.
        rest: (joints,) pose in which soles are level, rad.
        choice: leaps to try.
        measure: `distance` or `clearance`.
    """
    legs = Legs.of(size_body(body))
    angles = legs.by_leg(np.array(rest))
    made = [leap_targets(body, legs, angles, leap) for leap in choice]
    longest = max(map(len, made))
    targets = np.stack([np.concatenate([each, np.tile(each[-1], (longest - len(each), 1))]) for each in made])
    crouched = [plan_movement(body, legs, angles, leap).crouch_end for leap in choice]
    found = simulate_flights(body, np.array(rest), targets, crouched)
    return max(zip(choice, found, strict=True), key=lambda pair: pair[1].landed * getattr(pair[1], measure))


def choose_leap(body: Body, rest: tuple[float, ...], choice: tuple[Leap, ...], measure: str) -> Leap:
    """Return the leap of a choice by which a body gets farthest or highest; see `best`.

    Raises:
        ValueError: the body hardly leaves the ground, or does not land on its feet.
    """
    leap, flight = find_best_leap(body, rest, choice, measure)
    if not flight.landed:
        raise ValueError("it does not land on its feet")
    if (reached := getattr(flight, measure)) < MIN_BY_MEASURE[measure]:
        raise ValueError(
            f"the {measure} of its feet is {reached:.2f} standing heights, less than {MIN_BY_MEASURE[measure]}"
        )
    return leap
