"""Jumps and leaps: targets of joints by inverse kinematics, and what they do to a body, measured by trial.

A body crouches, draws back, stretches with all that its motors give, draws its feet up in the air, and
lands on feet that reach ahead. Lengths are multiples of the standing height h, durations of sqrt(h / g).
Control steps of a leap count from 1.
"""

import functools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.drives import drive
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.sizing import control_timestep, simulation, size_body
from arc_suite.models.standing import pose_mechanics, standing_qpos, time_unit
from arc_suite.robots.spec import Body
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import fitting, readings


class Leap(NamedTuple):
    """How a body leaps.

    Attributes:
        crouch: distance by which the torso sinks.
        back: distance by which the torso is drawn back while it sinks.
        forward: distance by which legs stretch the torso ahead of its feet.
        drive: how far joints are driven, by the way from the crouch to the stretch: motors of position control
            give the more, the further the target is.
        tuck: distance by which feet are drawn up in the air.
        ahead: distance by which feet land ahead of their positions at rest.
        stretch: duration of the stretch.
        fly: duration from the stretch to the landing.
        sink: duration of the crouch.
    """

    crouch: float = 0.5
    back: float = 0.5
    forward: float = 0.3
    drive: float = 2.5
    tuck: float = 0.2
    ahead: float = 0.25
    stretch: float = 1.0
    fly: float = 2.0
    sink: float = 2.0


_JUMP = Leap(back=0.0, forward=0.0, ahead=0.0, sink=4.0)
_JUMPS = tuple(
    _JUMP._replace(crouch=crouch, drive=drive) for crouch in (0.2, 0.35, 0.5) for drive in (0.5, 1.0, 1.5, 2.5)
)
_JUMP_SLANTS = (0.0, -0.03, 0.03, -0.08, 0.08)  # standing heights ahead: tried in turn for a jump that stays
MIN_CLEARANCE = 0.1  # standing heights, of feet in a jump
MIN_DISTANCE = 0.8  # standing heights, of feet in a leap
_MIN_HEIGHT = fitting.HEALTHY_RANGE[0]  # standing heights; a torso that is lower in a jump has fallen, as in tasks
MAX_DRIFT = 0.1  # standing heights, between the mean positions of feet before a jump and after it

# Durations of a leap's parts that do not differ between leaps.
_WAITING_TIME = 0.5  # in the crouch
_SETTLING_TIME = 3.0  # after the landing

_STRETCH_GOAL = 0.6  # standing heights that the torso is to rise in the stretch: more than any legs can
_IK_ITERATIONS = 40  # of inverse kinematics, for each pose
_HORIZONTAL_WEIGHT = 0.45  # of a sole's position, against 1 for its height: feet may slide rather than stay behind

_DOES_NOT_LAND = "it does not land on its feet"

# What counts as a flight.
_AIRBORNE_HEIGHT = 0.03  # standing heights; soles that are higher have left the ground
_MIN_UPRIGHTNESS = 0.7  # cosine of the torso's tilt in a leap that lands
_MIN_FINAL_HEIGHT = 0.6  # of the torso, as a share of its height before the leap


class Movement(NamedTuple):
    """A leap of one body. Control steps count from 1.

    Attributes:
        sole_offsets: (steps, 3) offsets of soles from their positions at rest, in the torso's frame, m.
        joint_drive: (legs, links) added to the angles of the crouch while legs stretch, rad.
        crouch_end: control step at which the crouch ends.
        stretch_end: control step at which the stretch ends.
        landing_step: control step at which feet are to be on the ground.
    """

    sole_offsets: np.ndarray
    joint_drive: np.ndarray
    crouch_end: int
    stretch_end: int
    landing_step: int


def lay_out_movement(body: Body, legs: Legs, rest_angles: np.ndarray, leap: Leap) -> Movement:
    """Return the plan of a leap from a pose (legs, links), rad, in which soles are level."""
    standing_height = body.torso.standing_height
    steps_per_time_unit = time_unit(body) / control_timestep(body)

    def count_steps(duration: float) -> int:
        return max(1, round(steps_per_time_unit * duration))

    sinking_steps = count_steps(leap.sink)
    waiting_steps = count_steps(_WAITING_TIME)
    stretch_steps = count_steps(leap.stretch)
    flight_steps = count_steps(leap.fly)
    settling_steps = count_steps(_SETTLING_TIME)

    # Soles move against the torso: they come up to a torso that sinks, and are ahead of one that is drawn back.
    crouch_offset = np.array((leap.back, 0.0, leap.crouch))  # standing heights, as the next ones
    landing_offset = np.array((leap.ahead, 0.0, 0.0))
    stretch_offset = np.array((-leap.forward, 0.0, -_STRETCH_GOAL))
    sinking = _ease_in_and_out(sinking_steps) * crouch_offset
    crouching = np.tile(crouch_offset, (waiting_steps + stretch_steps, 1))
    flying = np.sin(np.pi * np.arange(1, flight_steps + 1) / flight_steps)[:, None] * (0.0, 0.0, leap.tuck)
    settling = (1.0 - _ease_in_and_out(settling_steps)) * landing_offset
    sole_offsets = np.concatenate([sinking, crouching, flying + landing_offset, settling])

    rest_soles, _ = legs.soles(rest_angles)

    def solve(start_angles: np.ndarray, offset: np.ndarray) -> np.ndarray:
        return _solve_leg_angles(legs, start_angles, rest_soles + offset * standing_height, standing_height)

    crouch_angles = solve(rest_angles, crouch_offset)
    stretch_angles = solve(crouch_angles, stretch_offset)
    crouch_end = sinking_steps + waiting_steps
    stretch_end = crouch_end + stretch_steps
    return Movement(
        sole_offsets=standing_height * sole_offsets,
        joint_drive=leap.drive * (stretch_angles - crouch_angles),
        crouch_end=crouch_end,
        stretch_end=stretch_end,
        landing_step=stretch_end + flight_steps,
    )


def sole_weights(leg_count: int) -> np.ndarray:
    """Return the weights (legs, 3, 3) of the errors of soles in inverse kinematics."""
    return np.tile(np.diag((_HORIZONTAL_WEIGHT, _HORIZONTAL_WEIGHT, 1.0)), (leg_count, 1, 1))


def _ease_in_and_out(steps: int) -> np.ndarray:
    """Return shares (steps, 1) of a motion that begins and ends slowly, the last of them 1."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(1, steps + 1) / steps)[:, None]


def _solve_leg_angles(legs: Legs, start_angles, sole_goals, standing_height: float) -> np.ndarray:
    """Return the angles (..., legs, links), rad, that bring soles near goals (..., legs, 3), m."""
    weights = sole_weights(len(legs.mounts))
    return legs.solve_joint_angles(
        start_angles, sole_goals, weights, posture.IK_DAMPING * standing_height, _IK_ITERATIONS
    )


def leap_targets(body: Body, legs: Legs, rest_angles: np.ndarray, leap: Leap) -> np.ndarray:
    """Return the targets (steps, joints) of joints in the control steps of a leap from a pose (legs, links), rad."""
    return follow_movement(body, legs, rest_angles, lay_out_movement(body, legs, rest_angles, leap))


def follow_movement(body: Body, legs: Legs, rest_angles: np.ndarray, movement: Movement) -> np.ndarray:
    """Return the targets (steps, joints) of joints in the control steps of a movement; see `leap_targets`."""
    rest_soles, _ = legs.soles(rest_angles)
    sole_goals = rest_soles + movement.sole_offsets[:, None]
    start_angles = np.tile(rest_angles, (len(sole_goals), 1, 1))
    angles = _solve_leg_angles(legs, start_angles, sole_goals, body.torso.standing_height)
    angles[movement.crouch_end : movement.stretch_end] += movement.joint_drive
    return legs.by_joint(angles)


class Flight(NamedTuple):
    """What a leap does to a body on level ground; lengths in standing heights.

    Attributes:
        distance: between the mean position of the feet before the leap and after it; 0 if they do not leave the ground.
        drift: horizontal distance between the mean positions of the feet before the leap and after it.
        torso_distance: distance that the torso moves while no foot is on the ground.
        air_time: time for which no foot is on the ground, s.
        clearance: the largest height of the lowest foot.
        lowest: the lowest height of the torso.
        rise: rise of the torso.
        landed: whether the torso stays upright, and is high enough at the end.
    """

    distance: float
    drift: float
    torso_distance: float
    air_time: float
    clearance: float
    lowest: float
    rise: float
    landed: bool

    @property
    def stays_high(self) -> bool:
        """Whether the torso never sinks as low as that of a body that has fallen."""
        return self.lowest > _MIN_HEIGHT

    @property
    def is_clear(self) -> bool:
        """Whether all feet leave the ground as far as in a jump."""
        return self.clearance >= MIN_CLEARANCE


def simulate_flights(
    body: Body, rest_angles: np.ndarray, targets: np.ndarray, crouch_ends: Sequence[int]
) -> list[Flight]:
    """Return what leaps do to a body, by simulation.

    Args:
        body: any.
        rest_angles: (joints,) angles from which leaps start, rad.
        targets: (leaps, steps, joints) targets of joints by control step, rad; the last one is held.
        crouch_ends: control step of each leap at which its crouch ends.
    """
    sized_body = size_body(body)
    track = _simulate_leaps(sized_body, rest_angles, targets)
    return [_measure_flight(sized_body, track, leap, crouch_end) for leap, crouch_end in enumerate(crouch_ends)]


class _Track(NamedTuple):
    """How bodies move in leaps.

    Attributes:
        torsos: (leaps, steps, 3) positions, m.
        uprightness: (leaps, steps) cosines of the torso's tilt.
        soles: (leaps, steps, legs, 3) positions, m.
    """

    torsos: np.ndarray
    uprightness: np.ndarray
    soles: np.ndarray


def _simulate_leaps(body: Body, rest_angles: np.ndarray, targets: np.ndarray) -> _Track:
    """Return how a sized body moves in several leaps, each in a simulation of its own; see `simulate_flights`."""
    model = compile_model(body)
    layout = readings.layout(model, body)
    rest_pose = pose_mechanics(body, rest_angles)
    joint_drive = drive(body, rest_pose.inertias)
    timestep = control_timestep(body)
    leap_count = len(targets)
    actuator_count = len(rest_angles)

    batch = Batch(model, leap_count, 1)
    data = batch.data
    every_leap = np.ones(leap_count, bool)
    start_height = -rest_pose.soles[:, 2].min()
    start_torso = (0.0, 0.0, start_height, *rotations.NO_TURN)  # position, m, and quaternion
    start_qpos = readings.positions(np.concatenate([start_torso, rest_angles]), layout, standing_qpos(model))
    batch.reset(every_leap, np.tile(start_qpos, (leap_count, 1)), np.zeros_like(data.qvel))

    foot_radii = np.array([leg.foot.radius for leg in body.legs])
    soles_below_feet = foot_radii[:, None] * (0.0, 0.0, 1.0)
    torsos = []
    uprightness = []
    soles = []
    for step in range(targets.shape[1] - 1):
        target_angles = targets[:, step]
        target_velocities = (targets[:, step + 1] - target_angles) / timestep
        joint_angles = readings.pose(data.qpos, layout)[:, 7:]
        joint_velocities = data.qvel[:, layout.joint_velocities]
        actions = joint_drive.actions(target_angles, target_velocities, joint_angles, joint_velocities)
        data.ctrl[:, :actuator_count] = actions
        batch.step(simulation(body).substeps, every_leap)
        torso = readings.pose(data.qpos, layout)[:, :7].copy()
        torsos.append(torso[:, :3])
        uprightness.append(rotations.upright(torso[:, 3:]))
        soles.append(data.xpos[:, layout.feet] - soles_below_feet)
    return _Track(np.stack(torsos, axis=1), np.stack(uprightness, axis=1), np.stack(soles, axis=1))


def _measure_flight(body: Body, track: _Track, leap: int, crouch_end: int) -> Flight:
    """Return the flight of a leap, by its index in a track."""
    standing_height = body.torso.standing_height
    torso = track.torsos[leap]
    soles = track.soles[leap]
    sole_heights = soles[crouch_end:, :, 2]  # from the end of the crouch on
    is_airborne = (sole_heights > _AIRBORNE_HEIGHT * standing_height).all(axis=-1)
    take_off = int(is_airborne.argmax())  # steps after the crouch, as the next one; 0 if feet stay on the ground
    steps_in_air = int(np.append(~is_airborne, True)[take_off:].argmax())
    first_step = crouch_end + take_off
    last_step = max(first_step + steps_in_air - 1, first_step)

    stays_upright = (track.uprightness[leap][crouch_end:] >= _MIN_UPRIGHTNESS).all()
    stands = torso[-1, 2] >= _MIN_FINAL_HEIGHT * torso[0, 2]
    distance = 0.0
    if is_airborne.any():
        foot_displacement = (soles[-1] - soles[crouch_end - 1])[:, 0].mean()
        distance = float(foot_displacement / standing_height)
    drift = np.linalg.norm((soles[-1] - soles[0])[:, :2].mean(axis=0))
    return Flight(
        distance=distance,
        drift=float(drift / standing_height),
        torso_distance=float((torso[last_step, 0] - torso[first_step, 0]) / standing_height),
        air_time=control_timestep(body) * steps_in_air,
        clearance=float(sole_heights.min(axis=-1).max() / standing_height),
        lowest=float(torso[:, 2].min() / standing_height),
        rise=float((torso[:, 2].max() - torso[0, 2]) / standing_height),
        landed=bool(stays_upright and stands),
    )


def find_best_leap(body: Body, rest_angles: tuple[float, ...], choice: tuple[Leap, ...]) -> tuple[Leap, Flight]:
    """Return the leap of a choice by which a body lands and gets farthest, and its flight.

    Args:
        body: any.
        rest_angles: (joints,) angles of a pose in which soles are level, rad.
        choice: leaps to try.
    """
    flights = _try_leaps(body, rest_angles, choice)
    distances = [flight.distance if flight.landed else 0.0 for flight in flights]
    best = distances.index(max(distances))
    return choice[best], flights[best]


def choose_leap(body: Body, rest_angles: tuple[float, ...], choice: tuple[Leap, ...]) -> Leap:
    """Return the leap of a choice by which a body gets farthest; see `find_best_leap`.

    Raises:
        ValueError: the body hardly leaves the ground, or does not land on its feet.
    """
    leap, flight = find_best_leap(body, rest_angles, choice)
    if not flight.landed:
        raise ValueError(_DOES_NOT_LAND)
    if flight.distance < MIN_DISTANCE:
        size = f"{flight.distance:.2f} standing heights"
        raise ValueError(f"the distance of its feet is {size}, less than {MIN_DISTANCE}")
    return leap


def choose_jump(body: Body, rest_angles: tuple[float, ...]) -> Leap:
    """Return a jump by which a body comes down on its feet where it stood; see `jumps_that_stay`.

    Raises:
        ValueError: there is none.
    """
    for jump in jumps_that_stay(body, rest_angles):
        return jump
    flights = []
    for slant in _JUMP_SLANTS:
        flights += _try_leaps(body, rest_angles, _slant_jumps(slant))
    raise ValueError(_why_no_jump(flights))


def jumps_that_stay(body: Body, rest_angles: tuple[float, ...]) -> Iterator[Leap]:
    """Yield jumps by which a body comes down on its feet where it stood, of one slant after the other.

    Args:
        body: any.
        rest_angles: (joints,) angles of a pose in which soles are level, rad.

    Yields:
        Jumps; of each slant the highest first.
    """
    for slant in _JUMP_SLANTS:
        jumps = _slant_jumps(slant)
        flights = _try_leaps(body, rest_angles, jumps)
        good_jumps = []
        for jump, flight in zip(jumps, flights, strict=True):
            if flight.landed and flight.stays_high and flight.is_clear and flight.drift <= MAX_DRIFT:
                good_jumps.append((flight.clearance, jump))
        for _, jump in sorted(good_jumps, reverse=True):
            yield jump


def _slant_jumps(slant: float) -> tuple[Leap, ...]:
    """Return the jumps that are tried, with legs that stretch the torso ahead by a slant."""
    return tuple(jump._replace(forward=slant) for jump in _JUMPS)


def _why_no_jump(flights: Sequence[Flight]) -> str:
    """Return what is wrong with jumps of which none is good: with that which is nearest to a good one."""
    landings = [flight for flight in flights if flight.landed]
    if not landings:
        return _DOES_NOT_LAND
    upright_landings = [flight for flight in landings if flight.stays_high]
    if not upright_landings:
        return f"its torso sinks to {_MIN_HEIGHT} standing heights or less"
    clear_flights = [flight for flight in upright_landings if flight.is_clear]
    if not clear_flights:
        clearance = max(flight.clearance for flight in upright_landings)
        return f"the clearance of its feet is {clearance:.2f} standing heights, less than {MIN_CLEARANCE}"
    return describe_drift(min(flight.drift for flight in clear_flights))


def describe_drift(drift: float) -> str:
    """Return what is wrong with a jump whose feet come down elsewhere."""
    return f"its feet come down {drift:.2f} standing heights from where they stood, more than {MAX_DRIFT}"


@functools.lru_cache(maxsize=64)
def _try_leaps(body: Body, rest_angles: tuple[float, ...], choice: tuple[Leap, ...]) -> list[Flight]:
    """Return the flights of leaps from angles (joints,), rad."""
    legs = Legs.of(size_body(body))
    leg_angles = legs.by_leg(np.array(rest_angles))
    movements = [lay_out_movement(body, legs, leg_angles, leap) for leap in choice]
    targets_of_leaps = [follow_movement(body, legs, leg_angles, movement) for movement in movements]
    crouch_ends = [movement.crouch_end for movement in movements]
    return simulate_flights(body, np.array(rest_angles), _pad_and_stack(targets_of_leaps), crouch_ends)


def _pad_and_stack(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays (steps, ...) as one; shorter ones repeat their last step."""
    step_count = max(len(array) for array in arrays)
    padded = []
    for array in arrays:
        missing_steps = np.tile(array[-1], (step_count - len(array), 1))
        padded.append(np.concatenate([array, missing_steps]))
    return np.stack(padded)
