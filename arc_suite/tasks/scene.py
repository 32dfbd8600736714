"""The scene of a task, the start of an episode, and the inputs of a control step."""

import types
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.arenas import Arena
from arc_suite.robots.spec import Body
from arc_suite.tasks.readings import Layout

# Fields of `MjModel` whose values may differ from episode to episode: masses, frictions, armatures and servos.
CHANGEABLE = (
    *("body_mass", "body_inertia", "body_ipos", "body_iquat", "pair_friction", "geom_friction"),
    *("dof_armature", "jnt_actfrcrange", "actuator_gainprm", "actuator_biasprm", "actuator_gear"),
)


class Scene(NamedTuple):
    """The body and the arena of a task, with what follows from their compiled model.

    Attributes:
        body: the body that moves.
        arena: the ground and obstacles.
        layout: indices of the body's parts in the simulation's arrays.
        standing: (nq,) the standing pose: torso position and quaternion, joint angles; see `readings.torso_qpos`.
        control_timestep: s between two actions.
        substeps: steps of the simulation between two actions.
        model: fields of the compiled `MjModel`, those of `CHANGEABLE`.
    """

    body: Body
    arena: Arena
    layout: Layout
    standing: np.ndarray
    control_timestep: float
    substeps: int
    model: Mapping[str, np.ndarray]


class Start(NamedTuple):
    """The start of one episode; without leading axes.

    Attributes:
        qpos: (nq,) positions, the first one the torso's; see `readings.root_qpos`.
        qvel: (nv,) velocities, the first one the torso's.
        memory: numbers and arrays in a NamedTuple, which may hold further NamedTuples. Each step replaces it; nothing
            writes into it.
        mocap_pos: (mocap bodies, 3) positions of obstacles, m; None where the arena has none.
        model: fields of `MjModel` that differ in this episode, by name.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    memory: Any
    mocap_pos: np.ndarray | None = None
    model: Mapping[str, np.ndarray] = types.MappingProxyType({})


class Inputs(NamedTuple):
    """Inputs of a control step, which are written into the simulation.

    Attributes:
        ctrl: (..., motors) controls in [-1, 1].
        kick: (..., n) added to the first n numbers of qvel, the torso's velocity first, before the first substep; None
            for no kick.
        force: (..., 3) on the torso's center of mass throughout the step, in the world, N; None for no force.
    """

    ctrl: np.ndarray
    kick: np.ndarray | None = None
    force: np.ndarray | None = None
