"""Collects a dataset of walks in Minari's format, on all cores; or replays one and compares to the bit.

Killed or interrupted, the same command continues. Minari keeps datasets in ~/.minari/datasets, or where
MINARI_DATASETS_PATH points; `minari list local` shows them.

Examples:
  python tools/collect.py --robot queen --policy cpg --preset medium --episodes 1000
  python tools/collect.py --robot tick --preset slow,medium,fast --noise 0.1
  python tools/collect.py --spec examples/spider.json --policy my_package.policies:make
  python tools/collect.py --verify arc_suite/queen/cpg-medium-v0
"""

import numpy as np
from absl import flags

from arc_suite import checks, policies
from arc_suite.cli import body_flags, program
from arc_suite.cpg import PRESETS
from arc_suite.tasks.walk import HORIZON

FLAGS = flags.FLAGS
_ROBOT = flags.DEFINE_string("robot", "queen", "queen, bastion, tick or leaper, or all in turn.")
flags.DEFINE_string("policy", "cpg", policies.HELP)
flags.DEFINE_list("preset", ["medium"], f"Of the cpg: {', '.join(PRESETS)}; several with commas take turns.")
flags.DEFINE_float("noise", 0.0, "Standard deviation of normal noise on actions.", lower_bound=0.0)
flags.DEFINE_integer("episodes", 1000, "How many episodes the dataset is to have.", lower_bound=1)
flags.DEFINE_integer("steps", HORIZON, "After which an episode is truncated.", lower_bound=1, upper_bound=HORIZON)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)
flags.DEFINE_string("id", None, "Of the dataset. [default: arc_suite/ROBOT/POLICY-PRESET-v0, or like it]")
flags.DEFINE_boolean("overwrite", False, "Replace a dataset that is there, once the new one is complete.")
flags.DEFINE_string("verify", None, "Replay the dataset of this id instead.")
flags.DEFINE_integer("rows", 64, "Episodes at a time; the data do not depend on it.", lower_bound=1)
flags.DEFINE_integer("threads", None, "To simulate on; the data do not depend on it. [default: all]", lower_bound=1)


def main():
    """Collects or verifies."""
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(str(error)) from None
    bodies = body_flags.bodies(_ROBOT)
    if FLAGS.verify is not None:
        body = next(iter(bodies.values())) if _ROBOT.present or body_flags.made() else None
        count = data.verify(FLAGS.verify, body, FLAGS.rows, FLAGS.threads)
        print(f"{FLAGS.verify}: {count} episodes replayed, equal to the bit")
        return 0
    if FLAGS.id is not None and len(bodies) > 1:
        raise ValueError(f"--id={FLAGS.id}: names one dataset, and --robot=all makes {len(bodies)}")
    presets = tuple(checks.name(preset, PRESETS, "preset") for preset in FLAGS.preset)
    presets = presets if FLAGS.policy == "cpg" else ()
    for body in bodies.values():
        settings = data.Settings(body, FLAGS.policy, presets, FLAGS.noise, FLAGS.seed, FLAGS.steps)
        dataset_id = FLAGS.id or settings.dataset_id()
        missing = data.collect(dataset_id, settings, FLAGS.episodes, FLAGS.rows, FLAGS.threads, FLAGS.overwrite)
        dataset = data.open(dataset_id)
        if not missing:
            print(f"{dataset_id}: has its {len(dataset)} episodes already")
            continue
        returns, lengths = zip(
            *((summary["return"], summary["length"]) for summary in dataset.summaries()), strict=True
        )
        print(
            f"{dataset_id}: {len(dataset)} episodes, return {np.mean(returns):.1f} +- {np.std(returns):.1f}, "
            f"length {np.mean(lengths):.1f}, {dataset.metadata['dataset_size']} MB in {dataset.path}"
        )
    return 0


if __name__ == "__main__":
    program.run(main)
