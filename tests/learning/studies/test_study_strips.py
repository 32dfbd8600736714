"""Strips of studies: drawn of the policy whose style is measured, anew where missing, and shown where there are any."""

import dataclasses

import numpy as np
import pytest
import tiny_studies
from PIL import Image
from tqdm import tqdm

from arc_suite import policies
from arc_suite.envs.dm import load
from arc_suite.learning.agents.training import train
from arc_suite.learning.studies import publication, results
from arc_suite.learning.studies.report import _strips as paragraphs
from arc_suite.learning.studies.results import STRIP, Result
from arc_suite.learning.studies.tables import run
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.style import strips


def silent(*arguments, **keywords):
    """A progress bar that shows nothing."""
    return tqdm(*arguments, **keywords, disable=True)


@pytest.fixture
def finished(tmp_path):
    """A finished run, the folder of its study, and one to publish to."""
    each = tiny_studies.WITH_NUMPY.runs[0]
    each = each._replace(configuration=dataclasses.replace(each.configuration, steps=100))
    assert train(each.configuration, tmp_path / "runs" / each.name, progress=silent)
    return each, tmp_path / "runs", tmp_path / "results"


def unavailable(*arguments):
    raise RenderingUnavailable("cannot render: no OpenGL")


@pytest.mark.long
def test_a_strip_is_published_with_the_style(finished, monkeypatch):
    each, runs, published = finished
    drawn, style = published / each.name / STRIP, published / each.name / "style.csv"
    publication.publish(each, runs, published)
    first = drawn.read_bytes()
    environment = load("tick", "walk", tiny_studies.SHORT)
    strips.write(drawn, strips.strip(environment, policies.policy(runs / each.name, "tick")))
    assert drawn.read_bytes() == first
    assert Image.open(drawn).size == (strips.FRAMES * (strips.WIDTH + strips.GAP) - strips.GAP, strips.HEIGHT)

    # What is there stays; what is missing is drawn, though the style has been measured.
    monkeypatch.setattr(strips, "strip", lambda environment, policy: np.zeros((20, 30, 3), np.uint8))
    before = style.stat().st_mtime_ns
    publication.publish(each, runs, published)
    assert drawn.read_bytes() == first
    drawn.unlink()
    publication.publish(each, runs, published)
    assert Image.open(drawn).size == (30, 20)
    assert style.stat().st_mtime_ns == before

    # Without OpenGL none is drawn, none of another run stays, and the style is measured all the same.
    monkeypatch.setattr(strips, "strip", unavailable)
    measured = style.read_text()
    (published / each.name / "config.json").write_text("{}")
    publication.publish(each, runs, published)
    assert not drawn.exists()
    assert style.read_text() == measured


@pytest.mark.slow
def test_the_policy_is_that_of_the_latest_whole_evaluation(finished, monkeypatch):
    """A later one is there already while its episodes are still played."""
    each, runs, published = finished
    monkeypatch.setattr(strips, "strip", lambda environment, policy: None)
    publication.publish(each, runs, published)
    measured = (published / each.name / "style.csv").read_text()
    (runs / each.name / "policy.npz").write_bytes(b"another")
    with (runs / each.name / "evaluations.csv").open("a") as file:
        file.write((runs / each.name / "evaluations.csv").read_text().splitlines()[1].replace("100,", "200,", 1) + "\n")
    (published / each.name / "style.csv").unlink()
    publication.publish(each, runs, published)
    assert (published / each.name / "style.csv").read_text() == measured
    (found,) = results.results([each], published)
    assert found.steps.tolist() == [100]


def test_without_a_gait_no_strip_is_published(finished, monkeypatch):
    each, runs, published = finished
    monkeypatch.setattr(strips, "strip", lambda environment, policy: None)
    publication.publish(each, runs, published)
    assert sorted(path.name for path in (published / each.name).iterdir()) == [
        *("config.json", "evaluations.csv", "style.csv", "times.csv"),
    ]


def test_reports_show_the_strips_that_are_there(tmp_path):
    """Of each kind one, of the first seed that has one; with the command of a page."""
    settings, names = {"gait": "ripple"}, ("sac", "ppo")
    runs = [run("tick", name, 1000, seed, task_kwargs=settings) for name in names for seed in (0, 1)]
    empty = np.empty(0)
    groups = results.grouped([Result(each, empty, empty, {}, empty, {}, empty) for each in runs])
    assert paragraphs("mine", groups, tmp_path) == []
    (tmp_path / runs[1].name).mkdir()
    (tmp_path / runs[1].name / STRIP).touch()
    _, title, picture = paragraphs("mine", groups, tmp_path)
    assert title == (
        '**tick, walk, {"gait": "ripple"}: sac**, seed 1: `arc-suite render --robot=tick --task=walk '
        "--policy=runs/mine/tick-walk-sac-1 --set=gait=ripple --output=tick-walk-sac-1.html`"
    )
    assert picture.endswith("](tick-walk-sac-1/strip.png)")
