"""The guide to adding a task and an arena: its code runs, and what it adds is like the suite's own."""

import os
import pathlib
import re
import subprocess
import sys

import pytest
from tiers import never, tiers

ROOT = pathlib.Path(__file__).parents[2]
GUIDE = (ROOT / "docs" / "adding_a_task.md").read_text()
CROUCHING, USING_A_TASK, RAMPS, USING_AN_ARENA = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)
COMMANDS = [line for line in re.search(r"```sh\n(.*?)```", GUIDE, re.DOTALL)[1].splitlines() if line]

SAME_IN_ROWS = """
import gymnasium, numpy as np
for threads in (1, 2, 3):
    envs = gymnasium.make_vec(ENV_ID, num_envs=3, num_threads=threads, task_kwargs=KWARGS)
    env = gymnasium.make(ENV_ID, task_kwargs=KWARGS)
    assert np.array_equal(envs.reset(seed=1)[0][1], env.reset(seed=2)[0])
    actions = np.random.RandomState(0).uniform(-0.3, 0.3, (40, *envs.action_space.shape)).astype(np.float32)
    for action in actions:
        observations, rewards, *_ = envs.step(action)
        observation, reward, *_ = env.step(action[1])
        assert np.array_equal(observations[1], observation) and rewards[1] == reward
    envs.close()
print("same")
"""


@pytest.fixture
def package(tmp_path):
    """Writes the guide's modules and returns a function that runs Python beside them."""
    (tmp_path / "crouching.py").write_text(CROUCHING)
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


@pytest.mark.slow
def test_arena(package):
    out = package("-c", USING_AN_ARENA + "print(environment.progress if 0 else steeper.reset().observation.keys())")
    assert out.splitlines()[-1].startswith(
        "odict_keys(['posture', 'velocities', 'contact_forces', 'gait_clock', 'command'"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("imported", "env_id", "kwargs"),
    [
        ("crouching", "arc_suite/leaper-crouch-v0", {}),
        ("ramps", "arc_suite/tick-walk-v0", {"arena": "ramp"}),
    ],
)
def test_rows_are_bit_equal_to_single_environments(package, imported, env_id, kwargs):
    code = f"import arc_suite, {imported}\nENV_ID, KWARGS = {env_id!r}, {kwargs!r}\n{SAME_IN_ROWS}"
    assert package("-c", code) == "same\n"


@pytest.mark.parametrize("command", tiers(COMMANDS, never, lambda command: "evaluate" in command))
def test_commands(package, command):
    name, *arguments = command.split()
    assert name == "arc-suite"
    short = {"evaluate": ["--episodes", "1"], "collect": ["--episodes", "2"], "style": ["--episodes", "1"]}
    kept = [argument for argument in arguments if argument not in ("--episodes", "10")]
    assert package("-m", "arc_suite", *kept, *short[arguments[0]])
