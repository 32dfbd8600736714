"""Where the torso is: at the root body's origin, or at the hips where that origin lies away from the trunk.

Many files have their root frame on the floor below the trunk (`base_footprint`), or at a sensor. Heights, speeds and
falls are those of the torso, so they must not count from there. The physics stay those of the file: only the place
moves, in the root body's frame.
"""

from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from arc_suite.importing import tree
from arc_suite.importing.tree import Chain, Robot

# Of the root body's origin from the line between the hips and the trunk's center of mass, in depths of the legs.
_MAX_DISTANCE = 0.15
_MIN_DEPTH = 0.5  # of legs, as a share of their length: in some files the legs of the zero pose are level
_MIN_END_DEPTH = 0.7  # of the deepest end of a chain, below the trunk; chains that end higher are arms and heads


def place_torso(robot: Robot) -> Robot:
    """Return the robot with the place of its torso: the middle of its hips, unless the root body's origin will do."""
    data = robot.forward_kinematics(robot.model.qpos0)
    chains = find_leg_chains(robot)
    if not chains:
        return robot
    hips = np.mean([data.xanchor[chain[0]] for chain in chains], axis=0)
    deepest = min(end[2] for end in chains.values())
    length = max(_chain_length(data, chain, end) for chain, end in chains.items())
    depth = max(hips[2] - deepest, _MIN_DEPTH * length)
    if _distance_from_line(hips, _trunk_center(robot, data)) <= _MAX_DISTANCE * depth:
        return robot
    return robot._replace(torso_place=hips)


def placement_notes(robot: Robot) -> Iterator[str]:
    """Yield a note on a torso that is not at the root body's origin."""
    if robot.torso_place.any():
        place = ", ".join(f"{coordinate:.3g}" for coordinate in robot.torso_place)
        yield (
            f"torso: at the hips, ({place}) m from the frame of {robot.model.body(robot.root).name}: "
            "heights, speeds and falls are those of this place"
        )


def find_leg_chains(robot: Robot) -> Mapping[Chain, np.ndarray]:
    """Return the lowest points (3,) of the chains that end low at zero angles, by chain."""
    data = robot.forward_kinematics(robot.model.qpos0)
    ends = {}
    for chain, geoms in robot.end_colliders().items():
        if len(chain) > 1:
            ends[chain], _ = tree.lowest_point(robot, data, geoms)
    trunk_height = _trunk_center(robot, data)[2]
    deepest = min((end[2] for end in ends.values()), default=0.0)
    highest_end = trunk_height + _MIN_END_DEPTH * (deepest - trunk_height)
    return {chain: end for chain, end in ends.items() if end[2] <= highest_end}


def find_feet(robot: Robot) -> list[int]:
    """Return the bodies at the ends of the chains that end low at zero angles."""
    colliders = robot.end_colliders()
    return [int(robot.model.geom_bodyid[colliders[chain][-1]]) for chain in find_leg_chains(robot)]


def _trunk_center(robot: Robot, data: mujoco.MjData) -> np.ndarray:
    """Return the center of mass (3,) of the root body and of what is fixed to it, without the legs."""
    bodies = [body for body in robot.bodies if not robot.chains[body]]
    masses = robot.model.body_mass[bodies]
    if masses.sum() == 0.0:
        return np.zeros(3)
    return masses @ data.xipos[bodies] / masses.sum()


def _distance_from_line(start: np.ndarray, end: np.ndarray) -> float:
    """Return the distance of the origin from the line between two points (3,), m."""
    line = end - start
    share = np.clip(-start @ line / max(line @ line, 1e-12), 0.0, 1.0)  # of the line, up to the nearest point
    return float(np.linalg.norm(start + share * line))


def _chain_length(data: mujoco.MjData, chain: Chain, end: np.ndarray) -> float:
    """Return the length of a chain with all joints stretched, from its first joint to its end, m."""
    points = np.array([*data.xanchor[list(chain)], end])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
