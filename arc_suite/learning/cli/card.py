"""Write the model card of a run: README.md in its folder, which model hubs show.

It says robot, task, settings, steps, the return and the score with their intervals, commands, hashes, versions and the
license, and shows a picture of the policy. `arc-suite train` writes it when a run is complete.

  arc-suite card runs/tick-walk-ppo-0
"""

from pathlib import Path

from absl import flags

from arc_suite import registry
from arc_suite.learning import cards
from arc_suite.learning.agents import configuration, run_folder

FLAGS = flags.FLAGS
flags.DEFINE_list("modules", [], "Modules, with commas between them, that register what config.json names.")


def main(run: str | None = None) -> None:
    """Write the card, and print its path."""
    if run is None:
        raise ValueError("expected the folder of a run, such as runs/tick-walk-ppo-0")
    for module in FLAGS.modules:
        registry.import_module(module, "--modules")
    folder = Path(run)
    run_folder.read_config(folder)  # says that the folder is of no run
    try:
        read_run = configuration.read(folder / run_folder.CONFIG)
    except registry.NotImported as error:
        raise ValueError(f"{error}, by --modules") from None
    print(f"wrote {cards.write(read_run, folder)}")
