"""Write the model card of a run: README.md in its folder, which model hubs show.

It says robot, task, settings, steps, the return and the score with their intervals, commands, hashes, versions and the
license, and shows a picture of the policy. `arc-suite train` writes it when a run is complete.

  arc-suite card runs/tick-walk-ppo-0
"""

from pathlib import Path

from arc_suite.cli.flags import define_modules, hint_import, import_modules
from arc_suite.learning import cards
from arc_suite.learning.agents import configuration, run_folder

define_modules("config.json")


def main(run: str | None = None) -> None:
    """Write the card, and print its path."""
    if run is None:
        raise ValueError("expected the folder of a run, such as runs/tick-walk-ppo-0")
    import_modules()
    folder = Path(run)
    run_folder.read_config(folder)  # says that the folder is of no run
    with hint_import("--modules"):
        read_run = configuration.read(folder / run_folder.CONFIG)
    print(f"wrote {cards.write(read_run, folder)}")
