"""The leaderboard is made of all committed studies."""

import pathlib
import shutil

import pytest
from published_tables import constant, publish
from refusals import refused

from arc_suite.learning.studies import results
from arc_suite.learning.studies.tables import Study, run
from studies import catalog, leaderboard, reports

COMMITTED = pathlib.Path(__file__).parents[3] / "studies"
NAMES = sorted(path.parent.name for path in COMMITTED.glob(f"*/{results.RUNS}"))


def test_the_leaderboard_holds_each_configuration_once(tmp_path, monkeypatch):
    """The row with more seeds; phases tell two configurations of one algorithm apart."""
    phases = {"phase_updates": 7500, "check_every": 100, "patience": 1000}
    few, many = (run("tick", "sac", 1_000_000),), tuple(run("tick", "sac", 1_000_000, seed) for seed in range(2))
    other = (
        *many,
        run("tick", "speq", 1_000_000),
        run("tick", "speq", 1_000_000, hyperparameters=phases, label="speq-short"),
    )
    for name, runs in (("a", few), ("b", other)):
        for each in runs:
            publish(tmp_path / name, each, constant(100.0, 200.0))
        monkeypatch.setitem(catalog.STUDIES, name, Study(name, runs))
    leaderboard.write(tmp_path)
    page = (tmp_path / "README.md").read_text()
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| tick")]
    assert sorted((row[1], row[2], row[4], row[16]) for row in rows) == [
        ("sac", "-", "2", "[b](b/README.md)"),
        ("speq", "75,000", "1", "[b](b/README.md)"),
        ("speq-short", "7,500", "1", "[b](b/README.md)"),
    ]
    assert all("204.5" in row for row in rows), "the mean of the latest returns, one seed or two"


def test_a_folder_of_no_study_is_refused(tmp_path):
    publish(tmp_path / "shrt", run("tick", "sac", 1_000_000), constant(100.0))
    with refused("unknown study 'shrt'; did you mean 'short'? (there are: paper, ", begins=True):
        leaderboard.write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["shrt"]


def test_the_committed_leaderboard_is_made_of_committed_tables(tmp_path):
    for name in NAMES:
        shutil.copytree(COMMITTED / name, tmp_path / name)
    leaderboard.write(tmp_path)
    for name in (leaderboard.PAGE, leaderboard.TABLE):
        assert (tmp_path / name).read_text() == (COMMITTED / name).read_text(), name


@pytest.mark.long
def test_committed_reports_are_made_of_committed_tables(tmp_path):
    """Nobody has changed a number."""
    shutil.copytree(COMMITTED, tmp_path / "studies")
    assert NAMES
    for name in NAMES:
        reports.write(name, catalog.study(name), tmp_path / "studies" / name)
    for path in (f"{name}/README.md" for name in NAMES):
        assert (tmp_path / "studies" / path).read_text() == (COMMITTED / path).read_text(), path
