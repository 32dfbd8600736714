"""One value for a body, a task and its settings."""

import json
import pickle
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from arc_suite import registry
from arc_suite.arenas import FLAT
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_to_json

QUEEN = ROBOTS["queen"]
MADE = generator.generate(4, 2)
SHORT = {"time_limit": 0.5}


def test_equal_content_is_equal():
    setup = Setup.of("queen", "steer", {"time_limit": 2.0, "healthy_range": (0.2, 1.0)})
    assert setup == Setup.of(QUEEN, "steer", {"healthy_range": [0.2, 1.0], "time_limit": 2.0})
    assert len({setup, pickle.loads(pickle.dumps(setup)), Setup.of("queen", "steer"), Setup.of("tick", "steer")}) == 3
    assert Setup.of("queen") == Setup(QUEEN)
    setup.task_kwargs["time_limit"] = 9.0  # a copy
    assert setup.task_kwargs["time_limit"] == 2.0


def test_three_kinds_of_environment_play_the_same_episode():
    setup = Setup.of("tick", "steer", {"time_limit": 0.5})
    first = np.concatenate([block.ravel() for block in setup.load(seed=3).reset().observation.values()])
    env, batch = setup.make(), setup.make_vec(2, seed=2, max_episode_steps=7)
    assert env.spec.max_episode_steps is None
    np.testing.assert_array_equal(env.reset(seed=3)[0], first.astype(np.float32))
    np.testing.assert_array_equal(batch.reset()[0][1], first.astype(np.float32))
    assert batch.task.definition.step_limit == setup.definition.step_limit
    for each in (env, batch):
        each.close()


@pytest.mark.parametrize("body", [QUEEN, MADE], ids=["robot", "body"])
def test_files_hold_it(body):
    setup = Setup.of(body, "rough", {"difficulty": 0.5})
    assert Setup.from_dict(json.loads(json.dumps(setup.to_dict()))) == setup
    assert setup.robot == ("queen" if body is QUEEN else body_to_json(MADE))
    assert setup.env_id == f"arc_suite/{body.name}-rough-v0"
    assert str(setup) == f'{body.name}, rough, {{"difficulty": 0.5}}'
    spec = gymnasium.envs.registration.EnvSpec.from_json(setup.spec(50).to_json())
    assert spec.max_episode_steps == 50
    env = gymnasium.make(spec)
    assert env.unwrapped.task.scene.body == body
    env.close()


def test_provenance_tells_what_episodes_depend_on():
    told = Setup.of("queen").provenance()
    assert json.loads(json.dumps(told)) == told
    assert {"robot", "task", "task_kwargs", "task_version", "body_sha256", "physics_sha256", "versions"} == told.keys()
    for other in (
        Setup.of("tick"),
        Setup.of(QUEEN.replace(density=11.0)),
        Setup.of("queen", "walk", {"arena": "bumps"}),
    ):
        assert other.provenance()["physics_sha256"] != told["physics_sha256"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("quen",), "unknown robot 'quen'"),
        (("queen", "wlak"), "unknown task 'wlak'"),
        (("queen", "walk", {"arena": "flta"}), "unknown arena 'flta'"),
        (("queen", "walk", {"arena": FLAT}), "task_kwargs: expected values that JSON can hold"),
        (("queen", "walk", {"random": 3}), "setting 'random': expected none"),
        (("queen", "walk", [3]), "task_kwargs: expected a mapping"),
        (("random:0-1,quen",), "unknown robot 'quen'; did you mean 'queen'?"),
        (("random:0-1", "wlak"), "unknown task 'wlak'; did you mean 'walk'?"),
        (("random:0-1", "walk", {"actions": "torque"}), "unknown actions of different bodies 'torque'"),
        (("random:3-1",), "robot 'random:3-1': expected seeds in ascending order"),
    ],
)
def test_names_and_settings_are_checked_when_it_is_made(arguments, message):
    with pytest.raises(ValueError, match=message):
        Setup.of(*arguments)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robot": "nobody"}, "unknown robot 'nobody'"),
        ({"robot": "spider.json"}, "unknown robot 'spider.json'"),
        ({"robot": "{}"}, "missing; a Body needs it"),
        ({"robot": None}, "expected robot to be a str"),
        ({"task": 3}, "expected task to be a str"),
        ({"task_kwargs": []}, "expected task_kwargs to be a dict"),
        ({"robot": "queen,spider.json"}, "unknown robot 'spider.json'"),
        ({"robot": "os:spider.json"}, "unknown robot 'os:spider.json'"),
        ({"robot": "varied:0-3,strolling:crab:3-4"}, "files import nothing; import 'strolling' first"),
        ({"robot": "strolling:queen"}, "files import nothing; import 'strolling' first"),
        ({"task": "strolling:walk"}, "files import nothing; import 'strolling' first"),
        ({"task_kwargs": {"arena": "strolling:flat"}}, "files import nothing; import 'strolling' first"),
        ({"task_kwargs": {"strolling:wind": 1.0}}, "files import nothing; import 'strolling' first"),
    ],
)
def test_files_import_nothing_and_open_nothing(change, message):
    with pytest.raises(ValueError, match=message) as error:
        Setup.from_dict(Setup.of("queen").to_dict() | change)
    assert "\n" not in str(error.value)


def test_tasks_of_other_packages_are_told_with_their_module(monkeypatch):
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("task", "steer"), __name__)
    setup = Setup.of("queen", f"{__name__}:steer")
    assert (setup.task, setup.kind.name) == (f"{__name__}:steer", "steer")
    assert setup == Setup.of("queen", "steer") == Setup.from_dict(setup.to_dict())


def test_settings_of_a_setup_change_and_go():
    setup = Setup.of("tick", "gaps", {"difficulty": 0.2, "exclude_blocks": ["contact_forces"]})
    assert setup.validation(10) == setup and setup.with_settings({}) == setup
    assert setup.with_settings({"difficulty": 0.3, "friction": 1.0}, dropped=["exclude_blocks"]) == Setup.of(
        "tick", "gaps", {"friction": 1.0, "difficulty": 0.3}
    )
    assert setup.judging() == Setup.of("tick", "gaps", {"difficulty": 0.2})
    assert Setup.of("queen,tick", "rough").judging() == Setup.of("queen,tick", "rough")


@pytest.mark.parametrize("tasks", ["recover,walk", "walk,recover"])
def test_several_tasks_learn_in_the_settings_of_all(tasks):
    setup = Setup.of("varied:0-1", tasks)
    assert setup.learning().task_kwargs == {}
    with pytest.raises(ValueError, match="^task recover: expected the blocks posture,"):  # not its own settings
        setup.learning().make_vec(4)
    assert Setup.of("queen", "recover").learning().task_kwargs == {"fall_seed": 1, "time_limit": 10.0}


def test_names_of_several_bodies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a,b.json").write_text("{}")
    several = ["varied:0-3", "queen,tick", "random:0,varied:1", "module:family:3-4", "a.json,queen", "queen,a.json"]
    one = ["varied:7", "queen", "module:family:3", '{"name": "a,b:1-2"}', "a,b.json"]
    assert [name for name in several + one if registry.names_several_bodies(name)] == several


def test_several_bodies_go_into_files_and_come_back():
    setup = Setup.of("random:0-1,queen", "steer", SHORT)
    assert setup.several and [body.name for body in setup.bodies] == ["random_0", "random_1", "queen"]
    assert setup.name == "random.0-1+queen" and str(setup) == 'random:0-1,queen, steer, {"time_limit": 0.5}'
    assert Setup.from_dict(setup.to_dict()) == setup
    assert [member.body for member in setup.members()] == list(setup.bodies)
    assert setup.members()[2] == Setup.of("queen", "steer", SHORT | {"actions": "position"})
    assert setup.provenance()["body_sha256"] != Setup.of("random:0-2").provenance()["body_sha256"]
    with pytest.raises(ValueError, match="^robot 'random:0-1,queen': expected one body, got several$"):
        setup.load()


def test_bodies_of_files_go_into_files_and_come_back(tmp_path):
    path = tmp_path / "mine.json"
    body = registry.body_of("crab").replace(name="mine")
    path.write_text(body_to_json(body))
    setup = Setup.of(f"{path},queen,varied:0-1", "steer", SHORT)
    path.unlink()
    assert [body.name for body in setup.bodies] == ["mine", "queen", "varied_0", "varied_1"] and setup.bodies[0] == body
    assert setup.name == "mine+queen+varied.0-1" and str(setup).startswith("mine,queen,varied:0-1, steer, ")
    assert Setup.from_dict(setup.to_dict()) == setup == setup.with_settings({})
    assert setup.validation(10).robot == "varied:100000-100009"
    with pytest.raises(OSError, match=r"^cannot read .*none\.json: no such file or directory$"):
        Setup.of(f"queen,{tmp_path / 'none.json'}")
    for text in ("[1]", "[]", "[", '["queen", {}]'):
        with pytest.raises(ValueError, match="^robot"):
            Setup.from_dict(setup.to_dict() | {"robot": text})


def test_a_list_of_files_alone_is_validated_by_its_first_bodies(tmp_path):
    for name in ("first", "second"):
        (tmp_path / f"{name}.json").write_text(body_to_json(registry.body_of("crab").replace(name=name)))
    setup = Setup.of(f"{tmp_path / 'first.json'},{tmp_path / 'second.json'}")
    assert [body.name for body in setup.validation(1).bodies] == ["first"]


def test_names_of_other_packages_are_no_families(monkeypatch):
    body = registry.body_of("crab").replace(name="mine")
    monkeypatch.setitem(registry.ROBOTS, "mine", body)
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("robot", "mine"), __name__)
    setup = Setup.of(f"{__name__}:mine,queen")
    assert setup.bodies[0] == body and setup.validation(10) == setup


def test_bodies_of_validation_are_of_other_seeds():
    assert Setup.of("varied:0-3").validation(10).robot == "varied:100000-100009"
    assert Setup.of("varied:0-3,random:0-3").validation(10).robot == "varied:100000-100004,random:100000-100004"
    assert Setup.of("queen,tick").validation(1).robot == "queen"


def test_flat_environments_go_on_bit_exactly_with_other_ages():
    setup, one, other = Setup.of("random:0-1", "walk", SHORT), [], []
    environment = setup.make_vec(2, seed=0, autoreset_mode="SameStep")
    environment.reset()
    snapshot = environment.snapshot()
    assert_array_equal(snapshot["steps"], [0, 0])
    environment.restore(snapshot | {"steps": np.array([0, 8])})
    actions = 0.2 * np.random.default_rng(0).standard_normal((6, 2, 48))
    for action in actions[:3]:
        environment.step(action)
    middle = environment.snapshot()
    for found in (one, other):
        environment.restore(middle)
        found += [environment.step(action) for action in actions[3:]]
    for first, second in zip(one, other, strict=True):
        for left, right in zip(first[:4], second[:4], strict=True):
            assert_array_equal(left, right)
    assert not one[0][3].any() or one[0][3][1]
    assert environment.step_limit == environment.task.step_limit


def test_tasks_of_several_bodies_have_no_mirror_image():
    task = Setup.of("random:0-1").make_vec(2).task
    assert sum(task.sizes.values()) == 759 and task.definition is task
    with pytest.raises(ValueError, match="different bodies have no common mirror image"):
        _ = task.symmetry
