"""What a task is made for, how an episode starts, and what a control step writes into the simulation."""

import types
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.arenas import Arena
from arc_suite.robots.spec import Body
from arc_suite.tasks.readings import Layout

# Fields of `MjModel` that an episode can have its own values of: masses, frictions, armatures and servos.
CHANGEABLE = (
    *("body_mass", "body_inertia", "body_ipos", "body_iquat", "pair_friction", "geom_friction"),
    *("dof_armature", "jnt_actfrcrange", "actuator_gainprm", "actuator_biasprm", "actuator_gear"),
)


class Scene(NamedTuple):
    """What a task is made for.

    Attributes:
        body: what moves.
        arena: where.
        layout: of the body in the simulation's arrays.
        standing: (nq,) the pose in which it stands: torso position and quaternion, joint angles.
        control_timestep: s between two actions.
        substeps: of the simulation between them.
        model: the fields of `MjModel` that `CHANGEABLE` names, as compiled.
    """

    body: Body
    arena: Arena
    layout: Layout
    standing: np.ndarray
    control_timestep: float
    substeps: int
    model: Mapping[str, np.ndarray]


class Start(NamedTuple):
    """How one episode starts; no leading axes.

    Attributes:
        qpos: (nq,) positions.
        qvel: (nv,) velocities.
        memory: numbers and arrays in a NamedTuple, which may hold NamedTuples in turn; replaced from step to step
            and never written in place.
        mocap_pos: (mocap bodies, 3) m, of obstacles that the arena has; None where it has none.
        model: fields of `MjModel` that differ in this episode, by name.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    memory: Any
    mocap_pos: np.ndarray | None = None
    model: Mapping[str, np.ndarray] = types.MappingProxyType({})


class Inputs(NamedTuple):
    """What a control step writes into the simulation.

    Attributes:
        ctrl: (..., motors) in [-1, 1].
        kick: (..., nv) added to qvel before the first substep; None for no kick.
        force: (..., 3) on the torso's center of mass throughout the step, N, world; None for no force.
    """

    ctrl: np.ndarray
    kick: np.ndarray | None = None
    force: np.ndarray | None = None
