"""Films and sheets of clips: the body alone or on plain ground, from all around."""

import numpy as np
import pytest

from arc_suite.animation import clips as export
from arc_suite.animation.clips import filming
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS

BODY, SIZE = ROBOTS["tick"], 48


@pytest.fixture(scope="module")
def idle():
    (clip,) = export.clips(Setup.of(BODY, "steer"), ["idle"], fps=1)
    return clip


@pytest.mark.slow
def test_a_sheet_has_a_row_for_each_direction(idle):
    sheet = filming.sprite_sheet(BODY, idle, SIZE, 4, transparent=True)
    columns = len(idle.times) - 1
    assert sheet.shape == (4 * SIZE, columns * SIZE, 4) and sheet.dtype == np.uint8
    rows = [row[:, :SIZE] for row in np.split(sheet, 4)]
    for row in rows:
        assert 0.1 < (row[..., 3] > 0).mean() < 0.7 and not row[[0, -1], :, 3].any() and not row[:, [0, -1], 3].any()
    # Seen from either side the outline is the same, mirrored.
    assert abs(rows[0][..., 3].astype(int) - rows[2][:, ::-1, 3]).mean() < 25.0
    assert abs(rows[0][..., 3].astype(int) - rows[1][..., 3]).mean() > 5.0


@pytest.mark.slow
def test_a_film_is_as_long_as_its_loop(idle):
    plain = list(filming.film_pictures(BODY, idle, SIZE))
    assert len(plain) == len(idle.times) - 1
    assert plain[0].shape == (SIZE, SIZE, 3) and plain[0].std() > 10.0
    turning = list(filming.film_pictures(BODY, idle, SIZE, turntable=True))
    assert len(turning) == len(plain) * round(6.0 / idle.motion.seconds)
    np.testing.assert_array_equal(turning[0], plain[0])
    assert (turning[-1] != plain[-1]).any()
