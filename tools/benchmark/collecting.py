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
_DATASET_ID = "arc_suite/benchmark-v0"


def measure(robots: Sequence[str], episodes: int, rounds: int) -> str:
    """Collect and step in turn, on all cores, behind a progress bar.

    Args:
        robots: names of the robots.
        episodes: episodes of a dataset.
        rounds: how often each has its turn.

    Returns:
        A table in Markdown: medians of control steps a second, collecting (from nothing to the merged
        dataset) and bare (as many environments and threads, actions precomputed), and their ratio.
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
                    speeds.append((_collecting_speed(settings, episodes), _bare_speed(settings)))
            collecting, bare = np.median(speeds, axis=0)
            lines.append(f"| {robot} | {policy} | {collecting:.0f} | {bare:.0f} | {collecting / bare:.2f} |")
    next(turns, None)
    return "\n".join(lines)


def _collecting_speed(settings: data.DatasetSettings, episodes: int) -> float:
    """Return control steps a second of collecting a dataset."""
    start = time.perf_counter()
    data.collect(_DATASET_ID, settings, episodes, NUM_ENVS, progress=functools.partial(tqdm, disable=True))
    seconds = time.perf_counter() - start
    return data.open(_DATASET_ID).metadata["total_steps"] / seconds


def _bare_speed(settings: data.DatasetSettings) -> float:
    """Return control steps a second with the actions of the dataset's first episodes, repeated where they end."""
    environment = settings.environment(NUM_ENVS)
    dataset = data.open(_DATASET_ID)
    episodes = [dataset[index % len(dataset)].actions for index in range(NUM_ENVS)]
    actions = np.stack([np.resize(episode, (settings.steps, episode.shape[1])) for episode in episodes], axis=1)
    environment.reset(seed=settings.seed)
    steps = 0
    has_ended = np.zeros(NUM_ENVS, bool)
    start = time.perf_counter()
    for step_actions in actions:
        steps += NUM_ENVS - has_ended.sum()  # after an end, a step resets the environment and simulates nothing
        *_, terminated, truncated, _ = environment.step(step_actions)
        has_ended = terminated | truncated
    seconds = time.perf_counter() - start
    environment.close()
    return steps / seconds


@contextlib.contextmanager
def _temporary_datasets():
    """Let Minari keep datasets in a folder that is deleted afterwards."""
    earlier_path = os.environ.get("MINARI_DATASETS_PATH")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = folder
        try:
            yield
        finally:
            if earlier_path is None:
                del os.environ["MINARI_DATASETS_PATH"]
            else:
                os.environ["MINARI_DATASETS_PATH"] = earlier_path
