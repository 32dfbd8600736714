"""MuJoCo Warp on a processor: slow, and the only implementation of terrain."""

import numpy as np
import pytest
from conftest import compiled, walked

pytest.importorskip("warp", reason="of the extra `mjx-warp`: make check-mjx-release")
pytestmark = pytest.mark.release

SEEDS = 10


@pytest.mark.parametrize(("task", "apart"), [("rough", 0.02), ("stairs", 0.03)])
def test_terrain(task, apart):
    """Of Tick: walks of Leaper on terrain scatter, by .2 of the distance if actions change by 1e-5."""
    env, start, step = compiled("tick", task, impl="warp", worlds=SEEDS)
    state, environments, ours, theirs = walked(env, start, step, 300)
    distances = env.task.progress(state.info["memory"])["distance"], environments.task.progress["distance"]
    assert np.mean(distances[0]) == pytest.approx(np.mean(distances[1]), rel=0.01)
    assert ours.sum() == pytest.approx(theirs.sum(), rel=apart)
    np.testing.assert_array_equal(state.metrics["overflow"], np.zeros(SEEDS))


def test_overflow_is_told(monkeypatch):
    """Tables of two contacts a world: Warp drops the others in the steps that have more, and says so."""
    from arc_suite.learning.worlds import device

    monkeypatch.setattr(device, "table_sizes", lambda model: (2, 64))
    compiled.cache_clear()
    _, start, step = compiled("leaper", impl="warp", worlds=2)
    state, overflows = start(np.arange(2)), []
    for _ in range(6):  # the first ones in the air
        state = step(state, np.zeros((2, 12)))
        overflows.append(np.asarray(state.metrics["overflow"]))
    compiled.cache_clear()
    assert np.any(overflows) and not np.all(overflows)
