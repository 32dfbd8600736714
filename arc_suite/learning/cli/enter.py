"""Check an evaluation and enter it into the leaderboard.

  arc-suite evaluate --robot tick --policy ppo.zip --json entry.json
  arc-suite enter entry.json --policy ppo.zip --name my_ppo

The 100 episodes are played again: versions, hashes and returns must be those of the file. The entry is copied into
studies/entries, and studies/README.md is written anew. That proves that a result can be reproduced, and not how the
policy was made. The file imports nothing: --task names a module that it needs.
"""

from pathlib import Path

from absl import flags

from arc_suite import policies
from arc_suite.cli.flags import define_policy, define_task, policy_name, task
from arc_suite.cli.program import progress
from arc_suite.learning.studies import entries, leaderboard

FLAGS = flags.FLAGS
define_policy(f"{policies.HELP} [default: that which the entry names]", default=None)
define_task()
flags.DEFINE_string("name", None, "Of the algorithm in the leaderboard. [default: the stem of the policy's name]")
flags.DEFINE_string("results", "studies", "Folder of the leaderboard.")


def main(entry: str | None = None) -> None:
    """Check the entry, copy it and write the leaderboard."""
    if entry is None:
        raise ValueError("expected a file that arc-suite evaluate --json wrote; see --help")
    task()
    given = policy_name(FLAGS.policy) if FLAGS.policy else None
    found = entries.checked(Path(entry), given, lambda seeds: progress(seeds, unit="episode", leave=False))
    name = FLAGS.name or Path(found[0].policy).stem
    page = leaderboard.enter(Path(entry), name, found, Path(FLAGS.results))
    for each in found:
        total = sum(episode.total for episode in each.episodes) / len(each.episodes)
        print(f"{each.setup}: {name}, return {total:.1f}, all episodes equal")
    print(f"wrote {page}")
