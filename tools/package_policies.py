"""Puts the policy of a run into the package, of one robot as float16, with hash, command and return in policies.json.

Example:
  python tools/package_policies.py runs/tick-walk-ppo-0
  python tools/package_policies.py runs/varied.0-511-steer-dagger_bodies-0
"""

from pathlib import Path

import numpy as np

from arc_suite import evaluation, files, policies
from arc_suite.bodies import universal
from arc_suite.cli import program
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.policies import network
from arc_suite.policies.network import PACKAGED

INDEX = PACKAGED / "policies.json"


def command(run: configuration.Configuration) -> str:
    """Return the command that trains a policy again, after that of the run from which it starts."""
    start = Path(getattr(run.hyperparameters, "start", ""), run_folder.CONFIG)
    if not start.exists():
        return run.command
    return f"{command(configuration.read(start))} -o {start.parent} && {run.command}"


def returns(path: Path) -> list[float]:
    """Return the returns of a packaged policy in the episodes that judge a final policy."""
    packaged = network.load(path)
    setup = packaged.setup.validation(evaluation.EPISODES)
    if not setup.several:
        setup = Setup.of(setup.body, setup.task)  # without blocks that the policy leaves out itself
    environment = setup.make_vec(evaluation.EPISODES, autoreset_mode="Disabled")
    return [episode.total for episode in evaluation.episodes_in_batch(environment, packaged)]


def main(run: str | None = None) -> None:
    """Package the policy of a run."""
    if run is None:
        raise ValueError("expected the folder of a run, got none")
    policy = network.load(Path(run))
    run_configuration = configuration.read(Path(run) / "config.json")
    setup = run_configuration.setup
    arrays = dict(policy.graph.arrays)
    if not setup.several:  # inputs of many bodies differ too much in size for 16 bits
        for name, array in arrays.items():
            if array.dtype == np.float32:
                arrays[name] = array.astype(np.float16)
    body_name = universal.NAME if setup.several else setup.body.name
    name = f"{body_name}-{setup.task}"
    PACKAGED.mkdir(exist_ok=True)
    path = PACKAGED / f"{name}{network.EXTENSION}"
    network.save(path, policy._replace(graph=policy.graph._replace(arrays=arrays)))
    entry = {
        "command": command(run_configuration),
        "return": round(float(np.mean(returns(path))), 1),
        "sha256": policies.digest(str(path)),
    }
    index = files.read_json(INDEX) if INDEX.exists() else {}
    with files.writing_json(INDEX) as file:
        file.update(sorted((index | {name: entry}).items()))
    print(f"{path}: {path.stat().st_size} bytes, return {entry['return']}")


if __name__ == "__main__":
    program.run(main)
