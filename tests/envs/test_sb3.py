"""Environments for stable-baselines3: what its own vector environment makes of single environments."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

import arc_suite  # noqa: F401 (registers)

vec_env = pytest.importorskip("stable_baselines3.common.vec_env", reason="of the extra `sb3`: make check-sb3")

from arc_suite.envs import sb3  # noqa: E402

ID = "arc_suite/tick-walk-v0"
SETTINGS = {
    "task_kwargs": {"time_limit": 1.0, "on_divergence": "truncate"},
    "render_mode": "rgb_array",
    "width": 32,
    "height": 24,
}


@pytest.fixture
def both():
    envs = sb3.VecEnv(gymnasium.make_vec(ID, num_envs=3, autoreset_mode="SameStep", **SETTINGS))
    dummy = vec_env.DummyVecEnv([lambda: gymnasium.make(ID, **SETTINGS)] * 3)
    yield envs, dummy
    envs.close(), dummy.close()


def test_environments_are_stable_baselines_own(both):
    envs, dummy = both
    assert (envs.num_envs, envs.render_mode) == (dummy.num_envs, dummy.render_mode)
    assert (envs.observation_space, envs.action_space) == (dummy.observation_space, dummy.action_space)
    envs.seed(5), dummy.seed(5)
    assert data_equivalence(envs.reset(), dummy.reset(), exact=True)
    assert envs.reset_infos == dummy.reset_infos
    random, ends, falls = np.random.RandomState(0), 0, 0
    for _ in range(70):
        actions = random.uniform(-1, 1, (3, 18)).astype(np.float32)
        result, expected = envs.step(actions), dummy.step(actions)
        assert data_equivalence(result[:3], expected[:3], exact=True)
        for info, wanted in zip(result[3], expected[3], strict=True):
            assert info.keys() == wanted.keys()
            for name in info:
                np.testing.assert_array_equal(info[name], wanted[name])
                assert type(info[name]) is type(wanted[name])
        ends += result[2].sum()
        falls += sum(done and not info["TimeLimit.truncated"] for done, info in zip(result[2], result[3], strict=True))
    assert ends > falls > 0
    assert data_equivalence(envs.reset(), dummy.reset(), exact=True)
    for image, wanted in zip(envs.get_images(), dummy.get_images(), strict=True):
        np.testing.assert_array_equal(image, wanted)
    for name in ("render_mode", "np_random_seed", "action_space"):
        assert envs.get_attr(name) == dummy.get_attr(name)
        assert envs.get_attr(name, [2, 0]) == dummy.get_attr(name, [2, 0])
    assert envs.env_is_wrapped(gymnasium.Wrapper) == [False] * 3
    assert envs.has_attr("task") and not envs.has_attr("nothing")


def test_infos_of_starts_have_privileged_observations():
    settings = {"task_kwargs": {"time_limit": 0.5, "on_divergence": "truncate"}, "privileged": True}
    envs = sb3.VecEnv(gymnasium.make_vec(ID, num_envs=2, autoreset_mode="SameStep", **settings))
    dummy = vec_env.DummyVecEnv([lambda: gymnasium.make(ID, **settings)] * 2)
    for both_envs in (envs, dummy):
        both_envs.seed(5)
        both_envs.reset()
    actions = np.zeros((2, 18), np.float32)
    for _ in range(12):
        assert data_equivalence(envs.reset_infos, dummy.reset_infos, exact=True)
        assert all(info["privileged"].any() for info in envs.reset_infos)
        infos, expected_infos = envs.step(actions)[3], dummy.step(actions)[3]
        assert [info.keys() for info in infos] == [info.keys() for info in expected_infos]
    envs.close()
    dummy.close()


def test_agents_save_what_they_were_trained_for(both):
    """The space is that of single environments, with an attribute."""
    envs, dummy = both
    known = {"robot": "tick", "task": "walk", "task_kwargs": {"time_limit": 1.0}}
    assert envs.observation_space.arc_suite == known
    assert not hasattr(envs.environments.single_observation_space, "arc_suite")


def test_calls_of_environments(both):
    envs, _ = both
    envs.set_attr("metadata", {"render_fps": 7})
    assert envs.get_attr("metadata") == [{"render_fps": 7}] * 3
    with pytest.raises(AttributeError, match=r"^cannot set 'note': there is no such attribute; "):
        envs.set_attr("note", 7)
    assert len(envs.env_method("render", indices=[0, 1, 2])) == 3
    for use in (lambda: envs.set_attr("note", 8, indices=0), lambda: envs.env_method("note", indices=[0])):
        with pytest.raises(ValueError, match=r"^note: environments share it; expected all 3, got "):
            use()


def test_stable_baselines_wrappers_take_them(both):
    for wrap in (vec_env.VecMonitor, vec_env.VecNormalize):
        one, other = (wrap(envs) for envs in both)
        one.seed(1), other.seed(1)
        assert data_equivalence(one.reset(), other.reset(), exact=True)
        for _ in range(25):
            actions = np.zeros((3, 18), np.float32)
            assert data_equivalence(one.step(actions)[:3], other.step(actions)[:3], exact=True)


def test_other_modes_are_one_line():
    message = "^stable-baselines3 resets at once: expected a vector environment of this suite with autoreset_mode='Same"
    for envs in (gymnasium.make_vec(ID, num_envs=2), gymnasium.make(ID)):
        with pytest.raises(ValueError, match=message) as error:
            sb3.VecEnv(envs)
        assert "\n" not in str(error.value)
