"""Control: whether actions are torques or positions, and how stiffly positions are held."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.models.sizing import position_gains, reaches, sized
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode, within
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.multiples import find_multiples
from arc_suite.tasks.parts import Scalar
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Scene

ACTIONS = ("torque", "position")

_SERVOS = ("actuator_gainprm", "actuator_biasprm")  # of both: offset, stiffness, damping


class ControlState(NamedTuple):
    """State of the control.

    Attributes:
        gains: (..., 2) multiples of stiffness and of damping that the episode has drawn.
        angles: (..., joints) of the joints at the latest reading, rad.
        speeds: (..., joints) of the joints at the latest reading, rad/s.
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
        gains: multiple of the stiffness, and another of the damping, of position control and servos, or two of them.
        actions: "torque", or "position": an action is then the joints' wanted angles, 0 for the standing
            pose and as far as the farther limit of a joint's range for 1 and -1, held by the body's own gains. None:
            torques of motors and positions of servos, which take nothing else.
        is_of_servos: whether servos hold positions by themselves.
        stiffness: (joints,) action per rad.
        damping: (joints,) action per rad/s.
        reach: (joints,) the farther limit of each joint's range, from the standing pose, rad.
    """

    __slots__ = ()

    defaults = {"gains": (1.0, 1.0), "actions": None}
    bounds = {"gains": (0.01, 10.0)}
    read_back_fields = _SERVOS

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        gains = cls.check_span("gains", settings)
        actions = _check_actions(settings["actions"], body)
        if actions == "torque" and gains != (1.0, 1.0):
            value = checks.preview(settings["gains"])
            raise ValueError(f"gains: torques have none, expected actions='position', got {value}")
        stiffness, damping = position_gains(sized(body), standing(body).inertias)
        return cls(gains, actions, bool(body.source), stiffness, damping, reaches(body))

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
        still = np.zeros(len(self.reach))
        return ControlState(within(self.gains, episode.keyed.gains), still, still)

    def fields(self, scene: Scene, model: Mapping[str, Any], state: ControlState) -> dict[str, Any]:
        """Return the gains of servos."""
        if not self.is_of_servos or self.gains == (1.0, 1.0):
            return {}
        multiples = np.ones(model[_SERVOS[0]].shape[1])
        multiples[:3] = state.gains[[0, 0, 1]]
        return {name: multiples * model[name] for name in _SERVOS}

    def act(self, state: ControlState, action, elapsed) -> tuple[ControlState, Any]:
        """Return the torques that hold the positions of an action."""
        return state, self.torques(state, action)

    def torques(self, state: ControlState, action):
        """Return the actions (..., joints) in [-1, 1] of motors that hold joints at the positions of an action."""
        stiffness_gain = state.gains[..., :1]
        damping_gain = state.gains[..., 1:]
        pull = stiffness_gain * (self.stiffness * (self.reach * action - state.angles))
        return (pull - damping_gain * (self.damping * state.speeds)).clip(-1.0, 1.0)

    def positions(self, torques, angles, speeds):
        """Return the action (..., joints) for which motors that hold positions give torques, as far as joints reach.

        Args:
            torques: (..., joints) in [-1, 1].
            angles: (..., joints) of the joints, rad.
            speeds: (..., joints) of the joints, rad/s.
        """
        return ((angles + (torques + self.damping * speeds) / self.stiffness) / self.reach).clip(-1.0, 1.0)

    def measure(self, state: ControlState, readings: Readings) -> ControlState:
        """Return the state with the joints' angles and velocities."""
        return state._replace(angles=readings.joint_angles + 0.0, speeds=readings.velocities[..., 6:] + 0.0)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `gains`."""
        return {"gains": Block((Scalar("multiple of the stiffness"), Scalar("multiple of the damping")))}

    def privileged(self, state: ControlState, elapsed, heading) -> dict[str, Any]:
        """Return the multiples."""
        return {"gains": state.gains}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mean multiples of the gains of servos, of a body that has them."""
        joints = len(scene.body.joint_names)
        columns = (np.s_[:joints, 0], np.s_[:joints, 2])  # stiffness, damping
        multiples = [find_multiples(scene, fields, *pair) for pair in zip(_SERVOS, columns, strict=True)]
        if not self.is_of_servos or all(multiple is None for multiple in multiples):
            return {}
        gains = [
            gain if multiple is None else multiple.mean()
            for gain, multiple in zip(blocks["gains"], multiples, strict=True)
        ]
        return {"gains": blocks["gains"].__array_namespace__().stack(gains)}


def _check_actions(value, body: Body) -> str:
    if value is None:
        return "position" if body.source else "torque"
    if checks.name(value, ACTIONS, "actions") == "torque" and body.source:
        raise ValueError(f"actions: {body.name} has servos, which take positions, expected position, got torque")
    return value
