"""The history of the page's states; no viser."""

from arc_suite.animation.studio.sketch import Sketch
from arc_suite.animation.studio.states import Command, Edits, State, edited, redone, undone


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
