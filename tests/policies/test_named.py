"""Untrained policies by name."""

import hashlib
import sys

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite import policies, registry
from arc_suite.bodies.generator import generate
from arc_suite.evaluation import provenance
from arc_suite.policies import POLICIES, alone, policy
from arc_suite.robots import ROBOTS

ALL = (
    "slow, medium, fast, tuned, refined, straight, steered, surefooted, climbing, braced, reactive, sighted, leaping, "
    "planned, tracked, rising, crossing, in_step, posed, balanced, limping, hiking"
)
GENERAL = (
    "slow, medium, fast, straight, steered, surefooted, climbing, braced, reactive, sighted, leaping, planned, "
    "tracked, rising"
)

ROBOT_WORDS = ", ".join(registry.robot_words())
JOINTS = "expected a body named 'queen' to have the 18 joints of queen"


@pytest.mark.parametrize("name", POLICIES)
def test_policies_act_on_time_steps(name):
    environment = arc_suite.load("leaper", "walk", {"random": 0})
    time_step = environment.reset()
    first, second = (alone(policy(name, "leaper"), seed=1)(time_step) for _ in range(2))
    environment.action_spec().validate(first)
    np.testing.assert_array_equal(first, second)
    assert (name == "zero") == (not first.any())


@pytest.mark.parametrize(("name", "noise"), [("random", 0.0), ("zero", 0.1), ("cpg", 0.1)])
def test_random_policies_and_noise_differ_by_seed(name, noise):
    time_step = arc_suite.load("tick", "walk").reset(0)
    first, second = (alone(policy(name, "tick", noise=noise), seed)(time_step) for seed in (1, 2))
    assert (first != second).all()


def test_noise_is_added_to_what_the_policy_does():
    time_step = arc_suite.load("tick", "walk").reset(0)
    plain, noisy = (alone(policy("random", "tick", noise=noise), 1)(time_step) for noise in (0.0, 0.1))
    noise = alone(policy("zero", "tick", noise=0.1), 1)(time_step)
    np.testing.assert_array_equal(noisy, plain + noise)


@pytest.mark.parametrize("body", ["tick", generate(6, 3)])
def test_a_demonstrator_walks_by_positions_as_by_torques(body):
    """Where no joint would have to be pulled beyond its reach, to rounding, which contacts magnify."""
    rewards = {}
    for actions in ("torque", "position"):
        environment = arc_suite.load(body, "walk", {"random": 0, "actions": actions})
        act = alone(policy("cpg", body, task=environment.task.definition), 0)
        timestep, rewards[actions] = environment.reset(), []
        for _ in range(8):
            timestep = environment.step(act(timestep))
            rewards[actions].append(timestep.reward)
    np.testing.assert_allclose(*rewards.values(), rtol=1e-6)
    assert act(timestep).any() and np.abs(act(timestep) - environment.physics.data.ctrl).max() > 0.01


def test_policies_that_are_no_demonstrators_give_the_actions_that_a_task_takes():
    task = arc_suite.load("tick", "walk", {"actions": "position"}).task.definition
    time_step = arc_suite.load("tick", "walk").reset(0)
    for name in ("zero", "random"):
        actions = [alone(policy(name, "tick", task=given), 1)(time_step) for given in (None, task)]
        np.testing.assert_array_equal(*actions)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cgp", "queen"), "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random, ppo, universal)"),
        (
            ("zero", "quen"),
            f"unknown robot 'quen'; did you mean 'queen'? (there are: {ROBOT_WORDS}, module:name to import it)",
        ),
        (("cpg", "queen", "midium"), f"unknown preset 'midium'; did you mean 'medium'? (there are: {ALL})"),
        (("cpg", generate(4, 2), "tuned"), f"unknown preset 'tuned' (there are: {GENERAL}, posed)"),
        (("cpg", "queen", ()), f"preset: expected one or more of {ALL}, got none"),
        (("zero", "tick", "medium"), "preset 'medium': goes with the policy cpg, got 'zero'"),
        (("zero", "queen", (), 1, -0.1), "noise: expected a finite number of at least 0, got -0.1"),
        (("cpg", ROBOTS["bastion"].replace(name="queen")), f"walk: {JOINTS}, got 12; give it another name"),
    ],
)
def test_unknown_names_are_named(arguments, message):
    with refused(message):
        policy(*arguments)


OWN = """
import numpy as np
import arc_suite.cpg
number = 3
def walk(robot): return arc_suite.cpg.Demonstrator(robot, "medium")
def forgets(robot): return None
robots = []
def told(robot):
    robots.append(robot)
    return lambda time_step: np.zeros(18)
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "own_policies.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_policies", raising=False)


def test_policies_from_pythons_path_and_from_files_of_any_name(own, tmp_path):
    """The file is told where it lies, so that it finds its weights."""
    (tmp_path / "own-policies-0.py").write_text(f"{OWN}\nassert __file__ == {str(tmp_path / 'own-policies-0.py')!r}")
    time_step = arc_suite.load("tick", "walk", {"random": 0}).reset()
    own_policy = alone(policy("cpg", "tick", "medium"))(time_step)
    default = alone(policy("cpg", "tick", "refined"))(time_step)
    for path in ("own_policies:walk", "arc_suite.cpg:Demonstrator", f"{tmp_path}/own-policies-0.py:walk"):
        expected = default if path == "arc_suite.cpg:Demonstrator" else own_policy
        np.testing.assert_array_equal(alone(policy(path, "tick"))(time_step), expected)


def test_a_file_that_is_not_there_is_one_line():
    with pytest.raises(OSError, match="cannot read none.py: no such file or directory"):
        policy("none.py:make", "tick")


def test_policies_from_pythons_path_learn_the_name_of_a_robot_and_the_body_of_any_other(own):
    body, denser = generate(4, 2), ROBOTS["tick"].replace(density=1000.0)
    for robot, told in (("tick", "tick"), (ROBOTS["tick"], "tick"), (body, body), (denser, denser)):
        made = policy("own_policies:told", robot)
        made.reset([0], [0])
        assert sys.modules["own_policies"].robots.count(told) >= 2
        assert sys.modules["own_policies"].robots[-1] == told


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            "elsewhere:walk",
            "No module named 'elsewhere'; start in the folder of elsewhere.py, or put it on Python's path",
        ),
        ("own_polices:walk", "No module named 'own_polices'; did you mean 'own_policies'?"),
        (":walk", "invalid format: ':walk'"),
        ("own_policies:wlak", "module 'own_policies' has no attribute 'wlak'; did you mean 'walk'?"),
        ("own_policies.py:wlak", "module 'own_policies.py' has no attribute 'wlak'; did you mean 'walk'?"),
        ("needs.py:walk", "No module named 'tortch'"),
        ("own_policies:number", "expected a function that makes a policy from a robot's name"),
        ("own_policies:forgets", "expected it to return a function of a TimeStep, got NoneType"),
    ],
)
def test_paths_that_lead_nowhere_are_named(own, tmp_path, monkeypatch, path, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "needs.py").write_text("import tortch")
    with refused(f"policy {path!r}: {message}"):
        policy(path, "tick")


def test_hashes_of_functions(tmp_path, monkeypatch):
    file = tmp_path / "standing.py"
    file.write_text("def make(robot):\n    return lambda timestep: 0.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    expected = hashlib.sha256(file.read_bytes()).hexdigest()
    assert provenance.policy_sha256(f"{file}:make") == provenance.policy_sha256("standing:make") == expected
    file.write_text("def make(robot):\n    return lambda timestep: 1.0\n")
    assert provenance.policy_sha256("standing:make") != expected


def test_others_have_none():
    for name in ("zero", "cpg", "nowhere:make", "sys:exit"):
        assert policies.function_file(name) is None and provenance.policy_sha256(name) is None
