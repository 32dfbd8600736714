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
from PIL import Image

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
MAX_TOTAL_BYTES = 6_600_000  # of all pictures and films


class View(NamedTuple):
    """Some steps of an episode, and a camera on it.

    Attributes:
        robot: its name.
        task: its name.
        seed: seed of the episode.
        start: control steps before the first picture.
        moment: control steps from there to the still picture.
        command: set live throughout; None for that of the task.
        azimuth: azimuth of the camera from where the torso heads in the middle of the view, degrees, positive to the
            left.
        elevation: elevation of the camera, degrees.
        distance: distance of the camera, in distances of the farthest foot from the torso.
        drives: whether the camera goes along in a straight line; else it stands.
        settings: settings of the task.
        policy: name of the policy.
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
    policy: str = "cpg"


_CLOSE = {"distance": 3.7, "azimuth": -42.0}
_SIDE = {"azimuth": -90.0, "elevation": 14.0, "distance": 6.0, "drives": False}
ROBOT_VIEWS = {robot: View(robot, **_CLOSE) for robot in ("queen", "bastion", "tick", "leaper")}
IN_PLACE_VIEWS = {robot: view._replace(task="steer") for robot, view in ROBOT_VIEWS.items()}
# All four loop together at one frequency.
IN_PLACE_VIEWS["leaper"] = IN_PLACE_VIEWS["leaper"]._replace(settings={"gait_frequency": 1.5})
TASK_VIEWS = {
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
    "mimic": View("tick", "mimic", azimuth=-20.0, elevation=18.0, distance=6.0),
    "recover": View("tick", "recover", 3, 0, 12, elevation=18.0, distance=5.0, drives=False, policy="ppo"),
}
ONE_VIEWS = {name: view for name, view in {**ROBOT_VIEWS, **TASK_VIEWS}.items() if name != "recover"}
FALL_VIEWS = {f"fall {seed}": TASK_VIEWS["recover"]._replace(seed=seed) for seed in range(12)}
_CLIP_FPS = 30.0
_CUT_ABOVE = 0.82  # share of the rows cut from a square picture that are cut above, where it is empty
_CAPTION_HEIGHT = 22  # pixels: legible where a page shows a picture at half its width
_FILM_STEPS = 67  # control steps of a view; the camera is fitted to the torso's path in them


def play(view: View, environment, steps: int) -> Iterator[int]:
    """Play a view, and yield the number of each of its control steps."""
    definition = environment.task.definition
    preset = suited_preset(definition) if view.policy == "cpg" else None
    policy = policies.policy(view.policy, view.robot, preset, task=definition)
    for step, timestep in enumerate(evaluation.rollout(environment, policy, view.seed, view.start + steps)):
        if timestep.first() and view.command is not None:
            environment.command("command", view.command)
        if step > view.start:
            yield step - view.start - 1


def open_environment(view: View):
    """Return the environment of a view."""
    return arc_suite.load(view.robot, view.task, dict(view.settings))


class Camera:
    """A camera that stands, or goes along a straight line, and looks at the torso."""

    def __init__(self, view: View, environment):
        """Fit the line to the torso's path."""
        poses = np.array([environment.physics.data.qpos[:7].copy() for _ in play(view, environment, _FILM_STEPS)])
        positions = poses[:, :3]
        quaternion_in_the_middle = poses[len(poses) // 2, 3:7]
        degree = 1 if view.drives else 0
        self._line = np.polynomial.polynomial.polyfit(np.arange(len(poses)), positions, degree)
        azimuth = rotations.yaw(quaternion_in_the_middle) + math.radians(view.azimuth)
        elevation = math.radians(view.elevation)
        reach = abs(outline(environment.task.body)[..., :2]).max()  # m, of the farthest foot
        horizontal = np.array((math.cos(azimuth), math.sin(azimuth), 0.0))
        vertical = np.array((0.0, 0.0, 1.0))
        direction = math.cos(elevation) * horizontal + math.sin(elevation) * vertical
        self._offset = view.distance * reach * direction  # m, of the camera from what it looks at
        self._up = math.cos(elevation) * vertical - math.sin(elevation) * horizontal
        height = environment.task.body.torso.standing_height
        self._below_torso = np.array((0.0, 0.0, 0.35 * height))  # the camera looks lower than at the torso

    def aim(self, scene, step: int) -> None:
        """Aim the cameras of a scene at a step of the view."""
        target = np.polynomial.polynomial.polyval(step, self._line) - self._below_torso
        for camera in scene.camera:
            camera.pos = target + self._offset
            camera.up = self._up
            camera.forward = -self._offset / np.linalg.norm(self._offset)


def pictures(view: View, size: tuple[int, int], steps: int) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of a view: of so many steps, or, where that is 0, of its moment alone."""
    width, height = size
    environment = open_environment(view)
    camera = Camera(view, environment)
    is_film = steps > 0
    quality = "film" if is_film else "still"
    for step in play(view, environment, steps if is_film else view.moment + 1):
        if is_film or step == view.moment:
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
    (clip,) = clips.clips(setup, ["walk"], fps=_CLIP_FPS)
    top = round(_CUT_ABOVE * (width - height))
    for square in filming.film_pictures(setup.body, clip, width, heading=math.radians(-90.0 - view.azimuth)):
        yield square[top : top + height]


class Media(NamedTuple):
    """A picture or film, of one view or of several in a grid.

    Attributes:
        path: path of the file, from the repository's root.
        views: by caption.
        columns: columns of the grid.
        size: width and height of a view, pixels.
        steps: control steps of a film, a frame each; 0 for a still.
        captions: whether it shows them.
        large: whether the first view takes four cells.
        limit: bytes.
        source: source of a view's pictures.
        quality: quality of WebP, 0 to 100.
        fps: frames a second.
    """

    path: str
    views: Mapping[str, View]
    columns: int = 1
    size: tuple[int, int] = (448, 252)
    steps: int = _FILM_STEPS  # five cycles of a gait of 1.5 Hz, four of 1.2 Hz: the film loops without a jump
    captions: bool = False
    large: bool = False
    limit: int = 400_000
    source: Callable = pictures
    quality: int = 50
    fps: float = 20.0


MEDIA = (
    Media(
        "docs/films/robots.webp",
        IN_PLACE_VIEWS,
        columns=2,
        size=(600, 400),
        steps=20,
        limit=950_000,
        source=in_place,
        quality=75,
        fps=_CLIP_FPS,
    ),
    Media("docs/robots.png", ROBOT_VIEWS, columns=2, size=(640, 400), steps=0, captions=True, limit=300_000),
    Media(
        "docs/tasks.png",
        TASK_VIEWS,
        columns=6,
        size=(280, 168),
        steps=0,
        captions=True,
        large=True,
        limit=300_000,
    ),
    Media("docs/films/recover.webp", FALL_VIEWS, columns=4, size=(120, 84), limit=240_000, quality=12),
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


def draw(media: Media) -> None:
    """Draw a picture or film, and write it."""
    pictures_of_views = []
    for number, (name, view) in enumerate(media.views.items()):
        width, height = media.size
        is_large = media.large and number == 0
        size = (2 * width, 2 * height) if is_large else (width, height)
        view_pictures = list(media.source(view, size, media.steps))
        if media.captions:
            view_pictures = [films.add_caption(picture, name, _CAPTION_HEIGHT) for picture in view_pictures]
        pictures_of_views.append(view_pictures)
    frames = [arrange(list(views), media) for views in zip(*pictures_of_views, strict=True)]
    path = ROOT / media.path
    path.parent.mkdir(exist_ok=True)
    with files.writing(path) as temporary:
        if path.suffix == ".webp":
            films.write_webp(temporary, frames, 1.0 / media.fps, media.quality)
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
