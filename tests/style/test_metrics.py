"""Metrics of style, each on synthetic tracks with known answers."""

import math
import warnings

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from synthetic import CLEARANCE, CYCLE, DT, LEGS, RADIUS, TWO_PI, synthetic

from arc_suite import style
from arc_suite.bodies.generator import generate
from arc_suite.envs.setup import Setup
from arc_suite.style import METRICS, measure
from arc_suite.style.metrics import phase_error
from arc_suite.style.tracks import UNTIMED


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


def test_a_metric_measures_the_robot_or_every_leg():
    assert {tuple(measurement.legs) for measurement in measure(synthetic()).values()} == {(), LEGS}


def test_what_the_task_prescribes_is_what_a_perfect_walk_does():
    track = synthetic()
    prescribed = {name: metric.prescribed(track) for name, metric in METRICS.items() if metric.prescribed}
    names = "gait_compliance duty_factor phase_error phase_scatter stride_length stride_frequency speed"
    assert list(prescribed) == names.split()
    assert prescribed == pytest.approx({name: value(name, track) for name in prescribed}, abs=1e-9)
    for change in ({"duty_factor": 1.0}, {"gait_frequency": 0.0}):
        changed = track._replace(parameters=track.parameters._replace(**change))
        assert math.isnan(METRICS["stride_length"].prescribed(changed))
    steering = track._replace(target_velocity=math.nan)  # no velocity is asked for all the time
    asked = {name for name, metric in style.report([steering])["metrics"].items() if metric["prescribed"] is not None}
    assert asked == set(prescribed) - {"speed", "stride_length"}


def test_a_report_has_the_mean_of_what_episodes_prescribe():
    slow, fast = synthetic()._replace(seed=7), synthetic()._replace(seed=9, target_velocity=0.9)
    figures = style.report([slow, fast])
    assert figures["seeds"] == [7, 9]
    assert figures["metrics"]["speed"]["prescribed"] == pytest.approx(0.7)
    assert figures["metrics"]["duty_factor"]["prescribed"] == 0.5


def test_a_report_sums_tracks_up():
    figures = style.report([synthetic(), synthetic(speed=0.25, dragged=1)])
    assert figures["return"].mean == 1.5 * 160
    assert figures["length"].mean == 160
    speed = figures["metrics"]["speed"]
    assert (speed["unit"], speed["prescribed"], speed["legs"]) == ("m/s", 0.5, {})
    assert speed["robot"].mean == pytest.approx(0.375)
    duty = figures["metrics"]["duty_factor"]
    assert duty["prescribed"] == 0.5
    assert {leg: summary.mean for leg, summary in duty["legs"].items()} == dict.fromkeys(LEGS, 0.5) | {"r1": 0.75}
    assert figures["metrics"]["foot_slip"]["prescribed"] is None
    assert figures["progress"].keys() == {"speed"}
    assert figures["progress"]["speed"].mean == pytest.approx(0.375)


def test_heights_are_over_the_ground():
    level, track = measure(synthetic(slip=0.1)), synthetic(slip=0.1)
    hill = 0.3 * track.positions[:, 0]
    raised = track._replace(
        positions=track.positions + hill[:, None] * (0, 0, 1),
        foot_positions=track.foot_positions + hill[:, None, None] * (0, 0, 1),
    )
    for name, measurement in measure(raised).items():
        if name != "asymmetry":  # which is of paths in the torso's frame
            assert measurement.value == pytest.approx(level[name].value, rel=0.05), name


def without_gait(track):
    return track._replace(**UNTIMED, parameters=None, target_velocity=math.nan)


def test_a_task_without_a_gait_has_the_other_metrics():
    track = synthetic(slip=0.1)
    of_gait = {name for name, metric in METRICS.items() if metric.of_gait}
    measured, bare = measure(track), measure(without_gait(track))
    assert bare == {name: measurement for name, measurement in measured.items() if name not in of_gait}
    names = "foot_slip speed heading_error lateral_drift torso_pitch torso_roll height_variation action_change"
    assert list(bare) == [*names.split(), "torque", "cost_of_transport"]
    figures = style.report([without_gait(track)])
    assert figures["metrics"].keys() == bare.keys()
    assert {metric["prescribed"] for metric in figures["metrics"].values()} == {None}


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
    assert np.isnan(phase_error(other._replace(leg_phases=faster[:, None] + other.parameters.phase_offsets))).all()
    never = other._replace(duty_factors=np.zeros(15 * CYCLE))  # a schedule without stance has no middle of it
    assert np.isnan(phase_error(never)).all()


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
    # Half of the time at 0.1 m/s, while the torso moves on at 0.5 m/s: 0.1 m a meter.
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


def with_legs(track, *bodies):
    """The track of a body whose legs are those of the same names of other bodies."""
    legs = [next(leg for leg in body.legs if leg.name == name) for body, name in zip(bodies, LEGS, strict=True)]
    return track._replace(setup=Setup(track.body.replace(legs=tuple(legs))))


def test_legs_with_different_numbers_of_joints():
    track = with_legs(synthetic(), *(generate(4, links) for links in (1, 2, 3, 2)))
    track.torques[:] = np.arange(8)
    expected = [0, math.sqrt((1 + 4) / 2), math.sqrt((9 + 16 + 25) / 3), math.sqrt((36 + 49) / 2)]
    assert_allclose(legs("torque", track), expected)


def test_asymmetry():
    for track in (synthetic(late=(3, 3, 3, 3)), synthetic(course=0.7, facing=0.7)):
        assert_allclose(legs("asymmetry", track), 0.0, atol=1e-9)
    track = synthetic()
    track.foot_positions[:, 0, 1] += 0.05  # the left foot stands 5 cm wider than the right
    assert_allclose(legs("asymmetry", track), [0.05, 0.05, 0.0, 0.0], atol=1e-9)
    track = with_legs(track, generate(6, 2), *[generate(4, 2)] * 3)  # the left one stands elsewhere than the right
    assert_array_equal(np.isnan(legs("asymmetry", track)), [True, True, False, False])
    assert value("asymmetry", track) == pytest.approx(0.0, abs=1e-9)


def test_cost_of_transport_counts_positive_work():
    track = synthetic(cycles=2)
    steps = np.arange(len(track.positions))
    track.joint_angles[:, 0], track.torques[:, 0] = 0.1 * steps, 2.0  # drives: 0.2 J a step
    track.joint_angles[:, 1], track.torques[:, 1] = -0.1 * steps, 5.0  # brakes: does not count
    meters_a_step = 0.5 * DT
    assert value("cost_of_transport", track) == pytest.approx(0.2 / (2.0 * 10.0 * meters_a_step))
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
