"""Films and sheets of clips: the body alone or on plain ground, from all around."""

import json

import numpy as np
import pytest
from PIL import Image

from arc_suite import animation, motions
from arc_suite.animation import clips as export
from arc_suite.animation.clips import filming, sprites
from arc_suite.envs.setup import Setup
from arc_suite.models.standing import measure_standing
from arc_suite.robots import ROBOTS

BODY, SIZE = ROBOTS["tick"], 48


@pytest.fixture(scope="module")
def idle():
    (clip,) = export.clips(Setup.of(BODY, "steer"), ["idle"], fps=1)
    return clip


@pytest.mark.slow
def test_a_sheet_has_a_row_for_each_direction(idle):
    made = filming.sprite_sheet(BODY, [idle], SIZE, 4, transparent=True)
    sheet, columns = made.picture, len(idle.times) - 1
    assert sheet.shape == (4 * SIZE, columns * SIZE, 4) and sheet.dtype == np.uint8
    rows = [row[:, :SIZE] for row in np.split(sheet, 4)]
    for row in rows:
        assert 0.1 < (row[..., 3] > 0).mean() < 0.7 and not row[[0, -1], :, 3].any() and not row[:, [0, -1], 3].any()
    columns_with_body = np.flatnonzero(np.any([row[..., 3].any(axis=0) for row in rows], axis=0))
    assert np.ptp(columns_with_body) > 0.85 * SIZE
    lowest = [np.flatnonzero(row[..., 3].any(axis=1)).max() for row in rows]  # of feet nearer than the torso
    assert made.ground_line < min(lowest) < made.ground_line + 0.2 * SIZE
    # Feet, and what is nearer to the camera or reaches further ahead.
    width = np.ptp(np.flatnonzero((rows[0][..., 3] > 0).any(axis=0))) / made.pixels_per_meter
    assert 1.2 < width / np.ptp(measure_standing(BODY).soles[:, 0]) < 1.8
    left_out = {"tuned": "spider has no preset tuned"}
    assert sprites.describe_sheet("tick.png", [idle], made, left_out)["meta"]["left_out"] == left_out
    # Seen from either side the outline is the same, mirrored.
    assert abs(rows[0][..., 3].astype(int) - rows[2][:, ::-1, 3]).mean() < 25.0
    assert abs(rows[0][..., 3].astype(int) - rows[1][..., 3]).mean() > 5.0


@pytest.mark.slow
def test_a_clip_that_makes_the_others_small_is_named(idle):
    """As a death, in which the body is pushed over a standing height and a half aside."""
    aside = idle.motion.positions + np.array([1.5 * BODY.torso.standing_height, 0.0, 0.0])
    fall = idle._replace(name="fall", motion=idle.motion._replace(positions=aside))
    line = r"^clips fall need more room than the others: in a sheet without them the body is 1\.\d times as large$"
    with pytest.warns(UserWarning, match=line):
        filming.sprite_sheet(BODY, [idle, idle, fall], SIZE, 1)


@pytest.mark.slow
def test_a_film_is_as_long_as_its_loop(idle):
    plain = list(filming.film_pictures(BODY, idle, SIZE))
    assert len(plain) == len(idle.times) - 1
    assert plain[0].shape == (SIZE, SIZE, 3) and plain[0].std() > 10.0
    turning = list(filming.film_pictures(BODY, idle, SIZE, turntable=True))
    assert len(turning) == len(plain) * round(6.0 / idle.motion.seconds)
    np.testing.assert_array_equal(turning[0], plain[0])
    assert (turning[-1] != plain[-1]).any()


@pytest.mark.slow
def test_an_importer_reads_where_cells_are(tmp_path):
    """The names are those of Aseprite's arrays: Phaser and PixiJS look frames up by their number."""
    path = tmp_path / "tick.PNG"
    idle, attack = animation.animate("tick", path, ["idle", "attack"], fps=3, size=32, directions=2)
    sheet = json.loads((tmp_path / "tick.sprites.json").read_text())
    frames, meta = sheet["frames"], sheet["meta"]
    columns = len(idle.times) - 1  # of a loop the last frame is the first one
    attack_columns = len(attack.times)
    assert attack_columns < columns
    assert (meta["image"], meta["rows"], meta["columns"], meta["format"]) == ("tick.PNG", 4, columns, "RGB888")
    assert meta["left_out"] == {}
    assert meta["size"] == {"w": 32 * columns, "h": 4 * 32}
    assert [frame["filename"] for frame in frames] == [str(number) for number in range(2 * (columns + attack_columns))]
    assert frames[columns + 1]["frame"] == {"x": 32, "y": 32, "w": 32, "h": 32}
    assert frames[-1]["frame"] == {"x": 32 * (attack_columns - 1), "y": 96, "w": 32, "h": 32}
    first = 2 * columns  # of attack
    assert [(tag["name"], tag["from"], tag["to"], tag.get("repeat")) for tag in meta["frameTags"]] == [
        ("idle_0", 0, columns - 1, None),
        ("idle_180", columns, 2 * columns - 1, None),
        ("attack_0", first, first + attack_columns - 1, "1"),
        ("attack_180", first + attack_columns, first + 2 * attack_columns - 1, "1"),
    ]
    milliseconds = sum(frame["duration"] for frame in frames[:columns])
    assert milliseconds == round(1000.0 * columns / meta["frameTags"][0]["fps"])
    assert frames[-1]["anchor"] == {"x": 0.5, "y": pytest.approx(meta["ground_line"] / 32, abs=1e-3)}
    # The attack reaches further than idle, and both have one scale.
    picture = np.asarray(Image.open(path))
    assert meta["pixels_per_meter"] < 44.285 * 32 / SIZE
    assert np.ptp(picture[64:, 32 * attack_columns :], axis=(0, 1)).max() == 0  # cells after the last frame
    assert np.ptp(picture[64:, : 32 * attack_columns], axis=(0, 1)).max() > 0


@pytest.mark.slow
def test_numbers_of_none_are_the_defaults(tmp_path):
    height = BODY.torso.standing_height
    level = np.tile((1.0, 0.0, 0.0, 0.0), (2, 1))
    angles = np.zeros((2, len(BODY.joint_names)))
    motion = motions.make(BODY, "stand", 1.0, False, np.tile((0.0, 0.0, height), (2, 1)), level, angles)
    motions.save(motion, tmp_path / "stand.npz")
    pictures = []
    for options in ({}, {"size": None, "directions": None}):
        animation.animate(BODY, tmp_path / "stand.png", str(tmp_path / "stand.npz"), fps=1, **options)
        pictures.append((tmp_path / "stand.png").read_bytes())
    assert pictures[0] == pictures[1]
    with Image.open(tmp_path / "stand.png") as picture:
        assert picture.size == (2 * 480, 8 * 480)
