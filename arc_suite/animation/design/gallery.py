"""The files of a search: specs of the elites, a table of all bodies, a picture, and pages on which the elites walk.

Files follow from the outcomes alone. So a search that was interrupted leaves the same files in the end.
"""

import base64
import csv
import html
import io
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
from arc_suite.animation.design.trials import Goal, Trial, WalkMeans, goal_of, open_walk
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation import films

WALK_STEPS = 200  # control steps of a walk on a page
_PICTURE_STEP = 60  # control steps before the picture of a walk
_PICTURE_WIDTH = 300  # pixels of a cell
_PICTURE_HEIGHT = 225  # pixels of a cell
_MAX_COLUMNS = 4  # of a picture whose cells differ along one axis
_JPEG_QUALITY = 85
_WALK_COLUMNS = [f"{name}_{evaluation}" for evaluation in (1, 2) for name in WalkMeans._fields]
_COLUMNS = ("number", "cell", "elite", "reason", *_WALK_COLUMNS)  # before those of genes

Cell = tuple[int, ...]  # see `Map.cell`


class Elite(NamedTuple):
    """The best body of a cell.

    Attributes:
        label: label of the cell.
        cell: cell of the map.
        number: number of the body in the table.
        body: the body.
        first: its first walk; see `trials.Outcome`.
        second: its second walk.
    """

    label: str
    cell: Cell
    number: int
    body: Body
    first: WalkMeans
    second: WalkMeans

    def to_dict(self) -> dict:
        """Return what `design.json` holds of the elite."""
        return {"cell": self.label, "number": self.number, "first": self.first, "second": self.second}


class Layout(NamedTuple):
    """How a picture arranges cells.

    Attributes:
        cells: row by row, from left to right.
        columns: their number.
    """

    cells: list[Cell]
    columns: int


def find_elites(search: Search, cell_map: Map) -> list[Elite]:
    """Return the elites of a search, in the order of their cells."""
    elites = []
    for cell, number in sorted(search.elites.items()):
        candidate = search.candidates[number]
        body = cast(Body, search.body(candidate.genes, number))  # genes of an elite make a body
        outcome = candidate.outcome
        elites.append(Elite(cell_map.label(cell), cell, number, body, outcome.first, outcome.second))
    return elites


def write_table(path: Path, search: Search, cell_map: Map) -> None:
    """Write a row for every evaluated body, as CSV.

    A row holds the body's cell, why the body is excluded, the metrics of both evaluations, and the genes.
    """
    elite_numbers = set(search.elites.values())
    no_walk = [""] * len(WalkMeans._fields)
    with files.writing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([*_COLUMNS, *search.genes])
        for number, candidate in enumerate(search.candidates):
            label = "" if candidate.cell is None else cell_map.label(candidate.cell)
            is_elite = int(number in elite_numbers)
            reason, first, second = candidate.outcome
            walks = [*(first or no_walk), *(second or no_walk)]
            table.writerow([number, label, is_elite, reason, *walks, *candidate.genes])


def write_specs(folder: Path, elites: Iterable[Elite]) -> None:
    """Write the spec of every elite, named by its cell."""
    files.folder(folder)
    for elite in elites:
        files.write(folder / f"{elite.label}.json", body_to_json(elite.body))


def caption(elite: Elite, cell_map: Map, goal: Goal) -> str:
    """Return the cell of an elite, and its metric in its second evaluation."""
    value = goal.measure_metric(elite.second)
    return f"{cell_map.describe(elite.cell)}: {goal.metric_text} {value:.3g}{goal.unit}"


def draw_pictures(elites: Iterable[Elite], cell_map: Map, trial: Trial) -> dict[Cell, np.ndarray]:
    """Return a captioned picture (height, width, 3) of every elite in its walk, by its cell.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    goal = goal_of(trial.goal)
    pictures = {}
    for elite in elites:
        environment, policy = open_walk(elite.body, trial.task, trial.first, goal.preset)
        act = policies.alone(policy, trial.first.seeds[0])  # a function of a `TimeStep`
        size = (_PICTURE_WIDTH, _PICTURE_HEIGHT)
        footage = films.Footage(elite.label, environment, act, "portrait", size)
        for _ in range(_PICTURE_STEP):
            footage.step()
        pictures[elite.cell] = films.add_caption(footage.view(), caption(elite, cell_map, goal))
        footage.close()
    return pictures


def write_picture(path: Path, pictures: Mapping[Cell, np.ndarray]) -> None:
    """Write pictures as one picture, with a plain color in place of cells without an elite."""
    layout = _arrange_cells(pictures)
    empty_picture = films.empty_cell((_PICTURE_HEIGHT, _PICTURE_WIDTH, 3))
    all_pictures = [pictures.get(cell, empty_picture) for cell in layout.cells]
    with files.writing(path) as temporary:
        films.write_png(temporary, [films.grid(all_pictures, layout.columns)], seconds=0.0)


def write_walks(folder: Path, elites: Iterable[Elite], cell_map: Map, trial: Trial) -> None:
    """Write a page for each elite, on which it walks.

    Raises:
        ValueError: the viewer has not been built.
    """
    files.folder(folder)
    goal = goal_of(trial.goal)
    for elite in elites:
        environment, policy = open_walk(elite.body, trial.task, trial.first, goal.preset)
        track = style.record(environment, policy, seed=trial.first.seeds[0], max_steps=WALK_STEPS)
        environment.close()
        page = pages.page({caption(elite, cell_map, goal): track})
        files.write(folder / f"{elite.label}.html", page)


def write_page(path: Path, pictures: Mapping[Cell, np.ndarray], cell_map: Map, title: str) -> None:
    """Write a page of all pictures, with links to the walks and to the specs."""
    layout = _arrange_cells(pictures)
    items = "\n".join(_figure_html(cell_map.label(cell), pictures.get(cell)) for cell in layout.cells)
    template = pages.template("design/gallery.html")
    files.write(path, template.substitute(title=html.escape(title), columns=layout.columns, items=items))


def _figure_html(label: str, picture: np.ndarray | None) -> str:
    """Return the figure of a cell as HTML; an empty figure without a picture."""
    figure = ElementTree.Element("figure")
    if picture is not None:
        buffer = io.BytesIO()
        Image.fromarray(picture).save(buffer, "JPEG", quality=_JPEG_QUALITY)
        source = f"data:image/jpeg;base64,{base64.b64encode(buffer.getvalue()).decode()}"
        walk_link = ElementTree.SubElement(figure, "a", href=f"walks/{label}.html")
        ElementTree.SubElement(walk_link, "img", alt=label, src=source)
        figure_caption = ElementTree.SubElement(figure, "figcaption")
        spec_link = ElementTree.SubElement(figure_caption, "a", href=f"bodies/{label}.json")
        spec_link.text = f"{label}.json"
    return ElementTree.tostring(figure, encoding="unicode", method="html")


def _arrange_cells(pictures: Mapping[Cell, np.ndarray]) -> Layout:
    """Return the layout of all cells between those with pictures.

    The axis with fewer values runs across. Cells that differ along one axis only follow each other.
    """
    values_by_axis = [sorted(set(values)) for values in zip(*pictures, strict=True)]
    if len(values_by_axis) == 1 or min(len(values) for values in values_by_axis) == 1:
        return Layout(sorted(pictures), min(_MAX_COLUMNS, len(pictures)))
    first_values, second_values = values_by_axis
    cells: list[Cell]
    if len(second_values) < len(first_values):
        cells = [(first, second) for first in first_values for second in second_values]
        return Layout(cells, columns=len(second_values))
    cells = [(first, second) for second in second_values for first in first_values]
    return Layout(cells, columns=len(first_values))
