"""Draws the pictures of creatures that README and docs show: a row of `MEDIA` each.

Films are animated WebP: browsers and GitHub play it inline, in full colors, at a fifth of the size of a GIF.

Examples:
  python tools/make_media.py
  python tools/make_media.py docs/films/shoved.webp
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from media import cuts
from media.hand import Hand
from media.stage import pictures_of
from media.views import FALL_VIEWS, FPS, ONE_VIEWS, ROBOT_VIEWS, TASK_VIEWS, View
from PIL import Image

from arc_suite import checks, files
from arc_suite.cli import program
from arc_suite.simulation import films

ROOT = Path(__file__).parents[1]
MAX_STILL_BYTES = 300_000
MAX_TOTAL_BYTES = 8_650_000  # of all pictures and films
_CAPTION_HEIGHT = 22  # pixels: legible where a page shows a picture at half its width


class Media(NamedTuple):
    """A picture or film, of one view or of several in a grid.

    Attributes:
        path: path of the file, from the repository's root.
        views: by caption; those of a film are equally long.
        columns: columns of the grid.
        size: width and height of a view, pixels.
        captions: whether it shows them.
        large: whether the first view takes four cells.
        limit: bytes.
        quality: quality of WebP, 0 to 100.
    """

    path: str
    views: Mapping[str, View]
    columns: int = 1
    size: tuple[int, int] = (448, 252)
    captions: bool = False
    large: bool = False
    limit: int = 400_000
    quality: int = 32

    @property
    def is_film(self) -> bool:
        """Whether it moves."""
        return self.path.endswith(".webp")

    @property
    def picture_size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""
        cells = len(self.views) + 3 * self.large  # the large view takes four
        return self.columns * self.size[0], -(-cells // self.columns) * self.size[1]

    @property
    def frames(self) -> int:
        """Number of its frames."""
        return next(iter(self.views.values())).frames if self.is_film else 1

    def pictures(self) -> list[np.ndarray]:
        """Draw its frames (height, width, 3)."""
        pictures_of_views = []
        for number, (name, view) in enumerate(self.views.items()):
            width, height = self.size
            is_large = self.large and number == 0
            size = (2 * width, 2 * height) if is_large else (width, height)
            view_pictures = list(pictures_of(view, size, self.is_film))
            if self.captions:
                view_pictures = [films.add_caption(picture, name, _CAPTION_HEIGHT) for picture in view_pictures]
            pictures_of_views.append(view_pictures)
        return [arrange(list(views), self) for views in zip(*pictures_of_views, strict=True)]


class CutFilm(NamedTuple):
    """A film of cuts, one after the other; attributes as of `Media`."""

    path: str
    cuts: Mapping[str, View | Hand]
    size: tuple[int, int] = (1280, 720)
    limit: int = 3_000_000
    quality: int = 40
    is_film: bool = True

    @property
    def picture_size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""
        return self.size

    @property
    def frames(self) -> int:
        """Number of its frames."""
        return sum(cut.frames for cut in self.cuts.values())

    def pictures(self) -> list[np.ndarray]:
        """Draw its frames (height, width, 3)."""
        return [picture for cut in self.cuts.values() for picture in cuts.pictures_of(cut, self.size)]


_STILL = {"captions": True, "limit": MAX_STILL_BYTES}
MEDIA = (
    CutFilm("docs/films/first_sight.webp", cuts.CUTS),
    Media("docs/robots.png", ROBOT_VIEWS, columns=2, size=(640, 400), **_STILL),
    Media("docs/tasks.png", TASK_VIEWS, columns=6, size=(264, 160), large=True, **_STILL),
    Media("docs/films/recover.webp", FALL_VIEWS, columns=4, size=(120, 84), quality=12),
    *(Media(f"docs/films/{name}.webp", {name: view}) for name, view in ONE_VIEWS.items()),
)


def arrange(views: list[np.ndarray], media: Media) -> np.ndarray:
    """Return pictures in a grid, the first one in four cells if it is large."""
    columns = media.columns
    if not media.large:
        return films.grid(views, columns)
    views_at_the_top = 1 + 2 * (columns - 2)  # the large one, and two rows to its right
    top = [views[0], films.grid(views[1:views_at_the_top], columns - 2)]
    return np.concatenate([np.concatenate(top, axis=1), films.grid(views[views_at_the_top:], columns)])


def draw(media: Media | CutFilm) -> None:
    """Draw a picture or film, and write it."""
    frames = media.pictures()
    path = ROOT / media.path
    path.parent.mkdir(exist_ok=True)
    with files.writing(path) as temporary:
        if media.is_film:
            films.write_webp(temporary, frames, 1.0 / FPS, media.quality)
        else:
            films.write_small_png(temporary, Image.fromarray(frames[0]), dithers=True)
    num_bytes = path.stat().st_size
    if num_bytes > media.limit:
        raise ValueError(f"{media.path}: {num_bytes} bytes, at most {media.limit}")
    print(f"{media.path}: {num_bytes} bytes")


def main(path: str | None = None) -> None:
    """Draw the row of `MEDIA` with a path, or all of them."""
    rows = {media.path: media for media in MEDIA}
    paths = rows if path is None else [checks.name(path, rows, "picture")]
    for media_path in paths:
        draw(rows[media_path])


if __name__ == "__main__":
    program.run(main)
