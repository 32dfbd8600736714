"""Score a policy of many bodies on bodies that it has not seen, by family.

A score is (return - standing still) / (demonstrator - standing still), each body with its own demonstrator: 0 is
standing still, 1 the demonstrator. Each body plays 400 control steps. `walk` is the share of bodies that walk, by the
rule of arc-suite survey. Families: random and varied, 50 bodies of seeds that no run trains with; the four robots with
motors sized anew; 20 mutants of them; and 10 random bodies a quarter, and ten times, as large.

  arc-suite transfer --policy runs/varied.0-127-walk-dagger_bodies-0
  arc-suite transfer --policy universal --task steer --families varied,robots -o steer.csv
"""

import csv

from absl import flags

from arc_suite import checks, files
from arc_suite.cli.flags import define_task, task
from arc_suite.evaluation import transfer
from arc_suite.policies import universal

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_string("policy", "universal", "Folder of a run of many bodies, a policy file, or universal.")
flags.DEFINE_list("families", list(transfer.FAMILIES), "Families to play with.")
flags.DEFINE_string("output", None, "File to write every episode to, as CSV.", short_name="o")

_HEADS = ("family", "body", "who", "return", "walked", "tracking")


def main() -> None:
    """Play, print the table and write the episodes."""
    name, settings = task()
    for family in FLAGS.families:
        checks.name(family, transfer.FAMILIES, "family")
    if FLAGS.output:
        checks.extension(FLAGS.output, [".csv"])
    network, lines = universal.load(FLAGS.policy, name != "walk"), []
    print(f"{'family':<10}" + "".join(f"{head:>13}" for head in transfer.Result._fields))
    for family in FLAGS.families:
        played = transfer.of_family(family, network, name, settings)
        print(f"{family:<10}" + "".join(f"{number:>13.4g}" for number in transfer.result(played)), flush=True)
        for trial in played:
            for who in ("policy", "demonstrator", "zero"):
                lines.append((family, trial.body, who, *getattr(trial, who)))
    if FLAGS.output:
        with files.writing(FLAGS.output) as path, path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(_HEADS)
            writer.writerows(lines)
