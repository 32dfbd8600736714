"""The spec of a legged body: frozen, validated data.

A `Body` is a torso, its ballast and its legs; a `Leg` is a chain of `Link`s that ends in a
`Foot`; a `Link` is rigid or turns about one motorized `Joint`. Lengths are meters, masses
kilograms, angles degrees (the only place where they are). Frames: x forward, y left, z up; a
child's origin is the end of the link before it, and a body stands with all joints at zero.

A body that was imported has a `source`, the MJCF that its physics follow. Its legs are then a sketch of
the source in its standing pose, from which all angles count.

Every class checks its own fields and raises `SpecError`, which names the field. This module needs only
the standard library.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import operator
import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, NoReturn, Self

Vector2 = tuple[float, float]
Vector = tuple[float, float, float]

DENSITY = 10.0  # kg/m^3, of the published robots
PALETTES = ("moss", "rust", "bone", "coral", "night")  # see `palettes.colors`
MAX_PALETTE_SEED = 2**31 - 1  # of colors that are drawn
MATERIALS = ("shell", "limb", "glow", "frame", "trim")  # of any body; a palette lists their colors in this order
COLORS_EXAMPLE = "#3a5f2b,#d8c48a"  # of colors as a palette

MAX_LENGTH = 100.0  # m; far above any creature, far below lengths at which MuJoCo becomes unstable
MAX_DISTANCE = 1e4  # m, of a camera; more than enough to see any body
MAX_NAME = 32  # characters
MAX_ALIAS = 100  # characters of a name in a foreign file
MAX_SOURCE = 1 << 21  # bytes of the MJCF of an imported body; of 38 files the largest has 430,000
_MIN_LENGTH = 1e-6  # m
_MIN_NORM = 1e-6  # of a vector that is a direction
_MAX_AXIS = 1e3  # of the numbers of a joint's axis, which has any length
_MAX_DENSITY = 1e9  # kg/m^3
_MIN_INERTIA = 1e-14  # kg m^2; MuJoCo's own bound is 1e-15
_MAX_LEGS = 64
_MAX_LINKS = 16  # of a leg
_MAX_SHAPES = 64  # solids of a torso, and as many shapes of ballast
_MAX_HELD_JOINTS = 256
_MAX_FILE_JOINTS = 1024
_FIELDS_WITHOUT_PHYSICS = ("name", "camera", "palette", "ornaments")  # of a body

# Bounds of motors and joints, in SI units. They lie beyond the results of sizing for all bodies within the other
# bounds, so that no error is about a number that sizing has computed.
_MIN_GEAR = 1e-20
_MAX_GEAR = 1e30
_MAX_JOINT_CONSTANT = 1e35  # of armature and damping
_MIN_SPEED = 1e-3  # rad/s, at which a motor gives no torque
_MAX_SPEED = 1e6  # rad/s, the same
_MAX_LOSS = 1e6  # W/(N m)^2
_MAX_TABLE = 64  # points of a table of torques
_MAX_TABLE_ERROR = 0.1  # of the nearest line from a table, in largest torques
_MAX_DELAY = 1.0  # s
_MAX_DELAY_SUBSTEPS = 1000

_COLOR_PATTERN = re.compile(r"[0-9a-f]{6}")
_NAME_PATTERN = re.compile(rf"[a-z0-9_]{{1,{MAX_NAME}}}")
_SIZE_COUNTS = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}  # numbers in `Solid.size`
_MAX_PREVIEW = 60  # characters of a value in an error


class SpecError(ValueError):
    """A spec that describes no valid body; the message names the field.

    Attributes:
        reason: what is wrong, without the field.
        field: name of the field; None if the reason is about no single field.
    """

    def __init__(self, reason: str, field: str | None = None, owner: str | None = None):
        """Word the message, `owner.field: reason`.

        Args:
            reason: see the class.
            field: see the class.
            owner: the spec that has the field, as a label or a path; None if unknown.
        """
        full_field = ".".join(part for part in (owner, field) if part)
        super().__init__(": ".join(part for part in (full_field, reason) if part))
        self.reason = reason
        self.field = field


# Checks of values. Each returns the value as specs store it, or raises SpecError.


def _check_name(value: Any) -> str:
    if not isinstance(value, str) or not _NAME_PATTERN.fullmatch(value):
        valid = re.sub(r"[\s-]+", "_", value.strip().lower()) if isinstance(value, str) else ""
        cure = f"; did you mean {valid!r}?" if _NAME_PATTERN.fullmatch(valid) else ""
        raise SpecError(f"expected 1 to {MAX_NAME} characters out of [a-z0-9_], got {_preview(value)}{cure}")
    return value


def _check_number(value: Any, low: float, high: float) -> float:
    is_real = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_real or not low <= value <= high:  # a comparison with NaN is false
        raise SpecError(f"expected a number from {low:g} to {high:g}, got {_preview(value)}")
    return float(value) + 0.0  # turns -0.0 into 0.0, so that equal specs give equal texts


def _check_vector(value: Any, size: int, low: float, high: float) -> tuple[float, ...]:
    if not isinstance(value, (tuple, list)) or len(value) != size:
        raise SpecError(f"expected {size} numbers, got {_preview(value)}")
    return tuple([_check_number(number, low, high) for number in value])


def _check_lengths(value: Any) -> tuple[float, ...]:
    if not isinstance(value, (tuple, list)) or not 1 <= len(value) <= 3:
        raise SpecError(f"expected 1 to 3 lengths, got {_preview(value)}")
    return tuple([_check_number(number, _MIN_LENGTH, MAX_LENGTH) for number in value])


def _check_choice(value: Any, choices: Iterable[str]) -> str:
    if value not in tuple(choices):
        raise SpecError(f"expected one of {', '.join(choices)}, got {_preview(value)}")
    return value


def _check_palette(value: Any) -> str | int:
    is_seed = isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_PALETTE_SEED
    is_palette = isinstance(value, str) and value in PALETTES
    if is_seed or is_palette:
        return value
    colors = nearest_colors(value)
    if colors is not None and colors == str(value).lower():
        return colors
    names = ", ".join(PALETTES)
    counted_colors = f"1 to {len(MATERIALS)} colors such as {COLORS_EXAMPLE}"
    suggestion = f"; did you mean {colors!r}?" if colors else ""
    raise SpecError(
        f"expected one of {names}, or a seed from 0 to {MAX_PALETTE_SEED}, or {counted_colors}, "
        f"got {_preview(value)}{suggestion}"
    )


def nearest_colors(value: Any) -> str | None:
    """Return the colors that a value writes, as `Body.palette` stores them; None if it writes none.

    Args:
        value: colors as in CSS, in a text or a list. They may lack `#` or commas, have semicolons, 3 digits or a
            transparency. Colors beyond the number of `MATERIALS` are left out.
    """
    texts = value if isinstance(value, (tuple, list)) else [value]
    if not all(isinstance(text, str) for text in texts):
        return None
    colors = []
    for word in ",".join(texts).lower().replace(",", " ").replace(";", " ").split()[: len(MATERIALS)]:
        digits = word.removeprefix("#").removeprefix("0x")
        if len(digits) in (3, 4):
            digits = "".join(2 * digit for digit in digits)
        if len(digits) == 8:
            digits = digits[:6]
        if not _COLOR_PATTERN.fullmatch(digits):
            return None
        colors.append(f"#{digits}")
    return ",".join(colors) or None


def _check_instance(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise SpecError(f"expected a {kind.__name__}, got {_preview(value)}")
    return value


def _check_items(value: Any, kind: type, low: int, high: int) -> tuple:
    if not isinstance(value, (tuple, list)):
        raise SpecError(f"expected a sequence of {kind.__name__}s, got {_preview(value)}")
    if not low <= len(value) <= high:
        raise SpecError(f"expected {low} to {high} {kind.__name__}s, got {len(value)}")
    return tuple([_check_instance(item, kind) for item in value])


def _check_text(value: Any, low: int, high: int) -> str:
    if not isinstance(value, str) or not low <= len(value) <= high:
        raise SpecError(f"expected a text of {low} to {high} characters, got {_preview(value)}")
    return value


def _check_texts(value: Any, high: int) -> tuple[str, ...]:
    if not isinstance(value, (tuple, list)) or len(value) > high:
        raise SpecError(f"expected a sequence of at most {high} texts, got {_preview(value)}")
    return tuple(_check_text(text, 1, MAX_ALIAS) for text in value)


def _check_torque_table(value: Any) -> tuple[Vector2, ...]:
    if not isinstance(value, (tuple, list)) or not 2 <= len(value) <= _MAX_TABLE:
        raise SpecError(f"expected 2 to {_MAX_TABLE} pairs of speed and torque, got {_preview(value)}")
    points: list[Any] = [_check_vector(pair, 2, 0.0, _MAX_GEAR) for pair in value]
    for (speed, _), (next_speed, _) in itertools.pairwise(points):
        if not speed < next_speed <= _MAX_SPEED:
            raise SpecError(f"expected rising speeds up to {_MAX_SPEED:g}, got {next_speed:g} after {speed:g}")
    return tuple(points)


def _check_integer(value: Any, low: int, high: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise SpecError(f"expected an integer from {low} to {high}, got {_preview(value)}")
    return value


def _check_boolean(value: Any) -> bool:
    if not isinstance(value, bool):
        raise SpecError(f"expected true or false, got {_preview(value)}")
    return value


def _preview(value: Any) -> str:
    """Return how errors show a value: the beginning of its `repr`, or its type."""
    has_short_repr = value is None or isinstance(value, (str, int, float, tuple, list))
    text = repr(value) if has_short_repr else f"a {type(value).__name__}"
    if len(text) <= _MAX_PREVIEW:
        return text
    return text[: _MAX_PREVIEW - 3] + "..."


# Fields of the dataclasses below.


def _field(check, *args, default=dataclasses.MISSING, optional=False):
    """Return a dataclass field whose value is `check(value, *args)`.

    Its metadata also say which spec the value is or contains: `kind`, and whether there are `many` in a tuple.

    Args:
        check: one of the checks above.
        *args: arguments of the check, after the value.
        default: default of the field.
        optional: whether None is valid without a check.
    """
    metadata = {"check": check, "args": args, "optional": optional}
    if check in (_check_instance, _check_items):
        metadata["kind"] = args[0]
        metadata["many"] = check is _check_items
    return dataclasses.field(default=default, metadata=metadata)


def _name_field(**kwargs):
    return _field(_check_name, **kwargs)


def _number_field(low: float, high: float, **kwargs):
    return _field(_check_number, low, high, **kwargs)


def _length_field(**kwargs):
    return _number_field(_MIN_LENGTH, MAX_LENGTH, **kwargs)


def _position_field(**kwargs):
    return _field(_check_vector, 3, -MAX_LENGTH, MAX_LENGTH, **kwargs)


class _Spec:
    """Base class of all specs: checks every field, then the conditions on several fields."""

    def __post_init__(self):
        self._check_fields(dataclasses.fields(self))
        self._check_conditions()

    def _check_fields(self, fields: Iterable[dataclasses.Field]) -> None:
        """Replace the values of fields by their checked values; raise SpecError for one that is not valid."""
        for field in fields:
            value = getattr(self, field.name)
            if value is None and field.metadata["optional"]:
                continue
            try:
                value = field.metadata["check"](value, *field.metadata["args"])
            except SpecError as error:
                raise SpecError(error.reason, field.name, self._label()) from None
            object.__setattr__(self, field.name, value)  # the dataclass is frozen

    def _check_conditions(self) -> None:
        """Raise SpecError if fields do not fit each other; subclasses with such conditions override this."""

    def _fail(self, field: str, reason: str) -> NoReturn:
        """Raise SpecError for a field."""
        raise SpecError(reason, field, self._label())

    def _label(self) -> str:
        """Return how errors call the spec: `Joint(hip)`, or its class alone if it has no valid name."""
        name = getattr(self, "name", None)
        kind = type(self).__name__
        return f"{kind}({name})" if isinstance(name, str) and _NAME_PATTERN.fullmatch(name) else kind

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed. The changed fields and all conditions are checked."""
        fields = {field.name: field for field in dataclasses.fields(self)}
        if not changes.keys() <= fields.keys():
            return dataclasses.replace(self, **changes)  # raises the error of an unknown field
        copy = object.__new__(type(self))
        for name in fields:
            value = changes[name] if name in changes else getattr(self, name)
            object.__setattr__(copy, name, value)
        copy._check_fields([fields[name] for name in changes])  # `self` has checked the other fields
        copy._check_conditions()
        return copy


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Drive(_Spec):
    """What motors and servos have in common.

    The torque that drives a joint is at most `stall` at rest and falls to 0 at `no_load_speed`, as that of a motor at a
    constant voltage. It is never above the largest torque. A motor that is turned faster brakes.

    Attributes:
        no_load_speed: speed of the joint at which its motor gives no torque, rad/s; None: torques fall at no speed.
        stall: torque at rest without the limit of the largest torque, N m; None: the largest torque.
        torque_by_speed: pairs of speed, rad/s, and torque, N m, speeds rising. The nearest `no_load_speed` and `stall`
            replace it, and it is None then.
        winding_loss: heat of the windings per squared torque, W/(N m)^2, which counts as work of the motor.
        delay: time after which a control acts, s, rounded to substeps. A servo measures its joint without delay.
    """

    no_load_speed: float | None = _number_field(low=_MIN_SPEED, high=_MAX_SPEED, default=None, optional=True)
    stall: float | None = _number_field(low=_MIN_GEAR, high=_MAX_GEAR, default=None, optional=True)
    torque_by_speed: tuple[Vector2, ...] | None = _field(_check_torque_table, default=None, optional=True)
    winding_loss: float = _number_field(low=0.0, high=_MAX_LOSS, default=0.0)
    delay: float = _number_field(low=0.0, high=_MAX_DELAY, default=0.0)

    @property
    def largest_torque(self) -> float:
        """The largest torque, N m."""
        raise NotImplementedError

    @property
    def stall_torque(self) -> float:
        """The torque at rest from which the limit falls, N m."""
        return self.largest_torque if self.stall is None else self.stall

    @property
    def drag(self) -> float | None:
        """The fall of the limit per speed, N m s/rad; None where torques do not fall with speed."""
        return None if self.no_load_speed is None else self.stall_torque / self.no_load_speed

    def _check_conditions(self):
        if self.torque_by_speed is not None:
            self._replace_table()
        if self.stall is None:
            return
        if self.no_load_speed is None:
            self._fail("stall", f"expected none without a no_load_speed, got {self.stall:g}")
        if self.stall < self.largest_torque:
            self._fail("stall", f"expected at least the largest torque, {self.largest_torque:g}, got {self.stall:g}")

    def _replace_table(self) -> None:
        """Set the speed without load and the stall torque to those of the line that is nearest to the table."""
        field = "torque_by_speed"
        if self.stall is not None or self.no_load_speed is not None:
            self._fail(field, "expected none next to a no_load_speed or a stall")
        line = _fit_torque_line(self.torque_by_speed, self.largest_torque)
        if line is None:
            self._fail(field, f"expected torques that fall from at least the largest torque, {self.largest_torque:g}")
        if line.error > _MAX_TABLE_ERROR:
            nearest = f"no_load_speed {line.no_load_speed:.4g} and stall {line.stall:.4g}"
            limit = f"expected a table within {_MAX_TABLE_ERROR:.0%} of a falling line"
            self._fail(field, f"{limit}, got {line.error:.0%}; the nearest has {nearest}")
        object.__setattr__(self, "no_load_speed", line.no_load_speed)  # the dataclass is frozen
        object.__setattr__(self, "stall", line.stall)
        object.__setattr__(self, field, None)
        self._check_fields([item for item in dataclasses.fields(self) if item.name in ("no_load_speed", "stall")])


class _TorqueLine(NamedTuple):
    """A limit of torques that falls with speed.

    Attributes:
        stall: torque at rest, N m.
        no_load_speed: speed at which the torque is 0, rad/s.
        error: largest distance from the table and the straight lines between its points, in largest torques.
    """

    stall: float
    no_load_speed: float
    error: float


def _fit_torque_line(points: Sequence[Vector2], largest_torque: float) -> _TorqueLine | None:
    """Return the line through two points of a table that is nearest to all of them.

    Args:
        points: of the table, speeds rising.
        largest_torque: N m, above which torques of the table do not count.

    Returns:
        The line; None if no line falls, or if the table begins below the largest torque.
    """
    reaching = [index for index, (_, torque) in enumerate(points) if torque >= largest_torque]
    if not reaching:
        return None
    falling_points = points[reaching[-1] :]
    lines = []
    for (speed, torque), (next_speed, next_torque) in itertools.combinations(falling_points, 2):
        slope = (torque - next_torque) / (next_speed - speed)
        if slope > 0.0:
            stall = torque + slope * speed
            error = _largest_error(stall, slope, falling_points, largest_torque)
            lines.append(_TorqueLine(stall, stall / slope, error / largest_torque))
    lines = [line for line in lines if line.stall >= largest_torque]
    return min(lines, key=lambda line: line.error, default=None)


def _largest_error(stall: float, slope: float, points: Sequence[Vector2], largest_torque: float) -> float:
    """Return the largest difference, N m, of a limit and of a table whose torques have the largest one at most.

    The difference is largest at a point of the table, or where the line meets the largest torque.
    """
    knee = (stall - largest_torque) / slope
    speeds = [speed for speed, _ in points]
    if speeds[0] < knee < speeds[-1]:
        speeds.append(knee)
    errors = []
    for speed in speeds:
        limit = min(stall - slope * speed, largest_torque)  # below 0 beyond the speed without load
        errors.append(abs(limit - min(_torque_at(points, speed), largest_torque)))
    return max(errors)


def _torque_at(points: Sequence[Vector2], speed: float) -> float:
    """Return the torque of a table at a speed within it, N m."""
    for (low, torque), (high, next_torque) in itertools.pairwise(points):
        if low <= speed <= high:
            share = (speed - low) / (high - low)
            return torque + share * (next_torque - torque)
    raise ValueError(f"speed: expected one from {points[0][0]} to {points[-1][0]}, got {speed}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Motor(_Drive):
    """A torque motor; see `_Drive` for torques that fall with speed.

    Attributes:
        gear: torque at a control of 1, N m; controls are in [-1, 1].
    """

    gear: float = _number_field(low=_MIN_GEAR, high=_MAX_GEAR)

    @property
    def largest_torque(self) -> float:
        """The torque at a control of 1, N m."""
        return self.gear


@dataclasses.dataclass(frozen=True, kw_only=True)
class Servo(_Drive):
    """A motor that holds its joint at an angle in every substep; a control of 0 is the standing pose.

    Attributes:
        stiffness: torque per distance of the joint from the angle at which it is held, N m/rad.
        damping: torque per velocity, against it, N m s/rad.
        limit: the largest torque, N m.
    """

    stiffness: float = _number_field(low=_MIN_GEAR, high=_MAX_GEAR)
    damping: float = _number_field(low=0.0, high=_MAX_JOINT_CONSTANT)
    limit: float = _number_field(low=_MIN_GEAR, high=_MAX_GEAR)

    @property
    def largest_torque(self) -> float:
        """The limit, N m."""
        return self.limit


@dataclasses.dataclass(frozen=True, kw_only=True)
class Joint(_Spec):
    """A limited hinge at a link's origin, driven by its motor or its servo.

    Attributes:
        name: `<leg>_<name>` is the joint's and its motor's name in the model.
        axis: direction in the link's frame, of any length except zero.
        range_deg: lower and upper limit; zero, the standing pose, lies between them.
        armature: rotor inertia seen at the joint, kg m^2; None: sized to the body.
        damping: viscous torque per velocity, N m s/rad; None: sized to the body.
        friction_loss: torque of dry friction, N m; a body with a source has that of the source.
        motor: the torque motor; None: a motor is sized to the body, unless the joint has a servo.
        servo: the servo of an imported body's joint.
        alias: name of the joint in the file that it was imported from.
    """

    name: str = _name_field()
    axis: Vector = _field(_check_vector, 3, -_MAX_AXIS, _MAX_AXIS)
    range_deg: tuple[float, float] = _field(_check_vector, 2, -180.0, 180.0)
    armature: float | None = _number_field(low=0.0, high=_MAX_JOINT_CONSTANT, default=None, optional=True)
    damping: float | None = _number_field(low=0.0, high=_MAX_JOINT_CONSTANT, default=None, optional=True)
    friction_loss: float = _number_field(low=0.0, high=_MAX_GEAR, default=0.0)
    motor: Motor | None = _field(_check_instance, Motor, default=None, optional=True)
    servo: Servo | None = _field(_check_instance, Servo, default=None, optional=True)
    alias: str | None = _field(_check_text, 1, MAX_ALIAS, default=None, optional=True)

    def _check_conditions(self):
        if math.hypot(*self.axis) < _MIN_NORM:
            self._fail("axis", "expected a direction, got one of no length")
        if self.motor and self.servo:
            self._fail("servo", "expected a motor or a servo, got both")
        low, high = self.range_deg
        if not (low <= 0.0 <= high and low < high):
            self._fail("range_deg", f"expected low <= 0 <= high and low < high, got {_preview(self.range_deg)}")

    @property
    def torque(self) -> float | None:
        """Return the largest torque of the motor or servo, N m; None if the motor has not been sized yet."""
        drive = self.drive
        return None if drive is None else drive.largest_torque

    @property
    def drive(self) -> Motor | Servo | None:
        """Return the motor or the servo; None if the motor has not been sized yet."""
        return self.motor or self.servo

    def mirrored(self) -> Joint:
        """Return the joint of the leg across the x-z plane, so that equal angles give mirrored poses.

        The reflection y -> -y turns an axis (x, y, z) into (-x, y, -z). A vertical axis does not change,
        by the convention of the published robots; its range changes sign instead.
        """
        x, y, z = self.axis
        is_vertical = x == 0.0 and y == 0.0
        if is_vertical:
            low, high = self.range_deg
            return self.replace(range_deg=(-high, -low))
        return self.replace(axis=(-x, y, -z))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Link(_Spec):
    """A capsule from the link's origin to `end`.

    Attributes:
        name: `<leg>_<name>` is the name of the link's body in the model.
        end: end of the capsule's axis in the link's frame.
        radius: radius of the capsule.
        joint: about which the link turns at its origin; None: it is rigidly fixed to the part before it.
    """

    name: str = _name_field()
    end: Vector = _position_field()
    radius: float = _length_field()
    joint: Joint | None = _field(_check_instance, Joint, default=None, optional=True)

    def _check_conditions(self):
        if math.hypot(*self.end) < _MIN_LENGTH:
            self._fail("end", "expected a point away from the link's origin")

    def mirrored(self) -> Link:
        """Return the link of the leg across the x-z plane."""
        joint = None if self.joint is None else self.joint.mirrored()
        return self.replace(end=_reflect(self.end), joint=joint)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Foot(_Spec):
    """A sphere, rigidly fixed to the end of the last link; its height decides between stance and swing."""

    radius: float = _length_field()
    name: str = _name_field(default="foot")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Leg(_Spec):
    """A chain of links from a mount on the torso down to a foot.

    Attributes:
        name: prefix of the names of its parts and joints in the model.
        mount: origin of the first link in the torso's frame.
        links: from the torso outwards.
        foot: at the end of the last link.
        yaw_deg: angle about z by which the first link's frame is turned.
    """

    name: str = _name_field()
    mount: Vector = _position_field()
    links: tuple[Link, ...] = _field(_check_items, Link, 1, _MAX_LINKS)
    foot: Foot = _field(_check_instance, Foot)
    yaw_deg: float = _number_field(low=-360.0, high=360.0, default=0.0)

    def _check_conditions(self):
        _check_unique(self, "links", [link.name for link in self.links] + [self.foot.name])
        _check_unique(self, "links", [joint.name for joint in self.joints])
        if not self.joints:
            self._fail("links", "expected at least one link with a joint")

    @functools.cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Return the joints, from the torso outwards."""
        return tuple([link.joint for link in self.links if link.joint])

    @functools.cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints in the model, from the torso outwards."""
        return tuple(map(self.full_name, self.joints))

    @property
    def side(self) -> str:
        """Return 'left' or 'right', the side of the foot; 'left' on the midline."""
        _, y, _ = self.foot_position
        return "right" if y < -1e-9 else "left"  # a bound below 0, so that rounding does not decide

    @functools.cached_property
    def foot_position(self) -> Vector:
        """Return the position of the foot in the torso's frame with all joints at zero."""
        return self.points[-1]

    @property
    def foot_depth(self) -> float:
        """Return the depth, m, of the lowest point of the foot below the torso's origin, with all joints at zero."""
        return self.foot.radius - self.foot_position[2]

    @functools.cached_property
    def points(self) -> tuple[Vector, ...]:
        """Return the origin of every link, and last of the foot, in the torso's frame with all joints at zero."""
        cosine = math.cos(math.radians(self.yaw_deg))
        sine = math.sin(math.radians(self.yaw_deg))
        points = [self.mount]
        for link in self.links:
            x, y, z = points[-1]
            end_x, end_y, end_z = link.end
            points.append((x + (cosine * end_x - sine * end_y), y + (sine * end_x + cosine * end_y), z + end_z))
        return tuple(points)

    @functools.cached_property
    def parts(self) -> tuple[Link | Foot, ...]:
        """Return the rigid parts, from the torso outwards: the links, then the foot."""
        return (*self.links, self.foot)

    @functools.cached_property
    def part_names(self) -> tuple[str, ...]:
        """Return the names of the parts' bodies in the model, from the torso outwards."""
        return tuple(map(self.full_name, self.parts))

    def full_name(self, part: Link | Foot | Joint) -> str:
        """Return the name of a link's or foot's body, or of a joint and its motor, in the model."""
        return f"{self.name}_{part.name}"

    def mirrored(self, name: str) -> Leg:
        """Return the leg across the x-z plane, under another name."""
        return self.replace(
            name=name,
            mount=_reflect(self.mount),
            yaw_deg=-self.yaw_deg,
            links=tuple(link.mirrored() for link in self.links),
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Solid(_Spec):
    """A shape fixed to the torso that has the body's density and touches the floor.

    Attributes:
        name: name of the geom.
        shape: sphere, capsule, cylinder, ellipsoid or box.
        size: radius or half-extents, as MuJoCo takes them for the shape.
        position: position of its center in the torso's frame.
        euler_deg: angles of turns about the x, then the y, then the z axis of the frame that turns.
    """

    name: str = _name_field()
    shape: str = _field(_check_choice, _SIZE_COUNTS)
    size: tuple[float, ...] = _field(_check_lengths)
    position: Vector = _position_field(default=(0.0, 0.0, 0.0))
    euler_deg: Vector = _field(_check_vector, 3, -360.0, 360.0, default=(0.0, 0.0, 0.0))

    def _check_conditions(self):
        if len(self.size) != _SIZE_COUNTS[self.shape]:
            self._fail("size", f"expected {_SIZE_COUNTS[self.shape]} lengths for a {self.shape}, got {len(self.size)}")
        if self.name == "floor":
            self._fail("name", "'floor' is what the body stands on")

    def mirrored(self):
        """Return the shape across the x-z plane."""
        x, y, z = self.euler_deg
        return self.replace(position=_reflect(self.position), euler_deg=(-x, y, -z))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ballast(Solid):
    """A shape fixed to the torso that weighs `mass` and touches nothing."""

    mass: float = _number_field(low=1e-9, high=1e9)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Torso(_Spec):
    """The free-floating root: solids around its origin, which stands above the floor.

    Attributes:
        standing_height: height of the origin above the floor, m; None: the body derives it, so that its lowest
            foot stands on the floor.
        solids: the torso's shapes.
    """

    standing_height: float | None = _length_field(default=None, optional=True)
    solids: tuple[Solid, ...] = _field(_check_items, Solid, 1, _MAX_SHAPES)

    def _check_conditions(self):
        _check_unique(self, "solids", [solid.name for solid in self.solids])


@dataclasses.dataclass(frozen=True, kw_only=True)
class TrackingCamera(_Spec):
    """A camera that follows the body.

    Attributes:
        position: relative to the body's center of mass.
        xyaxes: the camera's x and y axes in the world, as in MJCF.
    """

    position: Vector = _field(_check_vector, 3, -MAX_DISTANCE, MAX_DISTANCE)
    xyaxes: tuple[float, ...] = _field(_check_vector, 6, -1.0, 1.0, default=(1.0, 0.0, 0.0, 0.0, 0.5, 1.0))

    def _check_conditions(self):
        a, b, c, d, e, f = self.xyaxes
        cross_product = (b * f - c * e, c * d - a * f, a * e - b * d)
        if math.hypot(*cross_product) < _MIN_NORM:
            self._fail("xyaxes", f"expected two directions that are not parallel, got {_preview(self.xyaxes)}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Simulation(_Spec):
    """The constants of the simulation that have a physical unit.

    The defaults are MuJoCo's, except the margin. They are those of the published robots and suit bodies of
    about half a meter. Since MuJoCo 3.5 the margin of a contact is the sum of its geoms' margins:
    floor and robot each have half of the published one.

    Attributes:
        timestep: timestep of one substep, s.
        contact_time: time constant of contacts and joint limits, s.
        contact_width: depth over which a contact hardens, m.
        contact_margin: distance at which contacts begin, of every geom that can touch, m.
        substeps: number in a control step.
    """

    timestep: float = _number_field(low=1e-6, high=0.1, default=0.002)
    contact_time: float = _number_field(low=2e-6, high=1.0, default=0.02)
    contact_width: float = _number_field(low=1e-9, high=MAX_LENGTH, default=0.001)
    contact_margin: float = _number_field(low=0.0, high=MAX_LENGTH, default=0.005)
    substeps: int = _field(_check_integer, 2, 1000, default=25)

    def _check_conditions(self):
        if self.contact_time < 2.0 * self.timestep:
            self._fail("contact_time", f"expected at least two timesteps, got {self.contact_time:g}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Held(_Spec):
    """A joint of an imported body that belongs to no leg. A servo holds it in the standing pose.

    Attributes:
        name: name of the joint and its servo in the model.
        servo: holds the joint.
    """

    name: str = _name_field()
    servo: Servo = _field(_check_instance, Servo)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Body(_Spec):
    """A complete creature.

    Actions, joint angles, joint velocities and contact forces are in the order of the legs.
    Fields that are None are sized to the body before its model is built; see `arc_suite.models.sizing`.

    Attributes:
        name: name of the body and its model; with a robot's name it uses the robot's parameters and presets.
        torso: the root of the kinematic tree.
        legs: all legs, left and right ones.
        camera: the side view that follows the body; None: placed to suit the body.
        ballast: additional masses on the torso.
        density: density of solids, links and feet, kg/m^3.
        simulation: constants of the simulation; None: scaled to the body.
        agility: factor on the gear of motors that are sized; above 1 for bodies that leap.
        palette: palette of the body's colors: one of `PALETTES`, a seed, or colors of the first of `MATERIALS`, such as
            `COLORS_EXAMPLE`; None: the robot's own, or gray. See `palettes.colors`.
        ornaments: whether eyes, tails, shells and the like, without weight, are drawn on the torso. An imported body
            has the looks of its file.
        source: MJCF of an imported body. It has parts and joints of the same names as here, and the standing pose as
            the keyframe `home`; see `arc_suite.models.source`.
        held: joints of an imported body that belong to no leg.
        file_joints: names of the motors' joints in the file that the body was imported from, in the order of the file.
    """

    name: str = _name_field()
    torso: Torso = _field(_check_instance, Torso)
    legs: tuple[Leg, ...] = _field(_check_items, Leg, 1, _MAX_LEGS)
    camera: TrackingCamera | None = _field(_check_instance, TrackingCamera, default=None, optional=True)
    density: float = _number_field(low=1e-9, high=_MAX_DENSITY, default=DENSITY)
    ballast: tuple[Ballast, ...] = _field(_check_items, Ballast, 0, _MAX_SHAPES, default=())
    simulation: Simulation | None = _field(_check_instance, Simulation, default=None, optional=True)
    agility: float = _number_field(low=0.1, high=10.0, default=1.0)
    palette: str | int | None = _field(_check_palette, default=None, optional=True)
    ornaments: bool = _field(_check_boolean, default=True)
    source: str | None = _field(_check_text, 1, MAX_SOURCE, default=None, optional=True)
    held: tuple[Held, ...] = _field(_check_items, Held, 0, _MAX_HELD_JOINTS, default=())
    file_joints: tuple[str, ...] = _field(_check_texts, _MAX_FILE_JOINTS, default=())

    def _check_conditions(self):
        _check_unique(self, "legs", [leg.name for leg in self.legs])
        shape_names = [shape.name for shape in (*self.torso.solids, *self.ballast)]
        _check_unique(self, "ballast", shape_names)
        self._check_source()
        self._check_delays()
        if self.source is None:
            self._check_inertia()
        if self.torso.standing_height is None:
            torso = self.torso.replace(standing_height=self._standing_height())
            object.__setattr__(self, "torso", torso)
        # Unique names within legs are not enough: part b_c of leg a and part c of leg a_b are both a_b_c in the model.
        _check_unique(self, "legs", [*shape_names, *self.part_names[1:]])
        _check_unique(self, "legs", [*self.joint_names, *(joint.name for joint in self.held)])

    def _standing_height(self) -> float:
        """Return the height, m, of the torso's origin above the lowest point of the lowest foot."""
        height = max(leg.foot_depth for leg in self.legs)
        if not _MIN_LENGTH <= height <= MAX_LENGTH:
            reason = f"feet end {abs(height):.4g} m {'below' if height > 0.0 else 'above'} the torso's origin"
            self._fail("torso", f"standing_height cannot be derived: {reason}")
        return float(f"{height:.12g}")  # lengths are decimal numbers, and so are their sums

    def _check_source(self) -> None:
        """Raise SpecError for fields that only bodies with a source may have, or only bodies without one."""
        joints_have_servos = [joint.servo is not None for joint in self.joints]
        expected_default = "expected the default in a body with a source, which has"
        if self.source is None:
            if any(joints_have_servos):
                self._fail("legs", "expected no servos in a body without a source")
            for field in ("held", "file_joints"):
                if getattr(self, field):
                    self._fail(field, "expected no values in a body without a source")
        elif not all(joints_have_servos):
            self._fail("legs", "expected a servo at every joint of a body with a source")
        elif any(joint.friction_loss for joint in self.joints):
            self._fail("legs", "expected no friction_loss in a body with a source, which has its own")
        elif self.ballast:
            self._fail("ballast", "expected none in a body with a source, which has its weights")
        elif self.agility != 1.0:
            self._fail("agility", f"{expected_default} its motors and weights")
        elif self.density != DENSITY:
            self._fail("density", f"{expected_default} its motors and weights")
        elif not self.ornaments:
            self._fail("ornaments", f"{expected_default} the looks of its file")
        elif self.simulation is None:
            self._fail("simulation", "missing; a body with a source needs it")

    def _check_delays(self) -> None:
        """Raise SpecError for a delay of a motor that takes too many substeps."""
        drives = [joint.motor or joint.servo for joint in self.joints]
        drives += [joint.servo for joint in self.held]
        longest_delay = max([drive.delay for drive in drives if drive], default=0.0)
        timestep = (self.simulation or Simulation()).timestep
        highest_delay = _MAX_DELAY_SUBSTEPS * timestep
        if longest_delay > highest_delay:
            what = f"{highest_delay:g} s, {_MAX_DELAY_SUBSTEPS} substeps"
            self._fail("legs", f"expected delays of motors of at most {what}, got {longest_delay:g}")

    def _check_inertia(self):
        """Raise SpecError for a moving part whose inertia is too small for MuJoCo.

        A part has at least the inertia of a ball of its smallest radius or half-extent: 8/15 pi density radius^5.
        """
        min_size = (_MIN_INERTIA / (8.0 / 15.0 * math.pi * self.density)) ** 0.2  # m, by the fifth root
        sizes = [("torso", solid.name, min(solid.size)) for solid in self.torso.solids]
        for leg in self.legs:
            sizes += [("legs", name, part.radius) for name, part in zip(leg.part_names, leg.parts, strict=True)]
        field, name, smallest_size = min(sizes, key=operator.itemgetter(2))
        if smallest_size >= min_size:
            return

        valid_density = float(f"{1.1 * self.density * (min_size / smallest_size) ** 5:.2g}")
        remedy = f" (density {valid_density:g} fits)" if valid_density <= _MAX_DENSITY else ""
        what = "a radius" if field == "legs" else "sizes"
        self._fail(
            field,
            f"{name}: expected {what} from {min_size:.2g} at density {self.density:g}, got {smallest_size:g}{remedy}",
        )

    @functools.cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Return the joints in the order of the action."""
        return tuple(itertools.chain.from_iterable([leg.joints for leg in self.legs]))

    @functools.cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints, and of their motors, in the order of the action."""
        return tuple(itertools.chain.from_iterable([leg.joint_names for leg in self.legs]))

    @functools.cached_property
    def part_names(self) -> tuple[str, ...]:
        """Return the names of the rigid bodies in the order of the contact forces, the torso first."""
        return ("torso", *itertools.chain.from_iterable([leg.part_names for leg in self.legs]))

    @functools.cached_property
    def foot_names(self) -> tuple[str, ...]:
        """Return the names of the feet's bodies, in the order of the legs."""
        return tuple([leg.part_names[-1] for leg in self.legs])

    @functools.cached_property
    def ranks(self) -> tuple[int, ...]:
        """Return for each leg how many legs of its side stand in front of it: the front legs have rank 0."""
        feet = [(leg.side, leg.foot_position[0]) for leg in self.legs]  # side and forward position
        ranks = []
        for side, x in feet:
            feet_in_front = [other_x for other_side, other_x in feet if other_side == side and other_x > x]
            ranks.append(len(feet_in_front))
        return tuple(ranks)

    def moves_like(self, other: Body) -> bool:
        """Return whether another body has the same physics: they differ in name, camera and looks at most."""
        fields = {name: getattr(other, name) for name in _FIELDS_WITHOUT_PHYSICS}
        return self.replace(**fields) == other

    def mirrored(self) -> Body:
        """Return the mirror image of the body across the x-z plane; names and order of the parts do not change."""
        solids = tuple(solid.mirrored() for solid in self.torso.solids)
        return self.replace(
            torso=self.torso.replace(solids=solids),
            ballast=tuple(ballast.mirrored() for ballast in self.ballast),
            legs=tuple(leg.mirrored(leg.name) for leg in self.legs),
        )


def _reflect(point: Vector) -> Vector:
    return (point[0], -point[1], point[2])


def _check_unique(spec: _Spec, field: str, names: Iterable[str]) -> None:
    """Raise SpecError, about a field of a spec, for a name that occurs twice."""
    earlier_names = set()
    for name in names:
        if name in earlier_names:
            spec._fail(field, f"the name {name!r} occurs twice")
        earlier_names.add(name)
