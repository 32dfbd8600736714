"""Walk: forward at the target speed, in the prescribed gait, for 50 seconds."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from dm_control import mujoco
from dm_control.rl import control

from arc_suite import checks
from arc_suite.models.sizing import SUBSTEPS, control_timestep
from arc_suite.robots import ROBOTS, gaits
from arc_suite.robots.spec import Body
from arc_suite.simulation.physics import Physics
from arc_suite.tasks import terms
from arc_suite.tasks.fitting import fitted_settings
from arc_suite.tasks.readings import layout
from arc_suite.tasks.walker import Walker

HORIZON = 1000  # control steps

# Signed weights of the ten terms (Section 4), the same for all robots but for "control".
WEIGHTS = {
    "forward": 1.5,
    "healthy": 1.0,
    "gait_bonus": 1.5,
    "gait_cost": -0.1,
    "control": -0.05,
    "smoothness": -0.02,
    "contact": -0.0005,
    "angular_velocity": -0.05,
    "vertical_velocity": -0.02,
    "posture": -0.001,
}

# What a robot does not set itself.
COMMON = {"duty_factor": 0.6, "default_angles": 0.0, "joint_noise": 0.1, "weights": {}}

_TRIPOD = (math.pi, 0.0, math.pi, 0.0, math.pi, 0.0)  # of l1 l2 l3 r1 r2 r3
_TROT = (0.0, math.pi, math.pi, 0.0)  # of fl fr rl rr

# The numbers of task x robot: units as in `terms.Parameters` and `Settings`.
SETTINGS = {
    "queen": {
        "target_velocity": 0.5,
        "velocity_band": 0.3,
        "gait_frequency": 1.5,
        "phase_offsets": _TRIPOD,
        "stance_threshold": 0.12,
        "healthy_range": (0.25, 1.2),
        "base_noise": 0.02,
        "weights": {"control": -0.05},
    },
    "bastion": {
        "target_velocity": 0.5,
        "velocity_band": 0.3,
        "gait_frequency": 1.5,
        "phase_offsets": _TRIPOD,
        "stance_threshold": 0.08,
        "healthy_range": (0.15, 1.0),
        "base_noise": 0.1,
        "weights": {"control": -0.08},
    },
    "tick": {
        "target_velocity": 0.33,
        "velocity_band": 0.33,
        "gait_frequency": 1.5,
        "phase_offsets": _TRIPOD,
        "stance_threshold": 0.06,
        "healthy_range": (0.08, 0.35),
        "base_noise": 0.02,
        "weights": {"control": -0.05},
    },
    "leaper": {
        "target_velocity": 0.6,
        "velocity_band": 0.4,
        "gait_frequency": 1.2,
        "phase_offsets": _TROT,
        "stance_threshold": 0.08,
        "healthy_range": (0.2, 1.0),
        "base_noise": 0.1,
        "weights": {"control": -0.1},
    },
}


class Settings(NamedTuple):
    """What a walk is made of, beside the body.

    Attributes:
        parameters: what the reward's terms read.
        weights: signed weight of every term.
        base_noise: of a reset: half-width of the uniform noise on the torso's position (m) and
            quaternion, and standard deviation of the torso's velocity (m/s, rad/s).
        joint_noise: the same for joint angles (rad) and joint velocities (rad/s).
    """

    parameters: terms.Parameters
    weights: dict[str, float]
    base_noise: float
    joint_noise: float


def settings(body: Body, overrides: Mapping[str, Any]) -> Settings:
    """The settings of a body, some of them overridden.

    Args:
        body: a robot of the table, or any other body, whose numbers are fitted to it.
        overrides: fields of `terms.Parameters`, "base_noise", "joint_noise", "weights", a
            mapping of the terms to change, and "gait", a name of `gaits.NAMES`, which sets the
            duty factor and the phase offsets that are not set themselves.

    Returns:
        The settings, checked.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it.
    """
    row = SETTINGS.get(body.name) if ROBOTS.get(body.name) == body else None
    table = COMMON | {"weights": {}} | (fitted_settings(body) if row is None else row)
    for name in overrides:
        checks.name(name, [*table, "gait"], "setting of walk")
    if overrides.get("gait") is not None:
        gait = gaits.gait(body, overrides["gait"])
        offsets = tuple(2.0 * math.pi * offset for offset in gait.offsets)
        table |= {"duty_factor": gait.duty_factor, "phase_offsets": offsets}
    weights, changed = WEIGHTS | table["weights"], overrides.get("weights") or {}
    if not isinstance(changed, Mapping):
        raise ValueError(f"weights: expected a mapping of names to numbers, got {changed!r}")
    for name, weight in changed.items():
        weights[checks.name(name, WEIGHTS, "weight")] = _number(f"weights[{name!r}]", weight)
    values = table | dict(overrides)
    numbers = {
        name: _number(name, values[name], low, high)
        for name, low, high in (
            ("target_velocity", -math.inf, math.inf),
            ("velocity_band", 1e-9, math.inf),
            ("gait_frequency", 0.0, math.inf),
            ("duty_factor", 0.0, 1.0),
            ("stance_threshold", -math.inf, math.inf),
        )
    }
    parameters = terms.Parameters(
        **numbers,
        phase_offsets=_array("phase_offsets", values["phase_offsets"], len(body.legs)),
        healthy_range=_healthy_range(values["healthy_range"]),
        default_angles=_array("default_angles", values["default_angles"], len(body.joint_names)),
    )
    noise = {name: _number(name, values[name], 0.0, math.inf) for name in ("base_noise", "joint_noise")}
    return Settings(parameters, weights, **noise)


def _number(name: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not real or not math.isfinite(value) or not low <= value <= high:
        raise ValueError(f"{name}: expected a finite number from {low:g} to {high:g}, got {value!r}")
    return float(value)


def _array(name: str, value: Any, size: int) -> np.ndarray:
    array = np.asarray(value)
    if array.dtype.kind not in "if" or array.shape not in ((), (size,)) or not np.isfinite(array).all():
        raise ValueError(f"{name}: expected one finite number or {size} of them, got {value!r}")
    return np.broadcast_to(array, size).astype(float)


def _healthy_range(value: Any) -> tuple[float, float]:
    low, high = _array("healthy_range", value, 2)
    if not low < high:
        raise ValueError(f"healthy_range: expected low < high, got {value!r}")
    return float(low), float(high)


def initial_state(qpos0: np.ndarray, nv: int, settings: Settings, random: np.random.RandomState):
    """Draws the state in which an episode starts.

    Args:
        qpos0: (nq,) the standing pose: torso position and quaternion, then joint angles.
        nv: number of velocities.
        settings: of the walk, for the noise.
        random: what to draw from.

    Returns:
        qpos (nq,) and qvel (nv,).
    """
    base, joint = settings.base_noise, settings.joint_noise
    joints = nv - 6
    qpos = qpos0 + np.concatenate([random.uniform(-base, base, 7), random.uniform(-joint, joint, joints)])
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    qvel = np.concatenate([base * random.standard_normal(6), joint * random.standard_normal(joints)])
    return qpos, qvel


class Walk(control.Task):
    """Walking, as a dm_control task: glue between a simulation and its `Walker`.

    Attributes:
        body: what walks.
        settings: the numbers.
        layout: where the body lies in the simulation.
        visualize_reward: whether rendered pictures show the reward as a colour.
    """

    def __init__(self, body: Body, settings: Settings, physics: Physics, random=None, on_divergence: str = "raise"):
        """Prepares to walk.

        Args:
            body: what walks.
            settings: the numbers.
            physics: the simulation of the body; only its model is read here.
            random: a `RandomState`, or what one is seeded with.
            on_divergence: what a step does whose physics diverges: "raise" an error, or "terminate"
                the episode with reward 0.

        Raises:
            ValueError: an unknown `on_divergence`, or not a seed.
        """
        self.body = body
        self.settings = settings
        self.visualize_reward = False
        if not isinstance(random, np.random.RandomState):
            random = np.random.RandomState(None if random is None else checks.seed(random))
        self._random = random
        self.layout = layout(physics.model.ptr, body.joint_names, body.part_names, body.foot_names)
        self._on_divergence = checks.name(on_divergence, ("raise", "terminate"), "on_divergence")
        self._walker = self.walker(physics)

    def walker(self, physics, rows: tuple[int, ...] = ()) -> Walker:
        """What remembers the course of this walk, or of a batch of such walks with leading axes `rows`."""
        return Walker(self.settings, self.layout, SUBSTEPS * physics.timestep(), physics.model.nu, rows)

    @property
    def random(self) -> np.random.RandomState:
        """What resets draw from."""
        return self._random

    @property
    def terms(self) -> dict[str, float]:
        """The ten unweighted terms of the latest reward by name; empty before the first step."""
        return self._walker.terms

    @property
    def phase(self) -> float:
        """Of the gait clock at the latest step, rad in [0, 2 pi)."""
        return self._walker.phase

    def action_spec(self, physics):
        """One control in [-1, 1] for each motor."""
        return mujoco.action_spec(physics)

    def initialize_episode(self, physics):
        """Puts the body on its feet, with noise, and the gait clock at 0."""
        data = physics.data.ptr
        data.qpos[:], data.qvel[:] = self.initial_state(physics, self._random)
        physics.shown_reward = None
        self._walker.restart()

    def initial_state(self, physics, random: np.random.RandomState):
        """Draws the state in which an episode starts; see the function `initial_state`."""
        return initial_state(physics.model.ptr.qpos0, physics.model.nv, self.settings, random)

    def before_step(self, action, physics):
        """Applies the action, clipped to [-1, 1].

        Raises:
            ValueError: the action has another shape or holds NaN; nothing has changed then.
        """
        self._walker.before_step(action, physics.data.ptr)

    def after_step(self, physics):
        """Advances the gait clock, measures the step's progress and takes the readings.

        Raises:
            PhysicsError: the physics diverged and is not to terminate the episode; one line that
                names robot, time and cause.
        """
        if physics.divergence is not None and self._on_divergence == "raise":
            raise control.PhysicsError(f"{self.body.name}: {physics.divergence}")
        self._walker.after_step(physics.data.ptr)

    def get_observation(self, physics):
        """The four blocks; see `Walker.observation`."""
        return self._walker.observation(physics.data.ptr)

    def get_reward(self, physics):
        """The weighted sum of the ten terms, which stay in `terms`."""
        reward = self._walker.reward(physics.data.ptr, None if physics.divergence is None else True)
        if self.visualize_reward:
            physics.shown_reward = reward / (terms.greatest(self.settings.weights) or 1.0)
        return reward

    def get_termination(self, physics):
        """0 when the torso's height has left its healthy range or the physics has diverged, else None."""
        failed = physics.divergence is not None or self._walker.fallen(physics.data.ptr)
        return 0.0 if failed else None


def walk(
    body: Body,
    time_limit: float | None = None,
    random=None,
    on_divergence: str = "raise",
    environment_kwargs=None,
    **overrides,
):
    """An environment in which the body walks.

    Args:
        body: any body.
        time_limit: s, may be infinite; None for 1000 control steps.
        random: a `RandomState`, or what one is seeded with.
        on_divergence: "raise" or "terminate"; see `Walk`.
        environment_kwargs: `flat_observation`, to get one vector in place of the blocks.
        **overrides: of `settings`.

    Returns:
        A `control.Environment`.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it.
    """
    chosen = settings(body, overrides)
    if time_limit is None:
        time_limit = (HORIZON - 0.5) * control_timestep(body)  # half a step short, so that rounding adds no step
    elif time_limit != math.inf:
        time_limit = _number("time_limit", time_limit, 1e-9)
    for name in environment_kwargs or {}:
        checks.name(name, ["flat_observation"], "environment setting")
    physics = Physics.from_body(body)
    task = Walk(body, chosen, physics, random, on_divergence)
    # legacy_step would move the contact forces and foot heights one substep on.
    return control.Environment(
        physics, task, time_limit, n_sub_steps=SUBSTEPS, legacy_step=False, **(environment_kwargs or {})
    )
