"""The training scripts run, and arc-suite evaluate judges what they save: `make check-sb3`."""

import importlib.util
import json
import os
import pathlib
import subprocess
import sys

import gymnasium
import numpy as np
import programs
import pytest

import arc_suite  # noqa: F401 (registers the ids)

pytest.importorskip("stable_baselines3", reason="of the extra `sb3`: make check-sb3")
torch = pytest.importorskip("torch")

ROOT = pathlib.Path(__file__).parents[2]
SCRIPTS = ROOT / "examples" / "training"


def run(script, *arguments, cwd):
    environ = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, SCRIPTS / script, *arguments], cwd=cwd, env=environ, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done


def test_sac_of_stable_baselines3(tmp_path):
    pytest.importorskip("matplotlib")
    done = run("sb3_sac.py", "--steps=704", "--checkpoints=1", "--episodes=1", "--output=tick", cwd=tmp_path)
    assert done.stderr == ""
    names = {"704.zip", "704_vecnormalize.pkl", "704.json", "curve.png"}
    assert {path.name for path in (tmp_path / "tick").iterdir()} == names
    report = json.loads((tmp_path / "tick" / "704.json").read_text())
    assert report["robots"]["tick"]["return"]["mean"] > 0.0


def test_ppo_of_stable_baselines3(tmp_path):
    pytest.importorskip("matplotlib")
    arguments = ("--task=steer", "--steps=128", "--checkpoints=1", "--episodes=1", "--output=tick")
    done = run("sb3_ppo.py", *arguments, cwd=tmp_path)
    assert done.stderr == ""
    names = {"128.zip", "128_vecnormalize.pkl", "128.json", "curve.png"}
    assert {path.name for path in (tmp_path / "tick").iterdir()} == names


def judge(script, ending, *flags, folder):
    """Copy a script next to what it saved, under the name of a place and seed, and let arc-suite evaluate play it."""
    copy = folder / "tick-walk-0.py"
    copy.write_text((SCRIPTS / f"{script}.py").read_text())
    (folder / f"{script}{ending}").rename(copy.with_suffix(ending))
    done = programs.arc_suite(
        "evaluate",
        "--robot=tick",
        f"--policy={copy}:make",
        "--episodes=1",
        "--set=time_limit=1",
        *flags,
        cwd=folder.parent,
    )
    assert done.returncode == 0 and "\ntick " in done.stdout, done.stderr


def test_ppo_of_rsl_rl(tmp_path):
    pytest.importorskip("rsl_rl")
    run("rsl_rl_ppo.py", "--task=steer", "--steps=1536", cwd=tmp_path)
    judge("rsl_rl_ppo", ".pt", "--task=steer", folder=tmp_path)


def test_ppo_of_cleanrl(tmp_path):
    run("cleanrl_ppo.py", "--task=steer", "--steps=2048", cwd=tmp_path)
    judge("cleanrl_ppo", ".pt", "--task=steer", folder=tmp_path)


def test_sac_of_sbx(tmp_path):
    pytest.importorskip("sbx")
    run("sbx_sac.py", "--steps=64", cwd=tmp_path)
    judge("sbx_sac", ".sbx", folder=tmp_path)


def test_what_rsl_rl_gets_is_what_its_hyperparameters_are_for():
    """Rewards per second, half actions, and time limits apart from falls."""
    pytest.importorskip("rsl_rl")
    script = load("rsl_rl_ppo")
    environments = script.Environments("tick", "walk", 2, 100_000)
    vector = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2, autoreset_mode="SameStep")
    vector.reset(seed=100_000)
    actions = torch.stack([torch.linspace(-3.0, 3.0, 18), torch.zeros(18)])  # one falls, the other stands
    ends = {"fall": 0, "time limit": 0}
    for _ in range(1000):
        observations, rewards, has_ended, extras = environments.step(actions)
        expected, reward, terminated, truncated, _ = vector.step(0.5 * actions.numpy())
        np.testing.assert_array_equal(observations["policy"], expected)
        np.testing.assert_allclose(rewards, 0.05 * reward, rtol=1e-6)
        np.testing.assert_array_equal(has_ended, terminated | truncated)
        np.testing.assert_array_equal(extras["time_outs"], truncated)
        ends["fall"] += terminated.sum()
        ends["time limit"] += truncated.sum()
    assert min(ends.values()) > 0


def test_advantages_of_cleanrl():
    """By hand, over two episodes: the value after the first one is zero."""
    script = load("cleanrl_ppo")
    rewards, continues, values = np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.0, 1.0]), np.array([0.5, 0.2, 0.1, 4.0])
    last = 3.0 + 0.99 * 4.0 - 0.1
    second = 2.0 - 0.2
    first = 1.0 + 0.99 * 0.2 - 0.5 + 0.99 * 0.95 * second
    np.testing.assert_allclose(script.compute_advantages(rewards, continues, values), [first, second, last])


def test_cleanrl_learns_on_a_minibatch():
    """The loss falls, and clipped ratios have no gradient."""
    script = load("cleanrl_ppo")
    torch.manual_seed(0)
    agent = script.Agent(3, 2)
    observations, actions = torch.randn(64, 3), torch.randn(64, 2)
    with torch.no_grad():
        old = agent.distribution(observations).log_prob(actions).sum(1), agent.value(observations).flatten()
    batch = (observations, actions, *old, torch.randn(64))
    optimizer = torch.optim.Adam(agent.parameters(), 1e-3)
    losses = []
    for _ in range(20):
        loss = script.compute_loss(agent, *batch)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < losses[0] - 0.05
    far = (observations, actions, old[0] - 5.0, old[1], torch.ones(64))
    agent.zero_grad()
    script.compute_loss(agent, *far).backward()
    assert agent.log_std.grad.abs().max() == 0.0


def load(name):
    """Import a script."""
    specification = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    return script
