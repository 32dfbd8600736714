"""How laws move the joints of a body, by its motors or servos."""

import numpy as np

from arc_suite.cpg.law import Drive
from arc_suite.models.sizing import action_reaches, position_gains
from arc_suite.robots.spec import Body


def drive(body: Body, inertias: np.ndarray) -> Drive:
    """Return the drive of a sized body; see `sizing.position_gains`."""
    return Drive(*position_gains(body, inertias), action_reaches(body) if body.source else None)
