"""Tables in Markdown."""

from collections.abc import Iterable, Sequence

import numpy as np


def table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (heads, ["---"] * len(heads), *lines))


def score_of_seeds(scores: Sequence[float]) -> str:
    """Return the mean of the scores (seeds,) as text, and each of them if there are several."""
    mean = f"{np.mean(scores):z.2f}"
    return f"{mean} ({', '.join(f'{score:z.2f}' for score in scores)})" if len(scores) > 1 else mean
