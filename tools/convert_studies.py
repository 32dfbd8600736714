"""Converts committed results of studies to the present names of algorithms and hyperparameters.

python tools/convert_studies.py studies
"""

import json
import pathlib
import sys

ALGORITHMS = {"imitation": "dagger", "cloning": "bc"}
LEARNERS = {f"arc_suite.agents.{old}": f"arc_suite.agents.{new}" for old, new in ALGORITHMS.items()}
PRIOR = {"fenced": "protected", "beside": "symmetric_sampling"}
HYPERPARAMETERS = {
    "averaging": "tau",
    "capacity": "buffer_size",
    "random_steps": "start_steps",
    "updates_per_step": "utd_ratio",
    "rows": "num_envs",
    "mirrored": "symmetry_augmentation",
    "trace": "gae_lambda",
    "first_std": "initial_std",
    "last_std": "final_std",
    "first_divergence": "initial_desired_kl",
    "last_divergence": "final_desired_kl",
    "normalising": "normalize_until",
    "warm_up": "value_warm_up",
}


def converted(config: dict) -> dict:
    """Return a record with the present names, of a record with the earlier ones."""
    found = {"hyperparameters" if name == "row" else name: value for name, value in config.items()}
    found["algorithm"] = ALGORITHMS.get(found["algorithm"], found["algorithm"])
    found["learner"] = LEARNERS.get(found["learner"], found["learner"])
    hyperparameters = {HYPERPARAMETERS.get(name, name): value for name, value in found["hyperparameters"].items()}
    if "prior" in hyperparameters:
        hyperparameters["prior"] = PRIOR.get(hyperparameters["prior"], hyperparameters["prior"])
    return found | {"hyperparameters": hyperparameters}


def main(studies: pathlib.Path) -> None:
    """Convert the configurations below a folder, and rename the folders of runs."""
    for path in sorted(studies.glob("*/*/config.json")):
        path.write_text(json.dumps(converted(json.loads(path.read_text())), indent=2) + "\n")
        name = path.parent.name
        for old, new in ALGORITHMS.items():
            name = name.replace(f"-{old}-", f"-{new}-")
        path.parent.rename(path.parent.with_name(name))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
