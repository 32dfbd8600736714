"""Runs studies in this process: runs of equal shape advance side by side, in one program, as a GPU wants them."""

import contextlib
import functools
from collections.abc import Callable, Generator, Hashable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

from tqdm import tqdm

from arc_suite import checks
from arc_suite.agents import study_runner, training
from arc_suite.agents.calls import Call
from arc_suite.agents.studies import Row
from arc_suite.agents.study_runner import State
from arc_suite.agents.together import together


def run(
    rows: Sequence[Row],
    folder: Path,
    published: Path,
    width: int,
    shown: Callable[[list[State]], None],
    progress: Callable = tqdm,
) -> list[State]:
    """Make the runs that are not finished, side by side, and publish them.

    The folders are those that a process for each run would leave, but for the last digits, which depend on the
    width. Runs that another process makes are left to it.

    Args:
        rows: of the study.
        folder: of the study, in which each run has one of its own.
        published: folder for what is to be committed.
        width: runs side by side.
        shown: called with the states of all runs, again and again.
        progress: makes progress bars as `tqdm` does, of prior data that are collected first.

    Returns:
        The states of all runs; a failed run has said why in its log, beside its folder.

    Raises:
        ValueError: a row that does not fit, or the folder of another run; one line.
        OSError: something cannot be written; one line.
    """
    found = study_runner.prepared(rows, folder, 1, progress)
    words = {row.name: word for row, word in zip(rows, found, strict=True)}

    def states():
        return [study_runner.state(row, folder / row.name, words[row.name]) for row in rows]

    for group in groups([row for row in rows if words[row.name] == "waiting"], width):
        with contextlib.ExitStack() as stack:
            logs = {row.name: study_runner.claimed(folder / f"{row.name}.log") for row in group}
            mine = [row for row in group if logs[row.name]]
            works = []
            for row in mine:
                log = stack.enter_context(logs[row.name])
                works.append(_work(row, folder / row.name, log, lambda *_: shown(states())))
            words |= {row.name: "running" if logs[row.name] else "elsewhere" for row in group}
            shown(states())
            ends = together(works, width)
        words |= {row.name: word for row, word in zip(mine, ends, strict=True)}
        for row in mine:
            study_runner.publish(row, folder, published)
    study_runner.publish_all(rows, folder, published)
    return states()


def groups(rows: Sequence[Row], width: int) -> Iterator[tuple[Row, ...]]:
    """Yield runs whose calls are of equal shape, so many at a time at most; the order is that of the rows."""
    alike: dict[Hashable, list[Row]] = {}
    for row in rows:
        alike.setdefault(_shape(row), []).append(row)
    for several in alike.values():
        for first in range(0, len(several), width):
            yield tuple(several[first : first + width])


def _shape(row: Row) -> Hashable:
    """What is equal where runs learn alike, in bodies with as many legs and joints."""
    run = row.run()
    settings = checks.json_text("task_kwargs", row.task_kwargs)
    return run.definition, row.task, settings, len(run.body.legs), len(run.body.joint_names)


def _work(row: Row, folder: Path, log: IO, told: Callable) -> Generator[Call, Any, str]:
    """Train a run, and return the word for how it ended."""
    try:
        yield from training.training(row.run(), folder, progress=functools.partial(tqdm, disable=True), told=told)
    except (ValueError, OSError) as error:
        log.write(f"arc-suite train: {' '.join(str(error).split())}\n".encode())
        log.flush()
        return "failed"
    return "finished"
