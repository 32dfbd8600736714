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

# The suite's own, from the body outwards. A modified task has all of them.
OWN: tuple[type[Modifier], ...] = (
    *(Contacts, Masses, Sensors, Control, Motors, Kicks, Pushes),
    *(Delay, ExcludedBlocks, ObservationNoise, History),
)

# By name of a setting: the modifier that has it. `registration.register` adds those of other packages.
MODIFIERS: dict[str, type[Modifier]] = {name: kind for kind in OWN for name in kind.defaults}


def fit_modifiers(settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> tuple[Modifier, ...]:
    """Return the modifiers that settings ask for: all of the suite's own, and those of other packages that are named.

    Args:
        settings: some of the settings in `MODIFIERS`, by name.
        body: that is modified.
        blocks: of the task's observation, by name.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
    """
    kinds = dict.fromkeys(OWN)
    for name in settings:
        kinds[MODIFIERS[checks.name(name, MODIFIERS, "modifier")]] = None
    values = {name: value for kind in kinds for name, value in kind.defaults.items()} | dict(settings)
    return tuple(kind.of(values, body, blocks) for kind in kinds)


def bounds() -> dict[str, tuple[float, float]]:
    """Return the bounds of numbers, or of each of two, by name of the setting."""
    return {name: limits for kind in dict.fromkeys(MODIFIERS.values()) for name, limits in kind.bounds.items()}
