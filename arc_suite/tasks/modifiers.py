"""Modifiers: disturbances, and how motors and senses are, as settings of any task.

Numbers without a unit are shares of what the body has; speeds are multiples of sqrt(g h) with the
standing height h, so that nothing has a scale. Where a setting takes two numbers, every episode
draws its own between them.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block

FAILS_FROM = 40  # control steps after which the motors of a leg fail
LONGEST_DELAY = 100  # control steps
LONGEST_HISTORY = 50  # control steps
ACTIONS = ("torque", "position")
_DELAYS = (0, LONGEST_DELAY)


class Modifiers(NamedTuple):
    """What is changed of a task; the defaults change nothing.

    Attributes:
        kicks: the greatest change of the torso's velocity by a kick, sqrt(g h): each of a schedule is
            uniform from 0 up to it, in any horizontal direction, 40 to 120 control steps apart.
        motor_strength: share of the torque of all motors, or two of them.
        actuator_failure: True for a leg that is drawn, or the index of one: its motors do nothing from step 40 on.
        friction: multiple of the friction of all contacts, or two of them.
        mass: multiple of mass and inertia of all parts, or two of them.
        observation_noise: level of uniform noise on what is measured, for all blocks that declare
            `noise`, or by the name of a block.
        delay: delay of actions, control steps, or two of them.
        actions: "torque", or "position": an action is then the joints' wanted angles, 0 for the standing
            pose and as far as the farther limit of a joint's range for 1 and -1, held by the body's own gains. None:
            torques of motors and positions of servos, which take nothing else.
        exclude_blocks: names of blocks that the observation leaves out: the vector gets shorter.
        payload: mass of a load as a share of the body's, or two of them; its place, uniform in the box around
            the torso, is drawn.
        center_of_mass: the greatest displacement of the torso's center of mass along each axis, h.
        joint_offset: the greatest error of the zero of each joint's sensor, rad: of the angles that are observed, and
            of those that position control and servos hold.
        joint_strength: share of the torque of each motor, or two of them, in addition to `motor_strength`: every
            joint draws its own.
        gains: multiple of the stiffness, and another of the damping, of position control and servos, or two of them.
        armature: multiple of the armatures of all joints, or two of them.
        force: the greatest force on the torso, of the body's weight: each of a schedule is uniform from 0 up to it, in
            any horizontal direction, lasts 1 to 4 control steps, and begins 40 to 120 after the one before.
        history: number of earlier control steps of which the block `history` holds the blocks that measure joints,
            and the actions after them, the newest first; before the start they are those of the start, and 0.
    """

    kicks: float = 0.0
    motor_strength: tuple[float, float] = (1.0, 1.0)
    actuator_failure: bool | int = False
    friction: tuple[float, float] = (1.0, 1.0)
    mass: tuple[float, float] = (1.0, 1.0)
    observation_noise: Mapping[str, float] = {}
    delay: tuple[int, int] = (0, 0)
    actions: str | None = None
    exclude_blocks: tuple[str, ...] = ()
    payload: tuple[float, float] = (0.0, 0.0)
    center_of_mass: float = 0.0
    joint_offset: float = 0.0
    joint_strength: tuple[float, float] = (1.0, 1.0)
    gains: tuple[float, float] = (1.0, 1.0)
    armature: tuple[float, float] = (1.0, 1.0)
    force: float = 0.0
    history: int = 0


NAMES = Modifiers._fields

# Of a number, or of each of two.
BOUNDS = {
    "kicks": (0.0, 100.0),
    "motor_strength": (0.0, 1.0),
    "friction": (0.0, 100.0),
    "mass": (0.01, 100.0),
    "observation_noise": (0.0, 100.0),
    "delay": _DELAYS,
    "payload": (0.0, 10.0),
    "center_of_mass": (0.0, 1.0),
    "joint_offset": (0.0, 1.0),
    "joint_strength": (0.0, 1.0),
    "gains": (0.01, 10.0),
    "armature": (0.01, 100.0),
    "force": (0.0, 100.0),
    "history": (0, LONGEST_HISTORY),
}
_NUMBERS = ("kicks", "center_of_mass", "joint_offset", "force")
_SPANS = ("motor_strength", "friction", "mass", "payload", "joint_strength", "gains", "armature")


def checked(settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Modifiers:
    """Return the modifiers that settings ask for.

    Args:
        settings: some of the fields of `Modifiers` by name.
        body: that is modified.
        blocks: of the task's observation, by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    for name in settings:
        checks.name(name, NAMES, "modifier")
    values = Modifiers()._asdict() | dict(settings)
    found = Modifiers(
        actuator_failure=_actuator_failure(values["actuator_failure"], body),
        observation_noise=_noise(
            values["observation_noise"], [name for name in blocks if blocks[name].noise is not None]
        ),
        delay=_delay(values["delay"]),
        history=_history(values["history"], blocks, _exclude_blocks(values["exclude_blocks"], blocks)),
        actions=_actions(values["actions"], body),
        exclude_blocks=_exclude_blocks(values["exclude_blocks"], blocks),
        **{name: checks.number(name, values[name], *BOUNDS[name]) for name in _NUMBERS},
        **{name: checks.span(name, values[name], *BOUNDS[name]) for name in _SPANS},
    )
    if found.actions == "torque" and found.gains != (1.0, 1.0):
        raise ValueError(f"gains: torques have none, expected actions='position', got {checks.shown(values['gains'])}")
    return found


def _actions(value, body: Body) -> str:
    if value is None:
        return "position" if body.source else "torque"
    if checks.name(value, ACTIONS, "actions") == "torque" and body.source:
        raise ValueError(f"actions: {body.name} has servos, which take positions, expected position, got torque")
    return value


def _actuator_failure(value, body: Body) -> bool | int:
    return value if isinstance(value, bool) else checks.integer("actuator_failure", value, 0, len(body.legs) - 1)


def _noise(value, noisy: list[str]) -> dict[str, float]:
    levels, bounds = value if isinstance(value, Mapping) else dict.fromkeys(noisy, value), BOUNDS["observation_noise"]
    return {
        checks.name(name, noisy, "block with noise"): checks.number("observation_noise", level, *bounds)
        for name, level in levels.items()
    }


def _delay(value) -> tuple[int, int]:
    low, high = value if isinstance(value, tuple | list) and len(value) == 2 else (value, value)
    least, most = _DELAYS
    low = checks.integer("delay", low, least, most)
    return low, checks.integer("delay", high, low, most)


def _history(value, blocks: Mapping[str, Block], excluded: tuple[str, ...]) -> int:
    count = checks.integer("history", value, *BOUNDS["history"])
    if count and not blocks_of_history(blocks, excluded):
        kept = ", ".join(name for name in blocks if name not in excluded)
        raise ValueError(f"history: expected a task that observes joints, as posture and velocities do, got {kept}")
    return count


def blocks_of_history(blocks: Mapping[str, Block], excluded: Iterable[str]) -> dict[str, Block]:
    """Return the blocks that a history keeps, by name: those that measure joints and are not left out."""
    return {name: block for name, block in blocks.items() if block.measures_joints and name not in excluded}


def _exclude_blocks(value, blocks: Iterable[str]) -> tuple[str, ...]:
    names = checks.names("exclude_blocks", value, blocks, "block")
    if set(names) == set(blocks):
        raise ValueError(f"exclude_blocks: expected to leave a block, got all of them: {', '.join(names)}")
    return names
