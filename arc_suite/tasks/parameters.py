"""Parameters of tasks: published ones of the four robots, fitted ones of other bodies, and overrides by a caller."""

import warnings
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, robots
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import modifiers
from arc_suite.tasks.clock import TWO_PI
from arc_suite.tasks.fitting import fitted_noise, fitted_parameters

# Parameters that a robot may leave out.
DEFAULTS = {"duty_factor": 0.6, "default_angles": 0.0, "weights": {}}

# One number for several kinds of noise, whatever their units, as published: name -> the settings that it sets.
SHARED_NOISE = {
    "base_noise": ("position_noise", "orientation_noise", "linear_velocity_noise", "angular_velocity_noise"),
    "joint_noise": ("joint_angle_noise", "joint_velocity_noise"),
}
LARGEST = 1e6  # bound of a setting, in its unit; sums of its square are finite

_TRIPOD = tuple(TWO_PI * offset for offset in gaits.TRIPOD)  # rad
_TROT = tuple(TWO_PI * offset for offset in gaits.TROT)  # rad

# Parameters of walk by robot; units as in `Parameters`, `Noise` and `walk.WalkSettings`.
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

# By task, then by robot. Parameters that are not here are those of walk.
PARAMETERS = {"walk": _WALK}


class Parameters(NamedTuple):
    """The gait that a task prescribes, and the speed that belongs to it.

    Attributes:
        target_velocity: speed at which a body in the gait is to walk, m/s.
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
    """Noise of the start: half-widths of uniform noise on the pose, standard deviations of normal noise on velocities.

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

    def draw(self, standing: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
        """Draw the state in which an episode starts: the standing pose with this noise.

        Args:
            standing: (nq,) torso position and quaternion, then joint angles.
            random: the random generator.

        Returns:
            qpos (nq,) and qvel (nq - 1,).
        """
        joints = len(standing) - 7
        widths = np.repeat((self.position_noise, self.orientation_noise, self.joint_angle_noise), (3, 4, joints))
        qpos = standing + random.uniform(-widths, widths)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        deviations = (self.linear_velocity_noise, self.angular_velocity_noise, self.joint_velocity_noise)
        qvel = np.repeat(deviations, (3, 3, joints)) * random.standard_normal(6 + joints)
        return qpos, qvel


# Settings that every task with a gait has.
NAMES = (*Parameters._fields, *SHARED_NOISE, *Noise._fields, "weights", "gait")

POSITIVE = (1e-9, LARGEST)  # lowest and highest number above 0
MIN_SPEED = 0.001  # m/s, of a target velocity, as paths and speeds are divided by it

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
# What other libraries call the height of a foot in mid-swing.
_NAMES_OF_STEP_HEIGHT = ("clearance", "foot_clearance", "foot_height", "lift", "step_height", "swing_height")
_STEP_HEIGHT_CURE = "no setting lifts feet, the preset surefooted does: docs/clips.md: paces"
BOUNDS |= {shared: (0.0, min(BOUNDS[name][1] for name in names)) for shared, names in SHARED_NOISE.items()}


def values(
    body: Body, overrides: Mapping[str, Any], task: str, names: Iterable[str], names_of_others: Iterable[str] = ()
) -> dict[str, Any]:
    """Return the value of every setting by name: that of the caller, or else that of the body.

    Args:
        body: a robot of `PARAMETERS`, or any other body, to which values are fitted.
        overrides: settings of the caller, by name. "base_noise" and "joint_noise" set several kinds of noise; "gait", a
            name of `gaits.NAMES`, sets the duty factor and the phase offsets. A setting under its own name prevails.
        task: its name, for errors.
        names: names of the settings that the task has.
        names_of_others: names of settings that are not the task's, to suggest in errors.

    Raises:
        ValueError: an unknown name, or a gait that does not fit the body.
    """
    suggestions = ("time_limit", "random", *names_of_others, *modifiers.MODIFIERS)
    for name in overrides:
        if name in _NAMES_OF_STEP_HEIGHT:
            raise ValueError(f"unknown setting of {task} {checks.preview(name)}; {_STEP_HEIGHT_CURE}")
        checks.name(name, names, f"setting of {task}", suggestions=suggestions)
    published = robots.parameters(PARAMETERS["walk"], body, "walk")
    table = DEFAULTS | (fitted_parameters(body) if published is None else published)
    table |= robots.parameters(PARAMETERS.get(task, {}), body, task) or {}
    if overrides.get("gait") is not None:
        gait = gaits.gait(body, overrides["gait"])
        offsets = tuple(TWO_PI * offset for offset in gait.offsets)
        table |= {"duty_factor": gait.duty_factor, "phase_offsets": offsets}
    settings = fitted_noise(body) | _expand_shared_noise(table) | _expand_shared_noise(overrides)
    settings["weights"] = table["weights"]  # those of the caller replace some of them; see `weights`
    return settings


def _expand_shared_noise(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with each number of `SHARED_NOISE` as the settings that it sets; settings that are there stay."""
    expanded = dict(settings)
    for shared_name, names in SHARED_NOISE.items():
        if shared_name in expanded:
            number = checks.number(shared_name, expanded.pop(shared_name), *BOUNDS[shared_name])
            expanded = dict.fromkeys(names, number) | expanded
    return expanded


def parameters(body: Body, values: Mapping[str, Any], backward: bool = True) -> Parameters:
    """Return checked parameters from the values of all settings by name.

    Args:
        body: the body.
        values: values by name.
        backward: whether the target velocity may be negative.

    Raises:
        ValueError: a value that does not fit the body or its bounds.
    """
    sizes = {"phase_offsets": len(body.legs), "default_angles": len(body.joint_names)}
    arrays = {name: checks.array(name, values[name], size, *BOUNDS[name]) for name, size in sizes.items()}
    low, high = BOUNDS["target_velocity"]
    speed = checks.number("target_velocity", values["target_velocity"], low if backward else MIN_SPEED, high)
    if abs(speed) < MIN_SPEED:
        raise ValueError(
            f"target_velocity: expected at least {MIN_SPEED:g} m/s in either direction, got {checks.preview(speed)}"
        )
    names = [name for name in Parameters._fields if name not in (*sizes, "target_velocity")]
    numbers = {name: checks.number(name, values[name], *BOUNDS[name]) for name in names}
    return Parameters(target_velocity=speed, **numbers, **arrays)


def noise(values: Mapping[str, Any]) -> Noise:
    """Return checked noise from the values of all settings by name.

    Raises:
        ValueError: a negative value.
    """
    return Noise(*(checks.number(name, values[name], *BOUNDS[name]) for name in Noise._fields))


def positive(name: str, value: Any) -> float:
    """Return a checked number above 0.

    Raises:
        ValueError: it is not.
    """
    return checks.number(name, value, *POSITIVE)


def weights(of_task: Mapping[str, float], of_body: Mapping[str, float] = {}, changed: Any = None) -> dict[str, float]:
    """Return the weights of all terms: those of the task, some of which the body and then the caller replace.

    Warns:
        UserWarning: the caller's weight of a cost is positive.

    Raises:
        ValueError: an unknown term, or a weight that is no finite number.
    """
    if not isinstance(changed, Mapping | None):
        term, weight = next(iter(of_task.items()))
        example = f'such as {{"{term}": {weight:g}}}'
        raise ValueError(f"weights: expected a mapping of names to numbers, {example}, got {checks.preview(changed)}")
    weights_by_term = {name: of_body.get(name, weight) for name, weight in of_task.items()}
    for name, weight in (changed or {}).items():
        number = checks.number(f"weights[{name!r}]", weight, -LARGEST, LARGEST)
        checks.name(name, weights_by_term, "term of weights")
        if weights_by_term[name] < 0.0 < number:
            text = f"weights[{name!r}]: {number:g} makes a bonus of this cost; {-number:g} weighs it as a cost"
            warnings.warn(text, stacklevel=2)
        weights_by_term[name] = number
    return weights_by_term
