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
from collections.abc import Iterable
from typing import Any, NoReturn

Vector = tuple[float, float, float]

MAX_LENGTH = 100.0  # meters; far above any creature, far below what upsets MuJoCo
MAX_DISTANCE = 1e4  # meters, of a camera: more than it takes to see any body
_DENSEST = 1e9  # kg/m^3

# Of a motor and of a joint, in SI units: beyond what sizing asks for of any body that the other bounds admit, so that
# no error names a number that sizing found.
_GEARS = (1e-20, 1e30)
_LARGEST = 1e35
_LEAST_INERTIA = 1e-14  # kg m^2; MuJoCo's own bound is 1e-15
MAX_NAME = 32  # characters
DENSITY = 10.0  # kg/m^3, of the published robots
MAX_ALIAS = 100  # characters of a name in a file of others
MAX_SOURCE = 1 << 21  # bytes of the MJCF of an imported body; of 38 files the largest has 430,000
PALETTES = ("moss", "rust", "bone", "coral", "night")  # see `palettes.colors`
_NAME = re.compile(rf"[a-z0-9_]{{1,{MAX_NAME}}}")
_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


class SpecError(ValueError):
    """A spec that no body can be built from; the message names the field.

    Attributes:
        reason: what is wrong, without the field.
        field: name of the field; None where the reason stands alone.
    """

    def __init__(self, reason: str, field: str | None = None, owner: str | None = None):
        """Word the error; `owner` tells whose field it is."""
        super().__init__(": ".join(part for part in (".".join(filter(None, (owner, field))), reason) if part))
        self.reason = reason
        self.field = field


def _check_name(value: Any) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise SpecError(f"expected 1 to {MAX_NAME} characters out of [a-z0-9_], got {_shown(value)}")
    return value


def _check_number(value: Any, low: float, high: float) -> float:
    real = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not real or not low <= value <= high:  # also false for NaN
        raise SpecError(f"expected a number from {low:g} to {high:g}, got {_shown(value)}")
    return float(value) + 0.0  # -0.0 becomes 0.0: equal specs are to give equal texts


def _check_vector(value: Any, size: int, low: float, high: float) -> tuple[float, ...]:
    if not isinstance(value, (tuple, list)) or len(value) != size:
        raise SpecError(f"expected {size} numbers, got {_shown(value)}")
    return tuple(map(functools.partial(_check_number, low=low, high=high), value))


def _check_lengths(value: Any) -> tuple[float, ...]:
    if not isinstance(value, (tuple, list)) or not 1 <= len(value) <= 3:
        raise SpecError(f"expected 1 to 3 lengths, got {_shown(value)}")
    return tuple(_check_number(number, 1e-6, MAX_LENGTH) for number in value)


def _check_choice(value: Any, choices: Iterable[str]) -> str:
    if value not in tuple(choices):
        raise SpecError(f"expected one of {', '.join(choices)}, got {_shown(value)}")
    return value


def _check_palette(value: Any) -> str | int:
    seed = isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**31
    if not seed and not (isinstance(value, str) and value in PALETTES):
        raise SpecError(f"expected one of {', '.join(PALETTES)}, or a seed of 0 or more, got {_shown(value)}")
    return value


def _check_instance(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise SpecError(f"expected a {kind.__name__}, got {_shown(value)}")
    return value


def _check_items(value: Any, kind: type, low: int, high: int) -> tuple:
    if not isinstance(value, (tuple, list)):
        raise SpecError(f"expected a sequence of {kind.__name__}s, got {_shown(value)}")
    if not low <= len(value) <= high:
        raise SpecError(f"expected {low} to {high} {kind.__name__}s, got {len(value)}")
    return tuple(map(functools.partial(_check_instance, kind=kind), value))


def _check_text(value: Any, low: int, high: int) -> str:
    if not isinstance(value, str) or not low <= len(value) <= high:
        raise SpecError(f"expected a text of {low} to {high} characters, got {_shown(value)}")
    return value


def _check_texts(value: Any, high: int) -> tuple[str, ...]:
    if not isinstance(value, (tuple, list)) or len(value) > high:
        raise SpecError(f"expected a sequence of at most {high} texts, got {_shown(value)}")
    return tuple(_check_text(text, 1, MAX_ALIAS) for text in value)


def _check_integer(value: Any, low: int, high: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise SpecError(f"expected an integer from {low} to {high}, got {_shown(value)}")
    return value


def _shown(value: Any) -> str:
    plain = value is None or isinstance(value, (str, int, float, tuple, list))
    text = repr(value) if plain else f"a {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


def _field(check, *args, default=dataclasses.MISSING, optional=False):
    """Return a dataclass field whose value passes through `check(value, *args)`; None may pass if optional."""
    metadata = {"check": check, "args": args, "optional": optional}
    if check in (_check_instance, _check_items):
        metadata["kind"] = args[0]
        metadata["many"] = check is _check_items
    return dataclasses.field(default=default, metadata=metadata)


def _name(**kwargs):
    return _field(_check_name, **kwargs)


def _number(low, high, **kwargs):
    return _field(_check_number, low, high, **kwargs)


def _length(**kwargs):
    return _number(1e-6, MAX_LENGTH, **kwargs)


def _angle(**kwargs):
    return _number(-360.0, 360.0, **kwargs)


def _position(**kwargs):
    return _field(_check_vector, 3, -MAX_LENGTH, MAX_LENGTH, **kwargs)


class _Spec:
    """Base of all specs: checks every field, then conditions on several fields."""

    def __post_init__(self):
        self._check_fields(dataclasses.fields(self))
        self._check_whole()

    def _check_fields(self, fields: Iterable[dataclasses.Field]) -> None:
        for field in fields:
            value = getattr(self, field.name)
            if value is None and field.metadata["optional"]:
                continue
            try:
                value = field.metadata["check"](value, *field.metadata["args"])
            except SpecError as error:
                raise SpecError(error.reason, field.name, self._label()) from None
            object.__setattr__(self, field.name, value)

    def _check_whole(self) -> None:
        """Check conditions on several fields; subclasses with such conditions override this."""

    def _fail(self, field: str, message: str) -> NoReturn:
        raise SpecError(message, field, self._label())

    def _label(self) -> str:
        name = getattr(self, "name", None)
        kind = type(self).__name__
        return f"{kind}({name})" if isinstance(name, str) and _NAME.fullmatch(name) else kind

    def replace(self, **changes):
        """Return a copy with some fields changed, checked like any other."""
        fields = {field.name: field for field in dataclasses.fields(self)}
        if not changes.keys() <= fields.keys():
            return dataclasses.replace(self, **changes)  # raises the error of an unknown field
        copy = object.__new__(type(self))
        for name in fields:
            object.__setattr__(copy, name, changes[name] if name in changes else getattr(self, name))
        copy._check_fields([fields[name] for name in changes])  # the others were checked before
        copy._check_whole()
        return copy


@dataclasses.dataclass(frozen=True, kw_only=True)
class Motor(_Spec):
    """A torque motor: control in [-1, 1], torque = gear (N m) x control."""

    gear: float = _number(*_GEARS)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Servo(_Spec):
    """A motor that holds its joint at an angle in every substep; a control of 0 is the standing pose.

    Attributes:
        stiffness: torque by the joint's distance from the wanted angle, N m/rad.
        damping: torque against its velocity, N m s/rad.
        limit: the largest torque, N m.
    """

    stiffness: float = _number(*_GEARS)
    damping: float = _number(0.0, _LARGEST)
    limit: float = _number(*_GEARS)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Joint(_Spec):
    """A limited hinge at a link's origin, driven by its motor or its servo.

    Attributes:
        name: `<leg>_<name>` is the joint's and its motor's name in the model.
        axis: direction in the link's frame, any length but zero.
        range_deg: lower and upper limit; zero, the standing pose, lies within.
        armature: rotor inertia seen at the joint, kg m^2; None: sized to the body.
        damping: viscous torque, N m s/rad; None: sized to the body.
        motor: None: sized to the body, unless it has a servo.
        servo: of an imported body.
        alias: its name in the file that it was imported from.
    """

    name: str = _name()
    axis: Vector = _field(_check_vector, 3, -1e3, 1e3)
    range_deg: tuple[float, float] = _field(_check_vector, 2, -180.0, 180.0)
    armature: float | None = _number(0.0, _LARGEST, default=None, optional=True)
    damping: float | None = _number(0.0, _LARGEST, default=None, optional=True)
    motor: Motor | None = _field(_check_instance, Motor, default=None, optional=True)
    servo: Servo | None = _field(_check_instance, Servo, default=None, optional=True)
    alias: str | None = _field(_check_text, 1, MAX_ALIAS, default=None, optional=True)

    def _check_whole(self):
        if math.hypot(*self.axis) < 1e-6:
            self._fail("axis", "expected a direction, got one of no length")
        if self.motor and self.servo:
            self._fail("servo", "expected a motor or a servo, got both")
        low, high = self.range_deg
        if not (low <= 0.0 <= high and low < high):
            self._fail("range_deg", f"expected low <= 0 <= high and low < high, got {_shown(self.range_deg)}")

    @property
    def torque(self) -> float | None:
        """Return the largest torque of its motor or servo, N m; None for one that is to be sized."""
        if self.servo:
            return self.servo.limit
        return self.motor.gear if self.motor else None

    def mirrored(self) -> Joint:
        """Return the joint of the leg across the x-z plane, so that equal angles give mirrored poses.

        A reflection at y -> -y turns an axis (a, b, c) into (-a, b, -c). A vertical axis stays
        instead, by the convention of the published robots, and its range changes sign.
        """
        a, b, c = self.axis
        if a == b == 0.0:
            low, high = self.range_deg
            return self.replace(range_deg=(-high, -low))
        return self.replace(axis=(-a, b, -c))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Link(_Spec):
    """A capsule from the link's origin to `end`, rigid on its parent or turning about `joint`."""

    name: str = _name()
    end: Vector = _position()
    radius: float = _length()
    joint: Joint | None = _field(_check_instance, Joint, default=None, optional=True)

    def _check_whole(self):
        if math.hypot(*self.end) < 1e-6:
            self._fail("end", "expected a point away from the link's origin")

    def mirrored(self) -> Link:
        """Return the link of the leg across the x-z plane."""
        return self.replace(end=_reflected(self.end), joint=self.joint and self.joint.mirrored())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Foot(_Spec):
    """A sphere, rigid at the end of the last link; its height decides between stance and swing."""

    radius: float = _length()
    name: str = _name(default="foot")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Leg(_Spec):
    """A chain of links from a mount on the torso down to a foot.

    Attributes:
        name: prefix of all names in the leg.
        mount: origin of the first link in the torso's frame.
        links: from the torso outwards.
        foot: the end of the chain.
        yaw_deg: turn of the first link's frame about z.
    """

    name: str = _name()
    mount: Vector = _position()
    links: tuple[Link, ...] = _field(_check_items, Link, 1, 16)
    foot: Foot = _field(_check_instance, Foot)
    yaw_deg: float = _angle(default=0.0)

    def _check_whole(self):
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
        return "right" if self.foot_position[1] < -1e-9 else "left"  # rounding must not tell sides

    @functools.cached_property
    def foot_position(self) -> Vector:
        """Return the position of the foot in the torso's frame with all joints at zero."""
        return self.points[-1]

    @functools.cached_property
    def points(self) -> tuple[Vector, ...]:
        """Return the origin of every link, and last of the foot, in the torso's frame with all joints at zero."""
        cos, sin = math.cos(math.radians(self.yaw_deg)), math.sin(math.radians(self.yaw_deg))
        points = [self.mount]
        for link in self.links:
            (x, y, z), (a, b, c) = points[-1], link.end
            points.append((x + (cos * a - sin * b), y + (sin * a + cos * b), z + c))
        return tuple(points)

    @functools.cached_property
    def parts(self) -> tuple[Link | Foot, ...]:
        """Return the rigid parts, from the torso outwards."""
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
            mount=_reflected(self.mount),
            yaw_deg=-self.yaw_deg,
            links=tuple(link.mirrored() for link in self.links),
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Solid(_Spec):
    """A shape fixed to the torso that has the body's density and touches the floor.

    Attributes:
        name: name of the geom.
        shape: sphere, capsule, cylinder, ellipsoid or box.
        size: half-extents as MuJoCo takes them for the shape.
        position: center in the torso's frame.
        euler_deg: turns about the x, y and z axes of the turning frame, in that order.
    """

    name: str = _name()
    shape: str = _field(_check_choice, _SIZES)
    size: tuple[float, ...] = _field(_check_lengths)
    position: Vector = _position(default=(0.0, 0.0, 0.0))
    euler_deg: Vector = _field(_check_vector, 3, -360.0, 360.0, default=(0.0, 0.0, 0.0))

    def _check_whole(self):
        if len(self.size) != _SIZES[self.shape]:
            self._fail("size", f"expected {_SIZES[self.shape]} lengths for a {self.shape}, got {len(self.size)}")
        if self.name == "floor":
            self._fail("name", "'floor' is what the body stands on")

    def mirrored(self):
        """Return the shape across the x-z plane."""
        x, y, z = self.euler_deg
        return self.replace(position=_reflected(self.position), euler_deg=(-x, y, -z))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ballast(Solid):
    """A shape fixed to the torso that weighs `mass` and touches nothing."""

    mass: float = _number(1e-9, 1e9)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Torso(_Spec):
    """The free-floating root: solids around its origin, which stands above the floor.

    Attributes:
        standing_height: of the origin above the floor, m; None: a body sets it so that its lowest foot
            stands on the floor.
        solids: its shapes.
    """

    standing_height: float | None = _length(default=None, optional=True)
    solids: tuple[Solid, ...] = _field(_check_items, Solid, 1, 64)

    def _check_whole(self):
        _check_unique(self, "solids", [solid.name for solid in self.solids])


@dataclasses.dataclass(frozen=True, kw_only=True)
class TrackingCamera(_Spec):
    """A camera that keeps `position` relative to the body's center of mass, `xyaxes` as in MJCF."""

    position: Vector = _field(_check_vector, 3, -MAX_DISTANCE, MAX_DISTANCE)
    xyaxes: tuple[float, ...] = _field(_check_vector, 6, -1.0, 1.0, default=(1.0, 0.0, 0.0, 0.0, 0.5, 1.0))

    def _check_whole(self):
        (a, b, c), (d, e, f) = self.xyaxes[:3], self.xyaxes[3:]
        if math.hypot(b * f - c * e, c * d - a * f, a * e - b * d) < 1e-6:  # their cross product
            self._fail("xyaxes", f"expected two directions that are not parallel, got {_shown(self.xyaxes)}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Simulation(_Spec):
    """The constants of the simulation that have a dimension.

    The defaults are MuJoCo's, except the margin. They are those of the published robots and suit bodies of
    about half a meter. Since MuJoCo 3.5 the margin of a contact is the sum of its geoms' margins:
    floor and robot each carry half of the published one.

    Attributes:
        timestep: of one substep, s.
        contact_time: time constant of contacts and joint limits, s.
        contact_width: depth over which a contact hardens, m.
        contact_margin: of every geom that touches, m.
        substeps: of a control step.
    """

    timestep: float = _number(1e-6, 0.1, default=0.002)
    contact_time: float = _number(2e-6, 1.0, default=0.02)
    contact_width: float = _number(1e-9, MAX_LENGTH, default=0.001)
    contact_margin: float = _number(0.0, MAX_LENGTH, default=0.005)
    substeps: int = _field(_check_integer, 2, 1000, default=25)

    def _check_whole(self):
        if self.contact_time < 2.0 * self.timestep:
            self._fail("contact_time", f"expected at least two timesteps, got {self.contact_time:g}")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Held(_Spec):
    """A joint outside of the legs of an imported body, which a servo holds in the standing pose.

    Attributes:
        name: of the joint and its servo in the model.
        servo: that holds it.
    """

    name: str = _name()
    servo: Servo = _field(_check_instance, Servo)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Body(_Spec):
    """A whole creature.

    The legs' order is that of bodies, actions, joint angles, joint velocities and contact forces.
    What is None is sized to the body before it is built; see `arc_suite.models.sizing`.

    Attributes:
        name: of the body and its model; a robot's name gives it the robot's numbers.
        torso: the root.
        legs: every leg, right ones included.
        camera: the side view that follows the body; None: placed to suit the body.
        ballast: further weight on the torso.
        density: of solids, links and feet, kg/m^3.
        simulation: its constants; None: scaled to the body.
        agility: factor on the motors that are sized, for bodies that leap.
        palette: of its colors, one of `PALETTES` or a seed; None: the robot's own, or gray.
        source: MJCF of an imported body, which names parts and joints as here and has the standing pose as the
            keyframe `home`; see `arc_suite.models.source`.
        held: its joints outside of the legs.
        file_joints: names of its motors' joints in the file that it was imported from, in the order of the file.
    """

    name: str = _name()
    torso: Torso = _field(_check_instance, Torso)
    legs: tuple[Leg, ...] = _field(_check_items, Leg, 1, 64)
    camera: TrackingCamera | None = _field(_check_instance, TrackingCamera, default=None, optional=True)
    density: float = _number(1e-9, _DENSEST, default=DENSITY)
    ballast: tuple[Ballast, ...] = _field(_check_items, Ballast, 0, 64, default=())
    simulation: Simulation | None = _field(_check_instance, Simulation, default=None, optional=True)
    agility: float = _number(0.1, 10.0, default=1.0)
    palette: str | int | None = _field(_check_palette, default=None, optional=True)
    source: str | None = _field(_check_text, 1, MAX_SOURCE, default=None, optional=True)
    held: tuple[Held, ...] = _field(_check_items, Held, 0, 256, default=())
    file_joints: tuple[str, ...] = _field(_check_texts, 1024, default=())

    def _check_whole(self):
        _check_unique(self, "legs", [leg.name for leg in self.legs])
        shapes = [part.name for part in (*self.torso.solids, *self.ballast)]
        _check_unique(self, "ballast", shapes)
        self._check_source()
        if self.source is None:
            self._check_inertia()
        if self.torso.standing_height is None:
            object.__setattr__(self, "torso", self.torso.replace(standing_height=self._derived_height()))
        # Names in the model: leg a's part b_c would meet leg a_b's part c.
        _check_unique(self, "legs", [*shapes, *self.part_names[1:]])
        _check_unique(self, "legs", [*self.joint_names, *(joint.name for joint in self.held)])

    def _derived_height(self) -> float:
        """Return the height of the torso's origin above its lowest foot's lowest point."""
        height = max(leg.foot.radius - leg.foot_position[2] for leg in self.legs)
        if not 1e-6 <= height <= MAX_LENGTH:
            reason = f"feet end {abs(height):.4g} m {'below' if height > 0.0 else 'above'} the torso's origin"
            self._fail("torso", f"standing_height cannot be derived: {reason}")
        return float(f"{height:.12g}")  # sums of decimal lengths are decimal again

    def _check_source(self) -> None:
        """Refuse servos without a source, and motors with one."""
        servos = [joint.servo is not None for joint in self.joints]
        if self.source is None:
            for field, given in (("legs", any(servos)), ("held", self.held), ("file_joints", self.file_joints)):
                if given:
                    what = "servos" if field == "legs" else "values"
                    self._fail(field, f"expected no {what} in a body without a source")
        elif not all(servos):
            self._fail("legs", "expected a servo at every joint of a body with a source")
        elif self.ballast:
            self._fail("ballast", "expected none in a body with a source, which has its weights")
        elif self.agility != 1.0 or self.density != DENSITY:
            field = "agility" if self.agility != 1.0 else "density"
            self._fail(field, "expected the default in a body with a source, which has its motors and weights")
        elif self.simulation is None:
            self._fail("simulation", "missing; a body with a source needs it")

    def _check_inertia(self):
        """Refuse moving parts whose inertia is too small for MuJoCo; that of a ball is 8/15 pi density radius^5."""
        least = (_LEAST_INERTIA / (8.0 / 15.0 * math.pi * self.density)) ** 0.2
        sizes = [("torso", solid.name, min(solid.size)) for solid in self.torso.solids]
        for leg in self.legs:
            sizes += [("legs", name, part.radius) for name, part in zip(leg.part_names, leg.parts, strict=True)]
        field, name, size = min(sizes, key=operator.itemgetter(2))
        if size < least:
            denser = float(f"{1.1 * self.density * (least / size) ** 5:.2g}")
            fits = f" (density {denser:g} fits)" if denser <= _DENSEST else ""
            what = "a radius" if field == "legs" else "sizes"
            self._fail(
                field, f"{name}: expected {what} from {least:.2g} at density {self.density:g}, got {size:g}{fits}"
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
        """Return for each leg how many legs of its side stand in front of it: 0 is the front leg."""
        feet = [(leg.side, leg.foot_position[0]) for leg in self.legs]
        return tuple([sum([other == side and ahead > x for other, ahead in feet]) for side, x in feet])

    def mirrored(self) -> Body:
        """Return the body across the x-z plane; every part keeps its name and place in the order."""
        solids = tuple(solid.mirrored() for solid in self.torso.solids)
        return self.replace(
            torso=self.torso.replace(solids=solids),
            ballast=tuple(ballast.mirrored() for ballast in self.ballast),
            legs=tuple(leg.mirrored(leg.name) for leg in self.legs),
        )


def _reflected(point: Vector) -> Vector:
    return (point[0], -point[1], point[2])


def _check_unique(spec: _Spec, field: str, names: Iterable[str]) -> None:
    seen = set()
    for name in names:
        if name in seen:
            spec._fail(field, f"the name {name!r} occurs twice")
        seen.add(name)
