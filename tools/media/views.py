"""Views: which steps of which episode a picture or film shows, and from where."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

import arc_suite
from arc_suite import evaluation, policies
from arc_suite.cpg import suited_preset
from arc_suite.markers import Marker
from arc_suite.robots.spec import Body
from arc_suite.simulation import films

FPS = 24.0  # a cycle of 1.5 Hz has 16 frames, one of 1.2 Hz has 20: films end where the gait begins anew


class Look(NamedTuple):
    """Ground and light of a view.

    Attributes:
        ground: (3,) mean color of the ground, 0 to 1.
        sky: (3,) mean color of the sky, 0 to 1.
        sun: (3,) direction in which the sun shines, of any length.
        sunlight: (3,) color of the sun, 0 to 1.
        shade: (3,) color of the light that comes from everywhere, 0 to 1.
        shadows: size of the shadow map, pixels.
    """

    ground: tuple[float, float, float] = (0.62, 0.57, 0.50)
    sky: tuple[float, float, float] = (0.41, 0.48, 0.57)
    sun: tuple[float, float, float] = (-0.36, 0.0, -1.0)
    sunlight: tuple[float, float, float] = (0.62, 0.61, 0.58)
    shade: tuple[float, float, float] = (0.28, 0.29, 0.32)
    shadows: int = 4096


class View(NamedTuple):
    """Some steps of an episode, and a camera on it.

    Attributes:
        robot: its name, or a body.
        task: its name.
        seed: seed of the episode.
        start: control steps before the first picture.
        moment: control steps from there to the still picture.
        command: set live throughout; None for that of the task.
        azimuth: azimuth of the camera from where the torso heads in the middle of the view, degrees, positive to the
            left.
        elevation: elevation of the camera, degrees.
        distance: distance of the camera, in distances of the farthest foot from the torso.
        aim: height at which the camera looks, in standing heights from the torso.
        drives: whether the camera goes along in a straight line; else it stands.
        settings: settings of the task.
        policy: name of the policy.
        seconds: duration of the film: whole cycles of the gait.
        fade: number of last pictures that fade into those before the first one, so that the film closes; 0 where it
            closes without.
        look: ground and light.
        shows_markers: whether arrows of commands and kicks are drawn.
    """

    robot: str | Body
    task: str = "walk"
    seed: int = 0
    start: int = 60
    moment: int = 35
    command: tuple[float, ...] | None = None
    azimuth: float = -50.0
    elevation: float = 13.0
    distance: float = 4.4
    aim: float = -0.35
    drives: bool = True
    settings: Mapping[str, float] = {}
    policy: str = "cpg"
    seconds: float = 3.0 / 1.5
    fade: int = 8
    look: Look = Look()
    shows_markers: bool = True

    @property
    def frames(self) -> int:
        """Number of frames of the film."""
        return round(self.seconds * FPS)


class Instant(NamedTuple):
    """What is drawn of an instant of an episode.

    Attributes:
        qpos: (nq,) positions.
        mocap_pos: (nmocap, 3) positions of movable bodies, m.
        markers: debug markers.
        failed_legs: names of legs to show dark.
    """

    qpos: np.ndarray
    mocap_pos: np.ndarray
    markers: Sequence[Marker]
    failed_legs: Sequence[str]


def open_environment(view: View):
    """Return the environment of a view."""
    return arc_suite.load(view.robot, view.task, dict(view.settings))


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


def film_instants(view: View, environment) -> list[Instant]:
    """Return what is drawn of a film's frames, and of those before that it fades into.

    Frames lie between control steps, by Hermite's cubic. Markers and dark legs are those of the step before.
    """
    steps_in_frame = 1.0 / (FPS * environment.control_timestep())
    num_frames = view.fade + view.frames
    count = math.ceil(num_frames * steps_in_frame) + 1
    data = environment.physics.data
    instants = []
    states = []
    for _ in play(view, environment, count):
        instants.append(_read_instant(view, environment))
        states.append((data.qpos.copy(), data.qvel.copy()))
    model = environment.physics.model.ptr
    film = []
    for frame in range(num_frames):
        step, share = divmod(frame * steps_in_frame, 1.0)
        before = states[int(step)]
        after = states[int(step) + 1]
        qpos = films.interpolate(model, before, after, share, environment.control_timestep())
        film.append(instants[int(step)]._replace(qpos=qpos))
    return film


def still_instant(view: View, environment) -> Instant:
    """Return what is drawn of the moment of a view."""
    for _ in play(view, environment, view.moment + 1):
        pass
    return _read_instant(view, environment)


def _read_instant(view: View, environment) -> Instant:
    data = environment.physics.data
    task = environment.task
    markers = tuple(task.markers(environment.physics)) if view.shows_markers else ()
    return Instant(data.qpos.copy(), data.mocap_pos.copy(), markers, tuple(task.failed_legs()))


_CLOSE = {"distance": 3.7, "azimuth": -42.0, "fade": 0}
_SIDE = {"azimuth": -90.0, "elevation": 14.0, "distance": 4.5}
ROBOT_VIEWS = {robot: View(robot, **_CLOSE) for robot in ("queen", "bastion", "tick", "leaper")}
ROBOT_VIEWS["leaper"] = ROBOT_VIEWS["leaper"]._replace(seconds=3.0 / 1.2, aim=-0.2, distance=4.5)
TASK_VIEWS = {
    "walk": View("queen", azimuth=-60.0, distance=4.0, aim=-0.25, fade=0),
    "steer": View("bastion", "steer", 39, 105, 60, azimuth=-25.0, elevation=32.0, distance=4.6, seconds=5.0 / 1.5),
    "directed": View("queen", "directed", 4, 65, 50, (0.7, 0.0, 0.4), azimuth=-60.0, elevation=14.0, seconds=4.0 / 1.5),
    "shoved": View("bastion", "shoved", 1, 45, 30, (1.0, 0.0, 0.0), azimuth=35.0, elevation=18.0, seconds=4.0 / 1.5),
    "limp": View("tick", "limp", 1, 60, 20, (1.0, 0.0, 0.0), azimuth=60.0),
    "rough": View("tick", "rough", **_SIDE),
    "slopes": View(
        "queen",
        "slopes",
        start=110,
        azimuth=-105.0,
        elevation=14.0,
        settings={"difficulty": 1.0},
    ),
    "stairs": View("bastion", "stairs", **{**_SIDE, "azimuth": -112.0}),
    "gaps": View("tick", "gaps", **{**_SIDE, "elevation": 25.0}),
    "course": View("queen", "course", start=110, **_SIDE),
    "leap": View(
        "queen", "leap", start=288, moment=32, seconds=4.0 / 1.5, **{**_SIDE, "elevation": 20.0, "distance": 5.3}
    ),
    "roam": View("queen", "roam", 0, 40, 31, elevation=20.0, distance=4.6),
    "navigate": View("bastion", "navigate", 0, 40, 62, azimuth=155.0, elevation=38.0, distance=6.6, seconds=5.0 / 1.5),
    "mimic": View("tick", "mimic", azimuth=-20.0, elevation=18.0, distance=5.8, fade=0),
    "recover": View(
        "tick",
        "recover",
        3,
        0,
        12,
        elevation=18.0,
        distance=6.6,
        drives=False,
        policy="ppo",
        seconds=5.0 / 1.5,
    ),
}
ONE_VIEWS = {name: view for name, view in {**ROBOT_VIEWS, **TASK_VIEWS}.items() if name != "recover"}
FALL_VIEWS = {f"fall {seed}": TASK_VIEWS["recover"]._replace(seed=seed) for seed in range(12)}
FALL_VIEWS["fall 8"] = FALL_VIEWS["fall 8"]._replace(distance=7.8, aim=-0.8)  # it gets up away from where it lay
FALL_VIEWS["fall 10"] = FALL_VIEWS["fall 10"]._replace(distance=6.0, aim=0.0)  # it lies on its back, feet up
