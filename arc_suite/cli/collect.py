"""Collect a dataset in Minari's format, or replay one and check every bit.

Both use all cores. Killed or interrupted, the same command continues. Minari keeps datasets in
~/.minari/datasets, or where MINARI_DATASETS_PATH points; `minari list local` shows them.

  arc-suite collect --robot queen --policy cpg --preset medium --episodes 1000
  arc-suite collect --robot tick --preset slow,medium,fast --noise 0.1
  arc-suite collect --spec spider --policy my_package.policies:make
  arc-suite collect --robot tick --policy runs/tick-walk-ppo-0 --checkpoint 200704
  arc-suite collect --robot tick --policy runs/tick-walk-ppo-0 --quality medium
  arc-suite collect --verify arc_suite/queen/walk/cpg-medium-v0

--verify imports no module that the dataset names: --task and --set name those that it needs, as in collecting.
"""

import math
import pathlib
from collections.abc import Sequence

import numpy as np
from absl import flags

from arc_suite import policies, seed_ranges
from arc_suite.cli.flags import (
    MAX_COUNT,
    custom_body,
    define_body,
    define_policy,
    define_task,
    policy_name,
    refuse_flags,
    setups_from_flags,
)
from arc_suite.cli.program import progress
from arc_suite.cpg import suited_preset
from arc_suite.cpg.selection import check_preset_name, preset_names
from arc_suite.envs.prepare import checked_limit
from arc_suite.envs.setup import Setup
from arc_suite.policies import checkpoints
from arc_suite.tasks.contract import STEPS

FLAGS = flags.FLAGS
define_body(more=", or all in turn")
define_task()
define_policy()
flags.DEFINE_integer(
    "checkpoint", None, "Environment step of the checkpoint of the run that --policy names.", lower_bound=0
)
flags.DEFINE_enum(
    "quality",
    None,
    checkpoints.QUALITIES,
    "Of the run that --policy names: random, uniform actions; medium, the first checkpoint that earns a third of the "
    "best one's return; expert, the latest; replay, all checkpoints in turn.",
)
flags.DEFINE_list(
    "preset",
    None,
    f"{policies.PRESET_HELP} Several with commas take turns: of n, the episode with seed s has number s modulo n. "
    "[default: the one that suits the task and the body]",
)
flags.DEFINE_float("noise", 0.0, "Standard deviation of normal noise on actions.", lower_bound=0.0)
flags.DEFINE_integer(
    "episodes", 1000, "How many episodes the dataset is to have.", lower_bound=1, upper_bound=MAX_COUNT
)
flags.DEFINE_integer(
    "steps", None, "Control steps after which an episode is truncated. [default: the task's limit]", lower_bound=1
)
flags.DEFINE_integer(
    "seed",
    seed_ranges.COLLECTING.start,
    "Seed of the first episode; the others count on from it. Evaluation has those below.",
    lower_bound=seed_ranges.COLLECTING.start,
    upper_bound=seed_ranges.COLLECTING[-1],
)
flags.DEFINE_string("id", None, "Id of the dataset. [default: arc_suite/ROBOT/TASK/POLICY-PRESET-v0, or like it]")
flags.DEFINE_boolean("overwrite", False, "Replace a dataset of that id, once the new one is complete.")
flags.DEFINE_string("author", None, "Who has made the dataset, for its metadata.")
flags.DEFINE_string("code_permalink", None, "Where the code lies that made the dataset, for its metadata.")
flags.DEFINE_string("verify", None, "Replay the dataset of this id instead.")
flags.DEFINE_integer("num_envs", 64, "Episodes at a time; the data do not depend on it.", lower_bound=1)
flags.DEFINE_integer(
    "threads", None, "Threads to simulate on; the data do not depend on it. [default: all]", lower_bound=1
)

# Flags that determine a dataset, or what becomes of it.
_COLLECTION_FLAGS = (
    "policy",
    "vecnormalize",
    "checkpoint",
    "quality",
    "preset",
    "noise",
    "episodes",
    "steps",
    "seed",
    "id",
    "overwrite",
    "author",
    "code_permalink",
)


def main() -> None:
    """Collect or verify."""
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(str(error)) from None
    if FLAGS.verify is not None:
        refuse_flags(_COLLECTION_FLAGS, "expected none with --verify, as the dataset holds what it was collected by")
    setups = setups_from_flags()
    if FLAGS.verify is not None:
        _verify(next(iter(setups.values())))
        return
    if FLAGS.id is not None and len(setups) > 1:
        raise ValueError(f"--id={FLAGS.id}: names one dataset, and --robot=all makes {len(setups)}")
    for name in FLAGS.preset or ():
        policies.check_preset(FLAGS.policy, name)
        if name in checkpoints.QUALITIES and name not in preset_names():
            raise ValueError(f"--preset={name}: is a quality of a run's policy, as in --policy RUN --quality {name}")
        check_preset_name(name)
    policy, label = policy_and_label()
    for judged_setup in setups.values():
        setup = judged_setup.learning()  # with other falls, for example, than those by which policies are judged
        presets = tuple(presets_for(setup))
        settings = data.DatasetSettings(setup, policy, presets, FLAGS.noise, FLAGS.seed, step_limit(setup))
        dataset_id = settings.dataset_id(label) if FLAGS.id is None else FLAGS.id
        collected_episodes = data.collect(
            dataset_id,
            settings,
            FLAGS.episodes,
            num_envs=FLAGS.num_envs,
            threads=FLAGS.threads,
            overwrite=FLAGS.overwrite,
            progress=progress,
            author=FLAGS.author,
            code_permalink=FLAGS.code_permalink,
        )
        dataset = data.open(dataset_id)
        if collected_episodes:
            print(f"{dataset_id}: {describe_dataset(dataset)}")
        else:
            print(f"{dataset_id}: has {len(dataset)} episodes already; --episodes={FLAGS.episodes} asks for no more")


def _verify(setup: Setup) -> None:
    """Replay the dataset of `--verify`, with the body and task of a setup where flags name them."""
    from arc_suite import data

    body = setup.body if FLAGS["robot"].present or custom_body() else None
    task = setup.task if FLAGS["task"].present else None
    count = data.verify(FLAGS.verify, body, FLAGS.num_envs, FLAGS.threads, progress, task)
    print(f"{FLAGS.verify}: {count} episodes replayed, all bit-equal")


def describe_dataset(dataset) -> str:
    """Return the number, returns and lengths of a dataset's episodes, and its size and folder, as text."""
    summaries = list(dataset.summaries())
    returns = [summary["return"] for summary in summaries]
    lengths = [summary["length"] for summary in summaries]
    return (
        f"{len(dataset)} episodes, return {np.mean(returns):.1f}, deviation {np.std(returns):.1f}, "
        f"length {np.mean(lengths):.1f}, {dataset.metadata['dataset_size']} MB in {dataset.path}"
    )


def step_limit(setup: Setup) -> int:
    """Return the control steps after which an episode of a dataset is truncated.

    Raises:
        ValueError: more steps than an episode of the task has, or neither --steps nor a finite time limit.
    """
    limit = setup.definition.step_limit
    if FLAGS.steps is None:
        if math.isinf(limit):
            raise ValueError("time_limit: expected a finite one, or --steps, as every episode of a dataset must end")
        return max(STEPS, int(limit))  # an episode ends at a shorter limit of the task anyway
    return checked_limit(FLAGS.steps, setup.definition)


def presets_for(setup: Setup) -> Sequence[str]:
    """Return the presets of the demonstrator in a setup; empty for other policies."""
    if FLAGS.policy != "cpg":
        return ()
    if FLAGS.preset is None:
        return [suited_preset(setup.definition)]
    return FLAGS.preset


def policy_and_label() -> tuple[str, str]:
    """Return the policy and its label in the dataset's id; an empty label stands for the policy's name.

    Raises:
        ValueError: --checkpoint and --quality together, or a run without such a checkpoint.
    """
    if FLAGS.checkpoint is None and FLAGS.quality is None:
        return policy_name(FLAGS.policy), ""
    if FLAGS.checkpoint is not None and FLAGS.quality is not None:
        raise ValueError("expected one of --checkpoint and --quality, got both")
    run_folder = pathlib.Path(FLAGS.policy)
    if FLAGS.checkpoint is not None:
        policy = str(checkpoints.at(run_folder, FLAGS.checkpoint))
        label = str(FLAGS.checkpoint)
    else:
        policy = checkpoints.of_quality(run_folder, FLAGS.quality)
        label = FLAGS.quality
    agent = checkpoints.agents(run_folder / checkpoints.FOLDER)[-1]
    return policy, f"{agent.algorithm}-{agent.seed}-{label}"
