"""The guide to adding a task and an arena: its code runs, and what it adds is like the suite's own."""

import os
import pathlib
import re
import subprocess
import sys

import programs
import pytest
from tiers import never, tiers

ROOT = pathlib.Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "adding_a_task.md").read_text()
CROUCHING, USING_A_TASK, LEVEL_STEER, USING_A_TERM, RAMPS, USING_AN_ARENA = re.findall(
    r"```python\n(.*?)```", GUIDE, re.DOTALL
)
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
    (tmp_path / "ramps.py").write_text(RAMPS)
    environ = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
        "MINARI_DATASETS_PATH": str(tmp_path / "datasets"),
    }

    def run(*arguments):
        command = [sys.executable, *arguments]
        done = subprocess.run(command, env=environ, cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        return done.stdout

    return run


@pytest.mark.slow
def test_task(package):
    out = package("-c", USING_A_TASK + "print(observations.shape, [block.shape for block in blocks.values()])")
    assert out.startswith("[0.7] {'height': ")
    assert out.endswith("(8, 48) [(8, 23), (8, 24), (8, 1)]\n")
    out = package("-c", USING_A_TASK + 'print((arc_suite.symmetry("leaper", "crouch").observation.signs < 0).sum())')
    assert out.endswith(f"\n{2 + 4 + 3 + 4}\n")  # the quaternion, hips, velocities of the torso, hips


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
    assert package("-c", USING_A_TERM + BATCH).splitlines()[-1] == f"None {23 + 24 + 150 + 2 + 6 + 18 - 1}"


@pytest.mark.slow
def test_arena(package):
    out = package("-c", USING_AN_ARENA + "print(environment.progress if 0 else steeper.reset().observation.keys())")
    assert out.splitlines()[-1].startswith(
        "odict_keys(['posture', 'velocities', 'contact_forces', 'gait_clock', 'command'"
    )


@pytest.mark.long
def test_a_task_in_the_arena_conforms(package):
    code = "from arc_suite.envs.setup import Setup\nfrom arc_suite.evaluation import conformance\n"
    code += 'print(conformance.difference(Setup.of("tick", "walk", {"arena": "ramps:ramp"}), 20))'
    assert package("-c", code) == "None\n"


CHECKED = 'parameters.weights(cls.weights, changed=overrides.get("weights"))'
UNCHECKED = CROUCHING.replace(CHECKED, 'cls.weights | overrides.get("weights", {})')
OBSERVE = re.compile(r"    def observe\(.*?\n\n", re.DOTALL)
MISSPELT = ("--set", 'weights={"heigt": 1.0}')
UNKNOWN = "unknown weight 'heigt'; did you mean 'height'? (there are: height, upright, control)"


@pytest.mark.parametrize(
    ("module", "setting", "message"),
    [
        (CROUCHING, MISSPELT, UNKNOWN),
        (UNCHECKED, MISSPELT, UNKNOWN),
        (OBSERVE.sub("", CROUCHING), (), "task 'crouch': has no observe, which arc_suite.tasks.Task requires"),
    ],
    ids=["weights that the task checks", "weights that it does not check", "a method is missing"],
)
def test_mistakes_in_a_task_and_its_settings_are_one_line(module, setting, message, tmp_path):
    (tmp_path / "crouching.py").write_text(module)
    arguments = ("--task=crouching:crouch", "--robot=tick", "--policy=zero", "--episodes=1", *setting)
    done = programs.arc_suite("evaluate", *arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"arc-suite evaluate: {message}\n")


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
