"""The page of a search of one's own: its code runs, and finds bodies that walk with less power."""

import os
import re
import subprocess
import sys

import pytest
from interpreters import ROOT, printed

SEARCH, GROUND, PROGRESS, CORES, MASSES = re.findall(
    r"```python\n(.*?)```", (ROOT / "docs" / "evolving.md").read_text(), re.DOTALL
)


@pytest.fixture
def folder(tmp_path):
    """Write the file of the page, and return its folder."""
    (tmp_path / "evolve.py").write_text(SEARCH)
    return tmp_path


def run(folder, code, name):
    """Return the lines that code prints as a file in a folder."""
    (folder / name).write_text(code)
    environ = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, name], cwd=folder, env=environ, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


@pytest.mark.slow
def test_a_search_finds_better_bodies(folder):
    (line,) = run(folder, SEARCH.replace("candidates=20", "candidates=6"), "evolve.py")
    name, fitness = line.split()
    code = "import evolve; from arc_suite.bodies import generator; print(evolve.fitness(generator.generate(6, 3)))"
    (first_fitness,) = printed(code, folder=folder)
    assert name.startswith("body_") and float(fitness) > float(first_fitness) > 0.01
    code = "import evolve; from arc_suite import registry; print(evolve.fitness(registry.body_of('best.json')))"
    assert printed(code, folder=folder) == [fitness]


@pytest.mark.slow
def test_bodies_are_scored_on_all_cores(folder):
    (line,) = run(folder, CORES.replace("range(4)", "range(2)"), "cores.py")
    assert all(0.005 < float(fitness) < 0.05 for fitness in line.strip("[]").split(","))


@pytest.mark.slow
def test_walks_are_measured_on_uneven_ground_and_by_numbers_of_the_demonstrator():
    speeds = printed(GROUND)
    assert len(set(speeds)) == 2 and all(0.3 < float(speed) < 0.5 for speed in speeds)
    speed, height = printed(PROGRESS)[0].split()
    assert 0.3 < float(speed) < 0.5  # m/s
    assert 0.25 < float(height) < 0.5  # m, of a torso that stands 0.4 m high


def test_masses_are_read():
    rows = [line.split(maxsplit=2) for line in printed(MASSES)]
    assert rows[0][0] == "torso" and len(rows) == 1 + 6 * 4
    assert sum(float(mass) for _, mass, _ in rows) == pytest.approx(0.3, rel=0.1)  # kg, as docs/bodies.md says
