"""Studies: tables of runs, from which curves and comparisons are made."""

import collections
import itertools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from arc_suite import checks, registry
from arc_suite.agents import algorithms
from arc_suite.agents.training import Run
from arc_suite.data import Settings
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body

_EPISODES = 1000  # of prior data, as the paper has them


class Prior(NamedTuple):
    """The prior data of a run: episodes of the body's demonstrator in the task of the run.

    Attributes:
        preset: of the demonstrator.
        episodes: how many.
    """

    preset: str = "medium"
    episodes: int = _EPISODES


class Row(NamedTuple):
    """A run of a study; what it makes depends on nothing else.

    Attributes:
        robot: name of a robot, or `module:name`.
        algorithm: name, or `module:attribute`; see `algorithms.algorithm`.
        steps: environment steps.
        seed: of everything random.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`.
        numbers: of the algorithm's row that are others than its own.
        prior: None for none.
        evaluate_every: environment steps between evaluations; None for what the algorithm says.
        label: by which its kind is shown; empty for the algorithm.
    """

    robot: str
    algorithm: str
    steps: int
    seed: int = 0
    task: str = "walk"
    task_kwargs: Mapping[str, Any] = {}
    numbers: Mapping[str, Any] = {}
    prior: Prior | None = None
    evaluate_every: int | None = None
    label: str = ""

    @property
    def kind(self) -> str:
        """What its runs with all seeds are called."""
        return self.label or self.algorithm

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.robot}-{registry.task_of(self.task).name}-{self.kind}-{self.seed}".replace(":", ".")

    @property
    def body(self) -> Body:
        """The robot's, which may be `module:name` of one that another package has.

        Raises:
            ValueError: there is none; one line.
        """
        if ":" in self.robot:
            return registry.body_of(self.robot)
        return ROBOTS[checks.name(self.robot, ROBOTS, "robot")]

    @property
    def place(self) -> str:
        """The robot and what it does, with the settings of the task."""
        settings = f", {checks.json_text('task_kwargs', self.task_kwargs)}" if self.task_kwargs else ""
        return f"{self.robot}, {registry.task_of(self.task).name}{settings}"

    @property
    def prior_settings(self) -> Settings:
        """The settings of its prior data."""
        return Settings(self.body, "cpg", (self.prior.preset,), task=self.task, task_kwargs=self.task_kwargs)

    @property
    def prior_id(self) -> str | None:
        """Id of the dataset of its prior data; None for none."""
        if self.prior is None:
            return None
        whole = self.prior_settings.dataset_id()
        few = f"-{self.prior.episodes}episodes-v0"
        return whole if self.prior.episodes == _EPISODES else whole.removesuffix("-v0") + few

    def run(self) -> Run:
        """Return the run for `training.train`.

        Raises:
            ValueError: no such robot, algorithm or number; one line.
        """
        definition = algorithms.algorithm(self.algorithm).with_row(dict(self.numbers))
        places = self.task, self.task_kwargs, self.seed, self.steps, self.prior_id, self.evaluate_every
        return Run(self.body, self.algorithm, definition, *places)

    def arguments(self, folder: Path) -> list[str]:
        """Return the arguments of `arc-suite` that make the run.

        Args:
            folder: of the run.
        """
        given = ["train", f"--robot={self.robot}", f"--task={self.task}", f"--algorithm={self.algorithm}"]
        given += [f"--seed={self.seed}", f"--steps={self.steps}", f"--output={folder}", *self._settings()]
        given += [f"--row={name}={_text(name, value)}" for name, value in self.numbers.items()]
        given += [] if self.prior is None else [f"--prior={self.prior_id}"]
        return given + ([] if self.evaluate_every is None else [f"--evaluate_every={self.evaluate_every}"])

    def page_arguments(self, folder: Path) -> list[str]:
        """Return the arguments of `arc-suite` that make a page which plays the run's policy.

        Args:
            folder: of the run.
        """
        given = ["render", f"--robot={self.robot}", f"--task={self.task}", f"--policy={folder}", *self._settings()]
        return [*given, f"--output={self.name}.html"]

    def _settings(self) -> list[str]:
        return [f"--set={name}={_text(name, value)}" for name, value in self.task_kwargs.items()]


class Study(NamedTuple):
    """A study.

    Attributes:
        title: what its figures are to be called, with all that makes them others than the paper's.
        rows: its runs, those first that are wanted first.
    """

    title: str
    rows: tuple[Row, ...]


def _text(name: str, value: Any) -> str:
    return value if isinstance(value, str) else checks.json_text(name, value)


_SIX = ("sac", "sacfd", "speq", "speq_o2o", "sope_eo", "sope")
_PRIOR = ("sacfd", "speq_o2o", "sope")


def _has_phases(algorithm: str) -> bool:
    return algorithms.ALGORITHMS[algorithm].row.phase_updates > 0


def six(
    robots: Iterable[str], steps: int, seeds: int, prior: Prior, numbers: Mapping[str, Any] | None = None, **fields
) -> tuple[Row, ...]:
    """Return rows of the paper's six algorithms.

    Args:
        robots: names.
        steps: environment steps of every run.
        seeds: how many; all runs of one seed come before those of the next.
        prior: data of the algorithms that take any.
        numbers: changed in the rows of those that have stabilisation phases.
        **fields: others of every `Row`.
    """
    return tuple(
        Row(
            robot,
            name,
            steps,
            seed,
            prior=prior if name in _PRIOR else None,
            numbers=(numbers or {}) if _has_phases(name) else {},
            **fields,
        )
        for seed, robot, name in itertools.product(range(seeds), robots, _SIX)
    )


# A tenth of the published phases, of how often they are judged, and of the patience with them.
_SHORT = {"phase_updates": 7500, "check_every": 100, "patience": 1000}

# The paper's own study is `paper`: 3,000 hours of a core. The others are what fits fewer.
STUDIES = {
    "paper": Study("the paper's six algorithms as published", six(ROBOTS, 1_000_000, 5, Prior())),
    "exact-tick": Study("phases as published, 100,000 steps", six(("tick",), 100_000, 1, Prior())),
    # Those without phases, SAC and SACfD, are as published, and run on all four robots. Second seeds come last.
    "short": Study(
        "short phases: 7,500 updates in place of 75,000",
        tuple(
            sorted(
                (
                    *six(("tick", "leaper"), 100_000, 2, Prior(), _SHORT),
                    *(row for row in six(("queen", "bastion"), 100_000, 1, Prior()) if not _has_phases(row.algorithm)),
                ),
                key=lambda row: row.seed,
            )
        ),
    ),
    # A quarter to half an hour of a core a run.
    "first-steps": Study(
        "the first 50,000 steps, short phases: 7,500 updates in place of 75,000, prior data of 100 episodes",
        six(("tick",), 50_000, 1, Prior(episodes=100), _SHORT, evaluate_every=5000),
    ),
    # What demonstrators are good for that the paper did not have.
    "refined-prior": Study(
        "prior data of the demonstrators with refined numbers in place of medium, short phases: 7,500 updates",
        tuple(
            row._replace(label=f"{row.algorithm}-refined")
            for row in six(("tick",), 100_000, 1, Prior("refined"), _SHORT)
            if row.prior is not None
        ),
    ),
    # What learners make of tasks in which feedback pays.
    "tasks": Study(
        "what learners make of tasks in which feedback pays; prior data are 100 episodes",
        (
            *(
                row
                for task, preset in (("steer", "steered"), ("rough", "surefooted"))
                for row in (
                    Row("tick", "ppo", 1_000_000, task=task),
                    Row("tick", "sac", 50_000, task=task, evaluate_every=5000),
                    Row("tick", "sacfd", 50_000, task=task, evaluate_every=5000, prior=Prior(preset, 100)),
                )
            ),
            *(
                Row("tick", "imitation", 38_400, task=task, evaluate_every=38_400)
                for task in ("steer", "rough", "slopes", "stairs", "navigate")
            ),
            # Whether a foot misses a trench is told by a few steps of an episode: it takes more of them.
            Row("tick", "imitation", 153_600, task="gaps", evaluate_every=76_800),
            # Noise falls over the length of a run; on rough ground that of a million steps is gone before it walks.
            *(Row("tick", "ppo", 3_000_000, task=task, label="ppo-3M") for task in ("rough", "steer")),
        ),
    ),
    "beyond": Study(
        "beyond the paper: imitation of the demonstrators, and PPO from nothing",
        (
            *(Row(robot, "imitation", 25_600) for robot in ROBOTS),
            Row("queen", "imitation", 38_400, task="steer", evaluate_every=38_400),
            Row("queen", "ppo", 2_000_000, task="steer"),
            *(
                Row(robot, "ppo", 832_000 if robot == "tick" else 1_200_000, seed)
                for seed, robot in itertools.product(range(3), ROBOTS)
            ),
        ),
    ),
}


def folder_name(name: str) -> str:
    """Return what the folders of a study are called: its name, without the colon of `module:attribute`."""
    return name.replace(":", ".")


def study(name: str) -> Study:
    """Return the study of a name, or of `module:attribute`, a `Study` on Python's path.

    Raises:
        ValueError: there is none, or two of its rows have one name; one line.
    """
    found = _named(name)
    for row, count in collections.Counter(row.name for row in found.rows).items():
        if count > 1:
            raise ValueError(f"study {name!r}: {count} rows are named {row}; a label tells them apart")
    return found


def _named(name: str) -> Study:
    if ":" not in name:
        return STUDIES[checks.name(name, STUDIES, "study")]
    found = checks.imported(name, "study")
    if not isinstance(found, Study):
        raise ValueError(f"study {name!r}: expected a Study, got {type(found).__name__}")
    return found
