"""Zips of stable-baselines3 as policies of every program."""

import importlib.util

import gymnasium
import numpy as np
import pytest

import arc_suite
from arc_suite import evaluation, policies
from arc_suite.envs.vector import VectorEnv

HAS_SB3 = importlib.util.find_spec("stable_baselines3") is not None
needs_sb3 = pytest.mark.skipif(not HAS_SB3, reason="of the extra `sb3`: make check-sb3")


@pytest.mark.skipif(HAS_SB3, reason="stable-baselines3 is installed")
def test_without_it_one_line_says_what_to_install(tmp_path):
    with pytest.raises(ValueError, match=r"^policy .*\.zip: zips need stable-baselines3: pip install -e '.*\[sb3\]'"):
        policies.policy(str(tmp_path / "sac.zip"), "tick")


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Zips of agents that know nothing yet, by algorithm, and what they do in a given state."""
    import stable_baselines3

    path, env = tmp_path_factory.mktemp("zips"), gymnasium.make("arc_suite/tick-walk-v0")
    observation, answers = env.reset(seed=0)[0], {}
    for name in ("SAC", "PPO", "TD3", "A2C"):
        agent = getattr(stable_baselines3, name)("MlpPolicy", env, device="cpu", seed=0, verbose=0)
        agent.save(path / name)
        answers[name] = agent.predict(observation, deterministic=True)[0]
    return path, answers


@needs_sb3
@pytest.mark.parametrize("name", ["SAC", "PPO", "TD3", "A2C"])
def test_does_what_the_agent_does(name, saved):
    path, answers = saved
    policy = policies.policy(str(path / f"{name}.zip"), "tick")
    timestep = arc_suite.load("tick", "walk").reset(0)
    assert np.array_equal(policies.alone(policy)(timestep), answers[name].astype(float))


@needs_sb3
def test_in_rows_it_does_the_same(saved):
    policy, task = policies.policy(str(saved[0] / "SAC.zip"), "tick"), {"time_limit": 1.0}
    rows = VectorEnv("tick", "walk", 3, 1, "Disabled", task_kwargs=task)
    assert evaluation.episodes_in_batch(rows, policy, range(3)) == evaluation.episodes(
        arc_suite.load("tick", "walk", task), policy, range(3)
    )


@needs_sb3
def test_errors_are_one_line(saved, tmp_path):
    path = saved[0]
    with pytest.raises(ValueError, match=r"SAC\.zip: moves \(18,\) joints, and leaper has 12$"):
        policies.policy(str(path / "SAC.zip"), "leaper")
    with pytest.raises(ValueError, match=r"^policy .*: expected observations \(199,\), got \(205,\)$"):
        evaluation.run(arc_suite.load("tick", "steer"), policies.policy(str(path / "SAC.zip"), "tick"), 0)
    with pytest.raises(OSError, match=r"^cannot read .*none\.zip: no such file$"):
        policies.policy(str(tmp_path / "none.zip"), "tick")
    (tmp_path / "damaged.zip").write_bytes((path / "SAC.zip").read_bytes()[:5000])
    with pytest.raises(ValueError, match=r"damaged\.zip: no policy of stable-baselines3: ") as caught:
        policies.policy(str(tmp_path / "damaged.zip"), "tick")
    assert "\n" not in str(caught.value)
