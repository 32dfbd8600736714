"""Versions that are recorded with results."""

import mujoco
import numpy as np

from arc_suite import versions


def test_versions():
    found = versions.recorded()
    assert list(found) == ["arc_suite", "mujoco", "dm_control", "numpy"]
    assert found["mujoco"] == mujoco.__version__
    assert found["numpy"] == np.__version__
