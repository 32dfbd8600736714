"""The table of learners of other libraries: their places alone, next to ours, with an interval over three seeds."""

import pathlib
import re

import pytest

from arc_suite.learning.studies import benchmark, csv_files
from arc_suite.learning.studies.benchmark import RunScore
from studies import peers

STUDIES = pathlib.Path(__file__).parents[3] / "studies"


def score(seed, value, task="walk"):
    return RunScore("tick", task, seed, 1000.0 * value, value, float("nan"), 0.9, 0.1)


def test_peers_stand_beside_ours_in_their_places(tmp_path):
    benchmark.write(tmp_path, "top", "sb3_ppo", [score(2, 0.8), score(0, 0.6), score(1, 0.7)])
    benchmark.write(tmp_path, "top", "rsl_rl_ppo", [score(0, -0.001)])
    benchmark.write(tmp_path, "samples", "sb3_ppo", [score(0, 0.1, task="steer")])
    rows = [("sb3_ppo", seed, 10.0 + seed) for seed in range(3)] + [("rsl_rl_ppo", 0, 9.96)]
    lines = []
    for learner, seed, minutes in rows:
        cells = (learner, "tick", "walk", seed, 100_000, 1_001_472, minutes)
        lines.append(dict(zip(peers.COLUMNS, cells, strict=True)))
    csv_files.write(tmp_path / peers.TABLE, peers.COLUMNS, lines)
    heads, _, *table = peers.text(tmp_path).splitlines()
    assert heads == f"| {' | '.join(peers.HEADS)} |"
    assert [line.split(" | ")[1] for line in table] == ["sb3_ppo", "rsl_rl_ppo"]
    assert table[0].endswith("| 1,001,472 | 11.0 | 0.70 [0.45, 0.95] | 0.60, 0.70, 0.80 | 700 |")
    assert table[1].endswith("| 1,001,472 | 10.0 | 0.00 | 0.00 | -1 |")


@pytest.mark.parametrize("learner", [learner for learner in peers.SOURCES if learner != peers.OURS])
def test_peers_have_a_source_and_steps_within_the_division(learner):
    library, source = peers.SOURCES[learner]
    assert re.search(r"\d", library) and "](https://" in source
    costs = [row for row in csv_files.read(STUDIES / peers.TABLE, peers.COLUMNS) if row["learner"] == learner]
    scores = benchmark.read(STUDIES).get((peers.DIVISION, learner), [])
    runs = sorted((row["robot"], row["task"], int(row["seed"])) for row in costs)
    assert runs == sorted(score[:3] for score in scores)
    assert all(1_000_000 <= int(row["steps"]) <= 1_002_000 for row in costs)
    assert all(100_000 <= int(row["training_seed"]) < 4_100_000_000 for row in costs)
