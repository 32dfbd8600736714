"""The benchmark: it runs and writes what it says; no time is asserted."""

import json
import pathlib
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from benchmark import growth, ordinary, report, tasks
from numpy.testing import assert_allclose
from PIL import Image
from tiers import tiers

import arc_suite
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

TOOL = pathlib.Path(__file__).parents[2] / "tools" / "bench.py"


def bench(*arguments, folder):
    command = [sys.executable, TOOL, "--json=results.json", "--plot=plot.png", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    """What a small run printed, and the folder to which it wrote."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "performance.md").write_text("Before.\n<!-- benchmark -->\nold\n<!-- end of benchmark -->\nAfter.\n")
    small = ("--robots=queen,leaper", "--num_envs=1,4", "--workers=1,2", "--rounds=2", "--steps=2")
    result = bench(*small, "--document=performance.md", folder=folder)
    assert (result.returncode, result.stderr) == (0, "")
    return result, folder


@pytest.mark.long
def test_small_run_prints_tables_and_writes_results_plot_and_document(small_run):
    result, folder = small_run
    lines = result.stdout.splitlines()
    for start in (
        "mj_step, full model",
        "mj_step, lean model",
        "dm_env",
        "Gymnasium env",
        "ordinary MujocoEnv",
        "SyncVectorEnv of ordinary ones",
        "AsyncVectorEnv of ordinary ones, 2 processes",
        "vector env, 1 environment",
        "vector env, 4 environments",
        *report.PROMISES,
        "memory of an environment, kB",
        "4 links a leg",
    ):
        assert any(line.startswith(f"| {start}") for line in lines), start
    results = json.loads((folder / "results.json").read_text())
    assert list(results["robots"]) == ["queen", "leaper"]
    for robot in results["robots"].values():
        assert robot["size"]["num_envs"] == 4
        for contestant in robot["contestants"]:
            assert len(contestant["microseconds"]) == 2 and min(contestant["microseconds"]) > 0
        assert report.ratios(robot["contestants"]).keys() == report.PROMISES.keys()
    assert len(results["growth"]) == 24
    assert (folder / "performance.md").read_text() == (
        f"Before.\n<!-- benchmark -->\n{result.stdout.removesuffix(chr(10))}<!-- end of benchmark -->\nAfter.\n"
    )
    assert is_a_plot(folder / "plot.png")


@pytest.mark.long
def test_robots_of_any_name_are_plotted_and_in_the_tables(small_run, tmp_path):
    results = json.loads((small_run[1] / "results.json").read_text())
    results["robots"] |= {name: results["robots"]["queen"] for name in ("hopper", "crawler")}
    report.plot(results, tmp_path / "plot.png")
    assert is_a_plot(tmp_path / "plot.png")
    assert "|  | queen | leaper | hopper | crawler |" in report.tables(results)
    colors = [color for _, color, _ in report._robots_with_colors(results)]
    assert len(set(colors)) == 4


def is_a_plot(path):
    pixels = np.asarray(Image.open(path).convert("RGB"))
    return min(pixels.shape[:2]) > 500 and len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robots=quen"], f"unknown robot 'quen'; did you mean 'queen'? (there are: {', '.join(ROBOTS)})"),
        (["--num_envs=1,many"], "--num_envs: expected positive integers with commas between, got '1,many'"),
        (["--workers=0"], "--workers: expected positive integers with commas between, got '0'"),
        (["--document=missing.md"], "--document: no file missing.md"),
        (["--document=results.md"], "results.md has no <!-- benchmark --> and <!-- end of benchmark -->"),
    ],
)
def test_bad_flags_are_one_line_errors(arguments, message, tmp_path):
    (tmp_path / "results.md").write_text("no marks")
    result = bench(*arguments, folder=tmp_path)
    assert result.returncode == 1
    assert result.stderr == f"bench.py: {message}\n"
    assert not (tmp_path / "results.json").exists()


@pytest.mark.parametrize("robot", tiers(ROBOTS, lambda robot: robot == "leaper"))
def test_ordinary_environment_has_the_same_observation_and_reward(robot, tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(ordinary.full_model(robot).to_xml_string())
    usual = gymnasium.make(ordinary.register(robot, str(path))).unwrapped
    environment = arc_suite.load(robot, "walk", {"random": 0}, {"flat_observation": True})
    usual.reset(seed=0)
    environment.reset()
    usual.set_state(environment.physics.position(), environment.physics.velocity())
    for action in np.random.RandomState(0).uniform(-0.4, 0.4, (20, *usual.action_space.shape)):
        observation, reward, terminated, truncated, info = usual.step(action)
        timestep = environment.step(action)
        assert_allclose(observation, timestep.observation["observations"], rtol=1e-5, atol=1e-5)
        assert_allclose(reward, timestep.reward, rtol=1e-5)
        assert list(info["reward_terms"]) == list(environment.task.terms)
        assert not (terminated or truncated)


@pytest.mark.parametrize(("legs", "links"), growth.SIZES)
def test_grown_bodies_have_their_legs_and_links(legs, links):
    body = growth.body(legs, links)
    assert len(body.legs) == legs
    assert len(body.joint_names) == legs * links
    assert len(body.part_names) == 1 + legs * (links + 1)


@pytest.mark.long
def test_what_every_task_costs(monkeypatch):
    for name, value in {"NUM_ENVS": 2, "_WARM_UP_STEPS": 1, "_STEPS": 1}.items():
        monkeypatch.setattr(tasks, name, value)
    table = [line.strip("|").split("|") for line in tasks.measure("tick", 1, 1).splitlines()[2:]]
    assert [cells[0].strip() for cells in table] == [*TASKS, "the scan of rough"]
    assert all(float(cells[1]) > 0.0 for cells in table)
    assert float(table[0][2]) == 1.0
