"""Early-stopping rules of stabilization phases, on a validation loss.

The loss is that of the policy on the validation set, about -Q. The published rule counts a loss below 0.999 times
the best as an improvement. Losses here are negative, and 0.999 times a negative best is worse than the best: a loss
up to 0.1 % worse counts as an improvement and lowers the bar. So the rule ends a phase only where the loss rises by
more in many checks in a row. The sign-safe rule expects a loss lower by 0.1 % of the best's size.
"""

from typing import NamedTuple


def threshold(rule: str, best: float, improvement: float) -> float:
    """Return the loss below which a rule, "published" or "sign_safe", counts an improvement on the best."""
    return (1.0 - improvement) * best if rule == "published" else best - improvement * abs(best)


class Patience(NamedTuple):
    """State of the early stopping.

    Attributes:
        best: loss at the latest improvement.
        waited: updates since then.
    """

    best: float
    waited: int = 0

    def after_check(self, rule: str, loss: float, improvement: float, updates: int) -> "Patience":
        """Return the state after `updates` more updates and a validation loss."""
        if loss < threshold(rule, self.best, improvement):
            return Patience(loss)
        return self._replace(waited=self.waited + updates)
