"""The evaluation protocol: seeded episodes and deterministic actions."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.envs.timestep import TimeStep
from arc_suite.evaluation import published
from arc_suite.policies import Policy, alone
from arc_suite.simulation.episode_loop import play_episode

EPISODES = 100  # that evaluate a final policy, from seed 0
CURVE_EPISODES = 10  # that evaluate a point of a learning curve (the paper's Section 6, Experimental Setting)

_PROGRESS = "progress_"  # prefix of the task's metrics in an info
_REWARD = "reward_"  # prefix of the terms of the reward in an info


class EpisodeResult(NamedTuple):
    """The results of one episode.

    Attributes:
        total: its return.
        length: control steps.
        progress: the task's metrics at its end by name.
    """

    total: float
    length: int
    progress: Mapping[str, float]


def paper_return(setup: Setup) -> float | None:
    """Return the return of the paper's demonstrator; None for a task, settings or a robot that the paper lacks."""
    return published.DEMONSTRATORS.get(setup.name) if _is_published(setup) else None


def published_returns(setup: Setup, algorithms: Iterable[str], steps: int) -> dict[str, float]:
    """Return the paper's returns after environment steps by algorithm: of those given, else of the best one.

    Empty for a task, settings or a robot that the paper lacks, and before the first points of its curves.
    """
    if not _is_published(setup):
        return {}
    returns = {name: published.at(setup.name, name, steps) for name in published.CURVES.get(setup.name, {})}
    returns = {name: value for name, value in returns.items() if value is not None}
    returns_of_algorithms = {name: returns[name] for name in algorithms if name in returns}
    if returns_of_algorithms or not returns:
        return returns_of_algorithms
    best_return = max(returns.values())
    return {name: value for name, value in returns.items() if value == best_return}


def _is_published(setup: Setup) -> bool:
    return setup.kind.name == "walk" and not setup.task_kwargs


def check_ends(limit: float) -> None:
    """Check that episodes end, given their longest duration, in control steps or s.

    Raises:
        ValueError: episodes that need not end.
    """
    if limit == math.inf:
        raise ValueError("time_limit: expected a finite number, as every episode must end, got inf")


def rollout(environment: Environment, policy: Policy, seed: int, max_steps: int | None = None) -> Iterator[TimeStep]:
    """Play one episode.

    Args:
        environment: environment of `arc_suite.load`.
        policy: made for one environment.
        seed: seed of the episode's start.
        max_steps: control steps after which to stop; None for a whole episode.

    Yields:
        The `TimeStep` of the reset and of every step; meanwhile the environment is in that state.

    Raises:
        ValueError: an episode that need not end.
    """
    if max_steps is None:
        check_ends(environment.task.definition.step_limit)
    yield from play_episode(environment, alone(policy, seed), seed, max_steps)


def run(
    environment: Environment,
    policy: Policy,
    seed: int,
    max_steps: int | None = None,
    watchers: Iterable[Callable[[TimeStep], Any]] = (),
) -> EpisodeResult:
    """Play one episode and return its results.

    Args:
        environment: as of `rollout`, like `policy`, `seed` and `max_steps`.
        policy: see `rollout`.
        seed: see `rollout`.
        max_steps: see `rollout`.
        watchers: called with every `TimeStep`, also that of the reset, while the environment is in that state.

    Raises:
        ValueError: as `rollout`; or a reward, or a block of the last observation, that is not finite.
    """
    rewards = []
    timestep = None
    for timestep in rollout(environment, policy, seed, max_steps):
        if not timestep.first():
            rewards.append(timestep.reward)
        for watch in watchers:
            watch(timestep)
    progress = {name: float(value) for name, value in environment.task.progress.items()}
    total = float(sum(rewards))
    if not math.isfinite(total):
        step = next(step for step, reward in enumerate(rewards, 1) if not math.isfinite(reward))
        for _ in rollout(environment, policy, seed, step):  # again, to see the terms of that step
            pass
        _refuse_non_finite(environment.task.definition.name, environment.task.terms, seed, f"in step {step}")
    _check_observation(environment.task.definition.name, timestep, seed)
    return EpisodeResult(total, len(rewards), progress)


def _refuse_non_finite(task_name: str, terms: Mapping[str, Any], seed: int, when: str) -> None:
    """Raise ValueError for the reward of an episode that is not finite; it names the terms that are not.

    Args:
        task_name: name of the task.
        terms: terms of the reward of one environment by name, at that step.
        seed: seed of the episode.
        when: the step in words.
    """
    names = [name for name, term in terms.items() if not np.isfinite(term)]
    cause = f": {', '.join(f'term {name!r} is {terms[name]}' for name in names)}" if names else ""
    raise ValueError(f"task {task_name}: the reward of the episode of seed {seed} is not finite {when}{cause}")


def _check_observation(task_name: str, timestep: TimeStep | None, seed: int) -> None:
    """Raise ValueError for a block of the last observation of an episode that is not finite."""
    for name, block in (timestep.observation if timestep is not None else {}).items():
        if not np.isfinite(block).all():
            raise ValueError(f"task {task_name}: block {name!r} is not finite at the end of the episode of seed {seed}")


def episodes(environment: Environment, policy: Policy, seeds: Iterable[int] = range(EPISODES)) -> list[EpisodeResult]:
    """Run one episode for each seed.

    Args:
        environment: environment of `arc_suite.load`.
        policy: made for one environment.
        seeds: seeds of the episodes; by default the protocol's.
    """
    return [run(environment, policy, seed) for seed in seeds]


def episodes_in_batch(
    environment,
    policy: Policy,
    seeds: Sequence[int] | None = None,
    watch: Callable[[np.ndarray, np.ndarray], None] | None = None,
) -> list[EpisodeResult]:
    """Run one episode for each seed, all at once.

    They are bit-equal to those of `episodes` if the policy takes observations as float32, as networks do.

    Args:
        environment: a `VectorEnv` or `BodiesEnv` with one environment for each seed, in the mode Disabled.
        policy: made for as many environments.
        seeds: seeds of the episodes; by default from 0 on.
        watch: called after the reset and after each control step with two masks (num_envs,): of the environments
            that played the step, none after the reset, and of those in which it ended by a fall or a divergence.

    Raises:
        ValueError: episodes that need not end, or a return that is not finite.
    """
    check_ends(environment.step_limit)
    num_envs = environment.num_envs
    seeds = list(range(num_envs) if seeds is None else seeds)
    observations, _ = environment.reset(seed=seeds)
    policy.reset(range(num_envs), seeds)
    rewards = np.zeros(num_envs)
    totals = np.zeros(num_envs)
    lengths = np.zeros(num_envs, int)
    progress = [{}] * num_envs
    is_playing = np.ones(num_envs, bool)
    if watch is not None:
        watch(~is_playing, ~is_playing)
    while is_playing.any():
        actions = policy.act(environment.task.split(observations), rewards)
        observations, rewards, terminated, truncated, info = environment.step(actions)
        totals[is_playing] += rewards[is_playing]
        lengths += is_playing
        if watch is not None:
            has_diverged = info.get("diverged", np.zeros(num_envs, bool))
            watch(is_playing, is_playing & (terminated | has_diverged))
        has_ended = is_playing & (terminated | truncated)
        for index in np.flatnonzero(has_ended).tolist():
            progress[index] = _read_metrics(info, index, _PROGRESS)
            if not math.isfinite(totals[index]):
                terms = _read_metrics(info, index, _REWARD)
                _refuse_non_finite(environment.task.definition.name, terms, seeds[index], f"by step {lengths[index]}")
        is_playing &= ~has_ended
        if has_ended.any() and is_playing.any():
            environment.rest(~is_playing)
    names = dict.fromkeys(name for metrics in progress for name in metrics)
    results = []
    for total, length, metrics in zip(totals.tolist(), lengths.tolist(), progress, strict=True):
        results.append(EpisodeResult(total, length, {name: metrics.get(name, math.nan) for name in names}))
    return results


def _read_metrics(info: Mapping[str, np.ndarray], index: int, prefix: str) -> dict[str, float]:
    """Return the metrics of one environment of a batch with a prefix; those of other tasks are left out."""
    metrics = {}
    for name, values in info.items():
        if name.startswith(prefix) and info[f"_{name}"][index]:
            metrics[name.removeprefix(prefix)] = float(values[index])
    return metrics
