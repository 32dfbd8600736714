"""Rules that end phases, numbers alone."""

import pytest

from arc_suite.learning.agents.stopping import Patience, threshold


def length(rule, losses, patience=3, first=None):
    """How many looks a phase takes."""
    state = Patience(losses[0] if first is None else first)
    for look, loss in enumerate(losses, start=1):
        state = state.checked(rule, loss, 0.001, 1)
        if state.waited >= patience:
            return look
    return None


def test_where_losses_are_positive_the_rules_agree():
    assert threshold("published", 2.0, 0.001) == pytest.approx(threshold("sign_safe", 2.0, 0.001)) == 1.998


def test_where_losses_are_negative_the_published_bar_lies_above_the_best():
    assert threshold("published", -2.0, 0.001) == pytest.approx(-1.998)
    assert threshold("sign_safe", -2.0, 0.001) == pytest.approx(-2.002)


@pytest.mark.parametrize(("rule", "stops"), [("published", None), ("sign_safe", 3)])
def test_a_loss_that_stays_as_it_is(rule, stops):
    """The trap: the published rule counts standing still below zero as improvement, and never ends."""
    assert length(rule, [-100.0] * 50) == stops


@pytest.mark.parametrize(("rule", "stops"), [("published", None), ("sign_safe", 3)])
def test_a_loss_that_creeps_up(rule, stops):
    """By less than 0.1 % a look, the published bar follows it down."""
    assert length(rule, [-100.0 * 0.9995**look for look in range(50)]) == stops


@pytest.mark.parametrize("rule", ["published", "sign_safe"])
def test_a_loss_that_rises(rule):
    assert length(rule, [-100.0, -99.0, -98.0, -97.0, -96.0], first=-100.5) == 3


@pytest.mark.parametrize("rule", ["published", "sign_safe"])
def test_a_loss_that_falls(rule):
    assert length(rule, [-100.0 * 1.01**look for look in range(50)]) is None


def test_an_improvement_takes_the_waiting_back():
    state = Patience(-100.0).checked("sign_safe", -99.0, 0.001, 1000).checked("sign_safe", -99.0, 0.001, 1000)
    assert state == Patience(-100.0, 2000)
    assert state.checked("sign_safe", -101.0, 0.001, 1000) == Patience(-101.0, 0)
