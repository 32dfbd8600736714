"""Modifiers: disturbances, and how motors and senses are, as settings of any task.

Numbers without a unit are shares of what the body has; speeds are multiples of sqrt(g h) with the
standing height h, so that nothing has a scale. Where a setting takes two numbers, every episode
draws its own between them.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.robots.spec import Body

FAILS_FROM = 40  # control steps after which the motors of a leg fail
LONGEST_DELAY = 100  # control steps
ACTIONS = ("torque", "position")


class Modifiers(NamedTuple):
    """What is changed of a task; the defaults change nothing.

    Attributes:
        kicks: the greatest change of the torso's velocity by a kick, sqrt(g h): each of a schedule is
            uniform from 0 up to it, in any horizontal direction, 40 to 120 control steps apart.
        motor_strength: of the torque of all motors, a share, or two of them.
        actuator_failure: True for a leg that is drawn, or the index of one: its motors do nothing from step 40 on.
        friction: of all contacts, a multiple, or two of them.
        mass: and inertia of all parts, a multiple, or two of them.
        observation_noise: level of uniform noise on what is measured, for all blocks that
            `noise.half_widths` knows, or by the name of a block.
        delay: of actions, control steps, or two of them.
        actions: "torque", or "position": an action is then the joints' wanted angles, 0 for the standing
            pose and as far as the farther limit of a joint's range for 1 and -1, held by the body's own gains.
        exclude_blocks: names of blocks that the observation leaves out: the vector gets shorter.
    """

    kicks: float = 0.0
    motor_strength: tuple[float, float] = (1.0, 1.0)
    actuator_failure: bool | int = False
    friction: tuple[float, float] = (1.0, 1.0)
    mass: tuple[float, float] = (1.0, 1.0)
    observation_noise: Mapping[str, float] = {}
    delay: tuple[int, int] = (0, 0)
    actions: str = "torque"
    exclude_blocks: tuple[str, ...] = ()


NAMES = Modifiers._fields


def checked(settings: Mapping[str, Any], body: Body, blocks: Mapping[str, int], noisy) -> Modifiers:
    """Return the modifiers that settings ask for.

    Args:
        settings: some of the fields of `Modifiers` by name.
        body: that is modified.
        blocks: sizes of the blocks of the task's observation, by name.
        noisy: names of those that can be noisy.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    for name in settings:
        checks.name(name, NAMES, "modifier")
    values = Modifiers()._asdict() | dict(settings)
    return Modifiers(
        kicks=checks.number("kicks", values["kicks"], 0.0, 100.0),
        motor_strength=checks.span("motor_strength", values["motor_strength"], 0.0, 1.0),
        actuator_failure=_actuator_failure(values["actuator_failure"], body),
        friction=checks.span("friction", values["friction"], 0.0, 100.0),
        mass=checks.span("mass", values["mass"], 0.01, 100.0),
        observation_noise=_noise(values["observation_noise"], list(noisy)),
        delay=_delay(values["delay"]),
        actions=checks.name(values["actions"], ACTIONS, "actions"),
        exclude_blocks=_exclude_blocks(values["exclude_blocks"], blocks),
    )


def _actuator_failure(value, body: Body) -> bool | int:
    return value if isinstance(value, bool) else checks.integer("actuator_failure", value, 0, len(body.legs) - 1)


def _noise(value, noisy: list[str]) -> dict[str, float]:
    levels = value if isinstance(value, Mapping) else dict.fromkeys(noisy, value)
    return {
        checks.name(name, noisy, "block with noise"): checks.number("observation_noise", level, 0.0, 100.0)
        for name, level in levels.items()
    }


def _delay(value) -> tuple[int, int]:
    low, high = value if isinstance(value, tuple | list) and len(value) == 2 else (value, value)
    low = checks.integer("delay", low, 0, LONGEST_DELAY)
    return low, checks.integer("delay", high, low, LONGEST_DELAY)


def _exclude_blocks(value, blocks: Mapping[str, int]) -> tuple[str, ...]:
    names = (value,) if isinstance(value, str) else value
    if not isinstance(names, tuple | list):
        raise ValueError(f"exclude_blocks: expected names of blocks, got {value!r}")
    names = tuple(checks.name(name, blocks, "block") for name in names)
    if set(names) == set(blocks):
        raise ValueError(f"exclude_blocks: expected to leave a block, got all of them: {', '.join(names)}")
    return names
