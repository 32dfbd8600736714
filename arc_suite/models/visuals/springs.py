"""How ornaments swing on the torso: the one table of their springs, for clips, pages and the studio."""

from typing import NamedTuple


class Spring(NamedTuple):
    """A damped spring that holds a bone in its direction on the torso.

    Attributes:
        frequency: rad / sqrt(h / g), without damping.
        damping: damping ratio, below 1.
        limit: degrees, that the bone swings to a side at most.
    """

    frequency: float
    damping: float
    limit: float


SPRINGS = {
    "antenna": Spring(frequency=2.5, damping=0.2, limit=30.0),
    "gun": Spring(frequency=2.5, damping=0.3, limit=12.0),
    "tail": Spring(frequency=1.8, damping=0.25, limit=40.0),
}
