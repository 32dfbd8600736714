"""Runs studies in this process: runs of equal shape advance side by side, in one program, as a GPU wants them."""

import functools
import time
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from arc_suite.agents import study_runner, training
from arc_suite.agents.calls import Call
from arc_suite.agents.studies import Row
from arc_suite.agents.study_states import State, states, watched
from arc_suite.agents.together import together
from arc_suite.envs.vector import usable_cores

_PAUSE = 2.0  # s between two looks at what other processes make
_no_bar = functools.partial(tqdm, disable=True)


def run(
    rows: Sequence[Row],
    folder: Path,
    published: Path,
    width: int,
    shown: Callable[[list[State]], None],
    progress: Callable = tqdm,
) -> list[State]:
    """Make the runs that are not finished, side by side, and publish them.

    Folders are those that `arc-suite train` makes, without its picture of returns and ONNX file; the last digits of
    what is learned are others, and depend on the width. What another process goes on with is waited for.

    Args:
        rows, folder, published, shown, progress: as `study_runner.run` takes them.
        width: runs side by side.

    Returns, raises: as `study_runner.run` does.
    """
    words = study_runner.prepared(rows, folder, usable_cores(), progress)
    look = watched(rows, folder, words, shown)

    def beside() -> int:
        return list(words.values()).count("running")

    def work(row: Row) -> Generator[Call, Any, None]:
        """Train a run that no other process goes on with, and publish it."""
        if (log := study_runner.claimed(folder / f"{row.name}.log")) is None:
            words[row.name] = "elsewhere"
            return
        with log:
            words[row.name] = "running"
            look()
            try:
                yield from training.training(
                    row.run(), folder / row.name, progress=_no_bar, told=lambda *_: look(), beside=beside
                )
                words[row.name] = "finished"
            except (ValueError, OSError) as error:
                log.write(f"arc-suite train: {' '.join(str(error).split())}\n".encode())
                words[row.name] = "failed"
            except Exception:
                log.write(traceback.format_exc().encode())
                words[row.name] = "failed"
        study_runner.publish(row, folder, published)
        look()

    while waiting := [row for row in rows if words[row.name] in ("waiting", "elsewhere")]:
        for group in groups(waiting, width):
            together([work(row) for row in group], width)
        if "elsewhere" in words.values():
            time.sleep(_PAUSE)
    study_runner.publish_all(rows, folder, published)
    return states(rows, folder, words)


def groups(rows: Sequence[Row], width: int) -> Iterator[tuple[Row, ...]]:
    """Yield runs whose calls are of equal shape, at most `width` at a time, groups in the order of their first rows."""
    alike: dict[str, list[Row]] = {}
    for row in rows:
        alike.setdefault(_shape(row), []).append(row)
    for several in alike.values():
        for first in range(0, len(several), width):
            yield tuple(several[first : first + width])


def _shape(row: Row) -> str:
    """What is equal where runs learn alike, in bodies with the same number of legs and of joints."""
    try:
        run = row.run()
    except ValueError:
        return row.name  # which fails by itself, with the reason in its log
    sizes = len(run.body.legs), len(run.body.joint_names)
    return repr((run.definition, row.task, sorted(row.task_kwargs.items()), sizes))
