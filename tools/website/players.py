"""Pages of the site in which creatures walk, where `make web` has built their scripts."""

from pathlib import Path

import numpy as np

import arc_suite
from arc_suite import policies, registry, style
from arc_suite.animation import pages, play_pages
from arc_suite.robots import ROBOTS
from website import markdown

GAME, GALLERY = "play.html", "gallery.html"  # pages to play in: the robots, generated creatures
CREATURES = tuple(f"varied:{seed}" for seed in range(24))
START, STEPS = 60, 200  # control steps before a film, in which the thrown body finds its feet, and in it


def films() -> dict[str, str]:
    """Return names of the films' pages by robot."""
    return {robot: f"walk_{robot}.html" for robot in ROBOTS}


def write(folder: Path) -> None:
    """Write the pages to play in, and the film of each robot.

    Raises:
        ValueError: the scripts have not been built.
    """
    for name, bodies in {GAME: ROBOTS.values(), GALLERY: map(registry.body_of, CREATURES)}.items():
        page = play_pages.page([play_pages.creature(body) for body in bodies])
        (folder / name).write_text(page, encoding="utf-8")
    for robot, name in films().items():
        environment = arc_suite.load(robot, "walk", {"random": 0})
        policy = policies.policy("ppo", robot, task=environment.task.definition)
        track = style.record(environment, policy, 0, START + STEPS)
        (folder / name).write_text(pages.page({robot: _after(track, START)}), encoding="utf-8")


def _after(track: style.Track, start: int) -> style.Track:
    """The rest of a track after some of its control steps."""
    parts = {name: value[start:] for name, value in track._asdict().items() if isinstance(value, np.ndarray)}
    return track._replace(**parts, terms={name: values[start:] for name, values in track.terms.items()})


def frame(source: str, title: str, kind: str = "creature") -> str:
    """Return the HTML that shows a page within another; `kind` is a class of docs/_static/site.css."""
    attributes = {"class": kind, "src": source, "title": title, "loading": "lazy"}
    return markdown.as_html(markdown.element("iframe", **attributes))
