"""Bad input: the exact line it is answered with, and that nothing has changed then."""

import os
import pathlib
import pickle

import dm_env
import gymnasium
import mujoco
import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite import evaluation, policies, registry
from arc_suite.arenas import ARENAS
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

ID = "arc_suite/bastion-walk-v0"
ZEROS = np.zeros(12)
EIGHTEEN = {"posture": np.zeros((2, 17)), "velocities": np.zeros((2, 24))}  # velocities of other joints
MODES, TRUNCATE = "(there are: NextStep, SameStep, Disabled)", "(there are: truncate)"
NAN = np.where(np.arange(12) == 7, np.nan, 0.0)
PICTURE = {"render_mode": "rgb_array", "width": 32, "height": 24}
TASK_NAMES = f"(there are: {', '.join(TASKS)}, module:name to import it)"
ARENA_NAMES = f"(there are: {', '.join(ARENAS)}, module:name to import it)"
DOMAINS = f"(there are: {', '.join(registry.robot_words())}, module:name to import it)"
PRESETS = (
    "(there are: slow, medium, fast, tuned, refined, straight, steered, surefooted, climbing, braced, reactive, "
    "sighted, leaping, planned, tracked, rising, crossing)"
)
CAMERAS, NAMED = "['tracking', 'portrait', 'profile', 'eye']", "(there are: tracking, portrait, profile, eye)"
ONE_BODY = (
    "arc_suite/bodies-walk-v0: gymnasium.make_vec makes these environments, with num_envs; gymnasium.make takes a "
    "robot in place of bodies, or arc_suite.envs.gym.Env a body and 'walk'"
)
ONE_MAPPING = (
    "task_kwargs: expected one mapping for all environments, got [{}, {}]; "
    "change_settings with a mask sets those of some"
)
PLACED_CAMERA = mujoco.MjvCamera()
PLACED = f"camera_id: expected one of {CAMERAS}; an MjvCamera is for physics.render"
BLOCKS = "observation: expected blocks posture and velocities by name, as `split` of a task gives them"
GAITS = "(there are: trot, pace, bound, walk, tripod, tetrapod, ripple, wave)"
SEED = "seed: expected an integer from 0 to 4294967295, got"
POLICIES = "(there are: cpg, zero, random, ppo, universal)"
MODULE = "expected module:name, with a module that can be imported"
OWN = "is the suite's own, expected without a module"
MASK = "reset_mask: expected 3 booleans, at least one of them true, got"
POSITIVE = "expected a number above 0, at most 1e+06"
COMMAND = "command 'command': expected 3 numbers from -1e+06 to 1e+06, got"


class World:
    """A dm_env, a Gymnasium environment and a vector environment, all in mid-episode."""

    def __init__(self):
        self.dm = arc_suite.load("bastion", "walk", {"random": 0})
        self.env = gymnasium.make(ID, **PICTURE).unwrapped
        self.envs = gymnasium.make_vec(ID, num_envs=3, num_threads=1, **PICTURE)
        self.dm.reset(), self.env.reset(seed=0), self.envs.reset(seed=0)
        for _ in range(3):
            self.dm.step(ZEROS), self.env.step(ZEROS), self.envs.step(np.zeros((3, 12)))
        self.steer = arc_suite.load("bastion", "steer", {"random": 0})
        self.steer.reset(), self.steer.step(ZEROS)
        self.walker = Demonstrator("bastion")

    def state(self):
        """Everything that a call could have changed."""
        envs = self.envs
        streams = [stream.get_state() for stream in envs._randoms]
        episodes = envs._memory, envs._streams, envs._steps, envs._ended, envs._resting, envs._streams_begin
        return (
            pickle.dumps((self.dm, self.env, self.steer, episodes, streams, self.walker._state)),
            envs.batch._simulations.state.tobytes(),
            pickle.dumps(np.random.get_state()),
            (dict(ROBOTS), dict(TASKS), set(gymnasium.registry), dict(os.environ), os.getcwd()),
            sorted(pathlib.Path().rglob("*")),
        )


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    folder, before = tmp_path_factory.mktemp("files"), os.getcwd()
    os.chdir(folder)
    pathlib.Path("folder.json").mkdir()
    pathlib.Path("folder").mkdir()
    pathlib.Path("text.json").write_text("walk")
    pathlib.Path("blank.json").write_text("\n")
    np.savez("arrays.npz", zeros=np.zeros(3))
    pathlib.Path("arrays.npz").rename("arrays.json")
    pathlib.Path("list.json").write_text("[1]")
    pathlib.Path("empty.json").write_text("{}")
    yield World()
    os.chdir(before)


def load(*arguments):
    return lambda world: arc_suite.load(*arguments)


def walk(**task_kwargs):
    return load("queen", "walk", task_kwargs)


def policy(*arguments, **settings):
    return lambda world: policies.policy(*arguments, **settings)


def render(*arguments):
    return lambda world: world.dm.physics.render(*arguments)


def make(**kwargs):
    return lambda world: gymnasium.make(ID, **kwargs)


def envs(**kwargs):
    return lambda world: gymnasium.make_vec(ID, **{"num_envs": 2} | kwargs)


def bodies(**kwargs):
    return lambda world: gymnasium.make_vec("arc_suite/bodies-walk-v0", **kwargs)


def opened(**kwargs):
    return lambda world: arc_suite.load("queen", "walk", **kwargs)


SIZE = {"width": 64, "height": 480, "camera_id": "eye"}
WITH_MODE = "goes with a render_mode, such as 'rgb_array'"
SETTING = "argument '{}': it is a setting of the task; write"
FACES = (make, envs, bodies, opened)
CASES = [
    # Actions.
    (lambda w: w.dm.step(NAN), "action[7]: expected a number from -1 to 1, got nan"),
    (lambda w: w.dm.step(np.full(12, np.inf)), "action[0]: expected a number from -1 to 1, got inf"),
    (lambda w: w.env.step(NAN - np.inf), "action[0]: expected a number from -1 to 1, got -inf"),
    (lambda w: w.envs.step([ZEROS, [*ZEROS[1:], 10**400], ZEROS]), "action: expected 3 x 12 numbers, got list"),
    (lambda w: w.envs.step([ZEROS, ZEROS + np.inf, ZEROS]), "action[1, 0]: expected a number from -1 to 1, got inf"),
    (lambda w: w.dm.step([]), "action: expected shape (12,), got (0,)"),
    (lambda w: w.dm.step({"hip": 0.0}), "action: expected 12 numbers, got dict"),
    (lambda w: w.dm.step([ZEROS, ZEROS[:3]]), "action: expected 12 numbers, got list"),
    (lambda w: w.env.step(np.zeros(0)), "action: expected shape (12,), got (0,)"),
    (lambda w: w.env.step(0.5), "action: expected shape (12,), got ()"),
    (lambda w: w.env.step(["a"] * 12), "action: expected 12 numbers, got list"),
    (lambda w: w.envs.step(ZEROS), "action: expected shape (3, 12), got (12,)"),
    (lambda w: w.envs.step(np.zeros((2, 12))), "action: expected shape (3, 12), got (2, 12)"),
    (lambda w: w.envs.step([ZEROS, ZEROS, NAN]), "action[2, 7]: expected a number from -1 to 1, got nan"),
    (lambda w: w.envs.step("walk"), "action: expected 3 x 12 numbers, got str"),
    (lambda w: w.envs.step(None), "action: expected 3 x 12 numbers, got NoneType"),
    (lambda w: w.dm.step([10**400] * 12), "action: expected 12 numbers, got list"),
    (lambda w: w.env.step(np.zeros(12, complex)), "action: expected 12 numbers, got ndarray of complex128"),
    (lambda w: w.envs.step(np.ma.zeros((3, 12))), "action: expected 3 x 12 numbers, got MaskedArray of float64"),
    (lambda w: w.envs.step([["0"] * 12] * 3), "action: expected 3 x 12 numbers, got list"),
    (lambda w: w.dm.physics.step(0), "nstep: expected an integer from 1, got 0"),
    # Commands.
    (lambda w: w.steer.command("command", [0.5]), f"{COMMAND} [0.5]"),
    (lambda w: w.steer.command("command", [0, 0, np.inf]), f"{COMMAND} [0, 0, inf]"),
    (lambda w: w.steer.command("command", [1e308, 0, 0]), f"{COMMAND} [1e+308, 0, 0]"),
    (lambda w: w.steer.command("command", ["1", "0", "0"]), f"{COMMAND} ['1', '0', '0']"),
    # Seeds.
    (lambda w: w.env.reset(seed=[1]), f"{SEED} [1]"),
    (lambda w: w.env.reset(seed=np.array([1, 2])), f"{SEED} array([1, 2])"),
    (lambda w: w.envs.reset(seed=-1), f"{SEED} -1"),
    (lambda w: w.envs.reset(seed=2**32 - 1), "seed: expected an integer from 0 to 4294967293, got 4294967295"),
    (lambda w: w.envs.reset(seed=1.5), f"{SEED} 1.5"),
    (lambda w: w.envs.reset(seed=[1, 2]), "seed: expected one for each of 3 environments, got 2"),
    (lambda w: w.envs.reset(seed=[1, 2, "x"]), f"{SEED} 'x'"),
    (lambda w: w.envs.reset(options={"reset_mask": np.zeros(3, bool)}), f"{MASK} array([False, False, False])"),
    (lambda w: w.envs.reset(seed=3, options={"reset_mask": np.array([1, 0, 1])}), f"{MASK} array([1, 0, 1])"),
    (envs(task_kwargs={"random": [1, 2, 3]}), "seed: expected one for each of 2 environments, got 3"),
    (lambda w: policies.alone(policies.policy("random", "queen"), seed=-1), f"{SEED} -1"),
    # Ids.
    (load("Queen", "walk"), f"unknown robot 'Queen'; did you mean 'queen'? {DOMAINS}"),
    (load(7, "walk"), f"unknown robot 7 {DOMAINS}"),
    (load(["queen"], "walk"), f"unknown robot ['queen']; did you mean 'queen'? {DOMAINS}"),
    (load("queen", None), f"unknown task None {TASK_NAMES}"),
    (
        load("creature:hopper", "walk"),
        "robot 'hopper': cannot import creature: No module named 'creature'; "
        "start in the folder of creature.py, or put it on Python's path",
    ),
    (load("queen", "email:crouch"), "task 'crouch': email registers no such task by arc_suite.register"),
    (load("..:queen", "walk"), f"robot '..:queen': {MODULE}"),
    (load(":queen", "walk"), f"robot ':queen': {MODULE}"),
    (load("queen", "lab/carry.py:carry"), "task 'lab/carry.py:carry': expected carry:carry, with lab in PYTHONPATH"),
    (load("queen", "carry.py"), "task 'carry.py': expected carry:name"),
    (load("mantis.py:mantis", "walk"), "robot 'mantis.py:mantis': expected mantis:mantis"),
    (load("os:queen", "walk"), f"robot 'os:queen': queen {OWN}"),
    (load("queen", "json:walk"), f"task 'json:walk': walk {OWN}"),
    (make(domain_name="bastoin"), f"unknown robot 'bastoin'; did you mean 'bastion'? {DOMAINS}"),
    (envs(task_name="wlak"), f"unknown task 'wlak'; did you mean 'walk'? {TASK_NAMES}"),
    # Names in the place of others.
    (load("walk", "queen"), "robot 'walk': it is a task; robots are queen, bastion, tick, leaper"),
    (load("queen", "tick"), f"task 'tick': it is a robot; tasks are {', '.join(TASKS)}"),
    (policy("tick", "queen"), "policy 'tick': it is a robot; expected as robot, next to a policy such as cpg"),
    (policy("refined", "queen"), "policy 'refined': it is a preset; expected as preset, next to a policy such as cpg"),
    (lambda w: evaluation.evaluate("queen"), "policy 'queen': it is a robot; expected as robot, next to a policy such"),
    (walk(motion="a.npz"), "setting 'motion': walk has none; mimic has it"),
    (
        walk(terrain_seed=1),
        "setting 'terrain_seed': walk has none; rough, slopes, stairs, gaps, course, leap, roam",
    ),
    (load("queen", "recover", {"both_sides": 1}), "setting 'both_sides': recover has none; mimic has it"),
    (walk(gaits="trot"), "unknown setting of walk 'gaits'; did you mean 'gait'?"),
    # Cameras and sizes.
    (render(24, 32, -2), f"no camera -2: expected -1 (free) to 3, or one of {CAMERAS}"),
    (render(24, 32, 1.5), f"no camera 1.5: expected -1 (free) to 3, or one of {CAMERAS}"),
    (render(24, 32, np.zeros(2)), f"no camera array([0., 0.]): expected -1 (free) to 3, or one of {CAMERAS}"),
    (make(**PICTURE, camera_id=PLACED_CAMERA), PLACED),
    (envs(**PICTURE, camera_id=PLACED_CAMERA), PLACED),
    (make(**PICTURE, camera_id="prtrait"), f"unknown camera 'prtrait'; did you mean 'portrait'? {NAMED}"),
    (lambda w: gymnasium.make("arc_suite/bodies-walk-v0"), ONE_BODY),
    (envs(task_kwargs=[{}, {}]), ONE_MAPPING),
    (bodies(task_kwargs=[{}, {}]), ONE_MAPPING),
    (envs(**PICTURE, camera_id=9), f"no camera 9: expected -1 (free) to 3, or one of {CAMERAS}"),
    (render(0, 32), "height: expected an integer from 1 to 2160, got 0"),
    (render(24, 99999), "width: expected an integer from 1 to 3840, got 99999"),
    (render(24, "32"), "width: expected an integer from 1 to 3840, got '32'"),
    (make(render_mode="rgb_array", width=-1), "width: expected an integer from 1 to 3840, got -1"),
    (envs(render_mode="depth_array", height=2.5), "height: expected an integer from 1 to 2160, got 2.5"),
    (lambda w: w.envs.render([5]), "indices: expected integers from 0 to 2, got 5"),
    (lambda w: w.envs.render(["a"]), "indices: expected integers from 0 to 2, got 'a'"),
    # Presets and policies.
    (lambda w: Demonstrator("queen", "meduim"), f"unknown preset 'meduim'; did you mean 'medium'? {PRESETS}"),
    (lambda w: Demonstrator("bastoin"), f"unknown robot 'bastoin'; did you mean 'bastion'? {DOMAINS}"),
    (lambda w: w.walker(dm_env.restart(np.zeros(151))), f"{BLOCKS}, got ndarray"),
    (lambda w: w.walker(None), "timestep: expected what reset and step of a dm_env return, got NoneType"),
    (lambda w: w.walker({}), "timestep: expected what reset and step of a dm_env return, got dict"),
    (lambda w: w.walker.act({"posture": np.zeros(17)}), f"{BLOCKS}, got dict"),
    (lambda w: w.walker.act(EIGHTEEN), "observation: expected those of 12 joints, got 12 angles and 18 velocities"),
    (lambda w: w.envs.task.split(np.zeros((2, 199))), "observation: expected 151 numbers, got shape (2, 199)"),
    (policy(None, "queen"), f"unknown policy None {POLICIES}"),
    (policy("cpg", "quene"), f"unknown robot 'quene'; did you mean 'queen'? {DOMAINS}"),
    (
        policy("nowhere:policy", "queen"),
        "policy 'nowhere:policy': No module named 'nowhere'; "
        "start in the folder of nowhere.py, or put it on Python's path",
    ),
    # Paths.
    (load("missing.json", "walk"), "cannot read missing.json: no such file or directory"),
    (load("folder.json", "walk"), "cannot read folder.json: is a directory"),
    (load(pathlib.Path("nothing"), "walk"), "cannot read nothing: no such file or directory"),
    (load("tick.json", "walk"), "cannot read tick.json: no such file or directory; did you mean tick?"),
    (load("texts.json", "walk"), "cannot read texts.json: no such file or directory; did you mean text.json?"),
    (load("folder", "walk"), "robot 'folder': it is a folder; expected a name, or a file .json, .xml, .urdf"),
    (load("blank.json", "walk"), "blank.json: expected a body in JSON, got an empty file"),
    (load("arrays.json", "walk"), "arrays.json: expected a body in JSON, got a file that is no text"),
    (
        load("text.json", "walk"),
        "text.json: expected a body in JSON; line 1, column 1: it is no JSON, which begins with a bracket",
    ),
    (load("list.json", "walk"), "list.json: expected an object with the fields of a Body, got a list"),
    (load("empty.json", "walk"), "empty.json: name: missing; a Body needs it"),
    # Keyword arguments.
    (walk(time_limit=0), f"time_limit: {POSITIVE}, got 0"),
    (walk(time_limit=1e308), f"time_limit: {POSITIVE}, got 1e+308"),
    (walk(target_velocity=10**400), f"target_velocity: expected a number from -1000 to 1000, got 1{299 * '0'}"),
    (policy("zero", "queen", noise=10**400), f"noise: expected a finite number of at least 0, got 1{299 * '0'}"),
    (walk(time_limit=float("nan")), f"time_limit: {POSITIVE}, got nan"),
    (walk(target_velocity=True), "target_velocity: expected a number from -1000 to 1000, got True"),
    (walk(healthy_range=(1, 2, 3)), "healthy_range: expected one finite number or 2 of them, got (1, 2, 3)"),
    (walk(joint_noise=float("inf")), "joint_noise: expected a number from 0 to 6.28319, got inf"),
    (walk(weights={"forward": None}), "weights['forward']: expected a number from -1e+06 to 1e+06, got None"),
    (walk(on_divergence="ignore"), "unknown on_divergence 'ignore' (there are: raise, truncate)"),
    (walk(gait=7), f"unknown gait 7 {GAITS}"),
    (load("queen", "walk", [1]), "task_kwargs: expected a mapping of names to values, got [1]"),
    (load("queen", "walk", None, "flat"), "environment_kwargs: expected a mapping of names to values, got 'flat'"),
    (
        load("queen", "walk", None, {"control_timestep": 0.02}),
        "environment setting 'control_timestep': reward and observation are made for the body's own control steps",
    ),
    (
        load("queen", "walk", None, {"time_limit": 5}),
        "environment setting 'time_limit': it is a setting of the task: task_kwargs={'time_limit': seconds}",
    ),
    (walk(arena="bumpy"), f"unknown arena 'bumpy'; did you mean 'bumps'? {ARENA_NAMES}"),
    (envs(num_envs=2.5), "num_envs: expected an integer from 1 to 1048576, got 2.5"),
    (envs(num_envs="4"), "num_envs: expected an integer from 1 to 1048576, got '4'"),
    (envs(num_envs=10**12), "num_envs: expected an integer from 1 to 1048576, got 1000000000000"),
    (envs(num_threads="all"), "num_threads: expected an integer from 1 to 1024, got 'all'"),
    (envs(num_threads=10**30), f"num_threads: expected an integer from 1 to 1024, got {10**30}"),
    (envs(task_kwargs=[1]), "task_kwargs: expected a mapping of names to values, got [1]"),
    (lambda w: w.envs.reset(options=[1]), "options: expected a mapping of names to values, got [1]"),
    (envs(max_episode_steps=0), "max_episode_steps: expected an integer from 1, got 0"),
    (envs(autoreset_mode="SomeStep"), f"unknown autoreset_mode 'SomeStep'; did you mean 'SameStep'? {MODES}"),
    (envs(task_kwargs={"on_divergence": "raise"}), f"unknown on_divergence of many environments 'raise' {TRUNCATE}"),
    *(
        (call(**{name: value}), f"{name}={value!r}: {WITH_MODE}")
        for call in (make, envs)
        for name, value in SIZE.items()
    ),
    (make(visualize_reward=True), f"visualize_reward=True: {WITH_MODE}"),
    (make(visualize_reward="no"), "visualize_reward: expected true or false, got 'no'"),
    (load("queen", "walk", None, None, "no"), "visualize_reward: expected true or false, got 'no'"),
    (load("queen", "walk", None, {"flat_observation": "no"}), "flat_observation: expected true or false, got 'no'"),
    (bodies(flat="no"), "flat: expected true or false, got 'no'"),
    (bodies(privileged=1), "privileged: expected true or false, got 1"),
    # Settings and other arguments in the place of arguments.
    *((call(kicks=2.0), f"{SETTING.format('kicks')} task_kwargs={{'kicks': 2.0}}") for call in FACES),
    *((call(difficulty=1), f"{SETTING.format('difficulty')} task_kwargs={{'difficulty': 1}}") for call in FACES),
    *((call(random=1), f"{SETTING.format('random')} task_kwargs={{'random': 1}}") for call in FACES),
    *((call(seed=1), "argument 'seed': reset(seed=...) begins a stream") for call in FACES),
    (make(num_envs=2), "argument 'num_envs': gymnasium.make_vec makes several environments"),
    (
        envs(bodies="random:0"),
        "argument 'bodies': gymnasium.make_vec of arc_suite/bodies-<task>-v0 makes environments of different bodies",
    ),
    (envs(flat_observation=True), "argument 'flat_observation': arc_suite.load has it in environment_kwargs; obs"),
    (opened(max_episode_steps=9), "argument 'max_episode_steps': task_kwargs={'time_limit': seconds} limits episodes"),
    (opened(render_mode="human"), "argument 'render_mode': physics.render of a dm_env draws a picture"),
    (
        opened(kick=1),
        "unknown argument 'kick'; did you mean 'kicks'? (there are: domain_name, task_name, task_kwargs, ",
    ),
    (opened(gravity=1), "argument 'gravity': environment.change_model({'gravity': [0.0, 0.0, -1.62]}) sets it"),
    (walk(gravity=1), "setting 'gravity': environment.change_model({'gravity': [0.0, 0.0, -1.62]}) sets it"),
    (make(terrain="rough"), "unknown argument 'terrain'; did you mean task_kwargs={'arena': 'rough'}?"),
    (opened(speed=2), "unknown argument 'speed'; did you mean task_kwargs={'target_velocity': 2}?"),
    (envs(duration=5), "unknown argument 'duration'; did you mean task_kwargs={'time_limit': 5}?"),
    (opened(wind=3), "unknown argument 'wind'; did you mean task_kwargs={'force': 3}?"),
    (walk(noise=3), "unknown setting of walk 'noise'; did you mean 'observation_noise'? (there are: "),
    (make(wdith=1), "unknown argument 'wdith'; did you mean 'width'? (there are: domain_name, task_name, task_kwargs"),
    (make(render_mode="ansi"), "unknown render_mode 'ansi' (there are: rgb_array, depth_array)"),
]


@pytest.mark.filterwarnings("ignore::UserWarning")  # Gymnasium has its own opinion of some
@pytest.mark.parametrize(("use", "message"), CASES, ids=[f"{i} {message[:40]}" for i, (_, message) in enumerate(CASES)])
def test_bad_input(world, use, message, monkeypatch):
    monkeypatch.setattr("arc_suite.simulation.opengl.has_display", lambda: False)
    before = world.state()
    starts_only = ("unknown argument", "argument 'flat", "unknown setting", "setting", "policy 'queen'")
    lists_arguments = message.startswith(starts_only)  # in an order that does not matter
    with refused(message, (ValueError, OSError), begins=lists_arguments):
        use(world)
    assert world.state() == before


def test_the_world_goes_on_as_one_that_met_nothing_bad(world):
    fresh = World()
    for _ in range(3):
        assert world.dm.step(ZEROS).reward == fresh.dm.step(ZEROS).reward
        np.testing.assert_array_equal(world.env.step(ZEROS)[0], fresh.env.step(ZEROS)[0])
        np.testing.assert_array_equal(world.envs.step(np.zeros((3, 12)))[0], fresh.envs.step(np.zeros((3, 12)))[0])
