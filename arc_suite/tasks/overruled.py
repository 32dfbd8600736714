"""What changed fields of a model tell of a body, in place of what an episode has drawn.

A privileged observation shows the body as it is, also where a user has changed it.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from arc_suite.models.standing import standing
from arc_suite.tasks.contract import Scene

_MEANS = {"friction": "pair_friction", "armature": "dof_armature"}
_MASSES = ("body_mass", "body_ipos")
# Of motors and of servos.
_STRENGTHS = (("actuator_gear", "actuator_gainprm"), ("jnt_actfrcrange",))
_GAINS = ((), ("actuator_gainprm", "actuator_biasprm"))  # stiffness, damping

FIELDS = tuple(dict.fromkeys([*_MEANS.values(), *_MASSES, *_STRENGTHS[0], *_STRENGTHS[1], *_GAINS[1]]))  # that count
_FREE = 5  # degrees of freedom of the torso's joint beyond one: joint i has degree i + 5


def told(scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return those blocks of a privileged observation, each (size,), that changed fields of the model decide.

    `friction`, `armature` and `gains` are means. `mass` is that of the legs; what the torso weighs besides is the
    `payload`, in the torso's center of mass.

    Args:
        scene: of the task.
        blocks: what was drawn, by name; see `privileged.blocks_of_modifiers`.
        fields: fields of the model by name; they hold in place of what was drawn.
    """
    servos, multiples = bool(scene.body.source), _multiples(scene, fields, blocks["strength"].shape[-1])
    found = {block: multiples[name].mean(keepdims=True) for block, name in _MEANS.items() if name in multiples}
    if any(name in fields for name in _MASSES):
        found |= _masses(scene, blocks, fields)
    if any(name in multiples for name in _STRENGTHS[servos]):
        given = [multiples[name] for name in _STRENGTHS[servos] if name in multiples]
        found["strength"] = math.prod(given, start=blocks["strength"])
    if any(name in multiples for name in _GAINS[servos]):
        gains = [multiples[name].mean() if name in multiples else None for name in _GAINS[servos]]
        drawn = [each if mean is None else mean for each, mean in zip(blocks["gains"], gains, strict=True)]
        found["gains"] = blocks["gains"].__array_namespace__().stack(drawn)
    return found


def _multiples(scene: Scene, fields: Mapping[str, Any], joints: int) -> dict[str, Any]:
    """Multiples (n,) of what counts in changed fields as compiled, by name; 1 where that is 0."""
    velocities = scene.layout.joint_velocities
    parts = {
        "pair_friction": np.s_[:, 0],
        "dof_armature": velocities,
        "actuator_gear": np.s_[:joints, 0],
        "actuator_gainprm": np.s_[:joints, 0],
        "actuator_biasprm": np.s_[:joints, 2],
        "jnt_actfrcrange": (np.arange(scene.model["dof_armature"].size)[velocities] - _FREE, 1),
    }
    found = {}
    for name, part in parts.items():
        if name in fields:
            compiled = scene.model[name][part]
            without = compiled == 0.0
            found[name] = (fields[name][part] * ~without + without) / (compiled + without)
    return found


def _masses(scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
    """The multiple of the legs' mass, the payload, and the displacement of the torso's center of mass."""
    torso, legs = scene.layout.torso, np.arange(len(scene.model["body_mass"]))[scene.layout.parts][1:]
    numpy, height = blocks["mass"].__array_namespace__(), scene.body.torso.standing_height
    own, place, whole = scene.model["body_mass"][torso], scene.model["body_ipos"][torso], standing(scene.body).mass
    payload = whole * blocks["payload"][:1]
    center = (own * (place + height * blocks["center_of_mass"]) + payload * height * blocks["payload"][1:]) / (
        own + payload
    )
    multiple = blocks["mass"]
    if "body_mass" in fields:
        multiple = fields["body_mass"][legs].sum(keepdims=True) / scene.model["body_mass"][legs].sum()
        payload = fields["body_mass"][[torso]] / multiple - own
    center = fields["body_ipos"][torso] if "body_ipos" in fields else center
    return {
        "mass": multiple,
        "payload": numpy.concatenate([payload / whole, center / height]),
        "center_of_mass": (center - place) / height,
    }
