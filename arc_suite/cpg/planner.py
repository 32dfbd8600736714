"""The demonstrator `planned`: it finds its way among pillars by what it sees, and steers along the plan.

Circles of known radius are fitted to the ranges, a shortest path around them is found by A* over points
about them, and the law of `steering` follows the command that leads along its first stretch. The path is
found anew in every step. Lengths are in R, the mean distance of the feet from their center. The search
runs under NumPy alone, and not under `jax.jit`.
"""

import heapq
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.arenas.pillars import RADIUS
from arc_suite.cpg.command_law import CommandLawState
from arc_suite.cpg.steering import Steered, SteeringParameters
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import FAR, RAYS, SIGHT

_SEEN = 0.95  # share of their farthest at which ranges are taken for pillars
_POINTS = 12  # about a pillar, through which paths lead
_OUTSIDE = 1.06 / math.cos(math.pi / _POINTS)  # of a pillar's room, at which these are: sides clear it too
_ANGLES = 2.0 * np.pi * np.arange(_POINTS) / _POINTS


class PlanningParameters(NamedTuple):
    """How a path is planned and followed.

    Attributes:
        steering: parameters of the law that follows it.
        room: between feet and pillars, where there is room, R.
        least: that the torso keeps from pillars, as a share of the extent of the feet.
        nearness: cost of a unit of missing room, in units of path.
        aim: how far along the path the point is that is steered for, R.
        forward: largest command forward, in target velocities.
        back: largest command backwards.
        aside: largest command sideways.
    """

    steering: SteeringParameters
    room: float = 0.3
    least: float = 0.8
    nearness: float = 6.0
    aim: float = 0.6
    forward: float = 1.2
    back: float = 0.6
    aside: float = 0.7


class Planned:
    """Goes to the goal of the block `goal`, around the pillars in the block `ranges`."""

    reads = (*Steered.reads, "goal", "ranges")

    def __init__(self, task: Task, parameters: PlanningParameters):
        """Fit the law that steers to a task; see `CommandLaw`."""
        self._parameters, self._steered = parameters, Steered(task, parameters.steering)
        self._extent = self._steered.extent / reach(self._steered.body)

    def initial(self, count: int) -> CommandLawState:
        """Return the state of the law that steers."""
        return self._steered.initial(count)

    def __call__(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        p, command = self._parameters, observation["command"].copy()
        for index, (goal, ranges) in enumerate(zip(observation["goal"], observation["ranges"], strict=True)):
            goal = FAR * float(goal[2]) * goal[:2]
            x, y = point_along_path(shortest_path(goal, locate_pillars(ranges), self._extent, p) or [goal], p.aim)
            command[index, :3] = command_toward(math.atan2(y, x), p)
        return self._steered(state, {**observation, "command": command})


def command_toward(bearing: float, parameters: PlanningParameters) -> tuple[float, float, float]:
    """Return the command that leads to a bearing, rad: a turn to it, and a walk there meanwhile."""
    forward = max(parameters.forward * math.cos(bearing), -parameters.back)
    return forward, parameters.aside * math.sin(bearing), min(max(bearing, -1.0), 1.0)


def locate_pillars(ranges: np.ndarray) -> np.ndarray:
    """Return the middles (n, 2) of pillars, forward and left of the torso, that the ranges (24,) tell of.

    Two neighboring rays that meet one pillar tell exactly where it is; a ray alone, that it is about
    as far behind as its radius.
    """
    points, met = (SIGHT * ranges * RAYS).T, ranges < _SEEN
    exact, rough = [], []
    for ray in np.flatnonzero(met):
        rough.append(points[ray] + RADIUS * RAYS[:, ray])
        across = points[(ray + 1) % len(ranges)] - points[ray]
        half = 0.5 * math.hypot(*across)
        if met[(ray + 1) % len(ranges)] and half < RADIUS:
            normal = np.array((across[1], -across[0])) / (2.0 * half)
            exact.append(points[ray] + 0.5 * across + math.sqrt(RADIUS**2 - half**2) * normal)
    middles = []
    for middle in exact + rough:
        if all(math.hypot(*(middle - other)) > 2.0 * RADIUS for other in middles):
            middles.append(middle)
    return np.array(middles).reshape(-1, 2)


def shortest_path(
    goal: np.ndarray, circles: np.ndarray, extent: float, parameters: PlanningParameters
) -> list[np.ndarray]:
    """Return the corners of a shortest path from the torso to a goal around circles, by A*; none if there is none.

    Args:
        goal: (2,) forward and left of the torso.
        circles: (n, 2) their middles.
        extent: of the feet about the torso.
        parameters: how near it may lead to them.

    Returns:
        Points (2,), the goal the last of them.
    """
    distances = np.hypot(*circles.T)
    least, wanted = np.minimum(RADIUS + parameters.least * extent, 0.99 * distances), RADIUS + extent + parameters.room
    points = np.concatenate([np.zeros((1, 2)), goal[None], _between(circles, wanted), _around(circles, wanted)])
    apart = np.hypot(*np.moveaxis(points[:, None] - circles, -1, 0))
    points = points[(apart >= least).all(axis=-1) | (np.arange(len(points)) < 2)]
    left = np.hypot(*(points - goal).T)  # the least that is left from each
    costs, before = np.where(np.arange(len(points)), np.inf, 0.0), np.zeros(len(points), int)
    done = np.zeros(len(points), bool)
    queue: list[tuple] = [(left[0], 0)]  # least cost of the whole path, through a point
    while queue:
        _, point = heapq.heappop(queue)
        if point == 1:
            corners = [1]
            while before[corners[-1]]:
                corners.append(before[corners[-1]])
            return list(points[corners[::-1]])
        if done[point]:
            continue
        done[point] = True
        cost = costs[point] + np.hypot(*(points - points[point]).T)
        nearest = _nearest(points[point], points, circles)
        cost += parameters.nearness * (wanted - nearest).clip(0.0).sum(axis=-1)
        cost[(nearest < least).any(axis=-1)] = np.inf
        better = np.flatnonzero(cost < costs)
        costs[better], before[better] = cost[better], point
        for index in better:
            heapq.heappush(queue, (cost[index] + left[index], index))
    return []


def _around(circles: np.ndarray, distance: float) -> np.ndarray:
    """Points (n, 2) about circles at a distance from their middles, which sides between them keep, too.

    One about each lies toward the torso, so that they stay where they are while it turns.
    """
    angles = np.arctan2(*-circles.T[::-1])[:, None] + _ANGLES
    return (circles[:, None] + distance * _OUTSIDE * np.stack([np.cos(angles), np.sin(angles)], axis=-1)).reshape(-1, 2)


def _between(circles: np.ndarray, distance: float) -> np.ndarray:
    """Points (n, 2) in the middle between any two circles that are nearer than both should be kept from."""
    first, second = np.triu_indices(len(circles), 1)
    near = np.hypot(*(circles[first] - circles[second]).T) < 2.0 * distance
    return 0.5 * (circles[first] + circles[second])[near]


def _nearest(start: np.ndarray, ends: np.ndarray, circles: np.ndarray) -> np.ndarray:
    """How near straight paths from a point (2,) to others (n, 2) lead to circles' middles: (n, circles)."""
    paths, apart = ends - start, circles - start
    share = (paths @ apart.T / np.maximum((paths**2).sum(axis=-1), 1e-12)[:, None]).clip(0.0, 1.0)
    between = share[..., None] * paths[:, None] - apart
    return np.hypot(between[..., 0], between[..., 1])


def point_along_path(corners: Sequence[np.ndarray], distance: float) -> np.ndarray:
    """Return the point (2,) at a distance along a path from the torso; its end, if it is shorter."""
    place = np.zeros(2)
    for corner in corners:
        length = math.hypot(*(corner - place))
        if length > distance:
            return place + distance / length * (corner - place)
        distance -= length
        place = corner
    return place
