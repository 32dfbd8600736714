"""Score a policy of many bodies on bodies that it has not seen, by family.

A score is (return - standing still) / (demonstrator - standing still), each body with its own demonstrator: 0 is
standing still, 1 the demonstrator. A demonstrator that hardly walks makes any score large, so speeds are shown, too.
Each body plays 400 control steps, or up to the time limit of the task.

`walk` is the share of bodies that walk: no fall, 0.7 of the target speed, the torso off the ground. `speed` is the
policy's mean share of the target speed, and `tracking`, in tasks with a command, a share of the demonstrators'.
Families: random and varied, 50 bodies of seeds that no run trains with; the four robots with motors sized anew; 20
mutants of them; and 10 random bodies a quarter, and ten times, as large.

  arc-suite transfer --policy runs/varied.0-127-walk-dagger_bodies-0
  arc-suite transfer --policy universal --task steer --families varied,robots,pacer.json -o bodies.csv
"""

from pathlib import Path

from absl import flags

from arc_suite import checks, files, policies
from arc_suite.bodies import universal
from arc_suite.cli.flags import complete_task, define_task, hint_import, refuse_flags, task_from_flags
from arc_suite.envs.setup import Setup
from arc_suite.learning import transfer
from arc_suite.learning.studies import bodies

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_string("policy", "universal", "Folder of a run of many bodies, a policy file, or universal.")
flags.DEFINE_list("families", list(transfer.FAMILIES), "Families to play with, or files or module:name of bodies.")
flags.DEFINE_string(
    "output",
    None,
    "Table to add every episode to, CSV; earlier ones of the policy and task are replaced.",
    short_name="o",
)
flags.DEFINE_string("name", None, "Of the policy in this table. [default: --policy]")


def main() -> None:
    """Play, print the table and write the episodes."""
    task, settings = task_from_flags()  # first: this imports the modules that flags name
    if FLAGS.policy in policies.POLICIES and FLAGS.policy != universal.NAME:
        raise ValueError(f"policy {FLAGS.policy}: expected universal, or the folder of a run of many bodies")
    with hint_import("--task or --set"):
        trained = policies.setup_of(FLAGS.policy)
    task, settings = complete_task(trained, task, settings)
    if FLAGS.families == ["all"]:
        raise ValueError("--families=all: without the flag, all families play")
    families = {name: transfer.find_family(name) for name in FLAGS.families}
    if FLAGS.output:
        checks.extension(FLAGS.output, [".csv"])
        files.check_target(FLAGS.output)
    else:
        refuse_flags(["name"], "goes with --output")
    # A policy of many bodies is the same in the task of any body; Queen's stands for all.
    setup = Setup.of("queen", task, settings)
    definition = setup.definition
    network = universal.load(FLAGS.policy, definition)
    universal.Universal(network, definition)  # raises an error now for a task in which it cannot act
    print(f"{'family':<10}" + "".join(f"{head:>13}" for head in transfer.TransferResult._fields))
    comparisons_by_family = {}
    for name, family in families.items():
        comparisons = transfer.compare_family(name, family, network, task, settings)
        numbers = transfer.result(comparisons)
        print(f"{name:<10}" + "".join(f"{number:>13.4g}" for number in numbers), flush=True)
        comparisons_by_family[name] = comparisons
    if FLAGS.output:
        task_text = f"{task}, {setup.settings_json}" if setup.task_kwargs else task
        bodies.write(Path(FLAGS.output), FLAGS.name or FLAGS.policy, task_text, comparisons_by_family)
