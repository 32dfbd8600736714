"""Every tool, and every face of the suite, takes any body."""

import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import arc_suite
from arc_suite.envs.gym import Env
from arc_suite.robots import generator
from arc_suite.robots.spec_files import load_body

ROOT = Path(__file__).parents[2]
SPIDER = ROOT / "examples" / "spider.json"


def run(tool, *arguments):
    command = [sys.executable, ROOT / "tools" / tool, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def test_evaluate_takes_a_spec_and_a_body_made_to_order():
    done = run("evaluate.py", "--spec", SPIDER, "--episodes=1")
    fields = done.stdout.splitlines()[-1].split()
    assert fields[0] == "spider"
    assert float(fields[1]) > 2500.0
    assert fields[7] == "-"  # the paper knows nothing of it
    done = run("evaluate.py", "--legs=4", "--links=2", "--policy=zero", "--episodes=1")
    assert done.stdout.splitlines()[-1].split()[0] == "walker_4x2"


def test_render_takes_a_body_made_to_order(tmp_path):
    path = tmp_path / "walker.png"
    done = run("render.py", "--legs=5", "--steps=5", "--width=64", "--height=48", "--output", path)
    if "cannot render" in done.stderr:
        pytest.skip("no OpenGL here")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("walker_5x3: return ")
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("tool", ["evaluate.py", "render.py", "style.py"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--spec=a.json"], "cannot read a.json: no such file or directory"),
        (["--spec=a.json", "--legs=4"], "expected one of --spec and --legs, got both"),
        (["--links=4"], "--links=4: goes with --legs"),
        (["--legs=4", "--robot=tick"], "--robot=tick: expected no robot beside --spec or --legs"),
        (["--legs=2"], "flag --legs=2: 2 is not an integer in the range [4, 12]"),
    ],
)
def test_bad_arguments_are_one_line(tool, arguments, message, tmp_path):
    output = [f"--output={tmp_path / 'a.png'}"] if tool == "render.py" else []
    done = run(tool, *arguments, *output)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"{tool}: {message}\n")


@pytest.mark.parametrize("body", [generator.generate(5, 2), SPIDER, str(SPIDER)], ids=["body", "path", "string"])
def test_gymnasium_takes_a_body_where_a_robot_stands(body):
    expected = arc_suite.load(body, "walk", {"random": 7}, {"flat_observation": True}).reset()
    single = Env(body, "walk")
    observation, _ = single.reset(seed=7)
    np.testing.assert_array_equal(observation, expected.observation["observations"].astype(np.float32))
    assert single.metadata["render_fps"] == round(1.0 / single.unwrapped._env.control_timestep())
    single.close()
    made = gymnasium.make("arc_suite/queen-walk-v0", domain_name=body)
    np.testing.assert_array_equal(made.reset(seed=7)[0], observation)
    made.close()


def test_rows_of_a_body_are_bit_equal_to_single_environments():
    body = load_body(SPIDER)
    rows = gymnasium.make_vec("arc_suite/queen-walk-v0", num_envs=2, domain_name=body)
    singles = [Env(body, "walk") for _ in range(2)]
    batch, _ = rows.reset(seed=3)
    np.testing.assert_array_equal(batch, [env.reset(seed=3 + i)[0] for i, env in enumerate(singles)])
    random = np.random.default_rng(0)
    for _ in range(5):
        actions = random.uniform(-1.0, 1.0, rows.action_space.shape).astype(np.float32)
        batch, rewards, *_ = rows.step(actions)
        steps = [env.step(action) for env, action in zip(singles, actions, strict=True)]
        np.testing.assert_array_equal(batch, [step[0] for step in steps])
        np.testing.assert_array_equal(rewards, [step[1] for step in steps])
    rows.close()
