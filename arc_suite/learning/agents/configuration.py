"""Configurations of runs: one value, read and written as JSON, from the flags or a study to the training."""

import dataclasses
import json
import os
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from arc_suite import checks, evaluation, files, registry, versions
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.hyperparameters import BLOCKS_LEFT_OUT
from arc_suite.learning.agents.learner import MAX_RUN_SEED, RunContext
from arc_suite.learning.agents.run_folder import LEG_VIEWS
from arc_suite.policies import network
from arc_suite.tasks import leg_views
from arc_suite.tasks.contract import CURRICULUM

# Names in the file of a configuration.
_OWN = ("algorithm", "hyperparameters", "seed", "steps", "evaluate_every", "prior", "training")
CONFIGURATION_FIELDS = ("robot", "task", "task_kwargs", *_OWN)
# Names in the record of a run that follow from its configuration, the data and the installed packages; `learner` is in
# records of earlier versions.
PRIOR_SHA256, TRAINING_SEEDS = "prior_sha256", "training_seeds"
DATA_FIELDS = (PRIOR_SHA256, TRAINING_SEEDS)
# Hyperparameters that hold names which other packages may have registered, and their kinds.
_NAMES_IN_HYPERPARAMETERS = {"network": "network", "preset": "law"}
PROVENANCE_FIELDS = (
    "task_version",
    "body_sha256",
    "model_sha256",
    "learner",
    "episodes",
    LEG_VIEWS,
    *DATA_FIELDS,
    "versions",
)


@dataclasses.dataclass(frozen=True)
class Configuration:
    """Everything that a run depends on, apart from installed packages; make it by `of` or `from_dict`.

    Attributes:
        setup: body, or bodies, task and settings.
        algorithm: name, or `module:name`; see `algorithms.algorithm`.
        hyperparameters: of the algorithm, a frozen dataclass.
        seed: of all random numbers.
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
        """Return a configuration with the algorithm's defaults for all that is not given.

        Args:
            setup: body, or bodies, task and settings by which the policy is judged.
            algorithm, seed, steps, evaluate_every, prior: see `Configuration`.
            hyperparameters: those that differ from the algorithm's. Where `start` names a policy of one body,
                `network` and `hidden` are that policy's, unless they are given.
            training: settings of the task in training alone, such as kicks or a curriculum.

        Raises:
            ValueError: an unknown algorithm or hyperparameter, a value out of its range, or a damaged policy to start
                from.
        """
        given = hyperparameters or {}
        definition = algorithms.algorithm(algorithm).with_hyperparameters(given)
        start = getattr(definition.hyperparameters, "start", "")
        if start and not setup.several and not {"network", "hidden"} <= given.keys():
            definition = definition.with_hyperparameters({**network_hyperparameters(start), **given})
        if setup.several and not definition.several:
            those = ", ".join(name for name, each in algorithms.ALGORITHMS.items() if each.several)
            raise ValueError(f"algorithm {algorithm}: learns with one body, got {setup.robot}; with several: {those}")
        left_out = getattr(definition.hyperparameters, "exclude_blocks", ())
        if setup.several and set(left_out) - set(BLOCKS_LEFT_OUT):
            raise ValueError(f"exclude_blocks: expected none with several bodies, got {', '.join(left_out)}")
        steps = definition.steps_of(setup) if steps is None else steps
        evaluate_every = definition.evaluate_every if evaluate_every is None else evaluate_every
        checks.integer("seed", seed, 0, MAX_RUN_SEED)
        checks.integer("steps", steps, 1)
        checks.integer("evaluate_every", evaluate_every, 1)
        if not isinstance(prior, str | None):
            raise ValueError(f"prior: expected the id of a dataset, got {checks.preview(prior)}")
        training = checks.mapping("training", training)
        _check_training(setup, definition, training)
        text = checks.json_text("training", dict(training))
        algorithm = registry.importable_name("algorithm", registry.bare_name(algorithm))
        hyperparameters = _with_modules(definition.hyperparameters)
        return cls(setup, algorithm, hyperparameters, seed, steps, evaluate_every, prior, text)

    @property
    def training(self) -> dict[str, Any]:
        """Settings of the task in training that differ from those of `setup`; a new dictionary."""
        return json.loads(self.training_json)

    @property
    def policy_setup(self) -> Setup:
        """Setup of the policy: `setup`, whose task leaves out the blocks that networks do not see."""
        return self.setup.with_settings(self._excluded())

    @property
    def training_setup(self) -> Setup:
        """Setup in which the algorithm learns: that of the policy, with the settings of training.

        Raises:
            ValueError: a setting that does not fit, or one by which observations or actions are others.
        """
        judged, found = self.policy_setup, self.policy_setup.with_settings(self.training)
        if found != judged:
            here, there = found.definition, judged.definition
            if (here.sizes, here.actions) != (there.sizes, there.actions):
                others = "other observations or actions than those that it is judged by"
                raise ValueError(f"training: expected settings of the same observations and actions, got {others}")
        return found

    def _excluded(self) -> dict[str, Any]:
        """Setting of the blocks that networks do not see: those of the task, then those of the hyperparameters."""
        names = getattr(self.hyperparameters, "exclude_blocks", ())
        if not names or self.setup.several:  # the inputs of several bodies are always the same
            return {}
        there = self.setup.judging().definition.sizes
        own = self.setup.excluded_blocks
        found = [*own, *(name for name in names if name in there and name not in own)]
        return {"exclude_blocks": found} if found else {}

    @property
    def validation(self) -> Setup:
        """Setup in which the policy is evaluated while it learns."""
        return self.setup.validation(evaluation.CURVE_EPISODES)

    @property
    def definition(self) -> algorithms.Algorithm:
        """The algorithm, with these hyperparameters."""
        return algorithms.algorithm(self.algorithm)._replace(hyperparameters=self.hyperparameters)

    def context(
        self, folder: str | os.PathLike, threads: int = 1, checkpoint: Mapping[str, np.ndarray] | None = None
    ) -> RunContext:
        """Return what the learner is given; see `RunContext`.

        Raises:
            ValueError: as `training_setup`.
        """
        own = {name: getattr(self, name) for name in ("setup", "seed", "steps", "evaluate_every", "prior")}
        return RunContext(
            **own, training=self.training_setup, folder=Path(folder), threads=threads, checkpoint=checkpoint
        )

    @property
    def name(self) -> str:
        """Name of the run's folder, if no other is given."""
        return f"{self.setup.name}-{self.setup.kind.name}-{self.algorithm}-{self.seed}".replace(":", ".")

    @property
    def command(self) -> str:
        """Command line that trains the same policy; hyperparameters that are the algorithm's own are left out."""
        usual = dataclasses.asdict(algorithms.algorithm(self.algorithm).hyperparameters)
        changed = {n: v for n, v in dataclasses.asdict(self.hyperparameters).items() if v != usual[n]}
        names = ("task", "algorithm", "steps", "seed", "evaluate_every", *["prior"] * (self.prior is not None))
        flags = [f"--{name}={getattr(self.setup if name == 'task' else self, name)}" for name in names]
        for flag, values in (("set", self.setup.task_kwargs), ("train_set", self.training), ("hp", changed)):
            flags += [f"--{flag}={n}={v if isinstance(v, str) else json.dumps(v)}" for n, v in values.items()]
        return shlex.join(["arc-suite", "train", f"--robot={self.setup.robot}", *flags])

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as files hold it, JSON-able."""
        own = {"algorithm": self.algorithm, "hyperparameters": dataclasses.asdict(self.hyperparameters)}
        own |= {name: getattr(self, name) for name in ("seed", "steps", "evaluate_every", "prior", "training")}
        return self.setup.to_dict() | own

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Return the configuration of a file; no module that it names is imported.

        Args:
            fields: those of `to_dict` or `record`; all but `robot` have defaults.

        Raises:
            NotImported: the module of a name has not been imported yet.
            ValueError: an unknown field, or a value that does not fit.
            OSError: the file of a body cannot be read.
        """
        for name in fields:
            checks.name(name, (*CONFIGURATION_FIELDS, *PROVENANCE_FIELDS), "field of a configuration")
        if "robot" not in fields:
            raise ValueError("expected a robot, got none")
        for kind, name in _registered_names(fields):
            registry.refuse_import(kind, name)
        setup = Setup.of(fields["robot"], fields.get("task", "walk"), fields.get("task_kwargs"))
        return cls.of(setup, **{name: fields[name] for name in _OWN if name in fields})

    @property
    def modules(self) -> tuple[str, ...]:
        """Modules that register what it names, for processes that read it from a file."""
        names = [name for _, name in _registered_names(self.to_dict())]
        return tuple(dict.fromkeys(name.rpartition(":")[0] for name in names if ":" in name))

    def record(self) -> dict[str, Any]:
        """Return, JSON-able, `to_dict` with hashes and versions of all that computes.

        Raises:
            ValueError: a setting of the task that does not fit.
        """
        provenance = self.setup.provenance()
        packages = {name: versions.version_of(name) for name in ("jax", "jaxlib", "optax")}
        own = {"episodes": evaluation.CURVE_EPISODES, "versions": provenance["versions"] | packages}
        return self.to_dict() | provenance | own | self._views()

    def _views(self) -> dict[str, int]:
        """Return the version of what legs see, of a run whose legs see blocks that earlier versions did not turn."""
        if getattr(self.hyperparameters, "network", "") != "legs" or self.setup.several:
            return {}
        seen = [*self.policy_setup.definition.blocks, *getattr(self.hyperparameters, "critic_blocks", ())]
        return {LEG_VIEWS: leg_views.VERSION} if set(seen) - set(leg_views.TURNED_BEFORE) else {}


def _registered_names(fields: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield kind and name of all that other packages may have registered, in the fields of a configuration.

    Raises:
        ValueError: hyperparameters or settings that are no mappings.
    """
    hyperparameters = checks.mapping("hyperparameters", fields.get("hyperparameters"))
    names = [("robot", name) for name in _names_of_bodies(fields.get("robot"))]
    names += [("task", fields.get("task")), ("algorithm", fields.get("algorithm"))]
    for key in ("task_kwargs", "training"):
        settings = checks.mapping(key, fields.get(key))
        names += [("arena", settings.get("arena")), *(("modifier", name) for name in settings)]
    names += [(kind, hyperparameters.get(field)) for field, kind in _NAMES_IN_HYPERPARAMETERS.items()]
    yield from ((kind, name) for kind, name in names if isinstance(name, str))


def _names_of_bodies(robot) -> list[str]:
    return registry.names_in_robot(robot) if isinstance(robot, str) else []


def _with_modules(hyperparameters):
    """Return hyperparameters whose names of other packages have their modules, as other processes look them up."""
    changes = {}
    for field, kind in _NAMES_IN_HYPERPARAMETERS.items():
        name = getattr(hyperparameters, field, None)
        if isinstance(name, str) and registry.bare_name(name) in registry.ADDITIONS[kind]:
            changes[field] = registry.importable_name(kind, registry.bare_name(name))
    return dataclasses.replace(hyperparameters, **changes)


def network_hyperparameters(start: str | os.PathLike) -> dict[str, Any]:
    """Return the hyperparameters of the network of a policy file; none if there is no file, as a run may resume."""
    try:
        graph = network.load(start).graph
    except OSError:
        return {}
    operators = {node.operator: node.inputs for node in reversed(graph.nodes)}  # of the first node of each operator
    if "Linear" not in operators:
        return {}
    width = graph.arrays[str(operators["Linear"][-1])].size
    return {"network": "legs" if "Product" in operators else "perceptron", "hidden": width}


def _check_training(setup: Setup, definition: algorithms.Algorithm, training: Mapping[str, Any]) -> None:
    """Raise ValueError for settings of training that nothing would follow, and for a curriculum that judges."""
    if setup.task_kwargs.get(CURRICULUM[0]):
        raise ValueError(
            f"setting {CURRICULUM[0]}: expected among the settings of training (--train_set), as an evaluation would "
            f"begin at the first level, got {checks.preview(setup.task_kwargs[CURRICULUM[0]])}"
        )
    if training and not definition.acts:
        raise ValueError(f"training: expected no settings, as the algorithm makes no step, got {', '.join(training)}")
    for name in training:
        if name in ("random", "exclude_blocks"):
            other = "as every run has a seed" if name == "random" else "as it is a hyperparameter"
            raise ValueError(f"training: setting {name}: expected none, {other}, got {checks.preview(training[name])}")


def read(path: Path) -> Configuration:
    """Return the configuration in a JSON file, such as `config.json` of a run's folder.

    Raises:
        NotImported: the module of a name has not been imported yet.
        ValueError: no configuration.
        OSError: the file cannot be read.
    """
    try:
        with files.reading(path):
            found = files.read_json(path)
        return Configuration.from_dict(checks.mapping("configuration", found))
    except registry.NotImported as error:
        raise registry.NotImported(f"{path}: {error}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {checks.quote(error)}") from None
