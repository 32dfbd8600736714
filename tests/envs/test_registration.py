"""Robots and tasks of other packages: registered from outside, then like the suite's own."""

import functools
import re
import sys
import types
from typing import ClassVar, NamedTuple

import gymnasium
import programs
import pytest
from interpreters import ROOT, printed
from refusals import refused

import arc_suite
from arc_suite import registration, registry, suite
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.cpg.law import Clocked
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import LAWS
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS
from arc_suite.tasks.parameters import PARAMETERS
from arc_suite.tasks.walk import Walk

GUIDE = (ROOT / "docs" / "adding_a_robot.md").read_text()
REGISTERING, USING = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture
def package(tmp_path):
    """Writes the package `creatures` and returns a function that runs code in its folder."""
    (tmp_path / "creatures").mkdir()
    (tmp_path / "creatures" / "__init__.py").write_text("")
    (tmp_path / "creatures" / "hopper.py").write_text(REGISTERING)
    (tmp_path / "hopper.py").write_text(REGISTERING)

    return functools.partial(printed, folder=tmp_path, MINARI_DATASETS_PATH=str(tmp_path / "datasets"))


@pytest.mark.slow
def test_guide(package):
    checks = (
        "assert picture.shape == (480, 640, 3) and picture.std() > 5 and environments.num_envs == 8\n"
        "print(environment.reset()[0].shape, environment.unwrapped.task.settings.parameters.target_velocity)\n"
    )
    assert package(USING + checks) == ["(107,) 0.15"]


def test_programs_find_the_robot_in_the_current_folder(package, tmp_path):
    done = programs.arc_suite(
        "evaluate", "--robot=hopper:hopper", "--preset=slow", "--episodes=1", "--set=time_limit=1", cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "") and "\nhopper, slow  " in done.stdout


@pytest.mark.long
def test_guides_robot_walks_well(package):
    """Straight ahead for a whole episode, the faster the preset; fast as fast as the task asks for."""
    code = (
        "import arc_suite, hopper\n"
        "from arc_suite import evaluation\n"
        "from arc_suite.cpg import Demonstrator\n"
        "environment = arc_suite.load('hopper', 'walk')\n"
        "for preset in ('slow', 'medium', 'fast'):\n"
        "    episode = evaluation.run(environment, Demonstrator(environment, preset), seed=0)\n"
        "    print(episode.length, episode.progress['speed'], episode.progress['gait_compliance'])\n"
    )
    lengths, speeds, compliances = zip(*(map(float, line.split()) for line in package(code)), strict=True)
    assert set(lengths) == {1000.0} and min(compliances) > 0.8
    assert 0.08 < speeds[0] < speeds[1] - 0.05 < speeds[2] - 0.1 and abs(speeds[2] - 0.3) < 0.03


@pytest.mark.slow
def test_every_face(package):
    code = """
import arc_suite, gymnasium, numpy as np
from creatures import hopper
tasks = arc_suite.TASKS_BY_DOMAIN["queen"]
assert tasks[:2] == ("walk", "steer") and tasks[-1] == "stroll"
assert arc_suite.ALL_TASKS == tuple((d, t) for d in arc_suite.TASKS_BY_DOMAIN for t in tasks)
assert list(arc_suite.TASKS_BY_DOMAIN)[-1] == "hopper"
assert arc_suite.suite.ALL_TASKS == arc_suite.ALL_TASKS
for task in ("walk", "steer", "stroll"):
    env_id = f"arc_suite/hopper-{task}-v0"
    env = gymnasium.make(env_id, render_mode="rgb_array", width=32, height=24)
    first, again = env.reset(seed=1)[0], env.reset(seed=1)[0]
    assert np.array_equal(first, again) and not np.array_equal(first, env.reset(seed=2)[0])
    action = np.full(8, 0.1, np.float32)
    env.reset(seed=1)
    stepped = env.step(action)
    assert env.render().shape == (24, 32, 3)
    for mode in ("vector_entry_point", "sync", "async"):
        envs = gymnasium.make_vec(env_id, num_envs=2, vectorization_mode=mode)
        assert np.array_equal(envs.reset(seed=1)[0][0], first), mode
        observations, rewards, *_ = envs.step(np.stack([action, action]))
        assert np.array_equal(observations[0], stepped[0]) and rewards[0] == stepped[1], mode
        envs.close()
for call in (
    lambda: arc_suite.load("hoper", "walk"),
    lambda: arc_suite.load("hopper", "strol"),
    lambda: arc_suite.load("nowhere:hopper", "walk"),
):
    try:
        call()
    except ValueError as error:
        print(error)
"""
    words = [*ROBOTS, "hopper", *registry.robot_words()[len(ROBOTS) :]]
    assert package(code) == [
        f"unknown robot 'hoper'; did you mean 'hopper'? (there are: {', '.join(words)}, module:name to import it)",
        f"unknown task 'strol'; did you mean 'stroll'? (there are: {', '.join([*TASKS, 'stroll'])}, "
        "module:name to import it)",
        "robot 'hopper': cannot import nowhere: No module named 'nowhere'; "
        "start in the folder of nowhere.py, or put it on Python's path",
    ]


@pytest.mark.long
def test_processes_that_share_no_memory_import_it(package):
    code = """
import gymnasium, numpy as np
if __name__ == "__main__":
    from creatures import hopper
    for context in ("spawn", "forkserver"):
        envs = gymnasium.make_vec(
            "arc_suite/hopper-walk-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"context": context}
        )
        print(envs.reset(seed=0)[0].shape)
        envs.close()
"""
    assert package(code) == ["(2, 107)"] * 2


@pytest.mark.slow
def test_names_import_what_they_name_and_ids_name_the_module_that_is_given(package):
    """A wrapper around `register` changes nothing of what other processes import."""
    code = """
import arc_suite, gymnasium
from arc_suite.tasks.walk import Walk
print(arc_suite.load("creatures.hopper:hopper", "creatures.hopper:stroll").reset().observation["gait_clock"].shape)
print(gymnasium.make("creatures.hopper:arc_suite/hopper-walk-v0").reset()[0].shape)
class Amble(Walk):
    name = "amble"
def wrapper(**kwargs):
    arc_suite.register(**kwargs)
wrapper(module="creatures.hopper", tasks=(Amble,))
print(gymnasium.spec("arc_suite/queen-amble-v0").kwargs)
class Saunter(Walk):
    name = "saunter"
arc_suite.register(tasks=(Saunter,))
print(gymnasium.spec("arc_suite/queen-saunter-v0").kwargs)
"""
    assert package(code) == [
        "(2,)",
        "(107,)",
        "{'domain_name': 'queen', 'task_name': 'creatures.hopper:amble'}",
        "{'domain_name': 'queen', 'task_name': 'saunter'}",
    ]


@pytest.mark.release
def test_a_preset_of_its_own_and_a_row_without_noise_serve_every_program(package, tmp_path):
    module = REGISTERING.replace('"base_noise": 0.02,', "").replace('("fast", 24)', '("fast", 24), ("prowl", 15)')
    (tmp_path / "hopper.py").write_text(module)
    code = """
import subprocess, sys
import arc_suite, hopper
from arc_suite.tasks.fitting import fitted_noise

assert "base_noise" not in hopper.WALK
noise = arc_suite.load("hopper", "walk").task.definition.settings.noise
assert noise._asdict() == fitted_noise(hopper.BODY)
for program, *arguments in (
    ("evaluate", "--episodes=1", "--preset=prowl"),
    ("style", "--episodes=1", "--preset=prowl", "--save=walk.npz"),
    ("style", "--policy=walk.npz", "--compare=cpg", "--compare_preset=prowl", "--episodes=1"),
    ("collect", "--episodes=2", "--steps=5", "--preset=prowl,slow"),
    ("collect", "--verify=arc_suite/hopper/walk/cpg-prowl-slow-5steps-v0"),
    ("render", "--steps=2", "--preset=prowl", "--output=hopper.png", "--width=64", "--height=48"),
    ("evaluate", "--preset=prwl"),
):
    command = [sys.executable, "-m", "arc_suite", program, "--robot=hopper:hopper", *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    print(program, done.returncode, *done.stderr.splitlines()[-1:])
"""
    lines = package(code)
    if "cannot render" in lines[-2]:
        lines[-2] = "render 0"
    assert lines == [
        *(f"{program} 0" for program in ("evaluate", "style", "style", "collect", "collect", "render")),
        "evaluate 1 arc-suite evaluate: unknown preset 'prwl'; did you mean 'prowl'? "
        "(there are: slow, medium, fast, tuned, refined, straight, steered, surefooted, climbing, braced, reactive, "
        "sighted, leaping, planned, tracked, rising, crossing, in_step, posed, balanced, prowl, limping, hiking)",
    ]


TICK = ROBOTS["tick"]
OTHER = TICK.replace(name="other")
ROW = PARAMETERS["walk"]["tick"]
WITHOUT_BANDS = {name: value for name, value in ROW.items() if name not in ("velocity_band", "healthy_range")}


def walk(row):
    """The arguments that register OTHER with parameters in walk."""
    return {"body": OTHER, "parameters": {"walk": row}}


def presets(**given):
    """The arguments that register OTHER with presets."""
    return {"body": OTHER, "presets": given}


class Other(Walk):
    """Another task of a name that is taken."""

    name = "walk"


class Nameless(Walk):
    """A task without a name of its own."""


def crawl(**attributes):
    """The argument that registers a subclass of Walk with attributes."""
    return {"tasks": (type("Crawl", (Walk,), {"name": "crawl", **attributes}),)}


class Parameters(NamedTuple):
    """Presets of a law of another package."""


class Law(Clocked):
    """A law of another package."""

    preset = Parameters()

    def __init__(self, task, preset):
        """Stand still."""
        super().__init__(lambda *_: 0.0)


class Unfitted(Law):
    """A law that takes no preset."""

    def __init__(self, task):
        """Take a task."""
        super().__init__(task, None)


class Lacking:
    """A law without parts."""

    reads, initial = ("posture", "velocities"), None


class Blind(Law):
    """A law that does not see its joints."""

    reads = ("goal",)


class Stolen(Law):
    """A law whose presets are those of another."""

    preset = PRESETS["queen"]["steered"]


class Numbered(Law):
    """A law whose preset is a number."""

    preset = 0.3


class Misnamed(Walk):
    """A task whose name no id can have."""

    name = "walk-slowly"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {},
            "nothing to register: give a body, tasks, arenas, families, modifiers, laws, networks, "
            "algorithms, clips, goals, axes or programs",
        ),
        ({"parameters": {"walk": ROW}}, "parameters, presets and visuals belong to a body, and none is given"),
        ({"body": "other"}, "body: expected a spec.Body, got 'other'"),
        ({"body": TICK.replace(density=7.0)}, "robot 'tick' is already registered"),
        (walk({"base_noise": 0.1, **ROW, "duty_factor": 2}), "duty_factor: expected a number from 0 to 1, got 2"),
        (walk(WITHOUT_BANDS), "parameters of walk: other has no healthy_range and no velocity_band"),
        (walk(ROW | {"weights": {"contrl": 1.0}}), "unknown term of weights 'contrl'; did you mean 'control'?"),
        (walk([ROW]), "parameters of walk: expected a mapping of names to values, got [{'target_velocity': "),
        (
            {"body": OTHER, "parameters": {"steer": 3}},
            "parameters of steer: expected a mapping of names to values, got",
        ),
        ({"body": OTHER, "parameters": {"wlak": ROW}}, "unknown task of parameters 'wlak'; did you mean 'walk'?"),
        (presets(**PRESETS["leaper"]), "preset 'slow': preset: other has 6 legs, and phase_offsets is for 4"),
        (presets(**PRESETS["bastion"]), "preset 'slow': preset: does not fit other: KeyError: 'knee'"),
        (presets(trot={"lead": 0.1}), "preset 'trot': preset: expected one of Preset, float, SteppingParameters"),
        ({"tasks": (Other,)}, "task 'walk' is already registered"),
        ({"tasks": (Misnamed,)}, "task 'walk-slowly': expected letters, digits and underscores, without a digit first"),
        ({"tasks": (len,)}, "tasks: expected classes by the contract of arc_suite.tasks.Task, got <built-in"),
        (walk(ROW) | {"tasks": (Other,)}, "task 'walk' is already registered"),
        ({"tasks": (Nameless,)}, "class Nameless has no name of its own: walk is that of Walk"),
        ({"tasks": Other}, "tasks: expected classes, such as tasks=(Other,), got <class '"),
        ({"modifiers": 3}, "modifiers: expected classes, such as modifiers=(Name,), got 3"),
        ({"task": (Other,)}, "unknown argument 'task'; did you mean 'tasks'? (there are: module, body, parameters, "),
        ({"bodies": (OTHER,)}, "argument 'bodies': body takes one robot's body"),
        ({"gait": "ripple"}, "argument 'gait': parameters has the gait of a robot"),
        ({"laws": ("mine",)}, "laws: expected a mapping of names to values, got ('mine',)"),
        ({"algorithms": len}, "algorithms: expected a mapping of names to values, got <built-in function len>"),
        (crawl(weights=["forward"]), "Crawl.weights: expected a mapping of names to values, got ['forward']"),
        (crawl(weights={"forward": "1.5"}), "Crawl.weights['forward']: expected a number from -1e+06 to 1e+06, got"),
        (crawl(weights={"forward": float("nan")}), "Crawl.weights['forward']: expected a number from -1e+06 to 1e+06"),
        (crawl(commands={"asked": 0}), "Crawl.commands['asked']: expected an integer from 1, got 0"),
        (crawl(demonstrators="steered"), "Crawl.demonstrators: expected a tuple of names of presets, got 'steered'"),
        (crawl(settings_for=lambda self, *_: None), "Crawl.settings_for: expected a class method, with @classmethod "),
        (crawl(step_limit=100), "Crawl.step_limit: expected none; the setting time_limit, s, decides it"),
        ({"arenas": {"flat": lambda body: None}}, "arena 'flat' is already registered"),
        (
            {"arenas": {"a-b": lambda body: None}},
            "arena 'a-b': expected letters, digits and underscores, without a digit first",
        ),
        ({"arenas": {"mine": FLAT}}, "arena 'mine': expected a function from a body to an Arena, got Flat()"),
        (
            {"arenas": {"mine": lambda: FLAT}},
            "arena 'mine': expected a function from a body to an Arena called with body: too many positional arguments",
        ),
        ({"laws": {"mine": Unfitted}}, "law 'mine': expected a class called with task and preset: too many positiona"),
        (
            {"laws": {"mine": Law, "a b": Law}},
            "law 'a b': expected letters, digits and underscores, without a digit first",
        ),
        ({"laws": {"mine": Law, "steered": Law}}, "law 'steered': the suite has presets of this name; choose another"),
        (
            {"laws": {"mine": Lacking}},
            "law 'mine': has no preset and no __call__, which arc_suite.cpg.law.Law requires",
        ),
        ({"laws": {"mine": 3}}, "law 'mine': has no preset and no reads and no initial and no __call__, which "),
        ({"laws": {"mine": Blind}}, "law 'mine': reads: expected posture, velocities and others, got ('goal',)"),
        ({"laws": {"mine": Stolen}}, "law 'mine': presets of SteppingParameters are those of Stepping"),
        ({"laws": {"mine": Numbered}}, "law 'mine': presets of float are those of StrideLaw"),
        ({"laws": {"mine": Law}} | walk(WITHOUT_BANDS), "parameters of walk: other has no healthy_range and no veloc"),
        ({"laws": {"mine": Law}} | presets(mine=3.0), "preset 'mine': froude: expected a number from -1 to 1, got 3.0"),
        ({"programs": {"mine": len}}, "program 'mine': expected the name of a module, got <built-in function len>"),
        ({"clips": {"mine": "a:b"}, "algorithms": {3: "a:b"}}, "algorithm 3: expected letters, digits and underscores"),
        ({"networks": {"mine": "a:b"}, "tasks": (Other,)}, "task 'walk' is already registered"),
    ],
)
def test_mistakes_are_one_line_and_register_nothing(arguments, message):
    tables = (
        ROBOTS,
        PARAMETERS["walk"],
        PRESETS,
        TASKS,
        ARENAS,
        LAWS,
        registry.MODULE_OF_NAME,
        *registry.ADDITIONS.values(),
    )
    before = [dict(table) for table in tables]
    with refused(message, begins=True):
        arc_suite.register(**arguments)
    assert [dict(table) for table in tables] == before


@pytest.fixture
def _restored_tables():
    """Takes back what a test registers."""
    additions = registry.ADDITIONS["law"]
    tables = (TASKS, ARENAS, LAWS, additions, registry.MODULE_OF_NAME, gymnasium.registry, ROBOTS, PARAMETERS)
    before = [dict(table) for table in tables]
    yield
    for table, entries in zip(tables, before, strict=True):
        table.clear()
        table.update(entries)


@pytest.mark.usefixtures("_restored_tables")
def test_a_part_that_is_edited_and_registered_again_replaces_its_earlier_version():
    """As a cell of a notebook that runs twice; another class of that name is refused."""
    for speed in (1.0, 2.0):

        class Edited(Walk):
            name = "edited"
            weights: ClassVar = Walk.weights | {"forward": speed}

        class EditedLaw(Law):
            preset = Parameters()

        def rise(body):
            return None

        arc_suite.register(tasks=(Edited,), laws={"edited_law": EditedLaw}, arenas={"edited_rise": rise})
        assert (TASKS["edited"], ARENAS["edited_rise"], LAWS[Parameters]) == (Edited, rise, EditedLaw)
    other = type("OtherEdited", (Walk,), {"name": "edited"})
    with refused("task 'edited' is already registered; choose another name"):
        arc_suite.register(tasks=(other,))


@pytest.mark.usefixtures("_restored_tables")
def test_a_robot_has_parameters_of_a_task_of_the_same_call():
    strolls = type("Strolls", (Walk,), {"name": "strolls"})
    slow = {"target_velocity": 0.2}
    arc_suite.register(body=OTHER, parameters={"strolls": slow, "walk": None}, tasks=(strolls,))
    assert PARAMETERS["strolls"] == {"other": slow} and "other" not in PARAMETERS["walk"]
    arc_suite.load("other", "strolls")


@pytest.mark.usefixtures("_restored_tables")
def test_a_body_has_another_name_once_a_robot_has_its_own():
    body = TICK.replace(name="zork", density=2.0 * TICK.density)
    assert registry.distinct_name(body) == "zork"
    arc_suite.register(body=TICK.replace(name="zork"))
    assert re.fullmatch(r"zork_[0-9a-f]{6}", registry.distinct_name(body))


@pytest.mark.usefixtures("_restored_tables")
def test_setups_name_parts_as_other_processes_can_import_them(monkeypatch):
    """As `module:name` in files and for other processes, and by the name alone for people."""
    monkeypatch.setitem(registry.FAMILIES, "zorks", lambda seed: TICK)
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("family", "zorks"), "zork_package")
    monkeypatch.setitem(ARENAS, "field", lambda body: FLAT)
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("arena", "field"), "zork_package")
    monkeypatch.setitem(ROBOTS, "other", OTHER)
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("robot", "other"), "zork_package")
    monkeypatch.setitem(sys.modules, "zork_package", types.ModuleType("zork_package"))
    setup = Setup.of("zorks:0-1,other,tick", "walk", {"arena": "field"})
    assert setup.robot == "zork_package:zorks:0-1,zork_package:other,tick"
    assert setup.task_kwargs == {"arena": "zork_package:field"}
    assert setup.name == "zorks.0-1+other+tick"
    qualified_setup = Setup.of(setup.robot, "walk", {"arena": "zork_package:field"})
    assert setup == qualified_setup == Setup.from_dict(setup.to_dict())


@pytest.mark.usefixtures("_restored_tables")
def test_anchors_are_measured_anew_once_something_is_registered(monkeypatch):
    """Demonstrators of a law that is registered later may suit the task."""
    policies_of_calls = []
    monkeypatch.setattr(anchors, "play_returns", lambda setup, policy, seeds: policies_of_calls.append(policy))
    setup = Setup.of(TICK.replace(name="zork"), "walk", {"time_limit": 0.1})
    anchors.measure_returns(setup)
    count = len(policies_of_calls)
    anchors.measure_returns(setup)
    assert len(policies_of_calls) == count > 0
    arc_suite.register(body=OTHER)
    anchors.measure_returns(setup)
    assert len(policies_of_calls) == 2 * count


@pytest.mark.filterwarnings("ignore:.*out of date")
def test_an_id_of_an_earlier_version_is_refused(monkeypatch):
    """As docs/contributing.md says of releases, which have the latest version of each task."""
    for name in [name for name in gymnasium.registry if name.startswith("arc_suite/")]:
        monkeypatch.delitem(gymnasium.registry, name)
    monkeypatch.setattr(Walk, "version", 1)
    registration.register_ids()
    try:
        with pytest.raises(gymnasium.error.DeprecatedEnv, match="use `arc_suite/queen-walk-v1` instead"):
            gymnasium.make("arc_suite/queen-walk-v0")
    finally:
        for name in [name for name in gymnasium.registry if name.startswith("arc_suite/")]:
            del gymnasium.registry[name]


def test_names_of_the_suite_of_dm_control():
    assert suite.load is arc_suite.load
    assert suite.BENCHMARKING is arc_suite.BENCHMARKING and set(suite.BENCHMARKING) < set(suite.ALL_TASKS)
    assert suite.TASKS_BY_DOMAIN == arc_suite.TASKS_BY_DOMAIN
    for module in (arc_suite, suite):
        with pytest.raises(AttributeError, match="no attribute 'HARD'"):
            _ = module.HARD
