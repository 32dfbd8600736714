"""What the whole page says, as one value, and a history of such values: undo and redo replace the value."""

import dataclasses
import json
import math
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.animation import player_controls
from arc_suite.animation.studio.sketch import Sketch

_PAUSE = 1.0  # s; changes of one widget that follow each other sooner are one change
_LONGEST = 200  # states that are kept


@dataclasses.dataclass(frozen=True)
class VisitorCommand:
    """What a visitor asks of the creature.

    Attributes:
        by_hand: whether all others hold; else the task's own command does.
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


VELOCITY = ("forward", "left", "turn")  # fields of the velocity
POSE = ("height", "shift_forward", "shift_left", "roll", "pitch", "yaw")  # and of a pose


class PageState(NamedTuple):
    """What the widgets of the page say."""

    sketch: Sketch
    command: VisitorCommand = VisitorCommand()

    def value(self, name: str) -> Any:
        """Return a field of the sketch or of the command."""
        return getattr(self.sketch if hasattr(self.sketch, name) else self.command, name)

    def replace_fields(self, **values: Any) -> "PageState":
        """Return the state with other values of fields of the sketch or of the command."""
        changed = self
        for name, value in values.items():
            part = "sketch" if hasattr(self.sketch, name) else "command"
            changed = changed._replace(**{part: dataclasses.replace(getattr(changed, part), **{name: value})})
        return changed

    @property
    def velocity(self) -> list[float] | None:
        """Return the velocity (3,) that is asked for; None where the task's own command holds."""
        return self._asked(VELOCITY)

    @property
    def pose(self) -> list[float] | None:
        """Return the pose (6,) that is asked for; None where the task's own holds."""
        return self._asked(POSE)

    @property
    def gait(self) -> tuple[str | None, float]:
        """Return the gait that is asked for, None for the task's own, and the multiple of its frequency."""
        return (self.command.gait_now, self.command.tempo) if self.command.by_hand else (None, 1.0)

    def _asked(self, names: tuple[str, ...]) -> list[float] | None:
        return [getattr(self.command, name) for name in names] if self.command.by_hand else None


class Edits(NamedTuple):
    """A state with those before it and those that undo has left.

    Attributes:
        now: the state.
        before: earlier states, the latest last.
        after: states that were undone, the next one first.
        latest: name of what changed last, and when, s.
    """

    now: PageState
    before: tuple[PageState, ...] = ()
    after: tuple[PageState, ...] = ()
    latest: tuple[str, float] = ("", -math.inf)


def record_edit(edits: Edits, state: PageState, name: str, time: float) -> Edits:
    """Return the history with a new state.

    Args:
        edits: so far.
        state: of now.
        name: of what has changed; while it is dragged, all its changes are one.
        time: of now, s.
    """
    if state == edits.now:
        return edits
    goes_on = name == edits.latest[0] and time - edits.latest[1] < _PAUSE
    before = edits.before if goes_on else (*edits.before, edits.now)[-_LONGEST:]
    return Edits(state, before, (), (name, time))


def undo(edits: Edits) -> Edits:
    """Return the history at the state before; the same if there is none."""
    *before, now = (*edits.before, edits.now)
    return Edits(before[-1], tuple(before[:-1]), (now, *edits.after)) if before else edits


def redo(edits: Edits) -> Edits:
    """Return the history at the state that was undone last; the same if there is none."""
    return Edits(edits.after[0], (*edits.before, edits.now), edits.after[1:]) if edits.after else edits


def to_json(state: PageState) -> str:
    """Return a state as JSON: what differs from the defaults."""
    parts = {}
    for name, part in state._asdict().items():
        fields = {field.name: (getattr(part, field.name), field.default) for field in dataclasses.fields(part)}
        parts[name] = {field: value for field, (value, default) in fields.items() if value != default}
    return json.dumps(parts, indent=2)


def is_state(text: str) -> bool:
    """Return whether a text is meant as a state, and not as the spec of a body."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(value, dict) and set(PageState._fields) <= set(value)


def from_json(text: str) -> PageState:
    """Return the state that a text describes; whether its names and numbers fit turns out when it is opened.

    Raises:
        ValueError: an unknown field, or a value of another kind.
    """
    value = json.loads(text)
    return PageState(_read(Sketch, value["sketch"], "sketch"), _read(VisitorCommand, value["command"], "command"))


def _read(kind: type, value: Any, what: str) -> Any:
    """Return a sketch or a command, of JSON."""
    defaults = {field.name: field.default for field in dataclasses.fields(kind)}
    given = {}
    for name, each in checks.mapping(what, value).items():
        checks.name(name, defaults, f"field of the {what}")
        given[name] = _KINDS[type(defaults[name])](f"{what}.{name}", each)
    return kind(**given)


def _text(what: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{what}: expected a text, got {checks.preview(value)}")
    return value


def _pairs(what: str, value: Any) -> tuple:
    """Pairs of a name with a number or with three of them."""
    found = []
    for pair in value if isinstance(value, list) else [value]:
        name, given = pair if isinstance(pair, list) and len(pair) == 2 else (None, None)
        if not isinstance(name, str):
            raise ValueError(f"{what}: expected pairs of a name and its value, got {checks.preview(value)}")
        several = what.endswith("ends")
        found.append((name, tuple(checks.array(what, given, 3).tolist()) if several else checks.number(what, given)))
    return tuple(found)


_KINDS: dict[type, Any] = {
    bool: checks.boolean,
    int: lambda what, value: checks.integer(what, value, 0),
    float: checks.number,
    str: _text,
    tuple: _pairs,
}
