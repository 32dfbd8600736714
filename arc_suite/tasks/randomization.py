"""What an episode draws of a body: masses, servos and sensors of its own, and pushes; and the model that follows.

Its random numbers follow from the episode's noise key, so that the stream of seeds is drawn from no more than before.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.outline import torso_box
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body
from arc_suite.tasks import noise
from arc_suite.tasks.contract import Scene
from arc_suite.tasks.inertia import Inertia
from arc_suite.tasks.modifiers import Modifiers

SCHEDULE, SHORTEST, LONGEST = 25, 40, 121  # kicks or pushes, and control steps from one to the next
MOST_STEPS = 4  # control steps of a push

_STEP = np.array([2**32 - 1], np.uint32)  # of the noise's generator, to which no episode counts

# What friction and mass multiply.
_FRICTIONS, _MASSES = ("pair_friction", "geom_friction"), ("body_mass", "body_inertia")
_SERVOS = ("actuator_gainprm", "actuator_biasprm")  # of both: offset, stiffness, damping
_LIMITS = "jnt_actfrcrange"  # of the torques of servos
_FREE = 5  # degrees of freedom of the torso's joint beyond one: joint i has degree i + 5


class Hidden(NamedTuple):
    """What an episode draws of the body, and a policy does not observe; by the names of the modifiers.

    Attributes:
        motor_strength: (..., 1) share of all motors.
        joint_strength: (..., joints) shares of each, in addition.
        friction: (..., 1) multiple.
        mass: (..., 1) multiple.
        payload: (..., 4) its mass, a share of the body's, and its place in the torso's frame, h.
        center_of_mass: (..., 3) displacement in the torso's frame, h.
        joint_offset: (..., joints) of sensors, rad.
        gains: (..., 2) multiples of stiffness and of damping.
        armature: (..., 1) multiple.
    """

    motor_strength: np.ndarray
    joint_strength: np.ndarray
    friction: np.ndarray
    mass: np.ndarray
    payload: np.ndarray
    center_of_mass: np.ndarray
    joint_offset: np.ndarray
    gains: np.ndarray
    armature: np.ndarray


class Pushes(NamedTuple):
    """A schedule of forces on the torso, which begins again once it has run out.

    Attributes:
        first: (..., SCHEDULE) control steps, counted from 1, in which they begin.
        last: (..., SCHEDULE) control steps in which they act last.
        forces: (..., SCHEDULE, 2) in the world, N.
    """

    first: np.ndarray
    last: np.ndarray
    forces: np.ndarray

    def acting(self, step):
        """Return the force (..., 2) that acts in a control step (..., 1), counted from 1."""
        now = (step - 1) % (self.first[..., -1:] + MOST_STEPS) + 1
        return (((self.first <= now) & (now <= self.last))[..., None] * self.forces).sum(axis=-2)


class Draws(NamedTuple):
    """What is random, each number uniform in [0, 1); all is drawn, always.

    Attributes:
        payload: position of its mass in the range.
        place: (3,) of the payload in the box around the torso.
        center: (3,) of mass in the range of its displacements.
        gains: (2,) positions of stiffness and of damping in their range.
        armature: position in its range.
        pauses: (SCHEDULE,) before pushes.
        lengths: (SCHEDULE,) of pushes in time.
        sizes: (SCHEDULE,) of pushes.
        directions: (SCHEDULE,) of pushes.
        strengths: (joints,) positions of each joint's strength in the range.
        offsets: (joints,) positions of the sensors' offsets in their range.
    """

    payload: float
    place: np.ndarray
    center: np.ndarray
    gains: np.ndarray
    armature: float
    pauses: np.ndarray
    lengths: np.ndarray
    sizes: np.ndarray
    directions: np.ndarray
    strengths: np.ndarray
    offsets: np.ndarray


def draw(noise_key: int, joints: int) -> Draws:
    """Draw what an episode has of its own, given the key of its noise and the number of joints."""
    sizes = (1, 3, 3, 2, 1, *[SCHEDULE] * 4, joints, joints)
    drawn = 0.5 + 0.5 * noise.noise(np.array([noise_key], np.uint32), _STEP, sum(sizes))
    parts = Draws(*np.split(drawn, np.cumsum(sizes)[:-1]))
    return parts._replace(payload=parts.payload[0], armature=parts.armature[0])


def within(span: tuple[float, float], share):
    """Return the number (...) that lies at a share (...) of a range."""
    low, high = span
    return low + share * (high - low)


def hidden(changes: Modifiers, body: Body, strength: float, friction: float, mass: float, drawn: Draws) -> Hidden:
    """Return what an episode has of its own.

    Args:
        changes: the modifiers.
        body: the spec.
        strength: position of the strength of all motors in its range.
        friction: position of the friction in its range.
        mass: position of the mass in its range.
        drawn: everything else.
    """
    low, high = (corner / body.torso.standing_height for corner in torso_box(body))
    return Hidden(
        motor_strength=np.array([within(changes.motor_strength, strength)]),
        joint_strength=within(changes.joint_strength, drawn.strengths),
        friction=np.array([within(changes.friction, friction)]),
        mass=np.array([within(changes.mass, mass)]),
        payload=np.array([within(changes.payload, drawn.payload), *within((low, high), drawn.place)]),
        center_of_mass=changes.center_of_mass * (2.0 * drawn.center - 1.0),
        joint_offset=changes.joint_offset * (2.0 * drawn.offsets - 1.0),
        gains=within(changes.gains, drawn.gains),
        armature=np.array([within(changes.armature, drawn.armature)]),
    )


def pushes(force: float, drawn: Draws) -> Pushes:
    """Return the schedule of pushes of at most a force, N."""
    first = np.cumsum(SHORTEST + (drawn.pauses * (LONGEST - SHORTEST)).astype(int))
    angles = 2.0 * math.pi * drawn.directions
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return Pushes(first, first + (drawn.lengths * MOST_STEPS).astype(int), force * drawn.sizes[:, None] * ways)


def changed_model(
    scene: Scene, changes: Modifiers, own: Hidden, given: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return the fields of the model that differ in an episode.

    Args:
        scene: of the task.
        changes: the modifiers.
        own: what the episode has drawn.
        given: fields that the task itself changes.
    """
    model = {**scene.model, **given}
    fields = {}
    if changes.friction != (1.0, 1.0):
        fields |= {name: own.friction[0] * model[name] for name in _FRICTIONS}
    if changes.mass != (1.0, 1.0):
        fields |= {name: own.mass[0] * model[name] for name in _MASSES}
    if changes.payload != (0.0, 0.0) or changes.center_of_mass:
        fields |= _torso(scene, own, model | fields)
    if changes.armature != (1.0, 1.0):
        fields["dof_armature"] = own.armature[0] * model["dof_armature"]
    if scene.body.source:
        fields |= _servos(scene, changes, own, model)
    return {**given, **fields}


def _torso(scene: Scene, own: Hidden, model: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The masses with a payload on the torso, and its center of mass moved."""
    part, height = scene.layout.torso, scene.body.torso.standing_height
    names = ("body_mass", "body_ipos", "body_inertia", "body_iquat")
    fields = {name: model[name].copy() for name in names}
    torso = Inertia(*(fields[name][part] for name in names))
    share, place = own.payload[0], own.payload[1:]
    torso = torso._replace(center=torso.center + height * own.center_of_mass)
    if share > 0.0:
        torso = torso.with_point(share * own.mass[0] * standing(scene.body).mass, height * place)
    for name, value in zip(names, torso, strict=True):
        fields[name][part] = value
    return fields


def _servos(scene: Scene, changes: Modifiers, own: Hidden, model: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Gains of servos, and the limits of their torques."""
    fields = {}
    if changes.gains != (1.0, 1.0):
        multiples = np.ones(model[_SERVOS[0]].shape[1])
        multiples[:3] = own.gains[[0, 0, 1]]
        fields |= {name: multiples * model[name] for name in _SERVOS}
    if changes.motor_strength != (1.0, 1.0) or changes.joint_strength != (1.0, 1.0):
        limits = own.motor_strength[0] * model[_LIMITS]
        joints = np.arange(_FREE + len(limits))[scene.layout.joint_velocities] - _FREE
        limits[joints] *= own.joint_strength[:, None]
        fields[_LIMITS] = limits
    return fields
