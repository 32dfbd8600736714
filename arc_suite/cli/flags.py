"""Flags that several programs have: body, task and its settings."""

import json
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

from absl import flags

from arc_suite import checks, policies, registry
from arc_suite.bodies import generator, shaping
from arc_suite.envs.setup import Setup
from arc_suite.models.soundness import flaws
from arc_suite.policies import other_libraries, zips
from arc_suite.robots import ROBOTS, palettes, spec_files
from arc_suite.robots.spec import PALETTES, Body
from arc_suite.tasks import TASKS

FLAGS = flags.FLAGS

MAX_COUNT = 100_000  # episodes, or bodies: more than anyone waits for
ROBOT_HELP = (
    f"{', '.join(registry.robot_words())}; a file in JSON, MJCF or URDF; module:name of one that another package has"
)


def define_body(robot: str | None = "queen", more: str = "") -> None:
    """Define --robot, --spec, --legs, --links, --length and --palette, for programs that take any body.

    Args:
        robot: default of --robot.
        more: end of its help.
    """
    flags.DEFINE_string("robot", robot, f"{ROBOT_HELP}{more}.")
    examples = ", ".join(spec_files.EXAMPLES)
    flags.DEFINE_string(
        "spec", None, f"A body in place of a robot: a file in JSON, MJCF or URDF, or one of {examples}."
    )
    flags.DEFINE_integer("legs", None, "A body with this number of legs, in place of a robot.", *generator.LEGS)
    flags.DEFINE_integer(
        "links", None, "Actuated links of each leg of a body made to order. [default: 3]", *generator.LINKS
    )
    flags.DEFINE_multi_string(
        "length",
        [],
        "Factor on the length of a link of a spec or body made to order: --length lower=1.5.",
    )
    flags.DEFINE_string("palette", None, f"Colors of a spec or body made to order: {', '.join(PALETTES)}, or a seed.")


def define_task(default: str = "walk") -> None:
    """Define --task and --set, for programs that take any task."""
    flags.DEFINE_string("task", default, f"Task: {', '.join(TASKS)}, or module:name of one that another package has.")
    flags.DEFINE_multi_string(
        "set",
        [],
        "Setting of the task, name=value. Values are JSON where they parse, else text: "
        "--set target_velocity=0.8 --set gait=ripple --set weights='{\"posture\": -0.01}'.",
    )


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


def policy_name(name: str) -> str:
    """Return the name of a policy with the statistics of --vecnormalize, if there are any.

    Raises:
        ValueError: --vecnormalize without a zip.
    """
    if FLAGS.vecnormalize is None:
        return name
    policy_file = other_libraries.find(name)
    if policy_file is None or policy_file.extension != zips.EXTENSION:
        given = f"--vecnormalize={checks.quote(FLAGS.vecnormalize)}"
        raise ValueError(f"{given}: goes with a zip of stable-baselines3, got {checks.preview(name)}")
    return other_libraries.with_further_file(name, FLAGS.vecnormalize)


def custom_body() -> Body | None:
    """Return the body that --spec or --legs ask for, as --length and --palette shape it, or None.

    Raises:
        ValueError: both are given, or --links, --length or --palette without them, or no body in the file.
        OSError: the file cannot be read.
    """
    if FLAGS.spec is not None and FLAGS.legs is not None:
        raise ValueError("expected one of --spec and --legs, got both")
    if FLAGS.links is not None and FLAGS.legs is None:
        raise ValueError(f"--links={FLAGS.links}: goes with --legs")
    if FLAGS.spec is None and FLAGS.legs is None:
        for name in ("length", "palette"):
            if FLAGS[name].present:
                raise ValueError(f"--{name}: goes with --spec or --legs")
        return None
    if FLAGS.spec is not None:
        body = registry.body_of(FLAGS.spec)
    else:
        body = generator.generate(FLAGS.legs, 3 if FLAGS.links is None else FLAGS.links)
    if FLAGS.length:
        body = shaping.shaped(body, links=named_values("length", FLAGS.length))
    return body if FLAGS.palette is None else body.replace(palette=palettes.parse(FLAGS.palette))


def define_walk(robot: str = "queen", more: str = "", task: str = "walk", policy: str = policies.HELP) -> None:
    """Define the flags of a program in which a policy walks bodies: of bodies, task, policy and preset.

    Args:
        robot: default of --robot.
        more: end of its help.
        task: default of --task.
        policy: help of --policy.
    """
    define_body(robot, more)
    define_task(task)
    define_policy(policy)
    define_preset()


def bodies_from_flags(near: Iterable[str] = ("all",)) -> dict[str, Body]:
    """Return bodies by name: the one made, or those that --robot names, which may be "all".

    For names see `registry.bodies_of`. Flaws of the body of --spec, such as feet in the floor, are warned of with the
    values that fit, as `arc-suite check` has them.

    Args:
        near: other values of --robot that an unknown robot may mean.

    Raises:
        ValueError: as `custom_body`, or an unknown robot, or a robot and a body.
        OSError: as `custom_body`.
    """
    body, robot = custom_body(), FLAGS["robot"]
    if body is None:
        return dict(ROBOTS) if robot.value == "all" else _named(robot.value, near)
    if robot.present:
        raise ValueError(f"--robot={checks.quote(robot.value)}: expected no robot with --spec or --legs")
    for flaw in flaws(body) if FLAGS.spec is not None or FLAGS.length else ():
        warnings.warn(f"{checks.quote(FLAGS.spec or body.name)}: {flaw.text}", stacklevel=2)
    return {body.name: body}


def _named(robot: str, near: Iterable[str]) -> dict[str, Body]:
    found = registry.bodies_of(robot, near)
    named = {body.name: body for body in found}
    if len(named) < len(found):
        raise ValueError(f"--robot={checks.quote(robot)}: expected a name for each body, got two of one name")
    return named


def only_body() -> Body:
    """Return the body of a program that takes one alone; see `bodies_from_flags`.

    Raises:
        ValueError: as `bodies_from_flags`, or several bodies.
        OSError: as `bodies_from_flags`.
    """
    return _only(bodies_from_flags(near=()))


def _only(found: dict[str, Any]) -> Any:
    first, *others = found.values()
    if others:
        raise ValueError(f"--robot={checks.quote(FLAGS.robot)}: expected one robot")
    return first


def setups_from_flags(stored: Setup | None = None, near: Iterable[str] = ("all",)) -> dict[str, Setup]:
    """Return the setups that --robot, --spec, --legs, --task and --set ask for, by name of the body.

    A trained policy, or a file of tracks, brings what the flags leave open, and a line says what: its body; without
    --task its task and settings, which --set changes. A curriculum is for training, and is left out.

    Args:
        stored: the setup of tracks; None for that of --policy.
        near: see `bodies_from_flags`.

    Raises:
        ValueError: as `bodies_from_flags`, `task_from_flags` and `policies.setup_of`.
        OSError: as `bodies_from_flags` and `policies.setup_of`.
    """
    # First: this imports the modules that flags name.
    named = bodies_from_flags(near)
    name, settings = task_from_flags()
    own = stored or policy_setup()
    name, settings = complete_task(own, name, settings)
    found = {body.name: Setup.of(body, name, settings) for body in choose_bodies(own, named).values()}
    fitting = [each for each in found.values() if own and (own.several or each.body == own.body)]
    if fitting and not stored:
        others = [each for each in fitting if (each.task, each.task_kwargs) != (own.task, own.task_kwargs)]
        print(f"{FLAGS.policy}: trained on {own}" + "".join(f"; plays in {each}" for each in others))
    return found


def policy_setup(policy: str | None = None) -> Setup | None:
    """Return the setup that judges a policy, see `Setup.judging`; None for one that is no file.

    Args:
        policy: of a program without --policy; None for that of --policy.

    Raises:
        ValueError: as `policies.setup_of`.
        OSError: as `policies.setup_of`.
    """
    own = policies.setup_of(policy_name(FLAGS.policy if policy is None else policy))
    return own and own.judging()


def choose_bodies(own: Setup | None, named: dict[str, Body]) -> dict[str, Body]:
    """Return the body of a policy or of tracks by name where no flag names one, else those of the flags."""
    if own is None or own.several or FLAGS["robot"].present or custom_body():
        return named
    return {own.body.name: own.body}


def complete_task(own: Setup | None, name: str, settings: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return task and settings of the flags; without --task those of a policy or of tracks, which --set changes."""
    return (name, settings) if own is None or FLAGS["task"].present else (own.task, own.task_kwargs | settings)


def only_setup() -> Setup:
    """Return the setup of a program that takes one body; see `setups_from_flags`.

    Raises:
        ValueError: as `setups_from_flags`, or several bodies.
        OSError: as `setups_from_flags`.
    """
    return _only(setups_from_flags(near=()))


def task_from_flags() -> tuple[str, dict[str, Any]]:
    """Return the name of the task and its settings, `task_kwargs` of `arc_suite.load`.

    The modules that the flags name are imported. What settings a task has is checked where an environment is opened.

    Raises:
        ValueError: an unknown task, a setting without a value, or `random`.
    """
    registry.task_of(FLAGS.task)
    settings = named_values("set", FLAGS["set"].value)
    if "random" in settings:
        raise ValueError(
            f"--set random={checks.quote(settings['random'])}: programs seed every episode; "
            "see --help for the flag of the first seed"
        )
    if "arena" in settings:
        registry.arena_maker(settings["arena"])
    return FLAGS.task, settings


def check_flags_suit_file(extension: str, own: Mapping[str, Iterable[str]]) -> None:
    """Check that no flag is given that is for other files.

    Args:
        extension: of the file to write.
        own: by flag, the extensions that it is for.

    Raises:
        ValueError: one is.
    """
    for flag, extensions in own.items():
        if FLAGS[flag].present and extension not in extensions:
            raise ValueError(f"--{flag}: it is for {', '.join(extensions)}, not for {extension}")


def named_values(flag: str, texts: Iterable[str]) -> dict[str, Any]:
    """Return what texts name=value of a flag say; values are JSON where they parse, else text.

    Raises:
        ValueError: a text without a name or a value.
    """
    found = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise ValueError(f"--{flag} {checks.quote(text)}: expected name=value")
        try:
            found[name] = json.loads(value)
        except ValueError:
            found[name] = value
    return found
