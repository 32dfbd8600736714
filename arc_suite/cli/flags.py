"""Flags that several programs have: body, task and its settings."""

import contextlib
import json
import os
import re
import shlex
import warnings
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from absl import flags

from arc_suite import checks, policies, registry
from arc_suite.arenas import ARENAS
from arc_suite.bodies import generator, shaping
from arc_suite.cli import flag_mistakes
from arc_suite.cpg.selection import check_preset_name
from arc_suite.envs.setup import Setup
from arc_suite.models.soundness import flaws
from arc_suite.policies import other_libraries, zips
from arc_suite.robots import ROBOTS, palettes, spec_files
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS

FLAGS = flags.FLAGS

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")

_NAME_AND_VALUE = re.compile(r"(\w+)(?:\s*:\s*|\s+)([^\s=].*)")  # with a colon or a space in place of =

_SEVERAL_SETTINGS = re.compile(r"\w+=[^,]*(?:, *[a-z_]+=[^,]*)+")  # such as "mass=1.2,friction=0.5"

MAX_COUNT = 100_000  # episodes, or bodies: more than anyone waits for
NAMING_FLAGS = "--robot, --task or --set"  # flags whose values may be `module:name`, which they import
DEFAULT_LINKS = 3  # of each leg of a body made to order
ROBOT_HELP = (
    f"{', '.join(registry.robot_words())}; a file in JSON, MJCF or URDF; module:name of one that another package has"
)


def define_body(robot: str | None = "queen", more: str = "") -> None:
    """Define --robot, --spec, --legs, --links, --length and --palette, for programs that take any body.

    Args:
        robot: default of --robot.
        more: text at the end of the help of --robot.
    """
    flags.DEFINE_string("robot", robot, f"{ROBOT_HELP}{more}.")
    examples = ", ".join(spec_files.EXAMPLES)
    flags.DEFINE_string(
        "spec", None, f"A body in place of a robot: a file in JSON, MJCF or URDF, or one of {examples}."
    )
    flags.DEFINE_integer("legs", None, "A body with this number of legs, in place of a robot.", *generator.LEG_RANGE)
    flags.DEFINE_integer(
        "links",
        None,
        f"Actuated links of each leg of a body made to order. [default: {DEFAULT_LINKS}]",
        *generator.LINK_RANGE,
    )
    flags.DEFINE_multi_string(
        "length",
        [],
        "Factor on the length of a link: --length lower=1.5, of the leg l1 --length l1_lower=1.5.",
    )
    flags.DEFINE_string("palette", None, f"Colors of the body: {palettes.HELP}.")


def define_arena() -> None:
    """Define --arena, for programs that take any ground."""
    flags.DEFINE_string(
        "arena",
        None,
        f"Ground in place of level floor: {', '.join(ARENAS)}; a height map such as ground.png:20x20x1.5, with its "
        "length, width and height, m; a mesh .obj or .stl, in m or with a factor, ground.stl:0.001; a scene .xml.",
    )


def define_task(default: str = "walk") -> None:
    """Define --task, --set and --arena, for programs that take any task."""
    define_arena()
    flags.DEFINE_string("task", default, f"Task: {', '.join(TASKS)}, or module:name of one that another package has.")
    flags.DEFINE_multi_string(
        "set",
        [],
        "Setting of the task, name=value. Values are JSON where they parse, else text: "
        "--set target_velocity=0.8 --set gait=ripple --set weights='{\"posture\": -0.01}'.",
    )


def define_modules(what: str) -> None:
    """Define --modules, for programs that read names of other packages' parts in files.

    Args:
        what: the file, which ends the help's first sentence.
    """
    flags.DEFINE_list(
        "modules", [], f"Modules, with commas between them, that register what {what} names: files import nothing."
    )


def import_modules() -> None:
    """Import the modules of --modules.

    Raises:
        ValueError: one cannot be imported.
    """
    for module in FLAGS.modules:
        registry.import_module(module, "--modules")


@contextlib.contextmanager
def hint_import(flag: str) -> Iterator[None]:
    """Add to the error of a module that a file names, and that is not imported, which flag imports it."""
    try:
        yield
    except registry.NotImported as error:
        raise ValueError(f"{error}, by {flag}") from None


def define_policy(text: str = policies.HELP) -> None:
    """Define --policy, with this help, and --vecnormalize, for programs that take any policy."""
    flags.DEFINE_string("policy", "cpg", text)
    define_vecnormalize()


def define_preset() -> None:
    """Define --preset, for programs that take the demonstrator."""
    flags.DEFINE_string("preset", None, f"{policies.PRESET_HELP} [default: the one that suits the task and the body]")


def define_vecnormalize() -> None:
    """Define --vecnormalize, for programs that take a zip of stable-baselines3."""
    flags.DEFINE_string(
        "vecnormalize",
        None,
        "Statistics that VecNormalize.save wrote, for a zip of stable-baselines3; their pickles run code. "
        "[default: ZIP_vecnormalize.pkl or vecnormalize.pkl next to a zip that was trained with VecNormalize]",
    )


def preset_from_flags() -> str | None:
    """Return the preset of --preset; None without the flag.

    Raises:
        ValueError: --policy is not the demonstrator, or no preset has this name.
    """
    policies.check_preset(FLAGS.policy, FLAGS.preset)
    return FLAGS.preset


def check_policy(policy: str, preset: str | None, body: Body) -> None:
    """Raise an error now for a policy that cannot be read or does not fit a body, or for an unknown preset.

    Raises:
        ValueError: as `policies.policy`.
        OSError: as `policies.policy`.
    """
    if preset is not None:
        check_preset_name(preset)
    if policy != "cpg":  # which takes seconds, and can be made for any body
        policies.policy(policy, body)


def policy_name(name: str) -> str:
    """Return the name of a policy with the statistics of --vecnormalize, if there are any.

    Raises:
        ValueError: an algorithm in place of a policy, or --vecnormalize without a zip.
    """
    is_word = name.isidentifier() and name not in policies.POLICIES and not os.path.exists(name)
    if is_word and name in flag_mistakes.algorithm_names():
        cure = f"arc-suite train --algorithm={name} learns a policy, whose name is the folder of the run"
        raise ValueError(f"policy {name!r}: it is an algorithm; {cure}")
    if FLAGS.vecnormalize is None:
        return name
    policy_file = other_libraries.find(name)
    if policy_file is None or policy_file.extension != zips.EXTENSION:
        flag = f"--vecnormalize={checks.quote(FLAGS.vecnormalize)}"
        raise ValueError(f"{flag}: goes with a zip of stable-baselines3, got {checks.preview(name)}")
    return other_libraries.with_further_file(name, FLAGS.vecnormalize)


def custom_body() -> Body | None:
    """Return the body of --spec or --legs, as --length and --palette change it; None without these flags.

    Raises:
        ValueError: both are given, or --links without --legs, or --length or --palette where no flag names a body, or
            no body in the file.
        OSError: the file cannot be read.
    """
    if FLAGS.spec is not None and FLAGS.legs is not None:
        raise ValueError("expected one of --spec and --legs, got both")
    if FLAGS.links is not None and FLAGS.legs is None:
        raise ValueError(f"--links={FLAGS.links}: goes with --legs")
    if FLAGS.spec is None and FLAGS.legs is None:
        if not FLAGS["robot"].present:
            refuse_flags(("length", "palette"), "goes with --robot, --spec or --legs")
        return None
    if FLAGS.spec is not None:
        return adjust_body(registry.body_of(FLAGS.spec))
    return adjust_body(generator.generate(FLAGS.legs, DEFAULT_LINKS if FLAGS.links is None else FLAGS.links))


def adjust_body(body: Body) -> Body:
    """Return a body with the lengths of --length and the colors of --palette.

    Raises:
        ValueError: an unknown link, or a value that does not fit.
    """
    if FLAGS.length:
        body = shaping.shaped(body, links=named_values("length", FLAGS.length))
    if FLAGS.palette is not None:
        body = body.replace(palette=palettes.parse(FLAGS.palette))
    return body


def define_walk(robot: str = "queen", more: str = "", task: str = "walk", policy: str = policies.HELP) -> None:
    """Define the flags of a program in which a policy walks bodies: of bodies, task, policy and preset.

    Args:
        robot: default of --robot.
        more: text at the end of the help of --robot.
        task: default of --task.
        policy: help of --policy.
    """
    define_body(robot, more)
    define_task(task)
    define_policy(policy)
    define_preset()


def bodies_from_flags(suggestions: Iterable[str] = ("all",)) -> dict[str, Body]:
    """Return bodies by name: the body of `custom_body`, or those that --robot names, which may be "all".

    For names see `registry.bodies_of`. --length and --palette change each body. Warnings name the flaws of a body of
    --spec or --length, such as feet in the floor, as `arc-suite check` does.

    Args:
        suggestions: other values of --robot that an unknown robot may mean.

    Raises:
        ValueError: as `custom_body`, or an unknown robot, or both a robot and a custom body.
        OSError: as `custom_body`.
    """
    body = custom_body()
    if body is not None:
        if FLAGS["robot"].present:
            raise ValueError(f"--robot={checks.quote(FLAGS.robot)}: expected no robot with --spec or --legs")
        bodies = (body,)
    elif FLAGS.robot == "all":
        bodies = tuple(adjust_body(robot) for robot in ROBOTS.values())
    else:
        bodies = tuple(adjust_body(robot) for robot in registry.bodies_of(FLAGS.robot, suggestions))
    if FLAGS.spec is not None or FLAGS.length:
        _warn_of_flaws(bodies)
    bodies_by_name = {registry.distinct_name(body): body for body in bodies}
    if len(bodies_by_name) < len(bodies):
        raise ValueError(f"--robot={checks.quote(FLAGS.robot)}: expected a name for each body, got two of one name")
    return bodies_by_name


def _warn_of_flaws(bodies: Iterable[Body]) -> None:
    """Warn of the flaws of bodies that users made."""
    for body in bodies:
        for flaw in flaws(body):
            warnings.warn(f"{checks.quote(FLAGS.spec or body.name)}: {flaw.text}", stacklevel=3)


def only_body() -> Body:
    """Return the body of a program that takes one body; see `bodies_from_flags`.

    Raises:
        ValueError: as `bodies_from_flags`, or several bodies.
        OSError: as `bodies_from_flags`.
    """
    return _only(bodies_from_flags(suggestions=()))


def _only(values_by_name: dict[str, Any]) -> Any:
    """Return the value of the only body.

    Raises:
        ValueError: several bodies.
    """
    if len(values_by_name) > 1:
        raise ValueError(f"--robot={checks.quote(FLAGS.robot)}: expected one robot")
    (value,) = values_by_name.values()
    return value


def setups_from_flags(stored: Setup | None = None, suggestions: Iterable[str] = ("all",)) -> dict[str, Setup]:
    """Return the setups that --robot, --spec, --legs, --task and --set ask for, by name of the body.

    Where the flags leave something open, it comes from the setup in which a policy was trained, or tracks were stored:
    the body; without --task also the task and its settings, which --set changes. A curriculum is left out, as it serves
    training only. A line says in which setup a policy was trained.

    Args:
        stored: the setup of tracks; None for the setup of --policy.
        suggestions: see `bodies_from_flags`.

    Raises:
        ValueError: as `bodies_from_flags`, `task_from_flags` and `policies.setup_of`.
        OSError: as `bodies_from_flags` and `policies.setup_of`.
    """
    # First: these import the modules that flags name.
    bodies = bodies_from_flags(suggestions)
    task, settings = task_from_flags()
    trained = policy_setup() if stored is None else None
    origin = trained if stored is None else stored  # of what the flags leave open
    bodies = choose_bodies(origin, bodies)
    task, settings = complete_task(origin, task, settings)
    setups = {name: Setup.of(body, task, settings) for name, body in bodies.items()}
    if trained is not None:
        _print_training_setup(trained, setups)
    return setups


def _print_training_setup(trained: Setup, setups: Mapping[str, Setup]) -> None:
    """Print in which setup a policy was trained, and in which others it plays; nothing if no body suits it."""
    suitable_setups = [setup for setup in setups.values() if trained.several or setup.body.moves_like(trained.body)]
    if not suitable_setups:
        return
    line = f"{FLAGS.policy}: trained on {trained}"
    for setup in suitable_setups:
        if (setup.task, setup.task_kwargs) != (trained.task, trained.task_kwargs):
            line += f"; plays in {setup}"
    print(line)


def policy_setup(policy: str | None = None, importing_flags: str = NAMING_FLAGS) -> Setup | None:
    """Return the setup that judges a policy, see `Setup.judging`; None for a policy that is no file.

    Args:
        policy: policy of a program without --policy; None for the policy of --policy.
        importing_flags: flags that import modules which the policy's file names, for errors.

    Raises:
        ValueError: as `policies.setup_of`.
        OSError: as `policies.setup_of`.
    """
    name = policy_name(FLAGS.policy if policy is None else policy)
    with hint_import(importing_flags):
        training_setup = policies.setup_of(name)
    if training_setup is None:
        return None
    return training_setup.judging()


def choose_bodies(origin: Setup | None, bodies: dict[str, Body]) -> dict[str, Body]:
    """Return the bodies of flags, or that of a policy or of tracks where no flag names a body.

    Args:
        origin: the setup of a policy or of tracks, of one body or of several; None without one.
        bodies: result of `bodies_from_flags`.
    """
    if origin is None or origin.several or FLAGS["robot"].present or custom_body():
        return bodies
    return {origin.name: origin.body}


def complete_task(origin: Setup | None, task: str, settings: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the task and the settings of flags; without --task those of a policy or of tracks, which --set changes.

    Of several tasks of a policy, it is the first.

    Args:
        origin: the setup of a policy or of tracks; None without one.
        task: task of `task_from_flags`.
        settings: settings of `task_from_flags`.
    """
    if origin is None or FLAGS["task"].present:
        return task, settings
    return origin.tasks[0], origin.task_kwargs | settings


def only_setup() -> Setup:
    """Return the setup of a program that takes one body; see `setups_from_flags`.

    Raises:
        ValueError: as `setups_from_flags`, or several bodies.
        OSError: as `setups_from_flags`.
    """
    return _only(setups_from_flags(suggestions=()))


def task_from_flags() -> tuple[str, dict[str, Any]]:
    """Return the name of the task and its settings, `task_kwargs` of `arc_suite.load`.

    The modules that the flags name are imported. Whether the task has these settings is checked where an environment is
    opened.

    Raises:
        ValueError: an unknown task, a setting without a value, or a seed as a setting.
    """
    registry.tasks_of(FLAGS.task)
    settings = named_values("set", FLAGS["set"].value)
    for name in ("random", "seed"):
        if name in settings:
            raise ValueError(
                f"--set {name}={checks.quote(settings[name])}: programs seed every episode; "
                "see --help for the flag of the first seed"
            )
    if FLAGS.arena is not None:
        if "arena" in settings:
            raise ValueError("expected one of --arena and --set arena, got both")
        settings["arena"] = FLAGS.arena
    if "arena" in settings:
        registry.arena_maker(settings["arena"])
    return FLAGS.task, settings


def refuse_flags(names: Iterable[str], reason: str) -> None:
    """Raise ValueError for those of these flags that the command line has: they would have no effect.

    Args:
        names: names of flags.
        reason: what the flags go with, or what there is in place of them.
    """
    idle_flags = [f"--{name}" for name in names if FLAGS[name].present]
    if idle_flags:
        raise ValueError(f"{', '.join(idle_flags)}: {reason}")


def check_flags_suit_file(extension: str, extensions_of_flags: Mapping[str, Iterable[str]]) -> None:
    """Check that all flags of the command line suit the file to write.

    Args:
        extension: extension of the file to write.
        extensions_of_flags: by flag, the extensions of the files that have the option.

    Raises:
        ValueError: a flag is for other files.
    """
    for flag, extensions in extensions_of_flags.items():
        if FLAGS[flag].present and extension not in extensions:
            raise ValueError(f"--{flag}: it is for {', '.join(extensions)}, not for {extension}")


def named_values(flag: str, texts: Iterable[str]) -> dict[str, Any]:
    """Return the values of a flag that is repeated with texts name=value, by name.

    Args:
        flag: its name, for errors.
        texts: texts of the command line; values are JSON where they parse, or numbers with commas between, else text.

    Raises:
        ValueError: a text without a name or without =, or a name twice.
    """
    values: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise ValueError(f"--{flag} {checks.quote(text)}: expected name=value{_suggest_assignment(flag, text)}")
        _refuse_flag_as_name(flag, name, value)
        mapping, dot, key = name.partition(".")
        if dot and "." not in key and ":" not in name:
            cure = checks.quote(f'{mapping}={{"{key}": {value}}}')
            raise ValueError(f"--{flag} {checks.quote(text)}: expected a name without a dot; did you mean '{cure}'?")
        if name in values:
            raise ValueError(f"--{flag} {checks.quote(text)}: {checks.quote(name)} has a value already")
        parsed_value = _parse_value(value)
        if isinstance(parsed_value, str) and _SEVERAL_SETTINGS.fullmatch(text):
            cure = " ".join(f"--{flag} {part.strip()}" for part in text.split(","))
            raise ValueError(
                f"--{flag} {checks.quote(text)}: expected one name=value; did you mean {checks.quote(cure)}?"
            )
        values[name] = parsed_value
    return values


def _suggest_assignment(flag: str, text: str) -> str:
    """Return the part of an error that suggests name=value for "name: value", "name value" and JSON; else ""."""
    match = _NAME_AND_VALUE.fullmatch(text)
    if match is not None:
        return f"; did you mean {checks.quote(f'{match[1]}={match[2]}')}?"
    with contextlib.suppress(ValueError, AttributeError):  # no JSON, or no object of it
        settings = [shlex.quote(f"{name}={json.dumps(value)}") for name, value in json.loads(text).items()]
        return f"; did you mean {checks.quote(' '.join(f'--{flag} {setting}' for setting in settings))}?"
    return ""


def _refuse_flag_as_name(flag: str, name: str, value: str) -> None:
    """Raise ValueError for a flag of the program that stands as a name in another flag, such as --set steps=100."""
    is_flag = len(name) > 1 and name in FLAGS and "absl" not in FLAGS.find_module_defining_flag(name).split(".")
    is_name = name in registry.setting_names() or (flag == "hp" and name in flag_mistakes.hyperparameter_words())
    if is_flag and not is_name and name != "seed":
        raise ValueError(
            f"--{flag} {checks.quote(f'{name}={value}')}: it is a flag; did you mean --{name}={checks.quote(value)}?"
        )


def _parse_value(text: str) -> Any:
    """Return the JSON value of a text, the numbers of a text such as "0.5,1.2", or else the text."""
    with contextlib.suppress(ValueError):
        return json.loads(text)
    with contextlib.suppress(ValueError):
        numbers = [_parse_number(part) for part in text.split(",")]
        return numbers if "," in text else numbers[0]
    return text


def _parse_number(text: str) -> float:
    """Return the number of a text; .5 and 2. are numbers, too."""
    if _NUMBER.fullmatch(text.strip()) is None:
        raise ValueError(f"expected a number, got {text!r}")
    return checks.number("", float(text))
