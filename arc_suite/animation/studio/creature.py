"""A creature that can walk: the body, the environment and the policy of a sketch, and the flaws of its body."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import policies
from arc_suite.animation.pacing import paced_demonstrator
from arc_suite.animation.parts import Material, Part, describe_body
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.bodies.shaping import parts_with_lengths
from arc_suite.envs import dm
from arc_suite.envs.setup import Setup
from arc_suite.models.outline import outline
from arc_suite.models.soundness import Flaw, flaws
from arc_suite.policies import Policy, alone


class Creature(NamedTuple):
    """A creature that can walk.

    Attributes:
        sketch: sketch of which it is made.
        setup: body, task and settings.
        environment: environment in which it walks. Episodes have no time limit; physics that diverges ends an episode.
        act: maps a `TimeStep` to an action.
        flaws: flaws of the body.
        parts_with_lengths: names of the parts that are links whose lengths can change.
        tile: side of the square tiles of its ground, m: the standing height of the body at scale 1. So tiles show how
            much a sketch scales the body.
        reach: greatest distance of a point of the body from the torso's origin along an axis, m.
        parts: visible parts of the body; a part follows its parent.
        materials: materials of the parts, by name.
    """

    sketch: Sketch
    setup: Setup
    environment: dm.Environment
    act: Callable[..., np.ndarray]
    flaws: tuple[Flaw, ...]
    parts_with_lengths: tuple[str, ...]
    tile: float
    reach: float
    parts: tuple[Part, ...]
    materials: Mapping[str, Material]


def open_creature(sketch: Sketch) -> Creature:
    """Open a sketch.

    Raises:
        ValueError: a name or a value of the sketch does not fit.
        OSError: a file cannot be read.
    """
    setup = sketches.make_setup(sketch)
    parts, materials = describe_body(setup.body)
    environment = load_environment(setup, time_limit=math.inf, on_divergence="truncate")
    act = alone(load_policy(sketch, environment))  # a function of a `TimeStep`
    act(load_environment(setup).reset())  # raises an error now if the policy does not take the observation
    return Creature(
        sketch=sketch,
        setup=setup,
        environment=environment,
        act=act,
        flaws=tuple(flaws(setup.body)),
        parts_with_lengths=parts_with_lengths(setup.body),
        tile=setup.body.torso.standing_height / sketch.scale,
        reach=float(abs(outline(setup.body)).max()),
        parts=tuple(parts),
        materials=materials,
    )


def load_environment(setup: Setup, **options) -> dm.Environment:
    """Open an environment of a setup, with the same first episode every time.

    Args:
        setup: setup to open.
        options: settings of the task that the setup may replace.
    """
    settings = options | setup.task_kwargs | {"random": 0}
    return dm.load(setup.body, setup.task, settings)


def load_policy(sketch: Sketch, environment: dm.Environment) -> Policy:
    """Return the policy of a sketch for one environment.

    Raises:
        ValueError: the policy does not fit the body or the task.
        OSError: a file cannot be read.
    """
    task = environment.task.definition
    if sketch.policy == "cpg":
        return paced_demonstrator(task, sketches.chosen_preset(sketch), sketch.speed)
    return policies.policy(sketch.policy, task.scene.body, sketches.chosen_preset(sketch), task=task)
