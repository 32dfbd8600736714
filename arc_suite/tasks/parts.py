"""Parts of observation blocks: the size of each, and how it transforms.

A part knows what its numbers are, such as a vector or angles of joints. From that follow its mirror image, what one leg
sees of it, its indices in vectors for many bodies, and the names of its entries. A task of another package uses these
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

HEADED = ("forward", "left", "up")  # axes of vectors relative to the heading of the torso
WORLD = ("world x", "world y", "world z")  # axes of vectors in the world's frame
ROTATIONS = ("roll", "pitch", "yaw")  # axes of angular velocities in the torso's frame

_RAY_STEP_DIGITS = 9  # decimals of a turn in steps between rays, so that whole steps stay whole


class ViewingLeg(NamedTuple):
    """A leg for which observations are transformed, such that it sees what the first leg would see in its place.

    Attributes:
        index: index of the leg in the body.
        turn: angle by which planar vectors are turned, rad.
        joints: (joints of a leg, joints) matrix that takes the joints of the leg from those of the body: the sign of
            the joint, 1 or -1, in its column, else 0.
        foot: (2,) place of the leg's foot in the standing pose, from the torso, forward and left, R.
    """

    index: int  # type: ignore[assignment]
    turn: float
    joints: np.ndarray
    foot: np.ndarray


class Padding(NamedTuple):
    """Where the numbers of one body lie in a longer vector, which has room for bodies with more legs and joints.

    Attributes:
        size: size of the longer vector.
        places: (numbers of the body,) index of each number in the longer vector.
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
        """Return the weights (size, features) of what a leg sees: each feature is a sum of at most two numbers."""
        return np.eye(self.size)

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the constants (n,) that a leg sees after the features of `view`."""
        return np.zeros(0)

    def padding(self, legs: int, joints: int) -> Padding:
        """Return where its numbers lie in vectors that have room for more legs and joints.

        Args:
            legs: number of legs that the vectors have room for.
            joints: number of joints of each of these legs.

        Raises:
            ValueError: the body has more legs, or a leg more joints.
        """
        return Padding(self.size, np.arange(self.size))

    @abstractmethod
    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit of every number."""


@dataclasses.dataclass(frozen=True)
class Scalar(Part):
    """A number that is the same to every leg, such as a height.

    Attributes:
        name: name of the number.
        unit: unit of the number.
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
    """A vector: one number along each axis."""

    name: str = ""
    unit: str = ""
    axes: tuple[str, ...] = ()
    axial: bool = False

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the names and units of the components."""
        for axis in self.axes:
            name = f"{self.name}, {axis}" if self.name else axis
            yield name, self.unit


@dataclasses.dataclass(frozen=True)
class Planar(_Components):
    """A horizontal vector (2,).

    Attributes:
        name: name of the vector.
        unit: unit of its components.
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
        name: name of the vector.
        unit: unit of its components.
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
        name: name of the quaternion.
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
        for component in "wxyz":
            yield f"{self.name} {component}".strip(), ""


@dataclasses.dataclass(frozen=True)
class Joints(Part):
    """A number for each joint (joints,). A leg sees those of its own joints.

    Attributes:
        body: with the joints.
        name: name of the numbers; {} stands for the joint's name.
        unit: unit of the numbers.
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
        """Return the map to the joints on the other side."""
        return mirrors.joints(image) if self.signed else Mirror.permute(image.joints)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (joints, joints of a leg) of the leg's own joints; 0 for joints that it lacks."""
        weights = leg.joints if self.signed else abs(leg.joints)
        return weights.T

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the padding by leg and joint."""
        return Padding(legs * joints, np.array(joint_places(self.body, legs, joints)))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each joint."""
        for joint in self.body.joint_names:
            yield self.name.format(joint), self.unit


@dataclasses.dataclass(frozen=True)
class Legs(Part):
    """A number for each leg (legs,). A leg sees its own.

    Attributes:
        body: with the legs.
        name: name of the numbers; {} stands for the leg's name.
        unit: unit of the numbers.
    """

    body: Body
    name: str = "{}"
    unit: str = ""

    @property
    def size(self) -> int:
        """How many legs there are."""
        return len(self.body.legs)

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the legs on the other side."""
        return Mirror.permute(image.legs)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (legs, 1) of the leg's own number."""
        return np.eye(self.size)[:, [leg.index]]

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the padding by leg."""
        if self.size > legs:
            raise ValueError(f"{self.body.name}: expected at most {legs} legs, got {self.size}")
        return Padding(legs, np.arange(self.size))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each leg."""
        for leg in self.body.legs:
            yield self.name.format(leg.name), self.unit


@dataclasses.dataclass(frozen=True)
class RigidParts(Part):
    """The same parts for each rigid part of the body. A leg sees those of the torso and of its own rigid parts.

    A rigid part is the torso, a link or a foot, which moves as a whole.

    Attributes:
        body: the body with the rigid parts.
        parts: the parts of each rigid part; {} in their names stands for the name of the rigid part.
    """

    body: Body
    parts: tuple[Part, ...]

    @property
    def size(self) -> int:
        """How many numbers there are."""
        return self._size_per_rigid_part * len(self.body.part_names)

    @property
    def has_frame(self) -> bool:
        """Whether it is known how the numbers of its parts transform."""
        return all(part.has_frame for part in self.parts)

    @property
    def _size_per_rigid_part(self) -> int:
        """How many numbers each rigid part has."""
        return sum(part.size for part in self.parts)

    def mirror(self, image: Image) -> Mirror:
        """Return the map to the rigid parts on the other side."""
        mirror_of_one = mirrors.join([part.mirror(image) for part in self.parts])
        return mirrors.repeat(image.parts, mirror_of_one)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights of torso and leg; 0 for rigid parts that another leg has and this one lacks."""
        torso_index = 0
        seen_indices = [torso_index, *self._indices_by_leg[leg.index]]
        max_parts_of_leg = max(len(indices) for indices in self._indices_by_leg)
        weights_of_one = diagonal(*(part.view(leg) for part in self.parts))
        selection = np.zeros((len(self.body.part_names), 1 + max_parts_of_leg))
        selection[seen_indices, np.arange(len(seen_indices))] = 1.0
        return np.kron(selection, weights_of_one)

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the padding by leg; a leg has room for a link with each joint, and a foot."""
        slots_of_leg = joints + 1
        if len(self._indices_by_leg) > legs or any(len(indices) > slots_of_leg for indices in self._indices_by_leg):
            raise ValueError(f"{self.body.name}: expected at most {legs} legs of at most {joints} links and a foot")
        slots = [0]  # the torso's, then those of the legs
        for leg_index, part_indices in enumerate(self._indices_by_leg):
            first_slot = 1 + slots_of_leg * leg_index
            slots += range(first_slot, first_slot + len(part_indices))
        size = self._size_per_rigid_part
        places = np.add.outer(size * np.array(slots), np.arange(size)).ravel()
        return Padding(size * (1 + slots_of_leg * legs), places)

    def places(self, name: str) -> np.ndarray:
        """Return the indices of the numbers of a rigid part, given its name."""
        size = self._size_per_rigid_part
        return size * self.body.part_names.index(name) + np.arange(size)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield names and units, by rigid part."""
        for rigid_part in self.body.part_names:
            for part in self.parts:
                for name, unit in part.entries():
                    yield name.format(rigid_part), unit

    @functools.cached_property
    def _indices_by_leg(self) -> list[list[int]]:
        """Indices of the rigid parts of each leg."""
        index_of_name = {name: index for index, name in enumerate(self.body.part_names)}
        indices_by_leg = []
        for leg in self.body.legs:
            indices_by_leg.append([index_of_name[leg.full_name(part)] for part in leg.parts])
        return indices_by_leg


@dataclasses.dataclass(frozen=True, eq=False)
class Phase(Part):
    """Sine and cosine of the phase of a gait (2,).

    Attributes:
        name: name of the phase.
        offsets: (legs,) phases by which legs are ahead of the clock, rad: a leg sees its own phase. None where offsets
            change with the gait: a leg sees the clock. Opposite legs are then half a cycle apart in each gait.
        default_angles: (joints,) angles of the pose around which the gait moves, rad, which must be symmetric;
            None where the pose does not count.
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
        # Phases as complex numbers, in which half a cycle is a change of sign.
        phases = np.exp(1j * self.offsets)
        phases_of_opposite_legs = np.exp(1j * self.offsets[image.legs])
        if np.allclose(phases_of_opposite_legs, phases):
            return Mirror.with_signs(1, 1)
        if np.allclose(phases_of_opposite_legs, -phases):
            return Mirror.with_signs(-1, -1)
        raise ValueError("phase_offsets: expected legs across from each other to move together, or half a cycle apart")

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the rotation from the clock to the leg's own phase."""
        return np.eye(2) if self.offsets is None else rotation(-self.offsets[leg.index])

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield sine and cosine."""
        for function in ("sine", "cosine"):
            yield f"{function} of {self.name}".strip(), ""


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
        """Return the map to the points on the other side."""
        return Mirror.permute(_find_opposite_points(self.points))

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each point."""
        for forward, left in self.points.T:
            yield self.name.format(forward, left), self.unit


class Grid(_Points):
    """A number for each point of a grid in the torso's frame (n,), such as heights of the ground.

    The points of a turned grid lie between those of this one: a feature would need four numbers. So a leg sees the grid
    without a turn. In addition, it sees the place of its foot. Legs on the right see both in the mirror.

    Attributes:
        points: (2, n) forward and left, R.
        name: name of the numbers; two {} stand for the coordinates.
        unit: unit of the numbers.
    """

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the place (2,) of the leg's foot."""
        return leg.foot


class Rays(_Points):
    """A number for each ray around the torso (n,): the first forward, the others at equal angles to the left.

    For a leg, rays turn as planar vectors do. Where a turned ray lies between two rays, their numbers are interpolated.

    Attributes:
        points: (2, n) directions, forward and left.
        name: name of the numbers; {} stands for the angle in degrees.
        unit: unit of the numbers.
    """

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights (rays, features) of the two rays next to each ray as the leg sees it."""
        steps = round(leg.turn * self.size / (2.0 * math.pi), _RAY_STEP_DIGITS)  # between rays
        whole_steps = math.floor(steps)
        share = steps - whole_steps
        rays = np.eye(self.size)
        return (1.0 - share) * np.roll(rays, whole_steps, axis=1) + share * np.roll(rays, whole_steps + 1, axis=1)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the name and the unit for each ray."""
        degrees = np.degrees(np.arctan2(self.points[1], self.points[0])) % 360.0
        for angle in degrees:
            yield self.name.format(angle), self.unit


@dataclasses.dataclass(frozen=True)
class Repeated(Part):
    """The same parts of several control steps, the latest first.

    Attributes:
        parts: the parts of one control step.
        count: number of control steps.
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
        mirror_of_step = mirrors.join([part.mirror(image) for part in self.parts])
        return mirrors.repeat(np.arange(self.count), mirror_of_step)

    def view(self, leg: ViewingLeg) -> np.ndarray:
        """Return the weights of each control step."""
        weights_of_step = diagonal(*(part.view(leg) for part in self.parts))
        return np.kron(np.eye(self.count), weights_of_step)

    def constants(self, leg: ViewingLeg) -> np.ndarray:
        """Return the constants of the parts, which are the same in each control step."""
        return np.concatenate([part.constants(leg) for part in self.parts])

    def padding(self, legs: int, joints: int) -> Padding:
        """Return the padding of each control step."""
        padding_of_step = join_padding([part.padding(legs, joints) for part in self.parts])
        return join_padding([padding_of_step] * self.count)

    def entries(self) -> Iterator[tuple[str, str]]:
        """Yield the names and units of each control step."""
        for step in range(1, self.count + 1):
            for part in self.parts:
                for name, unit in part.entries():
                    yield f"{name}, {step} steps before", unit


@dataclasses.dataclass(frozen=True)
class Unframed(Part):
    """Numbers without a known frame: they have no mirror image, and legs that see them cannot share a network.

    Attributes:
        size: how many there are.
        name: name of the numbers; {} stands for the index.
        unit: unit of the numbers.
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
        for index in range(self.size):
            yield self.name.format(index), self.unit


def joint_places(body: Body, legs: int, joints: int) -> tuple[int, ...]:
    """Return the indices (joints,) of a body's joints in a vector that has room for more legs and joints.

    Args:
        body: the body.
        legs: number of legs that the vector has room for.
        joints: number of joints of each of these legs.

    Raises:
        ValueError: the body has more legs, or a leg more joints.
    """
    counts = [len(leg.joints) for leg in body.legs]
    if len(counts) > legs or max(counts) > joints:
        expected = f"at most {legs} legs of at most {joints} joints"
        raise ValueError(f"{body.name}: expected {expected}, got {len(counts)} legs of up to {max(counts)}")
    places: list[int] = []
    for leg_index, count in enumerate(counts):
        first_place = joints * leg_index
        places += range(first_place, first_place + count)
    return tuple(places)


def join_padding(paddings: Sequence[Padding]) -> Padding:
    """Return the padding of concatenated vectors, given the padding of each."""
    size = 0
    places = []
    for padding in paddings:
        places.append(size + padding.places)
        size += padding.size
    return Padding(size, np.concatenate(places))


def rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) that turns planar vectors (..., 2) by an angle, rad, from the right."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    return np.array(((cosine, sine), (-sine, cosine)))


def diagonal(*matrices: np.ndarray) -> np.ndarray:
    """Return the block diagonal matrix: some matrices one after the other on its diagonal, 0 elsewhere."""
    total_shape = np.sum([matrix.shape for matrix in matrices], axis=0)
    block_diagonal = np.zeros(total_shape)
    row = 0
    column = 0
    for matrix in matrices:
        rows, columns = matrix.shape
        block_diagonal[row : row + rows, column : column + columns] = matrix
        row += rows
        column += columns
    return block_diagonal


def _find_opposite_points(points: np.ndarray) -> np.ndarray:
    """Return for each of the points (2, n) the index (n,) of its reflection across the x axis."""
    reflections = points * ((1.0,), (-1.0,))
    squared_distances = np.square(points[:, None, :] - reflections[:, :, None]).sum(axis=0)
    return squared_distances.argmin(axis=1)
