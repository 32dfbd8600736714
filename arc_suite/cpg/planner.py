"""A demonstrator that finds its way among pillars: it plans by what it sees, and steers along the plan.

Circles of known radius are fitted to the ranges, a shortest way around them is found by A* over points
about them, and the law of `steering` follows the command that leads along its first stretch. Nothing is
remembered from step to step: the way is found anew in every one. Lengths are told in R, the mean
distance of the feet from their centre.
"""

import heapq
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.arenas.pillars import RADIUS
from arc_suite.cpg.law import blocks
from arc_suite.cpg.steering import STEERING, Manner, Steered
from arc_suite.robots.spec import Body
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import FAR, RAYS, SIGHT

_SEEN = 0.95  # share of their farthest at which ranges are taken for pillars
_POINTS = 12  # about a pillar, through which ways lead
_OUTSIDE = 1.06 / math.cos(math.pi / _POINTS)  # of what a pillar takes up, at which these are: sides clear it too
_ANGLES = 2.0 * np.pi * np.arange(_POINTS) / _POINTS


class Plan(NamedTuple):
    """How a way is planned and followed.

    Attributes:
        room: between feet and pillars, where there is room, R.
        least: that the torso keeps from pillars, as a share of the extent of the feet.
        nearness: what a unit of missing room costs, in units of way.
        aim: how far along the way the point is that is steered for, R.
        ahead: velocity that is asked for, in target velocities.
        back: likewise backwards, at most.
        aside: likewise sideways, at most.
        manner: in which the body walks.
    """

    room: float = 0.3
    least: float = 0.8
    nearness: float = 6.0
    aim: float = 0.6
    ahead: float = 1.2
    back: float = 0.6
    aside: float = 0.7
    manner: Manner = STEERING["steered"]


PLANS = {"planned": Plan()}


class Planned:
    """Goes to the goal of the task navigate, around the pillars that its ranges tell of, in the rows of a batch."""

    def __init__(self, body: Body, plan: Plan):
        """Fit the law that steers to a body."""
        self._plan, self._steered = plan, Steered(body, plan.manner)
        self._extent = self._steered.extent / reach(body)

    def begin(self, rows: Sequence[int]) -> None:
        """Start episodes in some rows, given by their indices."""
        self._steered.begin(rows)

    def act(self, observation: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the actions (rows, joints) of a control step; see `Demonstrator.act`."""
        commanded, goals, ranges = blocks(observation, "navigate", "command", "goal", "ranges")
        command = commanded.copy()
        for row, goal in enumerate(goals):
            circles = seen(ranges[row])
            goal = FAR * float(goal[2]) * goal[:2]
            x, y = along(way(goal, circles, self._extent, self._plan) or [goal], self._plan.aim)
            command[row, :3] = toward(math.atan2(y, x), self._plan)
        return self._steered.act({**observation, "command": command})


def toward(bearing: float, plan: Plan) -> tuple[float, float, float]:
    """Return the command that leads to a bearing, rad: a turn to it, and a walk there meanwhile."""
    forward = max(plan.ahead * math.cos(bearing), -plan.back)
    return forward, plan.aside * math.sin(bearing), min(max(bearing, -1.0), 1.0)


def seen(ranges: np.ndarray) -> np.ndarray:
    """Return the middles (n, 2) of pillars, forward and left of the torso, that the ranges (24,) tell of.

    Two neighbouring rays that meet one pillar tell exactly where it is; a ray alone, that it is about
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


def way(goal: np.ndarray, circles: np.ndarray, extent: float, plan: Plan) -> list[np.ndarray]:
    """Return the corners of a shortest way from the torso to a goal around circles, by A*; none if there is no way.

    Args:
        goal: (2,) forward and left of the torso.
        circles: (n, 2) their middles.
        extent: of the feet about the torso.
        plan: how near it may lead to them.

    Returns:
        Points (2,), the goal the last of them.
    """
    distances = np.hypot(*circles.T)
    least, wanted = np.minimum(RADIUS + plan.least * extent, 0.99 * distances), RADIUS + extent + plan.room
    points = np.concatenate([np.zeros((1, 2)), goal[None], _between(circles, wanted), _around(circles, wanted)])
    apart = np.hypot(*np.moveaxis(points[:, None] - circles, -1, 0))
    points = points[(apart >= least).all(axis=-1) | (np.arange(len(points)) < 2)]
    left = np.hypot(*(points - goal).T)  # the least that is left from each
    costs, before = np.where(np.arange(len(points)), np.inf, 0.0), np.zeros(len(points), int)
    done = np.zeros(len(points), bool)
    queue = [(left[0], 0)]  # least cost of the whole way, through a point
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
        cost += plan.nearness * (wanted - nearest).clip(0.0).sum(axis=-1)
        cost[(nearest < least).any(axis=-1)] = np.inf
        better = np.flatnonzero(cost < costs)
        costs[better], before[better] = cost[better], point
        for index in better:
            heapq.heappush(queue, (cost[index] + left[index], index))
    return []


def _around(circles: np.ndarray, distance: float) -> np.ndarray:
    """Points (n, 2) about circles at a distance from their middles, which sides between them keep too.

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
    """How near straight ways from a point (2,) to others (n, 2) lead to circles' middles: (n, circles)."""
    way, apart = ends - start, circles - start
    share = (way @ apart.T / np.maximum((way**2).sum(axis=-1), 1e-12)[:, None]).clip(0.0, 1.0)
    between = share[..., None] * way[:, None] - apart
    return np.hypot(between[..., 0], between[..., 1])


def along(corners: Sequence[np.ndarray], distance: float) -> np.ndarray:
    """Return the point (2,) at a distance along a way from the torso; its end, if it is shorter."""
    place = np.zeros(2)
    for corner in corners:
        length = math.hypot(*(corner - place))
        if length > distance:
            return place + distance / length * (corner - place)
        distance -= length
        place = corner
    return place
