"""Puts policies of runs into the package: float16, with hash, command and return in policies.json.

python tools/package_policies.py runs/tick-walk-ppo-0 runs/queen-walk-ppo-0
"""

import dataclasses
import json
import shlex
import sys
from pathlib import Path

import numpy as np

from arc_suite import evaluation, policies
from arc_suite.agents import configuration
from arc_suite.envs.setup import Setup
from arc_suite.policies import network

FOLDER = Path(network.__file__).with_name("packaged")
INDEX = FOLDER / "policies.json"


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


def main(runs: list[str]) -> None:
    """Package the policies of some runs."""
    FOLDER.mkdir(exist_ok=True)
    index = json.loads(INDEX.read_text(encoding="utf-8")) if INDEX.exists() else {}
    for run in map(Path, runs):
        found, known = network.load(run), configuration.read(run / "config.json")
        layers = [layer._replace(arrays=tuple(a.astype(np.float16) for a in layer.arrays)) for layer in found.layers]
        name = f"{known.setup.body.name}-{known.setup.task}"
        path = FOLDER / f"{name}{network.EXTENSION}"
        network.save(path, found._replace(layers=tuple(layers)))
        environment = Setup.of(known.setup.body, known.setup.task).make_vec(10, autoreset_mode="Disabled")
        returns = [episode.total for episode in evaluation.episodes_in_batch(environment, network.load(path))]
        index[name] = {
            "command": command(known),
            "sha256": policies.digest(str(path)),
            "return": round(float(np.mean(returns)), 1),
        }
        print(f"{path}: {path.stat().st_size} bytes, return {index[name]['return']}")
    INDEX.write_text(json.dumps(index, indent=2, sort_keys=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
