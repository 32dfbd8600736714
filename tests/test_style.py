"""Style: recorded tracks, every metric on synthetic tracks with known answers, and the known ways to cheat."""

import functools
import math
import subprocess
import sys
import warnings

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import arc_suite
from arc_suite import evaluation, style
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.demonstrator import pattern
from arc_suite.cpg.law import joint_targets, torques
from arc_suite.cpg.presets import TUNINGS
from arc_suite.robots import ROBOTS
from arc_suite.robots.generator import generate
from arc_suite.style import METRICS, Track, measure, record
from arc_suite.style.metrics import phase_error
from arc_suite.style.tracks import lowest_point_velocities, mirrors
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


def value(name, track):
    return measure(track)[name].value


def legs(name, track):
    return list(measure(track)[name].legs.values())


def test_a_perfect_walk():
    values = {name: measurement.value for name, measurement in measure(synthetic()).items()}
    expected = dict.fromkeys(METRICS, 0.0)
    expected |= {"gait_compliance": 1.0, "duty_factor": 0.5, "stride_length": 0.4, "stride_frequency": 1.25}
    expected |= {"foot_clearance": CLEARANCE, "speed": 0.5}
    assert values == pytest.approx(expected, abs=1e-9)


def test_every_metric_states_its_definition_and_measures_robot_or_legs():
    by_leg = {name for name, measurement in measure(synthetic()).items() if measurement.legs}
    for name, metric in METRICS.items():
        assert metric.function.__name__ == name
        assert ("(feet,)" in metric.function.__doc__) == (name in by_leg)
        assert metric.unit in metric.function.__doc__
    assert all(tuple(measure(synthetic())[name].legs) == LEGS for name in by_leg)


def test_what_the_task_prescribes_is_what_a_perfect_walk_does():
    track = synthetic()
    prescribed = {name: metric.prescribed(track.parameters) for name, metric in METRICS.items() if metric.prescribed}
    assert list(prescribed) == [
        "gait_compliance",
        "duty_factor",
        "phase_error",
        "phase_scatter",
        "stride_length",
        "stride_frequency",
        "speed",
    ]
    assert prescribed == pytest.approx({name: value(name, track) for name in prescribed}, abs=1e-9)
    for change in ({"duty_factor": 1.0}, {"gait_frequency": 0.0}):
        assert math.isnan(METRICS["stride_length"].prescribed(track.parameters._replace(**change)))


def test_a_report_sums_tracks_up():
    figures = style.report([synthetic(), synthetic(speed=0.25, dragged=1)])
    assert figures["return"].mean == 1.5 * 160
    assert figures["length"].mean == 160
    speed = figures["metrics"]["speed"]
    assert (speed["unit"], speed["prescribed"], speed["legs"]) == ("m/s", 0.5, {})
    assert speed["robot"].mean == pytest.approx(0.375)
    duty = figures["metrics"]["duty_factor"]
    assert duty["prescribed"] == 0.5
    assert {leg: summary.mean for leg, summary in duty["legs"].items()} == dict.fromkeys(LEGS, 0.5) | {"fr": 0.75}
    assert figures["metrics"]["foot_slip"]["prescribed"] is None


def test_gait_compliance_counts_steps():
    # Two steps late: two wrong at touchdown and two at lift-off, of sixteen.
    assert_allclose(legs("gait_compliance", synthetic(late=(0, 2, 0, 8))), [1.0, 0.75, 1.0, 0.0])


def test_duty_factor_is_the_share_in_stance():
    assert_allclose(legs("duty_factor", synthetic(dragged=2)), [0.5, 0.5, 1.0, 0.5])
    half_up = synthetic()
    half_up.foot_positions[:80, 0, 2] = 0.2
    assert_allclose(legs("duty_factor", half_up)[0], 0.25)


def test_phase_error_is_circular_and_signed():
    assert_allclose(legs("phase_error", synthetic(late=(2, -4, 7, 18))), [2 / 16, -4 / 16, 7 / 16, 2 / 16])
    assert_allclose(abs(legs("phase_error", synthetic(late=(8, 0, 0, 0)))[0]), 0.5)
    assert_allclose(value("phase_error", synthetic(late=(2, -2, 2, -2))), 2 / 16)  # of sizes: they do not cancel


def test_phase_error_needs_a_rhythm():
    errors = legs("phase_error", synthetic(dragged=1))
    assert_array_equal(np.isnan(errors), [False, True, False, False])
    other = synthetic(cycles=15)
    faster = 1.4 * TWO_PI * (np.arange(15 * CYCLE) + 0.5) / CYCLE  # a clock of 21 cycles in the same time
    assert np.isnan(phase_error(other._replace(phases=faster % TWO_PI))).all()
    never = other.parameters._replace(duty_factor=0.0)  # a schedule without stance has no middle of it
    assert np.isnan(phase_error(other._replace(parameters=never))).all()


def test_phase_scatter_ignores_a_common_lag():
    assert value("phase_scatter", synthetic(late=(3, 3, 3, 3))) == pytest.approx(0.0, abs=1e-12)
    assert value("phase_scatter", synthetic(late=(0, 8, 8, 0))) == pytest.approx(1.0)
    assert value("phase_scatter", synthetic(late=(0, 4, 0, 4))) == pytest.approx(1.0 - math.sqrt(0.5))


def test_stride_length_and_frequency():
    track = synthetic(speed=0.25)
    assert_allclose(legs("stride_length", track), 0.2)
    assert_allclose(legs("stride_frequency", track), 1.25)
    assert_allclose(legs("stride_length", synthetic(course=math.pi / 3)), 0.2)  # the part along x
    assert_allclose(legs("stride_frequency", track._replace(time_step=0.1)), 0.625)
    assert_array_equal(np.isnan(legs("stride_length", synthetic(dragged=3))), [False, False, False, True])
    assert_array_equal(np.isnan(legs("stride_frequency", synthetic(cycles=1))), True)


def test_a_foot_that_bounces_in_stance_does_not_stride():
    track, bounced = synthetic(speed=0.25), synthetic(speed=0.25)
    standing = np.flatnonzero(bounced.stance[:, 0]).reshape(-1, 8)
    bounced.foot_positions[standing[:, 3], 0, 2] = RADIUS + 0.49 * CLEARANCE  # over the stance threshold
    assert legs("duty_factor", bounced)[0] < 0.5
    for name in ("stride_length", "stride_frequency"):
        assert_allclose(legs(name, bounced), legs(name, track))
    bounced.foot_positions[standing[:, 3], 0, 2] = RADIUS + 0.51 * CLEARANCE  # which is a step of its own
    assert_allclose(legs("stride_frequency", bounced)[0], 2 * 1.25, rtol=0.05)


def test_foot_slip():
    # Half of the time at 0.1 m/s, while the torso moves on at 0.5 m/s: 0.1 m a metre.
    steps = 10 * CYCLE
    assert_allclose(legs("foot_slip", synthetic(slip=0.1)), 0.1 * steps / (steps - 1))
    assert_allclose(legs("foot_slip", synthetic(dragged=0)), [steps / (steps - 1), 0, 0, 0])
    assert_allclose(legs("foot_slip", synthetic(slip=0.1, course=2.0)), legs("foot_slip", synthetic(slip=0.1)))
    assert_array_equal(legs("foot_slip", synthetic(slip=0.1, speed=0.0)), np.inf)


def test_foot_clearance_is_the_mean_over_cycles_of_the_highest_lift():
    track = synthetic()
    swings = np.flatnonzero(~track.stance[:, 0]).reshape(10, 8)
    for cycle, rows in enumerate(swings):
        track.foot_positions[rows[3], 0, 2] = RADIUS + 0.10 + 0.01 * cycle
    # The first and the last cycle, which a track may cut short, do not count.
    assert_allclose(legs("foot_clearance", track)[:2], [0.10 + 0.01 * 4.5, CLEARANCE])
    assert_allclose(legs("foot_clearance", synthetic(dragged=1)), [CLEARANCE, 0.0, CLEARANCE, CLEARANCE])
    assert_allclose(legs("foot_clearance", synthetic(cycles=1)), CLEARANCE)


def test_course():
    left, back = synthetic(course=math.pi / 2), synthetic(course=math.pi)
    assert value("speed", left) == pytest.approx(0.0, abs=1e-12)
    assert value("speed", back) == pytest.approx(-0.5)
    assert value("lateral_drift", left) == pytest.approx(1.0)
    assert value("lateral_drift", back) == pytest.approx(0.0, abs=1e-12)
    assert value("lateral_drift", synthetic(course=-math.pi / 6)) == pytest.approx(0.5)
    assert value("heading_error", left) == 0.0
    assert value("heading_error", synthetic(facing=-0.3)) == pytest.approx(0.3)
    assert value("heading_error", synthetic(facing=math.pi)) == pytest.approx(math.pi)


def test_pitch_and_roll_are_those_of_the_torsos_own_axes():
    half = 0.1
    pitch, roll = (math.cos(half), 0.0, math.sin(half), 0.0), (math.cos(half), math.sin(half), 0.0, 0.0)
    yawed = (math.cos(0.5), 0.0, 0.0, math.sin(0.5))
    for quaternion, expected in ((pitch, (0.2, 0.0)), (roll, (0.0, 0.2)), (yawed, (0.0, 0.0))):
        track = synthetic()
        track.quaternions[:] = quaternion
        assert (value("torso_pitch", track), value("torso_roll", track)) == pytest.approx(expected, abs=1e-9)
    combined = np.empty(4)
    mujoco.mju_mulQuat(combined, np.array(yawed), np.array(pitch))
    track = synthetic()
    track.quaternions[: 5 * CYCLE] = combined  # level for the other half
    assert value("torso_pitch", track) == pytest.approx(0.2 * math.sqrt(0.5))
    assert value("heading_error", track) == pytest.approx(0.5)


def test_height_variation():
    track = synthetic()
    track.positions[::2, 2] += 0.02
    assert value("height_variation", track) == pytest.approx(0.01)


def test_posture_deviation_is_from_the_standing_pose():
    track = synthetic()
    standing = np.arange(8) / 10
    track.joint_angles[:] = standing
    track.joint_angles[:, 2:4] += (0.3, -0.4)
    track = track._replace(parameters=track.parameters._replace(default_angles=standing))
    assert_allclose(legs("posture_deviation", track), [0.0, math.sqrt(0.125), 0.0, 0.0], atol=1e-12)


def test_action_change_and_torque():
    track = synthetic(cycles=1)
    track.actions[:, 0] = np.where(np.arange(CYCLE) % 2, 0.5, -0.5)
    track.torques[:, 6:] = (3.0, -4.0)
    squares = (0.5**2 + 15 * 1.0**2) / CYCLE  # the first change is from 0
    assert_allclose(legs("action_change", track), [math.sqrt(squares / 2), 0, 0, 0])
    assert_allclose(legs("torque", track), [0, 0, 0, math.sqrt(12.5)])


def test_legs_with_different_numbers_of_joints():
    track = synthetic()._replace(joint_legs=np.array([0, 1, 1, 2, 2, 2, 3, 3]))
    track.torques[:] = np.arange(8)
    expected = [0, math.sqrt((1 + 4) / 2), math.sqrt((9 + 16 + 25) / 3), math.sqrt((36 + 49) / 2)]
    assert_allclose(legs("torque", track), expected)


def test_asymmetry():
    for track in (synthetic(late=(3, 3, 3, 3)), synthetic(course=0.7, facing=0.7)):
        assert_allclose(legs("asymmetry", track), 0.0, atol=1e-9)
    track = synthetic()
    track.foot_positions[:, 0, 1] += 0.05  # the left foot stands 5 cm wider than the right
    assert_allclose(legs("asymmetry", track), [0.05, 0.05, 0.0, 0.0], atol=1e-9)
    track = track._replace(mirrors=np.array([-1, -1, 3, 2]))
    assert_array_equal(np.isnan(legs("asymmetry", track)), [True, True, False, False])
    assert value("asymmetry", track) == pytest.approx(0.0, abs=1e-9)


def test_cost_of_transport_counts_positive_work():
    track = synthetic(cycles=2)
    steps = np.arange(len(track.positions))
    track.joint_angles[:, 0], track.torques[:, 0] = 0.1 * steps, 2.0  # drives: 0.2 J a step
    track.joint_angles[:, 1], track.torques[:, 1] = -0.1 * steps, 5.0  # brakes: does not count
    metres_a_step = 0.5 * DT
    assert value("cost_of_transport", track) == pytest.approx(0.2 / (2.0 * 10.0 * metres_a_step))
    assert value("cost_of_transport", track._replace(positions=0 * track.positions)) == math.inf


@pytest.mark.parametrize("steps", [1, 2, 5])
def test_short_tracks_have_values_or_nan_but_no_errors(steps):
    whole = synthetic()
    rows = {
        name: array[:steps]
        for name, array in whole._asdict().items()
        if isinstance(array, np.ndarray) and len(array) == len(whole.positions)
    }
    track = whole._replace(**rows, terms={"forward": np.ones(steps)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measured = measure(track)
    assert measured["gait_compliance"].value == 1.0
    assert math.isnan(measured["stride_length"].value)


# The known ways to cheat.


class Scripted:
    """A demonstrator that cheats: `stand`, `hop` with all feet at once, `drag` the first leg, or walk `back`."""

    def __init__(self, robot, cheat):
        body, self.tuning, self.cheat = ROBOTS[robot], TUNINGS[robot], cheat
        honest = pattern(body, self.tuning, self.tuning.presets["medium"])
        changes = {"hop": {"offset": 0.0 * honest.offset}, "back": {"sweep": -honest.sweep}}
        self.pattern = honest._replace(**changes.get(cheat, {}))
        self.limp = len(body.legs[0].joints)

    def __call__(self, timestep):
        self.clock = 0 if timestep.first() else self.clock + 1
        angles, velocities = timestep.observation["posture"][5:], timestep.observation["velocities"][6:]
        targets = joint_targets(self.pattern, np.float64(DT * self.clock))
        if self.cheat == "stand":
            targets = 0.0 * targets
        action = torques(targets, angles, velocities, self.tuning.stiffness, self.tuning.damping)
        if self.cheat == "drag":
            action[: self.limp] = 0.0
        return action


@functools.cache
def measured(robot, cheat=None):
    policy = Scripted(robot, cheat) if cheat else Demonstrator(robot)
    return measure(record(arc_suite.load(robot, "walk"), policy, seed=0, max_steps=400))


@pytest.mark.parametrize("robot", ROBOTS)
def test_standing_still_shows(robot):
    honest, cheat = measured(robot), measured(robot, "stand")
    assert cheat["gait_compliance"].value > 0.55  # which alone would not tell
    assert abs(cheat["speed"].value) < 0.01 < 0.3 < honest["speed"].value
    assert math.isnan(cheat["stride_length"].value)
    assert cheat["duty_factor"].value > 0.99 > 0.8 > honest["duty_factor"].value
    assert cheat["foot_clearance"].value < 0.25 * honest["foot_clearance"].value
    assert cheat["foot_slip"].value == cheat["cost_of_transport"].value == math.inf


@pytest.mark.parametrize("robot", ROBOTS)
def test_hopping_shows(robot):
    honest, cheat = measured(robot), measured(robot, "hop")
    assert cheat["asymmetry"].value > 10 * honest["asymmetry"].value
    assert cheat["foot_slip"].value > 4 * honest["foot_slip"].value
    # Ideal hops, with all feet in the air at once, are a gait of their own.
    hop = measure(synthetic(offsets=(0, 0, 0, 0)))
    assert hop["phase_scatter"].value == pytest.approx(1.0)
    assert honest["phase_scatter"].value < 0.5
    assert hop["gait_compliance"].value == 0.5


@pytest.mark.parametrize("robot", ROBOTS)
def test_dragging_one_leg_shows(robot):
    honest, cheat = measured(robot), measured(robot, "drag")
    leg = ROBOTS[robot].legs[0].name
    assert cheat["asymmetry"].legs[leg] > 20 * honest["asymmetry"].legs[leg]
    assert cheat["torque"].legs[leg] == cheat["action_change"].legs[leg] == 0.0
    drag = measure(synthetic(dragged=0))
    assert drag["foot_slip"].legs["fl"] > 1.0 > 0.3 > max(honest["foot_slip"].legs.values())
    assert drag["foot_clearance"].legs["fl"] == pytest.approx(0.0)
    assert drag["asymmetry"].legs["fl"] > 0.05


@pytest.mark.parametrize("robot", ROBOTS)
def test_walking_backwards_shows(robot):
    honest, cheat = measured(robot), measured(robot, "back")
    assert cheat["speed"].value < -0.1 < 0.3 < honest["speed"].value
    assert cheat["stride_length"].value < -0.05 < 0.1 < honest["stride_length"].value
    turned = measure(synthetic(course=0.0, facing=math.pi))  # tail first along the way
    assert turned["heading_error"].value > 3.0 > 0.5 > honest["heading_error"].value


@pytest.mark.parametrize("robot", ROBOTS)
def test_walking_sideways_shows(robot):
    honest = measured(robot)
    to_the_side = measure(synthetic(course=math.pi / 2))
    assert to_the_side["lateral_drift"].value > 0.99 > 0.4 > honest["lateral_drift"].value
    assert abs(to_the_side["speed"].value) < 1e-9
    crab = measure(synthetic(facing=math.pi / 2))
    assert crab["heading_error"].value > 1.5 > 0.5 > honest["heading_error"].value


# Recording.


@pytest.mark.parametrize("robot", ROBOTS)
def test_tracks_agree_with_the_reward(robot):
    environment = arc_suite.load(robot, "walk", {"time_limit": 5.0})
    track = record(environment, Demonstrator(robot), seed=3)
    episode = evaluation.run(environment, Demonstrator(robot), seed=3)
    assert len(track.times) == episode.length == 100
    assert track.times[-1] == pytest.approx(5.0)
    assert track.rewards.sum() == pytest.approx(episode.total, rel=1e-12)
    results = measure(track)
    assert results["gait_compliance"].value == pytest.approx(track.terms["gait_bonus"].mean(), rel=1e-12)
    joints = track.actions.shape[1]
    for metric, term in (("action_change", "smoothness"), ("posture_deviation", "posture")):
        squares = np.array(list(results[metric].legs.values())) ** 2
        assert squares.mean() * joints == pytest.approx(track.terms[term].mean(), rel=1e-12)
    assert_allclose(track.terms["vertical_velocity"], track.linear_velocities[:, 2] ** 2)
    assert_allclose(track.terms["angular_velocity"], (track.angular_velocities[:, :2] ** 2).sum(axis=1))
    assert_array_equal(track.joint_velocities[-1], environment.physics.data.qvel[6:])
    gears = environment.physics.model.ptr.actuator_gear[:, 0]
    assert_allclose(track.torques, track.actions * gears)
    assert track.mass == pytest.approx(
        {"queen": 12.0866, "bastion": 5.3677, "leaper": 0.2224, "tick": 0.0814}[robot], 1e-3
    )
    assert 0.05 < track.contacts.mean() < 0.95
    assert (track.foot_positions[track.contacts][:, 2] < track.foot_radii[0] + 0.011).all()  # within the contact margin


def test_recording_is_seeded():
    environment = arc_suite.load("leaper", "walk", {"time_limit": 1.0})
    first, second, other = (record(environment, Demonstrator("leaper"), seed) for seed in (1, 1, 2))
    assert_array_equal(first.foot_velocities, second.foot_velocities)
    assert (first.positions != other.positions).all()


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_leg_has_its_mirror(robot):
    across = {"l": "r", "r": "l"}
    names = [leg.name for leg in ROBOTS[robot].legs]
    for name, mirror in zip(names, mirrors(ROBOTS[robot]), strict=True):
        expected = name[0] + across[name[1]] if robot == "leaper" else across[name[0]] + name[1]
        assert names[mirror] == expected


def test_legs_without_a_mirror():
    left = ROBOTS["queen"].replace(legs=ROBOTS["queen"].legs[:4])  # l1 l2 l3 r1
    assert_array_equal(mirrors(left), [3, -1, -1, 0])


def test_velocities_of_lowest_points_are_their_motion():
    environment = arc_suite.load("queen", "walk", {"random": 0})
    environment.reset()
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    data.qvel[:] = np.random.default_rng(0).normal(size=model.nv)
    mujoco.mj_forward(model, data)
    feet = [model.body(name).id for name in ROBOTS["queen"].foot_names]
    radii = np.full(6, 0.05)
    velocities = lowest_point_velocities(model, data, feet, radii)
    before = [data.xpos[foot] + (0, 0, -0.05) for foot in feet]
    fixed = [data.xmat[foot].reshape(3, 3).T @ (0, 0, -0.05) for foot in feet]
    mujoco.mj_integratePos(model, data.qpos, data.qvel, 1e-6)
    mujoco.mj_kinematics(model, data)
    after = [data.xpos[foot] + data.xmat[foot].reshape(3, 3) @ point for foot, point in zip(feet, fixed, strict=True)]
    assert_allclose(velocities, (np.array(after) - before) / 1e-6, atol=1e-4)


# Pictures.


@pytest.mark.parametrize("count", [1, 2])
def test_pictures(tmp_path, count):
    from arc_suite.style.pictures import PICTURES

    tracks = {"left": synthetic(late=(0, 2, 0, 0)), "right": synthetic(course=math.pi / 2, dragged=0)}
    tracks = dict(list(tracks.items())[:count])
    assert list(PICTURES) == ["gait", "reward", "speed", "path"]
    for name, draw in PICTURES.items():
        draw(tracks).savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000


def test_gait_diagram_shows_stance_and_schedule():
    from matplotlib.colors import to_hex

    from arc_suite.style.pictures import BLUE, PALE, VERMILION, gait

    track = synthetic(late=(0, 4, 0, 0))
    (axis,) = gait({"a": track}).axes
    seconds = dict.fromkeys((PALE, BLUE, VERMILION), 0.0)
    for bars in axis.collections:
        if bars.get_paths():
            widths = [np.ptp(bar.vertices[:, 0]) for bar in bars.get_paths()]
            seconds[to_hex(bars.get_facecolor()[0]).upper()] += sum(widths)
    # Four seconds are five cycles of 16 steps; each of four feet shall stand for 8 of them, one is 4 late.
    assert seconds == pytest.approx({PALE: 20 * 8 * DT, BLUE: (20 * 8 - 5 * 4) * DT, VERMILION: 5 * 4 * DT})
    texts = [text.get_text() for text in axis.texts]
    assert "50 %" in texts
    assert "+0.25 cycles" in texts
    assert "duty factor\n(0.50 wanted)" in texts


def test_pictures_of_a_track_of_one_step():
    from arc_suite.style.pictures import PICTURES

    track = record(arc_suite.load("tick", "walk"), Demonstrator("tick"), seed=0, max_steps=1)
    for draw in PICTURES.values():
        draw({"a": track})


def test_metrics_come_without_matplotlib():
    code = "import sys, arc_suite.style; print('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"


def test_package_exports():
    assert style.__all__ == [
        "METRICS",
        "Source",
        "Track",
        "load",
        "measure",
        "record",
        "report",
        "save",
        "source",
    ]
