"""Trackers that a training hands its metrics to: TensorBoard, and Weights & Biases.

Each opens with the first metrics of a run, whose folder has begun by then.
"""

import contextlib
import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from arc_suite import versions
from arc_suite.learning.agents.configuration import Configuration

_PROJECT = "arc_suite"  # of Weights & Biases, where the variable WANDB_PROJECT names none

Listener = Callable[[int, Mapping[str, float]], None]


@contextlib.contextmanager
def open_tensorboard(folder: Path) -> Iterator[Listener]:
    """Yield a listener that writes metrics for TensorBoard.

    Raises:
        ValueError: tensorboardX is not installed.
    """
    with versions.require_extra("--tensorboard needs tensorboardX", "learn"):
        from tensorboardX import SummaryWriter
    writers = []

    def write(step, metrics):
        if not writers:  # purges events after the checkpoint that the run resumes from
            writers.append(SummaryWriter(str(folder / "tensorboard"), purge_step=step))
        for name, value in metrics.items():
            writers[0].add_scalar(name, value, step)

    try:
        yield write
    finally:
        for writer in writers:
            writer.close()


@contextlib.contextmanager
def open_wandb(run: Configuration, folder: Path) -> Iterator[Listener]:
    """Yield a listener that hands metrics to Weights & Biases; a run that resumes goes on there, too.

    Variables of wandb hold, such as WANDB_MODE=offline and WANDB_PROJECT.

    Raises:
        ValueError: wandb is not installed.
    """
    try:
        import wandb
    except ImportError as error:
        raise ValueError(f"--wandb needs wandb: pip install wandb ({error})") from None
    path = folder.resolve()
    path_hash = hashlib.sha256(str(path).encode()).hexdigest()
    boards = []

    def write(step, metrics):
        if not boards:
            board = wandb.init(
                project=os.environ.get("WANDB_PROJECT", _PROJECT),
                name=path.name,
                id=f"{path.name}-{path_hash[:8]}",
                resume="allow",
                reinit="create_new",  # several runs of one process
                dir=str(path),
                config=run.record(),
            )
            board.define_metric("*", step_metric="step")  # wandb's own counter refuses steps that a run repeats
            boards.append(board)
        boards[0].log({"step": step, **metrics})

    try:
        yield write
    finally:
        for board in boards:
            board.finish()
