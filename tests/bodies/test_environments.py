"""Environments of different bodies: each is that of its body alone, to the last bit."""

import copy
import functools
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import arc_suite
from arc_suite import evaluation, policies, registry
from arc_suite.bodies import BodiesEnv, generator, tokens
from arc_suite.bodies.families import sound_body, varied_body
from arc_suite.envs import stacked
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks import command, sensors
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.readings import TorsoPlace
from arc_suite.tasks.walk import Walk

LAYOUTS = [
    generator.random_body(seed, legs, links)
    for seed, (legs, links) in enumerate((legs, links) for legs in range(4, 13) for links in (2, 3, 4))
]
TWINS = [
    generator.random_body(100 + seed, len(body.legs), len(body.legs[0].links)) for seed, body in enumerate(LAYOUTS)
]
FEW = [generator.random_body(seed, 6, 3) for seed in range(3)] + [ROBOTS["tick"], varied_body(3)]
SHORT = {"time_limit": 1.0}
MODIFIED = {
    "kicks": 1.0, "motor_strength": (0.6, 1.0), "actuator_failure": True, "friction": (0.4, 1.1), "mass": (0.8, 1.3),
    "payload": (0.1, 0.4), "center_of_mass": 0.1, "joint_offset": 0.05, "joint_strength": (0.5, 1.0),
    "gains": (0.8, 1.2), "armature": (0.8, 1.5), "force": 0.3,
    "observation_noise": 1.0, "delay": (0, 3),
}  # fmt: skip
MODES = ("NextStep", "SameStep", "Disabled")


def make(bodies, task="walk", num_envs=None, **kwargs):
    count = len(bodies) if num_envs is None else num_envs
    if "," in task:
        return BodiesEnv(task, count, bodies, **kwargs)
    return gymnasium.make_vec(f"arc_suite/bodies-{task}-v0", num_envs=count, bodies=bodies, **kwargs)


def alone(env, mode="NextStep", task_kwargs=()):
    """An environment of each body in its task."""
    settings = {"actions": "position", **dict(task_kwargs)}
    pairs = zip(env.bodies, env.tasks, strict=True)
    return [VectorEnv(body, task.name, 1, 1, mode, task_kwargs=settings) for body, task in pairs]


same = functools.partial(data_equivalence, exact=True)


def actions_of(env, count, seed=0):
    return np.random.RandomState(seed).uniform(-1.0, 1.0, (count, *env.action_space.shape)).astype(np.float32)


def assert_each_alone(env, singles, actions):
    """Steps both, and compares everything; returns how many episodes ended by termination and by truncation."""
    ends, of_each = np.zeros(2, int), [tokens.Tokens.of([task]) for task in env.tasks]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        own = env.own_observations()
        for index, single in enumerate(singles):
            joints = action[index][env.description.mask[index]]
            expected = single.step(joints[None])
            result = own[index][None], reward[[index]], terminated[[index]], truncated[[index]]
            assert same(result, expected[:4]), index
            assert env.resampled()[index] == single.resampled()[0]
            assert_infos_equal(info, expected[4], index, env)
            observed = of_each[index].make_tokens(of_each[index].gather_inputs(expected[0]))
            assert same({name: array[[index]] for name, array in observation.items()}, observed), index
            ends += expected[2][0], expected[3][0]
    return ends


def assert_infos_equal(info, expected, index, env):
    assert {name for name in expected if name.startswith("_")} <= info.keys()
    for name, value in expected.items():
        if name == "final_info":
            assert_infos_equal(info[name], value, index, env)
        elif name == "final_obs":
            of_one = tokens.Tokens.of([env.tasks[index]])
            observed = of_one.make_tokens(of_one.gather_inputs(value[0][None]))
            assert same(info[name][index], {part: array[0] for part, array in observed.items()})
        else:
            assert same(np.asarray(info[name][index]), np.asarray(value[0])), name


def assert_environments(bodies, task, mode, threads, settings=SHORT, steps=40):
    env = make(bodies, task, autoreset_mode=mode, num_threads=threads, task_kwargs=settings)
    singles = alone(env, mode, settings)
    env.reset(seed=3)
    for index, (single, own) in enumerate(zip(singles, env.own_observations(), strict=True)):
        assert same(own[None], single.reset(seed=3 + index)[0])
    return assert_each_alone(env, singles, actions_of(env, steps))


@pytest.mark.parametrize(("task", "mode"), [("walk", "NextStep"), ("steer", "SameStep")])
def test_each_is_that_of_its_body_alone(task, mode):
    assert assert_environments(FEW, task, mode, threads=2).sum() > 0


@pytest.mark.slow
def test_each_is_that_of_its_task_alone():
    """Rewards, limits, metrics and observations of a task."""
    assert assert_environments(FEW[:3], "walk,steer,rough", "SameStep", 1, {"time_limit": 0.3}, steps=20).sum() > 0


def test_bodies_and_tasks_take_turns_until_all_pairs_have_been():
    env = BodiesEnv("walk,steer", 4, FEW[:2], flat=True, autoreset_mode="Disabled", task_kwargs={"time_limit": 0.1})
    pairs = [(body.name, task.name) for body, task in zip(env.bodies, env.tasks, strict=True)]
    first, second = (body.name for body in FEW[:2])
    assert pairs == [(first, "walk"), (second, "steer"), (first, "steer"), (second, "walk")]
    assert env.task.name == "walk,steer" and len(env._places) == 2
    env.reset(seed=0)
    *_, info = env.step(np.zeros(env.action_space.shape))
    assert info["_progress_tracking"].tolist() == [False, True, True, False]
    assert info["progress_tracking"][[0, 3]].tolist() == [0.0, 0.0]
    totals = evaluation.episodes_in_batch(env, policies.Script(lambda seed: (), *env.action_space.shape))
    assert [np.isnan(episode.progress["tracking"]) for episode in totals] == [True, False, False, True]
    with refused("command 'command': task walk has no commands"):
        env.command("command", (1.0, 0.0, 0.0))
    env.command("command", (1.0, 0.0, 0.0), np.array([False, True, True, False]))
    with refused("num_envs: expected at least one for each of 3 tasks, got 2"):
        BodiesEnv("walk,steer,shoved", 2, FEW[:2])


def test_several_tasks_as_a_setup():
    setup = Setup.of("random:0-1", "walk,steer")
    assert (setup.tasks, setup.task_label, setup.kind.name) == (("walk", "steer"), "walk+steer", "walk")
    assert [member.task for member in setup.members()] == ["walk", "steer", "steer", "walk"]
    assert Setup.from_dict(setup.to_dict()) == setup and str(setup) == "random:0-1, walk+steer"
    with refused("task 'walk,steer': expected one with one body, got several"):
        Setup.of("tick", "walk,steer")
    with refused("unknown task 'ster'; did you mean 'steer'?", begins=True):
        Setup.of("random:0-1", "walk,ster")


@pytest.mark.slow
@pytest.mark.parametrize("task", ["walk", "steer"])
def test_modifiers_change_the_model_of_each(task):
    assert_environments([*FEW, FEW[0]], task, "NextStep", 2, SHORT | MODIFIED)


@pytest.mark.slow
def test_tasks_with_a_ground_have_a_batch_for_each_body():
    assert assert_environments(FEW[:2], "rough", "SameStep", 1, {"time_limit": 0.3}, steps=20).sum() > 0


@pytest.mark.release
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("task", ["walk", "steer", "shoved", "limp", "walk with modifiers"])
def test_each_of_all_layouts(task, mode):
    settings, threads = SHORT | (MODIFIED if "modifiers" in task else {}), 1 + MODES.index(mode)
    ends = assert_environments([*LAYOUTS, *TWINS], task.split()[0], mode, threads, settings, steps=25)
    assert ends.sum() > 0


@pytest.mark.release
@pytest.mark.parametrize("task", ["slopes", "stairs", "gaps", "course", "roam", "navigate"])
def test_each_on_other_grounds(task):
    assert_environments(FEW, task, "NextStep", 1, steps=25)


def test_other_commands_of_each(monkeypatch):
    monkeypatch.setattr(command, "SHORTEST", 3)
    monkeypatch.setattr(command, "LONGEST", 6)
    assert_environments(FEW, "steer", "NextStep", 1, steps=12)


def test_bodies_of_one_layout_share_a_batch():
    env = make([*LAYOUTS, *TWINS])
    assert len(env._places) == 27
    assert {len(place.indices) for place in env._places} == {2}
    again = make(FEW[:2], num_envs=5)
    assert [body.name for body in again.bodies] == [FEW[index % 2].name for index in range(5)]
    assert [place.indices.tolist() for place in again._places] == [[0, 1, 2, 3, 4]]
    assert make("random:3-4", num_envs=2).bodies == (sound_body(3), sound_body(4))
    assert len(make(["varied:0-1", "queen", FEW[0]], num_envs=4).bodies) == 4


def test_a_task_that_inherits_shares_a_batch_only_if_it_declares_what_follows_from_the_body():
    class Saunter(Walk):
        name = "saunter"

    class Stroll(Walk):
        name, from_body = "stroll", Walk.from_body

    task, _ = prepare_task(FEW[0], "walk")
    kinds = [stacked.kind(each(task.scene, task.settings)) for each in (Walk, Saunter, Stroll)]
    assert [found is None for found in kinds] == [False, True, False]


def test_torsos_at_other_places_share_no_batch():
    """All digits of a layout count, as all environments of a batch have that of the first one."""
    task, _ = prepare_task(FEW[0], "walk")
    kinds = []
    for shift in (0.0, 0.0, 1e-10):
        place = TorsoPlace(root=1, in_root=np.array((0.1 + shift, 0.0, 0.3)), in_torso=np.zeros(3))
        scene = task.scene._replace(layout=task.scene.layout._replace(torso_place=place))
        kinds.append(stacked.kind(Walk(scene, task.settings)))
    assert kinds[0] == kinds[1] != kinds[2]


def test_spaces_and_seeds():
    env = make(FEW)
    assert isinstance(env, BodiesEnv) and env.spec.id == "arc_suite/bodies-walk-v0"
    assert env.autoreset_mode is AutoresetMode.NEXT_STEP
    first, info = env.reset(seed=5)
    assert first in env.observation_space and info == {}
    assert env.np_random_seed == (5, 6, 7, 8, 9)
    assert same(make(FEW, task_kwargs={"random": 5}).reset()[0], first)
    assert same(env.reset(seed=[5, 6, 7, 8, 9])[0], first)
    assert not same(env.reset()[0], first)
    result = env.step(env.action_space.sample())
    assert result[0] in env.observation_space
    assert [array.dtype for array in result[1:4]] == [np.float64, bool, bool]
    assert result[4]["reward_forward"].shape == (5,) and result[4]["_reward_forward"].all()
    missing = ~env.description.mask
    assert missing.any() and not result[0]["legs"][..., :4][missing].any()
    assert env.call("np_random_seed") == env.np_random_seed


def test_some_are_reset_and_some_rest():
    env, twin = make(FEW, task_kwargs=SHORT), make(FEW, task_kwargs=SHORT)
    mask = np.array([False, True, False, True, False])
    with pytest.raises(ResetNeeded, match="^cannot reset some environments: reset all of them first$"):
        env.reset(options={"reset_mask": mask})
    before, _ = env.reset(seed=0)
    twin.reset(seed=0)
    after, _ = env.reset(seed=7, options={"reset_mask": mask})
    assert env.np_random_seed == (0, 8, 2, 10, 4)
    for name in before:
        assert_array_equal(after[name][~mask], before[name][~mask])
        assert not np.array_equal(after[name][mask], before[name][mask])
    env.rest(mask)
    for action in actions_of(env, 10):
        observation, reward, *_ = env.step(action)
        expected = twin.step(action)
        assert_array_equal(reward[~mask], expected[1][~mask])
        assert not reward[mask].any()
    for name in after:
        assert_array_equal(observation[name][~mask], expected[0][name][~mask])


def test_commands_reach_the_environments_of_a_mask():
    env = make(FEW, "steer")
    env.reset(seed=0)
    mask = np.array([True, False, False, True, True])
    env.command("command", [0.5, 0.0, -0.2], mask)
    observation = env.step(np.zeros(env.action_space.shape))[0]
    assert_allclose(observation["command"][mask, :3], np.tile((0.5, 0.0, -0.2), (3, 1)), rtol=1e-6)
    assert not np.allclose(observation["command"][~mask, :3], (0.5, 0.0, -0.2))
    with pytest.raises(ValueError, match="^unknown command 'comand'; did you mean 'command'"):
        env.command("comand", None)


@pytest.mark.parametrize(("bodies", "gait"), [(("varied:1", "varied:2"), "walk"), (("queen", "leaper"), "wave")])
def test_a_gait_by_name_is_that_of_each_body(bodies, gait):
    env = BodiesEnv("directed", 3, [*bodies])
    env.reset(seed=0)
    env.command("gait", gait, [True, True, False])
    observation = env.step(np.zeros(env.action_space.shape))[0]
    for index, body in enumerate((*bodies, bodies[0])):
        single = VectorEnv(body, "directed", 1, task_kwargs={"actions": "position"})
        single.reset(seed=index)
        if index < 2:
            single.command("gait", gait)
        expected = single.step(np.zeros(single.action_space.shape))[0][0]
        assert_array_equal(env.own_observations()[index], expected)
    assert all(np.isfinite(block).all() for block in observation.values())


@pytest.mark.parametrize("mode", ["NextStep", pytest.param("SameStep", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "duplicate",
    [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env)), "snapshot"],
    ids=["copy", "pickle", "arrays"],
)
def test_copies_and_snapshots_carry_on_bit_for_bit(duplicate, mode):
    settings = {**SHORT, "mass": (0.8, 1.2)}
    env = make(FEW, "steer", autoreset_mode=mode, task_kwargs=settings)
    env.reset(seed=1)
    steps = actions_of(env, 50)
    for action in steps[:15]:
        env.step(action)
    if duplicate == "snapshot":
        twin = make(FEW, "steer", autoreset_mode=mode, task_kwargs=settings)
        twin.restore(env.snapshot())
    else:
        twin = duplicate(env)
    for action in steps[15:]:
        assert same(twin.step(action), env.step(action))


def test_a_snapshot_of_other_bodies_is_refused_and_none_of_it_used():
    env, other = make(FEW), make([FEW[0], FEW[3]])
    env.reset(seed=1), other.reset(seed=1)
    arrays = other.snapshot() | {name: array for name, array in env.snapshot().items() if name.startswith("2/")}
    before = env.snapshot()
    with pytest.raises(ValueError, match="^snapshot: of another setup or number of environments: "):
        env.restore(arrays)
    assert same(env.snapshot(), before)


def test_tokens_have_no_dimension():
    """A body of another size, which moves alike, is described and observed alike."""
    body = generator.random_body(1, 6, 3)
    env = make([body, generator.scaled(body, 4.0), generator.scaled(body, 0.5)], "steer")
    for part in env.description:
        assert_allclose(part[1:].astype(float), part[:1].repeat(2, axis=0).astype(float), rtol=1e-4, atol=1e-5)
    env.reset(seed=[2, 2, 2])
    for action in actions_of(env, 1).repeat(10, axis=0):
        observation = env.step(action[:1].repeat(3, axis=0))[0]
    for name in ("torso", "command"):
        assert_allclose(observation[name][1:], observation[name][:1].repeat(2, axis=0), atol=1e-2)


def test_tokens_say_what_a_body_does():
    env = make([ROBOTS["queen"].replace(name="a_queen")], "walk")
    env.reset(seed=0)
    for action in actions_of(env, 3):
        observation = env.step(action)[0]
    blocks = env.tasks[0].split(env.own_observations()[0])
    assert_array_equal(observation["legs"][0, :6, :3].ravel(), blocks["posture"][5:])
    assert_allclose(observation["torso"][0, 0], blocks["posture"][0] / env.bodies[0].torso.standing_height, rtol=1e-6)
    assert_allclose(observation["command"][0, :2] @ observation["command"][0, :2], 1.0, rtol=1e-5)
    offsets = env.tasks[0].parameters.phase_offsets
    phase = np.arctan2(*blocks["gait_clock"]) + offsets
    assert_allclose(observation["legs"][0, :6, 8:10], np.stack([np.sin(phase), np.cos(phase)], axis=-1), atol=1e-6)
    phase, stance = phase % (2.0 * np.pi), 2.0 * np.pi * env.tasks[0].parameters.duty_factor
    clear = np.min([phase, 2.0 * np.pi - phase, abs(phase - stance)], axis=0) > 1e-3  # of the edges
    assert clear.any()
    assert_array_equal(observation["legs"][0, :6, 10][clear], (phase < stance)[clear])
    assert env.description.legs[0, :6, -1] == pytest.approx(env.tasks[0].parameters.duty_factor)
    assert not env.description.legs[0, 6:].any()


@pytest.mark.slow
def test_tokens_show_pose_and_gait_by_command():
    """Phases and stance of the present gait, the pose, duty factor and frequency; prescribed ones in other tasks."""
    env = BodiesEnv("directed,steer", 2, [FEW[3], FEW[4]])
    env.reset(seed=4)
    for _ in range(70):  # into the second command
        observation, *_ = env.step(np.zeros(env.action_space.shape))
    task, group = env.tasks[0], env._places[0].group
    blocks = task.split(env.own_observations()[0])
    phases, duty_factor = (array[0] for array in task.leg_phases(group._memory))
    count, legs, going = len(phases), observation["legs"][0], blocks["gait_clock"].any()
    assert_array_equal(legs[:count, 10], (phases < 2.0 * np.pi * duty_factor) | ~going)
    assert_allclose(legs[:count, 8:10], going * np.stack([np.sin(phases), np.cos(phases)], axis=-1), atol=1e-6)
    directed, steered = observation["command"]
    assert going and blocks["pose"].any()
    assert_array_equal(directed[6:12], blocks["pose"])
    assert directed[12] == pytest.approx(duty_factor, rel=1e-6)
    gait = env.tasks[1].parameters
    rate_unit = (9.81 / FEW[4].torso.standing_height) ** 0.5
    assert_allclose(steered[6:14], [*np.zeros(6), gait.duty_factor, gait.gait_frequency / rate_unit], rtol=1e-6)
    assert directed[14:].tolist() == [1.0, 1.0, 0.0] and steered[14:].tolist() == [1.0, 0.0, 0.0]


def test_each_leg_sees_the_ground_about_its_foot():
    env = BodiesEnv("roam,steer,walk", 3, ROBOTS["tick"], task_kwargs={"time_limit": 1.0})
    observation, _ = env.reset(seed=0)
    task, legs = env.tasks[0], observation["legs"][:, :6, 12:]
    scan = task.split(env.own_observations()[0])["scan"].reshape(25, 7)
    height = task.split(env.own_observations()[0])["posture"][0] / ROBOTS["tick"].torso.standing_height
    foot = np.array(ROBOTS["tick"].legs[0].foot_position[:2]) / reach(ROBOTS["tick"])
    row, column = abs(sensors.FORWARD - foot[0]).argmin(), abs(sensors.LEFT - foot[1]).argmin()
    assert legs[0, 0, 2] == pytest.approx(scan[row, column] + height - 1.0, abs=1e-6)
    assert abs(legs[0]).max() > 0.01 and not legs[1:].any() and not observation["legs"][:, 6:].any()
    level = BodiesEnv("steer", 1, ROBOTS["tick"], task_kwargs={"scan": True})
    observation, _ = level.reset(seed=0)
    assert_allclose(observation["legs"][0, :, 12:], 0.0, atol=1e-6)  # as where no scan shows it


def test_flat_vectors_for_plain_learners():
    env, flat = (make(FEW, autoreset_mode="SameStep", task_kwargs=SHORT, flat=flat) for flat in (False, True))
    assert flat.single_observation_space.shape == (759,) and flat.single_action_space.shape == (48,)
    assert_array_equal(flat.reset(seed=0)[0][:, :228], env.reset(seed=0)[0]["legs"].reshape(5, -1))
    ends = 0
    for action in actions_of(env, 25):
        vector, *result, info = flat.step(action.reshape(5, -1))
        observation, *expected, _ = env.step(action)
        assert same(result, expected) and vector in flat.observation_space
        assert_array_equal(vector[:, 228:240], observation["torso"])
        assert_array_equal(vector[:, 257:749], env.description.legs.reshape(5, -1))
        for last in info.get("final_obs", ()):
            ends += last is not None and last.shape == (759,)
    assert ends >= 3
    with pytest.raises(ValueError, match=r"^action: expected shape \(5, 48\), got \(5, 47\)$"):
        flat.step(np.zeros((5, 47)))


@pytest.mark.slow
def test_pictures_show_each_body():
    env = make(FEW[2:4], render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    one, two = env.render()
    assert one.shape == (48, 64, 3) and not np.array_equal(one, two)
    assert_array_equal(env.render([1])[0], two)
    assert make(FEW[:1]).render() is None


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"bodies": "varied:0-9", "num_envs": 4}, "num_envs: expected at least one for each of 10 bodies, got 4"),
        ({"bodies": [], "num_envs": 4}, "bodies: expected at least one, got []"),
        ({"bodies": "vared:0-9"}, "unknown family 'vared'; did you mean 'varied'? (there are: "),
        (
            {"bodies": ["queen", 3]},
            f"unknown robot 3 (there are: {', '.join(registry.robot_words())}, module:name to import it)",
        ),
        ({"task_kwargs": {"actions": "torque"}}, "unknown actions of different bodies 'torque' (there are: position)"),
        ({"task_kwargs": {"weigths": {}}}, "unknown setting of walk 'weigths'; did you mean 'weights'?"),
        ({"task_kwargs": {"history": 2}}, "history: expected 0 for different bodies, as tokens of "),
        ({"autoreset_mode": "never"}, "unknown autoreset_mode 'never'"),
        (
            {"task_kwargs": {"exclude_blocks": ["gait_clock"]}},
            "task walk: expected the blocks posture, velocities, contact_forces, gait_clock, got posture, velocities, ",
        ),
    ],
)
def test_bad_arguments_are_one_line(kwargs, message):
    arguments = {"bodies": FEW[:1], "num_envs": 10} | kwargs
    with refused(message, begins=True):
        make(**arguments)


def test_bodies_of_too_many_legs_or_joints_are_one_line():
    leg = ROBOTS["tick"].legs[0]
    legs = tuple(leg.replace(name=f"l{i}", yaw_deg=float(i)) for i in range(64))
    expected = "expected at most 12 legs of at most 4 joints, got"
    with pytest.raises(ValueError, match=f"^many: {expected} 64 legs of up to 3$"):
        make([ROBOTS["tick"].replace(name="many", legs=legs)])
    link = leg.links[0]
    links = (link.replace(name=f"upper{i}", joint=link.joint.replace(name=f"j{i}")) for i in range(5))
    long = leg.replace(links=tuple(links))
    with pytest.raises(ValueError, match=f"^long: {expected} 6 legs of up to 5$"):
        make([ROBOTS["tick"].replace(name="long", legs=(long, *ROBOTS["tick"].legs[1:]))])


def test_calls_at_the_wrong_time_and_wrong_actions():
    env = make(FEW[:2])
    with pytest.raises(ResetNeeded, match="^cannot step: no episode has begun; call reset first$"):
        env.step(np.zeros((2, 12, 4)))
    env.reset(seed=0)
    before = env.snapshot()
    wrong = np.zeros((2, 12, 4))
    wrong[1, 2, 3] = np.nan
    with refused("action: expected shape (2, 12, 4), got (2, 48)"):
        env.step(np.zeros((2, 48)))
    with refused("action[1, 2, 3]: expected a number from -1 to 1, got nan"):
        env.step(wrong)
    assert same(env.snapshot(), before)
    env.close()
    env.close()
    with pytest.raises(ClosedEnvironmentError, match="the environment is closed; make a new one$"):
        env.reset()


def test_the_name_of_the_ids_is_no_robots():
    with pytest.raises(ValueError, match="^robot 'bodies': ids of environments of different bodies have this name; "):
        arc_suite.register(body=ROBOTS["tick"].replace(name="bodies"))
