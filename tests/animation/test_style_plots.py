"""Pictures of tracks."""

import math

import interpreters
import numpy as np
import pytest
from matplotlib.colors import to_hex
from synthetic import DT, synthetic

import arc_suite
from arc_suite.animation.style_plots import BLUE, GAIT_PICTURES, PALE, PICTURES, VERMILION, gait
from arc_suite.cpg import Demonstrator
from arc_suite.style import record
from arc_suite.style.tracks import UNTIMED


@pytest.mark.long
@pytest.mark.parametrize("count", [1, 2])
def test_pictures(tmp_path, count):
    tracks = {"left": synthetic(late=(0, 2, 0, 0)), "right": synthetic(course=math.pi / 2, dragged=0)}
    tracks = dict(list(tracks.items())[:count])
    assert list(PICTURES) == ["gait", "reward", "speed", "path"]
    for name, draw in PICTURES.items():
        draw(tracks).savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 5000


@pytest.mark.slow
def test_pictures_of_a_task_without_a_gait_or_a_way_to_go():
    walk = synthetic()
    steer, stay = (
        walk._replace(target_velocity=math.nan, **changes) for changes in ({}, UNTIMED | {"parameters": None})
    )
    for track, names in ((walk, set(PICTURES)), (steer, set(PICTURES)), (stay, set(PICTURES) - set(GAIT_PICTURES))):
        figures = {name: PICTURES[name]({"a": track}) for name in names}
        legend = {text.get_text() for text in figures["speed"].legends[0].get_texts()}
        told = {"target: 0.50 m/s"} if track is walk else set()
        assert legend == {"a: 0.50 m/s"} | told
        assert figures["path"].axes[0].get_xlabel() == ("x (m), target direction" if track is walk else "x (m)")
    stands = stay._replace(target_velocity=0.0)  # a target without a gait has no band of velocities
    assert len(PICTURES["speed"]({"a": stands}).legends[0].get_texts()) == 2


def test_gait_diagram_shows_stance_and_schedule():
    track = synthetic(late=(0, 4, 0, 0))
    (axis,) = gait({"a": track}).axes
    seconds = dict.fromkeys((PALE, BLUE, VERMILION), 0.0)
    for bars in axis.collections:
        if bars.get_paths():
            widths = [np.ptp(bar.vertices[:, 0]) for bar in bars.get_paths()]
            seconds[to_hex(bars.get_facecolor()[0]).upper()] += sum(widths)
    # Four seconds are five cycles of 16 steps; each of four feet shall stand for 8 of them, one is 4 late.
    assert seconds == pytest.approx({PALE: 20 * 8 * DT, BLUE: (20 * 8 - 5 * 4) * DT, VERMILION: 5 * 4 * DT})
    texts = [text.get_text() for text in axis.texts]
    assert "50 %" in texts
    assert "+0.25 cycles" in texts
    assert "duty factor\n(0.50 wanted)" in texts


def test_a_picture_of_rewards_names_its_tracks():
    tracks = {"slow": synthetic(), "fast": synthetic(late=(0, 4, 0, 0))}
    titles = [axis.get_title(loc="left") for axis in PICTURES["reward"](tracks).axes]
    assert titles == [f"{label}: return {track.rewards.sum():.0f}" for label, track in tracks.items()]


@pytest.mark.slow
def test_pictures_of_a_track_of_one_step():
    track = record(arc_suite.load("tick", "walk"), Demonstrator("tick", "medium"), seed=0, max_steps=1)
    for draw in PICTURES.values():
        draw({"a": track})


@pytest.mark.slow
def test_metrics_come_without_matplotlib():
    assert interpreters.printed("import sys, arc_suite.style; print('matplotlib' in sys.modules)") == ["False"]
