"""Strips of studies: drawn of the policy whose style is measured, anew where missing, and shown where there are any."""

import numpy as np
import pytest
import tiny_studies
from PIL import Image
from tqdm import tqdm

from arc_suite import policies
from arc_suite.agents.training import train
from arc_suite.envs.dm import load
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.studies import results, runner
from arc_suite.studies.results import STRIP, Result
from arc_suite.studies.strips import paragraphs
from arc_suite.studies.tables import Row
from arc_suite.style import strips


def silent(*arguments, **keywords):
    """A progress bar that shows nothing."""
    return tqdm(*arguments, **keywords, disable=True)


@pytest.fixture
def finished(tmp_path):
    """A row whose run is finished, the folder of its study, and one to publish to."""
    row = tiny_studies.WITH_NUMPY.rows[0]._replace(steps=100)
    assert train(row.run(), tmp_path / "runs" / row.name, progress=silent)
    return row, tmp_path / "runs", tmp_path / "results"


def unavailable(*arguments):
    raise RenderingUnavailable("cannot render: no OpenGL")


@pytest.mark.slow
def test_a_strip_is_published_with_the_style(finished, monkeypatch):
    row, runs, published = finished
    drawn, style = published / row.name / STRIP, published / row.name / "style.csv"
    runner.publish(row, runs, published)
    first = drawn.read_bytes()
    environment = load("tick", "walk", row.task_kwargs)
    strips.write(drawn, strips.strip(environment, policies.policy(runs / row.name, "tick")))
    assert drawn.read_bytes() == first
    assert Image.open(drawn).size == (strips.FRAMES * (strips.WIDTH + strips.GAP) - strips.GAP, strips.HEIGHT)

    # What is there stays; what is missing is drawn, though the style has been measured.
    monkeypatch.setattr(strips, "strip", lambda environment, policy: np.zeros((20, 30, 3), np.uint8))
    before = style.stat().st_mtime_ns
    runner.publish(row, runs, published)
    assert drawn.read_bytes() == first
    drawn.unlink()
    runner.publish(row, runs, published)
    assert Image.open(drawn).size == (30, 20)
    assert style.stat().st_mtime_ns == before

    # Without OpenGL none is drawn, none of another run stays, and the style is measured all the same.
    monkeypatch.setattr(strips, "strip", unavailable)
    measured = style.read_text()
    (published / row.name / "config.json").write_text("{}")
    runner.publish(row, runs, published)
    assert not drawn.exists()
    assert style.read_text() == measured


def test_the_policy_is_that_of_the_latest_whole_evaluation(finished, monkeypatch):
    """A later one is there already while its episodes are still played."""
    row, runs, published = finished
    monkeypatch.setattr(strips, "strip", lambda environment, policy: None)
    runner.publish(row, runs, published)
    measured = (published / row.name / "style.csv").read_text()
    (runs / row.name / "policy.npz").write_bytes(b"another")
    with (runs / row.name / "evaluations.csv").open("a") as file:
        file.write((runs / row.name / "evaluations.csv").read_text().splitlines()[1].replace("100,", "200,", 1) + "\n")
    (published / row.name / "style.csv").unlink()
    runner.publish(row, runs, published)
    assert (published / row.name / "style.csv").read_text() == measured
    (found,) = results.results([row], published)
    assert found.steps.tolist() == [100]


def test_without_a_gait_no_strip_is_published(finished, monkeypatch):
    row, runs, published = finished
    monkeypatch.setattr(strips, "strip", lambda environment, policy: None)
    runner.publish(row, runs, published)
    assert sorted(path.name for path in (published / row.name).iterdir()) == [
        *("config.json", "evaluations.csv", "style.csv", "times.csv"),
    ]


def test_reports_show_the_strips_that_are_there(tmp_path):
    """Of each kind one, of the first seed that has one; with the command of a page."""
    rows = [Row("tick", name, 1000, seed, task_kwargs={"gait": "ripple"}) for name in ("sac", "ppo") for seed in (0, 1)]
    empty = np.empty(0)
    groups = results.grouped([Result(row, empty, empty, {}, empty, {}, empty) for row in rows])
    assert paragraphs("mine", groups, tmp_path) == []
    for row in rows[1:2]:
        (tmp_path / row.name).mkdir()
        (tmp_path / row.name / STRIP).touch()
    _, title, picture = paragraphs("mine", groups, tmp_path)
    assert title == (
        '**tick, walk, {"gait": "ripple"}: sac**, seed 1: `arc-suite render --robot=tick --task=walk '
        "--policy=runs/mine/tick-walk-sac-1 --set=gait=ripple --output=tick-walk-sac-1.html`"
    )
    assert picture.endswith("](tick-walk-sac-1/strip.png)")
