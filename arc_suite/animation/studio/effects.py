"""Widgets without effect on a creature; the page hides them."""

from arc_suite.animation import player_controls
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.sketch import LEGS, RANDOM
from arc_suite.animation.studio.states import POSE, VELOCITY, VisitorCommand
from arc_suite.bodies import torsos
from arc_suite.bodies.shaping import IMPORT_FIELDS, Shape, parts_with_lengths

_PROPORTIONS = Shape._fields[: Shape._fields.index("links")]  # fields of a shape that are about the body as a whole


def idle_fields(creature: Creature, command: VisitorCommand) -> frozenset[str]:
    """Return the names of the fields of a page's state that change nothing of a creature.

    Args:
        creature: creature that walks.
        command: the present one.
    """
    sketch = creature.sketch
    setup = creature.setup
    task_class = setup.kind
    task = creature.environment.task.definition
    typed_settings = sketches.settings_field(sketch)  # settings of the text field replace those of other widgets
    has_target_velocity = task.target_velocity is not None or task.parameters is not None
    takes_velocity = task.commands.get("command") == 3  # numbers: forward, left, turn
    is_imported = setup.body.source is not None

    idle: list[str] = []
    if sketch.source != LEGS:
        idle += ["legs", "links", "layout"]
    if sketch.source != RANDOM:
        idle.append("seed")
    if not torsos.has_plain_torso(sketches.source_body(sketch)):
        idle += torsos.PARTS
    if is_imported:  # it keeps its torso
        idle += [field for field in _PROPORTIONS if field not in IMPORT_FIELDS]
    if not parts_with_lengths(setup.body):
        idle.append("lengths")
    if "gait" in typed_settings:
        idle.append("gait")
    if "target_velocity" in typed_settings or not has_target_velocity:
        idle.append("speed")
    if "arena" in typed_settings or task_class.own_arena:
        idle.append("ground")
    if "kicks" in typed_settings:
        idle.append("kicks")
    if sketch.policy != "cpg":
        idle.append("preset")
    if not task.commands:
        idle.append("by_hand")
    if not (command.by_hand and takes_velocity):
        idle += VELOCITY
    if not (command.by_hand and player_controls.is_directed(task)):
        idle += ["gait_now", "tempo", *POSE]
    return frozenset(idle)
