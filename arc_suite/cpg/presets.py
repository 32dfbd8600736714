"""The demonstrators' numbers, by robot and preset."""

import functools
from collections.abc import Mapping
from typing import NamedTuple

from arc_suite.robots.gaits import TRIPOD, TROT

# An angle in degrees for all legs, or one for each rank: front, (middle,) rear.
ByRank = float | tuple[float, ...]


class Bend(NamedTuple):
    """How far a joint departs from its centre in mid-stance and in mid-swing, degrees."""

    stance: ByRank
    swing: ByRank


class Preset(NamedTuple):
    """One way to walk.

    Attributes:
        stiffness: action per rad of error (kp).
        damping: action per rad/s (kd).
        settle: first control steps, in which the robot crouches.
        ramp: control steps over which the stiffness grows linearly to its full value.
        ramp_start: share of the stiffness at the first step.
        frequency: of the cycle, Hz.
        duty_factor: share of the cycle spent in stance.
        phase_offsets: of the legs, cycles.
        sweep: half of the hip's sweep, degrees.
        centre: angles about which joints move, degrees, by joint; a hip's is positive forwards and
            0 if it is not there.
        bends: of the other joints, by name.
        crouch: angles held while settling, as `centre`; None for the centre. Legs drawn up catch a
            robot that a reset with its feet in the ground has thrown.
        torques: actions that are added whatever the error is, by joint and for each rank: amplitudes of
            the cosines of the leg's phase and its multiples, then of their sines; a hip's positive
            forwards. None for none.
        steering: action of the hips per rad of yaw, times the cosine of the leg's phase; the same sign
            left and right, so that a negative one turns back to where the robot started.
    """

    stiffness: float
    damping: float
    settle: int
    ramp: float
    ramp_start: float
    frequency: float
    duty_factor: float
    phase_offsets: tuple[float, ...]
    sweep: ByRank
    centre: Mapping[str, ByRank]
    bends: Mapping[str, Bend]
    crouch: Mapping[str, ByRank] | None = None
    torques: Mapping[str, tuple[tuple[float, ...], ...]] | None = None
    steering: float = 0.0


SPEEDS = ("slow", "medium", "fast")  # the published ones
PRESETS = (*SPEEDS, "tuned", "refined", "steered", "surefooted", "sighted", "planned", "balanced")

_hexapod = functools.partial(Preset, stiffness=0.8, settle=15, ramp=20, ramp_start=0.3, phase_offsets=TRIPOD)
_queen = functools.partial(
    _hexapod, damping=0.18, frequency=1.5, centre={"knee": (-25, -25, 25), "ankle": (15, 30, -15)}
)
_bastion = functools.partial(_hexapod, damping=0.15, centre={"ankle": 30})
_tick = functools.partial(_hexapod, damping=0.18, frequency=1.5, centre={"knee": 0, "ankle": 0})
_leaper = functools.partial(
    Preset,
    stiffness=0.8,
    damping=0.15,
    settle=0,
    ramp=15,
    ramp_start=0.2,
    phase_offsets=TROT,
    sweep=30,
    centre={"knee": 0, "ankle": 0},
)

TUNINGS = {
    "queen": {
        "slow": _queen(
            duty_factor=0.65,
            sweep=22,
            bends={
                "knee": Bend(stance=(10, 10, -10), swing=(-40, -40, 40)),
                "ankle": Bend(stance=(25, 0, -25), swing=(30, 45, -30)),
            },
        ),
        "medium": _queen(
            duty_factor=0.60,
            sweep=26,
            bends={
                "knee": Bend(stance=(15, 15, -15), swing=(-45, -45, 45)),
                "ankle": Bend(stance=(35, 0, -35), swing=(35, 55, -35)),
            },
        ),
        "fast": _queen(
            duty_factor=0.55,
            sweep=30,
            bends={
                "knee": Bend(stance=(20, 20, -20), swing=(-50, -50, 50)),
                "ankle": Bend(stance=(45, 0, -45), swing=(40, 65, -40)),
            },
        ),
        "tuned": Preset(
            stiffness=0.982,
            damping=0.21,
            settle=0,
            ramp=6.6,
            ramp_start=0.3,
            frequency=1.5,
            duty_factor=0.499,
            phase_offsets=(0.772, 0.223, 0.768, 0.272, 0.723, 0.268),
            sweep=(12.7, 18.8, 16.4),
            centre={"hip": (-1.7, -16.8, -4.9), "knee": (-19.3, -23.6, 29.8), "ankle": (-5.7, 32.5, -3.9)},
            bends={
                "knee": Bend(stance=(16.8, 33.1, -24.9), swing=(-53.0, -54.9, 26.1)),
                "ankle": Bend(stance=(16.5, -13.0, 0.4), swing=(45.7, -1.1, -5.6)),
            },
        ),
    },
    "bastion": {
        "slow": _bastion(frequency=1.2, duty_factor=0.65, sweep=22, bends={"ankle": Bend(stance=-15, swing=35)}),
        "medium": _bastion(frequency=1.5, duty_factor=0.60, sweep=26, bends={"ankle": Bend(stance=-20, swing=45)}),
        "fast": _bastion(frequency=1.8, duty_factor=0.55, sweep=30, bends={"ankle": Bend(stance=-25, swing=55)}),
        "tuned": Preset(
            stiffness=0.65,
            damping=0.115,
            settle=6,
            ramp=25.1,
            ramp_start=0.69,
            frequency=1.5,
            duty_factor=0.62,
            phase_offsets=(0.834, 0.33, 0.831, 0.334, 0.83, 0.331),
            sweep=(28.1, 12.4, 30.3),
            centre={"hip": (0.5, -5.3, 0.0), "ankle": (24.2, 26.7, 21.2)},
            bends={"ankle": Bend(stance=(-24.7, -23.9, -17.1), swing=(59.8, 47.3, 40.8))},
            crouch={"ankle": 60},
        ),
    },
    "tick": {
        "slow": _tick(
            duty_factor=0.65,
            sweep=32,
            bends={"knee": Bend(stance=8, swing=-35), "ankle": Bend(stance=0, swing=35)},
        ),
        "medium": _tick(
            duty_factor=0.60,
            sweep=40,
            bends={"knee": Bend(stance=12, swing=-40), "ankle": Bend(stance=0, swing=45)},
        ),
        "fast": _tick(
            duty_factor=0.55,
            sweep=40,
            bends={"knee": Bend(stance=18, swing=-45), "ankle": Bend(stance=0, swing=55)},
        ),
        "tuned": Preset(
            stiffness=0.648,
            damping=0.27,
            settle=0,
            ramp=20.4,
            ramp_start=0.85,
            frequency=1.5,
            duty_factor=0.539,
            phase_offsets=(0.762, 0.288, 0.798, 0.262, 0.788, 0.298),
            sweep=(45.9, 54.8, 46.4),
            centre={"hip": (-12.9, -9.1, -4.6), "knee": (-9.3, 6.6, 2.6), "ankle": (6.4, -15.6, 3.2)},
            bends={
                "knee": Bend(stance=(43.6, 21.0, 5.3), swing=(-58.1, -82.7, -47.5)),
                "ankle": Bend(stance=(-11.9, -7.3, -31.9), swing=(11.7, 34.7, 34.1)),
            },
        ),
    },
    "leaper": {
        "slow": _leaper(
            frequency=1.0,
            duty_factor=0.65,
            bends={"knee": Bend(stance=0, swing=-50), "ankle": Bend(stance=(20, 0), swing=(70, -70))},
        ),
        "medium": _leaper(
            frequency=1.2,
            duty_factor=0.60,
            bends={"knee": Bend(stance=0, swing=-55), "ankle": Bend(stance=(25, 0), swing=(75, -75))},
        ),
        "fast": _leaper(
            frequency=1.5,
            duty_factor=0.60,
            bends={"knee": Bend(stance=0, swing=-60), "ankle": Bend(stance=(30, 0), swing=(80, -80))},
        ),
        "tuned": Preset(
            stiffness=0.644,
            damping=0.126,
            settle=0,
            ramp=10.2,
            ramp_start=0.89,
            frequency=1.2,
            duty_factor=0.619,
            phase_offsets=(0.19, 0.69, 0.515, 0.015),
            sweep=(29.8, 32.3),
            centre={"hip": (-13.5, -10.5), "knee": (-2.4, 3.7), "ankle": (-2.0, -2.8)},
            bends={
                "knee": Bend(stance=(17.7, -4.9), swing=(-57.3, -39.3)),
                "ankle": Bend(stance=(18.1, -3.2), swing=(70.1, -78.4)),
            },
        ),
    },
}

# What `refined` adds to `tuned`: steering and torques, by joint, rank and then cosines and sines of three multiples of
# the leg's phase. Found by `arc-suite tune_cpg --space torques`.
_REFINEMENTS = {
    "queen": {
        "steering": -0.326,
        "torques": {
            "hip": (
                (-0.041, 0.022, -0.007, 0.043, -0.053, 0.015),
                (0.014, 0.028, 0.005, -0.029, 0.036, 0.013),
                (-0.039, 0.017, 0.023, -0.017, 0.041, 0.065),
            ),
            "knee": (
                (-0.062, -0.106, -0.024, 0.007, -0.068, -0.003),
                (-0.002, -0.004, -0.049, -0.045, -0.027, 0.018),
                (0.035, -0.006, 0.012, 0.016, 0.096, 0.042),
            ),
            "ankle": (
                (0.062, 0.138, -0.017, 0.035, -0.134, 0.007),
                (0.1, -0.065, 0.004, -0.074, -0.008, 0.038),
                (0.051, -0.066, 0.018, -0.109, -0.071, 0.02),
            ),
        },
    },
    "bastion": {
        "steering": -0.279,
        "torques": {
            "hip": (
                (-0.085, -0.004, -0.011, 0.05, -0.023, -0.05),
                (0.122, 0.039, -0.012, 0.018, 0.005, -0.034),
                (-0.07, 0.003, -0.013, -0.067, 0.019, -0.024),
            ),
            "ankle": (
                (-0.024, 0.105, 0.041, 0.085, 0.045, -0.054),
                (-0.036, 0.008, 0.079, 0.038, 0.022, -0.013),
                (0.008, 0.012, 0.035, 0.03, 0.009, 0.0),
            ),
        },
    },
    "tick": {
        "steering": -0.278,
        "torques": {
            "hip": (
                (-0.09, 0.044, -0.065, 0.102, 0.098, 0.011),
                (0.072, 0.082, -0.043, 0.179, 0.001, -0.052),
                (-0.02, -0.002, 0.021, 0.032, 0.059, -0.028),
            ),
            "knee": (
                (-0.014, -0.015, -0.054, -0.041, 0.039, -0.019),
                (0.005, 0.015, 0.011, 0.001, 0.056, -0.039),
                (-0.077, 0.005, -0.051, 0.076, 0.015, -0.015),
            ),
            "ankle": (
                (-0.061, 0.036, -0.054, 0.13, -0.014, 0.038),
                (0.052, -0.006, 0.075, 0.08, -0.032, -0.061),
                (0.106, 0.036, -0.025, 0.063, 0.053, -0.044),
            ),
        },
    },
    "leaper": {
        "steering": -0.203,
        "torques": {
            "hip": (
                (-0.055, 0.054, 0.005, -0.048, -0.136, -0.032),
                (-0.054, -0.038, 0.021, -0.062, -0.031, -0.005),
            ),
            "knee": (
                (0.077, 0.051, -0.081, -0.051, 0.061, 0.03),
                (-0.164, -0.068, 0.019, -0.053, 0.025, 0.011),
            ),
            "ankle": (
                (-0.051, 0.065, 0.161, 0.071, 0.179, -0.093),
                (0.312, 0.048, -0.088, 0.19, 0.009, -0.101),
            ),
        },
    },
}
for _robot, _added in _REFINEMENTS.items():
    TUNINGS[_robot]["refined"] = TUNINGS[_robot]["tuned"]._replace(**_added)
