"""Gives settings absurd values: each is refused in a line, or has an effect; `make check-absurd`, minutes.

A case is a task, a body, one of the settings that the task or a modifier has, and a value: of a wrong type, not finite,
huge, tiny, negative, empty, nested, thousands of digits long, of NumPy. What is taken must change an episode: an
observation, a reward, the end, or the model. Only the default itself, in whatever form, changes nothing.

A line of standard error names each fault with its case; `--case` repeats one. Exit status 1 if there is any fault.
"""

import argparse
import datetime
import decimal
import faulthandler
import fractions
import functools
import math
import pathlib
import signal
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np
from dm_control.rl.control import PhysicsError
from tqdm import tqdm

import arc_suite
from arc_suite import checks
from arc_suite.registry import SETTINGS_OF_EVERY_TASK
from arc_suite.tasks import TASKS, parameters
from arc_suite.tasks.modifiers import MODIFIERS

BODIES = ("tick", "leaper")
SEEDS = (5, 6, 7)  # of episodes; what has no effect under the first may draw by chance what the default draws
STEPS = 40  # control steps of the first episode; in the middle the body is thrown up, so that it falls
LONG = 400  # control steps of the second episode, in which motors fail and kicks come
LIMIT = 20  # s of CPU time, for one case
MAX_LINE = 1500  # characters of an error
CLOSE = 1e-6  # relative difference up to which a number is the default

REFUSED, EFFECT, DEFAULT, IDLE, NAMELESS, TRACEBACK = OUTCOMES = (
    *("refused", "effect", "default", "idle", "nameless", "traceback"),
)
FAULTS = (IDLE, NAMELESS, TRACEBACK)

# Settings without which a task refuses another one. Both episodes have them.
COMPANIONS: dict[str, dict[str, Any]] = {"level": {"curriculum": True}, "gains": {"actions": "position"}}
WIDER = {"commands": {"forward": (-1.5, 1.5)}}  # what a curriculum of commands needs
# Words by which errors name a setting, where it is not the setting's own name.
WORDS = {"random": "seed"}

_DIGITS = 4300  # Python refuses to convert longer texts to integers and back


def nest(levels: int) -> Any:
    """Return a number inside of many lists."""
    value: Any = 0
    for _ in range(levels):
        value = [value]
    return value


ABSURD = (
    *(
        None,
        True,
        False,
        np.True_,
        np.False_,
        0,
        -0.0,
        1,
        -1,
        1.0,
        2,
        3,
        0.5,
        2**31,
        -(2**63),
        2**70,
        10**400,
        10**5000,
    ),
    *(
        1e308,
        -1e308,
        5e-324,
        1e-300,
        math.nan,
        math.inf,
        -math.inf,
        1j,
        decimal.Decimal("0.5"),
        fractions.Fraction(1, 2),
    ),
    *("", " ", "queen", "walk", "1", "0.5", "nan", "None", "true", "\0", "a\nb", "ä" * 40, "x" * 10**5, "9" * _DIGITS),
    *(
        "9" * (_DIGITS + 1),
        "os:system",
        "../..",
        "-1",
        "tripod",
        "flat",
        "torque",
        "standing",
        "raise",
        b"1",
        bytearray(3),
    ),
    *(
        (),
        (1,),
        (1, 2),
        (2, 1),
        (1, 2, 3),
        (math.nan, 1),
        (-math.inf, math.inf),
        (True, False),
        (None, None),
        ("1", "2"),
    ),
    *(
        [],
        [[]],
        [None],
        [0.5, 0.7],
        ["posture"],
        ["posture", "posture"],
        [1] * 10**5,
        nest(3),
        nest(5000),
        [math.nan] * 18,
    ),
    *({}, {"": {}}, {1: 2}, {"forward": math.nan}, {"forward": 1}, {"forward": [2, 1]}, {"posture": 1e9}, {None: None}),
    *({"control": True}, {"control": 10**400}, {"control": [1]}, {"healthy": "1"}, set(), {1}, frozenset({"posture"})),
    *(range(3), object(), object, len, Ellipsis, slice(1), datetime.date(2000, 1, 1), pathlib.Path("queen"), iter([1])),
    *(np.array([]), np.array(0.5), np.array([1, 2]), np.array([1.0, np.nan]), np.zeros((2, 2)), np.array(["a"])),
    *(np.array([None]), np.array([1], object), np.array(True), np.zeros(10**5), np.ma.masked, np.datetime64("nat")),
    *(np.float32("nan"), np.float16(65504), np.int8(-128), np.uint64(2**64 - 1), np.longdouble(1), np.str_("walk")),
)


class Case(NamedTuple):
    """One absurd value.

    Attributes:
        body: name of the robot.
        task: name of the task.
        setting: name of the setting.
        value: absurd value.
    """

    body: str
    task: str
    setting: str
    value: Any


class Trace(NamedTuple):
    """What may show the effect of a setting.

    Attributes:
        model: bytes of the compiled model and the arena.
        step_limit: control steps of an episode.
        steps: yields the observation, reward and end of each step.
    """

    model: bytes
    step_limit: float
    steps: Iterator[tuple]


def names_of_settings(task: str) -> tuple[str, ...]:
    """Return the names of all settings that a task takes."""
    return (*SETTINGS_OF_EVERY_TASK, *TASKS[task].names(), *MODIFIERS)


def draw_case(seed: int, index: int) -> Case:
    """Return the case of an index: tasks and settings take turns, so that all are tried."""
    random = np.random.default_rng((seed, index))
    places = [(task, name) for task in TASKS for name in names_of_settings(task)]
    task, setting = places[index % len(places)]
    return Case(BODIES[random.integers(len(BODIES))], task, setting, draw_value(random))


def draw_value(random: np.random.Generator) -> Any:
    """Return a value of `ABSURD`, or a random number, text, array or collection."""
    match random.integers(8):
        case 0:
            return draw_number(random)
        case 1:
            scalar_types = (np.float16, np.float32, np.float64, np.int8, np.int64, np.uint8, np.bool_)
            with np.errstate(all="ignore"):
                return scalar_types[random.integers(len(scalar_types))](
                    random.normal() * 10.0 ** random.integers(-3, 4)
                )
        case 2:
            shape = tuple(random.integers(0, 4, random.integers(4)))
            return random.normal(size=shape) * 10.0 ** random.integers(-3, 300)
        case 3:
            return "".join(map(str, random.integers(0, 10, random.integers(1, _DIGITS + 2))))
        case 4:
            numbers = [draw_number(random) for _ in range(random.integers(5))]
            return tuple(numbers) if random.integers(2) else numbers
        case 5:
            keys = ("forward", "left", "turning", "control", "healthy", "posture", "command", "scan", "")
            return {keys[key]: draw_number(random) for key in random.integers(0, len(keys), random.integers(1, 4))}
        case _:
            return ABSURD[random.integers(len(ABSURD))]


def draw_number(random: np.random.Generator) -> float | int:
    """Return a number of any size and sign: half of them integers, some of them small."""
    size = 10.0 ** random.uniform(-2.0, 2.0) if random.integers(2) else 10.0 ** random.uniform(-320.0, 308.0)
    number = float(random.choice([-1.0, 1.0]) * size)
    return int(number) if random.integers(2) else number


def companions(task: str, setting: str) -> dict[str, Any]:
    """Return the settings without which a task refuses another one."""
    is_level = not TASKS[task].own_arena and task != "walk"
    wider = WIDER if is_level and setting in ("curriculum", "level") else {}
    return {**COMPANIONS.get(setting, {}), **wider}


def trace(body: str, task: str, settings: Mapping[str, Any], plants_divergence: bool, seed: int) -> Trace:
    """Open an environment with settings, and return what may show their effect.

    Args:
        body: name of the robot.
        task: name of the task.
        settings: settings of the task.
        plants_divergence: whether the simulation is to diverge in the episode.
        seed: seed of the episodes.
    """
    environment = arc_suite.load(body, task, {"random": seed, **settings}, {"flat_observation": True})
    model = environment.physics.model.ptr
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    steps = play(environment, plants_divergence)
    return Trace(buffer.tobytes(), environment.task.definition.step_limit, steps)


def play(environment, plants_divergence: bool) -> Iterator[tuple]:
    """Yield what each step shows of two episodes: a fall from above, then standing for long."""
    shape = environment.action_spec().shape
    random = np.random.default_rng(0)
    timestep = environment.reset()
    yield (timestep.observation["observations"],)
    for step in range(STEPS):
        if timestep.last():
            break
        if step == STEPS // 4 and plants_divergence:
            environment.physics.data.qpos[0] = np.nan
        if step == STEPS // 2:
            environment.physics.data.qpos[2] *= 5.0
        try:
            timestep = environment.step(random.uniform(-0.6, 0.6, shape))
        except PhysicsError:
            yield ("diverged",)
            return
        yield timestep.observation["observations"], timestep.reward, timestep.discount
    timestep = environment.reset(SEEDS[0])  # a stream of its own: settings may change what the first leaves of another
    for _ in range(LONG):
        if timestep.last():
            return
        timestep = environment.step(random.uniform(-0.1, 0.1, shape))
        yield timestep.observation["observations"], timestep.reward, timestep.discount


@functools.cache
def default_trace(body: str, task: str, setting: str, seed: int) -> tuple[bytes, float, list[tuple]]:
    """Return the model, the step limit and all steps without a setting."""
    model, step_limit, steps = trace(body, task, companions(task, setting), setting == "on_divergence", seed)
    return model, step_limit, list(steps)


def has_effect(case: Case, seed: int) -> bool:
    """Return whether episodes of a seed differ from those of the default.

    Raises:
        Exception: whatever refuses the value.
    """
    settings = {**companions(case.task, case.setting), case.setting: case.value}
    changed = trace(case.body, case.task, settings, case.setting == "on_divergence", seed)
    model, step_limit, steps = default_trace(case.body, case.task, case.setting, seed)
    if changed.model != model or changed.step_limit != step_limit:
        return True
    count = 0
    for default_step, changed_step in zip(steps, changed.steps, strict=False):
        if not all(map(np.array_equal, default_step, changed_step)):
            return True
        count += 1
    return count < len(steps) or next(changed.steps, None) is not None


@functools.cache
def default_values(body: str, task: str) -> dict[str, Any]:
    """Return the default of each setting by name; settings that are no numbers have none or an empty one."""
    defaults = {"random": SEEDS[0], "arena": "flat", "on_divergence": "raise", "time_limit": None}
    for name, modifier in MODIFIERS.items():
        defaults[name] = modifier.defaults[name]
    defaults |= dict(flatten(arc_suite.load(body, task).task.definition.settings))
    for shared_name, names in parameters.SHARED_NOISE.items():
        values = {defaults.get(name) for name in names}  # None in a task without this noise
        if len(values) == 1:
            (defaults[shared_name],) = values
    return defaults


def flatten(settings) -> Iterator[tuple[str, Any]]:
    """Yield the fields of settings, and of the values in them, by name."""
    fields = settings._asdict() if hasattr(settings, "_asdict") else getattr(settings, "__dict__", {})
    for name, value in fields.items():
        yield name, value
        yield from flatten(value)


def is_default(case: Case) -> bool:
    """Return whether a value is the default in some form: None, empty, or equal numbers."""
    default = default_values(case.body, case.task).get(case.setting)
    if case.value is None or (isinstance(case.value, Mapping | list | tuple) and not case.value):
        return True
    if isinstance(case.value, str) or isinstance(default, str):
        return case.value == default
    if isinstance(case.value, Mapping):
        defaults = default if isinstance(default, Mapping) else dict.fromkeys(case.value, 0.0)
        return all(is_close(value, defaults.get(name, 0.0)) for name, value in case.value.items())
    is_empty = default is None or (isinstance(default, Mapping | tuple) and not default)
    return is_close(case.value, 0.0 if is_empty else default)


def is_close(value: Any, default: Any) -> bool:
    """Return whether all numbers of a value are those of a default, but for rounding."""
    try:
        return bool(np.allclose(np.asarray(value, float), np.asarray(default, float), rtol=CLOSE, atol=CLOSE))
    except (TypeError, ValueError, OverflowError):
        return False


def outcome(case: Case) -> str:
    """Return what comes of a value, one of `OUTCOMES`."""
    try:
        if any(has_effect(case, seed) for seed in SEEDS):
            return EFFECT
    except (ValueError, TypeError, OSError) as error:
        return judge_line(case, error)
    except Exception:
        traceback.print_exc()
        return TRACEBACK
    return DEFAULT if is_default(case) else IDLE


def judge_line(case: Case, error: Exception) -> str:
    """Return whether an error is a line of the suite with the name of the setting."""
    line = str(error)
    if "\n" in line or not 0 < len(line) < MAX_LINE:
        traceback.print_exc()
        return TRACEBACK
    if case.setting in line or WORDS.get(case.setting, case.setting) in line:
        return REFUSED
    print(line, file=sys.stderr)
    return NAMELESS


def raise_timeout(*_) -> None:
    """Raise TimeoutError, as the handler of a signal."""
    raise TimeoutError(f"expected an end within {LIMIT} s of CPU time")


def main() -> int:
    """Print the table and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=10_000, help="values to try")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", type=int, help="try this one alone")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGPROF, raise_timeout)
    indices = range(arguments.cases) if arguments.case is None else [arguments.case]
    outcomes: Counter = Counter()
    for index in tqdm(indices, unit="value", leave=False, disable=None):
        case = draw_case(arguments.seed, index)
        signal.setitimer(signal.ITIMER_PROF, LIMIT)
        faulthandler.dump_traceback_later(20 * LIMIT, exit=True)  # a library that does not come back
        result = outcome(case)
        signal.setitimer(signal.ITIMER_PROF, 0)
        faulthandler.cancel_dump_traceback_later()
        outcomes[result] += 1
        if result in FAULTS:
            text = f"{result}: {case.task} of {case.body}, {case.setting}={checks.preview(case.value)[:200]}"
            print(f"{text}: --seed {arguments.seed} --case {index}", file=sys.stderr, flush=True)
    print("".join(f"{name:>11}" for name in OUTCOMES))
    print("".join(f"{outcomes[name]:>11}" for name in OUTCOMES))
    return int(any(outcomes[name] for name in FAULTS))


if __name__ == "__main__":
    sys.exit(main())
