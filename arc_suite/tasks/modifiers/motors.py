"""Motors: how strong they are, which fail, and their armatures."""

import math
from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode, within
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.multiples import find_multiples
from arc_suite.tasks.parts import Joints, Scalar
from arc_suite.tasks.scene import Inputs, Scene

FAILS_FROM = 40  # control steps after which the motors of a leg fail

_LIMITS = "jnt_actfrcrange"  # of the torques of servos
_FREE = 5  # degrees of freedom of the torso's joint beyond one: joint i has degree i + 5


class MotorsState(NamedTuple):
    """What an episode draws of motors.

    Attributes:
        motor_strength: (..., 1) share of all motors.
        joint_strength: (..., joints) shares of each, in addition.
        strength: (..., joints) of both.
        failing: (..., joints) whether they are those of the leg whose motors fail.
        armature: (..., 1) multiple.
    """

    motor_strength: np.ndarray
    joint_strength: np.ndarray
    strength: np.ndarray
    failing: np.ndarray
    armature: np.ndarray


class _MotorsFields(NamedTuple):
    motor_strength: tuple[float, float]
    joint_strength: tuple[float, float]
    armature: tuple[float, float]
    actuator_failure: bool | int
    are_servos: bool


class Motors(_MotorsFields, Modifier):
    """Motors or servos of the joints.

    Attributes:
        motor_strength: share of the torque of all motors, or two of them.
        joint_strength: share of the torque of each motor, or two of them, in addition to `motor_strength`: every
            joint draws its own.
        armature: multiple of the armatures of all joints, or two of them.
        actuator_failure: True for a leg that is drawn, or the index of one: its motors do nothing from step 40 on.
        are_servos: whether they are servos.
    """

    __slots__ = ()

    defaults = {
        "motor_strength": (1.0, 1.0),
        "joint_strength": (1.0, 1.0),
        "armature": (1.0, 1.0),
        "actuator_failure": False,
    }
    bounds = {"motor_strength": (0.0, 1.0), "joint_strength": (0.0, 1.0), "armature": (0.01, 100.0)}
    read_back_fields = ("dof_armature", "actuator_gear", "actuator_gainprm", _LIMITS)

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        failure = settings["actuator_failure"]
        if not isinstance(failure, bool):
            checks.integer("actuator_failure", failure, 0, len(body.legs) - 1)
        spans = [cls.check_span(name, settings) for name in cls.bounds]
        return cls(*spans, failure, bool(body.source))

    @property
    def structure(self) -> Hashable:
        """Whether motors fail."""
        return self.actuator_failure is not False

    def check_mirror(self, image: Image) -> None:
        """Check that no leg of one side fails in every episode."""
        leg = self.actuator_failure
        if not isinstance(leg, bool) and image.legs[leg] != leg:
            raise ValueError(f"actuator_failure: expected a leg that is drawn, or one on the midline, got {leg}")

    def draw(self, episode: Episode) -> MotorsState:
        """Return strengths, failure and armature of the episode."""
        stream = episode.stream
        motor_strength = np.array([within(self.motor_strength, stream.strength)])
        joint_strength = within(self.joint_strength, episode.keyed.strengths)
        owners = _owners(episode.scene.body)
        leg = stream.leg if self.actuator_failure is True else self.actuator_failure
        return MotorsState(
            motor_strength,
            joint_strength,
            strength=motor_strength * joint_strength,
            failing=np.zeros(len(owners), bool) if self.actuator_failure is False else owners == leg,
            armature=np.array([within(self.armature, episode.keyed.armature)]),
        )

    def fields(self, scene: Scene, model: Mapping[str, Any], state: MotorsState) -> dict[str, Any]:
        """Return the armatures, and the limits of the torques of servos."""
        fields = {}
        if self.armature != (1.0, 1.0):
            fields["dof_armature"] = state.armature[0] * model["dof_armature"]
        if self.are_servos and (self.motor_strength != (1.0, 1.0) or self.joint_strength != (1.0, 1.0)):
            limits = state.motor_strength[0] * model[_LIMITS]
            limits[_joints(scene)] *= state.joint_strength[:, None]
            fields[_LIMITS] = limits
        return fields

    def drive(self, state: MotorsState, inputs: Inputs, elapsed) -> Inputs:
        """Return what motors give: weak and failing ones less than the torques that are commanded of them.

        Servos are also given their releases.
        """
        strength = state.strength
        ctrl = strength * inputs.ctrl
        if self.actuator_failure is not False:
            works = ~(state.failing & (elapsed >= FAILS_FROM))
            ctrl = ctrl * works
            strength = strength * works
        if self.are_servos:
            ctrl = ctrl.__array_namespace__().concatenate([ctrl, 1.0 - strength], axis=-1)
        return inputs._replace(ctrl=ctrl)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks `armature`, and `strength`: shares of the torque that motors give, 0 once they failed."""
        strength = Joints(body, "strength of {}", signed=False)
        return {"armature": Block((Scalar("multiple of the armatures"),)), "strength": Block((strength,))}

    def privileged(self, state: MotorsState, elapsed, heading) -> dict[str, Any]:
        """Return the multiple, and the shares."""
        has_failed = state.failing & (elapsed > FAILS_FROM)
        return {"armature": state.armature, "strength": state.strength * ~has_failed}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mean multiple of changed armatures, and strengths times those of changed motors or servos."""
        joints = len(scene.body.joint_names)
        armatures = find_multiples(scene, fields, "dof_armature", scene.layout.joint_velocities)
        changed = {} if armatures is None else {"armature": armatures.mean(keepdims=True)}
        if self.are_servos:
            strengths = {_LIMITS: (_joints(scene), 1)}
        else:
            strengths = dict.fromkeys(("actuator_gear", "actuator_gainprm"), np.s_[:joints, 0])
        multiples = [find_multiples(scene, fields, name, part) for name, part in strengths.items()]
        multiples = [multiple for multiple in multiples if multiple is not None]
        if multiples:
            changed["strength"] = math.prod(multiples, start=blocks["strength"])
        return changed

    def failed_legs(self, scene: Scene, state: MotorsState, elapsed: int) -> tuple[str, ...]:
        """Return the leg whose motors have failed, once they have."""
        if elapsed <= FAILS_FROM:
            return ()
        failed = set(_owners(scene.body)[state.failing].tolist())
        return tuple(leg.name for index, leg in enumerate(scene.body.legs) if index in failed)


def _owners(body: Body) -> np.ndarray:
    """Return the leg (joints,) of each joint."""
    return np.repeat(np.arange(len(body.legs)), [len(leg.joints) for leg in body.legs])


def _joints(scene: Scene) -> np.ndarray:
    """Return the indices (joints,) of the body's joints in the model."""
    return np.arange(len(scene.model["dof_armature"]))[scene.layout.joint_velocities] - _FREE
