"""The demonstrator `planned`: it finds its way among pillars by what it sees, and steers along the plan.

Pillars are circles of known radius. They are fitted to the ranges that the torso measures. A* finds a
shortest path around them, over points about them. The law of `stepping` follows the command that leads
along the beginning of this path. The path is searched anew in every step. Lengths are in R, the mean
distance of the feet from their center. The search runs under NumPy alone, and not under `jax.jit`.
"""

import heapq
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite.arenas.pillars import RADIUS
from arc_suite.cpg.command_law import CommandLawState
from arc_suite.cpg.stepping import Stepping, SteppingParameters
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import FAR, RAYS, SIGHT

_MAX_PILLAR_RANGE = 0.95  # share of the sensor's range; a ray that measures more has met no pillar
_POINTS_PER_PILLAR = 12  # through which paths lead around it
_POINT_ANGLES = 2.0 * np.pi * np.arange(_POINTS_PER_PILLAR) / _POINTS_PER_PILLAR  # rad
# The points are the corners of a polygon about a pillar. This factor of a distance from the pillar's middle keeps the
# polygon's sides at the distance, too, with 6 % to spare.
_CORNER_FACTOR = 1.06 / math.cos(math.pi / _POINTS_PER_PILLAR)
_MAX_SHARE_OF_START = 0.99  # of the torso's distance from a pillar, so that the torso itself is never too close
_MAX_TURN = 1.0  # of the command, in target velocities
_START = 0  # index of the torso among the points of a search
_GOAL = 1  # index of the goal


class PlanningParameters(NamedTuple):
    """How a path is planned and followed.

    Attributes:
        steering: parameters of the law that follows it.
        room: between feet and pillars, where there is enough space, R.
        least: distance that the torso keeps from pillars, as a share of the extent of the feet.
        nearness: cost of a unit of missing room, in units of path.
        aim: how far along the path the point is that is steered for, R.
        forward: largest command forward, in target velocities.
        back: largest command backwards.
        aside: largest command sideways.
    """

    steering: SteppingParameters
    room: float = 0.3
    least: float = 0.8
    nearness: float = 6.0
    aim: float = 0.6
    forward: float = 1.2
    back: float = 0.6
    aside: float = 0.7


class Planned:
    """Goes to the goal of the block `goal`, around the pillars in the block `ranges`."""

    reads: tuple[str, ...] = (*Stepping.reads, "goal", "ranges")

    def __init__(self, task: Task, parameters: PlanningParameters):
        """Fit the law that steers to a task; see `CommandLaw`."""
        self._parameters = parameters
        self._steering_law = Stepping(task, parameters.steering)
        self.reads = (*self._steering_law.reads, "goal", "ranges")
        foot_radii = [leg.foot.radius for leg in self._steering_law.body.legs]
        distances = np.hypot(*self._steering_law.rest_soles[:, :2].T)  # of the feet from the torso, m
        self._extent = max(distances + foot_radii) / reach(self._steering_law.body)  # of the feet, R

    def initial(self, count: int) -> CommandLawState:
        """Return the state of the law that steers."""
        return self._steering_law.initial(count)

    def __call__(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        command = observation["command"].copy()
        for index, goal_block in enumerate(observation["goal"]):
            # The block shows the direction of the goal (2,) and its distance, as a share of the largest one.
            goal = FAR * float(goal_block[2]) * goal_block[:2]
            pillars = locate_pillars(observation["ranges"][index])
            corners = shortest_path(goal, pillars, self._extent, self._parameters)
            if not corners:
                corners = [goal]
            forward, left = point_along_path(corners, self._parameters.aim)
            command[index, :3] = command_toward(math.atan2(left, forward), self._parameters)
        return self._steering_law(state, {**observation, "command": command})


def command_toward(bearing: float, parameters: PlanningParameters) -> tuple[float, float, float]:
    """Return the command that leads to a bearing, rad: it turns to the bearing, and walks there meanwhile.

    Returns:
        The velocities forward, left and turning, in target velocities.
    """
    forward = max(parameters.forward * math.cos(bearing), -parameters.back)
    left = parameters.aside * math.sin(bearing)
    turning = min(max(bearing, -_MAX_TURN), _MAX_TURN)
    return forward, left, turning


def locate_pillars(ranges: np.ndarray) -> np.ndarray:
    """Return the middles (n, 2) of pillars, forward and left of the torso, R, from the ranges (24,) of all rays.

    The points where two neighboring rays meet one pillar give its exact middle. The middle of a pillar that only one
    ray meets is about a radius behind the point, along the ray.

    Args:
        ranges: (24,) as shares of the sensor's range.
    """
    points = (SIGHT * ranges * RAYS).T  # (24, 2) the ends of the rays
    meets_pillar = ranges < _MAX_PILLAR_RANGE
    exact_middles = []
    rough_middles = []
    for ray in np.flatnonzero(meets_pillar):
        rough_middles.append(points[ray] + RADIUS * RAYS[:, ray])
        next_ray = (ray + 1) % len(ranges)
        chord = points[next_ray] - points[ray]
        half_chord = 0.5 * math.hypot(*chord)
        if meets_pillar[next_ray] and half_chord < RADIUS:
            normal = np.array((chord[1], -chord[0])) / (2.0 * half_chord)  # away from the torso
            depth = math.sqrt(RADIUS**2 - half_chord**2)  # of the middle behind the chord
            exact_middles.append(points[ray] + 0.5 * chord + depth * normal)
    middles: list[np.ndarray] = []
    for candidate in exact_middles + rough_middles:
        # Pillars do not overlap: a candidate that overlaps with an earlier one belongs to the same pillar.
        if all(math.hypot(*(candidate - middle)) > 2.0 * RADIUS for middle in middles):
            middles.append(candidate)
    return np.array(middles).reshape(-1, 2)


def shortest_path(
    goal: np.ndarray, circles: np.ndarray, extent: float, parameters: PlanningParameters
) -> list[np.ndarray]:
    """Return the corners of a shortest path from the torso to a goal around circles, by A*; empty if there is none.

    Args:
        goal: (2,) forward and left of the torso.
        circles: (n, 2) their middles.
        extent: extent of the feet about the torso.
        parameters: how near the path may lead to circles.

    Returns:
        Points (2,), the goal the last of them.
    """
    min_distance, desired_distance = _distances_to_keep(circles, extent, parameters)
    points = _search_points(goal, circles, min_distance, desired_distance)
    goal_distances = np.hypot(*(points - goal).T)  # lower bounds of the path that is left
    costs = np.full(len(points), np.inf)  # of the cheapest known path from the start to each point
    costs[_START] = 0.0
    previous_points = np.zeros(len(points), int)
    is_visited = np.zeros(len(points), bool)
    # Lower bounds of the costs of paths through points, and the points.
    queue: list[tuple[Any, Any]] = [(goal_distances[_START], _START)]
    while queue:
        _, point = heapq.heappop(queue)
        if point == _GOAL:
            return _trace_back(points, previous_points)
        if is_visited[point]:
            continue
        is_visited[point] = True
        distances = _path_distances(points[point], points, circles)
        missing_room = (desired_distance - distances).clip(0.0).sum(axis=-1)
        costs_through_point = costs[point] + np.hypot(*(points - points[point]).T)
        costs_through_point += parameters.nearness * missing_room
        costs_through_point[(distances < min_distance).any(axis=-1)] = np.inf
        for neighbor in np.flatnonzero(costs_through_point < costs):
            costs[neighbor] = costs_through_point[neighbor]
            previous_points[neighbor] = point
            heapq.heappush(queue, (costs[neighbor] + goal_distances[neighbor], neighbor))
    return []


def _distances_to_keep(circles: np.ndarray, extent: float, parameters: PlanningParameters) -> tuple[np.ndarray, float]:
    """Return the distance (n,) from each circle's middle that a path must keep, and the distance that it should."""
    min_distance = RADIUS + parameters.least * extent
    start_distances = np.hypot(*circles.T)
    desired_distance = RADIUS + extent + parameters.room
    return np.minimum(min_distance, _MAX_SHARE_OF_START * start_distances), desired_distance


def _search_points(
    goal: np.ndarray, circles: np.ndarray, min_distance: np.ndarray, desired_distance: float
) -> np.ndarray:
    """Return the points (n, 2) of a search: the torso, the goal, and points between and about circles.

    Points that are too close to a circle are left out.
    """
    endpoints = np.stack([np.zeros(2), goal])
    between = _points_between(circles, desired_distance)
    around = _points_around(circles, desired_distance)
    points = np.concatenate([endpoints, between, around])
    circle_distances = np.hypot(*np.moveaxis(points[:, None] - circles, -1, 0))  # (points, circles)
    is_kept = (circle_distances >= min_distance).all(axis=-1)
    is_kept[: len(endpoints)] = True
    return points[is_kept]


def _points_between(circles: np.ndarray, distance: float) -> np.ndarray:
    """Return the points (n, 2) in the middle between any two circles that are less than twice a distance apart."""
    first, second = np.triu_indices(len(circles), 1)
    is_near = np.hypot(*(circles[first] - circles[second]).T) < 2.0 * distance
    return 0.5 * (circles[first] + circles[second])[is_near]


def _points_around(circles: np.ndarray, distance: float) -> np.ndarray:
    """Return points (n, 2) about circles, the corners of polygons whose sides keep a distance from circles' middles.

    One corner of each polygon lies toward the torso. So corners stay where they are while the torso turns.
    """
    bearings_of_torso = np.arctan2(-circles[:, 1], -circles[:, 0])
    angles = bearings_of_torso[:, None] + _POINT_ANGLES
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return (circles[:, None] + distance * _CORNER_FACTOR * directions).reshape(-1, 2)


def _path_distances(start: np.ndarray, ends: np.ndarray, circles: np.ndarray) -> np.ndarray:
    """Return how near straight paths from a point (2,) to ends (n, 2) come to circles' middles: (n, circles)."""
    paths = ends - start
    to_circles = circles - start
    squared_lengths = np.maximum((paths**2).sum(axis=-1), 1e-12)
    # Where each path is nearest to a circle, as a share of the path.
    shares = (paths @ to_circles.T / squared_lengths[:, None]).clip(0.0, 1.0)
    nearest = shares[..., None] * paths[:, None] - to_circles
    return np.hypot(nearest[..., 0], nearest[..., 1])


def _trace_back(points: np.ndarray, previous_points: np.ndarray) -> list[np.ndarray]:
    """Return the points of the path that a search has found, from the first after the start to the goal."""
    path = [_GOAL]
    while previous_points[path[-1]] != _START:
        path.append(previous_points[path[-1]])
    path.reverse()
    return list(points[path])


def point_along_path(corners: Sequence[np.ndarray], distance: float) -> np.ndarray:
    """Return the point (2,) at a distance along a path from the torso; the end of the path, if it is shorter."""
    position = np.zeros(2)
    remaining = distance
    for corner in corners:
        length = math.hypot(*(corner - position))
        if length > remaining:
            return position + remaining / length * (corner - position)
        remaining -= length
        position = corner
    return position
