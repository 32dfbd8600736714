"""The episodes that judge the final policy of a run, played once, when its training has ended: `RUN/final.csv`.

Their seeds follow from the hash of the policy's content, see `evaluation.judging`. Each line holds this hash.
"""

import contextlib
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import evaluation, files
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.evaluation import anchors, judging
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.policies import Policy, checkpoints, network
from arc_suite.policies.network import Network

TABLE = "final"
COLUMNS = ("policy_sha256", "seed", "return", "length")  # the metrics of the task follow

NO_BAR = functools.partial(tqdm, disable=True)

Lines = list[dict[str, str]]


def play_once(
    run: Configuration, folder: Path, step: int, threads: int | None = 1, progress: Callable[..., Any] = NO_BAR
) -> Lines:
    """Return the rows of the episodes that judge the final policy of a run; play them if nobody has.

    Args:
        run: configuration of the run.
        folder: folder of the run.
        step: environment step of the policy.
        threads: threads of the simulation; None for as many as there are cores.
        progress: makes a progress bar of control steps, as `tqdm` does.

    Raises:
        ValueError: a damaged file.
        OSError: a file cannot be read or written.
    """
    policy = network.load(folder / checkpoints.FOLDER / str(step))
    sha256 = network.digest(policy)
    final_lines = run_folder.lines(folder, TABLE, COLUMNS)
    if not are_of(final_lines, sha256):
        final_lines = _play(run.validation, policy, sha256, threads, progress)
        lines = [",".join(final_lines[0]), *(",".join(row.values()) for row in final_lines)]
        files.write(folder / f"{TABLE}.csv", "\n".join([*lines, ""]))
    return final_lines


def are_of(final_lines: Sequence[Mapping[str, str]], sha256: str) -> bool:
    """Return whether rows are the episodes that judge the policy of a hash."""
    seeds = [(row.get("policy_sha256"), row["seed"]) for row in final_lines]
    return seeds == [(sha256, str(seed)) for seed in judging.seeds_of(sha256)]


def _play(setup: Setup, policy: Network, sha256: str, threads: int | None, progress: Callable[..., Any]) -> Lines:
    """Play the episodes that judge a policy, and return their rows."""
    seeds = judging.seeds_of(sha256)
    environment = judging.setup_of(setup, seeds).make_vec(
        len(seeds), num_threads=threads, autoreset_mode=AutoresetMode.DISABLED
    )
    with contextlib.closing(environment):
        episodes = play_batch(environment, policy, seeds, progress, f"judging in {len(seeds)} episodes")
    return to_lines(sha256, seeds, episodes)


def play_batch(
    environment: VectorEnv, policy: Policy, seeds: Sequence[int], progress: Callable[..., Any], description: str
) -> list[evaluation.EpisodeResult]:
    """Run one episode for each seed behind a progress bar of control steps; see `evaluation.episodes_in_batch`.

    Args:
        environment: vector environment with one environment for each seed.
        policy: made for as many environments.
        seeds: seeds of the episodes.
        progress: makes a progress bar as `tqdm` does.
        description: text before the bar.
    """
    calls = int(np.max(environment.step_limit)) + 1  # of `watch`: one after the reset
    with progress(desc=description, total=calls, unit="step", leave=False) as bar:
        return evaluation.episodes_in_batch(environment, policy, seeds, watch=lambda *masks: bar.update())


def to_lines(sha256: str, seeds: Sequence[int], episodes: Sequence[evaluation.EpisodeResult]) -> Lines:
    """Return the rows of the episodes that judge the policy of a hash."""
    episode_lines = []
    for seed, episode in zip(seeds, episodes, strict=True):
        values = {"seed": seed, "return": episode.total, "length": episode.length}
        texts = {"policy_sha256": sha256} | {name: repr(value) for name, value in values.items()}
        metrics = {name: repr(value) for name, value in episode.progress.items()}
        episode_lines.append(texts | metrics | texts)  # no metric takes the place of another value
    return episode_lines


def describe(run: Configuration, final_lines: Sequence[Mapping[str, str]]) -> str:
    """Return the mean return of judging episodes, its standard error, and the score, as text."""
    returns = np.array([row["return"] for row in final_lines], float)
    error = returns.std(ddof=1) / np.sqrt(returns.size)
    score = anchors.anchors(run.validation).score(returns.mean())
    score_text = f", score {score:z.2f}" if np.isfinite(score) else ""
    first_seed = final_lines[0]["seed"]
    heading = f"judged in {returns.size} episodes, seeds {first_seed} on"
    return f"{heading}: return {returns.mean():.1f}, standard error {error:.1f}{score_text}"
