"""States of the page, their history and their files; no viser."""

import pytest
from refusals import refused

from arc_suite.animation.studio.sketch import Sketch
from arc_suite.animation.studio.states import (
    Edits,
    PageState,
    VisitorCommand,
    from_json,
    is_state,
    record_edit,
    redo,
    to_json,
    undo,
)


def changed(edits, time, **values):
    return record_edit(edits, edits.now.replace_fields(**values), next(iter(values)), time)


def test_undo_and_redo_walk_over_states():
    first = Edits(PageState(Sketch()))
    made = changed(changed(changed(first, 0.0, legs=6), 5.0, turn=0.5), 10.0, task="steer")
    assert made.now == PageState(Sketch(legs=6, task="steer"), VisitorCommand(turn=0.5))
    back = undo(undo(made))
    assert back.now == PageState(Sketch(legs=6)) and redo(redo(back)).now == made.now
    assert undo(undo(back)).now == first.now and redo(made) == made
    assert redo(changed(back, 20.0, legs=8)).now == PageState(Sketch())  # another change: nothing is left to redo


def test_changes_of_one_widget_in_quick_succession_are_one():
    dragged = Edits(PageState(Sketch()))
    for step in range(5):
        dragged = changed(dragged, 0.5 * step, scale=1.1 + step)
    assert undo(dragged).now == PageState(Sketch())
    paused = changed(dragged, 10.0, scale=2.0)
    assert undo(paused).now == dragged.now
    assert len(changed(paused, 10.1, width=2.0).before) == 3 and changed(paused, 10.1, scale=2.0) == paused


def test_the_task_commands_where_no_hand_does():
    assert PageState(Sketch()).velocity == [1.0, 0.0, 0.0] and PageState(Sketch()).gait == ("own", 1.0)
    state = PageState(Sketch(), VisitorCommand(by_hand=False, tempo=1.3))
    assert state.velocity is None and state.pose is None and state.gait == (None, 1.0)


FULL = PageState(
    Sketch(legs=6, lengths=(("lower", 1.2),), ends=(("l1_lower", (0.0, 0.1, -0.3)),), kicks=0.5, file="{}"),
    VisitorCommand(by_hand=False, pitch=0.1),
)


def test_a_state_is_read_back():
    assert from_json(to_json(FULL)) == FULL and from_json(to_json(PageState(Sketch()))) == PageState(Sketch())
    assert is_state(to_json(FULL))
    assert not any(map(is_state, ('{"name": "x"}', "[", "[" * 100_000, "<mujoco/>", '["sketch", "command"]')))


@pytest.mark.parametrize(
    ("sketch", "message"),
    [
        ('{"leg": 4}', "unknown field of the sketch 'leg'; did you mean 'legs'?"),
        ('{"legs": 1.5}', "sketch.legs: expected an integer from 0, got 1.5"),
        ('{"scale": NaN}', "sketch.scale: expected a finite number, got nan"),
        ('{"task": 3}', "sketch.task: expected a text, got 3"),
        ('{"lengths": {"lower": 2}}', "sketch.lengths: expected pairs of a name and its value, got {'lower': 2}"),
        ('{"ends": [["l1_lower", [1, 2]]]}', "sketch.ends: expected one finite number or 3 of them, got [1, 2]"),
        ("[]", "sketch: expected a mapping of names to values, got []"),
    ],
)
def test_a_broken_state_is_one_line(sketch, message):
    with refused(message, begins=True):
        from_json(f'{{"sketch": {sketch}, "command": {{}}}}')
