"""The link `world` of a URDF: the scene to which the robot is fixed, or a link of the robot with that name."""

import collections
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from arc_suite.robots.spec import SpecError

_WORLD = "world"  # which MuJoCo takes for the scene

# Elements by name, in the order of the file.
Elements = dict[str, ElementTree.Element]


def replace_world(robot: ElementTree.Element, links: Elements, joints: Elements) -> tuple[str, ...]:
    """Rename a link `world`, which MuJoCo takes for the scene, and return a note if the robot was fixed to it.

    A link without mass that nothing carries, and that carries the robot by fixed joints, is the scene: only the tilt
    of the robot in it counts. Otherwise it is a link of the robot.

    Raises:
        SpecError: the robot moves along or about one axis in the scene.
    """
    world = links.pop(_WORLD, None)
    if world is None:
        return ()
    new_name = f"arc_suite_{_WORLD}_link"
    world.set("name", new_name)
    links[new_name] = world
    ends = [(joint, end) for joint in joints.values() for end in ("parent", "child")]
    ends_at_world = [(joint, end) for joint, end in ends if joint.find(end).get("link") == _WORLD]
    for joint, end in ends_at_world:
        joint.find(end).set("link", new_name)
    carried_joints = [joint for joint, end in ends_at_world if end == "parent"]
    is_carried = len(carried_joints) < len(ends_at_world)
    kinds = {joint.get("type") for joint in carried_joints}
    if is_carried or "floating" in kinds or world.find("inertial") is not None:
        return ()
    if len(carried_joints) == 1 and kinds != {"fixed"}:
        raise SpecError(_describe_rail(carried_joints[0]))
    if kinds != {"fixed"}:
        return ()
    for shape in (*world.findall("collision"), *world.findall("visual")):
        world.remove(shape)
    branches = sorted(_list_branches(carried_joints, joints), key=len)
    robot_joint = branches[-1][0]
    for branch in branches[:-1]:  # what else stands in the scene
        for joint in branch:
            robot.remove(joints.pop(joint.get("name")))
            link = links.pop(joint.find("child").get("link"), None)
            if link is not None:
                robot.remove(link)
    origin = robot_joint.find("origin")
    if origin is not None:
        roll, pitch, _ = map(float, origin.get("rpy", "0 0 0").split())
        origin.set("xyz", "0 0 0")
        origin.set("rpy", f"{roll!r} {pitch!r} 0")
    child = robot_joint.find("child").get("link")
    return (f"the torso {child} is fixed to the world in the file: it has a free joint now",)


def _list_branches(first_joints: Sequence[ElementTree.Element], joints: Elements) -> list[list[ElementTree.Element]]:
    """Return joints, each with all joints that it carries."""
    joints_by_parent = collections.defaultdict(list)
    for joint in joints.values():
        joints_by_parent[joint.find("parent").get("link")].append(joint)
    branches = [[joint] for joint in first_joints]
    for branch in branches:
        for joint in branch:  # which grows on the way
            branch += joints_by_parent.pop(joint.find("child").get("link"), ())
    return branches


def _describe_rail(joint: ElementTree.Element) -> str:
    torso = joint.find("child").get("link")
    return f"the torso {torso!r} moves by the joint {joint.get('name')!r} alone; expected a free or a fixed torso"
