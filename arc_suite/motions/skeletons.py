"""From the bones of somebody's file to the joints of a body: rotations relative to the pose that bones are bound in.

Tools turn the axes of bones, but not what a bone does to the mesh: the rotation from the bound pose to a frame. The
rotation of a bone relative to the one above it, projected on the hinge, is how far the joint is from its bound angle.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.models.kinematics import Legs
from arc_suite.motions.motion import MAX_SEAM, Motion, make, make_continuous
from arc_suite.robots.spec import Body

# From axes with y up and z ahead, as of glTF, to those of the suite, x ahead and z up.
FROM_Y_UP = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
LOOP_SUFFIX = "_loop"  # of the names of animations that repeat
_IN_PLACE_SUFFIX = "_in_place"  # of the names of animations whose root stays although the clip moves
# From what these make of axes with z up and -y ahead, as of Blender.
_FROM_Z_UP = np.array(((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
_MIN_UPRIGHT = 0.7  # cosine of the torso's tilt in the bound pose

CURE = "; --of names the body of the file"  # ends errors of files that may be of another body
_MAX_LENGTH_ERROR = 0.02  # standing heights, of a bone that belongs to the body
_MAX_SCALE_ERROR = 0.01  # of a file whose unit is a meter
_MAX_BIND_MISS = 0.02  # standing heights, of a bone in the bound pose
_MIN_NAMED_MISS = 0.05  # degrees, or hundredths of a standing height
_MIN_NAMED_SEAM = 0.1  # the same, of a loop

# The search for the bound pose; see `_minimize`.
_ITERATIONS = 60
_DIFFERENCE = 1e-6  # rad or standing heights
_DAMPING = 1e-6


class Skeleton(NamedTuple):
    """Bones of a file over time, in the axes of the suite: x ahead, z up.

    Attributes:
        name: of the motion.
        frame_rate: Hz.
        loops: whether the motion repeats.
        bones: names.
        bind_positions: (bones, 3) where bones begin in the bound pose, in any unit.
        positions: (frames, bones, 3) where they begin, in any unit.
        turns: (frames, bones, 3, 3) rotations from the bound pose to each frame, in the world.
    """

    name: str
    frame_rate: float
    loops: bool
    bones: tuple[str, ...]
    bind_positions: np.ndarray
    positions: np.ndarray
    turns: np.ndarray


class _Chain(NamedTuple):
    """The parts of a body, the torso first: links and feet of legs.

    Attributes:
        legs: kinematics, whose shorter legs end in links without length.
        leg: (parts,) index of the leg; 0 for the torso.
        link: (parts,) index of the link; that of a foot is the number of links.
        parents: (parts,) index of the part above.
    """

    legs: Legs
    leg: np.ndarray
    link: np.ndarray
    parents: np.ndarray

    @classmethod
    def of(cls, body: Body) -> "_Chain":
        leg_indices = [0]
        link_indices = [0]
        parents = [0]
        for leg_index, leg in enumerate(body.legs):
            for link_index in range(len(leg.parts)):
                parents.append(0 if link_index == 0 else len(parents) - 1)
                leg_indices.append(leg_index)
                link_indices.append(link_index)
        return cls(Legs.of(body, used=1.0), np.array(leg_indices), np.array(link_indices), np.array(parents))

    def place(self, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where parts begin, (..., parts, 3), and the axes of their joints, 0 without one, in the torso's frame.

        Args:
            angles: (..., joints) rad.
        """
        beginnings, axes = self.legs.places(self.legs.by_leg(angles))
        positions = beginnings[..., self.leg[1:], self.link[1:], :]
        part_axes = axes[..., self.leg[1:], self.link[1:], :]
        torso = np.zeros((*positions.shape[:-2], 1, 3))
        return np.concatenate([torso, positions], axis=-2), np.concatenate([torso, part_axes], axis=-2)


class _BindPose(NamedTuple):
    """The pose that bones are bound in: orientation (3, 3) and position (3,) of the torso, and angles (joints,)."""

    orientation: np.ndarray
    position: np.ndarray
    angles: np.ndarray


def clip_of_animation(name: str) -> str:
    """Return the name of the clip of an animation, as `arc-suite animate` names animations after clips."""
    return name.removesuffix(LOOP_SUFFIX).removesuffix(_IN_PLACE_SUFFIX) or name


def fit_skeleton(body: Body, skeleton: Skeleton) -> tuple[Motion, list[str]]:
    """Return the motion of a body that a skeleton has, and a line for each thing that was changed.

    Args:
        body: the body that moves.
        skeleton: its bones, with y up in the file, or else z.

    Raises:
        ValueError: a bone is missing or has another length than the body's, or a number is not finite.
    """
    chain = _Chain.of(body)
    bones = _choose_bones(body, chain, skeleton)
    bind_pose = _find_bind_pose(body, chain, bones.bind_positions)
    if bind_pose.orientation[2, 2] < _MIN_UPRIGHT:  # z points up in the file
        bones = _choose_bones(body, chain, _turn(skeleton, _FROM_Z_UP))
        bind_pose = _find_bind_pose(body, chain, bones.bind_positions)
    if bind_pose.orientation[2, 2] < _MIN_UPRIGHT:
        raise ValueError(f"bones: expected a bound pose of {body.name} that stands upright")
    angles, off_hinge = _find_angles(chain, bind_pose, bones.turns)
    torso_turns = bones.turns[:, 0] @ bind_pose.orientation
    notes = [
        *_note_scale(bones.scale),
        *_note_turns_off_hinges(body, off_hinge),
        *_note_misses(body, chain, bones.positions, torso_turns, angles),
    ]
    positions = bones.positions[:, 0]
    quaternions = rotations.from_matrix(torso_turns)
    if skeleton.loops:
        positions, quaternions, angles, notes_of_loop = close_loop(body, positions, quaternions, angles)
        notes += notes_of_loop
    motion = make(body, skeleton.name, skeleton.frame_rate, skeleton.loops, positions, quaternions, angles)
    return motion, notes


class _Bones(NamedTuple):
    """The bones of a skeleton that are parts of a body, in its order, in m; see `Skeleton`.

    Attributes:
        bind_positions: (parts, 3) where they begin in the bound pose.
        positions: (frames, parts, 3) where they begin.
        turns: (frames, parts, 3, 3) rotations from the bound pose to each frame.
        scale: lengths of the file were divided by it.
    """

    bind_positions: np.ndarray
    positions: np.ndarray
    turns: np.ndarray
    scale: float


def _choose_bones(body: Body, chain: _Chain, skeleton: Skeleton) -> _Bones:
    """Return the bones of a body's parts; a ValueError if one is missing or has another length."""
    indices = _find_bones(body, skeleton.bones)
    bind_positions = skeleton.bind_positions[indices]
    positions = skeleton.positions[:, indices]
    bind_scale = _find_scale(body, chain, bind_positions)
    scale = _find_scale(body, chain, positions[0])
    return _Bones(bind_positions / bind_scale, positions / scale, skeleton.turns[:, indices], scale)


def _note_scale(scale: float) -> list[str]:
    """Return a line for lengths that are not in m."""
    if abs(scale - 1.0) <= _MAX_SCALE_ERROR:
        return []
    return [f"lengths are divided by {scale:.4g}"]


def _note_turns_off_hinges(body: Body, off_hinge: np.ndarray) -> list[str]:
    """Return a line for the largest turn (frames, parts), rad, that is not about the hinge of its part."""
    frame, part = np.unravel_index(off_hinge.argmax(), off_hinge.shape)
    degrees = float(np.degrees(off_hinge.max()))
    if degrees <= _MIN_NAMED_MISS:
        return []
    name = body.part_names[part]
    return [f"{name} turns {degrees:.2g} degrees about other axes than its hinge in frame {frame}; they are left out"]


def _note_misses(
    body: Body, chain: _Chain, positions: np.ndarray, torso_turns: np.ndarray, angles: np.ndarray
) -> list[str]:
    """Return a line for the part that is farthest from its bone.

    Args:
        body: the body that moves.
        chain: its parts.
        positions: (frames, parts, 3) where bones begin, m.
        torso_turns: (frames, 3, 3) orientations of the torso.
        angles: (frames, joints) rad.
    """
    parts_from_torso, _ = chain.place(angles)
    part_positions = positions[:, :1] + (torso_turns[:, None] @ parts_from_torso[..., None])[..., 0]
    misses = np.linalg.norm(part_positions - positions, axis=-1) / body.torso.standing_height
    if misses.max() <= 0.01 * _MIN_NAMED_MISS:
        return []
    name = body.part_names[int(misses.max(axis=0).argmax())]
    return [f"{name} misses its place by {misses.max():.3f} standing heights"]


def _turn(skeleton: Skeleton, rotation: np.ndarray) -> Skeleton:
    """Return a skeleton in other axes."""
    return skeleton._replace(
        bind_positions=skeleton.bind_positions @ rotation.T,
        positions=skeleton.positions @ rotation.T,
        turns=rotation @ skeleton.turns @ rotation.T,
    )


def close_loop(
    body: Body, positions: np.ndarray, quaternions: np.ndarray, angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Return a loop whose last frame is its first one, moved over the ground, and lines that say how far it was open.

    The last quarter of the loop takes up the difference. A loop that is open by more than `MAX_SEAM` stays open.

    Args:
        body: the body that moves.
        positions: (frames, 3) of the torso, m.
        quaternions: (frames, 4) of the torso.
        angles: (frames, joints) rad.
    """
    quaternions = make_continuous(quaternions)
    turn = rotations.yaw(quaternions[-1]) - rotations.yaw(quaternions[0])
    last_quaternion = rotations.turn_about_z(quaternions[0], turn)
    if last_quaternion @ quaternions[-1] < 0.0:
        last_quaternion = -last_quaternion
    angle_difference = angles[0] - angles[-1]
    quaternion_difference = last_quaternion - quaternions[-1]
    height_difference = positions[0, 2] - positions[-1, 2]
    seam = float(max(abs(angle_difference).max(initial=0.0), 2.0 * np.linalg.norm(quaternion_difference)))
    height_seam = float(abs(height_difference) / body.torso.standing_height)
    if max(seam, height_seam) > MAX_SEAM:
        return positions, quaternions, angles, []
    share = (np.linspace(-3.0, 1.0, len(angles)).clip(0.0))[:, None]
    weights = share**2 * (3.0 - 2.0 * share)
    positions = positions + weights * (0.0, 0.0, height_difference)
    quaternions = quaternions + weights * quaternion_difference
    return positions, quaternions, angles + weights * angle_difference, _note_seams(seam, height_seam)


def _note_seams(seam: float, height_seam: float) -> list[str]:
    """Return a line for a loop that was open by a turn, rad, and one for a height of the torso, standing heights."""
    notes = []
    if seam > np.radians(_MIN_NAMED_SEAM):
        notes.append(f"the loop was open by {np.degrees(seam):.2g} degrees, which its end takes up")
    if height_seam > 0.01 * _MIN_NAMED_SEAM:
        notes.append(f"the loop was open by {height_seam:.2g} standing heights of the torso, which its end takes up")
    return notes


def _find_bones(body: Body, bones: tuple[str, ...]) -> list[int]:
    """Return the indices of the bones of a body's parts.

    Raises:
        ValueError: a bone is missing.
    """
    indices = []
    for name in body.part_names:
        if name not in bones:
            hint = checks.hint(name, bones)
            raise ValueError(f"bones: expected those of {body.name}, and there is no {name}{hint}{CURE}")
        indices.append(bones.index(name))
    return indices


def _find_scale(body: Body, chain: _Chain, positions: np.ndarray) -> float:
    """Return the size of a skeleton's positions (parts, 3) in those of the body.

    Raises:
        ValueError: a bone has another length than that of the body.
    """
    resting_positions, _ = chain.place(np.zeros(len(body.joint_names)))
    expected = np.linalg.norm(resting_positions - resting_positions[chain.parents], axis=-1)
    lengths = np.linalg.norm(positions - positions[chain.parents], axis=-1)
    scale = lengths.sum() / expected.sum()
    if not np.isfinite(scale) or scale <= 0.0:
        raise ValueError("bones: expected finite positions, not all in one place")
    errors = abs(lengths / scale - expected)
    if errors.max() > _MAX_LENGTH_ERROR * body.torso.standing_height:
        worst = int(errors.argmax())
        raise ValueError(
            f"bones: expected {body.part_names[worst]} of {body.name} at {expected[worst]:.4g} m from the bone above "
            f"it, got {lengths[worst] / scale:.4g} m{CURE}"
        )
    return float(scale)


def _find_bind_pose(body: Body, chain: _Chain, positions: np.ndarray) -> _BindPose:
    """Return the pose of a body whose parts begin at positions (parts, 3), m."""
    height = body.torso.standing_height
    joints = len(body.joint_names)
    goals = positions / height
    resting_positions, _ = chain.place(np.zeros(joints))
    start = _align(resting_positions / height, goals)

    def measure_misses(parameters: np.ndarray) -> np.ndarray:
        """Return misses (..., parts, 3) at a turn and a shift of the torso and at angles, (..., 3 + 3 + joints)."""
        turns, shifts, angles = np.split(parameters, (3, 6), axis=-1)
        parts, _ = chain.place(angles)
        matrices = start.orientation @ _rotation_matrices(turns)
        return (matrices[..., None, :, :] @ (parts / height)[..., None])[..., 0] + shifts[..., None, :] - goals

    best = _minimize(measure_misses, np.concatenate([np.zeros(3), start.position, np.zeros(joints)]))
    miss = np.linalg.norm(measure_misses(best), axis=-1).max()
    if miss > _MAX_BIND_MISS:
        raise ValueError(
            f"bones: expected a bound pose of {body.name}, and the nearest one misses by {miss:.3f} standing heights"
        )
    turn, shift, angles = np.split(best, (3, 6))
    return _BindPose(start.orientation @ _rotation_matrices(turn), shift * height, angles)


def _minimize(measure: Callable[[np.ndarray], np.ndarray], start: np.ndarray) -> np.ndarray:
    """Return parameters (n,) with the least sum of squares, by Levenberg and Marquardt.

    Args:
        measure: returns numbers, of any shape, of parameters (..., n).
        start: (n,) parameters to begin with.
    """
    best = start
    residual = measure(best).ravel()
    damping = _DAMPING
    for _ in range(_ITERATIONS):
        nearby = best + _DIFFERENCE * np.eye(len(best))
        jacobian = (measure(nearby).reshape(len(best), -1) - residual).T / _DIFFERENCE
        normal = jacobian.T @ jacobian
        change = np.linalg.solve(normal + damping * np.eye(len(best)), -jacobian.T @ residual)
        candidate = best + change
        candidate_residual = measure(candidate).ravel()
        if candidate_residual @ candidate_residual < residual @ residual:
            best = candidate
            residual = candidate_residual
            damping = max(0.1 * damping, 1e-12)
        else:
            damping *= 10.0
        if abs(change).max() < 1e-10:
            break
    return best


def _align(points: np.ndarray, goals: np.ndarray) -> _BindPose:
    """Return the rotation and shift that bring points (n, 3) nearest to goals, after Kabsch."""
    center = points.mean(axis=0)
    goal_center = goals.mean(axis=0)
    left, _, right = np.linalg.svd((goals - goal_center).T @ (points - center))
    signs = np.array((1.0, 1.0, np.linalg.det(left @ right)))
    orientation = left * signs @ right
    return _BindPose(orientation, goal_center - orientation @ center, np.zeros(0))


def _find_angles(chain: _Chain, bind_pose: _BindPose, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the joint angles (frames, joints), and the turns off hinges (frames, parts), rad."""
    _, axes = chain.place(bind_pose.angles)
    axes = axes @ bind_pose.orientation.T  # in the world, in the bound pose
    relative_turns = turns[:, chain.parents].swapaxes(-1, -2) @ turns
    quaternions = rotations.from_matrix(relative_turns)
    # A rotation is a turn about the hinge, with these two numbers of its quaternion, and then one about an axis across.
    cosines = quaternions[..., 0]
    sines = (quaternions[..., 1:] * axes).sum(axis=-1)
    half_turns = np.arctan2(sines, cosines)
    half_turns = np.unwrap(half_turns, period=np.pi, axis=0)  # q and -q are one rotation
    half_turns -= np.pi * np.round(half_turns[:1] / np.pi)  # the first one is the shorter way round
    off_hinge = 2.0 * np.arccos(np.hypot(sines, cosines).clip(0.0, 1.0))
    off_hinge[:, 0] = 0.0  # the torso is free
    has_hinge = axes.any(axis=-1)
    return bind_pose.angles + 2.0 * half_turns[:, has_hinge], off_hinge


def _rotation_matrices(vectors: np.ndarray) -> np.ndarray:
    """Return rotations (..., 3, 3) by vectors (..., 3) along their axes, rad."""
    angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
    half_sines = np.sin(0.5 * angles)
    axes = vectors / np.maximum(angles, 1e-12)
    return rotations.matrix(np.concatenate([np.cos(0.5 * angles), half_sines * axes], axis=-1))
