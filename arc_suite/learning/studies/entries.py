"""Policies of others in the benchmark: files in a folder, judged as the policies of runs are."""

import contextlib
import difflib
import hashlib
import itertools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite import evaluation, files, parsers, policies, style
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging, provenance
from arc_suite.learning import finals
from arc_suite.learning.studies import results
from arc_suite.learning.studies.benchmark import STYLE, RunScore, read_finals, settings_cell, style_fields
from arc_suite.learning.studies.divisions import PLACES, SEEDS, place_setup
from arc_suite.policies import Policy, frozen, named, network, other_libraries, separate
from arc_suite.policies.frozen import Frozen

MAKE = "make"  # function of a module that makes a policy
ENDINGS = (*other_libraries.READERS, network.EXTENSION, named.PYTHON_EXTENSION)
# Robot, task and seed by the name of a policy in a folder.
NAMES = {
    f"{robot}-{task}-{seed}{ending}": (robot, task, seed)
    for (robot, task), seed, ending in itertools.product(PLACES, range(SEEDS), ("", *ENDINGS))
}


class Judged(NamedTuple):
    """A policy of others that has been judged.

    Attributes:
        score: its score.
        lines: lines of its episodes; see `finals`.
    """

    score: RunScore
    lines: finals.Lines


def score_policies(
    folder: Path, paths_by_run: Mapping[tuple[str, str, int], Path], progress: Callable[..., Any]
) -> list[Judged]:
    """Play the episodes that judge the policies of a folder, and return their scores and lines.

    Args:
        folder: folder of policies. A policy is a zip of stable-baselines3, a policy file (.npz), a module with a
            function `MAKE` (see `policies.policy`), or the folder of a run.
        paths_by_run: paths of the policies by robot, task and seed; see `find_policies`.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError: a policy that does not fit.
        OSError: a file cannot be read.
    """
    with contextlib.ExitStack() as stack:
        has_module = any(path.suffix == named.PYTHON_EXTENSION for path in paths_by_run.values())
        frozen_folder = stack.enter_context(frozen.freeze(folder)) if has_module else None
        return [
            _judge_policy(path, place_setup(robot, task), seed, frozen_folder, progress)
            for (robot, task, seed), path in paths_by_run.items()
        ]


def find_policies(folder: Path) -> dict[tuple[str, str, int], Path]:
    """Return the paths of the policies in a folder by robot, task and seed, in the order of their names.

    An entry of the folder is a policy if it has an ending of `ENDINGS` or a name of `NAMES`, or is the folder of a
    run. Weights, statistics, notes, and names that begin with `.` or `_` are skipped.

    Args:
        folder: folder of policies named `ROBOT-TASK-SEED`.

    Raises:
        ValueError: no policy in the folder, another name, or two policies of a place and seed.
        OSError: the folder cannot be read.
    """
    paths_by_run: dict[tuple[str, str, int], Path] = {}
    with files.reading(folder):
        paths = sorted(filter(_is_policy, folder.iterdir()))
    for path in paths:
        if path.name not in NAMES:
            (nearest_name,) = difflib.get_close_matches(path.name.lower(), NAMES, n=1, cutoff=0.0)
            expected = f"ROBOT-TASK-SEED of a place and a seed from 0 to {SEEDS - 1}"
            raise ValueError(f"{path}: expected {expected}, such as {nearest_name}")
        run = NAMES[path.name]
        if run in paths_by_run:
            raise ValueError(f"{path}: expected one policy of this place and seed, got {paths_by_run[run].name}, too")
        paths_by_run[run] = path
    if not paths_by_run:
        raise ValueError(f"{folder}: expected policies named ROBOT-TASK-SEED, such as tick-walk-0.zip, got none")
    return paths_by_run


def _is_policy(path: Path) -> bool:
    if path.name[0] in "._":
        return False
    return path.suffix.lower() in ENDINGS or path.name in NAMES or policies.is_file(os.fspath(path))


def _judge_policy(
    path: Path, setup: Setup, seed: int, frozen_folder: Frozen | None, progress: Callable[..., Any]
) -> Judged:
    """Play the episodes that judge a policy, and return its score and their lines.

    Args:
        path: path of the policy.
        setup: setup of its place.
        seed: seed of its training.
        frozen_folder: copy of its folder, which a module needs.
        progress: makes a progress bar as `tqdm` does.
    """
    is_module = path.suffix == named.PYTHON_EXTENSION
    sha256 = hash_module(frozen_folder, path.name) if is_module else policies.digest(str(path))
    seeds = judging.seeds_of(sha256)
    setup = judging.setup_of(setup, seeds)
    training_seeds = provenance.training_seeds(f"{path}:{MAKE}" if is_module else str(path), seeds)

    environments = setup.make_vec(len(seeds), autoreset_mode=AutoresetMode.DISABLED)
    acting = _acting(path, setup, len(seeds), frozen_folder)
    with contextlib.closing(environments), acting as policy:
        episodes = finals.play_batch(environments, policy, seeds, progress, f"judging {path}")
    with contextlib.closing(setup.load()) as environment, _acting(path, setup, 1, frozen_folder) as policy:
        style_seeds = seeds[: evaluation.CURVE_EPISODES]
        episode_metrics = [
            style.measure(style.record(environment, policy, episode_seed)) for episode_seed in style_seeds
        ]

    lines = finals.to_lines(sha256, seeds, episodes)
    for line, values in zip(lines, episode_metrics, strict=False):  # of the first episodes
        line |= {results.STYLE + metric: repr(values[metric].value) for metric in STYLE}
    facts = {
        "robot": setup.name,
        "task": setup.kind.name,
        "seed": seed,
        "policy_sha256": sha256,
        "first_seed": seeds.start,
        "notes": provenance.UNKNOWN if training_seeds is None else "",
        "physics_sha256": results.hash_physics(place_setup(setup.name, setup.kind.name)),
    }
    return Judged(score_lines(facts, lines), lines)


def hash_module(frozen_folder: Frozen, name: str) -> str:
    """Return the hash of a module's policy: of all files of its folder, and of the module's name.

    So modules of one folder play other episodes.
    """
    return hashlib.sha256(f"{frozen_folder.sha256}\0{name}".encode()).hexdigest()


def score_lines(facts: Mapping[str, Any], lines: finals.Lines) -> RunScore:
    """Return the score of a policy from the lines of its episodes.

    Args:
        facts: the fields of the score that the episodes do not tell; others do not count.
        lines: lines of the episodes that judge the policy; the first ones have metrics of style.
    """
    setup = place_setup(facts["robot"], facts["task"])
    mean_return = float(np.mean([float(line["return"]) for line in lines]))
    scale = anchors.anchors(judging.setup_of(setup, judging.seeds_of(facts["policy_sha256"])))
    metrics = {}
    for metric in STYLE:
        cells = [line[column] for line in lines if (column := results.STYLE + metric) in line]
        metrics[metric] = np.array(cells, float)
    values = {
        "result": mean_return,
        "score": float(scale.score(mean_return)),
        "minutes": np.nan,
        "task_kwargs": settings_cell(setup),
    }
    return RunScore(**{**facts, **values, **style_fields(setup, metrics)})


def score_anew(scores: Sequence[RunScore], published: Path) -> list[RunScore]:
    """Return the scores of policies from their published episodes.

    Raises:
        ValueError: a damaged table, or one without the episodes of a policy.
        OSError: the table cannot be read.
    """
    lines_by_policy = read_finals(published, scores)
    with parsers.guard(f"{published / results.FINALS}: damaged"):
        return [score_lines(score._asdict(), lines_by_policy[score.policy_name]) for score in scores]


@contextlib.contextmanager
def _acting(path: Path, setup: Setup, num_envs: int, frozen_folder: Frozen | None) -> Iterator[Policy]:
    """Make the policy of a file; a module acts in a process of its own, from the copy of its folder."""
    if path.suffix != named.PYTHON_EXTENSION:
        yield policies.policy(path, setup.body, num_envs=num_envs, task=setup.definition)
        return
    module = frozen_folder.path / path.name
    sizes = setup.definition.sizes
    policy = separate.Separate(module, MAKE, setup.body.name, num_envs, sizes, f"policy {path}")
    with contextlib.closing(policy):
        yield policy
