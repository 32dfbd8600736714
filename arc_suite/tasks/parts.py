"""Parts of observation blocks: the size of each, and how it transforms.

A part knows what its numbers are, such as a vector or angles of joints. From that follow its mirror image, what one leg
sees of it, its places in vectors of many bodies, and the names of its entries. A task of another package uses these
parts, or inherits from `Part`.
"""

import dataclasses
import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors
from arc_suite.tasks.mirrors import Mirror

HEADED = ("forward", "left", "up")  # axes of vectors as the torso heads
WORLD = ("world x", "world y", "world z")
ROTATIONS = ("roll", "pitch", "yaw")  # axes of angular velocities in the torso's frame

_DIGITS = 9  # of a turn in steps between rays


class ViewingLeg(NamedTuple):
    """A leg for which observations are transformed, such that it sees what the first leg would see in its place.

    Attributes:
        index: of the leg.
        turn: angle by which planar vectors are turned, rad.
        joints: (joints of a leg, joints) for each joint of the leg its place among those of the body, 1 or -1.
        foot: (2,) place of its foot in the standing pose from the torso, forward and left, as it sees it, R.
    """

    index: int
    turn: float
    joints: np.ndarray
    foot: np.ndarray


class Padding(NamedTuple):
    """Places of the numbers of one body in vectors that bodies of up to so many legs and joints share.

    Attributes:
        size: of the shared vector.
        places: (numbers of the body,) indices in it.
    """

    size: int
    places: np.ndarray


@dataclasses.dataclass(frozen=True)
class Part(ABC):
    """A part of a block."""

    @property
    def has_frame(self) -> bool:
        """Whether it is known how its numbers transform."""
        return True

    @property
    @abstractmethod
    def size(self) -> int:
        """How many numbers it has."""

    @abstractmethod
    def mirror(self, image: Image) -> Mirror:
        """Return the left-right map of its numbers.

        Raises:
            ValueError: there is none for this body.
        """

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (size, features) of what a leg sees: a feature is a sum of at most two numbers."""
        return np.eye(self.size)

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the constants (n,) that a leg sees after these features."""
        return np.zeros(0)

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the places of its numbers in vectors for bodies of up to so many legs, and joints of a leg.

        Raises:
            ValueError: the body has more.
        """
        return Padding(self.size, np.arange(self.size))

    @abstractmethod
    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit of every number."""


@dataclasses.dataclass(frozen=True)
class Scalar(Part):
    """A number that is the same to every leg, such as a height.

    Attributes:
        name: of the number.
        unit: of the number.
        sign: 1, or -1 where the mirror changes it, as of a rotation about the vertical axis.
    """

    name: str = ""
    unit: str = ""
    sign: int = 1

    size = 1

    def mirror(self, image: Image) -> Mirror:
        """Return the map that keeps the number or changes its sign."""
        return Mirror.with_signs(self.sign)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit."""
        yield self.name, self.unit


@dataclasses.dataclass(frozen=True)
class _Components(Part):
    """Numbers along axes."""

    name: str = ""
    unit: str = ""
    axes: tuple[str, ...] = ()
    axial: bool = False

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the names and units of the components."""
        for axis in self.axes:
            yield (f"{self.name}, {axis}" if self.name else axis), self.unit


@dataclasses.dataclass(frozen=True)
class Planar(_Components):
    """A horizontal vector (2,).

    Attributes:
        name: of the vector.
        unit: of its components.
        axes: names of its components.
        axial: whether it is an axis of rotation, as roll and pitch are to first order.
    """

    axes: tuple[str, str] = HEADED[:2]

    size = 2

    def mirror(self, image: Image) -> Mirror:
        """Return the reflection across the x-z plane."""
        return Mirror.with_signs(-1, 1) if self.axial else Mirror.with_signs(1, -1)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the rotation by the leg's turn."""
        return rotation(leg.turn)


@dataclasses.dataclass(frozen=True)
class Vector(_Components):
    """A vector (3,) in the world's frame, in that of the heading, or in the torso's.

    Attributes:
        name: of the vector.
        unit: of its components.
        axes: names of its components.
        axial: whether it is an axis of rotation, such as an angular velocity or a torque.
    """

    axes: tuple[str, str, str] = HEADED

    size = 3

    def mirror(self, image: Image) -> Mirror:
        """Return the reflection across the x-z plane."""
        return mirrors.AXIAL if self.axial else mirrors.POLAR

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the rotation by the leg's turn about the vertical axis."""
        return diagonal(rotation(leg.turn), np.eye(1))


@dataclasses.dataclass(frozen=True)
class Quaternion(Part):
    """An orientation (4,), w first: x and y turn as a planar vector.

    Attributes:
        name: of the quaternion.
    """

    name: str = ""

    size = 4

    def mirror(self, image: Image) -> Mirror:
        """Return the reflection across the x-z plane."""
        return mirrors.QUATERNION

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the rotation of x and y by the leg's turn."""
        return diagonal(np.eye(1), rotation(leg.turn), np.eye(1))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the names of the components."""
        yield from ((f"{self.name} {component}".strip(), "") for component in "wxyz")


@dataclasses.dataclass(frozen=True)
class Joints(Part):
    """A number for each joint (joints,). A leg sees those of its own joints.

    Attributes:
        body: with the joints.
        name: of the numbers; {} stands for the joint's name.
        unit: of the numbers.
        signed: whether signs depend on the direction of the joint's axis, as those of angles and torques do.
    """

    body: Body
    name: str = "{}"
    unit: str = ""
    signed: bool = True

    @property
    def size(self) -> int:
        """How many joints there are."""
        return len(self.body.joint_names)

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the joints across."""
        return mirrors.joints(image) if self.signed else Mirror.permute(image.joints)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (joints, joints of a leg) of the leg's own joints; 0 for joints that it lacks."""
        return (leg.joints if self.signed else abs(leg.joints)).T

    def padding(self, legs: int, joints: int) -> Padding:
        """Return places by leg and joint."""
        return Padding(legs * joints, np.array(joint_places(self.body, legs, joints)))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each joint."""
        yield from ((self.name.format(joint), self.unit) for joint in self.body.joint_names)


@dataclasses.dataclass(frozen=True)
class Legs(Part):
    """A number for each leg (legs,). A leg sees its own.

    Attributes:
        body: with the legs.
        name: of the numbers; {} stands for the leg's name.
        unit: of the numbers.
    """

    body: Body
    name: str = "{}"
    unit: str = ""

    @property
    def size(self) -> int:
        """How many legs there are."""
        return len(self.body.legs)

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the legs across."""
        return Mirror.permute(image.legs)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (legs, 1) of the leg's own number."""
        return np.eye(self.size)[:, [leg.index]]

    def padding(self, legs: int, joints: int) -> Padding:
        """Return places by leg."""
        if self.size > legs:
            raise ValueError(f"{self.body.name}: expected at most {legs} legs, got {self.size}")
        return Padding(legs, np.arange(self.size))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each leg."""
        yield from ((self.name.format(leg.name), self.unit) for leg in self.body.legs)


@dataclasses.dataclass(frozen=True)
class RigidParts(Part):
    """Parts for each rigid part of the body, one after the other. A leg sees those of the torso and its own.

    Attributes:
        body: with the rigid parts.
        parts: of each of them; {} in their names stands for the rigid part's name.
    """

    body: Body
    parts: tuple[Part, ...]

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self._share * len(self.body.part_names)

    @property
    def has_frame(self) -> bool:
        """Whether it is known how the numbers of its parts transform."""
        return all(part.has_frame for part in self.parts)

    @property
    def _share(self) -> int:
        """How many numbers a rigid part has."""
        return sum(part.size for part in self.parts)

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the rigid parts across."""
        return mirrors.repeat(image.parts, mirrors.join([part.mirror(image) for part in self.parts]))

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights of torso and leg; 0 for rigid parts that another leg has and this one lacks."""
        most = max(len(indices) for indices in self._by_leg)
        indices = [0, *self._by_leg[leg.index]]
        single = diagonal(*(part.view(leg) for part in self.parts))
        owners = np.zeros((len(self.body.part_names), 1 + most))
        owners[indices, range(len(indices))] = 1.0
        return np.kron(owners, single)

    def padding(self, legs: int, joints: int) -> Padding:
        """Return places by leg: links of up to so many joints, and the foot."""
        most = joints + 1
        if len(self._by_leg) > legs or any(len(indices) > most for indices in self._by_leg):
            raise ValueError(f"{self.body.name}: expected at most {legs} legs of at most {joints} links and a foot")
        slots = [0]
        for leg, indices in enumerate(self._by_leg):
            slots += [1 + most * leg + place for place in range(len(indices))]
        places = np.add.outer(self._share * np.array(slots), np.arange(self._share)).ravel()
        return Padding(self._share * (1 + most * legs), places)

    def places(self, name: str) -> np.ndarray:
        """Return the places of the numbers of a rigid part."""
        return self._share * self.body.part_names.index(name) + np.arange(self._share)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield names and units, by rigid part."""
        for rigid_part in self.body.part_names:
            for part in self.parts:
                yield from ((name.format(rigid_part), unit) for name, unit in part.entries())

    @functools.cached_property
    def _by_leg(self) -> list[list[int]]:
        """Indices of the rigid parts of each leg."""
        names = {name: index for index, name in enumerate(self.body.part_names)}
        return [[names[leg.full_name(part)] for part in leg.parts] for leg in self.body.legs]


@dataclasses.dataclass(frozen=True, eq=False)
class Phase(Part):
    """Sine and cosine of the phase of a gait (2,).

    Attributes:
        name: of the phase.
        offsets: (legs,) by which legs are ahead of the clock, rad: a leg sees its own phase. None where offsets change:
            a leg sees the clock. Offsets of legs across are then half a cycle apart.
        default_angles: (joints,) of the pose around which the gait moves, rad, which must be symmetric; None for any.
    """

    name: str = ""
    offsets: np.ndarray | None = None
    default_angles: np.ndarray | None = None

    size = 2

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the clock of the mirrored gait.

        Where left and right legs take turns, it is half a cycle later: its sine and cosine change sign.
        """
        default = self.default_angles
        if default is not None and not np.allclose(mirrors.joints(image)(default), default):
            raise ValueError("default_angles: expected mirrored poses left and right")
        if self.offsets is None:
            return Mirror.with_signs(-1, -1)
        for sign in (1, -1):  # of the clock's sine and cosine, whose leads over the legs across are 0 or half a cycle
            if np.allclose(np.exp(1j * self.offsets[image.legs]), sign * np.exp(1j * self.offsets)):
                return Mirror.with_signs(sign, sign)
        raise ValueError("phase_offsets: expected legs across from each other to move together, or half a cycle apart")

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the rotation from the clock to the leg's own phase."""
        return np.eye(2) if self.offsets is None else rotation(-self.offsets[leg.index])

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield sine and cosine."""
        yield from ((f"{function} of {self.name}".strip(), "") for function in ("sine", "cosine"))


@dataclasses.dataclass(frozen=True, eq=False)
class _Points(Part):
    """A number for each of some points in the torso's frame (n,)."""

    points: np.ndarray
    name: str = "{:.2f}, {:.2f}"
    unit: str = ""

    @property
    def size(self) -> int:
        """How many points there are."""
        return self.points.shape[1]

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the points across."""
        return Mirror.permute(_across(self.points))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each point."""
        yield from ((self.name.format(*point), self.unit) for point in self.points.T)


class Grid(_Points):
    """A number for each point of a grid in the torso's frame (n,), such as heights of the ground.

    A turned grid has points between those of this one, which needs four numbers a feature. So a leg sees the grid as
    the body does, in the mirror on the right, and the place of its foot in addition.

    Attributes:
        points: (2, n) forward and left, R.
        name: of the numbers; two {} stand for the coordinates.
        unit: of the numbers.
    """

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the place (2,) of the leg's foot."""
        return leg.foot


class Rays(_Points):
    """A number for each ray around the torso (n,), the first ahead, then evenly to the left.

    To a leg, rays turn as planar vectors do. Between two rays, their numbers are interpolated.

    Attributes:
        points: (2, n) directions, forward and left.
        name: of the numbers; {} stands for the angle in degrees.
        unit: of the numbers.
    """

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights of the two rays next to each ray of the leg."""
        steps = round(leg.turn * self.size / (2.0 * math.pi), _DIGITS)
        whole_steps = math.floor(steps)
        share = steps - whole_steps
        rays = np.eye(self.size)
        return (1.0 - share) * np.roll(rays, whole_steps, axis=1) + share * np.roll(rays, whole_steps + 1, axis=1)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each ray."""
        degrees = np.degrees(np.arctan2(self.points[1], self.points[0])) % 360.0
        yield from ((self.name.format(angle), self.unit) for angle in degrees)


@dataclasses.dataclass(frozen=True)
class Repeated(Part):
    """The same parts of several control steps, the latest first.

    Attributes:
        parts: of one control step.
        count: of control steps.
    """

    parts: tuple[Part, ...]
    count: int

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self.count * sum(part.size for part in self.parts)

    @property
    def has_frame(self) -> bool:
        """Whether it is known how the numbers of its parts transform."""
        return all(part.has_frame for part in self.parts)

    def mirror(self, image: Image) -> Mirror:
        """Return the map of each control step."""
        return mirrors.repeat(np.arange(self.count), mirrors.join([part.mirror(image) for part in self.parts]))

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights of each control step."""
        return np.kron(np.eye(self.count), diagonal(*(part.view(leg) for part in self.parts)))

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the constants of the parts, which are the same in each control step."""
        return np.concatenate([part.constants(leg) for part in self.parts])

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the places of each control step."""
        step = join_padding([part.padding(legs, joints) for part in self.parts])
        return join_padding([step] * self.count)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the names and units of each control step."""
        for step in range(1, self.count + 1):
            for part in self.parts:
                yield from ((f"{name}, {step} steps before", unit) for name, unit in part.entries())


@dataclasses.dataclass(frozen=True)
class Unframed(Part):
    """Numbers of which nobody knows how they transform: they have no mirror image, and legs cannot share a network.

    Attributes:
        size: how many there are.
        name: of the numbers; {} stands for the index.
        unit: of the numbers.
    """

    size: int = 1
    name: str = "{}"
    unit: str = ""

    has_frame = False

    def mirror(self, image: Image) -> Mirror:
        """Raise a ValueError, as there is no mirror image."""
        raise ValueError("numbers without a frame have no mirror image")

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Raise a ValueError, as legs may see them differently."""
        raise ValueError("numbers without a frame are not the same to every leg")

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each index."""
        yield from ((self.name.format(index), self.unit) for index in range(self.size))


def joint_places(body: Body, legs: int, joints: int) -> tuple[int, ...]:
    """Return the places (joints,) of a body's joints among those of so many legs of so many joints.

    Raises:
        ValueError: the body has more legs, or a leg more joints.
    """
    counts = [len(leg.joints) for leg in body.legs]
    if len(counts) > legs or max(counts) > joints:
        most = f"at most {legs} legs of at most {joints} joints"
        raise ValueError(f"{body.name}: expected {most}, got {len(counts)} legs of up to {max(counts)}")
    return tuple(joints * leg + joint for leg, count in enumerate(counts) for joint in range(count))


def join_padding(paddings: Sequence[Padding]) -> Padding:
    """Return the padding of vectors that are joined of the vectors of several parts."""
    starts = np.cumsum([0, *(padding.size for padding in paddings)])
    places = [start + padding.places for start, padding in zip(starts, paddings, strict=False)]
    return Padding(int(starts[-1]), np.concatenate(places))


def rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) that turns planar vectors (..., 2) by an angle, rad, from the right."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    return np.array(((cosine, sine), (-sine, cosine)))


def diagonal(*matrices: np.ndarray) -> np.ndarray:
    """Return the matrix with these on its diagonal, 0 elsewhere."""
    joined = np.zeros(np.sum([matrix.shape for matrix in matrices], axis=0))
    row = 0
    column = 0
    for matrix in matrices:
        joined[row : row + len(matrix), column : column + matrix.shape[1]] = matrix
        row += len(matrix)
        column += matrix.shape[1]
    return joined


def _across(points: np.ndarray) -> np.ndarray:
    """Return for each of the points (2, n) the index of the one across the x axis."""
    reflected = points * ((1.0,), (-1.0,))
    return np.square(points[:, None, :] - reflected[:, :, None]).sum(axis=0).argmin(axis=1)
