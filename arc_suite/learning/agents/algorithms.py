"""Algorithms by name: hyperparameters of learners. Nothing here needs JAX."""

import dataclasses
import functools
import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, registry, usage, versions
from arc_suite.arenas import FLAT
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.hyperparameters import (
    BLOCKS_LEFT_OUT,
    DEVICE_DEFAULTS,
    BehaviorCloning,
    DAgger,
    DeviceDefaults,
    ProximalPolicy,
    SoftActorCritic,
)


class Algorithm(NamedTuple):
    """An algorithm.

    Attributes:
        learn: the learner, a function of hyperparameters and context; see `arc_suite.learning.agents`.
        hyperparameters: a frozen dataclass.
        summary: a line for people.
        evaluate_every: environment steps between evaluations, by default.
        steps: environment steps of a run, by default.
        terrain_steps: environment steps of a run in any arena except the flat one, by default; None for `steps`.
        extends: whether a run can be extended to more steps, as no schedule depends on them.
        source: what it learns from in addition to its own steps, one of `usage.SOURCES`: "nothing", "prior data",
            "a demonstrator", "a policy" or "unknown". The use of another one ends a run.
        several: whether it can learn with several bodies.
        acts: whether it steps environments; if not, it counts updates, see `RunContext.count_steps`.
    """

    learn: Callable[[Any, Any], Iterator[Any]]
    hyperparameters: Any
    summary: str
    evaluate_every: int = 10_000
    steps: int = 1_000_000
    terrain_steps: int | None = None
    extends: bool = False
    source: str = usage.UNKNOWN
    several: bool = False
    acts: bool = True

    @property
    def device_defaults(self) -> DeviceDefaults | None:
        """What a run has by default where its simulation fills a GPU; None for other simulations."""
        return DEVICE_DEFAULTS.get(getattr(self.hyperparameters, "simulation", ""))

    def steps_of(self, setup: Setup) -> int:
        """Return the environment steps of a run, by default.

        Raises:
            ValueError: a setting of the task that does not fit.
        """
        if self.device_defaults is not None:
            task = setup.definition
            is_long = bool(task.commands) or task.scene.arena != FLAT
            return self.device_defaults.long_steps if is_long else self.device_defaults.steps
        if self.terrain_steps is None or setup.definition.scene.arena == FLAT:
            return self.steps
        return self.terrain_steps

    def evaluate_every_of(self, steps: int) -> int:
        """Return the environment steps between evaluations of a run of so many steps, by default."""
        if self.device_defaults is not None:
            return math.ceil(steps / self.device_defaults.evaluations)
        return self.evaluate_every

    def with_hyperparameters(self, changes: Mapping[str, Any]) -> "Algorithm":
        """Return the algorithm with some hyperparameters changed.

        A changed `simulation` changes those that it has defaults for, too.

        Raises:
            ValueError: no such hyperparameter, or a value of another type.
        """
        fields = dataclasses.asdict(self.hyperparameters)
        changed_fields = {}
        for name in changes:
            if name not in fields and name in registry.setting_names():
                raise ValueError(
                    f"hyperparameter {name!r}: it is a setting of the task; expected in --set, or task_kwargs"
                )
            checks.name(name, fields, "hyperparameter")
        for name, value in {**_device_changes(fields, changes), **changes}.items():
            plain_value = value.item() if isinstance(value, np.generic) else value
            changed_fields[name] = tuple(plain_value) if isinstance(plain_value, list) else plain_value
            if not _has_type_of(changed_fields[name], fields[name]):
                expected = f"{type(fields[name]).__name__} like {fields[name]!r}"
                preview = checks.preview(changed_fields[name])
                takes_integer = isinstance(fields[name], int) and not isinstance(fields[name], bool)
                hint = checks.hint_integer(changed_fields[name]) if takes_integer else ""
                raise ValueError(f"hyperparameter {name}: expected {expected}, got {preview}{hint}")
        return self._replace(hyperparameters=dataclasses.replace(self.hyperparameters, **changed_fields))


def _device_changes(fields: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the hyperparameters that a changed simulation changes by default.

    Args:
        fields: hyperparameters before the changes by name.
        changes: what is changed.
    """
    simulation = changes.get("simulation")
    if not isinstance(simulation, str) or simulation not in DEVICE_DEFAULTS:
        return {}
    defaults = dict(DEVICE_DEFAULTS[simulation].hyperparameters)
    counts = {**fields, **defaults, **changes}
    if all(isinstance(counts[name], int) for name in ("num_envs", "horizon")):
        defaults["minibatch"] = min(defaults["minibatch"], counts["num_envs"] * counts["horizon"])
    return defaults


def _has_type_of(value, example) -> bool:
    """Return whether a value has the type of an example; an integer also counts as a float, and a bool never does."""
    if isinstance(value, bool) or isinstance(example, bool):
        return isinstance(value, bool) and isinstance(example, bool)
    if isinstance(example, float):
        return isinstance(value, int | float)
    return isinstance(value, type(example))


_SAC = SoftActorCritic()
_SPEQ = SoftActorCritic(dropout=0.01, phase_updates=75_000)
_SAC_PARALLEL = SoftActorCritic(
    learning_rate=5e-4,
    discount=0.97,
    n_step=3,
    tau=0.01,
    num_envs=32,
    utd_ratio=0.375,
    start_steps=0,
    reward_scale=0.1,
    initial_std=0.3,
    last_gain=0.01,
    initial_temperature=0.003,
    target_entropy=-0.6,
    symmetry_augmentation=True,
    normalize=True,
    exclude_blocks=BLOCKS_LEFT_OUT,
)


def _learn(hp, context) -> Iterator[Any]:
    """Learn by the learner of this package that takes this class of hyperparameters.

    Raises:
        ValueError: JAX is not installed.
    """
    with versions.require_extra("training needs JAX", "learn"):
        from arc_suite.learning.agents import bc, dagger, off_policy, on_policy
    if stays_on_device(hp):
        from arc_suite.learning.agents import device_learner  # needs the extra `gpu`

        return device_learner.learn(hp, context)
    learners = {SoftActorCritic: off_policy, ProximalPolicy: on_policy, DAgger: dagger, BehaviorCloning: bc}
    return learners[type(hp)].learn(hp, context)


def program_of(hp, context) -> Hashable:
    """Return a value that is equal for runs that `learn_in_one_program` takes together.

    Raises:
        ValueError: a run that learns alone, or JAX is not installed.
    """
    with versions.require_extra("training needs JAX", "learn"):
        from arc_suite.learning.agents import mapped_updates
    if isinstance(hp, SoftActorCritic):
        return mapped_updates.program_of(hp, context)
    if stays_on_device(hp):
        from arc_suite.learning.agents import device_learner

        return device_learner.program_of(hp, context)
    raise ValueError(
        f"expected soft actor-critic, or a simulation on a device, for runs in one program, got {type(hp).__name__}"
    )


def learn_in_one_program(all_hp: Sequence, contexts: Sequence) -> Iterator[list]:
    """Learn in several runs with equal `program_of`; yield the slices of all runs, None for a run without one.

    Args:
        all_hp: hyperparameters of each run.
        contexts: context of each run.
    """
    from arc_suite.learning.agents import mapped_updates, off_policy

    if stays_on_device(all_hp[0]):
        from arc_suite.learning.agents import device_learner

        return device_learner.learn_in_step(all_hp[0], contexts)
    return off_policy.learn_in_step(all_hp, contexts, mapped_updates.MappedUpdates)


def stays_on_device(hp) -> bool:
    """Return whether simulation and learning stay on JAX's device; see `device_learner`."""
    return getattr(hp, "simulation", "mujoco") != "mujoco"


# Kinds of algorithms; the further arguments of each are its hyperparameters and its summary.
_off_policy = functools.partial(Algorithm, _learn, extends=True, source=usage.NOTHING)
_with_prior = functools.partial(_off_policy, source=usage.PRIOR_DATA)
_on_policy = functools.partial(Algorithm, _learn, several=True, source=usage.NOTHING)
_finetune = functools.partial(_on_policy, source=usage.POLICY)
_dagger = functools.partial(Algorithm, _learn, source=usage.DEMONSTRATOR, several=True)

# First the six algorithms of the ARC-RL paper, as in its published code, then others: docs/agents.md.
ALGORITHMS = {
    "sac": _off_policy(_SAC, "soft actor-critic"),
    "speq": _off_policy(_SPEQ, "SAC with phases in which the critics alone learn"),
    "sope_eo": _off_policy(dataclasses.replace(_SPEQ, early_stop="published"), "SPEQ with phases that stop early"),
    "sacfd": _with_prior(
        dataclasses.replace(_SAC, prior="protected"), "SAC with prior data in its buffer, never overwritten"
    ),
    "speq_o2o": _with_prior(
        dataclasses.replace(_SPEQ, prior="symmetric_sampling"),
        "SPEQ with a batch of prior data in every update",
    ),
    "sope": _with_prior(
        dataclasses.replace(_SPEQ, prior="symmetric_sampling", early_stop="published"),
        "SPEQ-O2O with phases that stop early",
    ),
    # Beyond the paper: DroQ (Hiraoka et al., "Dropout Q-functions for doubly efficient reinforcement learning", 2022).
    "droq": _off_policy(
        dataclasses.replace(_SAC, dropout=0.01, utd_ratio=20),
        "SAC with 20 updates of critics with dropout in every step",
    ),
    # What each part gives: docs/algorithms.md.
    "sac_parallel": _off_policy(
        _SAC_PARALLEL,
        "SAC from nothing in 32 environments, with 3-step returns and a short horizon",
        evaluate_every=20_000,
        steps=100_000,
    ),
    "xqc": _off_policy(
        dataclasses.replace(_SAC_PARALLEL, critics="categorical", reward_scale=0.03, initial_temperature=0.001),
        "SAC as sac_parallel, whose critics learn distributions over returns, with batch and weight norm",
        evaluate_every=20_000,
        steps=100_000,
    ),
    # Noise falls over the length of a run: uneven ground takes a longer one. studies/catalog.md has shorter schedules.
    "ppo": _on_policy(
        ProximalPolicy(network="legs", hidden=64, minibatch=512, schedule_steps=200_000),
        "proximal policy optimization of a network that legs share",
        evaluate_every=100_000,
        terrain_steps=3_000_000,
    ),
    # Small steps around a good policy: the noise of `ppo` would undo it.
    "finetune": _finetune(
        ProximalPolicy(
            initial_std=0.1,
            final_std=0.04,
            initial_desired_kl=0.008,
            final_desired_kl=0.004,
            policy_rate=1e-5,
            value_warm_up=320,
        ),
        "proximal policy optimization from the policy of another run, --hp start=FOLDER",
        evaluate_every=100_000,
        steps=500_000,
    ),
    "dagger": _dagger(DAgger(), "imitation of a demonstrator", evaluate_every=25_600, steps=25_600),
    # One policy for many bodies: two environments of each of 128, small batches as a network of legs is large.
    "dagger_bodies": _dagger(
        DAgger(num_envs=256, round=60, updates=500, last_updates=1100, batch=128, hidden=128),
        "imitation of the demonstrators of many bodies, by one policy",
        evaluate_every=46_080,
        steps=46_080,
    ),
    "finetune_bodies": _finetune(
        ProximalPolicy(
            num_envs=256,
            horizon=24,
            epochs=2,
            minibatch=512,
            network="legs",
            symmetry_augmentation=False,
            discount=0.96,
            initial_std=0.08,
            final_std=0.08,
            initial_desired_kl=0.06,
            final_desired_kl=0.03,
            policy_rate=8e-5,
            value_warm_up=96,
            hidden=128,
        ),
        "proximal policy optimization with many bodies from the policy of another run, --hp start=FOLDER",
        evaluate_every=122_880,
        steps=270_336,
    ),
    # The steps of behavior cloning are updates.
    "bc": Algorithm(
        _learn,
        BehaviorCloning(),
        "behavior cloning of a dataset",
        evaluate_every=2500,
        steps=5000,
        source=usage.PRIOR_DATA,
        acts=False,
    ),
}


def algorithm(name: str) -> Algorithm:
    """Return the algorithm of a name, or of `module:name`, which another package registers.

    Raises:
        ValueError: there is none, or its hyperparameters or its source do not fit.
    """
    definition = registry.find("algorithm", name, ALGORITHMS)
    part = f"algorithm {checks.preview(name)}"
    if not isinstance(definition, Algorithm):
        raise ValueError(f"{part}: expected an Algorithm, got {type(definition).__name__}")
    hyperparameters = definition.hyperparameters
    if isinstance(hyperparameters, type) or not dataclasses.is_dataclass(hyperparameters):
        got = checks.preview(hyperparameters)
        raise ValueError(f"{part}: hyperparameters: expected a value of a frozen dataclass, got {got}")
    checks.name(definition.source, usage.SOURCES, "source of an algorithm")
    return definition
