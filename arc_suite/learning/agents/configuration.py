"""Configurations of runs: values that flags and studies make, that training takes, and that files hold as JSON."""

import dataclasses
import json
import os
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from arc_suite import checks, evaluation, files, registry, usage, versions
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, run_folder
from arc_suite.learning.agents.hyperparameters import BLOCKS_LEFT_OUT
from arc_suite.learning.agents.learner import MAX_RUN_SEED, RunContext
from arc_suite.learning.agents.run_folder import COMMIT, LEG_VIEWS, MODEL_HASH, MODULE
from arc_suite.policies import network
from arc_suite.simulation.model_hash import PHYSICS
from arc_suite.tasks import leg_views
from arc_suite.tasks.contract import CURRICULUM

# Fields in the file of a configuration: those of the setup, and the others.
_LEARNING_FIELDS = ("algorithm", "hyperparameters", "seed", "steps", "evaluate_every", "prior", "training")
CONFIGURATION_FIELDS = ("robot", "task", "task_kwargs", *_LEARNING_FIELDS)

# Further fields in the record of a run, which follow from its configuration, the data and the installed packages.
# `learner` is in records of earlier versions.
PRIOR_SHA256 = "prior_sha256"
STYLE_FIELDS = ("style", "style_share")  # hyperparameters of `motion_style`
SCHEDULE_STEPS = "schedule_steps"  # a hyperparameter of `on_policy`
TRAINING_SEEDS = "training_seeds"
DATA_FIELDS = (PRIOR_SHA256, TRAINING_SEEDS)
PROVENANCE_FIELDS = (
    "task_version",
    "body_sha256",
    PHYSICS,
    "learner",
    "episodes",
    LEG_VIEWS,
    *DATA_FIELDS,
    "versions",
)

# Hyperparameters whose values are names that other packages may have registered, and the kinds of these names.
_KINDS_OF_NAMES = {"network": "network", "preset": "law"}

_NETWORK_OF_START = ("network", "hidden")  # hyperparameters that are those of the policy that a run starts from


@dataclasses.dataclass(frozen=True)
class Configuration:
    """Everything that a run depends on, except installed packages; make it by `of` or `from_dict`.

    Attributes:
        setup: body, or bodies, task and settings.
        algorithm: name, or `module:name`; see `algorithms.algorithm`.
        hyperparameters: hyperparameters of the algorithm, a frozen dataclass.
        seed: seed of all random numbers.
        steps: environment steps.
        evaluate_every: environment steps between evaluations.
        prior: id of a dataset of prior data; None for none.
        training_json: JSON of the task's settings in training that differ from those of `setup`, keys in order.
    """

    setup: Setup
    algorithm: str
    hyperparameters: Any
    seed: int
    steps: int
    evaluate_every: int
    prior: str | None = None
    training_json: str = "{}"

    @classmethod
    def of(
        cls,
        setup: Setup,
        algorithm: str = "ppo",
        hyperparameters: Mapping[str, Any] | None = None,
        seed: int = 0,
        steps: int | None = None,
        evaluate_every: int | None = None,
        prior: str | None = None,
        training: Mapping[str, Any] | None = None,
    ) -> Self:
        """Return a configuration; arguments that are None have the algorithm's defaults.

        Args:
            setup: body, or bodies, task and settings by which the policy is evaluated.
            algorithm, seed, steps, evaluate_every, prior: see `Configuration`.
            hyperparameters: those that differ from the algorithm's. Where `start` names a policy of one body,
                `network` and `hidden` are that policy's by default.
            training: settings of the task in training alone, such as kicks or a curriculum, in addition to those that
                the task itself has for training.

        Raises:
            ValueError: an unknown algorithm or hyperparameter, a value out of its range, or a damaged policy to start
                from.
        """
        changes = hyperparameters or {}
        definition = algorithms.algorithm(algorithm).with_hyperparameters(changes)
        start = getattr(definition.hyperparameters, "start", "")
        _check_start(setup, algorithm, definition)
        if start and not setup.several and not set(_NETWORK_OF_START) <= changes.keys():
            definition = definition.with_hyperparameters({**network_hyperparameters(start), **changes})
        if setup.several:
            _check_learns_several(setup, algorithm, definition)
        if steps is None:
            steps = definition.steps_of(setup)
        steps = checks.integer("steps", steps, 1)
        if evaluate_every is None:
            evaluate_every = definition.evaluate_every_of(steps)
        seed = checks.integer("seed", seed, 0, MAX_RUN_SEED)
        evaluate_every = checks.integer("evaluate_every", evaluate_every, 1)
        if not isinstance(prior, str | None):
            raise ValueError(f"prior: expected the id of a dataset, got {checks.preview(prior)}")
        training = {**setup.training_settings, **checks.mapping("training", training)}
        _check_training(setup, definition, training)
        return cls(
            setup=setup,
            algorithm=registry.importable_name("algorithm", registry.bare_name(algorithm)),
            hyperparameters=_with_modules(definition.hyperparameters),
            seed=seed,
            steps=steps,
            evaluate_every=evaluate_every,
            prior=prior,
            training_json=_embed_training(setup, training),
        )

    @property
    def training(self) -> dict[str, Any]:
        """Settings of the task in training that differ from those of `setup`; a new dictionary."""
        return json.loads(self.training_json)

    @property
    def policy_setup(self) -> Setup:
        """Setup of the policy: `setup`, whose task leaves out the blocks that networks do not see."""
        excluded_blocks = self._excluded_blocks()
        return self.setup.with_settings({"exclude_blocks": excluded_blocks} if excluded_blocks else {})

    @property
    def training_setup(self) -> Setup:
        """Setup in which the algorithm learns: that of the policy, with the settings of training.

        Raises:
            ValueError: a setting that does not fit, or one that changes observations or actions.
        """
        policy_setup = self.policy_setup
        training_setup = apply_training(policy_setup, self.training)
        if training_setup != policy_setup:
            training_task = training_setup.definition
            policy_task = policy_setup.definition
            if training_task.sizes != policy_task.sizes or training_task.actions != policy_task.actions:
                difference = "other observations or actions than those that it is judged by"
                raise ValueError(f"training: expected settings of the same observations and actions, got {difference}")
        return training_setup

    def _excluded_blocks(self) -> list[str]:
        """Return the blocks that networks do not see; an empty list leaves the setting of the task as it is."""
        names = getattr(self.hyperparameters, "exclude_blocks", ())
        if not names or self.setup.several:  # the inputs of several bodies are always the same
            return []
        task_blocks = self.setup.judging().definition.sizes
        excluded_by_task = self.setup.excluded_blocks
        excluded_by_hyperparameters = [name for name in names if name in task_blocks and name not in excluded_by_task]
        return [*excluded_by_task, *excluded_by_hyperparameters]

    @property
    def validation(self) -> Setup:
        """Setup in which the policy is evaluated while it learns."""
        return self.setup.validation(evaluation.CURVE_EPISODES)

    @property
    def definition(self) -> algorithms.Algorithm:
        """The algorithm, with these hyperparameters."""
        return algorithms.algorithm(self.algorithm)._replace(hyperparameters=self.hyperparameters)

    @property
    def default_hyperparameters(self) -> Mapping[str, Any]:
        """Hyperparameters that the algorithm has by default, by name; on a device those of its simulation."""
        definition = algorithms.algorithm(self.algorithm)
        if self.learns_on_device:
            definition = definition.with_hyperparameters({"simulation": self.hyperparameters.simulation})
        return dataclasses.asdict(definition.hyperparameters)

    @property
    def learns_on_device(self) -> bool:
        """Whether simulation and learning stay on JAX's device; see `device_learner`."""
        return algorithms.stays_on_device(self.hyperparameters)

    def context(
        self, folder: str | os.PathLike[str], threads: int = 1, checkpoint: Mapping[str, np.ndarray] | None = None
    ) -> RunContext:
        """Return the context of the run, which its learner takes.

        Args:
            folder: folder of the run.
            threads: threads of the simulation.
            checkpoint: arrays to resume from; None for a new run.

        Raises:
            ValueError: as `training_setup`.
        """
        return RunContext(
            setup=self.setup,
            training=self.training_setup,
            seed=self.seed,
            steps=self.steps,
            evaluate_every=self.evaluate_every,
            folder=Path(folder),
            prior=self.prior,
            threads=threads,
            checkpoint=checkpoint,
        )

    @property
    def name(self) -> str:
        """Default name of the run's folder."""
        return f"{self.setup.name}-{self.setup.task_label}-{self.algorithm}-{self.seed}".replace(":", ".")

    @property
    def command(self) -> str:
        """Command line that trains the same policy; hyperparameters with the algorithm's defaults are left out."""
        changes = {"simulation": self.hyperparameters.simulation} if self.learns_on_device else {}
        defaults = self.default_hyperparameters
        hyperparameters = dataclasses.asdict(self.hyperparameters)
        changes |= {
            name: value for name, value in hyperparameters.items() if name not in defaults or value != defaults[name]
        }
        words = [
            "arc-suite",
            "train",
            f"--robot={self.setup.robot}",
            f"--task={self.setup.task}",
            f"--algorithm={self.algorithm}",
            f"--steps={self.steps}",
            f"--seed={self.seed}",
            f"--evaluate_every={self.evaluate_every}",
        ]
        if self.prior is not None:
            words.append(f"--prior={self.prior}")
        settings = self.setup.task_kwargs
        if "arena" in settings:
            words.append(f"--arena={settings.pop('arena')}")
        words += _flags("set", settings)
        words += _flags("train_set", _changed_training(self.setup, self.training))
        words += _flags("hp", changes)
        return shlex.join(words)

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as files hold it, plain values by field, without idle hyperparameters."""
        learning_fields = {name: getattr(self, name) for name in _LEARNING_FIELDS}
        learning_fields["hyperparameters"] = self._active_hyperparameters()
        return self.setup.to_dict() | learning_fields

    def _active_hyperparameters(self) -> dict[str, Any]:
        """Return the hyperparameters by name, without idle ones that runs of earlier versions lack, as those go on."""
        hyperparameters = dataclasses.asdict(self.hyperparameters)
        idle_names = set()
        if not hyperparameters.get("style"):
            idle_names.update(STYLE_FIELDS)
        default_steps = self.default_hyperparameters.get(SCHEDULE_STEPS)
        if default_steps is not None and hyperparameters[SCHEDULE_STEPS] == default_steps <= self.steps:
            idle_names.add(SCHEDULE_STEPS)
        return {name: value for name, value in hyperparameters.items() if name not in idle_names}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Return the configuration of a file; no module that it names is imported.

        Args:
            fields: those of `to_dict` or `record`; all except `robot` have defaults.

        Raises:
            NotImported: the module of a name has not been imported yet.
            ValueError: an unknown field, or a value that does not fit.
            OSError: the file of a body cannot be read.
        """
        for name in fields:
            checks.name(
                name, (*CONFIGURATION_FIELDS, *PROVENANCE_FIELDS, COMMIT, MODEL_HASH), "field of a configuration"
            )
        if "robot" not in fields:
            raise ValueError("expected a robot, got none")
        for kind, name in _registered_names(fields):
            registry.refuse_import(kind, name)
        setup = Setup.of(fields["robot"], fields.get("task", "walk"), fields.get("task_kwargs"))
        return cls.of(setup, **{name: fields[name] for name in _LEARNING_FIELDS if name in fields})

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules that register the names in the configuration, for processes that read it from a file."""
        modules = [name.rpartition(":")[0] for _, name in _registered_names(self.to_dict()) if ":" in name]
        return tuple(dict.fromkeys(modules))  # each once

    @property
    def parts_of_others(self) -> tuple[tuple[str, str], ...]:
        """Kind and name of each part in the configuration that another package has registered."""
        parts = []
        for kind, name in _registered_names(self.to_dict()):
            kinds = (kind, "family") if kind == "robot" else (kind,)
            parts += [(kind, name) for kind in kinds if (kind, registry.bare_name(name)) in registry.MODULE_OF_NAME]
        return tuple(dict.fromkeys(parts))  # each once

    def record(self) -> dict[str, Any]:
        """Return `to_dict` with hashes and versions of everything that a run computes with, plain values by field.

        Modules of other packages are among the versions; see `versions.describe_module`.

        Raises:
            ValueError: a setting of the task that does not fit.
        """
        provenance = self.setup.provenance()
        packages = {name: versions.version_of(name) for name in ("jax", "jaxlib", "optax")}
        fields = self.to_dict() | provenance
        fields["episodes"] = evaluation.CURVE_EPISODES
        modules = {f"{MODULE}{name}": versions.describe_module(name) for name in self.modules}
        fields["versions"] = provenance["versions"] | packages | modules
        commit = versions.commit_of_clone()
        if commit is not None:
            fields[COMMIT] = commit
        if self._depends_on_leg_views():
            fields[LEG_VIEWS] = leg_views.VERSION
        return fields

    def _depends_on_leg_views(self) -> bool:
        """Return whether legs see blocks that the first version of leg views did not turn."""
        if getattr(self.hyperparameters, "network", "") != "legs" or self.setup.several:
            return False
        critic_blocks = getattr(self.hyperparameters, "critic_blocks", ())
        seen_blocks = {*self.policy_setup.definition.blocks, *critic_blocks}
        return not seen_blocks <= set(leg_views.TURNED_BEFORE)


def _flags(flag: str, values: Mapping[str, Any]) -> list[str]:
    """Return a flag `--flag=name=value` for each value: text as it is, all others as JSON."""
    texts = {name: value if isinstance(value, str) else json.dumps(value) for name, value in values.items()}
    return [f"--{flag}={name}={text}" for name, text in texts.items()]


def _registered_names(fields: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield kind and name of everything in the fields of a configuration that other packages may have registered.

    Raises:
        ValueError: hyperparameters or settings that are no mappings.
    """
    hyperparameters = checks.mapping("hyperparameters", fields.get("hyperparameters"))
    robot = fields.get("robot")
    body_names = registry.names_in_robot(robot) if isinstance(robot, str) else []
    names = [("robot", name) for name in body_names]
    names += [("task", name) for name in registry.split_task_names(fields.get("task"))]
    names.append(("algorithm", fields.get("algorithm")))
    for settings_field in ("task_kwargs", "training"):
        settings = checks.mapping(settings_field, fields.get(settings_field))
        if registry.names_arena(settings.get("arena")):
            names.append(("arena", settings["arena"]))
        names += [("modifier", name) for name in settings]
    names += [(kind, hyperparameters.get(field)) for field, kind in _KINDS_OF_NAMES.items()]
    for kind, name in names:
        if isinstance(name, str):
            yield kind, name


def _with_modules(hyperparameters):
    """Return hyperparameters with `module:name` for names of other packages, as other processes need the module."""
    changes = {}
    for field, kind in _KINDS_OF_NAMES.items():
        name = getattr(hyperparameters, field, None)
        if isinstance(name, str) and registry.bare_name(name) in registry.ADDITIONS[kind]:
            changes[field] = registry.importable_name(kind, registry.bare_name(name))
    return dataclasses.replace(hyperparameters, **changes)


def with_network_of_folder(run: Configuration, folder: str | os.PathLike[str]) -> Configuration:
    """Return the configuration of a run that goes on in a folder.

    Where the policy that it started from is gone, the folder has the network in its place.

    Raises:
        ValueError: no folder of a run.
        OSError: its record cannot be read.
    """
    start = getattr(run.hyperparameters, "start", "")
    if not start or run.setup.several or os.path.exists(start) or not run_folder.is_begun(folder):
        return run
    recorded_values = checks.mapping("hyperparameters", run_folder.read_config(folder).get("hyperparameters"))
    defaults = run.default_hyperparameters
    changes = {
        name: recorded_values[name]
        for name in defaults.keys() & recorded_values.keys() & set(_NETWORK_OF_START)
        if getattr(run.hyperparameters, name) == defaults[name]
    }
    return dataclasses.replace(run, hyperparameters=dataclasses.replace(run.hyperparameters, **changes))


def network_hyperparameters(start: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the hyperparameters of the network of a policy file.

    They are empty if there is no file, as a run may resume without the policy that it started from; see
    `with_network_of_folder`.
    """
    try:
        graph = network.load(start).graph
    except OSError:
        return {}
    linear_nodes = [node for node in graph.nodes if node.operator == "Linear"]
    if not linear_nodes:
        return {}
    first_bias = linear_nodes[0].inputs[-1]
    is_of_legs = any(node.operator == "Product" for node in graph.nodes)
    return {"network": "legs" if is_of_legs else "perceptron", "hidden": graph.arrays[str(first_bias)].size}


def _check_learns_several(setup: Setup, name: str, definition: algorithms.Algorithm) -> None:
    """Raise ValueError for an algorithm or hyperparameters that cannot learn with several bodies."""
    if not definition.several:
        names = [other_name for other_name, algorithm in algorithms.ALGORITHMS.items() if algorithm.several]
        raise ValueError(f"algorithm {name}: learns with one body, got {setup.robot}; with several: {', '.join(names)}")
    exclude_blocks = getattr(definition.hyperparameters, "exclude_blocks", ())
    if not set(exclude_blocks) <= set(BLOCKS_LEFT_OUT):
        raise ValueError(f"exclude_blocks: expected none with several bodies, got {', '.join(exclude_blocks)}")


def _check_start(setup: Setup, name: str, definition: algorithms.Algorithm) -> None:
    """Raise ValueError for a policy to start from, where the algorithm learns from nothing."""
    start = getattr(definition.hyperparameters, "start", "")
    if start and definition.source == usage.NOTHING:
        cure = "finetune_bodies" if setup.several else "finetune"
        expected = f"expected none, as {name} learns from no policy; --algorithm {cure} does"
        raise ValueError(f"start: {expected}, got {checks.preview(start)}")


def _check_training(setup: Setup, definition: algorithms.Algorithm, training: Mapping[str, Any]) -> None:
    """Raise ValueError for settings of training that do not fit or have no effect, and a curriculum in evaluations."""
    checks.json_text("training", dict(training))
    curriculum = setup.task_kwargs.get(CURRICULUM)
    if curriculum:
        raise ValueError(
            f"setting {CURRICULUM}: expected among the settings of training (--train_set), as an evaluation "
            f"would begin at the first level, got {checks.preview(curriculum)}"
        )
    changed_names = _changed_training(setup, training)
    if changed_names and not definition.acts:
        names = ", ".join(changed_names)
        raise ValueError(f"training: expected no settings, as the algorithm makes no step, got {names}")
    for name in training:
        if name in ("random", "exclude_blocks"):
            reason = "as every run has a seed" if name == "random" else "as it is a hyperparameter"
            raise ValueError(f"training: setting {name}: expected none, {reason}, got {checks.preview(training[name])}")


def _embed_training(setup: Setup, training: Mapping[str, Any]) -> str:
    """Return the settings of training as JSON, with ground and motions of files as texts, as a setup has them."""
    return setup.with_settings(training, dropped=setup.task_kwargs).settings_json


def _changed_training(setup: Setup, training: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of training, by name, that differ from those that the task itself has for training."""
    of_task = setup.training_settings
    return {name: value for name, value in training.items() if of_task.get(name) != value}


def apply_training(policy_setup: Setup, training: Mapping[str, Any]) -> Setup:
    """Return the setup in which a policy of a setup learns, given the settings of training."""
    # The difficulty is that of evaluations: levels of a curriculum have their own.
    dropped = ("difficulty",) if training.get(CURRICULUM) else ()
    return policy_setup.with_settings(training, dropped)


def read(path: Path) -> Configuration:
    """Return the configuration in a JSON file, such as `config.json` of a run's folder.

    Raises:
        NotImported: the module of a name has not been imported yet.
        ValueError: no configuration.
        OSError: the file cannot be read.
    """
    try:
        with files.reading(path):
            fields = files.read_json(path)
        return Configuration.from_dict(checks.mapping("configuration", fields))
    except registry.NotImported as error:
        raise registry.NotImported(f"{path}: {error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {checks.quote(error)}") from None
