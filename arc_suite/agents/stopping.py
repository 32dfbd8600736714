"""Ends stabilisation phases: rules that say when held-out data judge the critics no better any more.

The signal is the loss of the policy on held-out data, about -Q. The published rule counts a loss below 0.999
times the best as an improvement. Where losses are negative, as they are here, 0.999 times the best is worse than
the best: a loss up to 0.1 % worse counts as an improvement and lowers the bar, and the rule ends a phase only
where the loss rises by more in many looks in a row. The sign-safe rule asks for a loss that is lower by 0.1 % of
the best's size.
"""

from typing import NamedTuple


def threshold(rule: str, best: float, improvement: float) -> float:
    """Return the loss below which a rule, "published" or "sign_safe", sees an improvement on the best."""
    return (1.0 - improvement) * best if rule == "published" else best - improvement * abs(best)


class Patience(NamedTuple):
    """How a phase stands.

    Attributes:
        best: loss, as the rule sees it.
        waited: updates since then.
    """

    best: float
    waited: int = 0

    def looked(self, rule: str, loss: float, improvement: float, updates: int) -> "Patience":
        """Return how it stands after so many more updates and a look."""
        if loss < threshold(rule, self.best, improvement):
            return Patience(loss)
        return self._replace(waited=self.waited + updates)
