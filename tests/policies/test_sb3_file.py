"""Zips of stable-baselines3 as policies of every program."""

import pickle

import gymnasium
import numpy as np
import programs
import pytest

import arc_suite
from arc_suite import evaluation, policies, usage
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.usage import Usage

UNKNOWN = "does not hold the robot and task that it was trained for; train in arc_suite.envs.sb3.VecEnv"

pytest.importorskip("stable_baselines3", reason="of the extra `sb3`: make check-sb3")
pytestmark = pytest.mark.filterwarnings(f"ignore:.*{UNKNOWN}")


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


@pytest.mark.parametrize("name", ["SAC", "PPO", "TD3", "A2C"])
def test_does_what_the_agent_does(name, saved):
    path, answers = saved
    policy = policies.policy(str(path / f"{name}.zip"), "tick")
    timestep = arc_suite.load("tick", "walk").reset(0)
    assert np.array_equal(policies.alone(policy)(timestep), answers[name].astype(float))


def test_in_a_batch_it_does_the_same(saved):
    policy, task = policies.policy(str(saved[0] / "SAC.zip"), "tick"), {"time_limit": 1.0}
    envs = VectorEnv("tick", "walk", 3, 1, "Disabled", task_kwargs=task)
    alone = evaluation.episodes(arc_suite.load("tick", "walk", task), policy, range(3))
    assert evaluation.episodes_in_batch(envs, policy, range(3)) == alone


def test_a_run_that_uses_a_zip_uses_a_policy(saved):
    name, observation = str(saved[0] / "PPO.zip"), arc_suite.load("tick", "walk").reset(0)
    made, network = policies.policy(name, "tick"), policies.policy(name, "tick").network(Setup.of("tick", "walk"))
    uses = (lambda: policies.policy(name, "tick"), lambda: policies.alone(made)(observation), lambda: network.graph)
    for use in uses:
        with usage.record(Usage("mine")) as used:
            use()
        assert used.sources == {usage.POLICY}


def test_errors_are_one_line(saved, tmp_path):
    path = saved[0]
    with pytest.raises(ValueError, match=r"SAC\.zip: moves 18 joints, and leaper has 12$"):
        policies.policy(str(path / "SAC.zip"), "leaper")
    with pytest.raises(ValueError, match=r"^policy .*: expected observations \(199,\), got \(205,\)$"):
        evaluation.run(arc_suite.load("tick", "steer"), policies.policy(str(path / "SAC.zip"), "tick"), 0)
    with pytest.raises(OSError, match=r"^cannot read .*none\.zip: no such file$"):
        policies.policy(str(tmp_path / "none.zip"), "tick")
    (tmp_path / "damaged.zip").write_bytes((path / "SAC.zip").read_bytes()[:5000])
    with pytest.raises(ValueError, match=r"damaged\.zip: no policy of stable-baselines3: ") as caught:
        policies.policy(str(tmp_path / "damaged.zip"), "tick")
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def normalized(tmp_path_factory):
    """A zip of PPO and the statistics that it was trained with, the raw observation and what it does there."""
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecNormalize

    from arc_suite.envs import sb3

    folder = tmp_path_factory.mktemp("normalized")
    envs = VectorEnv("tick", "walk", 4, 1, "SameStep", task_kwargs={"time_limit": 1.0})
    environments = VecNormalize(sb3.VecEnv(envs))
    agent = PPO("MlpPolicy", environments, n_steps=16, batch_size=32, n_epochs=1, device="cpu", seed=0).learn(128)
    agent.save(folder / "ppo.zip")
    environments.save(folder / "stats.pkl")
    observation = arc_suite.load("tick", "walk").reset(0)
    flat = np.concatenate(list(observation.observation.values()), dtype=np.float32)
    return folder, observation, agent.predict(environments.normalize_obs(flat), deterministic=True)[0]


def test_statistics_are_applied(normalized):
    folder, timestep, expected = normalized
    with pytest.raises(ValueError, match=r"ppo\.zip: was trained with VecNormalize, whose statistics are missing: "):
        policies.policy(str(folder / "ppo.zip"), "tick")
    policy = policies.policy(f"{folder / 'ppo.zip'}+{folder / 'stats.pkl'}", "tick")
    assert np.array_equal(policies.alone(policy)(timestep), expected.astype(float))


def test_a_zip_knows_its_robot(normalized, saved, recwarn):
    name = f"{normalized[0] / 'ppo.zip'}+{normalized[0] / 'stats.pkl'}"
    with pytest.raises(ValueError, match=r"ppo\.zip: made for tick, and not for queen$"):
        policies.policy(name, "queen")
    policies.policy(name, "tick")
    assert not [each for each in recwarn if "arc_suite" in str(each.message)]
    with pytest.warns(UserWarning, match=r"PPO\.zip: does not hold the robot and task that it was trained for; "):
        policies.policy(str(saved[0] / "PPO.zip"), "queen")


def test_programs_take_statistics(normalized):
    folder = normalized[0]
    evaluate = ("evaluate", "--robot=tick", "--policy=ppo.zip", "--episodes=1", "--set=time_limit=1")
    programs.passed(programs.arc_suite(*evaluate, "--vecnormalize=stats.pkl", cwd=folder))
    done = programs.arc_suite(*evaluate, "--vecnormalize=stats.pkl", "--policy=cpg", cwd=folder)
    line = "--vecnormalize=stats.pkl: goes with a zip of stable-baselines3, got 'cpg'"
    programs.refused(done, f"arc-suite evaluate: {line}\n")


def test_a_program_warns_in_one_line(saved):
    done = programs.arc_suite(
        "evaluate", "--robot=tick", "--policy=PPO.zip", "--episodes=1", "--set=time_limit=1", cwd=saved[0]
    )
    assert done.returncode == 0 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("arc-suite evaluate: policy PPO.zip: does not hold the robot and task ")


def test_what_are_no_statistics_is_one_line(normalized, tmp_path):
    zipped = normalized[0] / "ppo.zip"
    (tmp_path / "text.pkl").write_text("text")
    (tmp_path / "list.pkl").write_bytes(pickle.dumps([1, 2]))
    for name, message in (("text", "no statistics of VecNormalize: "), ("list", "expected statistics of VecNormalize")):
        with pytest.raises(ValueError, match=rf"{name}\.pkl: {message}") as error:
            policies.policy(f"{zipped}+{tmp_path / name}.pkl", "tick")
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["SAC", "PPO", "TD3"])
def test_as_layers(name, tmp_path):
    """The network that `arc-suite export` writes does what the agent does."""
    import stable_baselines3

    from arc_suite.envs import sb3

    envs = sb3.VecEnv(VectorEnv("leaper", "walk", 2, 1, "SameStep"))
    getattr(stable_baselines3, name)("MlpPolicy", envs, device="cpu", seed=0).save(tmp_path / "agent.zip")
    network, policy = (
        make(str(tmp_path / "agent.zip")) for make in (policies.load_network, lambda p: policies.policy(p, "leaper"))
    )
    assert network.setup.body.name == "leaper"
    observation = {name: block[None] for name, block in arc_suite.load("leaper", "walk").reset(0).observation.items()}
    np.testing.assert_allclose(network.act(observation, np.zeros(1)), policy.act(observation, np.zeros(1)), atol=1e-5)


def test_statistics_are_the_first_nodes(normalized):
    folder, timestep, expected = normalized
    network = policies.load_network(f"{folder / 'ppo.zip'}+{folder / 'stats.pkl'}")
    operators = [node.operator for node in network.graph.nodes]
    assert operators[:3] == ["Sub", "Mul", "Clip"] and operators[-1] == "Clip"
    np.testing.assert_allclose(policies.alone(network)(timestep), expected, atol=1e-4)


def test_a_zip_without_a_setup_is_not_exported(saved):
    with pytest.raises(ValueError, match=r"PPO\.zip: does not hold the robot and task that it was trained for; "):
        policies.load_network(str(saved[0] / "PPO.zip"))
