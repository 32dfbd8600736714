"""Strips of frames in reports of studies: those that are published, by which styles are compared by eye."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite.studies import tables
from arc_suite.studies.results import STRIP, Result

_STRIPS = (
    "Frames of the latest policy in the episode of seed 0, at equal phases of one gait cycle, to the nearest "
    "control step: the fifth cycle, or the latest whole one before a fall. The camera goes along and keeps its "
    "direction; where the task tells a command, it is straight ahead. The command line makes a page that plays the "
    "policy."
)


def paragraphs(name: str, groups: Mapping[str, Mapping[str, Sequence[Result]]], published: Path) -> list[str]:
    """Return the strips of a study as Markdown: of each kind of run that of the first seed which has one.

    Args:
        name: of the study.
        groups: its results, see `results.grouped`.
        published: folder of its tables.

    Returns:
        Paragraphs; none where nothing has a strip.
    """
    found = []
    for place, kinds in groups.items():
        for kind, seeds in kinds.items():
            rows = [each.row for each in seeds if (published / each.row.name / STRIP).exists()]
            for row in rows[:1]:
                command = shlex.join(
                    ["arc-suite", *row.page_arguments(Path("runs", tables.folder_name(name), row.name))]
                )
                found.append(f"**{place}: {kind}**, seed {row.seed}: `{command}`")
                found.append(f"![{place}: {kind}]({row.name}/{STRIP})")
    return [_STRIPS, *found] if found else []
