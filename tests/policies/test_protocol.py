"""The protocol of acting: every policy, in environments that begin at different times, acts as in the episode alone."""

import dm_env
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite import evaluation
from arc_suite.bodies import generator
from arc_suite.policies import POLICIES, Individuals, Mixture, Script, Sum, alone, policy
from arc_suite.robots import ROBOTS

# (environment, control step at which it begins, seed) of episodes; its last step is that before the next begins.
EPISODES = ((0, 0, 4), (1, 0, 5), (2, 0, 6), (1, 7, 7), (0, 20, 8), (2, 20, 4), (1, 31, 9), (1, 32, 0))
NUM_ENVS, STEPS = 3, 300

OWN = """
import numpy as np
def make(robot):
    past = []
    def act(timestep):
        past.append(timestep.reward or 0.0)
        assert timestep.first() == (len(past) == 1) == (timestep.reward is None)
        return np.sin(sum(past) + timestep.observation["posture"][5:] * len(past))
    return act
"""


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    (tmp_path / "own_protocol.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)


def felt(joints, seed, step):
    """Blocks and the reward of a step of an episode, which depend on its seed alone."""
    random = np.random.default_rng((seed, step))
    blocks = {"posture": random.normal(0.0, 0.3, 5 + joints), "velocities": random.normal(0.0, 0.3, 6 + joints)}
    reward = random.normal()
    return blocks | {"gait_clock": np.array((np.sin(0.1 * step), np.cos(0.1 * step)))}, reward


def acted_alone(made, joints, seed, length):
    act, actions = alone(made, seed), []
    for step in range(length):
        blocks, reward = felt(joints, seed, step)
        actions.append(act(dm_env.transition(reward, blocks) if step else dm_env.restart(blocks)))
    return np.array(actions)


def acted_together(made, joints):
    """The actions of every episode, by its number."""
    playing, actions = [None] * NUM_ENVS, [[] for _ in EPISODES]
    for step in range(STEPS):
        beginning = [number for number, (_, first, _) in enumerate(EPISODES) if first == step]
        for number in beginning:
            playing[EPISODES[number][0]] = number
        if beginning:
            made.reset([EPISODES[number][0] for number in beginning], [EPISODES[number][2] for number in beginning])
        told = [felt(joints, EPISODES[number][2], step - EPISODES[number][1]) for number in playing]
        blocks, rewards = zip(*told, strict=True)
        stacked = {name: np.stack([block[name] for block in blocks]) for name in blocks[0]}
        for number, action in zip(playing, made.act(stacked, np.array(rewards)), strict=True):
            actions[number].append(action)
    return [np.array(action) for action in actions]


MADE_UP = [name for name in POLICIES if name not in ("ppo", "universal")]  # they need the whole observation of a task
VARIANTS = [
    *((name, {}) for name in MADE_UP),
    *((name, {"noise": 0.1}) for name in MADE_UP),
    ("cpg", {"presets": ("slow", "medium", "fast")}),
    ("cpg", {"presets": ("medium", "fast"), "noise": 0.1}),
    ("own_protocol:make", {}),
    ("own_protocol:make", {"noise": 0.1}),
]


@pytest.mark.filterwarnings("ignore:.*another robot")  # what is felt here is drawn at random
@pytest.mark.parametrize(
    "body",
    tiers([ROBOTS["leaper"], generator.generate(5, 2)], lambda body: body.name != "leaper"),
    ids=["leaper", "made"],
)
@pytest.mark.parametrize(("name", "settings"), tiers(VARIANTS, lambda name, settings: "noise" in settings))
def test_an_environment_acts_as_its_episode_alone(name, settings, body):
    joints = len(body.joint_names)
    together = acted_together(policy(name, body, num_envs=NUM_ENVS, **settings), joints)
    for (_, _, seed), actions in zip(EPISODES, together, strict=True):
        made = policy(name, body, **settings)
        acted_alone(made, joints, seed + 1, 3)  # an episode before leaves nothing behind
        assert_array_equal(actions, acted_alone(made, joints, seed, len(actions)))
    same = {seed: actions for (_, _, seed), actions in zip(EPISODES, together, strict=True)}
    assert len(together[0]) == 20 < len(same[4]) == STEPS - 20
    assert_array_equal(together[0], same[4][:20])


def test_policies_of_one_environment_play_episodes_and_act_on_time_steps():
    environment = arc_suite.load("tick", "walk", {"time_limit": 1.0})
    for name in POLICIES:
        steps = list(evaluation.rollout(environment, policy(name, "tick"), seed=3))
        act, time_step = alone(policy(name, "tick"), seed=3), environment.reset(3)
        for expected in steps[1:]:
            time_step = environment.step(act(time_step))
            assert time_step.reward == expected.reward


def test_scripts_end_in_zeros():
    made = Script(lambda seed: seed * np.ones((2, 4)), 2, 4)
    assert not made.act(None, None).any()
    made.reset([1], [3])
    assert [made.act(None, None).tolist() for _ in range(3)] == [[[0.0] * 4, [value] * 4] for value in (3.0, 3.0, 0.0)]


def test_sums_and_mixtures():
    ones, twos = (Script(lambda seed, value=value: np.full((9, 1), value), 3, 1) for value in (1.0, 2.0))
    both = Sum(ones, twos)
    both.reset(range(3), range(3))
    assert_array_equal(both.act(None, None), [[3.0]] * 3)
    mixture = Mixture([ones, twos], 3)
    mixture.reset(range(3), [4, 7, 6])
    assert_array_equal(mixture.act(None, None), [[1.0], [2.0], [1.0]])


def test_actions_that_are_none_are_one_line_that_tells_where():
    blocks = {"posture": np.zeros((2, 3))}
    for action, problem in (
        (np.zeros(3), "action: expected shape (2,), got (3,)"),
        ("left", "action: expected 2 numbers, got str"),
        ([0.0, np.nan], "action[1]: expected a number from -1 to 1, got nan"),
    ):
        made = Individuals(lambda action=action: lambda time_step: action, 2, 2, "policy 'mine'")
        made.reset([1], [7])
        with refused(f"policy 'mine': episode of seed 7, step 0: {problem}"):
            made.act(blocks, np.zeros(2))
