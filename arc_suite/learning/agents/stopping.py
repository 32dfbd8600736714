"""Early-stopping rules of stabilization phases, on a validation loss.

The loss is that of the policy on the validation set, about -Q.

The published rule counts a loss below 0.999 times the best loss as an improvement. Losses here are negative, and 0.999
times a negative best loss is above it. So a loss up to 0.1 % worse counts as an improvement, and becomes the best loss.
The rule ends a phase only where the loss rises by more in many checks in a row.

The sign-safe rule expects a loss that is lower by 0.1 % of the size of the best loss.
"""

from typing import NamedTuple


def threshold(rule: str, best: float, improvement: float) -> float:
    """Return the loss below which a rule counts an improvement.

    Args:
        rule: "published" or "sign_safe".
        best: the best loss so far.
        improvement: relative improvement that counts.
    """
    if rule == "published":
        return (1.0 - improvement) * best
    return best - improvement * abs(best)


class Patience(NamedTuple):
    """State of the early stopping.

    Attributes:
        best: loss at the latest improvement.
        waited: updates since then.
    """

    best: float
    waited: int = 0

    def after_check(self, rule: str, loss: float, improvement: float, updates: int) -> "Patience":
        """Return the state after a validation loss.

        Args:
            rule: "published" or "sign_safe".
            loss: the validation loss.
            improvement: relative improvement that counts.
            updates: made since the validation loss before.
        """
        if loss < threshold(rule, self.best, improvement):
            return Patience(loss)
        return self._replace(waited=self.waited + updates)
