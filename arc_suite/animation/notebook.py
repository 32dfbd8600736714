"""Walks inline in a notebook."""

import base64
import contextlib
import dataclasses
import io
import itertools
from collections.abc import Callable
from xml.etree import ElementTree

from arc_suite import checks, policies, style
from arc_suite.animation import pages
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy
from arc_suite.simulation import films

_PAGE_STEPS, _FILM_STEPS = 400, 80
_HEIGHT = 560  # of a page, pixels
_SIZE = (240, 180)  # of a film, pixels


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
    environment, policy: str | Policy | Callable = "cpg", *, seed: int = 0, steps: int | None = None, film: bool = False
) -> Inline:
    """Return a walk that a notebook shows inline.

    The episode is played in another environment of the same body, task and settings.

    Args:
        environment: of `arc_suite.load`, `gymnasium.make` or `gymnasium.make_vec`.
        policy: a name as of `policies.policy`, with the preset that suits task and body; a policy for one
            environment; or a function of a `TimeStep` with named blocks.
        seed: of the episode.
        steps: control steps, at most; None for 400, in a film 80.
        film: show a film in place of the page with its controls. It needs OpenGL, a page needs none.

    Raises:
        ValueError: another environment or policy, a value out of range, or there is no viewer of pages.
        RenderingUnavailable: a film, and no OpenGL here.
    """
    setup = _setup(environment)
    played = setup.load()
    actor = policies.acting(policy, played.task.definition)
    name = policy if isinstance(policy, str) else "policy"
    usual = _FILM_STEPS if film else _PAGE_STEPS
    steps = checks.integer("steps", usual if steps is None else steps, 1)
    if film:
        return Inline(_film(played, actor, seed, steps))
    pages.viewer_script()  # finds out at once whether there is one
    track = style.record(played, actor, seed, steps)
    page = pages.page({f"{setup.body.name}, {name}": track})
    return Inline(_element("iframe", srcdoc=page, width="100%", height=str(_HEIGHT), style="border: 0"))


def _setup(environment) -> Setup:
    made = getattr(environment, "unwrapped", environment)
    made = getattr(made, "_env", made)  # of Gymnasium's adapter
    if isinstance(made, VectorEnv):
        return Setup.of(*made.arguments)
    if isinstance(made, Environment):
        return Setup.of(made.task.body, made.task.definition.name, made.task_kwargs)
    kinds = "arc_suite.load, gymnasium.make or gymnasium.make_vec"
    raise ValueError(f"environment: expected one of {kinds}, got {type(environment).__name__}")


def _film(environment: Environment, policy: Policy, seed: int, steps: int) -> str:
    body = environment.task.body.name
    footage, file = films.Footage(body, environment, policies.alone(policy, seed), "profile", _SIZE), io.BytesIO()
    with contextlib.closing(footage):
        frame = films.frame_seconds(footage.control_timestep)
        views = films.frames([footage], steps * footage.control_timestep, frame)
        films.write_webp(file, [footage.view(), *itertools.chain(*views)], frame, quality=35)
    source = f"data:image/webp;base64,{base64.b64encode(file.getvalue()).decode()}"
    return _element("img", src=source, width=str(_SIZE[0]), height=str(_SIZE[1]), alt=body)


def _element(tag: str, **attributes: str) -> str:
    return ElementTree.tostring(ElementTree.Element(tag, attributes), encoding="unicode", method="html")
