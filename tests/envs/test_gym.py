"""The suite through Gymnasium: its contract, its wrappers, and the same bits as the dm_env."""

import copy
import json
import pickle
import warnings

import gymnasium
import interpreters
import mujoco
import numpy as np
import pytest
from episodes import flat
from gymnasium import wrappers
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence
from refusals import refused
from tiers import never, tiers

import arc_suite
from arc_suite import registry
from arc_suite.tasks import TASKS
from arc_suite.tasks.walk import Walk

IDS = [f"arc_suite/{robot}-walk-v0" for robot in ("queen", "bastion", "tick", "leaper")]
SIZES = {"queen": (199, 18), "bastion": (151, 12), "tick": (199, 18), "leaper": (163, 12)}
PICTURES = ("rgb_array", "depth_array")


def robot(env_id):
    return env_id.removeprefix("arc_suite/").removesuffix("-walk-v0")


EVERY_ID = pytest.mark.parametrize("env_id", tiers(IDS, lambda env_id: robot(env_id) == "leaper"))


def actions(env, count, seed=0):
    size = env.action_space.shape[0]
    return np.random.default_rng(seed).uniform(-1, 1, (count, size)).astype(np.float32)


def begun_pair(env_id):
    """Two environments in the same state."""
    pair = gymnasium.make(env_id), gymnasium.make(env_id)
    for env in pair:
        env.reset(seed=0)
    return pair


def fell(env):
    """Puts the torso where no healthy one is."""
    env.unwrapped.physics.data.qpos[2] = 9.0


def assert_same(first, second):
    assert data_equivalence(first, second, exact=True)


def test_ids_are_those_of_the_suite():
    """In a process of its own: other tests register tasks."""
    code = "import arc_suite, gymnasium; print(*(name for name in gymnasium.registry if name.startswith('arc_suite/')))"
    (line,) = interpreters.printed(code)
    registered = line.split()
    places = {*arc_suite.ALL_TASKS, *(("bodies", task) for task in TASKS)}
    assert sorted(registered) == sorted(f"arc_suite/{domain}-{task}-v0" for domain, task in places)
    assert set(IDS) <= set(registered)


@pytest.mark.slow
def test_import_registers_lazily_and_in_silence_however_often():
    code = (
        f"import sys, importlib, gymnasium, arc_suite; spec = gymnasium.spec({IDS[0]!r});"
        "importlib.reload(arc_suite); importlib.reload(arc_suite.registration); arc_suite.registration.register_ids();"
        f"print('shimmy' in sys.modules, gymnasium.spec({IDS[0]!r}) is spec)"
    )
    assert interpreters.printed(code, options=("-W", "always")) == ["False True"]


@EVERY_ID
@pytest.mark.parametrize("render_mode", [None, *(pytest.param(m, marks=pytest.mark.slow) for m in PICTURES)])
def test_check_env_warns_of_infinite_bounds_alone(env_id, render_mode):
    size = {} if render_mode is None else {"width": 64, "height": 48}
    env = gymnasium.make(env_id, render_mode=render_mode, **size)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped)
    messages = [str(warning.message) for warning in caught]
    assert len(messages) == 2 and all("A Box observation space m" in m and "infinity" in m for m in messages)


def test_metadata_is_nobody_elses():
    from shimmy.dm_control_compatibility import DmControlCompatibilityV0

    env = gymnasium.make(IDS[0])
    env.unwrapped.metadata["render_fps"] = 7
    assert gymnasium.make(IDS[0]).metadata["render_fps"] == 20
    assert env.metadata["render_fps"] == 7
    assert DmControlCompatibilityV0.metadata["render_fps"] == 10  # shimmy's own default, untouched


@EVERY_ID
def test_spaces_and_types_of_a_reset_and_a_step(env_id):
    env = gymnasium.make(env_id)
    observations, motors = SIZES[robot(env_id)]
    assert env.observation_space == gymnasium.spaces.Box(-np.inf, np.inf, (observations,), np.float32)
    assert env.action_space == gymnasium.spaces.Box(-1.0, 1.0, (motors,), np.float32)
    assert env.metadata["render_fps"] == 20 and env.unwrapped.dt == 0.05
    observation, info = env.reset(seed=0)
    assert observation.dtype == np.float32 and info == {}
    observation, reward, terminated, truncated, info = env.step(actions(env, 1)[0])
    assert observation.dtype == np.float32 and observation in env.observation_space
    assert [type(value) for value in (reward, terminated, truncated)] == [float, bool, bool]
    figures = ["progress_speed", "progress_gait_compliance", "progress_cost_of_transport"]
    assert list(info) == [f"reward_{name}" for name in Walk.weights] + figures
    assert {type(figure) for figure in info.values()} == {float}
    assert json.loads(json.dumps(info)) == info
    weights = env.unwrapped.task.settings.weights
    assert reward == pytest.approx(sum(weights[name] * info[f"reward_{name}"] for name in weights), abs=1e-12)


@EVERY_ID
def test_every_call_returns_fresh_data(env_id):
    env = gymnasium.make(env_id)
    kept = [env.reset(seed=0)[0]] + [env.step(action)[0] for action in actions(env, 3)] + [env.reset()[0]]
    before = [observation.copy() for observation in kept]
    for action in actions(env, 3, seed=1):
        env.step(action)
    assert_same(kept, before)
    assert not any(np.shares_memory(a, b) for i, a in enumerate(kept) for b in kept[:i])


@EVERY_ID
def test_bit_equal_to_the_dm_env(env_id):
    env = gymnasium.make(env_id)
    environment = arc_suite.load(robot(env_id), "walk", {"random": 11})
    for seed in (11, None, None):  # the unseeded resets continue the stream
        observation, _ = env.reset(seed=seed)
        timestep = environment.reset()
        for action in [None, *actions(env, 60)]:
            if action is not None:
                observation, reward, terminated, _, info = env.step(action)
                timestep = environment.step(action)
                assert reward == timestep.reward and terminated == (timestep.discount == 0.0)
                assert {name: info[f"reward_{name}"] for name in Walk.weights} == environment.task.terms
            assert_same(observation, flat(timestep).astype(np.float32))
            if timestep.last():
                break


def test_seeds_of_all_kinds():
    env = gymnasium.make(IDS[3])
    observation = env.reset(seed=5)[0]
    for seed in (np.int64(5), np.uint8(5), np.int32(5)):
        assert_same(env.reset(seed=seed)[0], observation)
        assert env.unwrapped.np_random_seed == 5
    assert gymnasium.make(IDS[3], task_kwargs={"random": 7}).unwrapped.np_random_seed == 7
    assert not np.array_equal(env.reset(seed=2**32 - 1)[0], env.reset()[0])
    assert not np.array_equal(gymnasium.make(IDS[3]).reset()[0], gymnasium.make(IDS[3]).reset()[0])


@pytest.mark.parametrize("seed", [-1, 2**32, 1.5, "7", np.float32(3)])
def test_bad_seeds_are_one_line_and_change_nothing(seed):
    env, same = begun_pair(IDS[3])
    with refused(f"seed: expected an integer from 0 to 4294967295, got {seed!r}"):
        env.reset(seed=seed)
    assert_same(env.step(actions(env, 1)[0]), same.step(actions(env, 1)[0]))
    assert_same(env.reset()[0], same.reset()[0])
    with refused(f"seed: expected an integer from 0 to 4294967295, got {seed!r}"):
        arc_suite.load("leaper", "walk", {"random": seed})


def test_np_random_is_the_stream_of_resets():
    env, other = gymnasium.make(IDS[3]), gymnasium.make(IDS[3])
    assert env.unwrapped.np_random_seed == -1  # Gymnasium's sign for an unknown seed
    env.reset(seed=3), other.reset(seed=3)
    assert isinstance(env.np_random, np.random.Generator)
    assert env.np_random.random() == other.np_random.random()
    assert_same(env.reset()[0], other.reset()[0])
    env.np_random.random()
    assert not np.array_equal(env.reset()[0], other.reset()[0])
    for e in (env, other):
        e.unwrapped.np_random = np.random.default_rng(4)
    assert env.unwrapped.np_random_seed == -1
    assert_same(env.reset()[0], other.reset()[0])


@EVERY_ID
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_carry_on_bit_for_bit(env_id, duplicate):
    env = gymnasium.make(env_id, task_kwargs={"healthy_range": [-9.0, 9.0]})
    env.reset(seed=1)
    for action in actions(env, 30):
        env.step(action)
    twin = duplicate(env)
    for field in ("qpos", "qvel", "qacc_warmstart", "cfrc_ext", "xpos", "sensordata", "ctrl"):
        assert_same(*(getattr(each.unwrapped.physics.data, field).copy() for each in (env, twin)))
    for action in actions(env, 100, seed=2):
        assert_same(env.step(action), twin.step(action))
    assert_same(env.reset(), twin.reset())
    assert_same(env.step(actions(env, 1)[0]), twin.step(actions(env, 1)[0]))


@EVERY_ID
def test_pickles_are_small_and_hold_no_picture(env_id):
    env = gymnasium.make(env_id, render_mode="rgb_array", width=64, height=48)
    env.reset(seed=1)
    picture = env.render()
    stored = pickle.dumps(env)
    assert len(stored) < 1_000_000 and b"dm_control._render" not in stored
    twin = pickle.loads(stored)
    assert b"visual-" not in stored
    assert_same(twin.render(), picture)
    env.close()
    assert_same(twin.render(), picture)


@EVERY_ID
def test_spec_survives_json(env_id):
    kwargs = {
        "task_kwargs": {"weights": {"control": -0.2}, "healthy_range": [0.0, 2.0], "random": 5},
        "privileged": True,
    }
    env = gymnasium.make(env_id, **kwargs)
    spec = gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json())
    assert spec.max_episode_steps is None and spec.entry_point == "arc_suite.envs.gym:Env"
    again = gymnasium.make(spec)
    assert again.spec.to_json() == env.spec.to_json()
    assert_same(env.reset(), again.reset())
    assert_same(env.step(actions(env, 1)[0]), again.step(actions(env, 1)[0]))
    assert gymnasium.spec(env_id).to_json()


@pytest.mark.long
@pytest.mark.parametrize("env_id", tiers(IDS, never, lambda env_id: robot(env_id) == "tick"))
def test_both_time_limits_agree(env_id):
    def last_step(env, before_last=lambda env: None):
        env.reset(seed=0)
        action = np.zeros(env.action_space.shape, np.float32)
        for _ in range(999):
            *_, terminated, truncated, _ = env.step(action)
            assert (terminated, truncated) == (False, False)
        before_last(env)
        return env.step(action)[2:4]

    own = gymnasium.make(env_id)  # no TimeLimit: the dm_env's limit
    wrapped = gymnasium.make(env_id, max_episode_steps=1000, task_kwargs={"time_limit": 60.0})  # the TimeLimit's alone
    assert last_step(own) == last_step(wrapped) == (False, True)
    with pytest.raises(ResetNeeded):
        own.step(np.zeros(own.action_space.shape))
    assert last_step(own, before_last=fell) == (True, False)
    assert last_step(wrapped, before_last=fell) == (True, True)  # as TimeLimit says of its own limit


NEEDS_RESET = "cannot step: the episode has ended or has not begun; call reset first"


@EVERY_ID
def test_order_of_calls(env_id):
    env = gymnasium.make(env_id)
    action = np.zeros(env.action_space.shape, np.float32)
    with pytest.raises(ResetNeeded, match=r"^Cannot call env.step\(\) before calling env.reset\(\)$"):
        env.step(action)
    with pytest.raises(ResetNeeded, match=f"^{NEEDS_RESET}$"):
        env.unwrapped.step(action)
    env.reset(seed=0)
    fell(env)
    _, _, terminated, truncated, info = env.step(action)
    assert (terminated, truncated, info["reward_healthy"]) == (True, False, 0.0)
    state = env.unwrapped.physics.get_state()
    for _ in range(2):
        with pytest.raises(ResetNeeded, match=f"^{NEEDS_RESET}$"):
            env.step(action)
    assert_same(env.unwrapped.physics.get_state(), state)
    env.reset()
    assert not env.step(action)[2]


@EVERY_ID
def test_closed_environments_say_so(env_id):
    env = gymnasium.make(env_id, render_mode="rgb_array", width=32, height=32)
    env.reset()
    env.render()
    env.close()
    env.close()
    for call, use in (
        ("reset", env.reset),
        ("step", lambda: env.step(np.zeros(env.action_space.shape, np.float32))),
        ("render", env.render),
        ("copy", lambda: copy.deepcopy(env)),
    ):
        with refused(f"cannot {call}: the environment is closed; make a new one", ClosedEnvironmentError):
            use()


def no_numbers(kind):
    return f"action: expected 12 numbers, got {kind}"


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(11), "action: expected shape (12,), got (11,)"),
        (np.zeros((1, 12)), "action: expected shape (12,), got (1, 12)"),
        (np.array([0.0] * 4 + [np.nan] + [0.0] * 7), "action[4]: expected a number from -1 to 1, got nan"),
        ("walk", no_numbers("str")),
        ([10**400] * 12, no_numbers("list")),
        ([0.5] * 11 + [10**400], no_numbers("list")),
        ([1j] * 12, no_numbers("list")),
        (np.zeros(12, complex), no_numbers("ndarray of complex128")),
        (["1"] * 12, no_numbers("list")),
        (np.zeros(12, "M8[s]"), no_numbers("ndarray of datetime64[s]")),
        (np.zeros(12, "m8[s]"), no_numbers("ndarray of timedelta64[s]")),
        (np.zeros(12, object), no_numbers("ndarray of object")),
        (np.ma.masked_array(np.zeros(12), mask=[True] + [False] * 11), no_numbers("MaskedArray of float64")),
        (None, no_numbers("NoneType")),
    ],
)
def test_bad_actions_change_nothing(action, message, recwarn):
    env, same = begun_pair(IDS[1])
    with refused(message):
        env.unwrapped.step(action)
    assert not recwarn
    assert_same(env.step(actions(env, 1)[0]), same.step(actions(env, 1)[0]))


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.longdouble, int, np.uint8, bool, list, "out of range"])
def test_real_numbers_of_all_kinds_are_actions(kind):
    env, same = begun_pair(IDS[1])
    given = {list: [1.0] * 12, "out of range": np.full(12, 3.0)}.get(kind)
    assert_same(env.unwrapped.step(np.ones(12, kind) if given is None else given), same.unwrapped.step(np.ones(12)))


RGB = {"render_mode": "rgb_array"}
CAMERAS = ["tracking", "portrait", "profile", "eye"]
WRONG = {"weights": {"controll": 1.0}}


def there(names):
    return f"there are: {', '.join(names)}"


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({**RGB, "camera_id": "trackin"}, f"unknown camera 'trackin'; did you mean 'tracking'? ({there(CAMERAS)})"),
        ({**RGB, "camera_id": 4}, f"no camera 4: expected -1 (free) to 3, or one of {CAMERAS}"),
        ({**RGB, "camera_id": 1.5}, f"no camera 1.5: expected -1 (free) to 3, or one of {CAMERAS}"),
        (
            {"task_kwargs": WRONG},
            f"unknown term of weights 'controll'; did you mean 'control'? ({there(Walk.weights)})",
        ),
        (
            {"domain_name": "quen"},
            f"unknown robot 'quen'; did you mean 'queen'? ({there(registry.robot_words())}, module:name to import it)",
        ),
        (
            {"task_name": "wlak"},
            f"unknown task 'wlak'; did you mean 'walk'? ({there(TASKS)}, module:name to import it)",
        ),
    ],
)
def test_bad_arguments_are_one_line(kwargs, message):
    with refused(message):
        gymnasium.make(IDS[0], **kwargs)


def test_unknown_render_modes_are_one_line(monkeypatch):
    monkeypatch.setattr("arc_suite.simulation.opengl.has_display", lambda: False)
    unknown = "unknown render_mode 'rgb_aray'; did you mean 'rgb_array'? (there are: rgb_array, depth_array)"
    with pytest.warns(UserWarning, match="rgb_aray"), refused(unknown):  # Gymnasium's own warning
        gymnasium.make(IDS[0], render_mode="rgb_aray")
    with refused("render_mode 'human' needs a display, and there is none; use rgb_array or depth_array"):
        gymnasium.make(IDS[0], render_mode="human")


def test_human_is_offered_where_there_is_a_display(monkeypatch):
    for display, modes in ((True, ["rgb_array", "depth_array", "human"]), (False, ["rgb_array", "depth_array"])):
        monkeypatch.setattr("arc_suite.simulation.opengl.has_display", lambda display=display: display)
        assert gymnasium.make(IDS[0]).metadata["render_modes"] == modes


@pytest.mark.slow
def test_human_without_a_window_is_one_line():
    code = (
        "import gymnasium, arc_suite\n"
        f"env = gymnasium.make({IDS[0]!r}, render_mode='human')\n"
        "try: env.reset()\n"
        "except arc_suite.simulation.opengl.RenderingUnavailable as error: print(error)\n"
    )
    expected = "cannot open a window: (65550) b'X11: Failed to open display :9876'; use render_mode 'rgb_array'"
    assert interpreters.printed(code, DISPLAY=":9876", WAYLAND_DISPLAY=None) == [expected]


@EVERY_ID
def test_pictures(env_id):
    def picture(**kwargs):
        env = gymnasium.make(env_id, width=80, height=60, **kwargs)
        env.reset(seed=0)
        return env.render()

    rgb, depth = picture(render_mode="rgb_array"), picture(render_mode="depth_array")
    assert rgb.shape == (60, 80, 3) and rgb.dtype == np.uint8 and rgb.std() > 5
    assert depth.shape == (60, 80) and depth.dtype == np.float32 and 0 < depth.min() < 10
    assert (rgb != picture(render_mode="rgb_array", camera_id="portrait")).any()
    assert gymnasium.make(env_id).unwrapped.render() is None


@pytest.mark.parametrize("size", [{"width": 0}, {"height": -3}, {"width": 100_000}, {"height": 2.5}])
@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_impossible_sizes_are_one_line_when_the_environment_is_made(make, size):
    ((name, value),) = size.items()
    with pytest.raises(ValueError, match=rf"^{name}: expected an integer from 1 to \d+, got {value}$"):
        make(IDS[0], render_mode="rgb_array", **size)


@pytest.mark.slow
def test_pictures_of_1920_x_1080():
    env = gymnasium.make(IDS[0], render_mode="rgb_array", width=1920, height=1080)
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (1080, 1920, 3) and picture.std() > 5


def test_render_collection():
    env = gymnasium.make(IDS[0], render_mode="rgb_array_list", width=32, height=32)
    env.reset(seed=0)
    for action in actions(env, 3):
        env.step(action)
    assert [frame.shape for frame in env.render()] == [(32, 32, 3)] * 4


@EVERY_ID
def test_wrappers(env_id):
    env = gymnasium.make(env_id, task_kwargs={"time_limit": 0.5})
    env = wrappers.RescaleAction(wrappers.FlattenObservation(env), np.float32(-2), np.float32(2))
    env = wrappers.RecordEpisodeStatistics(wrappers.NormalizeObservation(env))
    observation, _ = env.reset(seed=0)
    total, done = 0.0, False
    while not done:
        observation, reward, terminated, truncated, info = env.step(np.zeros(env.action_space.shape, np.float32))
        total, done = total + reward, terminated or truncated
    assert info["episode"]["l"] == 10 and info["episode"]["r"] == pytest.approx(total)
    assert np.isfinite(observation).all() and observation.dtype == np.float32


def test_wrappers_that_draw_random_numbers():
    env = wrappers.AddWhiteNoise(gymnasium.make(IDS[0], render_mode="rgb_array", width=32, height=32), 0.5)
    env.reset(seed=0)
    assert env.render().shape == (32, 32, 3)


@pytest.mark.slow
def test_gymnasium_records_films(tmp_path):
    pytest.importorskip("moviepy", reason="of the extra `video`")
    env = gymnasium.make("arc_suite/tick-walk-v0", render_mode="rgb_array", width=64, height=48)
    with wrappers.RecordVideo(env, str(tmp_path / "films"), name_prefix="tick") as recorded:
        recorded.reset(seed=0)
        for _ in range(3):
            recorded.step(recorded.action_space.sample())
    assert [path.name for path in tmp_path.glob("films/*.mp4")] == ["tick-episode-0.mp4"]


def test_data_and_model_are_those_of_mujoco():
    env = gymnasium.make("arc_suite/tick-walk-v0")
    env.reset(seed=0)
    mujoco.mj_forward(env.unwrapped.model, env.unwrapped.data)
    assert env.unwrapped.data is env.unwrapped.physics.data.ptr
    assert env.unwrapped.model is env.unwrapped.physics.model.ptr
