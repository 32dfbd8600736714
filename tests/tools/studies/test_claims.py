"""The paper's claims in the reports of the project's own studies."""

import re

import pytest
from published_tables import as_in_the_paper, cells, constant, publish

from arc_suite.evaluation import published
from arc_suite.learning.studies.tables import run
from studies import catalog, claims, reports


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A study as the paper's table of finals would have it, and the folder of its tables."""
    study = as_in_the_paper(tmp_path / "mine")
    monkeypatch.setitem(catalog.STUDIES, "mine", study)
    return study, tmp_path / "mine"


@pytest.mark.slow
def test_claims(made):
    """On the paper's own finals each sentence comes out as in its table; one does not hold there."""
    study, folder = made
    page = reports.write("mine", study, folder).read_text()
    held = {claim.text: cells(page, claim.text)[1:] for claim in claims.CLAIMS}
    for claim in claims.CLAIMS:
        paper, there, ours, here = held[claim.text]
        if claim.metric is None:
            assert there == here
            assert re.findall(r"\w+ [+-]", paper) == re.findall(r"\w+ [+-]", ours)
        else:
            assert (paper, there) == ("-", "not measured")
    counts = [held[claim.text][3] for claim in claims.CLAIMS]
    assert counts == [f"{count} of 4 robots" for count in (4, 4, 4, 4, 3, 0, 0, 4)]
    assert "queen -300" in held["with prior data all end higher than without"][0]
    least = min(published.FINALS["queen"][name] for name in claims.ONLINE) - published.DEMONSTRATORS["queen"]
    assert f"queen +{least:.0f}" in held["all online algorithms surpass the demonstrator"][0]


@pytest.mark.slow
def test_claims_need_what_they_compare(made):
    """The study's title tells short phases; other tasks and missing algorithms are not compared."""
    study, folder = made
    few = study._replace(runs=tuple(each for each in study.runs if each.kind == "sac"))
    page = reports.write("few", few, folder).read_text()
    assert cells(page, claims.CLAIMS[0].text)[3:] == ["-", "not measured"]
    other = study._replace(runs=(run("tick", "ppo", 1_000_000),))
    publish(folder, other.runs[0], constant(100.0, 200.0))
    assert "Claims" not in reports.write("other", other, folder).read_text()


def test_the_papers_table_has_every_robot_and_algorithm():
    assert published.CURVES.keys() == published.DEMONSTRATORS.keys()
    for curves in published.CURVES.values():
        assert set(curves) == {*claims.ONLINE, *claims.WITH_PRIOR}
        assert all(len(points) == len(published.STEPS) for points in curves.values())
