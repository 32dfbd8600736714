"""What is wrong with the results of a task is one line that names class, method, what was expected and returned."""

import re

import numpy as np
import pytest

from arc_suite import evaluation, policies
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import task_results
from arc_suite.learning import finals
from arc_suite.learning.studies import results
from arc_suite.tasks import TASKS
from arc_suite.tasks.walk import Walk


@pytest.fixture
def setup_of(monkeypatch):
    """Return a function from attributes of a subclass of Walk to its setup of one second."""

    def make(**attributes):
        monkeypatch.setitem(
            TASKS, "carry", type("Carry", (Walk,), {"name": "carry", "__module__": "lab", **attributes})
        )
        return Setup.of("tick", "carry", {"time_limit": 1.0})

    return make


def without_result(method):
    """Return a method that calls that of Walk, and forgets to return its result."""
    return lambda self, *arguments: getattr(Walk, method)(self, *arguments) and None


def changed_term(change):
    return lambda self, memory, readings: Walk.terms(self, memory, readings) | {"control": change(memory)}


def write_action(self, memory, readings):
    memory.action[...] = 0.0
    return Walk.after(self, memory, readings)


def count_calls(self, memory, readings):
    self.count = 1
    return Walk.after(self, memory, readings)


ENDS = "expected a pair of booleans, whether the episode is terminated and whether it is truncated, got"


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"__init__": lambda self, *_: None}, "Carry.__init__: expected a call of super().__init__(scene, settings, "),
        (
            {"settings_for": classmethod(lambda cls, body, overrides: {"weights": {}})},
            "Carry.settings_for: expected settings with a field weights, a mapping, got {'weights': {}}",
        ),
        (
            {"weights": Walk.weights | {"forward": np.nan}},
            "Walk.settings_for: expected a finite number as weight of 'forward', got nan",
        ),
        (
            {"weights": Walk.weights | {"forward": "1.5"}},
            "Walk.settings_for: expected a finite number as weight of 'forward', got '1.5'",
        ),
        (
            {"start": lambda self, random, stream: tuple(Walk.start(self, random, stream))[:3]},
            "Carry.start: expected a Start of arc_suite.tasks.scene, got (array(",
        ),
        (
            {"start": lambda self, *args: (start := Walk.start(self, *args))._replace(qpos=start.qpos[1:])},
            "Carry.start: expected qpos of shape (25,), got shape (24,)",
        ),
        ({"begin": without_result("begin")}, "Carry.begin: expected a memory, a NamedTuple, got None"),
        ({"after": without_result("after")}, "Carry.after: expected a memory, a NamedTuple, got None"),
        ({"after": write_action}, "Carry.after: writes into its arguments; expected a new memory, such as"),
        (
            {"after": lambda self, *args: Walk.after(self, *args)._replace(distance="far")},
            "Carry.after: expected numbers or arrays as 'distance' of the memory, got 'far'",
        ),
        ({"after": count_calls}, "Carry: a method sets the attribute 'count'; a task is a frozen value"),
        (
            {"before": lambda self, memory, action: memory},
            "Carry.before: expected a pair of a memory and Inputs, got WalkMemory(",
        ),
        ({"terms": lambda self, *_: 1.0}, "Carry.terms: expected a dictionary of numbers by name, got 1.0"),
        (
            {"terms": changed_term(lambda memory: "big")},
            "Carry.terms: expected a number for each environment as 'control', got 'big'",
        ),
        (
            {"terms": changed_term(lambda memory: None)},
            "Carry.terms: expected a number for each environment as 'control', got None",
        ),
        (
            {"terms": changed_term(lambda memory: memory.action)},
            "Carry.terms: expected 'control' of shape (), got shape (18,)",
        ),
        (
            {"terms": changed_term(lambda memory: memory.action.sum(keepdims=np.ndim(memory.x) == 1))},
            "Carry.terms: expected 'control' of shape (3,), got shape (1, 1)",
        ),
        ({"progress": lambda self, memory: 1.0}, "Carry.progress: expected a dictionary of numbers by name, got 1.0"),
        (
            {"progress": lambda self, memory: {"action": memory.action}},
            "Carry.progress: expected 'action' of shape (), got shape (18,)",
        ),
        (
            {"progress": lambda self, memory: {"a,b": 1.0}},
            "Carry.progress: expected a text without commas, quotes and line breaks as name of a metric, got 'a,b'",
        ),
        (
            {"progress": lambda self, memory: {7: 1.0}},
            "Carry.progress: expected a text without commas, quotes and line breaks as name of a metric, got 7",
        ),
        (
            {"observe": lambda self, *args: Walk.observe(self, *args) | {"posture": [1.0]}},
            "Carry.observe: expected an array as block 'posture', got [1.0]",
        ),
        ({"ended": lambda self, *_: None}, f"Carry.ended: {ENDS} None"),
        ({"ended": lambda self, *_: True}, f"Carry.ended: {ENDS} True"),
        ({"ended": lambda self, *_: (0.0, False)}, f"Carry.ended: {ENDS} (0.0, False)"),
        (
            {"ended": lambda self, *_: (np.zeros(2, bool), False)},
            "Carry.ended: expected booleans of shape (), got shape",
        ),
        (
            {"commands": {"asked": 1}},
            "Carry.commands: 'asked' is no field of WalkMemory; expected one, or a method with_command",
        ),
        (
            {"demonstrators": ("steerd",)},
            "unknown preset in Carry.demonstrators 'steerd'; did you mean 'steered'? (there are: ",
        ),
    ],
)
def test_a_result_that_does_not_fit_is_told(setup_of, attributes, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        task_results.check_results(setup_of(**attributes))


TAKEN_NAMES = (
    *("provenance", "preset", "zero_return", "paper_return", "return", "score", "no_score", "anchors", "length"),
    *("episodes", "run", "step", "policy_sha256", "seed", "wall_seconds", "cpu_seconds", "style_weight"),
)


@pytest.mark.parametrize("name", TAKEN_NAMES)
def test_a_metric_does_not_take_the_place_of_a_result(setup_of, name):
    setup = setup_of(progress=lambda self, memory: Walk.progress(self, memory) | {name: 7.0})
    message = (
        f"Carry.progress: expected another name of a metric, such as 'task_{name}', as tables have their own "
        f"'{name}', got '{name}'"
    )
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        evaluation.evaluate("zero", setup.robot, setup.task, task_kwargs=setup.task_kwargs, episodes=1)


def test_a_report_and_the_tables_have_no_name_that_a_metric_may_have(setup_of):
    report = evaluation.evaluate("zero", "tick", "walk", task_kwargs={"time_limit": 1.0}, episodes=1)
    columns = {*report.to_json(), *finals.COLUMNS, *results.TIMES, "step", "run"}
    assert columns - set(report.progress) <= set(TAKEN_NAMES)


def test_errors_of_the_methods_themselves_pass_through(setup_of):
    def fail(self, memory, readings):
        raise ValueError("too heavy")

    with pytest.raises(ValueError, match="^too heavy$"):
        task_results.check_results(setup_of(terms=fail))


@pytest.mark.parametrize("robot", ["tick", "random:7"])
@pytest.mark.parametrize("settings", [{}, {"kicks": 1.0, "delay": 2, "actions": "position", "observation_noise": 0.1}])
@pytest.mark.parametrize("task", ["walk", "navigate", "recover"])
def test_results_of_the_suite_fit(robot, settings, task):
    setup = Setup.of(robot, task, settings)
    task_results.check_results(setup)
    assert task_results.find_non_finite(setup, 2) is None


def late(value):
    """Return a function of a memory: 1.0, and another value from the fifth step on."""
    return lambda memory: np.where(np.asarray(memory.tick) < 5, 1.0, value)


@pytest.mark.parametrize(
    ("attributes", "flaw", "cause"),
    [
        (
            {"terms": changed_term(late(np.nan))},
            "step 5: term 'control' is nan",
            "the reward of the episode of seed 7 is not finite in step 5: term 'control' is nan",
        ),
        (
            {"terms": changed_term(late(np.inf))},
            "step 5: term 'control' is inf",
            "the reward of the episode of seed 7 is not finite in step 5: term 'control' is inf",
        ),
        (
            {
                "observe": lambda self, memory, readings: (
                    Walk.observe(self, memory, readings)
                    | {"posture": readings.posture * late(np.nan)(memory)[..., None]}
                )
            },
            "step 5: block 'posture' is nan",
            "block 'posture' is not finite at the end of the episode of seed 7",
        ),
    ],
)
def test_what_is_not_finite_is_named(setup_of, attributes, flaw, cause):
    setup = setup_of(**attributes)
    task_results.check_results(setup)
    assert task_results.find_non_finite(setup, 10) == flaw
    environment = setup.load()
    policy = policies.policy("zero", "tick")
    with pytest.raises(ValueError, match=f"^task carry: {re.escape(cause)}$"):
        evaluation.run(environment, policy, 7)


def test_a_return_of_a_batch_that_is_not_finite_names_its_terms(setup_of):
    setup = setup_of(terms=changed_term(late(np.nan)))
    environments = setup.make_vec(2, autoreset_mode="Disabled")
    policy = policies.policy("zero", "tick", num_envs=2)
    line = "^task carry: the reward of the episode of seed 7 is not finite by step 20: term 'control' is nan$"
    with pytest.raises(ValueError, match=line):
        evaluation.episodes_in_batch(environments, policy, [7, 8])
