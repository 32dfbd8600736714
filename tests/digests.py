"""Digests of every task: bit-exact observations, rewards and metrics, and bit-exact actions of demonstrators.

`python tests/digests.py` prints the cases that differ from `tests/golden/digests.json`; its exit code is then 1.
`--accept` stores the present ones. A difference is a change of dynamics, reward or observation: it belongs in the
changelog.

Bits depend on the processor: NumPy and the C library round sines and matrix products differently on
different ones. The file names the arithmetic on which it was made. Where the arithmetic differs, the rewards
of the first steps are compared at a tolerance instead.
"""

import argparse
import hashlib
import itertools
import json
import pathlib
import sys
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np
from tqdm import tqdm

import arc_suite
from arc_suite.arenas import FLAT
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS
from arc_suite.simulation import falls
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import TASKS

FILE = pathlib.Path(__file__).parent / "golden" / "digests.json"
SEEDS, STEPS, AFTER = (3, 40), 300, 60  # control steps of a stream, and those after one more reset
FIRST = 20  # rewards that are compared at a tolerance

falls.DROPS = 12  # as in all tests: tables of falls take a tenth of a second


class Case(NamedTuple):
    """One setting of a task; `command` is set after 100 steps, `preset` acts in place of a fixed motion."""

    robot: str
    task: str
    task_kwargs: Mapping[str, Any] = {}
    command: tuple[float, ...] | None = None
    preset: str | None = None


# What is digested of every robot: label -> task and settings. Labels stay when a setting gets another name.
_MODIFIED = {
    "kicks": {"kicks": 1.5},
    "weaker motors": {"motor_strength": (0.6, 1.0)},
    "failing leg": {"actuator_failure": True},
    "friction": {"friction": (0.4, 1.1)},
    "mass": {"mass": (0.8, 1.3)},
    "noise": {"observation_noise": 1.0},
    "delay": {"delay": (0, 3)},
    "position actions": {"actions": "position"},
    "fewer blocks": {"exclude_blocks": ("contact_forces",)},
}
_SHORT = {"time_limit": 4.0}
_SETTINGS = {
    **{f"steer, {label}": ("steer", settings) for label, settings in _MODIFIED.items()},
    "walk, all modifiers": ("walk", {**_MODIFIED["kicks"], **_MODIFIED["noise"], **_MODIFIED["delay"]}),
    "roam, position actions": ("roam", _MODIFIED["position actions"]),
    "walk, wave gait": ("walk", {"gait": "wave"}),
    "steer, wave gait": ("steer", {"gait": "wave"}),
    "rough, curriculum": ("rough", {"curriculum": True, "level": 3, **_SHORT}),
    "roam, curriculum": ("roam", {"curriculum": True, "level": 3, **_SHORT}),
    "course, difficulty": ("course", {"difficulty": 0.3, "terrain_seed": 2}),
    "steer, slower": ("steer", {"target_velocity": 0.3, "gait_frequency": 1.0, "weights": {"control": -0.01}}),
}
_COMMANDED = ("steer", "rough", "roam")
_DEMONSTRATED = (
    *(("walk", preset) for preset in ("slow", "medium", "fast", "tuned", "refined")),
    *(("steer", preset) for preset in ("steered", "surefooted")),
    ("rough", "surefooted"),
    ("rough", "climbing"),
    ("gaps", "sighted"),
    ("navigate", "planned"),
)


def cases() -> dict[str, Case]:
    """Return every case by name."""
    found = {f"{robot} {task}": Case(robot, task) for robot, task in itertools.product(ROBOTS, TASKS)}
    for robot in ROBOTS:
        found |= {f"{robot} {label}": Case(robot, task, kwargs) for label, (task, kwargs) in _SETTINGS.items()}
        command = (0.5, np.nan, -0.3)
        found |= {f"{robot} {task}, live command": Case(robot, task, {}, command) for task in _COMMANDED}
        presets = [*_DEMONSTRATED, *([("roam", "balanced")] if robot == "leaper" else [])]
        found |= {f"{robot} {task}, {preset}": Case(robot, task, {}, None, preset) for task, preset in presets}
    return found


def arithmetic() -> str:
    """Return a digest of how this machine rounds, of numbers and of a simulation."""
    numbers = np.linspace(-7.0, 7.0, 1001)
    matrix = np.sin(np.outer(numbers[:40], numbers[100:140])) + 9.0 * np.eye(40)
    results = [np.sin(numbers), np.cos(numbers), np.exp(numbers), np.arctan2(numbers, numbers[::-1])]
    results += [np.hypot(numbers, 1.3), matrix @ matrix, np.linalg.solve(matrix, numbers[:40])]
    model = compile_model(ROBOTS["queen"], FLAT)
    data = mujoco.MjData(model)
    for step in range(2000):
        data.ctrl[:] = 0.4 * ((step // 100) % 2) - 0.2
        mujoco.mj_step(model, data)
    return _digest([*results, data.qpos])


def rows(case: Case, seed: int) -> Iterator[tuple[np.ndarray, float | None, dict]]:
    """Yield observation, reward and metrics of every step; a reset has no reward."""
    environment = arc_suite.load(case.robot, case.task, {**case.task_kwargs, "random": seed})
    motors = environment.action_spec().shape[0]
    noise, at = np.random.RandomState(seed), np.arange(motors)
    act = Demonstrator(case.robot, case.preset) if case.preset else None
    timestep = environment.reset()
    for step in range(STEPS + AFTER):
        if timestep.last() or step == STEPS:
            timestep = environment.reset()
        yield np.concatenate(list(timestep.observation.values())), timestep.reward, _metrics(environment, timestep)
        if case.command is not None and step == 100:
            environment.command("command", case.command)
        if act:
            action = act(timestep)
        else:  # every other seed moves smoothly, and falls later
            smooth = 0.5 * np.sin(0.4 * step + 2.0 * at)
            action = noise.uniform(-1.0, 1.0, motors) if seed == SEEDS[0] else smooth
        timestep = environment.step(action)


def _metrics(environment, timestep) -> dict:
    return {} if timestep.first() else environment.task.progress


def digested(case: Case) -> dict[str, Any]:
    """Return the digests of a case: `observations`, the same without negative zeros, `rewards`, `metrics`."""
    observations, rewards, metrics = [], [], []
    for seed in SEEDS:
        for observation, reward, progress in rows(case, seed):
            observations.append(observation)
            rewards.append(np.nan if reward is None else reward)
            metrics.extend(float(progress[name]) for name in sorted(progress))
    unsigned = (observation + 0.0 for observation in observations)
    found = {"observations": observations, "unsigned": unsigned, "rewards": rewards, "metrics": metrics}
    first = [None if np.isnan(reward) else float(f"{reward:.9g}") for reward in rewards[:FIRST]]
    return {name: _digest(arrays) for name, arrays in found.items()} | {"first": first}


def _digest(arrays) -> str:
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array, np.float64).tobytes())
    return found.hexdigest()[:16]


def stored() -> dict[str, Any]:
    """Return the file's content: `arithmetic`, and `cases` by name."""
    return json.loads(FILE.read_text())


def main() -> None:
    """Print what differs, and store the present digests where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="beginnings of names of cases; all where none is given")
    parser.add_argument("--accept", action="store_true", help="store the present digests")
    given = parser.parse_args()
    before = stored() if FILE.exists() else {"arithmetic": arithmetic(), "cases": {}}
    if before["arithmetic"] != arithmetic():
        print("this machine's arithmetic is another than the file's")
    now = {name: case for name, case in cases().items() if name.startswith(tuple(given.names) or "")}
    now = {name: digested(case) for name, case in tqdm(now.items(), disable=None)}
    is_equal = True
    for name, found in now.items():
        old = before["cases"].get(name, {})
        if changed := [key for key in found if found[key] != old.get(key)]:
            is_equal = False
            print(f"{name}: {', '.join(changed)}")
    if given.accept:
        kept = before["cases"] if given.names else {}
        content = {"arithmetic": arithmetic(), "cases": dict(sorted({**kept, **now}.items()))}
        lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(found)}" for name, found in content["cases"].items())
        FILE.write_text(f'{{"arithmetic": "{content["arithmetic"]}", "cases": {{\n{lines}\n}}}}\n')
    elif not is_equal:
        sys.exit(1)


if __name__ == "__main__":
    main()
