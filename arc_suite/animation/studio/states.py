"""The values of all widgets of the page as one state, and the history of states for undo and redo."""

import dataclasses
import json
import math
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.animation import player_controls
from arc_suite.animation.studio.sketch import Sketch

_MAX_PAUSE = 1.0  # s; changes of one widget that follow each other sooner are one change
_MAX_STATES = 200  # that undo can return to


@dataclasses.dataclass(frozen=True)
class VisitorCommand:
    """What a visitor commands the creature to do.

    Attributes:
        by_hand: whether the other fields are the command; if not, the task's own command holds.
        forward, left, turn: velocity, -1 to 1 each.
        gait_now: name of the gait by command, or `player_controls.OWN_GAIT`.
        tempo: multiple of the gait's frequency.
        height, shift_forward, shift_left: numbers of a pose, standing heights.
        roll, pitch, yaw: numbers of a pose, rad.
    """

    by_hand: bool = True
    forward: float = 1.0
    left: float = 0.0
    turn: float = 0.0
    gait_now: str = player_controls.OWN_GAIT
    tempo: float = 1.0
    height: float = 0.0
    shift_forward: float = 0.0
    shift_left: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0


VELOCITY = ("forward", "left", "turn")  # names of the fields of the velocity
POSE = ("height", "shift_forward", "shift_left", "roll", "pitch", "yaw")  # names of the fields of the pose


class PageState(NamedTuple):
    """The values of the widgets of the page."""

    sketch: Sketch
    command: VisitorCommand = VisitorCommand()

    def value(self, name: str) -> Any:
        """Return a field of the sketch or of the command."""
        return getattr(self.sketch if hasattr(self.sketch, name) else self.command, name)

    def replace_fields(self, **values: Any) -> "PageState":
        """Return the state with other values of fields of the sketch or of the command."""
        sketch_values = {name: value for name, value in values.items() if hasattr(self.sketch, name)}
        command_values = {name: value for name, value in values.items() if name not in sketch_values}
        return PageState(
            sketch=dataclasses.replace(self.sketch, **sketch_values),
            command=dataclasses.replace(self.command, **command_values),
        )

    @property
    def velocity(self) -> list[float] | None:
        """Return the velocity (3,) by command; None where the task's own command holds."""
        return self._command_values(VELOCITY)

    @property
    def pose(self) -> list[float] | None:
        """Return the pose (6,) by command; None where the task's own holds."""
        return self._command_values(POSE)

    @property
    def gait(self) -> tuple[str | None, float]:
        """Return the gait by command, None for the task's own, and the multiple of its frequency."""
        if not self.command.by_hand:
            return None, 1.0
        return self.command.gait_now, self.command.tempo

    def _command_values(self, names: tuple[str, ...]) -> list[float] | None:
        if not self.command.by_hand:
            return None
        return [getattr(self.command, name) for name in names]


class Edits(NamedTuple):
    """The present state with the states before it and those that undo has left.

    Attributes:
        now: the present state.
        before: earlier states, the latest last.
        after: states that were undone; redo takes the first.
        latest: name of what was changed last, and when, s.
    """

    now: PageState
    before: tuple[PageState, ...] = ()
    after: tuple[PageState, ...] = ()
    latest: tuple[str, float] = ("", -math.inf)


def record_edit(edits: Edits, state: PageState, name: str, time: float) -> Edits:
    """Return the history with a new present state.

    Args:
        edits: the history so far.
        state: the new state.
        name: name of what has changed. Changes of one name that follow each other at once, as in a drag, are one
            change.
        time: time of the change, s.
    """
    if state == edits.now:
        return edits
    latest_name, latest_time = edits.latest
    continues_latest = name == latest_name and time - latest_time < _MAX_PAUSE
    before = edits.before if continues_latest else (*edits.before, edits.now)[-_MAX_STATES:]
    return Edits(now=state, before=before, after=(), latest=(name, time))


def undo(edits: Edits) -> Edits:
    """Return the history at the state before; the same history if there is none."""
    if not edits.before:
        return edits
    return Edits(now=edits.before[-1], before=edits.before[:-1], after=(edits.now, *edits.after))


def redo(edits: Edits) -> Edits:
    """Return the history at the state that was undone last; the same history if there is none."""
    if not edits.after:
        return edits
    return Edits(now=edits.after[0], before=(*edits.before, edits.now), after=edits.after[1:])


def to_json(state: PageState) -> str:
    """Return a state as JSON: the fields that differ from the defaults."""
    return json.dumps(
        {"sketch": _changed_fields(state.sketch), "command": _changed_fields(state.command)},
        indent=2,
    )


def _changed_fields(part: Sketch | VisitorCommand) -> dict[str, Any]:
    """Return the fields of a sketch or of a command that differ from the defaults."""
    changed_fields = {}
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if value != field.default:
            changed_fields[field.name] = value
    return changed_fields


def is_state(text: str) -> bool:
    """Return whether a text is meant as a state, and not as the spec of a body."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(value, dict) and set(PageState._fields) <= set(value)


def from_json(text: str) -> PageState:
    """Return the state that a text describes.

    Whether its names and numbers suit the body and the task turns out when the sketch is opened.

    Raises:
        ValueError: an unknown field, or a value of another kind.
    """
    value = json.loads(text)
    sketch = _read(Sketch, value["sketch"], "sketch")
    command = _read(VisitorCommand, value["command"], "command")
    return PageState(sketch, command)


def _read(part_class: type, value: Any, part_name: str) -> Any:
    """Return the sketch or the command that a value of JSON describes.

    Args:
        part_class: `Sketch` or `VisitorCommand`.
        value: value of JSON.
        part_name: name with which errors begin.
    """
    defaults = {field.name: field.default for field in dataclasses.fields(part_class)}
    fields = {}
    for name, field_value in checks.mapping(part_name, value).items():
        checks.name(name, defaults, f"field of the {part_name}")
        check = _CHECKS[type(defaults[name])]
        fields[name] = check(f"{part_name}.{name}", field_value)
    return part_class(**fields)


def _check_text(what: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{what}: expected a text, got {checks.preview(value)}")
    return value


def _check_pairs(what: str, value: Any) -> tuple:
    """Return pairs of a name with a number, for `lengths`, or with three numbers, for `ends`."""
    pairs: list[tuple[str, Any]] = []
    for pair in value if isinstance(value, list) else [value]:
        is_pair = isinstance(pair, list) and len(pair) == 2 and isinstance(pair[0], str)
        if not is_pair:
            raise ValueError(f"{what}: expected pairs of a name and its value, got {checks.preview(value)}")
        name, content = pair
        if what.endswith("ends"):
            pairs.append((name, tuple(checks.array(what, content, 3).tolist())))
        else:
            pairs.append((name, checks.number(what, content)))
    return tuple(pairs)


# Checks of a field by the type of its default: they take how errors name the field, and its value.
_CHECKS: dict[type, Any] = {
    bool: checks.boolean,
    int: lambda what, value: checks.integer(what, value, 0),
    float: checks.number,
    str: _check_text,
    tuple: _check_pairs,
}
