"""Checkpoints of a run's policy: one folder for each evaluation, which any program takes as a policy.

    RUN/checkpoints/<step>/policy.npz   the policy
    RUN/checkpoints/<step>/agent.json   its metadata: algorithm, environment steps, seed, mean return

The folder `RUN/checkpoints` itself is a policy, too: its checkpoints take turns from seed to seed.
"""

from pathlib import Path
from typing import NamedTuple

from arc_suite import checks, files, parsers

FOLDER = "checkpoints"
AGENT = "agent.json"
QUALITIES = ("random", "medium", "expert", "replay")
MEDIUM = 1.0 / 3.0  # of the best return, as in D4RL (Fu et al., 2020)


class Agent(NamedTuple):
    """Metadata of a checkpoint.

    Attributes:
        algorithm: name of the algorithm.
        steps: environment steps of training until the checkpoint.
        seed: seed of the run.
        mean_return: mean return of the checkpoint's evaluation.
    """

    algorithm: str
    steps: int
    seed: int
    mean_return: float


def save(folder: Path, agent: Agent) -> None:
    """Write the metadata of a checkpoint into its folder.

    Raises:
        OSError: it cannot be written.
    """
    with files.writing_json(folder / AGENT) as file:
        file.update(agent._asdict())


def agents(path: Path) -> list[Agent]:
    """Return the metadata of one checkpoint, or of all in a folder, sorted by step; none of another folder.

    Raises:
        ValueError: a damaged file.
    """
    with parsers.guard(f"{path}: damaged"):
        paths = [path / AGENT] if (path / AGENT).exists() else list(path.glob(f"*/{AGENT}"))
        return sorted((Agent(**files.read_json(file)) for file in paths), key=lambda agent: agent.steps)


def at(run: Path, step: int) -> Path:
    """Return the checkpoint of a run at a step.

    Raises:
        ValueError: there is no such checkpoint.
    """
    steps = [agent.steps for agent in agents(run / FOLDER)]
    if step not in steps:
        choices = checks.list_choices([str(step) for step in steps])
        raise ValueError(f"{run}: keeps no checkpoint at {step} {choices}")
    return run / FOLDER / str(step)


def of_quality(run: Path, quality: str) -> str:
    """Return the policy of a quality, named as in D4RL.

    "random" is uniform; "medium" is the first checkpoint with at least a third of the best return; "expert" is the
    latest; "replay" is all of them in turn.

    Raises:
        ValueError: an unknown quality, a run without checkpoints, or medium of a run without a positive return; one
            line.
    """
    checks.name(quality, QUALITIES, "quality")
    checkpoints = agents(run / FOLDER)
    if not checkpoints:
        raise ValueError(f"{run}: keeps no checkpoints")
    if quality == "random":
        return "random"
    if quality == "replay":
        return str(run / FOLDER)
    if quality == "expert":
        return str(at(run, checkpoints[-1].steps))
    best = max(agent.mean_return for agent in checkpoints)
    if best <= 0.0:
        raise ValueError(f"{run}: none is medium, as the best earns {best:.1f}; there are random, expert and replay")
    first_medium = next(agent for agent in checkpoints if agent.mean_return >= MEDIUM * best)
    return str(at(run, first_medium.steps))
