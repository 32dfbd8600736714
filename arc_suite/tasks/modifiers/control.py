"""Control: whether actions are torques or positions, and how stiffly positions are held."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.models.sizing import action_reaches, position_gains, size_body
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.drags import SERVO_FIELDS, have_drags, scale_servos
from arc_suite.tasks.modifiers.draws import Episode, interpolate
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.multiples import find_multiples
from arc_suite.tasks.parts import Scalar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Scene

ACTIONS = ("torque", "position")
_OFFSET_SHARE = 0.2  # of a joint's reach: how far an action of 1 leads from the center that a task gives


class ControlState(NamedTuple):
    """State of the control.

    Attributes:
        gains: (..., 2) multiples of stiffness and of damping that the episode has drawn.
        angles: (..., joints) angles of the joints at the latest reading, rad.
        speeds: (..., joints) speeds of the joints at the latest reading, rad/s.
    """

    gains: np.ndarray
    angles: np.ndarray
    speeds: np.ndarray


class _ControlFields(NamedTuple):
    gains: tuple[float, float]
    actions: str
    is_of_servos: bool
    stiffness: np.ndarray
    damping: np.ndarray
    reach: np.ndarray


class Control(_ControlFields, Modifier):
    """Control of the joints.

    Attributes:
        gains: range of the multiple of the stiffness, and of that of the damping, of position control and servos.
        actions: "torque", or "position": an action is then the target angles of the joints. 0 is the standing pose, 1
            and -1 are as far from it as the farther limit of the joint's range. Where a task gives another center, such
            as the next pose of a motion, 0 is that center, and 1 leads 0.2 times as far. The setting None stands for
            torques of motors, and for positions of servos, which take nothing else.
        is_of_servos: whether servos hold positions by themselves.
        stiffness: (joints,) action per rad.
        damping: (joints,) action per rad/s.
        reach: (joints,) distance of the farther limit of each joint's range from the standing pose, rad.
    """

    __slots__ = ()

    defaults = {"gains": (1.0, 1.0), "actions": None}
    bounds = {"gains": (0.01, 10.0)}
    read_back_fields = SERVO_FIELDS

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        gains = cls.check_span("gains", settings)
        actions = _check_actions(settings["actions"], body)
        if actions == "torque" and gains != (1.0, 1.0):
            value = checks.preview(settings["gains"])
            raise ValueError(f"gains: torques have none, expected actions='position', got {value}")
        stiffness, damping = position_gains(size_body(body), measure_standing(body).inertias)
        return cls(gains, actions, bool(body.source), stiffness, damping, action_reaches(body))

    @property
    def is_active(self) -> bool:
        """Whether it holds positions by torques."""
        return self.actions == "position" and not self.is_of_servos

    @property
    def structure(self) -> Hashable:
        """What actions are."""
        return self.actions

    def draw(self, episode: Episode) -> ControlState:
        """Return the gains of the episode."""
        zeros = np.zeros(len(self.reach))
        return ControlState(interpolate(self.gains, episode.keyed.gains), angles=zeros, speeds=zeros)

    def fields(self, scene: Scene, model: Mapping[str, Any], state: ControlState) -> dict[str, Any]:
        """Return the gains of servos."""
        if not self.is_of_servos or self.gains == (1.0, 1.0):
            return {}
        stiffness_gain = state.gains[0]
        damping_gain = state.gains[1]
        columns = model["actuator_gainprm"].shape[1]
        multiples = np.ones(columns)
        multiples[:3] = (stiffness_gain, stiffness_gain, damping_gain)  # offset, stiffness, damping
        if have_drags(scene.body):
            return scale_servos(scene.body, model, multiples)
        return {name: multiples * model[name] for name in SERVO_FIELDS}

    def act(self, state: ControlState, action, elapsed) -> tuple[ControlState, Any]:
        """Return the torques that hold the positions of an action."""
        return state, self.torques(state, action)

    def torques(self, state: ControlState, action):
        """Return the torques (..., joints) of motors, in [-1, 1], that hold joints at the positions of an action."""
        stiffness_gain = state.gains[..., :1]
        damping_gain = state.gains[..., 1:]
        target_angles = self.reach * action
        spring = stiffness_gain * (self.stiffness * (target_angles - state.angles))
        damper = damping_gain * (self.damping * state.speeds)
        return (spring - damper).clip(-1.0, 1.0)

    def add_center(self, center, action):
        """Return the position (..., joints) of an action (..., joints) about a center (..., joints), rad."""
        return center / self.reach + _OFFSET_SHARE * action

    def subtract_center(self, center, positions):
        """Return the action (..., joints) in [-1, 1] for a position (..., joints): the inverse of `add_center`."""
        return ((positions - center / self.reach) / _OFFSET_SHARE).clip(-1.0, 1.0)

    def positions(self, torques, angles, speeds):
        """Return the action (..., joints) by which position control gives some torques: the inverse of `torques`.

        An action is clipped to [-1, 1], so that targets stay within the reach of the joints.

        Args:
            torques: (..., joints) in [-1, 1].
            angles: (..., joints) angles of the joints, rad.
            speeds: (..., joints) speeds of the joints, rad/s.
        """
        target_angles = angles + (torques + self.damping * speeds) / self.stiffness
        return (target_angles / self.reach).clip(-1.0, 1.0)

    def measure(self, state: ControlState, readings: Readings) -> ControlState:
        """Return the state with the joints' angles and velocities."""
        # Sums with 0 are copies: readings may be views of the simulation.
        angles = readings.joint_angles + 0.0
        speeds = readings.velocities[..., 6:] + 0.0  # after 6 numbers of the torso
        return state._replace(angles=angles, speeds=speeds)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `gains`."""
        return {"gains": Block((Scalar("multiple of the stiffness"), Scalar("multiple of the damping")))}

    def privileged(self, state: ControlState, elapsed, heading) -> dict[str, Any]:
        """Return the multiples of stiffness and damping."""
        return {"gains": state.gains}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mean multiples of the gains of servos that a user has changed; nothing for motors."""
        if not self.is_of_servos:
            return {}
        joints = len(scene.body.joint_names)
        # The gain of a servo is its stiffness, the third number of its bias its damping.
        stiffness = find_multiples(scene, fields, "actuator_gainprm", np.s_[:joints, 0])
        damping = find_multiples(scene, fields, "actuator_biasprm", np.s_[:joints, 2])
        if stiffness is None and damping is None:
            return {}
        stiffness_gain, damping_gain = blocks["gains"]
        if stiffness is not None:
            stiffness_gain = stiffness.mean()
        if damping is not None:
            damping_gain = damping.mean()
        xp = blocks["gains"].__array_namespace__()
        return {"gains": xp.stack([stiffness_gain, damping_gain])}


def _check_actions(value, body: Body) -> str:
    """Return the checked setting `actions`; in place of None, what the motors or servos of the body take."""
    if value is None:
        return "position" if body.source else "torque"
    if checks.name(value, ACTIONS, "actions") == "torque" and body.source:
        raise ValueError(f"actions: {body.name} has servos, which take positions, expected position, got torque")
    return value
