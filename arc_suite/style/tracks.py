"""Records rollouts as plain arrays: all that a report of style needs."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import checks, evaluation
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.policies import Policy
from arc_suite.robots.spec import Body
from arc_suite.tasks.clock import TWO_PI
from arc_suite.tasks.parameters import Parameters
from arc_suite.tasks.terms import reward

UNTIMED = dict.fromkeys(("phases", "leg_phases", "duty_factors"))  # fields of a track in a task without a gait


class Track(NamedTuple):
    """A recorded rollout: one row for the end of every control step, SI units, angles in rad.

    Attributes:
        setup: body, task and settings.
        seed: seed of the episode; the actions repeat it where motors take them as they are.
        time_step: s between rows.
        positions: (steps, 3) positions of the torso.
        quaternions: (steps, 4) quaternions of the torso, w first.
        linear_velocities: (steps, 3) linear velocities of the torso, world frame.
        angular_velocities: (steps, 3) angular velocities of the torso, its own frame.
        joint_angles: (steps, joints)
        joint_velocities: (steps, joints)
        actions: (steps, joints), as applied.
        torques: (steps, joints) torques of the motors, N m.
        torso_heights: (steps,) heights of the torso over the ground.
        foot_positions: (steps, feet, 3) positions of the feet's centers.
        foot_heights: (steps, feet) heights of the feet's centers over the ground.
        foot_velocities: (steps, feet, 3) velocities of the lowest points of the feet, world frame.
        contacts: (steps, feet) whether the ground pushes on the foot.
        phases: (steps,) phases of the gait clock, rad; None in a task without a gait.
        leg_phases: (steps, feet) phases of the legs in the gait that holds, up to whole turns; None in a task
            without a gait.
        duty_factors: (steps,) duty factors of the gait that holds; None in a task without a gait.
        terms: the reward's unweighted terms by name, each (steps,).
        weights: signed weight of every term.
        progress: the task's metrics at the end by name.
        target_velocity: constant target of the task along world x, m/s; NaN if it has none.
        parameters: prescribed schedule and standing pose; None in a task without a gait.
        mass: kg, of the whole body.
        gravity: m/s^2, downwards.
    """

    setup: Setup
    seed: int
    time_step: float
    positions: np.ndarray
    quaternions: np.ndarray
    linear_velocities: np.ndarray
    angular_velocities: np.ndarray
    joint_angles: np.ndarray
    joint_velocities: np.ndarray
    actions: np.ndarray
    torques: np.ndarray
    torso_heights: np.ndarray
    foot_positions: np.ndarray
    foot_heights: np.ndarray
    foot_velocities: np.ndarray
    contacts: np.ndarray
    phases: np.ndarray | None
    leg_phases: np.ndarray | None
    duty_factors: np.ndarray | None
    terms: Mapping[str, np.ndarray]
    weights: Mapping[str, float]
    progress: Mapping[str, float]
    target_velocity: float
    parameters: Parameters | None
    mass: float
    gravity: float

    @property
    def body(self) -> Body:
        """The body that moved."""
        return self.setup.body

    @property
    def legs(self) -> tuple[str, ...]:
        """Names of the legs."""
        return tuple(leg.name for leg in self.body.legs)

    @property
    def joint_legs(self) -> np.ndarray:
        """Index of the leg that a joint belongs to, (joints,)."""
        return np.array([index for index, leg in enumerate(self.body.legs) for _ in leg.joints])

    @property
    def foot_radii(self) -> np.ndarray:
        """Radii of the feet, (feet,) m."""
        return np.array([leg.foot.radius for leg in self.body.legs])

    @property
    def mirrors(self) -> np.ndarray:
        """For each leg the index of its left-right counterpart, (feet,), -1 if there is none."""
        stands = np.array([leg.foot_position for leg in self.body.legs])
        distances = np.linalg.norm(stands[:, None] - stands * (1, -1, 1), axis=-1)
        nearest = distances.argmin(axis=1)
        apart = nearest != np.arange(len(stands))
        return np.where(apart & (distances.min(axis=1) < 1e-6), nearest, -1)

    @property
    def times(self) -> np.ndarray:
        """Times since the start of the episode, (steps,) s."""
        return self.time_step * np.arange(1, len(self.positions) + 1)

    @property
    def stance(self) -> np.ndarray:
        """Feet in stance, (steps, feet) booleans: those below the threshold of the paper's Section 4."""
        return self.foot_heights < self.parameters.stance_threshold

    @property
    def schedule(self) -> np.ndarray:
        """Feet that the gait wants in stance (the paper's Section 4), (steps, feet) booleans."""
        return self.leg_phases % TWO_PI < TWO_PI * self.duty_factors[:, None]

    @property
    def rewards(self) -> np.ndarray:
        """Rewards of the steps, (steps,)."""
        return reward(self.terms, self.weights)[1]


def only_setup(tracks: Iterable[Track]) -> Setup:
    """Return the setup of tracks.

    Raises:
        ValueError: no tracks, or tracks of several setups.
    """
    setups = {track.setup for track in tracks}
    if len(setups) != 1:
        raise ValueError(f"tracks: expected those of one setup, got {sorted(map(str, setups))}")
    return setups.pop()


def record(environment: Environment, policy: Policy, seed: int, max_steps: int | None = None) -> Track:
    """Play one episode of the evaluation protocol and record it.

    Foot positions, velocities and contacts are one substep behind the torso, as in the reward.

    Args:
        environment: environment of `arc_suite.load`.
        policy: made for one environment.
        seed: seed of the episode's start.
        max_steps: control steps after which to stop, at least 1; None for a whole episode.

    Returns:
        The track; without phases, duty factors and parameters if the task prescribes no gait.

    Raises:
        ValueError: no step, or a setting of the environment's task that JSON cannot hold, such as an `Arena`.
    """
    if max_steps is not None:
        checks.integer("max_steps", max_steps, 1)
    run = environment.task
    task = run.definition
    model = environment.physics.model.ptr
    data = environment.physics.data.ptr
    body = task.scene.body
    layout = task.scene.layout
    setup = Setup.of(body, task.name, environment.task_kwargs)
    feet = [model.body(name).id for name in body.foot_names]
    radii = np.array([leg.foot.radius for leg in body.legs])
    rows = []
    terms = []
    for timestep in evaluation.rollout(environment, policy, seed, max_steps):
        if timestep.first():
            continue
        readings = task.read(data)
        row = {
            "positions": readings.torso_position,
            "quaternions": readings.torso_quaternion,
            "linear_velocities": readings.velocities[:3],
            "angular_velocities": readings.velocities[3:6],
            "joint_angles": readings.joint_angles,
            "joint_velocities": data.qvel[layout.joint_velocities],
            "actions": data.ctrl[: len(body.joint_names)],
            "torques": data.qfrc_actuator[layout.joint_velocities],
            "torso_heights": readings.torso_height,
            "foot_positions": data.xpos[feet],
            "foot_heights": readings.foot_heights,
            "foot_velocities": lowest_point_velocities(model, data, feet, radii),
            "contacts": data.cfrc_ext[feet].any(axis=-1),
        }
        gait = task.leg_phases(run.memory)
        if gait is not None:
            leg_phases, duty_factors = gait
            row |= {"phases": task.phase(run.memory), "leg_phases": leg_phases, "duty_factors": duty_factors}
        rows.append({name: np.array(value) for name, value in row.items()})
        terms.append(run.terms)
    arrays = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return Track(
        setup=setup,
        seed=int(seed),
        time_step=environment.control_timestep(),
        **UNTIMED | arrays,
        terms={name: np.array([step_terms[name] for step_terms in terms]) for name in terms[0]},
        weights=dict(task.settings.weights),
        progress={name: float(value) for name, value in run.progress.items()},
        target_velocity=np.nan if task.target_velocity is None else task.target_velocity,
        parameters=task.parameters,
        mass=float(model.body_mass.sum()),
        gravity=float(-model.opt.gravity[2]),
    )


def lowest_point_velocities(model, data, feet, radii) -> np.ndarray:
    """Return the velocities of the feet where they would touch a level floor: (feet, 3) m/s in the world frame.

    Args:
        model: `mujoco.MjModel`
        data: `mujoco.MjData`
        feet: ids of the feet's bodies, spheres about their origins.
        radii: (feet,) m.
    """
    velocities = np.empty((len(feet), 6))
    for foot, velocity in zip(feet, velocities, strict=True):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, foot, velocity, 0)
    angular_velocities = velocities[:, :3]
    linear_velocities = velocities[:, 3:]
    lowest_points = radii[:, None] * (0.0, 0.0, -1.0)  # from the origins of the feet
    return linear_velocities + np.cross(angular_velocities, lowest_points)
