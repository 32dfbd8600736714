"""The vector environment: each of its environments is a single environment, to the last bit."""

import copy
import functools
import gc
import itertools
import pickle
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector as wrappers
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import never, tiers, turns

import arc_suite
from arc_suite.envs.vector import VectorEnv

ROBOTS = ("queen", "bastion", "tick", "leaper")
MODES = ("NextStep", "SameStep")
PARTS = ("observation", "reward", "terminated", "truncated", "info")
# Episodes of 20 steps, and torso heights that random actions leave now and then.
SHORT = {
    "queen": {"time_limit": 1.0, "healthy_range": (0.6, 1.2)},
    "bastion": {"time_limit": 1.0, "healthy_range": (0.4, 1.0)},
    "tick": {"time_limit": 1.0},
    "leaper": {"time_limit": 1.0, "healthy_range": (0.35, 1.0)},
}


def make(robot="queen", num_envs=3, **kwargs):
    return gymnasium.make_vec(f"arc_suite/{robot}-walk-v0", num_envs=num_envs, **kwargs)


def make_singles(robot, num_envs, mode="NextStep", **kwargs):
    return make(robot, num_envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **kwargs)


def random_actions(envs, count, seed=0):
    return np.random.RandomState(seed).uniform(-1, 1, (count, *envs.action_space.shape)).astype(np.float32)


same = functools.partial(data_equivalence, exact=True)


def assert_same_steps(one, other, steps):
    for actions in steps:
        assert same(one.step(actions), other.step(actions))


def arrays(value):
    """All arrays within a nested result."""
    if isinstance(value, dict):
        return [array for item in value.values() for array in arrays(item)]
    if isinstance(value, (tuple, list)) or (isinstance(value, np.ndarray) and value.dtype == object):
        return [array for item in value for array in arrays(item)] + ([value] if isinstance(value, np.ndarray) else [])
    return [value] if isinstance(value, np.ndarray) else []


@pytest.mark.parametrize(("mode", "robot"), tiers(itertools.product(MODES, ROBOTS), never, turns(MODES, ROBOTS)))
def test_environments_are_single_environments_whatever_the_threads(robot, mode):
    singles = make_singles(robot, 5, mode, task_kwargs=SHORT[robot])
    batches = [
        make(robot, 5, num_threads=threads, autoreset_mode=mode, task_kwargs=SHORT[robot]) for threads in (1, 2, 3, 8)
    ]
    expected = singles.reset(seed=3)
    for batch in batches:
        assert same(batch.reset(seed=3), expected)
    ends = np.zeros(2, int)
    for actions in random_actions(singles, 70):
        expected = singles.step(actions)
        for batch in batches:
            result = batch.step(actions)
            for part, value, wanted in zip(PARTS, result, expected, strict=True):
                assert same(value, wanted), part
        ends += expected[2].sum(), expected[3].sum()
    assert (ends > 0).all(), f"{ends} episodes ended by termination and by truncation: nothing was tried"
    if mode == "SameStep":
        assert result[4].keys() >= {"reward_forward", "_reward_forward"}


@pytest.mark.parametrize("mode", tiers(MODES, lambda mode: mode == "SameStep"))
def test_gymnasiums_step_limit_truncates_too(mode):
    limits = {"task_kwargs": SHORT["tick"], "max_episode_steps": 7}
    singles, batch = make_singles("tick", 4, mode, **limits), make("tick", 4, autoreset_mode=mode, **limits)
    assert same(batch.reset(seed=0), singles.reset(seed=0))
    assert_same_steps(batch, singles, random_actions(batch, 30))


def test_make_vec_gives_the_native_environment():
    batch, singles = make(num_envs=4), make_singles("queen", 4)
    assert isinstance(batch, VectorEnv)
    assert batch.spec.id == "arc_suite/queen-walk-v0"
    assert batch.num_envs == 4
    for space in ("single_observation_space", "single_action_space", "observation_space", "action_space"):
        assert getattr(batch, space) == getattr(singles, space), space
    assert batch.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert batch.metadata["render_fps"] == 20
    for mode in AutoresetMode:
        envs = make(autoreset_mode=mode)
        assert envs.autoreset_mode is envs.metadata["autoreset_mode"] is mode
    observation, info = batch.reset(seed=0)
    assert observation in batch.observation_space and info == {}
    observation, reward, terminated, truncated, info = batch.step(batch.action_space.sample())
    assert observation in batch.observation_space
    assert (reward.shape, reward.dtype) == ((4,), np.float64)
    assert terminated.dtype == truncated.dtype == bool
    assert_array_equal(info["_reward_forward"], [True] * 4)
    assert (info["reward_forward"].shape, info["progress_speed"].dtype) == ((4,), np.float64)


def test_episode_that_ends_rests_until_its_reset_where_there_is_no_autoreset():
    """Gymnasium's contract of the mode: who asks for no autoreset resets those that have ended."""
    singles = make_singles("tick", 4, "Disabled", task_kwargs=SHORT["tick"])
    batch = make("tick", 4, autoreset_mode="Disabled", task_kwargs=SHORT["tick"])
    late = make("tick", 4, autoreset_mode="Disabled", task_kwargs=SHORT["tick"])
    assert same(batch.reset(seed=3), singles.reset(seed=3))
    late.reset(seed=3)
    resets = 0
    for actions in random_actions(batch, 60):
        result = batch.step(actions)
        assert same(result, singles.step(actions))
        ended = result[2] | result[3]
        if ended.any():
            mask = {"reset_mask": ended}
            assert same(batch.reset(options=mask), singles.reset(options={"reset_mask": ended.copy()}))
            resets += 1
    assert resets > 5
    done = np.zeros(4, bool)
    for count, actions in enumerate(random_actions(late, 25)):
        if count == 22:
            late.rest(np.array([True, False, False, False]))  # wakes none of the others
        qpos = late.batch.data.qpos.copy()
        observation, reward, terminated, truncated, info = late.step(actions)
        assert_array_equal(late.batch.data.qpos[done], qpos[done])
        assert not (reward[done].any() or terminated[done].any() or truncated[done].any())
        assert not info.get("_reward_forward", done & False)[done].any()
        done |= terminated | truncated
    assert done.all()


@pytest.mark.parametrize("task", ["steer", pytest.param("walk", marks=pytest.mark.slow)])
@pytest.mark.parametrize("mode", tiers([*MODES, "Disabled"], lambda mode: mode == "NextStep"))
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda envs: pickle.loads(pickle.dumps(envs))])
def test_copies_carry_on_bit_for_bit(duplicate, mode, task):
    settings = {"time_limit": 1.0, "arena": "bumps"}
    batch = gymnasium.make_vec(f"arc_suite/tick-{task}-v0", num_envs=4, autoreset_mode=mode, task_kwargs=settings)
    batch.reset(seed=[1, 2, None, 4])
    steps = random_actions(batch, 90)
    for actions in steps[:33]:
        batch.step(actions)
    batch.rest(np.array([False, False, False, True]))
    twin = duplicate(batch)
    assert len(pickle.dumps(batch)) < 1_000_000
    assert twin.np_random_seed == batch.np_random_seed == (1, 2, -1, 4)
    with pytest.raises(ValueError, match="read-only"):
        twin.batch.data.xpos[...] = 0.0
    assert_same_steps(twin, batch, steps[33:54])
    mask = {"reset_mask": np.array([True, False, False, True])}
    assert same(twin.reset(options=mask), batch.reset(options=mask))
    assert_same_steps(twin, batch, steps[54:])
    fresh = duplicate(make("tick", 2))
    assert same(fresh.reset(seed=0), make("tick", 2).reset(seed=0))


@pytest.mark.slow
def test_calls_and_attributes_of_environments_are_those_of_single_environments():
    settings = {"task_kwargs": {"time_limit": 1.0}, "render_mode": "rgb_array", "width": 32, "height": 24}
    batch, singles = make("tick", 3, **settings), make_singles("tick", 3, **settings)
    assert batch.np_random_seed == singles.np_random_seed == (-1, -1, -1)
    for seed, options in ((5, None), ([8, None, 9], None), (20, {"reset_mask": np.array([True, False, True])})):
        batch.reset(seed=seed, options=options), singles.reset(seed=seed, options=options)
        assert batch.np_random_seed == singles.np_random_seed
    assert batch.np_random_seed == (20, 6, 22)
    for name in ("np_random_seed", "render_mode", "observation_space", "action_space"):
        assert batch.get_attr(name) == batch.call(name) == singles.get_attr(name), name
    assert same(batch.call("render"), singles.call("render"))
    assert [one.random() for one in batch.np_random] == [one.random() for one in singles.get_attr("np_random")]
    assert same(batch.reset(), singles.reset())
    assert make("tick", 2, task_kwargs={"random": 5}).np_random_seed == (5, 6)
    assert make("tick", 2).call("render") == (None, None)
    batch.set_attr("render_mode", [7, 7, 7])
    assert batch.get_attr("render_mode") == (7, 7, 7)
    batch.set_attr("render_mode", "all")
    assert batch.render_mode == "all"
    for values in ([1, 2, 3], [1, 1]):
        with refused("set_attr 'render_mode': environments share it; expected one value for all, got", begins=True):
            batch.set_attr("render_mode", values)
    with refused("call 'step': environments do it together; call step of the environment itself"):
        batch.call("step", np.zeros((3, 18)))
    with pytest.raises(AttributeError, match="nothing"):
        batch.get_attr("nothing")
    steer = gymnasium.make_vec("arc_suite/tick-steer-v0", num_envs=2)
    steer.reset(seed=0)
    assert steer.call("command", "command", [1.0, 0.0, 0.5]) == (None, None)
    steer.step(np.zeros((2, 18)))
    assert_array_equal(steer._memory.command.live, [[1.0, 0.0, 0.5]] * 2)


def test_seeds_of_all_kinds():
    batch = make(num_envs=2)
    observation, _ = batch.reset(seed=5)
    for seed in (np.int64(5), [5, 6], np.array([5, 6])):
        assert_array_equal(batch.reset(seed=seed)[0], observation)
    assert_array_equal(make(num_envs=2, task_kwargs={"random": 5}).reset()[0], observation)
    assert_array_equal(batch.reset(seed=[None, 6])[0][1], observation[1])
    assert not np.array_equal(batch.reset()[0], observation)
    assert not np.array_equal(make(num_envs=2).reset()[0], make(num_envs=2).reset()[0])


@pytest.mark.parametrize("mode", tiers(MODES, lambda mode: mode == "SameStep"))
def test_environments_that_rest_stand_still_until_their_reset_and_the_others_notice_nothing(mode):
    batch, awake = (make("tick", 4, autoreset_mode=mode, task_kwargs=SHORT["tick"]) for _ in range(2))
    batch.reset(seed=0), awake.reset(seed=0)
    mask = np.array([True, False, True, False])
    for count, actions in enumerate(random_actions(batch, 60)):
        if count == 3:
            batch.rest(mask)
            still = batch.batch.data.qpos[mask].copy()
        observations, rewards, terminated, truncated, info = batch.step(actions)
        expected = awake.step(actions)
        for here, there in zip((observations, rewards, terminated, truncated), expected[:4], strict=True):
            assert_array_equal(here[~mask], there[~mask])
        if count >= 3:
            assert_array_equal(batch.batch.data.qpos[mask], still)
            assert not (rewards[mask].any() or terminated[mask].any() or truncated[mask].any())
            assert not info.get("_reward_forward", mask & False)[mask].any()
    fresh = make("tick", 4, autoreset_mode=mode, task_kwargs=SHORT["tick"])
    fresh.reset(seed=7)
    batch.reset(seed=7)  # wakes them
    assert_same_steps(batch, fresh, random_actions(batch, 20))
    with pytest.raises(ValueError, match="^mask: expected 4 booleans, at least one of them true, got array"):
        batch.rest(np.zeros(4, bool))


@pytest.mark.parametrize("mode", tiers(MODES, lambda mode: mode == "SameStep"))
def test_reset_mask_restarts_some_environments(mode):
    singles = make_singles("tick", 4, mode, task_kwargs=SHORT["tick"])
    batch = make("tick", 4, autoreset_mode=mode, task_kwargs=SHORT["tick"])
    assert same(batch.reset(seed=0), singles.reset(seed=0))
    steps = random_actions(batch, 60)
    for count, actions in enumerate(steps):
        result, expected = batch.step(actions), singles.step(actions)
        if count % 7 == 0:
            seed = 100 * count if count % 2 else None
            mask = np.arange(4) % 2 == count % 2
            before = batch.reset(seed=seed, options={"reset_mask": mask})
            assert same(before, singles.reset(seed=seed, options={"reset_mask": mask.copy()}))
        assert same(result, expected)  # also after the reset: what is handed out stays
    for wrong in (np.ones(3, bool), np.zeros(4, bool), np.arange(4)):
        with pytest.raises(ValueError, match="^reset_mask: expected 4 booleans, at least one of them true, got array"):
            batch.reset(options={"reset_mask": wrong})
    with pytest.raises(ResetNeeded, match="^cannot reset some environments: reset all of them first$"):
        make(num_envs=4).reset(options={"reset_mask": mask})


@pytest.mark.parametrize("mode", tiers(MODES, lambda mode: mode == "SameStep"))
def test_what_is_handed_out_is_the_callers_own(mode):
    batch, twin = (make("tick", 3, autoreset_mode=mode, task_kwargs=SHORT["tick"]) for _ in range(2))
    first = batch.reset(seed=0)
    assert same(twin.reset(seed=0), first)
    mine = arrays(first)
    for actions in random_actions(batch, 45):
        given = actions.copy()
        result = batch.step(given)
        assert same(twin.step(actions), result)
        inside = [*vars(batch.batch.data).values()]
        for array in arrays(result):
            assert not any(np.may_share_memory(array, other) for other in (*mine, *inside, given))
            mine.append(array)
        assert len({array.__array_interface__["data"] for array in arrays(result)}) == len(arrays(result))
        for array in [*arrays(result), given]:  # the caller may do what he likes with them
            array[...] = None if array.dtype == object else 7
        mine = mine[-50:]


def test_nan_is_refused_before_anything_moves():
    batch, twin = make("leaper", 6), make("leaper", 6)
    batch.reset(seed=0), twin.reset(seed=0)
    for env, actions in enumerate(random_actions(batch, 6)):
        poisoned = actions.copy()
        poisoned[env, 2 * env] = np.nan
        with pytest.raises(ValueError, match=rf"^action\[{env}, {2 * env}\]: expected a number from -1 to 1, got nan$"):
            batch.step(poisoned)
        assert same(batch.step(actions), twin.step(actions))
    with pytest.raises(ValueError, match=r"^action: expected shape \(6, 12\), got \(12,\)$"):
        batch.step(np.zeros(12))
    with pytest.raises(ValueError, match=r"^action: expected 6 x 12 numbers, got list$"):
        batch.step(["forward"] * 6)
    assert same(batch.step(actions * 100), twin.step(np.sign(actions)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.NormalizeObservation,
        wrappers.NormalizeReward,
        wrappers.DictInfoToList,
        wrappers.FlattenObservation,
        lambda envs: wrappers.RescaleAction(envs, np.float32(0.0), np.float32(2.0)),
        wrappers.ClipAction,
        lambda envs: wrappers.ClipReward(envs, 0.0, 1.0),
        lambda envs: wrappers.DtypeObservation(envs, np.float64),
        lambda envs: wrappers.TransformObservation(envs, lambda observation: observation * 2.0),
    ],
)
def test_gymnasiums_wrappers_do_to_it_what_they_do_to_single_environments(wrap):
    batch = wrap(make("tick", 3, task_kwargs=SHORT["tick"]))
    singles = wrap(make_singles("tick", 3, task_kwargs=SHORT["tick"]))
    assert same(batch.reset(seed=1), singles.reset(seed=1))
    assert_same_steps(batch, singles, random_actions(batch, 45))


@pytest.mark.parametrize("mode", tiers(MODES, lambda mode: mode == "SameStep"))
def test_statistics_are_those_of_single_environments_in_both_modes(mode):
    """Not those of the test itself: in the mode SameStep Gymnasium 1.2's wrapper forgets last rewards."""
    batch = wrappers.RecordEpisodeStatistics(make("tick", 3, autoreset_mode=mode, task_kwargs=SHORT["tick"]))
    singles = wrappers.RecordEpisodeStatistics(make_singles("tick", 3, mode, task_kwargs=SHORT["tick"]))
    batch.reset(seed=0), singles.reset(seed=0)
    lengths = []
    for actions in random_actions(batch, 45):
        *_, terminated, truncated, info = batch.step(actions)
        ended, expected = terminated | truncated, singles.step(actions)[4]
        assert ended.any() == ("episode" in info)
        for name in ("r", "l") if ended.any() else ():
            assert_array_equal(info["episode"][name], expected["episode"][name])
        lengths += [info["episode"]["l"][env] for env in np.flatnonzero(ended)]
    assert len(lengths) > 3 and max(lengths) == 20


@pytest.mark.slow
def test_render_shows_each_environment_and_disturbs_nothing():
    size = {"width": 80, "height": 60}
    batch, twin = make("queen", 2, render_mode="rgb_array", **size), make("queen", 2)
    single = gymnasium.make("arc_suite/queen-walk-v0", render_mode="rgb_array", **size)
    batch.reset(seed=4), twin.reset(seed=4), single.reset(seed=5)
    for actions in random_actions(batch, 5):
        assert same(batch.step(actions), twin.step(actions))
        single.step(actions[1])
        one, two = batch.render()
        assert (one.shape, one.dtype) == ((60, 80, 3), np.uint8)
        assert not np.array_equal(one, two)
        assert_array_equal(two, single.render())
        assert_array_equal(batch.render([1])[0], two)
    assert twin.render() is None
    depth = make("queen", 2, render_mode="depth_array", **size)
    depth.reset(seed=4)
    assert depth.render()[0].shape == (60, 80) and depth.render()[0].dtype == np.float32


@pytest.mark.parametrize(("task", "steps"), [("steer", 3), ("navigate", 3), ("limp", 42)])
def test_pictures_show_arrows_pillars_and_dark_legs_as_those_of_single_environments(task, steps):
    envs = VectorEnv("tick", task, 2, render_mode="rgb_array", height=60, width=80)
    single = arc_suite.load("tick", task)
    envs.reset(seed=3), single.reset(seed=4)
    for _ in range(steps):
        envs.step(np.zeros((2, 18))), single.step(np.zeros(18))
    assert_array_equal(envs.render([1])[0], single.physics.render(60, 80))


def test_calls_at_the_wrong_time():
    batch = make()
    with pytest.raises(ResetNeeded, match="^cannot step: no episode has begun; call reset first$"):
        batch.step(np.zeros((3, 18)))
    batch.reset()
    batch.close()
    batch.close()
    for call in (batch.reset, batch.render, lambda: batch.step(np.zeros((3, 18))), lambda: batch.task.privileged):
        with pytest.raises(ClosedEnvironmentError, match="the environment is closed; make a new one$"):
            call()


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"num_envs": 0}, "num_envs: expected an integer from 1 to 1048576, got 0"),
        ({"num_threads": 1.5}, "num_threads: expected an integer from 1 to 1024, got 1.5"),
        (
            {"autoreset_mode": "samestep"},
            "unknown autoreset_mode 'samestep'; did you mean 'SameStep'? (there are: NextStep, SameStep, Disabled)",
        ),
        ({"render_mode": "rgb"}, "unknown render_mode 'rgb' (there are: rgb_array, depth_array)"),
        ({"render_mode": "rgb_aray"}, "unknown render_mode 'rgb_aray'; did you mean 'rgb_array'?"),
        ({"render_mode": "rgb_array", "camera_id": "tracing"}, "unknown camera 'tracing'; did you mean 'tracking'?"),
        ({"task_kwargs": {"weigths": {}}}, "unknown setting of walk 'weigths'; did you mean 'weights'?"),
        ({"task_kwargs": {"random": -1}}, "seed: expected an integer from 0 to 4294967295, got -1"),
        ({"task_kwargs": {"on_divergence": "raise"}}, "unknown on_divergence of many environments 'raise'"),
    ],
)
def test_bad_arguments_are_one_line_errors(kwargs, message, monkeypatch):
    ignored = []
    monkeypatch.setattr(sys, "unraisablehook", ignored.append)
    with refused(message, begins=True):
        make(**kwargs)
    gc.collect()
    assert not ignored  # where Gymnasium closes what was never made


def test_time_at_rest_does_not_count():
    environment = VectorEnv("queen", "walk", 2, 1, "Disabled", task_kwargs={"time_limit": 0.5, "random": 0})  # 10 steps
    environment.reset()
    own_steps = np.zeros(2, int)
    rests = {1: [True, False], 5: [False, True]}  # by call: who rests from then on
    for call in range(11):
        if call in rests:
            environment.rest(np.array(rests[call]))
        at_rest = environment._resting.copy()
        truncated = environment.step(np.zeros((2, 18)))[3]
        own_steps += ~at_rest
        assert not truncated.any()
    assert own_steps.tolist() == [7, 5]
    assert environment.snapshot()["steps"].tolist() == [7, 5]
    ends = [environment.step(np.zeros((2, 18)))[3].tolist() for _ in range(3)]
    assert ends == [[False, False], [False, False], [True, False]]


def test_an_end_waits_for_its_start_while_the_environment_rests():
    environment = VectorEnv("tick", "walk", 2, 1, "NextStep", task_kwargs={"time_limit": 0.2})  # 4 steps
    environment.reset(seed=0)
    actions = np.zeros(environment.action_space.shape)
    ends = [environment.step(actions)[3].tolist() for _ in range(4)]
    assert ends[3] == [True, True]
    environment.rest(np.array([True, False]))
    environment.step(actions)
    assert environment.snapshot()["steps"].tolist() == [4, 0]
    environment.rest(np.array([False, True]))
    _, rewards, _, truncated, _ = environment.step(actions)  # starts the next episode of environment 0
    assert (rewards.tolist(), truncated.tolist()) == ([0.0, 0.0], [False, False])
    assert environment.snapshot()["steps"].tolist() == [0, 0]


def test_ends_of_another_mode_start_in_the_next_step():
    settings = {"time_limit": 0.5, "random": 0}  # 10 steps
    donor = VectorEnv("queen", "walk", 2, 1, "Disabled", task_kwargs=settings)
    donor.reset()
    for _ in range(9):
        donor.step(np.zeros((2, 18)))
    arrays = donor.snapshot()
    arrays["steps"][1] = 10
    arrays["ended"][1] = True  # environment 1 has ended, and environment 0 ends in the next step
    environment = VectorEnv("queen", "walk", 2, 1, "SameStep", task_kwargs=settings)
    environment.restore(arrays)
    _, _, _, truncated, info = environment.step(np.zeros((2, 18)))
    assert truncated.tolist() == [True, False]
    assert info["_final_obs"].tolist() == [True, False]
    assert environment.snapshot()["steps"].tolist() == [0, 0]
    assert not environment.step(np.zeros((2, 18)))[3].any()
