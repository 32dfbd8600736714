"""Which chains of a robot are legs, and the pose in which it stands on them."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import checks
from arc_suite.importing import tree
from arc_suite.importing.tree import Robot
from arc_suite.models.kinematics import least_changes
from arc_suite.models.standing import stability_margin
from arc_suite.robots.spec import SpecError

# Shares of the standing height.
_AGREE = 0.15  # by which feet on the floor may differ
_HANG = 0.5  # of the deepest foot: a chain that reaches lower is a leg that hangs
_LEAST_MARGIN = 0.02  # of the center of mass inside the feet
_OFF = 0.15  # of the center of mass from the line between two feet, which may be long

_STRAIGHT = 0.96  # of a leg's length: one that is longer has no knee to bend
_LEAST_THIGH = 0.2  # of the standing height; a shorter one does not make a leg straight
_SOLE = 0.05  # of the standing height, that a foot is high whose shape tells nothing

# The search for a pose with bent knees.
_REACH = 0.65  # of the leg's length, from the joint before the last down to the foot
_ASIDE = 0.1  # of the leg's length, of the foot outwards from where a straight leg has it: a wide stance is steady
_BEND = 0.65  # rad, of the thigh at first; the knee bends back twice as much
_STEPS = 80
_LARGEST_STEP = 0.2  # rad
_DAMPING = 0.05  # of the leg's length
_MISS = 0.05  # of the leg's length

_TILT = 0.05  # of the directions from which the sole of a flat foot is felt
_LEVEL = 0.01  # of the standing height, by which shapes of one foot that touch the floor differ
_HUB = 0.1  # of a wheel's radius, by which the joint may miss its middle
_RANGE = 6.0  # rad; a joint that turns farther has no middle

# numpy's integers are equal to MuJoCo's enumerations, but not in a tuple of them.
_BALLS = (int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_CAPSULE))


class Leg(NamedTuple):
    """A leg of a robot in its standing pose, in the torso's frame.

    Attributes:
        joints: its own, from the torso outwards.
        body: the last link.
        geom: the foot's collider.
        sole: (3,) the lowest point.
        center: (3,) of the foot, as a ball that touches the floor at the sole.
        radius: of that ball, m.
    """

    joints: tuple[int, ...]
    body: int
    geom: int
    sole: np.ndarray
    center: np.ndarray
    radius: float


class Stance(NamedTuple):
    """A standing pose.

    Attributes:
        qpos: (nq,) of the file's model, with the torso's frame as the world's.
        legs: in the order of the file.
        height: of the torso's origin above the lowest sole.
        origin: where the pose comes from, in words.
    """

    qpos: np.ndarray
    legs: tuple[Leg, ...]
    height: float
    origin: str

    @property
    def joints(self) -> list[int]:
        """Return the legs' joints, in the order of the action."""
        return [joint for leg in self.legs for joint in leg.joints]


class NoStance(SpecError):
    """No pose in which a robot stands."""


class _Unfit(Exception):
    """A pose in which the robot does not stand; the message says why."""


def find_stance(robot: Robot, home: str | None, feet: Sequence[str]) -> Stance:
    """Return the pose in which a robot stands.

    The first of keyframes, zero angles, a search for bent knees, and the middles of the ranges in which all feet
    reach the floor, with the center of mass inside them and no straight legs.

    Args:
        robot: the file's.
        home: name of a keyframe, which is then taken whatever it looks like.
        feet: names of bodies or geoms at the ends of the legs; none to find them.

    Raises:
        NoStance: no pose stands.
        SpecError: a name is not in the file, or its pose has no legs.
    """
    ends = _named_feet(robot, feet) if feet else None
    if home is not None:
        names = [robot.model.key(key).name for key in range(robot.model.nkey)]
        key = names.index(_known(home, names, "keyframe"))
        try:
            return _standing(robot, robot.model.key_qpos[key], f"keyframe {home}", ends, strict=False)
        except _Unfit as reason:
            raise SpecError(f"keyframe {home}: {reason}") from None
    reasons, tried = [], []
    for bent, poses in ((True, _poses(robot, ends)), (False, tried)):  # better straight legs than none
        for origin, qpos in poses:
            try:
                return _standing(robot, qpos, origin, ends, bent)
            except _Unfit as reason:
                reasons.append(f"{origin}: {reason}")
            if bent:
                tried.append((origin, qpos))
    cure = "name a keyframe that stands with --home, or the feet with --feet"
    raise NoStance(f"no standing pose ({'; '.join(dict.fromkeys(reasons))}); {cure}")


def _known(name: str, valid: Sequence[str], kind: str) -> str:
    try:
        return checks.name(name, [each for each in valid if each], kind)
    except ValueError as error:
        raise SpecError(str(error)) from None


def _named_feet(robot: Robot, feet: Sequence[str]) -> dict[tuple[int, ...], list[int]]:
    """Return the colliders of feet that are named by body or geom, by the chain that leads to them."""
    ends, model = {}, robot.model
    names = {model.geom(geom).name: [geom] for geom in robot.colliders}
    for body in robot.bodies[1:]:
        own = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body]
        if own:
            names[model.body(body).name] = own
    for foot in feet:
        geoms = names[_known(foot, list(names), "foot")]
        chain = robot.chains[int(model.geom_bodyid[geoms[0]])]
        if not chain:
            raise SpecError(f"foot {foot!r}: no joint lies between it and the torso")
        ends[chain] = geoms
    return ends


def _ends(robot: Robot) -> dict[tuple[int, ...], list[int]]:
    """Return the colliders at the end of every chain of joints that no other chain goes on from."""
    ends = {}
    for geom in robot.colliders:
        ends.setdefault(robot.chains[int(robot.model.geom_bodyid[geom])], []).append(geom)
    inner = {chain[:size] for chain in ends for size in range(len(chain))}
    return {chain: geoms for chain, geoms in ends.items() if chain not in inner}


def _poses(robot: Robot, ends: dict | None) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the poses (nq,) to try, each with where it comes from."""
    model = robot.model
    for key in sorted(range(model.nkey), key=lambda key: model.key(key).name != "home"):
        yield f"keyframe {model.key(key).name or key}", model.key_qpos[key]
    yield "zero angles", model.qpos0
    for front, rear in ((1, 1), (-1, -1), (1, -1), (-1, 1)):
        found = _searched(robot, ends or _ends(robot), front, rear)
        if found is not None:
            yield "search for bent knees", found
    yield "middle of the ranges", _middle(robot)
    yield "zero angles within the ranges", robot.clipped(model.qpos0)


def _middle(robot: Robot) -> np.ndarray:
    """Return the pose in the middle of all ranges that have one."""
    qpos = robot.model.qpos0.copy()
    for joint in robot.joints:
        low, high = robot.range(joint)
        if high - low < _RANGE:
            qpos[robot.place(joint)] = 0.5 * (low + high)
    return robot.clipped(qpos)


def _standing(
    robot: Robot, qpos: np.ndarray, origin: str, ends: dict | None, bent: bool = True, strict: bool = True
) -> Stance:
    """Return the stance of a pose.

    Args:
        robot: the file's.
        qpos: (nq,) the pose.
        origin: where it comes from.
        ends: colliders of feet that are named, by chain; None to find them.
        bent: whether straight legs are refused.
        strict: whether anything is refused.

    Raises:
        _Unfit: the robot does not stand in it; if not strict, only if it has no legs.
    """
    outside = [joint for joint in robot.joints if not _within(robot, joint, qpos)]
    if outside and strict:
        raise _Unfit(f"joint {robot.name(outside[0])} is out of its range")
    data = robot.placed(qpos)
    named, ends = bool(ends), ends or _ends(robot)
    found = {chain: tree.lowest_point(robot, data, geoms) for chain, geoms in ends.items() if chain}
    if not found:
        raise _Unfit("no chain of joints ends in a collider")
    height = -min(point[2] for point, _ in found.values())
    if height <= 0.0:
        raise _Unfit("no foot is below the torso")
    low = {chain: end for chain, end in found.items() if named or end[0][2] < -(1.0 - _AGREE) * height}
    legs = _legs(robot, data, ends, low, height)
    if strict:
        _check_feet(robot, found, legs, height)
        _check_torso(robot, data, legs, height)
    if strict and bent:
        _check_knees(data, legs, height)
    return Stance(data.qpos.copy(), legs, float(height), origin)


def _within(robot: Robot, joint: int, qpos: np.ndarray) -> bool:
    low, high = robot.range(joint)
    return low - 1e-6 <= qpos[robot.place(joint)] <= high + 1e-6


def _legs(robot: Robot, data: mujoco.MjData, ends: dict, low: dict, height: float) -> tuple[Leg, ...]:
    """Return the legs of chains that end low; joints that several of them share, and wheels, belong to none."""
    legs = []
    for chain, (point, geom) in sorted(low.items()):
        others = {joint for other in low if other != chain for joint in other}
        own = tuple(joint for joint in chain if joint not in others)
        if own and _is_wheel(robot, data, own[-1], point, geom):
            own = own[:-1]
        if not own:
            raise _Unfit(f"joint {robot.name(chain[-1])} turns a wheel or several feet")
        body = int(robot.model.geom_bodyid[geom])
        sole, radius = _sole(robot, data, ends[chain], height)
        legs.append(Leg(own, body, geom, sole, sole + (0.0, 0.0, radius), radius))
    if len(legs) < 2:
        raise _Unfit(f"{len(legs)} foot on the floor")
    return tuple(legs)


def _is_wheel(robot: Robot, data: mujoco.MjData, joint: int, point: np.ndarray, geom: int) -> bool:
    """Return whether a joint turns a foot without end about the foot's own middle."""
    low, high = robot.range(joint)
    axis = data.xaxis[joint]
    middle, sole = (np.linalg.norm(np.cross(axis, end - data.xanchor[joint])) for end in (data.geom_xpos[geom], point))
    return bool(high - low > _RANGE and abs(axis[2]) < 0.5 and middle < _HUB * sole)


def _sole(robot: Robot, data: mujoco.MjData, geoms: Sequence[int], height: float) -> tuple[np.ndarray, float]:
    """Return the middle of what touches the floor (3,), and the radius of a ball in its place."""
    model = robot.model
    point, geom = tree.lowest_point(robot, data, geoms)
    touching = [each for each in geoms if tree.lowest_point(robot, data, [each])[0][2] < point[2] + _LEVEL * height]
    kind, radius = model.geom_type[geom], float(model.geom_size[geom][0])
    if kind == _BALLS[0] and len(touching) == 1:
        return point, radius
    around = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    tilts = np.stack((_TILT * np.cos(around), _TILT * np.sin(around), np.full(16, -1.0)), axis=1)
    tilts /= np.linalg.norm(tilts, axis=1, keepdims=True)
    felt = np.array([tree.support_point(model, data, each, tilt) for tilt in tilts for each in touching])
    middle = np.array((*(0.5 * (felt[:, :2].max(axis=0) + felt[:, :2].min(axis=0))), point[2]))
    if kind in _BALLS:
        return middle, radius
    half = 0.5 * (tree.support_point(model, data, geom, -tree.DOWN)[2] - point[2])
    return middle, float(min(half, _SOLE * height))


def _check_feet(robot: Robot, found: dict, legs: tuple[Leg, ...], height: float) -> None:
    low = {leg.geom for leg in legs}
    for chain, (point, geom) in found.items():
        if geom not in low and point[2] < -_HANG * height:
            raise _Unfit(f"the chain of {robot.name(chain[-1])} ends {height + point[2]:.3g} m above the floor")
    uneven = max(leg.sole[2] for leg in legs) + height
    if uneven > _AGREE * height:
        raise _Unfit(f"a foot hangs {uneven:.3g} m above the floor")


def _check_torso(robot: Robot, data: mujoco.MjData, legs: tuple[Leg, ...], height: float) -> None:
    """Refuse a torso or an arm below the feet, and a center of mass outside of three or more feet."""
    own = {joint for leg in legs for joint in leg.joints}
    chains = {geom: robot.chains[int(robot.model.geom_bodyid[geom])] for geom in robot.colliders}
    rest = [geom for geom, chain in chains.items() if not own.intersection(chain)]
    if rest and tree.lowest_point(robot, data, rest)[0][2] < -height:
        raise _Unfit("the torso is lower than the feet")
    margin = stability_margin(data.subtree_com[robot.root], [leg.sole for leg in legs])
    if margin < (_LEAST_MARGIN if len(legs) > 2 else -_OFF) * height:
        raise _Unfit(f"the center of mass is {margin:.3g} m inside of the feet")


def _check_knees(data: mujoco.MjData, legs: tuple[Leg, ...], height: float) -> None:
    for leg in legs:
        if len(leg.joints) < 2:
            continue
        hip, knee = (data.xanchor[joint] for joint in leg.joints[-2:])
        thigh, shank = np.linalg.norm(knee - hip), np.linalg.norm(leg.sole - knee)
        if thigh > _LEAST_THIGH * height and np.linalg.norm(leg.sole - hip) > _STRAIGHT * (thigh + shank):
            raise _Unfit("the legs are straight")


def _searched(robot: Robot, ends: dict, front: int, rear: int) -> np.ndarray | None:
    """Return a pose (nq,) with each foot below the joint before the last, knees bent to a side; None if there is none.

    Args:
        robot: the file's.
        ends: colliders by chain.
        front: sign of the bend of legs in front of the torso's origin.
        rear: of the others.
    """
    zero = robot.clipped(robot.model.qpos0 * 0.0)
    data = robot.placed(zero)
    lows = {chain: tree.lowest_point(robot, data, geoms) for chain, geoms in ends.items() if len(chain) > 1}
    deepest = min((point[2] for point, _ in lows.values()), default=0.0)
    qpos = _middle(robot)
    for chain, (point, geom) in lows.items():
        if point[2] < 0.4 * deepest:  # arms and heads stay
            sign = front if data.xanchor[chain[-2]][0] > 0.0 else rear
            bent = _bent(robot, zero, chain, (point, geom), sign)
            if bent is None:
                return None
            for joint in chain:
                qpos[robot.place(joint)] = bent[robot.place(joint)]
    return qpos


def _bent(robot: Robot, zero: np.ndarray, chain: tuple[int, ...], end: tuple, sign: int) -> np.ndarray | None:
    """Return a pose (nq,) in which one leg stands with a bent knee, by damped least squares; None if it cannot."""
    model, (point, geom) = robot.model, end
    body = int(model.geom_bodyid[geom])
    data = robot.placed(zero)
    foot = data.xmat[body].reshape(3, 3).T @ (point - data.xpos[body])
    hip, knee = data.xanchor[chain[-2]].copy(), data.xanchor[chain[-1]].copy()
    length = np.linalg.norm(knee - hip) + np.linalg.norm(point - knee)
    aside = point[1] + np.sign(point[1]) * _ASIDE * length if len(chain) > 2 else hip[1]
    goal = np.array((hip[0], aside, hip[2] - _REACH * length))
    places, dofs = [robot.place(joint) for joint in chain], [int(model.jnt_dofadr[joint]) for joint in chain]
    qpos = zero.copy()
    qpos[places[-2:]] = _BEND * sign, -2.0 * _BEND * sign
    for _ in range(_STEPS):
        qpos = robot.clipped(qpos)
        robot.placed(qpos, data)
        reached = data.xpos[body] + data.xmat[body].reshape(3, 3) @ foot
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, reached, body)
        moved = jacobian[:, dofs]
        step = least_changes(moved, (goal - reached)[:, None], _DAMPING * float(length))
        qpos[places] += step.clip(-_LARGEST_STEP, _LARGEST_STEP)
    missed = np.linalg.norm((goal - reached)[[0, 2]]) > _MISS * length
    return None if missed else robot.clipped(qpos)
