"""A motion: frames of a body at a fixed rate, in the world, with the paths of its feet in standing heights."""

from typing import NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.models.kinematics import Legs
from arc_suite.models.posture import find_rest_pose
from arc_suite.motions.ground_poses import find_headings
from arc_suite.robots import mirror as mirrors
from arc_suite.robots.spec import Body

MAX_FRAMES = 1 << 16  # 18 minutes at 60 Hz
MIN_RATE = 1.0  # Hz
MAX_RATE = 1000.0  # Hz

MAX_NAME = 200  # characters
MAX_NUMBER = 1e5  # m, rad or standing heights
MAX_PLANTED_HEIGHT = 0.03  # standing heights: a sole that is lower is planted
MAX_SEAM = 0.05  # rad, or standing heights, between the last frame of a loop and its first
_MAX_HEIGHT_ERROR = 1e-6  # of a standing height, relative

_REFLECTION = np.array((1.0, -1.0, 1.0))  # factors on a point
_QUATERNION_REFLECTION = np.array((1.0, -1.0, 1.0, -1.0))  # w first


class Motion(NamedTuple):
    """Frames of a body at a fixed rate, both ends included. It starts above the origin and heads along +x.

    A loop ends with its first frame, moved over the ground and turned about the vertical by the displacement of a
    cycle. A frame is at `index / frame_rate` seconds.

    Attributes:
        name: of the motion.
        body: name of the body that it was drawn for.
        standing_height: of that body, m.
        joint_names: names of its joints, in the order of `angles`.
        leg_names: names of its legs, in the order of `soles`.
        frame_rate: Hz.
        loops: whether the motion repeats.
        positions: (frames, 3) positions of the torso, m.
        quaternions: (frames, 4) quaternions of the torso, w first, whose signs do not jump.
        angles: (frames, joints) joint angles from the standing pose, rad.
        planted: (frames, legs) whether a foot stands, booleans.
        soles: (frames, legs, 3) positions of the soles in the world, standing heights.
        rest_soles: (legs, 3) soles of that body at rest, from the ground below its torso, standing heights.
        rest_height: height of the torso over the ground at rest, standing heights; of most bodies 1.
    """

    name: str
    body: str
    standing_height: float
    joint_names: tuple[str, ...]
    leg_names: tuple[str, ...]
    frame_rate: float
    loops: bool
    positions: np.ndarray
    quaternions: np.ndarray
    angles: np.ndarray
    planted: np.ndarray
    soles: np.ndarray
    rest_soles: np.ndarray
    rest_height: float

    @property
    def frames(self) -> int:
        """Number of frames, both ends included."""
        return len(self.positions)

    @property
    def seconds(self) -> float:
        """Duration, s; of a loop, that of a cycle."""
        return (self.frames - 1) / self.frame_rate

    @property
    def displacement(self) -> np.ndarray:
        """Displacement (3,) of the torso from the first frame to the last: forward and left, m, and turn, rad."""
        headings = find_headings(self.quaternions)
        shift = self.positions[-1, :2] - self.positions[0, :2]
        return np.append(rotations.to_heading_frame(shift, headings[0]), headings[-1] - headings[0])


def make(
    body: Body,
    name: str,
    frame_rate: float,
    loops: bool,
    positions: np.ndarray,
    quaternions: np.ndarray,
    angles: np.ndarray,
    planted: np.ndarray | None = None,
) -> Motion:
    """Return a motion of a body, moved to its start above the origin.

    Args:
        body: the body that moves.
        name: of the motion, printable.
        frame_rate: Hz.
        loops: whether the motion repeats; the last frame is the first one, moved by a cycle's displacement.
        positions: (frames, 3) positions of the torso in the world, m.
        quaternions: (frames, 4) quaternions of the torso, w first, of any length above 0.
        angles: (frames, joints) joint angles from the standing pose, rad.
        planted: (frames, legs) booleans; None for feet whose soles are near the ground.

    Raises:
        ValueError: too few or too many frames, other shapes, numbers that are not finite, a loop that does not close,
            or a name that is empty, too long or not printable.
    """
    legs = Legs.of(body)
    standing_height = body.torso.standing_height
    positions = np.asarray(positions, float)
    quaternions = np.asarray(quaternions, float)
    angles = np.asarray(angles, float)
    _check_shapes(positions, quaternions, angles, len(body.joint_names))
    quaternions = make_continuous(quaternions)
    positions, quaternions = _start_at_origin(positions, quaternions)
    soles = find_soles(legs, positions, quaternions, angles) / standing_height
    rest_soles, rest_height = find_rest(body)
    if planted is None:
        planted = soles[..., 2] < MAX_PLANTED_HEIGHT
    motion = Motion(
        name=name,
        body=body.name,
        standing_height=standing_height,
        joint_names=body.joint_names,
        leg_names=tuple([leg.name for leg in body.legs]),
        frame_rate=float(frame_rate),
        loops=checks.boolean("loops", loops),
        positions=positions,
        quaternions=quaternions,
        angles=angles,
        planted=np.asarray(planted, bool),
        soles=soles,
        rest_soles=rest_soles / standing_height,
        rest_height=rest_height / standing_height,
    )
    return check_motion(motion)


def check_motion(motion: Motion) -> Motion:
    """Return a motion after a check of its name and its numbers.

    Raises:
        ValueError: see `make`.
    """
    check_name("name", motion.name)
    checks.boolean("loops", motion.loops)
    checks.number("frame_rate", motion.frame_rate, MIN_RATE, MAX_RATE)
    checks.number("standing_height", motion.standing_height, 1e-6, 1e3)
    checks.number("rest_height", motion.rest_height, 1e-3, 1e3)
    _check_frames(motion.frames)
    frames = motion.frames
    joints = len(motion.joint_names)
    legs = len(motion.leg_names)
    for field, shape in array_shapes(frames, joints, legs).items():
        values = getattr(motion, field)
        _check_shape(field, values, shape)
        if not np.isfinite(values).all():
            raise ValueError(f"{field}: expected finite numbers in frame {_first_bad_frame(values)}")
        if abs(values).max(initial=0.0) > MAX_NUMBER:
            raise ValueError(f"{field}: expected numbers up to {MAX_NUMBER:g}, got {abs(values).max():.3g}")
    lengths = np.linalg.norm(motion.quaternions, axis=-1)
    if abs(lengths - 1.0).max() > 1e-6:
        raise ValueError("quaternions: expected unit quaternions")
    if motion.loops:
        _check_loop(motion)
    return motion


def check_name(field: str, name: str) -> None:
    """Check that a text can name a motion or a part of its body.

    Raises:
        ValueError: it is empty, too long, or not printable.
    """
    if not (isinstance(name, str) and name.isprintable() and 0 < len(name) <= MAX_NAME):
        raise ValueError(f"{field}: expected printable names of 1 to {MAX_NAME} characters, got {checks.preview(name)}")


def fits(motion: Motion, body: Body) -> bool:
    """Return whether a motion was drawn for a body: the same joints and legs, and the same standing height."""
    return _describe_misfit(motion, body) is None


def array_shapes(frames: int, joints: int, legs: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of a motion by name, given its numbers of frames, joints and legs."""
    return {
        "positions": (frames, 3),
        "quaternions": (frames, 4),
        "angles": (frames, joints),
        "planted": (frames, legs),
        "soles": (frames, legs, 3),
        "rest_soles": (legs, 3),
    }


def check_body(motion: Motion, body: Body) -> None:
    """Check that a motion was drawn for a body; see `fits`.

    Raises:
        ValueError: the motion is of another body.
    """
    misfit = _describe_misfit(motion, body)
    if misfit is not None:
        raise ValueError(
            f"motion {motion.name!r} is of {motion.body!r}: {misfit}; "
            f"`arc-suite motion FILE --robot {body.name} -o OUT.npz` makes it one of {body.name}"
        )


def _describe_misfit(motion: Motion, body: Body) -> str | None:
    """Return the first difference of the bodies of a motion and of a spec; None if there is none."""
    leg_names = tuple([leg.name for leg in body.legs])
    for kind, names, expected_names in (
        ("joint", motion.joint_names, body.joint_names),
        ("leg", motion.leg_names, leg_names),
    ):
        if len(names) != len(expected_names):
            return f"expected {len(expected_names)} {kind}s, got {len(names)}"
        for name, expected_name in zip(names, expected_names, strict=True):
            if name != expected_name:
                return f"expected {kind} {expected_name}, got {name}"
    height = body.torso.standing_height
    if not np.isclose(motion.standing_height, height, rtol=_MAX_HEIGHT_ERROR):
        return f"expected a standing height of {height:g} m, got {motion.standing_height:g} m"
    return None


def mirror(motion: Motion, body: Body) -> Motion:
    """Return the left-right mirror image of a motion of a symmetric body.

    Raises:
        ValueError: the body has no left-right symmetry, or the motion is of another body.
    """
    check_body(motion, body)
    image = mirrors.image(body)
    return motion._replace(
        positions=motion.positions * _REFLECTION,
        quaternions=motion.quaternions * _QUATERNION_REFLECTION,
        angles=motion.angles[:, image.joints] * image.signs,
        planted=motion.planted[:, image.legs],
        soles=motion.soles[:, image.legs] * _REFLECTION,
        rest_soles=motion.rest_soles[image.legs] * _REFLECTION,
    )


def find_rest(body: Body) -> tuple[np.ndarray, float]:
    """Return the soles (legs, 3) of a body at rest, from the ground below its torso, and the torso's height, m."""
    soles = find_rest_pose(body).sole_positions
    height = float(-soles[:, 2].min())
    return soles + (0.0, 0.0, height), height


def find_soles(legs: Legs, positions: np.ndarray, quaternions: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the positions (frames, legs, 3) of the soles in the world, m: the lowest points of feet.

    Args:
        legs: legs of the body.
        positions: (frames, 3) of the torso, m.
        quaternions: (frames, 4) of the torso.
        angles: (frames, joints) rad.
    """
    below_foot = legs.radii[:, None] * (0.0, 0.0, 1.0)
    soles = legs.sole_positions(legs.by_leg(angles))  # in the torso's frame; below the feet where the torso is level
    centers = (rotations.matrix(quaternions)[:, None] @ (soles + below_foot)[..., None])[..., 0]
    return positions[:, None] + centers - below_foot


def _start_at_origin(positions: np.ndarray, quaternions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and quaternions moved over the ground: the first frame is above the origin and heads along x."""
    heading = rotations.yaw(quaternions[0])
    ground = rotations.to_heading_frame(positions[:, :2] - positions[0, :2], heading)
    return np.concatenate([ground, positions[:, 2:]], axis=-1), rotations.turn_about_z(quaternions, -heading)


def make_continuous(quaternions: np.ndarray) -> np.ndarray:
    """Return the same orientations (frames, 4) of length 1, with signs that do not jump, and w of the first positive.

    Raises:
        ValueError: a quaternion of length 0, or one that is not finite.
    """
    if quaternions.ndim != 2 or quaternions.shape[-1] != 4 or not len(quaternions):
        raise ValueError(f"quaternions: expected numbers of shape (frames, 4), got {quaternions.shape}")
    lengths = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    is_valid = np.isfinite(lengths) & (lengths > 1e-9)
    if not is_valid.all():
        raise ValueError(f"quaternions: expected finite ones above 0 in frame {int(is_valid[:, 0].argmin())}")
    return continue_signs(quaternions) / lengths


def continue_signs(quaternions: np.ndarray) -> np.ndarray:
    """Return the same orientations (frames, 4) with signs that do not jump, and w of the first not negative."""
    flips = (quaternions[1:] * quaternions[:-1]).sum(axis=-1) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    if quaternions[0, 0] < 0.0:
        signs = -signs
    return quaternions * signs[:, None]


def _check_frames(frames: int) -> None:
    if not 2 <= frames <= MAX_FRAMES:
        raise ValueError(f"frames: expected from 2 to {MAX_FRAMES}, got {frames}")


def _check_shapes(positions: np.ndarray, quaternions: np.ndarray, angles: np.ndarray, joints: int) -> None:
    """Check that arrays have as many frames, and the numbers of a pose in each."""
    frames = positions.shape[:1]  # a number has none
    _check_shape("positions", positions, (*frames, 3))
    _check_shape("quaternions", quaternions, (*frames, 4))
    _check_shape("angles", angles, (*frames, joints))
    _check_frames(len(positions))


def _check_shape(field: str, values: np.ndarray, shape: tuple[int, ...]) -> None:
    if values.shape != shape:
        raise ValueError(f"{field}: expected numbers of shape {shape}, got {values.shape}")


def _check_loop(motion: Motion) -> None:
    """Check that the last frame of a loop is its first one, up to a displacement over the ground."""
    angle_seam = abs(motion.angles[-1] - motion.angles[0]).max(initial=0.0)
    upright_seam = abs(_verticals(motion.quaternions[-1]) - _verticals(motion.quaternions[0])).max()
    height_seam = abs(motion.positions[-1, 2] - motion.positions[0, 2]) / motion.standing_height
    if max(angle_seam, upright_seam, height_seam) > MAX_SEAM:
        raise ValueError(
            f"loops: expected the last frame to be the first one: joints differ by {angle_seam:.3g} rad, "
            f"the torso's tilt by {upright_seam:.3g} rad, its height by {height_seam:.3g} standing heights"
        )


def _verticals(quaternion: np.ndarray) -> np.ndarray:
    """Return the world's vertical (3,) in the frame of the torso."""
    return rotations.matrix(quaternion)[2]


def _first_bad_frame(values: np.ndarray) -> int:
    is_finite = np.isfinite(values).reshape(len(values), -1).all(axis=-1)
    return int(is_finite.argmin())
