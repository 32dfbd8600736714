"""Configurations of runs: one value, read and written as JSON, from the flags or a study to the training."""

import dataclasses
import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from arc_suite import checks, evaluation, files, versions
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.learner import MOST_SEEDS

# Names in the file of a configuration.
_OWN = ("algorithm", "hyperparameters", "seed", "steps", "evaluate_every", "prior")
CONFIGURATION = ("robot", "task", "task_kwargs", *_OWN)
# Names in the record of a run that follow from its configuration, the data and the installed packages; `learner` is in
# records of earlier versions.
PRIOR_SHA256, TRAINING_SEEDS = "prior_sha256", "training_seeds"
OF_DATA = (PRIOR_SHA256, TRAINING_SEEDS)
PROVENANCE = ("task_version", "body_sha256", "model_sha256", "learner", "episodes", *OF_DATA, "versions")


@dataclasses.dataclass(frozen=True)
class Configuration:
    """Everything that a run depends on, apart from installed packages; make it by `of` or `from_dict`.

    Attributes:
        setup: body, or bodies, task and settings.
        algorithm: name, or `module:attribute`; see `algorithms.algorithm`.
        hyperparameters: of the algorithm, a frozen dataclass.
        seed: of all random numbers.
        steps: environment steps.
        evaluate_every: environment steps between evaluations.
        prior: id of a dataset of prior data; None for none.
    """

    setup: Setup
    algorithm: str
    hyperparameters: Any
    seed: int
    steps: int
    evaluate_every: int
    prior: str | None = None

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
    ) -> Self:
        """Return a configuration with the algorithm's defaults for all that is not given.

        Raises:
            ValueError: an unknown algorithm or hyperparameter, or a value out of its range.
        """
        definition = algorithms.algorithm(algorithm).with_hyperparameters(hyperparameters or {})
        if setup.several and not definition.several:
            those = ", ".join(name for name, each in algorithms.ALGORITHMS.items() if each.several)
            raise ValueError(f"algorithm {algorithm}: learns with one body, got {setup.robot}; with several: {those}")
        steps = definition.steps_of(setup) if steps is None else steps
        evaluate_every = definition.evaluate_every if evaluate_every is None else evaluate_every
        checks.integer("seed", seed, 0, MOST_SEEDS)
        checks.integer("steps", steps, 1)
        checks.integer("evaluate_every", evaluate_every, 1)
        if not isinstance(prior, str | None):
            raise ValueError(f"prior: expected the id of a dataset, got {checks.shown(prior)}")
        return cls(setup, algorithm, definition.hyperparameters, seed, steps, evaluate_every, prior)

    @property
    def validation(self) -> Setup:
        """Setup in which the policy is evaluated while it learns."""
        return self.setup.validation(evaluation.CURVE_EPISODES)

    @property
    def definition(self) -> algorithms.Algorithm:
        """The algorithm, with these hyperparameters."""
        return algorithms.algorithm(self.algorithm)._replace(hyperparameters=self.hyperparameters)

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
        for flag, values in (("set", self.setup.task_kwargs), ("hp", changed)):
            flags += [f"--{flag}={n}={v if isinstance(v, str) else json.dumps(v)}" for n, v in values.items()]
        return shlex.join(["arc-suite", "train", f"--robot={self.setup.robot}", *flags])

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as files hold it, JSON-able."""
        own = {"algorithm": self.algorithm, "hyperparameters": dataclasses.asdict(self.hyperparameters)}
        own |= {name: getattr(self, name) for name in ("seed", "steps", "evaluate_every", "prior")}
        return self.setup.to_dict() | own

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Return the configuration of a file; modules that it names are imported.

        Args:
            fields: those of `to_dict` or `record`; all but `robot` have defaults.

        Raises:
            ValueError: an unknown field, or a value that does not fit.
            OSError: the file of a body cannot be read.
        """
        for name in fields:
            checks.name(name, (*CONFIGURATION, *PROVENANCE), "field of a configuration")
        if "robot" not in fields:
            raise ValueError("expected a robot, got none")
        checks.mapping("hyperparameters", fields.get("hyperparameters"))
        setup = Setup.of(fields["robot"], fields.get("task", "walk"), fields.get("task_kwargs"))
        return cls.of(setup, **{name: fields[name] for name in _OWN if name in fields})

    def record(self) -> dict[str, Any]:
        """Return, JSON-able, `to_dict` with hashes and versions of all that computes.

        Raises:
            ValueError: a setting of the task that does not fit.
        """
        provenance = self.setup.provenance()
        packages = {name: versions.installed(name) for name in ("jax", "jaxlib", "optax")}
        own = {"episodes": evaluation.CURVE_EPISODES, "versions": provenance["versions"] | packages}
        return self.to_dict() | provenance | own


def read(path: Path) -> Configuration:
    """Return the configuration in a JSON file, such as `config.json` of a run's folder.

    Raises:
        ValueError: no configuration.
        OSError: the file cannot be read.
    """
    try:
        with files.reading(path):
            found = files.read_json(path)
        return Configuration.from_dict(checks.mapping("configuration", found))
    except ValueError as error:
        raise ValueError(f"{path}: {checks.quoted(error)}") from None
