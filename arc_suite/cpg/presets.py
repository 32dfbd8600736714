"""The demonstrators' parameters, by robot and preset."""

from arc_suite.cpg.balancing import BalancingParameters
from arc_suite.cpg.planner import PlanningParameters
from arc_suite.cpg.prescribed import Bend, Preset
from arc_suite.cpg.sighted import SightedParameters
from arc_suite.cpg.steering import SteeringParameters
from arc_suite.robots.gaits import TRIPOD, TROT


def _commanded(sighted: SightedParameters, **build) -> dict:
    """Presets of a body that follow a command, given the parameters of steering that depend on its build."""
    steered = SteeringParameters(**build)
    surefooted = steered._replace(lift=0.45, gain=(2.0, 2.0, 1.0), integral=0.6, attitude=0.3)
    # Without an integral, actions follow from what is observed: networks without memory learn them.
    reactive = steered._replace(gain=(3.0, 3.0, 1.5), integral=0.0)
    planned = PlanningParameters(steered)
    return {
        "steered": steered,
        "surefooted": surefooted,
        "reactive": reactive,
        "sighted": sighted,
        "planned": planned,
    }


# Of bodies and robots without presets of their own of these names; a number is a speed as a share of sqrt(g h).
DEFAULTS = {"slow": 0.18, "medium": 0.25, "fast": 0.32, **_commanded(SightedParameters())}


def _published(common: dict, *rows: tuple) -> dict:
    """The paper's slow, medium and fast: frequency, Hz, duty factor, sweep and bends, degrees, of each."""
    numbers = (dict(zip(("frequency", "duty_factor", "sweep", "bends"), row, strict=True)) for row in rows)
    return {name: Preset(**common, **row) for name, row in zip(("slow", "medium", "fast"), numbers, strict=True)}


_HEXAPOD = {"stiffness": 0.8, "settle": 15, "ramp": 20, "ramp_start": 0.3, "phase_offsets": TRIPOD}
_LEAPER = {"stiffness": 0.8, "damping": 0.15, "settle": 0, "ramp": 15, "ramp_start": 0.2, "phase_offsets": TROT}

PRESETS = {
    "queen": {
        **_published(
            {**_HEXAPOD, "damping": 0.18, "centre": {"knee": (-25, -25, 25), "ankle": (15, 30, -15)}},
            (1.5, 0.65, 22, {"knee": Bend((10, 10, -10), (-40, -40, 40)), "ankle": Bend((25, 0, -25), (30, 45, -30))}),
            (1.5, 0.60, 26, {"knee": Bend((15, 15, -15), (-45, -45, 45)), "ankle": Bend((35, 0, -35), (35, 55, -35))}),
            (1.5, 0.55, 30, {"knee": Bend((20, 20, -20), (-50, -50, 50)), "ankle": Bend((45, 0, -45), (40, 65, -40))}),
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
        **_published(
            {**_HEXAPOD, "damping": 0.15, "centre": {"ankle": 30}},
            (1.2, 0.65, 22, {"ankle": Bend(-15, 35)}),
            (1.5, 0.60, 26, {"ankle": Bend(-20, 45)}),
            (1.8, 0.55, 30, {"ankle": Bend(-25, 55)}),
        ),
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
        **_published(
            {**_HEXAPOD, "damping": 0.18, "centre": {"knee": 0, "ankle": 0}},
            (1.5, 0.65, 32, {"knee": Bend(8, -35), "ankle": Bend(0, 35)}),
            (1.5, 0.60, 40, {"knee": Bend(12, -40), "ankle": Bend(0, 45)}),
            (1.5, 0.55, 40, {"knee": Bend(18, -45), "ankle": Bend(0, 55)}),
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
        **_published(
            {**_LEAPER, "centre": {"knee": 0, "ankle": 0}},
            (1.0, 0.65, 30, {"knee": Bend(0, -50), "ankle": Bend((20, 0), (70, -70))}),
            (1.2, 0.60, 30, {"knee": Bend(0, -55), "ankle": Bend((25, 0), (75, -75))}),
            (1.5, 0.60, 30, {"knee": Bend(0, -60), "ankle": Bend((30, 0), (80, -80))}),
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
    PRESETS[_robot]["refined"] = PRESETS[_robot]["tuned"]._replace(**_added)

# Leads, and what differs from other bodies, were found by search and by trying.
PRESETS["queen"] |= _commanded(SightedParameters(ride=0.93), lead=0.12)
PRESETS["bastion"] |= _commanded(SightedParameters(lift=0.35, lead=0.06, longer=0.0), lead=0.08)
PRESETS["tick"] |= _commanded(SightedParameters(trust=0.5), lead=0.1)
PRESETS["leaper"] |= _commanded(SightedParameters(), share=0.03, level=1.0, sweep=0.8, unload=0.0, lead=0.04)
PRESETS["leaper"]["balanced"] = BalancingParameters(
    feet=((0.59, 0.9, -0.62), (-0.55, 0.64, -0.64)),
    lift=0.32,
    gain=(0.5, 0.3, 0.5),
    integral=0.5,
    most=1.2,
    shorter=0.06,
    lead=0.06,
    attitude=0.3,
    lean=0.5,
    capture=0.45,
)
