"""Motors: how strong they are, which fail, and their armatures."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.drags import have_drags, scale_servos
from arc_suite.tasks.modifiers.draws import Episode, interpolate
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.multiples import find_multiples
from arc_suite.tasks.parts import Joints, Scalar
from arc_suite.tasks.scene import Inputs, Scene

FAILS_FROM = 40  # control steps after which the motors of a leg fail

_TORQUE_LIMITS = "jnt_actfrcrange"  # field of the model: the lowest and highest torque of each joint's servo
_EXTRA_DEGREES = 5  # the torso's joint has 6 degrees of freedom, others 1: joint i has degree of freedom i + 5


class MotorsState(NamedTuple):
    """What an episode draws of motors.

    Attributes:
        motor_strength: (..., 1) share of the torque that all motors give.
        joint_strength: (..., joints) shares of the torque that each motor gives, in addition.
        strength: (..., joints) product of both.
        failing: (..., joints) whether the motor belongs to the leg whose motors fail.
        armature: (..., 1) multiple of the armatures of all joints.
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
    have_drags: bool = False


class Motors(_MotorsFields, Modifier):
    """Motors or servos of the joints.

    Attributes:
        motor_strength: range of the share of the torque that all motors give.
        joint_strength: range of the share of the torque that each motor gives, in addition to `motor_strength`. Each
            joint has a share of its own.
        armature: range of the multiple of the armatures of all joints.
        actuator_failure: the index of a leg whose motors do nothing from step 40 on; True for a random leg.
        are_servos: whether the joints have servos in place of motors.
        have_drags: whether torques of servos fall with speed. Their strengths are written into the model, as the share
            of a limited torque is not the limit of a share.
    """

    __slots__ = ()

    defaults = {
        "motor_strength": (1.0, 1.0),
        "joint_strength": (1.0, 1.0),
        "armature": (1.0, 1.0),
        "actuator_failure": False,
    }
    bounds = {"motor_strength": (0.0, 1.0), "joint_strength": (0.0, 1.0), "armature": (0.01, 100.0)}
    read_back_fields = ("dof_armature", "actuator_gear", "actuator_gainprm", _TORQUE_LIMITS)

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(
            motor_strength=cls.check_span("motor_strength", settings),
            joint_strength=cls.check_span("joint_strength", settings),
            armature=cls.check_span("armature", settings),
            actuator_failure=_check_failure(settings["actuator_failure"], len(body.legs)),
            are_servos=bool(body.source),
            have_drags=have_drags(body),
        )

    @property
    def structure(self) -> Hashable:
        """Whether motors fail."""
        return self.actuator_failure is not False

    def check_mirror(self, image: Image) -> None:
        """Check that the leg that fails is a random one, or one on the midline."""
        leg = self.actuator_failure
        if not isinstance(leg, bool) and image.legs[leg] != leg:
            raise ValueError(f"actuator_failure: expected a leg that is drawn, or one on the midline, got {leg}")

    def draw(self, episode: Episode) -> MotorsState:
        """Return strengths, failure and armature of the episode."""
        stream = episode.stream
        keyed = episode.keyed
        motor_strength = np.array([interpolate(self.motor_strength, stream.motor_strength)])
        joint_strength = interpolate(self.joint_strength, keyed.joint_strengths)
        leg_of_joint = _find_legs_of_joints(episode.scene.body)
        if self.actuator_failure is False:
            failing = np.zeros(len(leg_of_joint), bool)
        elif self.actuator_failure is True:
            failing = leg_of_joint == stream.failing_leg
        else:
            failing = leg_of_joint == self.actuator_failure
        return MotorsState(
            motor_strength=motor_strength,
            joint_strength=joint_strength,
            strength=motor_strength * joint_strength,
            failing=failing,
            armature=np.array([interpolate(self.armature, keyed.armature)]),
        )

    def fields(self, scene: Scene, model: Mapping[str, Any], state: MotorsState) -> dict[str, Any]:
        """Return the armatures, and the limits of the torques of servos."""
        fields = {}
        if self.armature != (1.0, 1.0):
            fields["dof_armature"] = state.armature[0] * model["dof_armature"]
        if self.are_servos and (self.motor_strength != (1.0, 1.0) or self.joint_strength != (1.0, 1.0)):
            limits = state.motor_strength[0] * model[_TORQUE_LIMITS]
            limits[_find_joints_in_model(scene)] *= state.joint_strength[:, None]
            fields[_TORQUE_LIMITS] = limits
            if self.have_drags:
                multiples = np.ones((len(model["actuator_gainprm"]), 1))
                multiples[: 2 * len(state.strength)] = np.tile(state.strength, 2)[:, None]  # servos and releases
                fields |= scale_servos(scene.body, model, multiples)
        return fields

    def drive(self, state: MotorsState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with the torques that motors give: weak and failing motors give less than commanded.

        Servos have a second input each, after those for their targets: the share of the torque that they do not give.
        Where torques fall with speed, they have a third: the share of the drag that they do not give.
        """
        strength = state.strength
        if self.have_drags:
            strength = strength.__array_namespace__().ones_like(strength)
        ctrl = strength * inputs.ctrl
        if self.actuator_failure is not False:
            works = ~(state.failing & (elapsed >= FAILS_FROM))
            ctrl = ctrl * works
            strength = strength * works
        if self.are_servos:
            xp = ctrl.__array_namespace__()
            releases = 1.0 - strength
            ctrl = xp.concatenate([ctrl, releases, *[releases] * self.have_drags], axis=-1)
        return inputs._replace(ctrl=ctrl)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks `armature`, and `strength`: shares of the torque that motors give, 0 after a failure."""
        strength = Joints(body, "strength of {}", signed=False)
        return {"armature": Block((Scalar("multiple of the armatures"),)), "strength": Block((strength,))}

    def privileged(self, state: MotorsState, elapsed, heading) -> dict[str, Any]:
        """Return the multiple of the armatures, and the shares of the torque that motors give."""
        has_failed = state.failing & (elapsed > FAILS_FROM)
        return {"armature": state.armature, "strength": state.strength * ~has_failed}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mean multiple of the armatures, and the strengths, of joints that a user has changed.

        Strengths are those that the episode has drawn, times the multiples by which the user has changed the torques.
        """
        changed_blocks = {}
        armatures = find_multiples(scene, fields, "dof_armature", scene.layout.joint_velocities)
        if armatures is not None:
            changed_blocks["armature"] = armatures.mean(keepdims=True)
        if self.are_servos:
            upper_limits = (_find_joints_in_model(scene), 1)
            torque_multiples = [find_multiples(scene, fields, _TORQUE_LIMITS, upper_limits)]
        else:
            joints = len(scene.body.joint_names)
            first_column = np.s_[:joints, 0]
            torque_multiples = [
                find_multiples(scene, fields, "actuator_gear", first_column),
                find_multiples(scene, fields, "actuator_gainprm", first_column),
            ]
        for multiples in torque_multiples:
            if multiples is not None:
                strength = changed_blocks.get("strength", blocks["strength"])
                changed_blocks["strength"] = strength * multiples
        return changed_blocks

    def failed_legs(self, scene: Scene, state: MotorsState, elapsed: int) -> tuple[str, ...]:
        """Return the name of the leg whose motors have failed; none before they fail."""
        if elapsed <= FAILS_FROM:
            return ()
        failed_indices = _find_legs_of_joints(scene.body)[state.failing].tolist()
        return tuple(leg.name for index, leg in enumerate(scene.body.legs) if index in failed_indices)


def _check_failure(failure: Any, legs: int) -> bool | int:
    """Return the setting `actuator_failure` of a body with a number of legs as a Python value.

    Raises:
        ValueError: it is neither a boolean nor the index of a leg.
    """
    if isinstance(failure, bool | np.bool_):
        return bool(failure)
    try:
        return checks.integer("actuator_failure", failure, 0, legs - 1)
    except ValueError:
        expected = f"expected true, false or the index of a leg, 0 to {legs - 1}"
        raise ValueError(f"actuator_failure: {expected}, got {checks.preview(failure)}") from None


def _find_legs_of_joints(body: Body) -> np.ndarray:
    """Return the index of the leg of each joint (joints,)."""
    return np.repeat(np.arange(len(body.legs)), [len(leg.joints) for leg in body.legs])


def _find_joints_in_model(scene: Scene) -> np.ndarray:
    """Return the indices (joints,) of the body's joints in the model."""
    degrees_of_freedom = np.arange(len(scene.model["dof_armature"]))
    return degrees_of_freedom[scene.layout.joint_velocities] - _EXTRA_DEGREES
