"""How the runs of a study stand, from their tables: what is shown while they are made."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite.agents import run_folder
from arc_suite.studies.tables import Row

_EVERY = 2.0  # s between two looks, where no word changes


class State(NamedTuple):
    """How a run stands.

    Attributes:
        row: that makes it.
        word: finished, running, elsewhere, failed or waiting.
        step: environment steps of its latest line of times.
        result: mean return of the latest evaluation; None before the first.
        wall: s so far, of wall clock.
        cpu: s so far, of the processor.
    """

    row: Row
    word: str
    step: int
    result: float | None
    wall: float
    cpu: float


def states(rows: Sequence[Row], folder: Path, words: Mapping[str, str]) -> list[State]:
    """Return how the runs of a study stand.

    Args:
        rows: of the study.
        folder: of the study.
        words: of the runs, by name, as in `State`.
    """
    return [state(row, folder / row.name, words[row.name]) for row in rows]


def state(row: Row, folder: Path, word: str) -> State:
    """Return how a run stands, from its tables."""
    times, evaluations = (table(folder, name) for name in ("times", "evaluations"))
    step, wall, cpu = (times[name][-1] if times else 0.0 for name in ("step", "wall_seconds", "cpu_seconds"))
    result = None
    if evaluations:
        result = float(run_folder.latest_returns(evaluations).mean())
    return State(row, word, int(step), result, float(wall), float(cpu))


def watched(
    rows: Sequence[Row], folder: Path, words: Mapping[str, str], shown: Callable[[list[State]], None]
) -> Callable[[], None]:
    """Return a function that shows how runs stand, when a word has changed and every two seconds.

    It reads those tables alone that may have grown: all 120 of `paper`, at their end, take half a second of a core.

    Args:
        rows, folder, words: as `states` takes them; words change.
        shown: called with the states.
    """
    seen: dict[str, State] = {}
    latest = -math.inf

    def look() -> None:
        nonlocal latest
        changed = [row for row in rows if row.name not in seen or seen[row.name].word != words[row.name]]
        if not changed and time.monotonic() < latest + _EVERY:
            return
        growing = [row for row in rows if words[row.name] in ("running", "elsewhere")]
        seen.update((each.row.name, each) for each in states([*changed, *growing], folder, words))
        shown([seen[row.name] for row in rows])
        latest = time.monotonic()

    return look


def remaining(states: Sequence[State], jobs: int) -> float | None:
    """Return about how many seconds a study still takes; None where nothing tells yet.

    A run goes on as fast as it has gone so far, or as the others of its kind, or as all others.
    """
    paces: dict[str, list[float]] = {}
    for each in states:
        if each.step:
            for name in (each.row.kind, ""):
                paces.setdefault(name, []).append(each.wall / each.step)
    if not paces:
        return None
    total = 0.0
    for each in states:
        if each.word not in ("finished", "failed"):
            pace = each.wall / each.step if each.step else np.mean(paces.get(each.row.kind, paces[""]))
            total += pace * max(each.row.steps - each.step, 0)
    return total / jobs


def table(folder: Path, name: str) -> dict[str, np.ndarray]:
    """Return a table of a run, as `run_folder.table` does, without columns where there is none yet.

    Raises:
        ValueError: a damaged table; one line.
    """
    return run_folder.table(folder, name) if (folder / f"{name}.csv").exists() else {}
