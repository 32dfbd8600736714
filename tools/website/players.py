"""Pages of the site in which creatures walk; they need the scripts that `make web` builds."""

from pathlib import Path

import numpy as np

import arc_suite
from arc_suite import policies, registry, style
from arc_suite.animation import pages, play_pages
from arc_suite.robots import ROBOTS
from website import markdown

GAME = "play.html"  # page to play in with the robots
GALLERY = "gallery.html"  # page to play in with generated creatures
CREATURES = tuple(f"varied:{seed}" for seed in range(24))
FILM_START = 60  # control steps before a film, in which the body finds its balance after the start
FILM_STEPS = 200  # control steps of a film


def film_pages() -> dict[str, str]:
    """Return the names of the pages with films by robot."""
    return {robot: f"walk_{robot}.html" for robot in ROBOTS}


def write(folder: Path) -> None:
    """Write the pages to play in, and the film of each robot.

    Raises:
        ValueError: the scripts have not been built.
    """
    bodies_of_page = {GAME: ROBOTS.values(), GALLERY: map(registry.body_of, CREATURES)}
    for name, bodies in bodies_of_page.items():
        page = play_pages.page([play_pages.creature(body) for body in bodies])
        (folder / name).write_text(page, encoding="utf-8")
    for robot, name in film_pages().items():
        environment = arc_suite.load(robot, "walk", {"random": 0})
        policy = policies.policy("ppo", robot, task=environment.task.definition)
        track = style.record(environment, policy, seed=0, max_steps=FILM_START + FILM_STEPS)
        film = _cut_start(track, FILM_START)
        (folder / name).write_text(pages.page({robot: film}), encoding="utf-8")


def _cut_start(track: style.Track, steps: int) -> style.Track:
    """Return a track without its first control steps."""
    arrays = {name: value[steps:] for name, value in track._asdict().items() if isinstance(value, np.ndarray)}
    terms = {name: values[steps:] for name, values in track.terms.items()}
    return track._replace(**arrays, terms=terms)


def frame(source: str, title: str, style_class: str = "creature") -> str:
    """Return the HTML that shows a page within another one.

    Args:
        source: path of the page that is shown.
        title: title of the frame.
        style_class: one of docs/_static/site.css.
    """
    attributes = {"class": style_class, "src": source, "title": title, "loading": "lazy"}
    return markdown.to_html(markdown.element("iframe", **attributes))
