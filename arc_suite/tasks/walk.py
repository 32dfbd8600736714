"""Walk: forward at the target speed, in the prescribed gait, for 50 seconds (the paper's Section 4)."""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, robots
from arc_suite.robots import gaits, mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors, modifiers, terms
from arc_suite.tasks.clock import TWO_PI, Clock
from arc_suite.tasks.contract import Inputs, Start, Task
from arc_suite.tasks.fitting import fitted_noise, fitted_settings
from arc_suite.tasks.mirrors import AXIAL, POLAR, QUATERNION, SAME, Mirror
from arc_suite.tasks.readings import Readings, component
from arc_suite.tasks.terms import Parameters

# Signed weights of the ten terms (Section 4), the same for all robots but for "control".
BONUSES = {"forward": 1.5, "healthy": 1.0, "gait_bonus": 1.5}
COSTS = {
    "gait_cost": -0.1,
    "control": -0.05,
    "smoothness": -0.02,
    "contact": -0.0005,
    "angular_velocity": -0.05,
    "vertical_velocity": -0.02,
    "posture": -0.001,
}

# What a robot does not set itself.
COMMON = {"duty_factor": 0.6, "default_angles": 0.0, "weights": {}}

# One number for several kinds of noise, whatever their units, as published: name -> the settings that it sets.
SHARED_NOISE = {
    "base_noise": ("position_noise", "orientation_noise", "linear_velocity_noise", "angular_velocity_noise"),
    "joint_noise": ("joint_angle_noise", "joint_velocity_noise"),
}
_LARGEST = 1e6  # that a setting may be, in its unit: far beyond sense, and finite when squared and summed up

_TRIPOD, _TROT = (tuple(TWO_PI * offset for offset in offsets) for offsets in (gaits.TRIPOD, gaits.TROT))

# The numbers of task x robot: units as in `Parameters` and `Settings`.
SETTINGS = {
    "queen": {
        "target_velocity": 0.5,
        "velocity_band": 0.3,
        "gait_frequency": 1.5,
        "phase_offsets": _TRIPOD,
        "stance_threshold": 0.12,
        "healthy_range": (0.25, 1.2),
        "base_noise": 0.02,
        "joint_noise": 0.1,
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
        "joint_noise": 0.1,
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
        "joint_noise": 0.1,
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
        "joint_noise": 0.1,
        "weights": {"control": -0.1},
    },
}


class Noise(NamedTuple):
    """Noise of a walk's start: half-widths where it is uniform, of poses; standard deviations of velocities.

    Attributes:
        position_noise: of the torso, half-width, m.
        orientation_noise: of the components of the torso's quaternion, half-width.
        linear_velocity_noise: of the torso, standard deviation, m/s.
        angular_velocity_noise: of the torso, standard deviation, rad/s.
        joint_angle_noise: half-width, rad.
        joint_velocity_noise: standard deviation, rad/s.
    """

    position_noise: float
    orientation_noise: float
    linear_velocity_noise: float
    angular_velocity_noise: float
    joint_angle_noise: float
    joint_velocity_noise: float


class Settings(NamedTuple):
    """What a walk is made of, beside the body.

    Attributes:
        parameters: what the reward's terms read.
        weights: signed weight of every term.
        noise: of the start.
    """

    parameters: Parameters
    weights: dict[str, float]
    noise: Noise


NAMES = (*Parameters._fields, *SHARED_NOISE, *Noise._fields, "weights", "gait")  # of settings that may be overridden


def settings(body: Body, overrides: Mapping[str, Any], bonuses: Mapping[str, float] = BONUSES) -> Settings:
    """Return the settings of a body, some of them overridden.

    Args:
        body: a robot of the table, or any other body, whose numbers are fitted to it.
        overrides: fields of `Parameters` and of `Noise`; "base_noise", one number for those of the
            torso, and "joint_noise", one for those of the joints, where they are not set
            themselves; "weights", a mapping of the terms to change; and "gait", a name of
            `gaits.NAMES`, which sets the duty factor and the phase offsets likewise.
        bonuses: weights of a task that has other bonuses beside walk's costs.

    Returns:
        The settings, checked.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it.
    """
    row = robots.row(SETTINGS, body, "walk")
    table = COMMON | {"weights": {}} | (fitted_settings(body) if row is None else row)
    for name in overrides:
        checks.name(name, NAMES, "setting of walk", near=("time_limit", "arena", *modifiers.NAMES))
    if overrides.get("gait") is not None:
        gait = gaits.gait(body, overrides["gait"])
        offsets = tuple(TWO_PI * offset for offset in gait.offsets)
        table |= {"duty_factor": gait.duty_factor, "phase_offsets": offsets}
    weights = _changed({**bonuses, **COSTS, **table["weights"]}, overrides.get("weights"))
    # What sets no noise has it fitted to the body.
    values = fitted_noise(body) | _spread(table) | _spread(overrides)
    numbers = {
        name: checks.number(name, values[name], low, high)
        for name, low, high in (
            ("target_velocity", -_LARGEST, _LARGEST),
            ("velocity_band", 1e-9, _LARGEST),
            ("gait_frequency", 0.0, _LARGEST),
            ("duty_factor", 0.0, 1.0),
            ("stance_threshold", -_LARGEST, _LARGEST),
        )
    }
    parameters = Parameters(
        **numbers,
        phase_offsets=checks.array("phase_offsets", values["phase_offsets"], len(body.legs)),
        healthy_range=_healthy_range(values["healthy_range"]),
        default_angles=checks.array("default_angles", values["default_angles"], len(body.joint_names)),
    )
    noise = Noise(*(checks.number(name, values[name], 0.0, _LARGEST) for name in Noise._fields))
    return Settings(parameters, weights, noise)


def _spread(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with every number of `SHARED_NOISE` written out as those that it sets and that are not given."""
    spread = dict(values)
    for shared, names in SHARED_NOISE.items():
        if shared in spread:
            number = checks.number(shared, spread.pop(shared), 0.0, _LARGEST)
            spread = dict.fromkeys(names, number) | spread
    return spread


def _changed(weights: dict[str, float], changed: Any) -> dict[str, float]:
    """The weights, some of them changed."""
    if not isinstance(changed, Mapping | None):
        raise ValueError(f"weights: expected a mapping of names to numbers, got {changed!r}")
    for name, weight in (changed or {}).items():
        weights[checks.name(name, weights, "weight")] = checks.number(f"weights[{name!r}]", weight, -_LARGEST, _LARGEST)
    return weights


def _healthy_range(value: Any) -> tuple[float, float]:
    low, high = checks.array("healthy_range", value, 2)
    if not low < high:
        raise ValueError(f"healthy_range: expected low < high, got {value!r}")
    return float(low), float(high)


def initial_state(qpos0: np.ndarray, nv: int, settings: Settings, random: np.random.RandomState):
    """Draw the state in which an episode starts.

    Args:
        qpos0: (nq,) the standing pose: torso position and quaternion, then joint angles.
        nv: number of velocities.
        settings: of the walk, for the noise.
        random: what to draw from.

    Returns:
        qpos (nq,) and qvel (nv,).
    """
    position, orientation, linear, angular, angle, joint_velocity = settings.noise
    widths = np.repeat((position, orientation, angle), (3, 4, nv - 6))
    qpos = qpos0 + random.uniform(-widths, widths)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    return qpos, np.repeat((linear, angular, joint_velocity), (3, 3, nv - 6)) * random.standard_normal(nv)


class Memory(NamedTuple):
    """What a walk remembers of its episode.

    Attributes:
        tick: (...) control steps since the start.
        action: (..., joints) of the latest step, clipped to [-1, 1].
        previous_action: (..., joints) of the step before; 0 before the first.
        x: (...) of the torso's frame in the world at the latest reading, m.
        forward_velocity: (...) mean of the torso's world x velocity over the latest step, m/s.
        wrong_feet: (...) number of feet that are on the ground and should not be, or the reverse.
        distance: (...) along world x since the start, m.
        wrong_in_all: (...) sum of `wrong_feet` over the steps.
    """

    tick: int | np.ndarray
    action: np.ndarray
    previous_action: np.ndarray
    x: np.ndarray
    forward_velocity: np.ndarray
    wrong_feet: np.ndarray
    distance: np.ndarray
    wrong_in_all: np.ndarray


class Walk(Task):
    """Walking forward at the target speed in the prescribed gait."""

    name = "walk"
    bonuses = BONUSES

    @classmethod
    def fitted(cls, body: Body, overrides: Mapping[str, Any]) -> Settings:
        """Return the settings for a body; see the function `settings`."""
        return settings(body, overrides, cls.bonuses)

    @functools.cached_property
    def blocks(self) -> Mapping[str, int]:
        """posture, velocities, contact_forces and gait_clock, in the paper's order (Section 3)."""
        body = self.scene.body
        joints, parts = len(body.joint_names), len(body.part_names)
        return {"posture": 5 + joints, "velocities": 6 + joints, "contact_forces": 6 * parts, "gait_clock": 2}

    @property
    def mirrors(self) -> Mapping[str, Mirror]:
        """Of a gait whose sides take turns, the mirrored clock is half a cycle later: its sine and cosine change sign.

        Raises:
            ValueError: the body, the gait or the angles of the posture are not the same on both sides; one line.
        """
        image = mirror.image(self.scene.body)
        joints, default = mirrors.joints(image), self.parameters.default_angles
        if not np.allclose(joints(default), default):
            raise ValueError("default_angles: expected mirrored poses left and right")
        return {
            "posture": mirrors.joined([SAME, QUATERNION, joints]),
            "velocities": mirrors.joined([POLAR, AXIAL, joints]),
            "contact_forces": mirrors.of_each(image.parts, mirrors.joined([AXIAL, POLAR])),
            "gait_clock": self._mirrored_clock(image.legs),
        }

    def _mirrored_clock(self, across: np.ndarray) -> Mirror:
        offsets = self.parameters.phase_offsets
        for sign in (1, -1):  # of the clock's sine and cosine, whose leads over the legs across are 0 or half a cycle
            if np.allclose(np.exp(1j * offsets[across]), sign * np.exp(1j * offsets)):
                return Mirror.signed(sign, sign)
        raise ValueError("phase_offsets: expected legs across from each other to move together, or half a cycle apart")

    @functools.cached_property
    def clock(self) -> Clock:
        """The clock of the prescribed gait."""
        p = self.parameters
        return Clock.made(
            p.gait_frequency, p.duty_factor, p.phase_offsets, self.scene.control_timestep, self.step_limit
        )

    @property
    def parameters(self) -> Parameters:
        """The numbers that terms read."""
        return self.settings.parameters

    @property
    def target_velocity(self) -> float | None:
        """The target velocity, m/s."""
        return self.parameters.target_velocity

    def start(self, random: np.random.RandomState, carry: Any) -> Start:
        """Draw the state: the standing pose, with noise. The clock starts at 0, with no action before."""
        joints = len(self.scene.body.joint_names)
        qpos, qvel = initial_state(self.scene.standing, 6 + joints, self.settings, random)
        still, zero = np.zeros(joints), np.float64(0.0)
        return Start(qpos, qvel, Memory(0, still, still, zero, zero, zero, zero, zero))

    def begin(self, memory: Memory, readings: Readings) -> Memory:
        """Take down where the torso's frame stands."""
        return memory._replace(x=component(readings.frame_position, 0) + 0.0)  # not a view

    def before(self, memory: Memory, action) -> tuple[Memory, Inputs]:
        """Take down the action, which is applied as it is."""
        return memory._replace(action=action, previous_action=memory.action), Inputs(action)

    def after(self, memory: Memory, readings: Readings) -> Memory:
        """Advance the clock, and measure the step's progress and which feet were wrong."""
        tick = memory.tick + 1
        return self.measured(memory, readings, tick, self.clock.at(self.clock.stance, tick))

    def measured(self, memory: Memory, readings: Readings, tick, stance) -> Memory:
        """Return the memory after a step, given the clock's tick (...) and the feet that are to stand (..., feet)."""
        x = component(readings.frame_position, 0) + 0.0
        way = x - memory.x
        on_ground = readings.foot_heights < self.parameters.stance_threshold
        wrong_feet = (on_ground != stance).sum(axis=-1, dtype=float)
        return memory._replace(
            tick=tick,
            x=x,
            forward_velocity=way / self.scene.control_timestep,
            wrong_feet=wrong_feet,
            distance=memory.distance + way,
            wrong_in_all=memory.wrong_in_all + wrong_feet,
        )

    def terms(self, memory: Memory, readings: Readings) -> dict:
        """Return the paper's ten terms."""
        return terms.terms(readings, memory, self.parameters)

    def observe(self, memory: Memory, readings: Readings) -> dict:
        """Return the paper's observation."""
        return {
            "posture": readings.posture,
            "velocities": readings.velocities,
            "contact_forces": readings.contact_forces,
            "gait_clock": self.clock.at(self.clock.circle, memory.tick),
        }

    def ended(self, memory: Memory, readings: Readings) -> tuple:
        """Return as terminated whose torso has left its healthy range; none is truncated."""
        return ~terms.healthy(readings.torso_height, self.parameters), False

    def progress(self, memory: Memory) -> dict:
        """Return the mean forward `speed`, m/s, and `gait_compliance`, the mean share of feet as prescribed."""
        steps = memory.tick + (memory.tick == 0)
        return {
            "speed": memory.distance / (steps * self.scene.control_timestep),
            "gait_compliance": 1.0 - memory.wrong_in_all / (steps * len(self.parameters.phase_offsets)),
        }
