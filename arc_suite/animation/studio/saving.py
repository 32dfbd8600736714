"""Files of a creature, as bytes: what the buttons of the page save."""

import contextlib
import itertools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import imageio.v3 as imageio
import numpy as np

from arc_suite import models, style, versions
from arc_suite.animation import clips as export
from arc_suite.animation import pages, play_pages
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature, load_environment, load_policy
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.envs.dm import Environment
from arc_suite.policies import Individuals, alone
from arc_suite.robots.spec_files import body_to_json
from arc_suite.simulation import films
from arc_suite.simulation.pictures import picture

_PAGE_STEPS, _FILM_STEPS = 400, 100
_SIZE = (640, 480)  # of pictures and films, pixels

Commands = Mapping[str, Any]  # values by name, None for what the task itself would do


class File(NamedTuple):
    """A file of a creature.

    Attributes:
        label: of its button.
        extension: of its name.
        content: makes it of a creature, the positions (nq,) in which it stands, and commands of its task.
    """

    label: str
    extension: str
    content: Callable[[Creature, np.ndarray, Commands], bytes]


def download_name(creature: Creature, file: File) -> str:
    """Return the name under which a file is saved."""
    return f"{creature.setup.body.name}{file.extension}"


def make_spec(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return the spec as JSON."""
    return body_to_json(creature.setup.body).encode()


def make_mjcf(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return the model, on the ground of the task, as MuJoCo loads it."""
    arena = creature.environment.task.definition.scene.arena
    return models.text(creature.setup.body, arena).encode()


def make_clips(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return animation clips as binary glTF; see `export.clips`.

    Raises:
        ValueError: a clip cannot be made.
    """
    sketch = creature.sketch
    clips = export.clips(creature.setup, export.DEFAULT, sketch.policy, sketches.chosen_preset(sketch))
    return export.glb(
        creature.setup.body, clips, generator=f"arc_suite {versions.version_of('arc_suite') or ''}".strip()
    )


def make_page(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a page that plays an episode.

    Raises:
        ValueError: the viewer of pages has not been built.
    """
    pages.viewer_script()  # finds out at once whether there is one
    environment = load_environment(creature.setup)
    with contextlib.closing(environment):
        act = _commanded(environment, creature.sketch, commands)
        acting = Individuals(lambda: act, 1, len(creature.setup.body.joint_names))
        track = style.record(environment, acting, 0, _PAGE_STEPS)
    return pages.page({creature.setup.body.name: track}).encode()


def make_playable_page(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a page in which keys walk the creature about; see `play_pages`.

    Raises:
        ValueError: the scripts of pages have not been built, or the policy does not run in a page.
    """
    sketch = creature.sketch
    return play_pages.page(
        [play_pages.creature(creature.setup.body, sketch.policy, sketches.chosen_preset(sketch))]
    ).encode()


def make_picture(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a picture of the creature where it stands, as PNG.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    arena, data = creature.environment.task.definition.scene.arena, creature.environment.physics.data
    width, height = _SIZE
    view = picture(creature.setup.body, arena, qpos, height, width, "portrait", mocap_pos=data.mocap_pos.copy())
    return imageio.imwrite("<bytes>", view, extension=".png")


def make_film(creature: Creature, qpos: np.ndarray, commands: Commands) -> bytes:
    """Return a film of an episode, as MP4.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    environment = load_environment(creature.setup)
    act = _commanded(environment, creature.sketch, commands)
    footage = films.Footage(creature.setup.body.name, environment, act, "profile", _SIZE)
    frame = films.frame_seconds(footage.control_timestep)
    with contextlib.closing(footage), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        views = films.frames([footage], _FILM_STEPS * footage.control_timestep, frame)
        films.write_mp4(path, itertools.chain.from_iterable(views), frame)
        return path.read_bytes()


def _commanded(environment: Environment, sketch: Sketch, commands: Commands):
    """Return the policy of a sketch as a function of a `TimeStep`, which sets commands at the start of episodes."""
    act = alone(load_policy(sketch, environment))

    def acting(timestep):
        if timestep.first():
            for name, value in commands.items():
                environment.command(name, value)
        return act(timestep)

    return acting


FILES = (
    File("Spec", ".json", make_spec),
    File("MJCF", ".xml", make_mjcf),
    File("Clips", ".glb", make_clips),
    File("Page", ".html", make_page),
    File("Page to play in", "_play.html", make_playable_page),
    File("Picture", ".png", make_picture),
    File("Film", ".mp4", make_film),
)
