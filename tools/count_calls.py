"""Counts the Python calls inside the package that a step of a dm_env makes: of functions, comprehensions, generators.

Unlike a time, the number is the same on every machine.

Examples:
  python tools/count_calls.py
  python tools/count_calls.py --open varied:7
"""

import collections
import contextlib
import pathlib
import sys
from collections.abc import Iterator

import numpy as np
from absl import flags

import arc_suite
from arc_suite.cli import program

_PACKAGE = str(pathlib.Path(arc_suite.__file__).parent)
STEPS = 100  # control steps that are counted
_WARM_UP_STEPS = 5  # control steps before them

_BY_FUNCTION = flags.DEFINE_bool("by_function", False, "List the functions.")
_OPEN = flags.DEFINE_string("open", None, "Robot whose walk is opened, in place of steps: a name, or family:seed.")


@contextlib.contextmanager
def counting(calls: collections.Counter) -> Iterator[None]:
    """Add the calls of each function inside the package, by file and name."""

    def count(frame, event, argument):
        if event == "call" and frame.f_code.co_filename.startswith(_PACKAGE):
            calls[f"{frame.f_code.co_filename.removeprefix(_PACKAGE)}: {frame.f_code.co_qualname}"] += 1

    sys.setprofile(count)
    try:
        yield
    finally:
        sys.setprofile(None)


def calls_of_opening(robot: str) -> collections.Counter:
    """Return the calls that open a robot's walk; those of a body that was opened before are fewer."""
    calls: collections.Counter = collections.Counter()
    with counting(calls):
        arc_suite.load(robot, "walk")
    return calls


def calls_of_steps(task: str, robot: str = "queen") -> collections.Counter:
    """Return the calls of `STEPS` control steps of random actions."""
    environment = arc_suite.load(robot, task, {"random": 0})
    random = np.random.RandomState(0)
    environment.reset()
    actions = random.uniform(-0.2, 0.2, (_WARM_UP_STEPS + STEPS, *environment.action_spec().shape))
    calls: collections.Counter = collections.Counter()
    for step, action in enumerate(actions):
        is_counted = step >= _WARM_UP_STEPS
        with counting(calls) if is_counted else contextlib.nullcontext():
            timestep = environment.step(action)
        if timestep.last():
            raise RuntimeError(f"{task}: the episode ended in step {step}")
    return calls


def main() -> None:
    """Print the calls of opening a robot, or of a step of a plain task and of one with all parts."""
    if _OPEN.value:
        calls = calls_of_opening(_OPEN.value)
        print(f"{_OPEN.value}: {calls.total()} calls to open it")
        _print_functions(calls, 1)
        return
    for task in ("walk", "roam"):
        calls = calls_of_steps(task)
        print(f"{task}: {calls.total() / STEPS:g} calls a step")
        _print_functions(calls, STEPS)


def _print_functions(calls: collections.Counter, times: int) -> None:
    for name, count in calls.most_common() if _BY_FUNCTION.value else ():
        print(f"  {count / times:g} {name}")


if __name__ == "__main__":
    program.run(main)
