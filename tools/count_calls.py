"""Counts the Python calls inside the package that a step of a dm_env makes: of functions, comprehensions, generators.

Unlike a time, the number is the same on every machine.

Example:
  python tools/count_calls.py
"""

import collections
import pathlib
import sys

import numpy as np
from absl import flags

import arc_suite
from arc_suite.cli import program

_PACKAGE = str(pathlib.Path(arc_suite.__file__).parent)
_STEPS, _WARM = 100, 5  # control steps that are counted, after some that are not

_BY_FUNCTION = flags.DEFINE_bool("by_function", False, "List the functions.")


def counted(task: str, robot: str = "queen") -> collections.Counter:
    """Return the calls of each function, by file and name, in `_STEPS` control steps of random actions."""
    environment, random = arc_suite.load(robot, task, {"random": 0}), np.random.RandomState(0)
    environment.reset()
    actions = random.uniform(-0.2, 0.2, (_WARM + _STEPS, *environment.action_spec().shape))
    calls: collections.Counter = collections.Counter()

    def count(frame, event, argument):
        if event == "call" and frame.f_code.co_filename.startswith(_PACKAGE):
            calls[f"{frame.f_code.co_filename.removeprefix(_PACKAGE)}: {frame.f_code.co_qualname}"] += 1

    for step, action in enumerate(actions):
        sys.setprofile(count if step >= _WARM else None)
        try:
            timestep = environment.step(action)
        finally:
            sys.setprofile(None)
        if timestep.last():
            raise RuntimeError(f"{task}: the episode ended in step {step}")
    return calls


def main() -> None:
    """Print the calls of a step of a plain task and of one with everything."""
    for task in ("walk", "roam"):
        calls = counted(task)
        print(f"{task}: {calls.total() / _STEPS:g} calls a step")
        for name, count in calls.most_common() if _BY_FUNCTION.value else ():
            print(f"  {count / _STEPS:g} {name}")


if __name__ == "__main__":
    program.run(main)
