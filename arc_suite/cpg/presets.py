"""The demonstrators' parameters, by robot and preset."""

import json
from pathlib import Path

from arc_suite.cpg.climbing import ClimbingParameters
from arc_suite.cpg.leaping import LeapingParameters
from arc_suite.cpg.leaps import Leap
from arc_suite.cpg.limping import LimpingParameters
from arc_suite.cpg.planner import PlanningParameters
from arc_suite.cpg.prescribed import Bend, Preset
from arc_suite.cpg.rising import RisingParameters
from arc_suite.cpg.sighted import SightedParameters
from arc_suite.cpg.stepping import SteppingParameters
from arc_suite.cpg.straight import StraightParameters
from arc_suite.cpg.tracked import TrackingParameters
from arc_suite.robots.gaits import TRIPOD, TROT

# Leaps that a generated body chooses from. Its feet stand wide, so that it steps over trenches of the standing height.
_LEAPS = (Leap(drive=1.5), Leap(), Leap(drive=4.0), Leap(back=0.3, forward=0.7, drive=4.0))
_LEAPING = LeapingParameters(choice=_LEAPS, widest=1.0)


def _command_presets(sighted: SightedParameters, leaping: LeapingParameters = _LEAPING, **steering) -> dict:
    """Return the presets of a body that follow a command.

    Args:
        sighted: parameters of the preset `sighted`.
        leaping: parameters of the preset `leaping`.
        **steering: fields of `SteppingParameters` that depend on the build of the body.
    """
    steered = SteppingParameters(**steering)
    # A kick of sqrt(g h) moves the point over which the torso would come to rest by h: nearer soles cannot hold it.
    wide = steered._replace(wider=0.2, lower=0.15, integral=0.3)
    braced = wide._replace(most=1.2)
    surefooted = wide._replace(lift=0.4)
    climbing = ClimbingParameters(surefooted)
    # Without an integral, actions are a function of the observation: networks without memory can learn them.
    reactive = steered._replace(integral=0.0)
    planned = PlanningParameters(steered)
    return {
        "straight": StraightParameters(steered._replace(lift=0.2, gain=(1.0, 1.0, 0.5))),
        "steered": steered,
        "surefooted": surefooted,
        "climbing": climbing,
        "braced": braced,
        "reactive": reactive,
        "sighted": sighted,
        "leaping": leaping._replace(walk=sighted),
        "planned": planned,
        "tracked": TrackingParameters(),
        "rising": RisingParameters(),
    }


# Presets of generated bodies, and of robots without their own presets of these names. A number is a speed as a share
# of sqrt(g h). These bodies keep near their standing pose, for which their motors are sized. Their gait is quick, and
# feet follow late.
_SIGHTED = SightedParameters(lead=0.12, longer=0.0, trust=0.5)
DEFAULTS = {"slow": 0.18, "medium": 0.25, "fast": 0.32, **_command_presets(_SIGHTED)}
# Of bodies with four legs or fewer, which tip between two feet. Others walk better without these corrections.
# In gaits and poses by command, a slow integral and low steps disturb them less.
_POSED = {"lift": 0.2, "integral": 0.1}
DEFAULTS_OF_FOUR_LEGS = {
    **DEFAULTS,
    "posed": DEFAULTS["steered"]._replace(**_POSED),
    "climbing": ClimbingParameters(
        DEFAULTS["surefooted"]._replace(gain=(2.0, 2.0, 1.0), lean=0.2, capture=0.4),
        rough_lift=0.35,
        reserve=1.3,
        tilt_rate=0.4,
        tilt_sum=0.5,
        leveling=0.7,
        slope=0.2,
        preview=0.35,
    ),
}

# Presets of imported bodies. Their servos need little feedback on the motion: it comes late, and tips them.
_STEERED = SteppingParameters(lift=0.2, gain=(1.0, 1.0, 0.5), integral=0.1, most=1.4, lean=0.0, capture=0.2)
_BRACED = _STEERED._replace(wider=0.5, lower=0.25)
# Servos follow their targets sooner than motors do.
_SIGHTED_BY_SERVOS = SightedParameters(lift=0.25, lead=0.03, longer=0.0, trust=0.5)
DEFAULTS_OF_SERVOS = {
    "slow": 0.18,
    "medium": 0.24,
    "fast": 0.3,
    "straight": StraightParameters(_STEERED._replace(lift=0.3, integral=0.3)),
    "steered": _STEERED,
    "surefooted": _STEERED,  # a wide stance costs some of the way over uneven ground
    "climbing": ClimbingParameters(_STEERED, slope=0.0, preview=0.25),
    "braced": _BRACED,
    "balanced": _STEERED,  # the former name of surefooted
    "reactive": _STEERED._replace(integral=0.0),
    "sighted": _SIGHTED_BY_SERVOS,
    "crossing": _SIGHTED_BY_SERVOS,  # earns a third more than `climbing` on all kinds of ground together
    "leaping": _LEAPING._replace(walk=_SIGHTED_BY_SERVOS),
    "planned": PlanningParameters(_STEERED),
    "tracked": TrackingParameters(),
    "rising": RisingParameters(),
}
# With a failed leg, generated bodies and those with more legs earn more by `braced`.
DEFAULTS_OF_FOUR_LEGS_WITH_SERVOS = {**DEFAULTS_OF_SERVOS, "limping": LimpingParameters(_BRACED)}
# Of bodies whose soles stand further aside than this, in standing heights, on average: no kick needs them wider, and a
# torso over the other feet of a failed leg gains nothing.
WIDE_STANCE = 0.95
DEFAULTS_OF_WIDE_LEGS_WITH_SERVOS = {**DEFAULTS_OF_SERVOS, "braced": _STEERED}
# Of bodies whose median motor gives less than this share of m g h. Over rough ground and slopes they earn up to a fifth
# more by the lower torso of `sighted`; those with stronger motors fall there.
WEAK_TORQUE = 0.57
DEFAULTS_OF_FOUR_LEGS_WITH_WEAK_SERVOS = {**DEFAULTS_OF_FOUR_LEGS_WITH_SERVOS, "hiking": _SIGHTED_BY_SERVOS}
# Of bodies that stand with more than this share of a motor's torque. In a trot two feet carry twice as much, and bent
# legs more still, so the torso stays at its height.
LARGE_LOAD = 0.4
_SIGHTED_UNDER_LOAD = _SIGHTED_BY_SERVOS._replace(ride=1.0)
DEFAULTS_OF_FOUR_LEGS_WITH_LOADED_SERVOS = {
    **DEFAULTS_OF_FOUR_LEGS_WITH_SERVOS,
    "sighted": _SIGHTED_UNDER_LOAD,
    "crossing": _SIGHTED_UNDER_LOAD,
    "leaping": _LEAPING._replace(walk=_SIGHTED_UNDER_LOAD),
}


def _paper_presets(common: dict, slow: tuple, medium: tuple, fast: tuple) -> dict:
    """Return the paper's presets of a robot.

    Args:
        common: fields that the presets share.
        slow, medium, fast: frequency, Hz, duty factor, sweep and bends, degrees, of each preset.
    """
    presets = {}
    for name, row in (("slow", slow), ("medium", medium), ("fast", fast)):
        frequency, duty_factor, sweep, bends = row
        presets[name] = Preset(**common, frequency=frequency, duty_factor=duty_factor, sweep=sweep, bends=bends)
    return presets


_HEXAPOD = {"stiffness": 0.8, "settle": 15, "ramp": 20, "ramp_start": 0.3, "phase_offsets": TRIPOD}
_LEAPER = {"stiffness": 0.8, "damping": 0.15, "settle": 0, "ramp": 15, "ramp_start": 0.2, "phase_offsets": TROT}

PRESETS = {
    "queen": _paper_presets(
        {**_HEXAPOD, "damping": 0.18, "center": {"knee": (-25, -25, 25), "ankle": (15, 30, -15)}},
        (1.5, 0.65, 22, {"knee": Bend((10, 10, -10), (-40, -40, 40)), "ankle": Bend((25, 0, -25), (30, 45, -30))}),
        (1.5, 0.60, 26, {"knee": Bend((15, 15, -15), (-45, -45, 45)), "ankle": Bend((35, 0, -35), (35, 55, -35))}),
        (1.5, 0.55, 30, {"knee": Bend((20, 20, -20), (-50, -50, 50)), "ankle": Bend((45, 0, -45), (40, 65, -40))}),
    ),
    "bastion": _paper_presets(
        {**_HEXAPOD, "damping": 0.15, "center": {"ankle": 30}},
        (1.2, 0.65, 22, {"ankle": Bend(-15, 35)}),
        (1.5, 0.60, 26, {"ankle": Bend(-20, 45)}),
        (1.8, 0.55, 30, {"ankle": Bend(-25, 55)}),
    ),
    "tick": _paper_presets(
        {**_HEXAPOD, "damping": 0.18, "center": {"knee": 0, "ankle": 0}},
        (1.5, 0.65, 32, {"knee": Bend(8, -35), "ankle": Bend(0, 35)}),
        (1.5, 0.60, 40, {"knee": Bend(12, -40), "ankle": Bend(0, 45)}),
        (1.5, 0.55, 40, {"knee": Bend(18, -45), "ankle": Bend(0, 55)}),
    ),
    "leaper": _paper_presets(
        {**_LEAPER, "center": {"knee": 0, "ankle": 0}},
        (1.0, 0.65, 30, {"knee": Bend(0, -50), "ankle": Bend((20, 0), (70, -70))}),
        (1.2, 0.60, 30, {"knee": Bend(0, -55), "ankle": Bend((25, 0), (75, -75))}),
        (1.5, 0.60, 30, {"knee": Bend(0, -60), "ankle": Bend((30, 0), (80, -80))}),
    ),
}


def _from_json(fields: dict) -> dict | Bend:
    """Return an object of JSON with tuples in place of lists; the two angles of a bend as a `Bend`."""
    values = {name: _tuple_from_list(value) for name, value in fields.items()}
    return Bend(**values) if values.keys() == {"stance", "swing"} else values


def _tuple_from_list(value):
    """Return nested lists as tuples, and other values unchanged."""
    return tuple(map(_tuple_from_list, value)) if isinstance(value, list) else value


# Results of tools/tune_cpg.py: the preset `tuned`, and the steering and torques that `refined` adds to it.
_SEARCHED = json.loads(Path(__file__).with_name("searched.json").read_text(encoding="utf-8"), object_hook=_from_json)
for _robot, _results in _SEARCHED.items():
    _tuned = Preset(**_results["tuned"])
    PRESETS[_robot] |= {"tuned": _tuned, "refined": _tuned._replace(**_results["refined"])}

# The numbers of each robot below are results of searches and trials.
_QUEEN_LEAP = Leap(crouch=0.52, back=0.52, forward=0.6, drive=4.1, tuck=0.1, ahead=0.27)
# From ten starts whose joints differ by .03 rad it gets 1.95 to 2.02 h ahead, and turns by .05 rad at most.
_BASTION_LEAP = Leap(crouch=0.75, back=0.41, forward=0.7, drive=1.24, tuck=0.5, ahead=0.16, stretch=1.61, fly=3.2)
PRESETS["queen"] |= _command_presets(SightedParameters(ride=0.93), LeapingParameters(choice=(_QUEEN_LEAP,)), lead=0.12)
PRESETS["bastion"] |= _command_presets(
    SightedParameters(lift=0.35, lead=0.06, longer=0.0),
    LeapingParameters(choice=(_BASTION_LEAP,), near=0.4, most=0.5),
    lead=0.08,
)
PRESETS["tick"] |= _command_presets(SightedParameters(trust=0.5), lead=0.1)
# With a lower torso its chassis hits the ground: it fell in each episode of `rough` at difficulty 1, now in none.
PRESETS["tick"]["surefooted"] = PRESETS["tick"]["surefooted"]._replace(lower=0.0)
PRESETS["tick"]["climbing"] = ClimbingParameters(PRESETS["tick"]["surefooted"])
for _robot in ("queen", "bastion", "tick"):
    PRESETS[_robot]["crossing"] = PRESETS[_robot]["sighted"]
PRESETS["leaper"] |= _command_presets(
    SightedParameters(), gain=(1.0, 1.0, 0.5), integral=0.45, most=1.05, lead=0.04, lean=0.0
)
PRESETS["leaper"]["posed"] = PRESETS["leaper"]["steered"]._replace(**_POSED)
PRESETS["leaper"]["braced"] = PRESETS["leaper"]["steered"]
PRESETS["leaper"]["surefooted"] = PRESETS["leaper"]["steered"]._replace(integral=0.2, lean=0.4)
PRESETS["leaper"]["climbing"] = ClimbingParameters(
    PRESETS["leaper"]["surefooted"], tilt_rate=0.2, slope=0.0, preview=0.25
)
PRESETS["leaper"]["balanced"] = PRESETS["leaper"]["surefooted"]  # its former name

# On level ground, with feet that touch down when the gait schedules it, for clips. Over the legs of Bastion, which have
# two joints, `steered` rocks, and the feet in front touch down a third of a cycle late: it follows their paths at the
# expense of their height. Leaper tips backward between the two feet of its trot; further ahead it does not.
PRESETS["bastion"]["in_step"] = PRESETS["bastion"]["steered"]._replace(
    across=0.15, lift=0.4, gain=(1.0, 1.0, 0.5), integral=0.1, lead=0.134, lean=1.0
)
PRESETS["leaper"]["in_step"] = PRESETS["leaper"]["steered"]._replace(ahead=0.12, higher=0.1, lead=0.08)
