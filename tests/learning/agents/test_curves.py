"""Pictures of training: labels that can be read, and one color for an algorithm."""

import itertools

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="of the extra learn: make check-agents")

from matplotlib.text import Annotation

from arc_suite.evaluation.published import FINALS
from arc_suite.learning.agents import plots
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.learning.agents.plots import Curve

STEPS = np.arange(1, 6) * 20_000


def test_every_algorithm_has_a_style_of_its_own():
    assert plots.STYLES.keys() == ALGORITHMS.keys()
    styles = [*plots.STYLES.values(), *plots._STYLES_OF_OTHERS]
    colors = [color for color, _ in styles]
    assert len(set(colors)) == len(colors) and len(set(styles)) == len(styles)


def labels(figure):
    """Labels of levels with their boxes, and the boxes of the axes, in pixels."""
    renderer = figure.canvas.get_renderer()
    figure.draw(renderer)
    found = [each for axis in figure.axes for each in axis.get_children() if isinstance(each, Annotation)]
    boxes = [(each.get_text(), super(Annotation, each).get_window_extent(renderer)) for each in found]
    return boxes, [axis.get_window_extent(renderer) for axis in figure.axes]


@pytest.fixture
def crowded():
    """Two places with all that a study can show: every level of Tick's paper, and two equal ones."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    lines = {"standing still": 1640.0, "demonstrator medium": 1640.0, "demonstrator refined": 3886.0}
    kinds = {name: Curve(name, STEPS, np.linspace(0.0, 3000.0, 5)[None]) for name in FINALS["tick"]}
    kinds["sac-other"] = Curve("sac", STEPS, np.linspace([0.0, 100.0, 50.0], [2000.0, 2500.0, 2400.0], 5).T)
    kinds["sac-two"] = Curve("sac", STEPS, np.linspace([0.0, 100.0], [2000.0, 2500.0], 5).T)
    figure = plots.plot_study({"a": kinds, "b": kinds}, {"a": lines, "b": lines}, {"a": FINALS["tick"], "b": {}})
    FigureCanvasAgg(figure)
    return figure


def test_no_label_lies_on_a_line_or_on_another(crowded):
    boxes, axes = labels(crowded)
    assert len(boxes) == 9 + 3
    for text, box in boxes:
        assert not any(box.overlaps(axis) for axis in axes), text
    for (one, first), (other, second) in itertools.combinations(boxes, 2):
        assert not first.overlaps(second), (one, other)


def test_fewer_than_three_runs_have_no_band_and_kinds_of_one_algorithm_have_its_color(crowded):
    for axis in crowded.axes:
        assert len(axis.collections) == 1, "of the kind with three runs"
        drawn = {line.get_label(): line for line in axis.get_lines()}
        assert drawn["sac"].get_color() == drawn["sac-other"].get_color() == plots.STYLES["sac"][0]
        assert drawn["sac"].get_linestyle() != drawn["sac-other"].get_linestyle()
        assert drawn["sac"].get_marker() == plots.STYLES["sac"][1]


def test_kinds_of_one_algorithm_differ_in_their_markers():
    """In the legend and in every panel; their number is that of the variants of `parallel-parts`."""
    curve = Curve("sac_parallel", STEPS, np.arange(5.0)[None])
    kinds = {f"sac_parallel-{part}": curve for part in "abcde"}
    figure = plots.plot_study({"a": kinds, "b": dict(reversed(kinds.items()))}, {}, {})
    for lines in (figure.legends[0].get_lines(), *(axis.get_lines() for axis in figure.axes)):
        assert {line.get_color() for line in lines} == {plots.STYLES["sac_parallel"][0]}
        assert len({(line.get_marker(), line.get_markerfacecolor()) for line in lines}) == 5


@pytest.mark.parametrize("places", ["a", "ab"])
def test_a_legend_of_long_names_lies_in_the_picture(places):
    curve = Curve("sac_parallel", STEPS, np.zeros((1, 5)))
    kinds = {f"sac_parallel-three-step-{part}-environments": curve for part in "abcde"}
    figure = plots.plot_study(dict.fromkeys(places, kinds), {}, {})
    figure.draw_without_rendering()
    box = figure.legends[0].get_window_extent()
    assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1


@pytest.mark.parametrize(("points", "shown"), [(1, 1), (15, 15), (16, 8), (30, 15), (50, 13)])
def test_long_curves_have_few_markers_and_the_legend_shows_them(points, shown):
    curves = {
        place: {"ppo": Curve("ppo", np.arange(count), np.zeros((1, count)))}
        for place, count in (("short", 5), ("long", points))
    }
    figure = plots.plot_study(curves, {}, {})
    (line,) = figure.axes[1].get_lines()
    assert len(range(0, points, line.get_markevery())) == shown
    assert {each.get_marker() for each in (line, *figure.legends[0].get_lines())} == {"o"}


def test_unknown_algorithms_get_other_colors():
    styles = plots._styles(["mine:FIRST", "sac", "mine:SECOND"])
    assert styles["sac"] == plots.STYLES["sac"]
    assert len({color for color, _ in styles.values()}) == 3 and styles["mine:FIRST"] not in plots.STYLES.values()


def test_a_run_stands_over_its_anchors():
    evaluations = {"step": np.repeat([100.0, 200.0], 10), "return": np.arange(20.0)}
    figure = plots.plot_run(evaluations, "ppo", "mine", {"standing still": 1640.0}, {"sope": 3610.0})
    texts = [each.get_text() for each in figure.axes[0].get_children() if isinstance(each, Annotation)]
    assert texts == ["ppo 14", "standing still 1640", "sope, paper 3610"]
