"""Which widgets change nothing of a creature: the page does not show them."""

from arc_suite.animation import player_controls
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.sketch import LEGS, RANDOM
from arc_suite.animation.studio.states import POSE, VELOCITY, VisitorCommand
from arc_suite.bodies.shaping import Shape

_SHAPE = (*Shape._fields[: Shape._fields.index("links")], "lengths")


def idle_fields(creature: Creature, command: VisitorCommand) -> frozenset[str]:
    """Return the fields of a state that change nothing of a creature, by name.

    Args:
        creature: that walks.
        command: of now.
    """
    sketch, setup, task = creature.sketch, creature.setup, creature.environment.task.definition
    field, by_hand, directs = sketches.settings_field(sketch), command.by_hand, player_controls.is_directed(task)
    rules = (
        (("legs", "links", "layout"), sketch.source != LEGS),
        (("seed",), sketch.source != RANDOM),
        (_SHAPE, setup.body.source is not None),  # an imported body keeps its shape
        (("gait",), "gait" in field),  # the field of settings comes before the widgets
        (("speed",), "target_velocity" in field or task.target_velocity is None and task.parameters is None),
        (("ground",), "arena" in field or setup.kind.own_arena),
        (("kicks",), "kicks" in field),
        (("preset",), sketch.policy != "cpg"),
        (("by_hand",), not task.commands),
        (VELOCITY, not by_hand or task.commands.get("command") != 3),
        (("gait_now", "tempo", *POSE), not by_hand or not directs),
    )
    return frozenset(name for names, holds in rules if holds for name in names)
