"""The guides to adding a task and an arena: their code runs, and what it adds is like the suite's own."""

import functools
import re

import programs
import pytest
from interpreters import ROOT, printed
from tiers import never, tiers

GUIDE = "".join((ROOT / "docs" / f"adding_{name}.md").read_text() for name in ("a_task", "an_arena"))
(
    CROUCHING,
    USING_A_TASK,
    LEVEL_STEER,
    USING_A_TERM,
    CARRYING,
    CIRCLING,
    USING_A_COMMAND,
    RAMPS,
    USING_AN_ARENA,
) = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)
COMMANDS = re.findall(r"(?:^|`)(arc-suite [^`\n]*)", GUIDE, re.MULTILINE)
SHORT = {
    "evaluate": ["--episodes=1"],
    "collect": ["--episodes=2"],
    "style": ["--episodes=1"],
    "render": ["--steps=2", "--width=64", "--height=48"],
}


@pytest.fixture
def package(tmp_path):
    """Writes the guide's modules and returns a function that runs Python in their folder."""
    (tmp_path / "crouching.py").write_text(CROUCHING)
    (tmp_path / "level_steer.py").write_text(LEVEL_STEER)
    (tmp_path / "carrying.py").write_text(CARRYING)
    (tmp_path / "circling.py").write_text(CIRCLING)
    (tmp_path / "ramps.py").write_text(RAMPS)
    return functools.partial(printed, folder=tmp_path)


@pytest.mark.slow
def test_task(package):
    code = (
        USING_A_TASK
        + """
print(observations.shape, [block.shape for block in blocks.values()])
print((arc_suite.symmetry("leaper", "crouch").observation.signs < 0).sum())
try:
    arc_suite.load("leaper", "crouch", forward_reward_weight=0.5)
except ValueError as error:
    print(error)
"""
    )
    first, *_, shapes, negative, refusal = package(code)
    assert first.startswith("[0.7] {'height': ")
    assert shapes == "(8, 48) [(8, 23), (8, 24), (8, 1)]"
    assert int(negative) == 2 + 4 + 3 + 4  # the quaternion, hips, velocities of the torso, hips
    assert refusal.startswith("argument 'forward_reward_weight': the setting weights has the weight of every term")


BATCH = """
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance
setup = Setup.of("tick", "level_steer", settings)
print(conformance.difference(setup, 20), setup.definition.symmetry.observation.sources.max())
last = timestep.observation["last_action"] - 0.5
assert 0.0 < abs(last).min() and abs(last).max() <= 0.02
weights = environment.task.settings.weights
reward = 0
for name, weight in weights.items():
    reward = reward + weight * environment.task.terms[name]
assert (reward, weights["level"]) == (timestep.reward, 1.0)
"""


@pytest.mark.slow
def test_a_term_and_a_block(package):
    """In a dm_env as the guide shows them, and in a batch; test_jax runs them under `jit`."""
    assert package(USING_A_TERM + BATCH)[-1] == f"None {23 + 24 + 150 + 2 + 6 + 18 - 1}"


SPILLED = """
import arc_suite, carrying
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance
from arc_suite.tasks.setting_table import own_settings
setup = Setup.of("tick", "carry", {"spill_cosine": 0.95})
print(conformance.difference(setup, 20), own_settings(setup.definition)[-1][:2])
environment = arc_suite.load("tick", "carry", {"spill_cosine": 0.9999, "random": 0})
environment.reset()
steps = 1
while not environment.step([0.0] * 18).last():
    steps += 1
    assert environment.task.memory.cosine >= 0.9999
print(steps < 1000, environment.task.memory.cosine < 0.9999)
try:
    Setup.of("tick", "carry", {"spill_cosin": 1.0}).definition
except ValueError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_setting_and_a_memory(package):
    conforming, spilled, refusal = package(SPILLED)
    assert conforming == "None ('spill_cosine', '0.95')"
    assert spilled == "True True"
    assert refusal.startswith("unknown setting of carry 'spill_cosin'; did you mean 'spill_cosine'?")


ROUND = """
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance
setup = Setup.of("tick", "circling", {"kicks": 1.0})
print(conformance.difference(setup, 20), *setup.definition.commands, setup.definition.symmetry.observation.signs[-6:])
"""


def test_a_command_of_a_new_kind(package):
    """It walks, is set live, is like itself in a batch and under modifiers, and has a mirror image."""
    tracked, last = package(USING_A_COMMAND + ROUND)
    assert float(tracked) > 0.3 and last == "None command [ 1 -1 -1  1 -1 -1]"


WITHOUT_TERMS = re.sub(r"    def terms.*?\n\n", "", CIRCLING, count=1, flags=re.DOTALL)
WITHOUT_LIVE = re.sub(r"    live: .*?\n", "", CIRCLING, count=1).replace(", np.full(3, np.nan)", "")


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (WITHOUT_TERMS, "Can't instantiate abstract class Circle with abstract method terms"),
        (WITHOUT_LIVE, "command Circle: expected a memory with a field 'live', or no live commands, got neither"),
    ],
    ids=["a method is missing", "the field of live commands is missing"],
)
def test_mistakes_in_a_command_are_one_line(module, message, tmp_path):
    (tmp_path / "circling.py").write_text(module)
    arguments = ("--task=circling:circling", "--robot=tick", "--policy=zero", "--episodes=1")
    done = programs.arc_suite("evaluate", *arguments, cwd=tmp_path)
    assert done.returncode == 1 and message in done.stderr.splitlines()[-1]


@pytest.mark.slow
def test_arena(package):
    last = package(USING_AN_ARENA + "print(*steeper.reset().observation)")[-1]
    assert last.startswith("posture velocities contact_forces gait_clock command")


@pytest.mark.long
def test_a_task_in_the_arena_conforms(package):
    code = "from arc_suite.envs.setup import Setup\nfrom arc_suite.evaluation import conformance\n"
    code += 'print(conformance.difference(Setup.of("tick", "walk", {"arena": "ramps:ramp"}), 20))'
    assert package(code) == ["None"]


CHECKED = 'parameters.weights(cls.weights, changed=overrides.get("weights"))'
UNCHECKED = CROUCHING.replace(CHECKED, 'cls.weights | overrides.get("weights", {})')
OBSERVE = re.compile(r"    def observe\(.*?\n\n", re.DOTALL)
MISSPELLED = ("--set", 'weights={"heigt": 1.0}')
UNKNOWN = "unknown term of weights 'heigt'; did you mean 'height'? (there are: height, upright, control)"


@pytest.mark.parametrize(
    ("module", "setting", "message"),
    [
        (CROUCHING, MISSPELLED, UNKNOWN),
        (UNCHECKED, MISSPELLED, UNKNOWN),
        (OBSERVE.sub("", CROUCHING), (), "task 'crouch': has no observe, which arc_suite.tasks.Task requires"),
    ],
    ids=["weights that the task checks", "weights that it does not check", "a method is missing"],
)
def test_mistakes_in_a_task_and_its_settings_are_one_line(module, setting, message, tmp_path):
    (tmp_path / "crouching.py").write_text(module)
    arguments = ("--task=crouching:crouch", "--robot=tick", "--policy=zero", "--episodes=1", *setting)
    done = programs.arc_suite("evaluate", *arguments, cwd=tmp_path)
    programs.refused(done, f"arc-suite evaluate: {message}")


@pytest.mark.parametrize("command", tiers(COMMANDS, never, lambda command: "evaluate" in command))
def test_commands(package, command, tmp_path, monkeypatch):
    """By the console script, in the folder of the modules alone."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    name, program, *arguments = command.split()
    if "--verify=ID" in arguments:
        made = programs.arc_suite(
            "collect", "--task=crouching:crouch", "--policy=zero", *SHORT["collect"], cwd=tmp_path
        )
        arguments[arguments.index("--verify=ID")] = f"--verify={made.stdout.partition(':')[0]}"
    else:
        arguments += SHORT.get(program, [])
    done = programs.arc_suite(program, *arguments, cwd=tmp_path)
    if "cannot render" in done.stderr:
        pytest.skip("no OpenGL here")
    assert (done.returncode, done.stderr) == (0, "") and done.stdout
