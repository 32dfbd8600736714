"""The files of a search: specs of the best, a table of all, a picture, and pages on which the best walk.

All follow from the outcomes, so that a search that was broken off leaves the same files in the end.
"""

import base64
import csv
import html
import io
import itertools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, cast
from xml.etree import ElementTree

import numpy as np
from PIL import Image

from arc_suite import files, policies, style
from arc_suite.animation import pages
from arc_suite.animation.design.axes import Map
from arc_suite.animation.design.search import Search
from arc_suite.animation.design.trials import GOALS, Trial, WalkMeans, open_walk
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation import films

STEPS = 200  # control steps of a walk on a page
_BEFORE_PICTURE = 60
_SIZE = (300, 225)  # pixels of a cell of the picture
_FIELDS = ("number", "cell", "elite", "reason", *(f"{name}_{turn}" for turn in (1, 2) for name in WalkMeans._fields))


class Elite(NamedTuple):
    """The best body of a cell.

    Attributes:
        label: of the cell.
        cell: of the map.
        number: of the body in the table.
        body: the body.
        first, second: its walks; see `trials.Outcome`.
    """

    label: str
    cell: tuple[int, ...]
    number: int
    body: Body
    first: WalkMeans
    second: WalkMeans

    def to_dict(self) -> dict:
        """Return what `design.json` holds of it."""
        return {"cell": self.label, "number": self.number, "first": self.first, "second": self.second}


def elites(search: Search, cells: Map) -> list[Elite]:
    """Return the best bodies, in the order of their cells."""
    found = []
    for cell, number in sorted(search.elites.items()):
        one = search.candidates[number]
        body = cast(Body, search.body(one.genes, number))  # an elite has one, and no reason why it has none
        found.append(Elite(cells.label(cell), cell, number, body, one.outcome.first, one.outcome.second))
    return found


def write_table(path: Path, search: Search, cells: Map) -> None:
    """Write a row for every body evaluated, CSV: cell, why it is excluded, metrics of both evaluations, genes."""
    best, none = set(search.elites.values()), [""] * len(WalkMeans._fields)
    with files.writing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([*_FIELDS, *search.genes])
        for number, (numbers, cell, (reason, first, second)) in enumerate(search.candidates):
            label = "" if cell is None else cells.label(cell)
            walks = [*(first or none), *(second or none)]
            table.writerow([number, label, int(number in best), reason, *walks, *numbers])


def write_specs(folder: Path, best: Iterable[Elite]) -> None:
    """Write the spec of every elite, named by its cell."""
    files.folder(folder)
    for elite in best:
        files.write(folder / f"{elite.label}.json", body_to_json(elite.body))


def caption(elite: Elite, cells: Map, goal: str) -> str:
    """Return the cell of an elite and its metric in its second evaluation."""
    names = ", ".join(f"{number} {name}" for name, number in zip(cells.names, elite.cell, strict=True))
    return f"{names}: {getattr(elite.second, GOALS[goal].metric):.3g}{GOALS[goal].unit}"


def pictures(best: Iterable[Elite], cells: Map, trial: Trial) -> dict[tuple[int, ...], np.ndarray]:
    """Return a captioned picture of every elite on its way, by its cell.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    views = {}
    for elite in best:
        environment, policy = open_walk(elite.body, trial.task, trial.first, GOALS[trial.goal])
        act = policies.alone(policy, trial.first.seeds[0])
        footage = films.Footage(elite.label, environment, act, "portrait", _SIZE)
        for _ in range(_BEFORE_PICTURE):
            footage.step()
        views[elite.cell] = films.captioned(footage.view(), caption(elite, cells, trial.goal))
        footage.close()
    return views


def write_picture(path: Path, views: Mapping[tuple[int, ...], np.ndarray]) -> None:
    """Write pictures as one; see `_arranged`."""
    shown, columns = _arranged(views)
    nothing = np.zeros((*_SIZE[::-1], 3), np.uint8)
    with files.writing(path) as temporary:
        films.write_png(temporary, [films.grid([views.get(cell, nothing) for cell in shown], columns)], 0.0)


def write_walks(folder: Path, best: Iterable[Elite], cells: Map, trial: Trial) -> None:
    """Write a page for each elite, on which it walks.

    Raises:
        ValueError: the viewer has not been built.
    """
    files.folder(folder)
    for elite in best:
        environment, policy = open_walk(elite.body, trial.task, trial.first, GOALS[trial.goal])
        track = style.record(environment, policy, trial.first.seeds[0], STEPS)
        environment.close()
        files.write(folder / f"{elite.label}.html", pages.page({caption(elite, cells, trial.goal): track}))


def write_page(path: Path, views: Mapping[tuple[int, ...], np.ndarray], cells: Map, title: str) -> None:
    """Write a page of all pictures, each a link to the page on which the body walks, with a link to its spec."""
    shown, columns = _arranged(views)
    items = "\n".join(_item(cells.label(cell), views.get(cell)) for cell in shown)
    text = pages.template("design/gallery.html").substitute(title=html.escape(title), columns=columns, items=items)
    files.write(path, text)


def _item(label: str, view: np.ndarray | None) -> str:
    """Return the figure of a cell as HTML; an empty one without a picture."""
    figure = ElementTree.Element("figure")
    if view is not None:
        buffer = io.BytesIO()
        Image.fromarray(view).save(buffer, "JPEG", quality=85)
        source = f"data:image/jpeg;base64,{base64.b64encode(buffer.getvalue()).decode()}"
        walk = ElementTree.SubElement(figure, "a", href=f"walks/{label}.html")
        ElementTree.SubElement(walk, "img", alt=label, src=source)
        name = ElementTree.SubElement(ElementTree.SubElement(figure, "figcaption"), "a", href=f"bodies/{label}.json")
        name.text = f"{label}.json"
    return ElementTree.tostring(figure, encoding="unicode", method="html")


def _arranged(views: Mapping[tuple[int, ...], np.ndarray]) -> tuple[list[tuple[int, ...]], int]:
    """Return the cells to show, row by row, and how many columns there are: the axis with fewer values has columns."""
    axes = [sorted(set(values)) for values in zip(*views, strict=True)]
    if min(map(len, axes)) == 1 or len(axes) == 1:
        return sorted(views), min(4, len(views))
    across = int(len(axes[1]) < len(axes[0]))
    cells = sorted(itertools.product(*axes), key=lambda cell: (cell[1 - across], cell[across]))
    return cells, len(axes[across])
