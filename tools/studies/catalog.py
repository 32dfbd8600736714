"""The project's own studies by name.

Each names its robots, algorithms and tasks one by one: what else is registered, or comes later, is in none of them, so
that a finished study stays finished.
"""

import itertools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from arc_suite import checks
from arc_suite.learning.agents import algorithms
from arc_suite.learning.studies import tables
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS
from arc_suite.learning.studies.tables import Prior, Run, Study, run
from studies import committed

_PAPERS_ALGORITHMS = ("sac", "sacfd", "speq", "speq_o2o", "sope_eo", "sope")
_WITH_PRIOR = ("sacfd", "speq_o2o", "sope")


def runs_of_the_paper(
    robots: Iterable[str],
    steps: int,
    seeds: int,
    prior: Prior,
    phases: Mapping[str, Any] | None = None,
    names: Iterable[str] = _PAPERS_ALGORITHMS,
    **fields: Any,
) -> tuple[Run, ...]:
    """Return runs of the paper's six algorithms, those of one seed before those of the next.

    Args:
        robots: names.
        steps: environment steps of every run.
        seeds: number of seeds.
        prior: data of the algorithms that take any.
        phases: hyperparameters of the algorithms that have stabilization phases.
        names: names of the algorithms, for fewer than six.
        **fields: others of `run`.
    """
    runs = []
    for seed, robot, name in itertools.product(range(seeds), robots, names):
        has_phases = algorithms.ALGORITHMS[name].hyperparameters.phase_updates > 0
        fields_of_algorithm = {
            "prior": prior if name in _WITH_PRIOR else None,
            "hyperparameters": phases if has_phases else None,
        }
        runs.append(run(robot, name, steps, seed, **fields_of_algorithm, **fields))
    return tuple(runs)


# A tenth of the published phases, of the interval of their checks, and of the patience.
_SHORT_PHASES = {"phase_updates": 7500, "check_every": 100, "patience": 1000}

# `sac_parallel` with all parts, then without one of them.
_PARTS = {
    "sac_parallel": {},
    "sac_parallel-raw": {"normalize": False},
    "sac_parallel-contacts": {"exclude_blocks": []},
    "sac_parallel-unmirrored": {"symmetry_augmentation": False},
    "sac_parallel-8-environments": {"num_envs": 8},
    "sac_parallel-one-step": {"n_step": 1},
}


def _steps_from_nothing(task: str) -> int:
    """Return the steps of the division top as they were while `gaps` was no place of the benchmark."""
    return DIVISIONS["top"].steps if task == "gaps" else DIVISIONS["top"].steps_in(task)


def _run_with_forces(robot: str, steps: int, seed=0, task="walk", label="ppo-forces", **fields: Any) -> Run:
    """Return a run of `ppo` as it was once: a perceptron of 256 units, which sees contact forces."""
    hyperparameters = {"exclude_blocks": [], "network": "perceptron", "hidden": 256, "minibatch": 1024}
    return run(robot, "ppo", steps, seed, task, hyperparameters=hyperparameters, label=label, **fields)


# `sac_parallel` with prior data, or with phases: label, changed hyperparameters, prior data.
_WITH_ADDITIONS = (
    ("sac_parallel", {}, None),
    ("sac_parallel-medium", {"prior": "symmetric_sampling"}, Prior("medium", 100)),
    ("sac_parallel-refined", {"prior": "symmetric_sampling"}, Prior("refined", 100)),
    ("sac_parallel-phases", _SHORT_PHASES, None),
)
# `ppo` by the label of its network.
_NETWORKS = {"ppo": {}, "ppo-perceptron": {"network": "perceptron"}}
_UNEVEN_TASKS = ("rough", "slopes", "stairs", "navigate")  # tasks of uneven ground or pillars, without trenches
# Tasks of the study from nothing; `walk` has studies of its own.
# Places of the benchmark while `stairs` was one in place of `gaps`.
_PLACES_BEFORE_GAPS = tuple(("queen", "stairs") if place == ("queen", "gaps") else place for place in PLACES)
_TASKS_FROM_NOTHING = ("steer", "rough", "slopes", "stairs", "gaps", "course", "shoved", "limp", "roam", "navigate")
_ROBOTS = ("queen", "bastion", "tick", "leaper")
_TICK_FIRST = ("tick", "leaper", "queen", "bastion")

# The paper's own study is `paper`: 3,000 hours of a core. The others fit fewer hours.
STUDIES = {
    "paper": Study("the paper's six algorithms as published", runs_of_the_paper(_ROBOTS, 1_000_000, 5, Prior())),
    "exact-tick": Study("phases as published, 100,000 steps", runs_of_the_paper(("tick",), 100_000, 1, Prior())),
    # SAC and SACfD have no phases: they are as published, and run on all four robots. Second seeds come last.
    "short": Study(
        "short phases: 7,500 updates in place of 75,000",
        tuple(
            sorted(
                (
                    *runs_of_the_paper(("tick", "leaper"), 100_000, 2, Prior(), _SHORT_PHASES),
                    *runs_of_the_paper(("queen", "bastion"), 100_000, 1, Prior(), names=("sac", "sacfd")),
                ),
                key=lambda paper_run: paper_run.configuration.seed,
            )
        ),
    ),
    # A quarter to half an hour of a core a run.
    "first-steps": Study(
        "the first 50,000 steps, short phases: 7,500 updates in place of 75,000, prior data of 100 episodes",
        runs_of_the_paper(("tick",), 50_000, 1, Prior(episodes=100), _SHORT_PHASES, evaluate_every=5000),
    ),
    # Demonstrators that the paper did not have.
    "refined-prior": Study(
        "prior data of the demonstrators with refined numbers in place of medium, short phases: 7,500 updates",
        tuple(
            paper_run._replace(label=f"{paper_run.kind}-refined")
            for paper_run in runs_of_the_paper(("tick",), 100_000, 1, Prior("refined"), _SHORT_PHASES, _WITH_PRIOR)
        ),
    ),
    # Half a minute of a core a run, two on `gaps`.
    "imitation": Study(
        "imitation of the demonstrators by DAgger",
        (
            *(run(robot, "dagger", 25_600) for robot in _ROBOTS),
            *(run(robot, "dagger", 38_400, task="steer", evaluate_every=38_400) for robot in _ROBOTS),
            *(run("tick", "dagger", 38_400, task=task, evaluate_every=38_400) for task in _UNEVEN_TASKS),
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
            *(_run_with_forces("tick", _steps_from_nothing(task), task=task) for task in _TASKS_FROM_NOTHING),
            # Without a curriculum it learns to stand at the first trench.
            _run_with_forces(
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
            for kind, seed, robot in itertools.product(("sac_parallel", "sac_parallel-one-step"), range(3), _TICK_FIRST)
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
            for robot, (label, changes, prior) in itertools.product(("tick", "leaper"), _WITH_ADDITIONS)
        ),
    ),
    # Noise falls over a run: a short one is no part of a long one. One to three minutes of a core a run.
    "schedules": Study(
        "PPO with schedules of 200,000 and 400,000 steps",
        tuple(
            run(robot, "ppo", steps, evaluate_every=steps, label=f"ppo-{steps // 1000}k")
            for steps, robot in itertools.product((200_000, 400_000), _TICK_FIRST)
        ),
    ),
    # What the network that legs share gives: ten minutes of a core a run.
    "legs": Study(
        "PPO on Tick with the network that legs share, and with a perceptron of its width and minibatch",
        tuple(
            run("tick", "ppo", 1_000_000, seed, task, hyperparameters=changes, label=label)
            for seed, task, (label, changes) in itertools.product(
                range(SEEDS), ("walk", "steer", "navigate", "directed"), _NETWORKS.items()
            )
        ),
    ),
    "ppo-forces": Study(
        "division top of the benchmark: PPO with contact forces and 256 units",
        tuple(
            _run_with_forces(robot, DIVISIONS["top"].steps_in(task), seed, task)
            for seed, (robot, task) in itertools.product(range(SEEDS), _PLACES_BEFORE_GAPS)
        ),
    ),
}


def study(name: str) -> Study:
    """Return the study of a name, or of `<division>-<algorithm>` of the benchmark.

    Raises:
        ValueError: there is none.
    """
    if name.partition("-")[0] in DIVISIONS:
        return tables.study(name)
    return STUDIES[checks.name(name, STUDIES, "study")]


def committed_study(name: str, published: Path) -> Study:
    """Return the study of a name, for a report of its tables; algorithms of other packages need not be registered.

    Args:
        name: name of the study.
        published: folder of its tables.

    Raises:
        ValueError: there is none, or a damaged table.
        OSError: a table cannot be read.
    """
    division, _, learner = name.partition("-")
    is_folder_name = tables.folder_name(name) == name  # `module:attribute` names an algorithm that can be imported
    if division in DIVISIONS and learner not in algorithms.ALGORITHMS and is_folder_name and published.is_dir():
        return committed.read(name, published)
    return study(name)
