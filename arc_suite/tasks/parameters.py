"""Parameters of tasks: of the four robots as published, of any other body fitted to it, and what a caller overrides."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, robots
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import modifiers
from arc_suite.tasks.clock import TWO_PI
from arc_suite.tasks.fitting import fitted_noise, fitted_parameters

# What the parameters of a robot may leave out.
COMMON = {"duty_factor": 0.6, "default_angles": 0.0, "weights": {}}

# One number for several kinds of noise, whatever their units, as published: name -> the settings that it sets.
SHARED_NOISE = {
    "base_noise": ("position_noise", "orientation_noise", "linear_velocity_noise", "angular_velocity_noise"),
    "joint_noise": ("joint_angle_noise", "joint_velocity_noise"),
}
LARGEST = 1e6  # bound of a setting, in its unit: far beyond sense, and finite when squared and summed up

_TRIPOD, _TROT = (tuple(TWO_PI * offset for offset in offsets) for offsets in (gaits.TRIPOD, gaits.TROT))

# Of walk by robot; units as in `Parameters`, `Noise` and `walk.WalkSettings`.
_WALK = {
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

# By task, then by robot; what a task has no entry for is walk's.
PARAMETERS = {"walk": _WALK}


class Parameters(NamedTuple):
    """The gait that a task prescribes, and the speed that belongs to it.

    Attributes:
        target_velocity: speed that belongs to the gait, m/s.
        gait_frequency: frequency of the gait's clock, Hz.
        duty_factor: share of a cycle that a foot spends in stance.
        phase_offsets: (feet,) added to the clock's phase, rad.
        stance_threshold: height below which a foot is in stance, m.
        default_angles: (joints,) angles from which the posture is measured, rad.
    """

    target_velocity: float
    gait_frequency: float
    duty_factor: float
    phase_offsets: np.ndarray
    stance_threshold: float
    default_angles: np.ndarray

    @property
    def feet(self) -> int:
        """Number of feet."""
        return self.phase_offsets.shape[-1]


class Noise(NamedTuple):
    """Noise of the start: half-widths of uniform noise on the pose, standard deviations of velocities.

    Attributes:
        position_noise: half-width of the torso's position, m.
        orientation_noise: half-width of the components of the torso's quaternion.
        linear_velocity_noise: standard deviation of the torso's velocity, m/s.
        angular_velocity_noise: standard deviation of the torso's angular velocity, rad/s.
        joint_angle_noise: half-width of joint angles, rad.
        joint_velocity_noise: standard deviation of joint velocities, rad/s.
    """

    position_noise: float
    orientation_noise: float
    linear_velocity_noise: float
    angular_velocity_noise: float
    joint_angle_noise: float
    joint_velocity_noise: float

    def drawn(self, standing: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
        """Draw the state in which an episode starts: the standing pose with this noise.

        Args:
            standing: (nq,) torso position and quaternion, then joint angles.
            random: to draw from.

        Returns:
            qpos (nq,) and qvel (nq - 1,).
        """
        joints = len(standing) - 7
        widths = np.repeat((self.position_noise, self.orientation_noise, self.joint_angle_noise), (3, 4, joints))
        qpos = standing + random.uniform(-widths, widths)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        deviations = self.linear_velocity_noise, self.angular_velocity_noise, self.joint_velocity_noise
        return qpos, np.repeat(deviations, (3, 3, joints)) * random.standard_normal(6 + joints)


# Settings that every task with a gait has.
NAMES = (*Parameters._fields, *SHARED_NOISE, *Noise._fields, "weights", "gait")

LEAST_SPEED = 0.001  # m/s; paths and speeds are divided by the target velocity

BOUNDS = {
    "target_velocity": (-1000.0, 1000.0),
    "gait_frequency": (0.001, 1000.0),
    "duty_factor": (0.0, 1.0),
    "phase_offsets": (-TWO_PI, TWO_PI),
    "stance_threshold": (-LARGEST, LARGEST),
    "default_angles": (-TWO_PI, TWO_PI),
    "position_noise": (0.0, 1000.0),
    "orientation_noise": (0.0, 10.0),
    "linear_velocity_noise": (0.0, 1000.0),
    "angular_velocity_noise": (0.0, 1000.0),
    "joint_angle_noise": (0.0, TWO_PI),
    "joint_velocity_noise": (0.0, 1000.0),
}
BOUNDS |= {shared: (0.0, min(BOUNDS[name][1] for name in names)) for shared, names in SHARED_NOISE.items()}


def values(body: Body, overrides: Mapping[str, Any], task: str, names: Iterable[str], elsewhere=()) -> dict[str, Any]:
    """Return the value of every setting by name: the body's own, and in their place what the caller overrides.

    Args:
        body: a robot of `PARAMETERS`, or any other body, to which they are fitted.
        overrides: settings by name; "base_noise" and "joint_noise" set several kinds of noise, "gait", a name
            of `gaits.NAMES`, the duty factor and the phase offsets, each where that is not set itself.
        task: its name, for errors.
        names: of the settings that the task has.
        elsewhere: names that `load` takes and the task does not see, for suggestions.

    Raises:
        ValueError: an unknown name, or a gait that does not fit the body.
    """
    for name in overrides:
        checks.name(name, names, f"setting of {task}", suggestions=("time_limit", *elsewhere, *modifiers.MODIFIERS))
    own = robots.parameters(PARAMETERS["walk"], body, "walk")
    table = COMMON | (fitted_parameters(body) if own is None else own)
    table |= robots.parameters(PARAMETERS.get(task, {}), body, task) or {}
    if overrides.get("gait") is not None:
        gait = gaits.gait(body, overrides["gait"])
        offsets = tuple(TWO_PI * offset for offset in gait.offsets)
        table |= {"duty_factor": gait.duty_factor, "phase_offsets": offsets}
    weights = {"weights": table["weights"]}  # a caller's weights change some of them: see `weights`
    return fitted_noise(body) | _spread(table) | _spread(overrides) | weights


def _spread(given: Mapping[str, Any]) -> dict[str, Any]:
    """Write every number of `SHARED_NOISE` out as the settings that it sets and that are not given."""
    spread = dict(given)
    for shared, names in SHARED_NOISE.items():
        if shared in spread:
            number = checks.number(shared, spread.pop(shared), *BOUNDS[shared])
            spread = dict.fromkeys(names, number) | spread
    return spread


def parameters(body: Body, given: Mapping[str, Any], backward: bool = True) -> Parameters:
    """Return checked parameters from the values of all settings by name.

    Args:
        body: that has them.
        given: values by name.
        backward: whether the target velocity may be negative.

    Raises:
        ValueError: a value that does not fit the body or its bounds.
    """
    sizes = {"phase_offsets": len(body.legs), "default_angles": len(body.joint_names)}
    arrays = {name: checks.array(name, given[name], size, *BOUNDS[name]) for name, size in sizes.items()}
    low, high = BOUNDS["target_velocity"]
    speed = checks.number("target_velocity", given["target_velocity"], low if backward else LEAST_SPEED, high)
    if abs(speed) < LEAST_SPEED:
        raise ValueError(
            f"target_velocity: expected at least {LEAST_SPEED:g} m/s in either direction, got {checks.preview(speed)}"
        )
    names = [name for name in Parameters._fields if name not in (*sizes, "target_velocity")]
    numbers = {name: checks.number(name, given[name], *BOUNDS[name]) for name in names}
    return Parameters(target_velocity=speed, **numbers, **arrays)


def noise(given: Mapping[str, Any]) -> Noise:
    """Return checked noise from the values of all settings by name.

    Raises:
        ValueError: a negative value.
    """
    return Noise(*(checks.number(name, given[name], *BOUNDS[name]) for name in Noise._fields))


def positive(name: str, value: Any) -> float:
    """Return a checked number above 0.

    Raises:
        ValueError: it is not.
    """
    return checks.number(name, value, 1e-9, LARGEST)


def weights(of_task: Mapping[str, float], of_body: Mapping[str, float] = {}, changed: Any = None) -> dict[str, float]:
    """Return the weights of all terms: the task's, of which the body and then the caller replace some.

    Raises:
        ValueError: an unknown term, or a weight that is no finite number.
    """
    if not isinstance(changed, Mapping | None):
        raise ValueError(f"weights: expected a mapping of names to numbers, got {checks.preview(changed)}")
    found = {name: of_body.get(name, weight) for name, weight in of_task.items()}
    for name, weight in (changed or {}).items():
        found[checks.name(name, found, "weight")] = checks.number(f"weights[{name!r}]", weight, -LARGEST, LARGEST)
    return found
