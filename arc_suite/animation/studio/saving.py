"""Files of a creature that the buttons of the page save, as bytes."""

import contextlib
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import imageio.v3 as imageio
import numpy as np

from arc_suite import models, style, versions
from arc_suite.animation import clips, pages, play_pages
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature, load_environment, load_policy
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.envs.dm import Environment
from arc_suite.policies import Individuals, alone
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation import films
from arc_suite.simulation.pictures import picture

_PAGE_STEPS = 400  # control steps of the episode on a page
_FILM_STEPS = 100  # control steps of the episode in a film
_WIDTH = 640  # pixels of pictures and films
_HEIGHT = 480  # pixels of pictures and films

Commands = Mapping[str, Any]  # of a task, by name; None leaves a command to the task


class File(NamedTuple):
    """A kind of file of a creature.

    Attributes:
        label: label of its button.
        suffix: suffix of its name, after the name of the body.
        make: returns the content for a creature, the positions (nq,) of its pose, and the commands of its task.
        takes_weight: whether `make` takes `weight`, too; see `clips.clips`.
    """

    label: str
    suffix: str
    make: Callable[..., bytes]
    takes_weight: bool = False


def download_name(creature: Creature, file: File) -> str:
    """Return the name under which a file is saved."""
    return f"{creature.setup.body.name}{file.suffix}"


def make_spec(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return the spec as JSON."""
    return body_to_json(creature.setup.body).encode()


def make_mjcf(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return the model, on the ground of the task, as MuJoCo loads it."""
    arena = creature.environment.task.definition.scene.arena
    return models.text(creature.setup.body, arena).encode()


def make_clips(creature: Creature, qpos: np.ndarray, commands: Commands, weight: float | str = 1.0) -> bytes:
    """Return animation clips as binary glTF, with a weight; see `animation.clips`.

    Raises:
        ValueError: a clip cannot be made.
    """
    sketch = creature.sketch
    preset = sketches.chosen_preset(sketch)
    default_clips = clips.clips(creature.setup, clips.DEFAULT, sketch.policy, preset, weight=weight)
    version = versions.version_of("arc_suite") or ""
    return clips.glb(creature.setup.body, default_clips, generator=f"arc_suite {version}".strip())


def make_page(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a page that plays an episode.

    Raises:
        ValueError: the viewer of pages has not been built.
    """
    pages.viewer_script()  # raises an error now if there is no viewer
    body = creature.setup.body
    environment = load_environment(creature.setup)
    with contextlib.closing(environment):
        act = _policy_under_commands(environment, creature.sketch, commands)
        # Tracks are recorded of policies for vectors of environments; this vector has one.
        policy = Individuals(lambda: act, num_envs=1, joints=len(body.joint_names))
        track = style.record(environment, policy, seed=0, max_steps=_PAGE_STEPS)
    return pages.page({body.name: track}).encode()


def make_playable_page(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a page on which keys steer the creature, on its ground at first; see `play_pages`.

    Raises:
        ValueError: the scripts of pages have not been built, or the policy does not run in a page.
    """
    sketch = creature.sketch
    preset = sketches.chosen_preset(sketch)
    arena = creature.setup.task_kwargs.get("arena")
    playable_creature = play_pages.creature(creature.setup.body, sketch.policy, preset, arena)
    return play_pages.page([playable_creature]).encode()


def make_picture(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a picture of the creature in its pose, as PNG.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    arena = creature.environment.task.definition.scene.arena
    obstacle_positions = creature.environment.physics.data.mocap_pos.copy()
    view = picture(
        creature.setup.body,
        arena,
        qpos,
        height=_HEIGHT,
        width=_WIDTH,
        camera_id="portrait",
        mocap_pos=obstacle_positions,
    )
    return imageio.imwrite("<bytes>", view, extension=".png")


def make_film(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a film of an episode, as MP4.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    environment = load_environment(creature.setup)
    act = _policy_under_commands(environment, creature.sketch, commands)
    footage = films.Footage(creature.setup.body.name, environment, act, "profile", (_WIDTH, _HEIGHT))
    film_seconds = _FILM_STEPS * footage.control_timestep
    frame_seconds = films.frame_seconds(footage.control_timestep)
    with contextlib.closing(footage), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        frames = (views[0] for views in films.frames([footage], film_seconds, frame_seconds))
        films.write_mp4(path, frames, frame_seconds)
        return path.read_bytes()


def _policy_under_commands(environment: Environment, sketch: Sketch, commands: Commands) -> Callable:
    """Return the policy of a sketch as a function of a `TimeStep` that sets commands at the start of episodes."""
    act = alone(load_policy(sketch, environment))

    def set_commands_and_act(timestep):
        if timestep.first():
            for name, value in commands.items():
                environment.command(name, value)
        return act(timestep)

    return set_commands_and_act


FILES = (
    File("Spec", ".json", make_spec),
    File("MJCF", ".xml", make_mjcf),
    File("Clips", ".glb", make_clips, takes_weight=True),
    File("Page", ".html", make_page),
    File("Page to play in", "_play.html", make_playable_page),
    File("Picture", ".png", make_picture),
    File("Film", ".mp4", make_film),
)
