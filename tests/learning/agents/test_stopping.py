"""Rules that end phases, numbers alone."""

import pytest

from arc_suite.learning.agents.stopping import Patience, threshold


def length(rule, losses, patience=3, first=None):
    """How many looks a phase takes."""
    state = Patience(losses[0] if first is None else first)
    for look, loss in enumerate(losses, start=1):
        state = state.after_check(rule, loss, 0.001, 1)
        if state.waited >= patience:
            return look
    return None


def test_where_losses_are_positive_the_rules_agree_else_the_published_bar_lies_above_the_best():
    assert threshold("published", 2.0, 0.001) == pytest.approx(threshold("sign_safe", 2.0, 0.001)) == 1.998
    assert threshold("published", -2.0, 0.001) == pytest.approx(-1.998)
    assert threshold("sign_safe", -2.0, 0.001) == pytest.approx(-2.002)


@pytest.mark.parametrize(
    ("losses", "first", "published"),
    [
        # The trap: the published rule counts standing still below zero as improvement, and never ends.
        ([-100.0] * 50, None, None),
        # By less than 0.1 % a look, the published bar follows a loss down that creeps up.
        ([-100.0 * 0.9995**look for look in range(50)], None, None),
        ([-100.0, -99.0, -98.0, -97.0, -96.0], -100.5, 3),
    ],
    ids=["stays", "creeps up", "rises"],
)
def test_a_loss_that_does_not_fall(losses, first, published):
    assert (length("published", losses, first=first), length("sign_safe", losses, first=first)) == (published, 3)


@pytest.mark.parametrize("rule", ["published", "sign_safe"])
def test_a_loss_that_falls(rule):
    assert length(rule, [-100.0 * 1.01**look for look in range(50)]) is None


def test_an_improvement_takes_the_waiting_back():
    state = Patience(-100.0).after_check("sign_safe", -99.0, 0.001, 1000).after_check("sign_safe", -99.0, 0.001, 1000)
    assert state == Patience(-100.0, 2000)
    assert state.after_check("sign_safe", -101.0, 0.001, 1000) == Patience(-101.0, 0)
