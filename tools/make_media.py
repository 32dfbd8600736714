"""Draws the pictures of creatures that README and docs show: a row of `MEDIA` each.

Films are animated WebP: browsers and GitHub play it inline, in full colors, at a fifth of the size of a GIF.

Examples:
  python tools/make_media.py
  python tools/make_media.py docs/films/shoved.webp
"""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

import arc_suite
from arc_suite import checks, evaluation, files, policies, rotations
from arc_suite.animation import clips
from arc_suite.animation.clips import filming
from arc_suite.cli import program
from arc_suite.cpg import suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.models.outline import outline
from arc_suite.simulation import films

ROOT = Path(__file__).parents[1]
TOTAL = 6_400_000  # bytes of all


class View(NamedTuple):
    """Some steps of an episode under the best demonstrator, and a camera on it.

    Attributes:
        robot: its name.
        task: its name.
        seed: of the episode.
        start: control steps before the first picture.
        moment: control steps from there to the still.
        command: set live all along; None for that of the task.
        azimuth: of the camera from where the torso heads in the middle of the view, degrees, positive to the left.
        elevation: of the camera, degrees.
        distance: of the camera, in distances of the farthest foot from the torso.
        drives: whether the camera goes along in a straight line; else it stands.
        settings: of the task.
    """

    robot: str
    task: str = "walk"
    seed: int = 0
    start: int = 60
    moment: int = 35
    command: tuple[float, ...] | None = None
    azimuth: float = -50.0
    elevation: float = 13.0
    distance: float = 4.4
    drives: bool = True
    settings: Mapping[str, float] = {}


_CLOSE = {"distance": 3.7, "azimuth": -42.0}
_SIDE = {"azimuth": -90.0, "elevation": 14.0, "distance": 6.0, "drives": False}
ROBOTS = {robot: View(robot, **_CLOSE) for robot in ("queen", "bastion", "tick", "leaper")}
IN_PLACE = {robot: view._replace(task="steer") for robot, view in ROBOTS.items()}
IN_PLACE["leaper"] = IN_PLACE["leaper"]._replace(settings={"gait_frequency": 1.5})  # that of the others: one loop
TASKS = {
    "walk": View("queen", azimuth=-60.0, distance=4.0),
    "steer": View("bastion", "steer", 39, 105, 60, azimuth=-25.0, elevation=32.0, distance=6.2),
    "directed": View("queen", "directed", 4, 65, 50, (0.7, 0.0, 0.4), azimuth=-60.0, elevation=14.0, distance=4.5),
    "shoved": View("bastion", "shoved", 1, 45, 30, (1.0, 0.0, 0.0), azimuth=35.0, elevation=18.0, distance=5.0),
    "limp": View("tick", "limp", 1, 60, 20, (1.0, 0.0, 0.0), azimuth=60.0),
    "rough": View("tick", "rough", **{**_SIDE, "distance": 7.0}),
    "slopes": View(
        "queen",
        "slopes",
        start=110,
        azimuth=-105.0,
        elevation=14.0,
        distance=6.2,
        drives=False,
        settings={"difficulty": 1.0},
    ),
    "stairs": View("bastion", "stairs", **{**_SIDE, "azimuth": -112.0}),
    "gaps": View("tick", "gaps", **{**_SIDE, "elevation": 25.0}),
    "course": View("queen", "course", start=110, **_SIDE),
    "leap": View("queen", "leap", start=288, moment=32, **{**_SIDE, "elevation": 20.0}),
    "roam": View("queen", "roam", 0, 40, 31, elevation=20.0, distance=6.0, drives=False),
    "navigate": View("bastion", "navigate", 0, 40, 62, azimuth=155.0, elevation=38.0, distance=9.0),
}
_FPS = 30.0  # of clips
_ABOVE = 0.82  # share of what is cut from a square, where it is empty, that is cut above
_CAPTION = 22  # height of a caption, pixels: legible where a page shows a picture at half its width
_FRAMES = 67  # control steps of a view, on whose path the camera is fitted


def played(view: View, environment, steps: int) -> Iterator[int]:
    """Play a view, and yield the number of each of its control steps."""
    definition = environment.task.definition
    policy = policies.policy("cpg", view.robot, suited_preset(definition), task=definition)
    for step, timestep in enumerate(evaluation.rollout(environment, policy, view.seed, view.start + steps)):
        if timestep.first() and view.command is not None:
            environment.command("command", view.command)
        if step > view.start:
            yield step - view.start - 1


def opened(view: View):
    """The environment of a view."""
    return arc_suite.load(view.robot, view.task, dict(view.settings))


class Camera:
    """A camera that stands, or goes along a straight line, and looks at the torso."""

    def __init__(self, view: View, environment):
        """Fit the line to the torso's path."""
        poses = [environment.physics.data.qpos[:7].copy() for _ in played(view, environment, _FRAMES)]
        path = np.array(poses)
        self._line = np.polynomial.polynomial.polyfit(np.arange(len(path)), path[:, :3], int(view.drives))
        azimuth = rotations.yaw(path[len(path) // 2, 3:7]) + math.radians(view.azimuth)
        elevation = math.radians(view.elevation)
        reach = abs(outline(environment.task.body)[..., :2]).max()
        level = np.array((math.cos(azimuth), math.sin(azimuth), 0.0))
        above = np.array((0.0, 0.0, 1.0))
        self._back = view.distance * reach * (math.cos(elevation) * level + math.sin(elevation) * above)
        self._up = math.cos(elevation) * above - math.sin(elevation) * level
        self._lower = np.array((0.0, 0.0, 0.35 * environment.task.body.torso.standing_height))

    def aim(self, scene, step: int) -> None:
        """Aim the cameras of a scene at a step of the view."""
        target = np.polynomial.polynomial.polyval(step, self._line) - self._lower
        for camera in scene.camera:
            camera.pos, camera.up = target + self._back, self._up
            camera.forward = -self._back / np.linalg.norm(self._back)


def pictures(view: View, size: tuple[int, int], steps: int) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of a view: of each of its steps, or of its moment where there are none."""
    (width, height), environment = size, opened(view)
    camera, quality = Camera(view, environment), "film" if steps else "still"
    for step in played(view, environment, steps or view.moment + 1):
        if steps or step == view.moment:
            yield environment.physics.render(
                height,
                width,
                "profile",
                quality=quality,
                scene_callback=lambda _, scene, step=step: camera.aim(scene, step),
            )
    environment.close()


def in_place(view: View, size: tuple[int, int], steps: int) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of one gait cycle in place, 30 a second, on plain ground."""
    width, height = size
    setup = Setup.of(view.robot, view.task, dict(view.settings))
    (clip,) = clips.clips(setup, ["walk"], fps=_FPS)
    above = round(_ABOVE * (width - height))
    for square in filming.film_pictures(setup.body, clip, width, heading=math.radians(-90.0 - view.azimuth)):
        yield square[above : above + height]


class Media(NamedTuple):
    """A picture or film, of one view or of several in a grid.

    Attributes:
        path: of the file, from the repository's root.
        views: by caption.
        columns: of the grid.
        size: width and height of a view, pixels.
        steps: control steps of a film, a frame each; 0 for a still.
        captions: whether it shows them.
        large: whether the first view takes four cells.
        limit: bytes.
        source: of a view's pictures.
        quality: of WebP, 0 to 100.
        fps: frames a second.
    """

    path: str
    views: Mapping[str, View]
    columns: int = 1
    size: tuple[int, int] = (448, 252)
    steps: int = _FRAMES  # five cycles of a gait of 1.5 Hz, four of 1.2 Hz: the loop goes on where it began
    captions: bool = False
    large: bool = False
    limit: int = 400_000
    source: Callable = pictures
    quality: int = 50
    fps: float = 20.0


MEDIA = (
    Media("docs/films/robots.webp", IN_PLACE, 2, (600, 400), 20, limit=950_000, source=in_place, quality=75, fps=_FPS),
    Media("docs/robots.png", ROBOTS, 2, (640, 400), 0, True, limit=700_000),
    Media("docs/tasks.png", TASKS, 4, (360, 216), 0, True, True, 800_000),
    *(Media(f"docs/films/{name}.webp", {name: view}) for name, view in {**ROBOTS, **TASKS}.items()),
)


def arranged(views: list[np.ndarray], media: Media) -> np.ndarray:
    """Return pictures in a grid, the first of them in four cells where it is large."""
    columns = media.columns
    if not media.large:
        return films.grid(views, columns)
    near = 1 + 2 * (columns - 2)
    top = [views[0], films.grid(views[1:near], columns - 2)]
    return np.concatenate([np.concatenate(top, axis=1), films.grid(views[near:], columns)])


def draw(media: Media) -> None:
    """Draw a picture or film, and write it."""
    views = []
    for number, (name, view) in enumerate(media.views.items()):
        size = tuple(pixels * (1 + (media.large and number == 0)) for pixels in media.size)
        drawn = media.source(view, size, media.steps)
        views.append([films.captioned(picture, name, _CAPTION) if media.captions else picture for picture in drawn])
    frames = [arranged(list(row), media) for row in zip(*views, strict=True)]
    path = ROOT / media.path
    path.parent.mkdir(exist_ok=True)
    with files.writing(path) as temporary:
        if path.suffix == ".webp":
            films.write_webp(temporary, frames, 1.0 / media.fps, media.quality)
        else:
            films.write_png(temporary, frames, 0.0)
    size = path.stat().st_size
    if size > media.limit:
        raise ValueError(f"{media.path}: {size} bytes, at most {media.limit}")
    print(f"{media.path}: {size} bytes")


def main(path: str | None = None) -> None:
    """Draw the row of `MEDIA` with a path, or all of them."""
    rows = {media.path: media for media in MEDIA}
    for each in rows if path is None else [checks.name(path, rows, "picture")]:
        draw(rows[each])


if __name__ == "__main__":
    program.run(main)
