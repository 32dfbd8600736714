"""The four robots of the paper, as data: domain name -> `Body`."""

from collections.abc import Mapping
from typing import Any

from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Body

ROBOTS: dict[str, Body] = {module.BODY.name: module.BODY for module in (queen, bastion, tick, leaper)}


def is_robot(body: Body) -> bool:
    """Return whether a body is one of the suite's or the registered robots, without any changes."""
    return ROBOTS.get(body.name) == body


def parameters(table: Mapping[str, Any], body: Body, what: str) -> Any | None:
    """Return the entry of a body's robot in a table, by the body's name; None if the table has none.

    A body with a robot's name may differ from the robot in density and sizes, but must have the robot's joints.

    Args:
        table: entries by name of the robot.
        body: any body.
        what: what the table contains, such as "preset"; errors begin with it.

    Raises:
        ValueError: the body has a robot's name but other joints.
    """
    if body.name not in table:
        return None
    robot = ROBOTS.get(body.name)
    if robot is not None and body.joint_names != robot.joint_names:
        expected_count = len(robot.joint_names)
        count = len(body.joint_names)
        other_names = " with other names" if count == expected_count else ""
        raise ValueError(
            f"{what}: expected a body named {body.name!r} to have the {expected_count} joints of {body.name}, "
            f"got {count}{other_names}; give it another name"
        )
    return table[body.name]
