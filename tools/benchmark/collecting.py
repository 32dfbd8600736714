"""Measures what collecting a dataset costs against bare steps of the vector environment."""

import contextlib
import functools
import os
import tempfile
import time
from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from arc_suite import data
from arc_suite.envs.setup import Setup

NUM_ENVS = 64
POLICIES = ("cpg", "random")  # long episodes and short ones
_ID = "arc_suite/benchmark-v0"


def measure(robots: Sequence[str], episodes: int, rounds: int) -> str:
    """Collects and steps in turn, on all cores, behind a progress bar.

    Args:
        robots: whose walks.
        episodes: of a dataset.
        rounds: how often each has its turn.

    Returns:
        A table in Markdown: medians of control steps a second, collecting (from nothing to the merged
        dataset) and bare (the same rows and threads, actions precomputed), and their ratio.
    """
    lines = ["| robot | policy | collecting, steps/s | bare, steps/s | ratio |", "|---|---|---|---|---|"]
    turns = iter(tqdm(range(len(robots) * len(POLICIES) * rounds), unit="round", disable=None))
    for robot in robots:
        for policy in POLICIES:
            settings = data.DatasetSettings(Setup.of(robot), policy, ("medium",) if policy == "cpg" else ())
            speeds = []
            for _ in range(rounds):
                next(turns)
                with _temporary_datasets():
                    speeds.append((_collecting(settings, episodes), _bare(settings)))
            collecting, bare = np.median(speeds, axis=0)
            lines.append(f"| {robot} | {policy} | {collecting:.0f} | {bare:.0f} | {collecting / bare:.2f} |")
    next(turns, None)
    return "\n".join(lines)


def _collecting(settings: data.DatasetSettings, episodes: int) -> float:
    started = time.perf_counter()
    data.collect(_ID, settings, episodes, NUM_ENVS, progress=functools.partial(tqdm, disable=True))
    seconds = time.perf_counter() - started
    return data.open(_ID).metadata["total_steps"] / seconds


def _bare(settings: data.DatasetSettings) -> float:
    """Steps the actions of the dataset's first episodes, row by row, again and again where they are over."""
    environment = settings.environment(NUM_ENVS)
    dataset = data.open(_ID)
    recorded = [dataset[row % len(dataset)].actions for row in range(NUM_ENVS)]
    actions = np.stack([np.resize(episode, (settings.steps, episode.shape[1])) for episode in recorded], axis=1)
    environment.reset(seed=settings.seed)
    steps, ended = 0, np.zeros(NUM_ENVS, bool)
    started = time.perf_counter()
    for row in actions:
        steps += NUM_ENVS - ended.sum()  # a row whose episode has ended starts the next one instead
        *_, terminated, truncated, _ = environment.step(row)
        ended = terminated | truncated
    seconds = time.perf_counter() - started
    environment.close()
    return steps / seconds


@contextlib.contextmanager
def _temporary_datasets():
    """Lets Minari keep datasets in a folder that is deleted afterwards."""
    before = os.environ.get("MINARI_DATASETS_PATH")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["MINARI_DATASETS_PATH"]
            else:
                os.environ["MINARI_DATASETS_PATH"] = before
