"""Registration of other packages' robots, tasks, laws, learners and other parts, and of ids with Gymnasium."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import gymnasium

from arc_suite import checks, registry
from arc_suite.arenas import ARENAS
from arc_suite.cpg.law import Law
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import LAWS, SUITE_PRESETS, law
from arc_suite.envs.prepare import prepare_task
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Visuals
from arc_suite.registry import ADDITIONS, BODIES_ENV, FAMILIES, MODULE_OF_NAME, REFUSAL_OF_ONE_BODY
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.modifiers import MODIFIERS, Modifier
from arc_suite.tasks.parameters import LARGEST, PARAMETERS, SHARED_NOISE

BODIES = "bodies"  # stands in place of a robot's name in ids of environments of different bodies

# Tables of the registered parts by kind.
_TABLES: dict[str, dict[str, Any]] = {
    "task": TASKS,
    "arena": ARENAS,
    "family": FAMILIES,
    "modifier": MODIFIERS,
    **ADDITIONS,
}

# Argument that `register` lacks -> what takes its place, in errors.
_HINTS = {
    **dict.fromkeys(("bodies", "robot", "robots"), "body takes one robot's body"),
    "gait": "parameters has the gait of a robot",
}


def register(
    *,
    module: str | None = None,
    body: Body | None = None,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    presets: Mapping[str, Any] | None = None,
    visuals: Visuals | None = None,
    tasks: Iterable[type[Task]] = (),
    arenas: Mapping[str, Any] | None = None,
    families: Mapping[str, Callable[[int], Body]] | None = None,
    modifiers: Iterable[type[Modifier]] = (),
    laws: Mapping[str, type[Law]] | None = None,
    networks: Mapping[str, Any] | None = None,
    algorithms: Mapping[str, Any] | None = None,
    clips: Mapping[str, Any] | None = None,
    goals: Mapping[str, Any] | None = None,
    axes: Mapping[str, Any] | None = None,
    programs: Mapping[str, str] | None = None,
    **others: Any,
) -> None:
    """Add a robot, or parts of other kinds, to the suite: every task then exists for every robot.

    Call it where a module is imported. `load` and Gymnasium's ids then name the robot as they name
    Queen. Callers name a part of any kind as `name`, or as `module:name`, which imports the module.

    Args:
        module: the module that makes this call, its `__name__`. Other processes import it to register the same names.
            None if no other process needs them.
        body: the robot's body; its name becomes a domain.
        parameters: the robot's parameters by name of the task. Walk needs all keys of
            `tasks.parameters.PARAMETERS["walk"]["queen"]`, in the same units; another task needs those that differ from
            walk's. Noise that walk does not set is fitted to the body; without walk's, all parameters are.
        presets: the robot's demonstrators by name: a `cpg.prescribed.Preset`, or parameters of
            another law, see `cpg.selection.LAWS`. The presets that every body has are fitted if not given.
        visuals: decorations and colors; None for those that suit any body.
        tasks: classes by the contract of `tasks.contract`, each with its name.
        arenas: by name, functions from a body to the `Arena` that suits it.
        families: by name, functions from a seed to a body, always the same for the same seed; see
            `bodies.families.sound`. `name:seed` then stands for the body wherever a domain does. It takes precedence
            over a module of that name.
        modifiers: classes of `tasks.modifiers.Modifier`. Their settings become settings of every task; a task has the
            modifier if one of them is given.
        laws: classes of demonstrators' laws by name; see `cpg.law.Law`. A preset of the class of `law.preset` has this
            law, and the law's name is also the name of that preset on every body.
        networks: by name, functions from a task to an architecture, for `--hp network=`; see
            `learning.agents.architectures.of`.
        algorithms: values of `learning.agents.algorithms.Algorithm` by name.
        clips: values of classes of `animation.clips.catalog`, such as `Acted`, by name.
        goals: values of `animation.design.trials.Goal` by name, for `arc-suite design --goal`.
        axes: values of `animation.design.axes.Axis` by name, for `arc-suite design --map`.
        programs: names of modules that `arc-suite` runs, by name of the program. Each module has a docstring and a
            function `main`.
        others: none; an unknown argument is refused with what takes its place.

    A network, an algorithm, a clip, a goal or an axis may also be a text `module:attribute`: it is then imported and
    checked at its first use.

    Raises:
        ValueError: a name that is taken, a task or a law that lacks methods, or parameters or a preset that do not fit
            the body. Nothing has been registered then.
    """
    for name in others:
        if name in _HINTS:
            raise ValueError(f"argument {name!r}: {_HINTS[name]}")
        checks.name(name, [key for key in inspect.signature(register).parameters if key != "others"], "argument")
    if module == "__main__":  # other processes cannot import it
        module = None
    _check_tables(tasks=tasks, modifiers=modifiers)
    _check_tables(arenas=arenas, families=families, laws=laws, networks=networks)
    _check_tables(
        algorithms=algorithms,
        clips=clips,
        goals=goals,
        axes=axes,
        programs=programs,
        presets=presets,
        parameters=parameters,
    )
    all_additions = {
        "task": {_task_name(task): task for task in tasks},
        "arena": arenas,
        "family": families,
        "modifier": {name: modifier for modifier in modifiers for name in _modifier_settings(modifier)},
        "law": laws,
        "network": networks,
        "algorithm": algorithms,
        "clip": clips,
        "goal": goals,
        "axis": axes,
        "program": programs,
    }
    additions_by_kind = {kind: dict(additions) for kind, additions in all_additions.items() if additions}
    for kind, additions in additions_by_kind.items():
        _check_names(kind, additions, module)
    for name, module_name in additions_by_kind.get("program", {}).items():
        if not isinstance(module_name, str):
            raise ValueError(f"program {name!r}: expected the name of a module, got {checks.preview(module_name)}")
    for name, maker in additions_by_kind.get("arena", {}).items():
        if not isinstance(maker, str):
            _check_arguments(f"arena {name!r}: expected a function from a body to an Arena", maker, "body")
    law_by_preset_class = {
        _preset_class(name, law_class): law_class for name, law_class in additions_by_kind.get("law", {}).items()
    }

    if body is not None:
        all_tasks = {**TASKS, **additions_by_kind.get("task", {})}
        all_laws = {**LAWS, **law_by_preset_class}
        _register_body(body, parameters or {}, presets, visuals, all_tasks, all_laws)
        MODULE_OF_NAME["robot", body.name] = module
    elif not (parameters is None and presets is None and visuals is None):
        raise ValueError("parameters, presets and visuals belong to a body, and none is given")
    elif not additions_by_kind:
        kinds = "a body, tasks, arenas, families, modifiers, laws, networks, algorithms, clips, goals, axes or programs"
        raise ValueError(f"nothing to register: give {kinds}")

    LAWS.update(law_by_preset_class)
    for kind, additions in additions_by_kind.items():
        _TABLES[kind].update(additions)
        MODULE_OF_NAME.update({(kind, name): module for name in additions})
    registry.forget_results()  # a body of an earlier call may share its name with the new one
    register_ids()


def _check_tables(**additions: Any) -> None:
    """Raise ValueError for parts by argument that are no tuple of classes or no mapping of names to parts."""
    for name, parts in additions.items():
        if name in ("tasks", "modifiers"):
            if isinstance(parts, type) or not isinstance(parts, Iterable):
                example = f"({parts.__name__},)" if isinstance(parts, type) else "(Name,)"
                raise ValueError(f"{name}: expected classes, such as {name}={example}, got {checks.preview(parts)}")
        elif not isinstance(parts, Mapping | None):
            raise ValueError(f"{name}: expected a mapping of names to values, got {checks.preview(parts)}")


def _is_new_version(value: Any, earlier_value: Any) -> bool:
    """Return whether two classes or functions have the same name in the same module, as after an edit of a cell."""
    attributes = ("__module__", "__qualname__")
    names, earlier_names = ([getattr(part, name, None) for name in attributes] for part in (value, earlier_value))
    return None not in names and names == earlier_names


def _check_names(kind: str, additions: Mapping[str, Any], module: str | None) -> None:
    """Raise ValueError for a name that is no identifier, or that something else has."""
    table = _TABLES[kind]
    for name, value in additions.items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise ValueError(
                f"{kind} {checks.preview(name)}: expected letters, digits and underscores, without a digit first"
            )
        is_same_value = table.get(name) is value
        is_of_same_module = module is not None and MODULE_OF_NAME.get((kind, name)) == module
        is_known = is_same_value or is_of_same_module or _is_new_version(value, table.get(name))
        if name in table and not is_known:  # registering a part again is fine
            raise ValueError(f"{kind} {checks.preview(name)} is already registered; choose another name")


def _check_arguments(expectation: str, function: Any, *arguments: str) -> None:
    """Raise ValueError for a value that is no function of so many arguments by position.

    Args:
        expectation: the beginning of the message.
        function: any value.
        *arguments: their names.
    """
    if not callable(function):
        raise ValueError(f"{expectation}, got {checks.preview(function)}")
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError as error:
        raise ValueError(f"{expectation} called with {' and '.join(arguments)}: {error}") from None
    except ValueError:  # a function of C without a signature
        return


def _preset_class(name: str, law_class) -> type:
    """Return the class of the presets of another package's law, after checks of the law.

    Raises:
        ValueError: the class is no law, or its name or the class of its presets belongs to another law.
    """
    attributes = {attribute for base in getattr(law_class, "__mro__", ()) for attribute in vars(base)}
    missing = [attribute for attribute in ("preset", "reads", "initial", "__call__") if attribute not in attributes]
    if missing:
        raise ValueError(f"law {name!r}: has no {' and no '.join(missing)}, which arc_suite.cpg.law.Law requires")
    if not {"posture", "velocities"} <= set(law_class.reads):
        reads = checks.preview(law_class.reads)
        raise ValueError(f"law {name!r}: reads: expected posture, velocities and others, got {reads}")
    if name in SUITE_PRESETS:
        raise ValueError(f"law {name!r}: the suite has presets of this name; choose another name")
    preset_class = type(law_class.preset)
    law_of_presets = LAWS.get(preset_class, law_class)
    if law_of_presets is not law_class and not _is_new_version(law_class, law_of_presets):
        raise ValueError(f"law {name!r}: presets of {preset_class.__name__} are those of {law_of_presets.__name__}")
    _check_arguments(f"law {name!r}: expected a class", law_class, "task", "preset")
    return preset_class


def _task_name(task) -> str:
    """Return the name of a task, after a check of its class.

    Raises:
        ValueError: the task is no class by the contract, or lacks methods.
    """
    name = getattr(task, "name", None)
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise ValueError(f"tasks: expected classes by the contract of arc_suite.tasks.Task, got {checks.preview(task)}")
    missing = sorted(task.__abstractmethods__)
    if missing:
        methods = " and no ".join(missing)
        raise ValueError(f"task {checks.preview(name)}: has no {methods}, which arc_suite.tasks.Task requires")
    owner = next((base for base in task.__mro__ if "name" in vars(base)), None)
    if owner is None:
        raise ValueError(f"class {task.__name__} has no name: expected one, such as name = {task.__name__.lower()!r}")
    if owner is not task and TASKS.get(name) is owner:
        raise ValueError(f"class {task.__name__} has no name of its own: {name} is that of {owner.__name__}")
    _check_task_attributes(task)
    return name


def _check_task_attributes(task: type[Task]) -> None:
    """Raise ValueError for an attribute of a class of a task that is not as the contract says.

    A property decides its value for each task; `arc-suite check` looks at it.
    """
    weights, commands, demonstrators = (
        None if isinstance(inspect.getattr_static(task, name, None), property) else getattr(task, name, None)
        for name in ("weights", "commands", "demonstrators")
    )
    for term, weight in checks.mapping(f"{task.__name__}.weights", weights).items():
        checks.number(f"{task.__name__}.weights[{term!r}]", weight, -LARGEST, LARGEST)
    for command, size in checks.mapping(f"{task.__name__}.commands", commands).items():
        checks.integer(f"{task.__name__}.commands[{command!r}]", size, 1)
    is_sequence = isinstance(demonstrators, tuple | list | None)
    if not (is_sequence and all(isinstance(name, str) for name in demonstrators or ())):
        got = checks.preview(demonstrators)
        raise ValueError(f"{task.__name__}.demonstrators: expected a tuple of names of presets, got {got}")
    if not isinstance(inspect.getattr_static(task, "settings_for"), classmethod):
        raise ValueError(f"{task.__name__}.settings_for: expected a class method, with @classmethod before it")
    subclasses = task.__mro__[: task.__mro__.index(Task)]
    if any("step_limit" in vars(base) for base in subclasses):
        raise ValueError(f"{task.__name__}.step_limit: expected none; the setting time_limit, s, decides it")


def _modifier_settings(modifier) -> Mapping[str, Any]:
    """Return the default values of a modifier's settings by name, after checks of its class.

    Raises:
        ValueError: the class is no modifier, has no settings, or has one of a task's settings.
    """
    if not (isinstance(modifier, type) and issubclass(modifier, Modifier) and issubclass(modifier, tuple)):
        expected = "NamedTuples that inherit from arc_suite.tasks.modifiers.Modifier"
        raise ValueError(f"modifiers: expected {expected}, got {checks.preview(modifier)}")
    if not modifier.defaults:
        raise ValueError(f"modifier {modifier.__name__}: expected settings in its `defaults`, got none")
    shared_names = sorted(modifier.defaults.keys() & registry.task_setting_names())
    if shared_names:
        raise ValueError(f"modifier {modifier.__name__}: {shared_names[0]} is a setting of tasks; choose another name")
    return modifier.defaults


def _register_body(
    body: Body,
    parameters: Mapping[str, Any],
    presets: Any,
    visuals: Visuals | None,
    tasks: Mapping[str, type[Task]],
    laws: Mapping[type, Any],
) -> None:
    """Check a robot and all that belongs to it, then put it into the tables.

    Args:
        body: see `register`.
        parameters: see `register`.
        presets: see `register`.
        visuals: see `register`.
        tasks: all tasks by name, those of the same registration included.
        laws: all laws by class of their presets, those of the same registration included.

    Raises:
        ValueError: something does not fit the body. Nothing has been registered then.
    """
    if not isinstance(body, Body):
        raise ValueError(f"body: expected a spec.Body, got {checks.preview(body)}")
    if body.name == BODIES:
        raise ValueError(f"robot {BODIES!r}: ids of environments of different bodies have this name; choose another")
    if ROBOTS.get(body.name, body) != body:
        raise ValueError(f"robot {body.name!r} is already registered")
    for task, task_parameters in parameters.items():
        task_class = tasks[checks.name(task, tasks, "task of parameters")]
        if task_parameters is not None:
            _check_parameters(body, task_class, checks.mapping(f"parameters of {task}", task_parameters))
    if presets is not None:
        _check_presets(body, parameters.get("walk", {}), presets, laws)

    ROBOTS[body.name] = body
    for task, task_parameters in parameters.items():
        if task_parameters is not None:
            PARAMETERS.setdefault(task, {})[body.name] = task_parameters
    if presets is not None:
        PRESETS[body.name] = presets
    if visuals is not None:
        VISUALS[body.name] = visuals


def _check_parameters(body: Body, task: type[Task], parameters: Mapping[str, Any]) -> None:
    """Raise ValueError for a robot's parameters of a task that are incomplete or do not fit the body."""
    if task.name == "walk":
        required_names = PARAMETERS["walk"]["queen"].keys() - {"weights", *SHARED_NOISE}
        missing = sorted(required_names - parameters.keys())
        if missing:
            cure = "give them too, or leave out the table, which is then fitted to the body"
            raise ValueError(f"parameters of {task.name}: {body.name} has no {' and no '.join(missing)}; {cure}")
    task.settings_for(body, parameters)


def _check_presets(
    body: Body, walk_parameters: Mapping[str, Any], presets: Mapping[str, Any], laws: Mapping[type, Any]
) -> None:
    """Raise ValueError for a preset that has no law, or does not fit the body's walk."""
    task, _ = prepare_task(body, "walk", walk_parameters)
    for name, preset in presets.items():
        try:
            law(task, preset, laws)
        except ValueError as error:
            raise ValueError(f"preset {checks.preview(name)}: {error}") from None


def register_ids() -> None:
    """Register `arc_suite/<robot>-<task>-v<version>` with Gymnasium for every pair that has no id yet.

    Ids with `bodies` in place of a robot make vector environments of different bodies, by `gymnasium.make_vec` alone.
    Gymnasium imports the classes of the entry points when an environment is made.
    """
    for domain_name, task_name in registry.all_tasks():
        env_id = registry.env_id(domain_name, TASKS[task_name])
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="arc_suite.envs.gym:Env",
                vector_entry_point="arc_suite.envs.vector:VectorEnv",
                kwargs={
                    "domain_name": registry.importable_name("robot", domain_name),
                    "task_name": registry.importable_name("task", task_name),
                },
            )
    for task_name, task in TASKS.items():
        env_id = registry.env_id(BODIES, task)
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point=REFUSAL_OF_ONE_BODY,
                vector_entry_point=BODIES_ENV,
                kwargs={"task_name": registry.importable_name("task", task_name)},
            )
