"""Make the runs of one of the project's own studies, or write its report and the leaderboard.

`arc-suite study` makes a study of your own, with the same flags. Here the report also checks the paper's claims, and
studies/README.md, the leaderboard, is made anew from all studies that are committed. Neither needs an algorithm of
another package, only its committed tables.

  python tools/study.py first-steps
  python tools/study.py first-steps --report
  python tools/study.py paper --jobs 8 --shard 3/16
  python tools/study.py paper --submit 16 --hours 24
  python tools/study.py top-ppo --report
  python tools/study.py samples-my_package.mine --report
"""

import sys
from pathlib import Path

from absl import flags

from arc_suite.cli import program
from arc_suite.learning.cli.study import make_or_report, results_folder
from studies import catalog, reports

FLAGS = flags.FLAGS


def main(name: str | None = None) -> int:
    """Make the runs, or write the report and the leaderboard; the exit status is 0 if all runs are finished."""
    if name is None:
        raise ValueError(f"expected a study: {', '.join(catalog.STUDIES)}, or <division>-<algorithm>; see --help")
    command = (sys.executable, str(Path(__file__).resolve()), name)
    study = catalog.committed_study(name, results_folder(name)) if FLAGS.report else catalog.study(name)
    return make_or_report(name, study, command, reports.write)


if __name__ == "__main__":
    program.run(main)
