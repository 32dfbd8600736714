"""Modifiers: disturbances, and how motors and senses are, as settings of any task.

Numbers without a unit are shares of what the body has; speeds are multiples of sqrt(g h) with the
standing height h, so that nothing has a scale. Where a setting takes two numbers, every episode
draws its own between them.
"""

from collections.abc import Mapping
from typing import Any

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.contacts import Contacts
from arc_suite.tasks.modifiers.control import Control
from arc_suite.tasks.modifiers.delay import Delay
from arc_suite.tasks.modifiers.excluded_blocks import ExcludedBlocks
from arc_suite.tasks.modifiers.history import History
from arc_suite.tasks.modifiers.kicks import Kicks
from arc_suite.tasks.modifiers.masses import Masses
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.motors import Motors
from arc_suite.tasks.modifiers.observation_noise import ObservationNoise
from arc_suite.tasks.modifiers.pushes import Pushes
from arc_suite.tasks.modifiers.sensors import Sensors
from arc_suite.tasks.modifiers.sensors_only import SensorsOnly

__all__ = [
    "MODIFIERS",
    "SUITE_MODIFIERS",
    "Contacts",
    "Control",
    "Delay",
    "ExcludedBlocks",
    "History",
    "Kicks",
    "Masses",
    "Modifier",
    "Motors",
    "ObservationNoise",
    "Pushes",
    "Sensors",
    "SensorsOnly",
    "bounds",
    "fit_modifiers",
]

# The suite's modifiers, from the body outwards. A modified task has all of them.
SUITE_MODIFIERS: tuple[type[Modifier], ...] = (
    Contacts,
    Masses,
    Sensors,
    Control,
    Motors,
    Kicks,
    Pushes,
    Delay,
    ExcludedBlocks,
    ObservationNoise,
    SensorsOnly,
    History,
)

# Name of a setting -> the modifier that has it. `registration.register` adds the modifiers of other packages.
MODIFIERS: dict[str, type[Modifier]] = {
    setting: modifier for modifier in SUITE_MODIFIERS for setting in modifier.defaults
}


def fit_modifiers(settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> tuple[Modifier, ...]:
    """Return the modifiers for some settings: all of the suite's, and those of other packages that have a setting here.

    They act in the order in which they were registered.

    Args:
        settings: some of the settings in `MODIFIERS`, by name.
        body: the body of the task.
        blocks: blocks of the task's observation, by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    chosen_modifiers = {MODIFIERS[checks.name(name, MODIFIERS, "modifier")] for name in settings}
    chosen_modifiers.update(SUITE_MODIFIERS)
    # In the order of registration, not of the settings: files sort these.
    modifiers = [modifier for modifier in dict.fromkeys(MODIFIERS.values()) if modifier in chosen_modifiers]
    values: dict[str, Any] = {}
    for modifier in modifiers:
        values |= modifier.defaults
    values |= settings
    return tuple(modifier.of(values, body, blocks) for modifier in modifiers)


def bounds() -> dict[str, tuple[float, float]]:
    """Return the lowest and highest number by name of the setting; both ends of a range lie between them."""
    limits: dict[str, tuple[float, float]] = {}
    for modifier in MODIFIERS.values():
        limits |= modifier.bounds
    return limits
