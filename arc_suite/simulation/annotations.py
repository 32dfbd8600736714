"""Types of a simulation's data and model, for editors and type checkers: MuJoCo's and dm_control's own have none."""

from contextlib import AbstractContextManager
from typing import Any, Protocol

import mujoco
import numpy as np


class MjData(Protocol):
    """The state of a simulation and what follows from it, for functions of `mujoco`; arrays are live.

    These are the fields that programs read most; the others are there, too.

    Attributes:
        time: s.
        ncon: number of contacts.
        qpos, qvel, qacc: positions, velocities and accelerations of the joints; the torso's come first.
        ctrl: controls of motors and servos.
        actuator_force: their forces, N m.
        qfrc_actuator, qfrc_applied, qfrc_constraint: forces of the joints, N and N m.
        xfrc_applied: forces and torques that act on bodies, (bodies, 6).
        cfrc_ext: forces and torques of contacts on bodies, (bodies, 6).
        xpos, xquat, xmat: places and orientations of bodies, m.
        xipos: centers of mass of bodies, m.
        cvel: velocities of bodies, turning first.
        subtree_com: centers of mass of bodies with their children, m; the first is the whole robot's.
        geom_xpos, geom_xmat, site_xpos, site_xmat: places and orientations of geoms and sites, m.
        mocap_pos, mocap_quat: places and orientations of pillars and other bodies that do not move, m.
        sensordata: readings of sensors.
    """

    time: float
    ncon: int
    qpos: np.ndarray
    qvel: np.ndarray
    qacc: np.ndarray
    ctrl: np.ndarray
    actuator_force: np.ndarray
    qfrc_actuator: np.ndarray
    qfrc_applied: np.ndarray
    qfrc_constraint: np.ndarray
    xfrc_applied: np.ndarray
    cfrc_ext: np.ndarray
    xpos: np.ndarray
    xquat: np.ndarray
    xmat: np.ndarray
    xipos: np.ndarray
    cvel: np.ndarray
    subtree_com: np.ndarray
    geom_xpos: np.ndarray
    geom_xmat: np.ndarray
    site_xpos: np.ndarray
    site_xmat: np.ndarray
    mocap_pos: np.ndarray
    mocap_quat: np.ndarray
    sensordata: np.ndarray

    def __getattr__(self, name: str) -> Any: ...


class Data(MjData, Protocol):
    """The data of a simulation as dm_control wraps them, `physics.data`.

    Attributes:
        ptr: the data itself, for functions of `mujoco`.
    """

    ptr: mujoco.MjData

    def contact_force(self, contact_id: int) -> np.ndarray: ...
    def object_velocity(
        self, object_id: int | str, object_type: int | str, local_frame: bool = False
    ) -> np.ndarray: ...
    def copy(self) -> "Data": ...


class MjModel(Protocol):
    """The model of a simulation, for functions of `mujoco`; arrays are live.

    These are the fields that programs read most; the others are there, too.

    Attributes:
        nq, nv, nu: numbers of positions, velocities and controls.
        nbody, njnt, ngeom, nsite, nsensor, npair: numbers of bodies, joints, geoms, sites, sensors and pairs of geoms.
        body_mass, body_inertia, body_ipos, body_iquat: masses, kg, inertias and where they are.
        body_pos, body_quat, body_parentid: places in the parent's frame, m, and indices of parents.
        jnt_range, jnt_stiffness: ranges of joints, rad, and their springs.
        dof_armature, dof_damping, dof_frictionloss: resistance of joints.
        actuator_gear, actuator_ctrlrange, actuator_forcerange: transmission and bounds of motors and servos.
        geom_size, geom_pos, geom_rgba, geom_friction, pair_friction: geoms and contacts; see the class `Physics`.
        key_qpos, qpos0: poses of keyframes, and the one in which the model is written.
    """

    nq: int
    nv: int
    nu: int
    nbody: int
    njnt: int
    ngeom: int
    nsite: int
    nsensor: int
    npair: int
    body_mass: np.ndarray
    body_inertia: np.ndarray
    body_ipos: np.ndarray
    body_iquat: np.ndarray
    body_pos: np.ndarray
    body_quat: np.ndarray
    body_parentid: np.ndarray
    jnt_range: np.ndarray
    jnt_stiffness: np.ndarray
    dof_armature: np.ndarray
    dof_damping: np.ndarray
    dof_frictionloss: np.ndarray
    actuator_gear: np.ndarray
    actuator_ctrlrange: np.ndarray
    actuator_forcerange: np.ndarray
    geom_size: np.ndarray
    geom_pos: np.ndarray
    geom_rgba: np.ndarray
    geom_friction: np.ndarray
    pair_friction: np.ndarray
    key_qpos: np.ndarray
    qpos0: np.ndarray

    def __getattr__(self, name: str) -> Any: ...


class Model(MjModel, Protocol):
    """The model of a simulation as dm_control wraps it, `physics.model`.

    Attributes:
        ptr: the model itself, for functions of `mujoco`.
        name: name of the model.
    """

    ptr: mujoco.MjModel
    name: str

    def name2id(self, name: str, object_type: int | str) -> int: ...
    def id2name(self, object_id: int, object_type: int | str) -> str: ...
    def disable(self, *flags: int | str) -> AbstractContextManager[None]: ...
    def copy(self) -> "Model": ...
    def free(self) -> None: ...
    def to_bytes(self) -> bytes: ...
    def save_binary(self, path: str) -> None: ...


class NamedField(Protocol):
    """A field by names of rows, such as `named.data.xpos["torso", "z"]`; live."""

    def __getitem__(self, key: Any) -> np.ndarray: ...
    def __setitem__(self, key: Any, value: Any) -> None: ...


class NamedFields(Protocol):
    """Fields of data or a model by names."""

    def __getattr__(self, name: str) -> NamedField: ...


class Named(Protocol):
    """`physics.named`: data and model by names of bodies, joints, geoms and sensors."""

    @property
    def data(self) -> NamedFields: ...
    @property
    def model(self) -> NamedFields: ...
