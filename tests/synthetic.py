"""Synthetic tracks: a trot that holds its schedule, and how it may go wrong."""

import math

import numpy as np

from arc_suite.robots.generator import generate
from arc_suite.style import Track
from arc_suite.tasks.rewards import Parameters

TWO_PI = 2.0 * math.pi
DT = 0.05
CYCLE = 16  # control steps
LEGS = ("fl", "fr", "rl", "rr")
HOMES = np.array([(0.2, 0.3), (0.2, -0.3), (-0.2, 0.3), (-0.2, -0.3)])
RADIUS, CLEARANCE, HEIGHT = 0.05, 0.07, 0.4
OFFSETS = np.array([0.0, 0.5, 0.5, 0.0])  # cycles: a trot


def synthetic(cycles=10, speed=0.5, course=0.0, facing=0.0, late=(0, 0, 0, 0), slip=0.0, offsets=OFFSETS, dragged=None):
    """A trot that holds its schedule exactly, but for what the arguments change.

    A foot stands still for half of the cycle, 8 steps, and jumps up by CLEARANCE to be carried
    forward for the other half.

    Args:
        cycles: how many, of 16 steps or 0.8 s each.
        speed: m/s along the course.
        course: direction of travel from world x, rad.
        facing: yaw of the torso, rad.
        late: steps by which each foot lags behind the schedule.
        slip: m/s at which standing feet slide sideways, as far as velocities tell.
        offsets: of the legs, cycles, in what is done; what is prescribed stays a trot.
        dragged: index of a leg that lies on the ground and is pulled along.
    """
    steps = np.arange(cycles * CYCLE)
    clock = (steps + 0.5) / CYCLE  # samples lie amid steps of the schedule
    own = clock[:, None] + np.asarray(offsets) - np.asarray(late) / CYCLE
    stance = own % 1.0 < 0.5
    way = speed * DT * (steps + 0.5)
    stride = speed * DT * CYCLE
    # A foot stands where the torso is in mid-stance, a quarter of a cycle after touchdown.
    stands = (np.floor(own) + 0.25 - np.asarray(offsets) + np.asarray(late) / CYCLE) * stride
    along = np.where(stance, stands, stands + stride * 2.0 * (own % 1.0 - 0.5))
    velocities = np.zeros((len(steps), 4, 3))
    velocities[..., 0] = np.where(stance, 0.0, 2.0 * speed)
    velocities[..., 1] = np.where(stance, slip, 0.0)
    if dragged is not None:
        stance[:, dragged], along[:, dragged], velocities[:, dragged, 0] = True, way, speed
    feet = np.empty((len(steps), 4, 3))
    feet[..., 0] = along + HOMES[:, 0]
    feet[..., 1] = HOMES[:, 1]
    feet[..., 2] = RADIUS + np.where(stance, 0.0, CLEARANCE)
    positions = np.stack([way, 0.0 * way, np.full_like(way, HEIGHT)], axis=-1)
    quaternion = (math.cos(facing / 2), 0.0, 0.0, math.sin(facing / 2))
    return Track(
        body=generate(4, 2),
        seed=0,
        time_step=DT,
        positions=positions @ about_z(course).T,
        quaternions=np.tile(quaternion, (len(steps), 1)),
        linear_velocities=np.tile(about_z(course) @ (speed, 0.0, 0.0), (len(steps), 1)),
        angular_velocities=np.zeros((len(steps), 3)),
        joint_angles=np.zeros((len(steps), 8)),
        joint_velocities=np.zeros((len(steps), 8)),
        actions=np.zeros((len(steps), 8)),
        torques=np.zeros((len(steps), 8)),
        foot_positions=feet @ about_z(course).T,
        foot_velocities=velocities @ about_z(course).T,
        contacts=stance,
        phases=clock % 1.0 * TWO_PI,
        terms={"forward": np.ones(len(steps))},
        weights={"forward": 1.5},
        parameters=Parameters(
            target_velocity=0.5,
            velocity_band=0.3,
            gait_frequency=1.0 / (DT * CYCLE),
            duty_factor=0.5,
            phase_offsets=TWO_PI * OFFSETS,
            stance_threshold=0.08,
            healthy_range=(0.1, 1.0),
            default_angles=np.zeros(8),
        ),
        mass=2.0,
        gravity=10.0,
        legs=LEGS,
        joint_legs=np.repeat(range(4), 2),
        mirrors=np.array([1, 0, 3, 2]),
        foot_radii=np.full(4, RADIUS),
    )


def about_z(angle):
    return np.array([(math.cos(angle), -math.sin(angle), 0), (math.sin(angle), math.cos(angle), 0), (0, 0, 1)])


def assert_same(left, right):
    """Two values are equal to the bit and of one type, and so is all that is in them, in its order."""
    assert type(left) is type(right)
    if isinstance(left, np.ndarray):
        assert (left.dtype, left.shape, left.tobytes()) == (right.dtype, right.shape, right.tobytes())
        return
    left, right = (value._asdict() if hasattr(value, "_asdict") else value for value in (left, right))
    if isinstance(left, dict):
        assert list(left) == list(right)
        for name in left:
            assert_same(left[name], right[name])
    else:
        assert left == right
