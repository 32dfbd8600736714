"""Walks inline in a notebook."""

import base64
import contextlib
import dataclasses
import io
import itertools
import os
from xml.etree import ElementTree

from arc_suite import checks, policies, style
from arc_suite.animation import pages
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.envs.task_view import AnyEnvironment
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy, PolicyFunction
from arc_suite.simulation import films

_PAGE_STEPS = 400  # control steps
_FILM_STEPS = 80  # control steps
_PAGE_HEIGHT = 560  # pixels
_FILM_SIZE = (240, 180)  # width and height, pixels
_FILM_QUALITY = 35  # of WebP, up to 100


@dataclasses.dataclass(frozen=True)
class Inline:
    """A walk that a notebook shows where it is the value of a cell.

    Attributes:
        html: an element with nothing to fetch: a page in a frame, or a film.
    """

    html: str = dataclasses.field(repr=False)  # or a notebook holds it twice

    def _repr_html_(self) -> str:
        return self.html


def show(
    environment: AnyEnvironment,
    policy: str | os.PathLike[str] | Policy | PolicyFunction = "cpg",
    *,
    seed: int = 0,
    steps: int | None = None,
    film: bool = False,
) -> Inline:
    """Return a walk that a notebook shows inline.

    The episode is played in another environment of the same body, task and settings.

    Args:
        environment: environment of `arc_suite.load`, `gymnasium.make` or `gymnasium.make_vec`.
        policy: a name as of `policies.policy`, with the preset that suits task and body; a policy for one
            environment; or a function of a `TimeStep` with named blocks.
        seed: seed of the episode.
        steps: control steps, at most; None for 400, in a film 80.
        film: show a film in place of the page with its controls. It needs OpenGL, a page needs none.

    Raises:
        ValueError: another environment or policy, a value out of range, or there is no viewer of pages.
        RenderingUnavailable: a film, and no OpenGL here.
    """
    setup = _setup_of(environment)
    played_environment = setup.load(checks.seed(seed))
    actor = policies.acting(policy, played_environment.task.definition)
    if steps is None:
        steps = _FILM_STEPS if film else _PAGE_STEPS
    steps = checks.integer("steps", steps, 1)
    if film:
        return Inline(_film(played_environment, actor, seed, steps))
    pages.viewer_script()  # raises an error at once if there is none
    track = style.record(played_environment, actor, seed, steps)
    policy_name = policy if isinstance(policy, str) else "policy"
    page = pages.page({f"{setup.body.name}, {policy_name}": track})
    return Inline(_element("iframe", srcdoc=page, width="100%", height=str(_PAGE_HEIGHT), style="border: 0"))


def _setup_of(environment) -> Setup:
    """Return the setup of an environment, without its wrappers."""
    bare_environment = getattr(environment, "unwrapped", environment)
    bare_environment = getattr(bare_environment, "_env", bare_environment)  # of Gymnasium's adapter
    if isinstance(bare_environment, VectorEnv):
        return Setup.of(*bare_environment.arguments)
    if isinstance(bare_environment, Environment):
        task_name = bare_environment.task.definition.name
        return Setup.of(bare_environment.task.body, task_name, bare_environment.task_kwargs)
    kinds = "arc_suite.load, gymnasium.make or gymnasium.make_vec"
    raise ValueError(f"environment: expected one of {kinds}, got {type(environment).__name__}")


def _film(environment: Environment, policy: Policy, seed: int, steps: int) -> str:
    """Return an element with a film of an episode."""
    body = environment.task.body.name
    act = policies.alone(policy, seed)
    footage = films.Footage(body, environment, act, "profile", _FILM_SIZE)
    file = io.BytesIO()
    with contextlib.closing(footage):
        frame_seconds = films.frame_seconds(footage.control_timestep)
        film_seconds = steps * footage.control_timestep
        first_picture = footage.view()
        later_pictures = itertools.chain(*films.frames([footage], film_seconds, frame_seconds))
        films.write_webp(file, [first_picture, *later_pictures], frame_seconds, quality=_FILM_QUALITY)
    source = f"data:image/webp;base64,{base64.b64encode(file.getvalue()).decode()}"
    width, height = _FILM_SIZE
    return _element("img", src=source, width=str(width), height=str(height), alt=body)


def _element(tag: str, **attributes: str) -> str:
    return ElementTree.tostring(ElementTree.Element(tag, attributes), encoding="unicode", method="html")
