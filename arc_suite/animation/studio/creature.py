"""A sketch, opened: its environment, policy and what `check` says of its body."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import policies
from arc_suite.animation.parts import Material, Part
from arc_suite.animation.parts import describe_body as described
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.bodies.shaping import link_names
from arc_suite.envs import dm
from arc_suite.envs.setup import Setup
from arc_suite.models.outline import outline
from arc_suite.models.soundness import Flaw, flaws
from arc_suite.policies import Policy, alone


class Creature(NamedTuple):
    """A creature that can walk.

    Attributes:
        sketch: what made it.
        setup: body, task and settings.
        environment: of its own; episodes have no time limit, and physics that diverges ends one.
        act: maps a `TimeStep` to an action.
        flaws: of the body.
        links: names of the links of its legs.
        tile: side of the tiles of its ground, m, whose number tells its size: what its standing height is at size 1.
        reach: how far it extends from the torso's origin along any axis, m.
        parts: that are seen.
        materials: of the parts, by name.
    """

    sketch: Sketch
    setup: Setup
    environment: dm.Environment
    act: Callable[..., np.ndarray]
    flaws: tuple[Flaw, ...]
    links: tuple[str, ...]
    tile: float
    reach: float
    parts: tuple[Part, ...]
    materials: Mapping[str, Material]


def open_creature(sketch: Sketch) -> Creature:
    """Open a sketch.

    Raises:
        ValueError: a name or a value that does not fit.
        OSError: a file cannot be read.
    """
    setup = sketches.make_setup(sketch)
    parts, materials = described(setup.body)
    environment = load_environment(setup, time_limit=math.inf, on_divergence="terminate")
    act = alone(load_policy(sketch, environment))
    act(load_environment(setup).reset())  # finds out at once whether the policy knows the observation
    return Creature(
        sketch=sketch,
        setup=setup,
        environment=environment,
        act=act,
        flaws=tuple(flaws(setup.body)),
        links=link_names(setup.body),
        tile=setup.body.torso.standing_height / sketch.scale,
        reach=float(abs(outline(setup.body)).max()),
        parts=tuple(parts),
        materials=materials,
    )


def load_environment(setup: Setup, **options) -> dm.Environment:
    """Open an environment of a setup, with the same first episode every time.

    Args:
        setup: what to open.
        options: settings of the task, unless the setup has them.
    """
    return dm.load(setup.body, setup.task, options | setup.task_kwargs | {"random": 0})


def load_policy(sketch: Sketch, environment: dm.Environment) -> Policy:
    """Return the policy of a sketch for one environment.

    Raises:
        ValueError: it does not fit the body or the task.
        OSError: a file cannot be read.
    """
    task = environment.task.definition
    return policies.policy(sketch.policy, task.scene.body, sketches.chosen_preset(sketch), task=task)
