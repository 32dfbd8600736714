"""Puts the policy of a run into the package: float16, with hash, command and return in policies.json.

Example:
  python tools/package_policies.py runs/tick-walk-ppo-0
"""

import dataclasses
import json
import shlex
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files, policies
from arc_suite.agents import configuration
from arc_suite.cli import program
from arc_suite.envs.setup import Setup
from arc_suite.policies import network
from arc_suite.policies.named import PACKAGED

INDEX = PACKAGED / "policies.json"


def command(run: configuration.Configuration) -> str:
    """Return the command that trains a policy again, without what are defaults."""
    defaults = dataclasses.asdict(run.definition.hyperparameters.__class__())
    values = dataclasses.asdict(run.hyperparameters)
    hyperparameters = {name: value for name, value in values.items() if value != defaults[name]}
    flags = [f"--robot={run.setup.body.name}", f"--task={run.setup.task}", f"--algorithm={run.algorithm}"]
    flags += [f"--steps={run.steps}", f"--seed={run.seed}", f"--evaluate_every={run.evaluate_every}"]
    flags += [f"--hp={name}={value}" for name, value in hyperparameters.items()]
    flags += [f"--set={name}={json.dumps(value)}" for name, value in run.setup.task_kwargs.items()]
    return shlex.join(["arc-suite", "train", *flags])


def main(run: str | None = None) -> None:
    """Package the policy of a run."""
    if run is None:
        raise ValueError("expected the folder of a run, got none")
    found, known = network.load(Path(run)), configuration.read(Path(run) / "config.json")
    layers = [layer._replace(arrays=tuple(a.astype(np.float16) for a in layer.arrays)) for layer in found.layers]
    name = f"{known.setup.body.name}-{known.setup.task}"
    PACKAGED.mkdir(exist_ok=True)
    path = PACKAGED / f"{name}{network.EXTENSION}"
    network.save(path, found._replace(layers=tuple(layers)))
    environment = Setup.of(known.setup.body, known.setup.task).make_vec(10, autoreset_mode="Disabled")
    returns = [episode.total for episode in evaluation.episodes_in_batch(environment, network.load(path))]
    entry = {
        "command": command(known),
        "return": round(float(np.mean(returns)), 1),
        "sha256": policies.digest(str(path)),
    }
    index = files.read_json(INDEX) if INDEX.exists() else {}
    with files.writing_json(INDEX) as file:
        file.update(sorted((index | {name: entry}).items()))
    print(f"{path}: {path.stat().st_size} bytes, return {entry['return']}")


if __name__ == "__main__":
    program.run(main)
