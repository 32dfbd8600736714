"""Studies by name: tables of runs."""

import collections
import itertools
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.cpg.selection import suited_preset
from arc_suite.data import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

_EPISODES = 1000  # of prior data, as in the paper
_LATER = (
    "walk",
    "directed",
    "leap",
)  # no tasks of the study from nothing: walk has studies of its own, others none yet


class Prior(NamedTuple):
    """Prior data: episodes of the body's demonstrator in the task of the run.

    Attributes:
        preset: of the demonstrator.
        episodes: number of episodes.
    """

    preset: str = "medium"
    episodes: int = _EPISODES

    def settings(self, setup: Setup) -> DatasetSettings:
        """Return the settings of the dataset."""
        return DatasetSettings(setup, "cpg", (self.preset,))

    def dataset_id(self, setup: Setup) -> str:
        """Return the id of the dataset."""
        whole = self.settings(setup).dataset_id()
        few = f"-{self.episodes}episodes-v0"
        return whole if self.episodes == _EPISODES else whole.removesuffix("-v0") + few


class Run(NamedTuple):
    """A run of a study; `run` makes it.

    Attributes:
        configuration: of the training.
        label: name of its kind in the report; empty for the algorithm.
        prior: data that are collected before the run; None for none.
    """

    configuration: Configuration
    label: str = ""
    prior: Prior | None = None

    @property
    def kind(self) -> str:
        """Name of this run and its other seeds."""
        return self.label or self.configuration.algorithm

    @property
    def name(self) -> str:
        """Name of its folder."""
        setup, seed = self.configuration.setup, self.configuration.seed
        return folder_name(f"{setup.body.name}-{setup.kind.name}-{self.kind}-{seed}")

    @property
    def place(self) -> str:
        """Robot, task and settings of its evaluations, by which results are grouped."""
        return str(self.configuration.validation)


def run(
    robot: str,
    algorithm: str,
    steps: int,
    seed: int = 0,
    task: str = "walk",
    task_kwargs: Mapping[str, Any] | None = None,
    hyperparameters: Mapping[str, Any] | None = None,
    prior: Prior | None = None,
    evaluate_every: int | None = None,
    label: str = "",
    training: Mapping[str, Any] | None = None,
) -> Run:
    """Return a run.

    Args:
        robot: name of a robot, or `module:name`.
        algorithm, steps, seed, hyperparameters, evaluate_every, training: see `Configuration.of`.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`.
        prior: prior data; None for none.
        label: name of its kind in the report; empty for the algorithm.

    Raises:
        ValueError: an unknown robot, task, algorithm or hyperparameter.
    """
    setup = Setup.of(robot, task, task_kwargs)
    dataset = None if prior is None else prior.dataset_id(setup)
    configuration = Configuration.of(setup, algorithm, hyperparameters, seed, steps, evaluate_every, dataset, training)
    return Run(configuration, label, prior)


class Study(NamedTuple):
    """A study.

    Attributes:
        title: of its report; names what is not as in the paper.
        runs: the most urgent first.
    """

    title: str
    runs: tuple[Run, ...]


_SIX = ("sac", "sacfd", "speq", "speq_o2o", "sope_eo", "sope")
_PRIOR = ("sacfd", "speq_o2o", "sope")


def six(
    robots: Iterable[str],
    steps: int,
    seeds: int,
    prior: Prior,
    phases: Mapping[str, Any] | None = None,
    names=_SIX,
    **fields,
) -> tuple[Run, ...]:
    """Return runs of the paper's six algorithms, those of one seed before those of the next.

    Args:
        robots: names.
        steps: environment steps of every run.
        seeds: number of seeds.
        prior: data of the algorithms that take any.
        phases: hyperparameters of the algorithms that have stabilization phases.
        names: of the algorithms, for fewer than six.
        **fields: others of `run`.
    """
    own = {name: {"prior": prior if name in _PRIOR else None} for name in names}
    for name in names:
        own[name]["hyperparameters"] = phases if algorithms.ALGORITHMS[name].hyperparameters.phase_updates else None
    each = itertools.product(range(seeds), robots, names)
    return tuple(run(robot, name, steps, seed, **own[name], **fields) for seed, robot, name in each)


# A tenth of the published phases, of the interval of their checks, and of the patience.
_SHORT = {"phase_updates": 7500, "check_every": 100, "patience": 1000}

# `sac_parallel` with all parts, then without one of them.
_PARTS = {
    "sac_parallel": {},
    "sac_parallel-raw": {"normalize": False},
    "sac_parallel-contacts": {"exclude_blocks": []},
    "sac_parallel-unmirrored": {"symmetry_augmentation": False},
    "sac_parallel-8-environments": {"num_envs": 8},
    "sac_parallel-one-step": {"n_step": 1},
}


def _seeing_forces(robot, steps, seed=0, task="walk", label="ppo-forces", **fields) -> Run:
    """A run of `ppo` as it was once: a perceptron of 256 units, which sees contact forces."""
    own = {"exclude_blocks": [], "network": "perceptron", "hidden": 256, "minibatch": 1024}
    return run(robot, "ppo", steps, seed, task, hyperparameters=own, label=label, **fields)


# `sac_parallel` with prior data, or with phases.
_ADDED = (
    ("sac_parallel", {}, None),
    ("sac_parallel-medium", {"prior": "symmetric_sampling"}, Prior("medium", 100)),
    ("sac_parallel-refined", {"prior": "symmetric_sampling"}, Prior("refined", 100)),
    ("sac_parallel-phases", _SHORT, None),
)
_UNEVEN = ("rough", "slopes", "stairs", "navigate")  # tasks of uneven ground or pillars, without trenches
_ROBOTS = ("tick", "leaper", "queen", "bastion")

# The paper's own study is `paper`: 3,000 hours of a core. The others fit fewer hours.
STUDIES = {
    "paper": Study("the paper's six algorithms as published", six(ROBOTS, 1_000_000, 5, Prior())),
    "exact-tick": Study("phases as published, 100,000 steps", six(("tick",), 100_000, 1, Prior())),
    # SAC and SACfD have no phases: they are as published, and run on all four robots. Second seeds come last.
    "short": Study(
        "short phases: 7,500 updates in place of 75,000",
        tuple(
            sorted(
                (
                    *six(("tick", "leaper"), 100_000, 2, Prior(), _SHORT),
                    *six(("queen", "bastion"), 100_000, 1, Prior(), names=("sac", "sacfd")),
                ),
                key=lambda each: each.configuration.seed,
            )
        ),
    ),
    # A quarter to half an hour of a core a run.
    "first-steps": Study(
        "the first 50,000 steps, short phases: 7,500 updates in place of 75,000, prior data of 100 episodes",
        six(("tick",), 50_000, 1, Prior(episodes=100), _SHORT, evaluate_every=5000),
    ),
    # Demonstrators that the paper did not have.
    "refined-prior": Study(
        "prior data of the demonstrators with refined numbers in place of medium, short phases: 7,500 updates",
        tuple(
            each._replace(label=f"{each.kind}-refined")
            for each in six(("tick",), 100_000, 1, Prior("refined"), _SHORT, _PRIOR)
        ),
    ),
    # Half a minute of a core a run, two on `gaps`.
    "imitation": Study(
        "imitation of the demonstrators by DAgger",
        (
            *(run(robot, "dagger", 25_600) for robot in ROBOTS),
            *(run(robot, "dagger", 38_400, task="steer", evaluate_every=38_400) for robot in ROBOTS),
            *(run("tick", "dagger", 38_400, task=task, evaluate_every=38_400) for task in _UNEVEN),
            # A foot misses a trench in a few steps of an episode alone: that takes more episodes.
            run("tick", "dagger", 153_600, task="gaps", evaluate_every=76_800),
        ),
    ),
    # `ppo`, then as it was, with the steps of the division `top`.
    "from-nothing": Study(
        "PPO from nothing in the other tasks, Tick; then as it was, with contact forces",
        (
            *(
                run("tick", "ppo", 1_000_000, task=task, evaluate_every=200_000)
                for task in ("limp", "roam", "course", "gaps")
            ),
            # A leg that fails keeps it from learning: it learns without, and is judged with it.
            run(
                *("tick", "ppo", 1_000_000, 0, "limp"),
                evaluate_every=200_000,
                label="ppo-undisturbed",
                training={"actuator_failure": False},
            ),
            *(
                _seeing_forces("tick", DIVISIONS["top"].steps_in(task), task=task)
                for task in TASKS
                if task not in _LATER
            ),
            # Without a curriculum it learns to stand at the first trench.
            _seeing_forces(
                *("tick", DIVISIONS["top"].far_steps, 0, "gaps"),
                label="ppo-curriculum-forces",
                training={"curriculum": True},
            ),
        ),
    ),
    # Four to six minutes of a core a run. One-step returns learn faster on some seeds, and fall on others.
    "parallel": Study(
        "SAC from nothing in parallel environments, 100,000 steps, with returns of three steps and of one",
        tuple(
            run(robot, "sac_parallel", 100_000, seed, hyperparameters=_PARTS[kind], label=kind)
            for kind, seed, robot in itertools.product(("sac_parallel", "sac_parallel-one-step"), range(3), _ROBOTS)
        ),
    ),
    # What each part of it gives.
    "parallel-parts": Study(
        "SAC in parallel environments with all its parts and without one, 60,000 steps",
        tuple(
            run(robot, "sac_parallel", 60_000, seed, hyperparameters=changes, label=label)
            for seed, robot, (label, changes) in itertools.product(range(2), ("tick", "leaper"), _PARTS.items())
        ),
    ),
    # The paper's two ideas on a learner that learns without them.
    "parallel-prior": Study(
        "SAC in parallel environments with prior data of 100 episodes, or short phases, 60,000 steps",
        tuple(
            run(robot, "sac_parallel", 60_000, hyperparameters=changes, prior=prior, label=label)
            for robot, (label, changes, prior) in itertools.product(("tick", "leaper"), _ADDED)
        ),
    ),
    "ppo-forces": Study(
        "division top of the benchmark: PPO with contact forces and 256 units",
        tuple(
            _seeing_forces(robot, DIVISIONS["top"].steps_in(task), seed, task)
            for seed, (robot, task) in itertools.product(range(SEEDS), PLACES)
        ),
    ),
}


def benchmark(division: str, algorithm: str) -> Study:
    """Return the study of an algorithm on a division of the benchmark: all places with the first seed, then the others.

    Raises:
        ValueError: an unknown division or algorithm, or one that learns from something else than the division gives.
    """
    rule = DIVISIONS[checks.name(division, DIVISIONS, "division")]
    if (source := algorithms.algorithm(algorithm).source) != rule.source:
        fit = ", ".join(name for name, each in algorithms.ALGORITHMS.items() if each.source == rule.source)
        what = f"algorithm {algorithm} learns from {source}, and the division {division} takes those that learn from"
        raise ValueError(f"{what} {rule.source}: {fit}")
    runs = []
    for seed, (robot, task) in itertools.product(range(SEEDS), PLACES):
        prior = Prior(_collects(robot, task), rule.episodes) if rule.episodes else None
        runs.append(run(robot, algorithm, rule.steps_in(task), seed, task, prior=prior))
    return Study(f"division {division} of the benchmark: {algorithm}", tuple(runs))


def _collects(robot: str, task: str) -> str:
    """The preset that collects prior data of a place: on `walk` that of the paper, elsewhere the one that suits."""
    return "medium" if task == "walk" else suited_preset(Setup.of(robot, task).definition)


def folder_name(name: str) -> str:
    """Return the name of a folder, without the colon of `module:attribute`."""
    return name.replace(":", ".")


def study(name: str) -> Study:
    """Return the study of a name, of `<division>-<algorithm>`, or of `module:attribute`, a `Study` on Python's path.

    Raises:
        ValueError: there is none, or two of its runs have one name.
    """
    division, _, algorithm = name.partition("-")
    if division in DIVISIONS:
        return benchmark(division, algorithm)
    found = checks.imported(name, "study") if ":" in name else STUDIES[checks.name(name, STUDIES, "study")]
    if not isinstance(found, Study):
        raise ValueError(f"study {checks.shown(name)}: expected a Study, got {type(found).__name__}")
    for each, count in collections.Counter(each.name for each in found.runs).items():
        if count > 1:
            raise ValueError(f"study {checks.shown(name)}: {count} runs are named {each}; a label tells them apart")
    return found
