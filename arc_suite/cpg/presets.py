"""The demonstrators' parameters, by robot and preset."""

import json
from pathlib import Path

from arc_suite.cpg.balancing import BalancingParameters
from arc_suite.cpg.leaping import LeapingParameters
from arc_suite.cpg.leaps import Leap
from arc_suite.cpg.planner import PlanningParameters
from arc_suite.cpg.prescribed import Bend, Preset
from arc_suite.cpg.sighted import SightedParameters
from arc_suite.cpg.steering import SteeringParameters
from arc_suite.robots.gaits import TRIPOD, TROT

# Leaps that generated bodies try. Their feet stand wide, so that they step over trenches of the standing height.
_LEAPS = Leap(drive=1.5), Leap(), Leap(drive=4.0), Leap(back=0.3, forward=0.7, drive=4.0)
_LEAPING = LeapingParameters(choice=_LEAPS, widest=1.0)


def _commanded(sighted: SightedParameters, leaping: LeapingParameters = _LEAPING, **build) -> dict:
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
        "leaping": leaping._replace(walk=sighted),
        "planned": planned,
    }


# Of bodies and robots without presets of their own of these names; a number is a speed as a share of sqrt(g h).
# They keep near their standing pose, for which their motors are sized, and feet follow later in their quick gait.
_SIGHTED = SightedParameters(lead=0.24, longer=0.12, trust=0.5)
DEFAULTS = {"slow": 0.18, "medium": 0.25, "fast": 0.32, **_commanded(_SIGHTED, share=0.05, level=1.0)}

# Of imported bodies. Feedback on the motion, which comes late, tips robots with quick motors; their servos need little.
_STEERED = SteeringParameters(lift=0.12, gain=(0.3, 0.3, 0.3), integral=0.3, share=0.05, level=1.0)
_BALANCED = BalancingParameters()
DEFAULTS_OF_SERVOS = {
    "slow": 0.18,
    "medium": 0.24,
    "fast": 0.3,
    "steered": _STEERED,
    "surefooted": _STEERED._replace(lift=0.3),
    "reactive": _STEERED._replace(integral=0.0),
    "sighted": _SIGHTED,
    "leaping": _LEAPING._replace(walk=_SIGHTED),
    "planned": PlanningParameters(_STEERED),
}
# Of imported bodies that step for their balance; on six legs such steps tip them.
BALANCING = {
    "surefooted": _BALANCED,
    "balanced": _BALANCED,
    "reactive": _BALANCED._replace(integral=0.0),
}


def _published(common: dict, *rows: tuple) -> dict:
    """The paper's slow, medium and fast: frequency, Hz, duty factor, sweep and bends, degrees, of each."""
    numbers = (dict(zip(("frequency", "duty_factor", "sweep", "bends"), row, strict=True)) for row in rows)
    return {name: Preset(**common, **row) for name, row in zip(("slow", "medium", "fast"), numbers, strict=True)}


_HEXAPOD = {"stiffness": 0.8, "settle": 15, "ramp": 20, "ramp_start": 0.3, "phase_offsets": TRIPOD}
_LEAPER = {"stiffness": 0.8, "damping": 0.15, "settle": 0, "ramp": 15, "ramp_start": 0.2, "phase_offsets": TROT}

PRESETS = {
    "queen": _published(
        {**_HEXAPOD, "damping": 0.18, "center": {"knee": (-25, -25, 25), "ankle": (15, 30, -15)}},
        (1.5, 0.65, 22, {"knee": Bend((10, 10, -10), (-40, -40, 40)), "ankle": Bend((25, 0, -25), (30, 45, -30))}),
        (1.5, 0.60, 26, {"knee": Bend((15, 15, -15), (-45, -45, 45)), "ankle": Bend((35, 0, -35), (35, 55, -35))}),
        (1.5, 0.55, 30, {"knee": Bend((20, 20, -20), (-50, -50, 50)), "ankle": Bend((45, 0, -45), (40, 65, -40))}),
    ),
    "bastion": _published(
        {**_HEXAPOD, "damping": 0.15, "center": {"ankle": 30}},
        (1.2, 0.65, 22, {"ankle": Bend(-15, 35)}),
        (1.5, 0.60, 26, {"ankle": Bend(-20, 45)}),
        (1.8, 0.55, 30, {"ankle": Bend(-25, 55)}),
    ),
    "tick": _published(
        {**_HEXAPOD, "damping": 0.18, "center": {"knee": 0, "ankle": 0}},
        (1.5, 0.65, 32, {"knee": Bend(8, -35), "ankle": Bend(0, 35)}),
        (1.5, 0.60, 40, {"knee": Bend(12, -40), "ankle": Bend(0, 45)}),
        (1.5, 0.55, 40, {"knee": Bend(18, -45), "ankle": Bend(0, 55)}),
    ),
    "leaper": _published(
        {**_LEAPER, "center": {"knee": 0, "ankle": 0}},
        (1.0, 0.65, 30, {"knee": Bend(0, -50), "ankle": Bend((20, 0), (70, -70))}),
        (1.2, 0.60, 30, {"knee": Bend(0, -55), "ankle": Bend((25, 0), (75, -75))}),
        (1.5, 0.60, 30, {"knee": Bend(0, -60), "ankle": Bend((30, 0), (80, -80))}),
    ),
}


def _plain(fields: dict) -> dict | Bend:
    """Return an object of JSON with tuples in place of lists; the two angles of a bend as a `Bend`."""
    fields = {name: _tuples(value) for name, value in fields.items()}
    return Bend(**fields) if fields.keys() == {"stance", "swing"} else fields


def _tuples(value):
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


# What tools/tune_cpg.py found: `tuned`, and the steering and torques that `refined` adds to it.
_SEARCHED = json.loads(Path(__file__).with_name("searched.json").read_text(encoding="utf-8"), object_hook=_plain)
for _robot, _found in _SEARCHED.items():
    _tuned = Preset(**_found["tuned"])
    PRESETS[_robot] |= {"tuned": _tuned, "refined": _tuned._replace(**_found["refined"])}

# Leads, and what differs from other bodies, were found by search and by trying.
_QUEENS = Leap(crouch=0.52, back=0.52, forward=0.6, drive=4.1, tuck=0.1, ahead=0.27)
_BASTIONS = Leap(crouch=0.61, back=0.6, forward=0.51, drive=2.0, tuck=0.37, stretch=1.19, fly=2.6)
PRESETS["queen"] |= _commanded(SightedParameters(ride=0.93), LeapingParameters(choice=(_QUEENS,)), lead=0.12)
PRESETS["bastion"] |= _commanded(
    SightedParameters(lift=0.35, lead=0.06, longer=0.0),
    LeapingParameters(choice=(_BASTIONS,), near=0.4, most=0.5),
    lead=0.08,
)
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
