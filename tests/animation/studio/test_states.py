"""States of the page, their history and their files; no viser."""

import pytest
from refusals import refused

from arc_suite.animation.studio.sketch import Sketch
from arc_suite.animation.studio.states import (
    Command,
    Edits,
    State,
    edited,
    from_json,
    is_state,
    redone,
    to_json,
    undone,
)


def changed(edits, time, **values):
    return edited(edits, edits.now.having(**values), next(iter(values)), time)


def test_undo_and_redo_walk_over_states():
    first = Edits(State(Sketch()))
    made = changed(changed(changed(first, 0.0, legs=6), 5.0, turn=0.5), 10.0, task="steer")
    assert made.now == State(Sketch(legs=6, task="steer"), Command(turn=0.5))
    back = undone(undone(made))
    assert back.now == State(Sketch(legs=6)) and redone(redone(back)).now == made.now
    assert undone(undone(back)).now == first.now and redone(made) == made
    assert redone(changed(back, 20.0, legs=8)).now == State(Sketch())  # another change: nothing is left to redo


def test_changes_of_one_widget_in_quick_succession_are_one():
    dragged = Edits(State(Sketch()))
    for step in range(5):
        dragged = changed(dragged, 0.5 * step, scale=1.1 + step)
    assert undone(dragged).now == State(Sketch())
    paused = changed(dragged, 10.0, scale=2.0)
    assert undone(paused).now == dragged.now
    assert len(changed(paused, 10.1, width=2.0).before) == 3 and changed(paused, 10.1, scale=2.0) == paused


def test_the_task_commands_where_no_hand_does():
    assert State(Sketch()).velocity == [1.0, 0.0, 0.0] and State(Sketch()).gait == ("own", 1.0)
    state = State(Sketch(), Command(by_hand=False, tempo=1.3))
    assert state.velocity is None and state.pose is None and state.gait == (None, 1.0)


FULL = State(
    Sketch(legs=6, lengths=(("lower", 1.2),), ends=(("l1_lower", (0.0, 0.1, -0.3)),), kicks=0.5, file="{}"),
    Command(by_hand=False, pitch=0.1),
)


def test_a_state_is_read_back():
    assert from_json(to_json(FULL)) == FULL and from_json(to_json(State(Sketch()))) == State(Sketch())
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
