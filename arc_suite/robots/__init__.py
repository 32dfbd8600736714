"""The four robots of the paper, as data: domain name -> `Body`."""

from collections.abc import Mapping
from typing import Any

from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Body

ROBOTS = {module.BODY.name: module.BODY for module in (queen, bastion, tick, leaper)}


def is_robot(body: Body) -> bool:
    """Return whether a body is one of the robots, registered ones included, and no variation of one."""
    return ROBOTS.get(body.name) == body


def parameters(table: Mapping[str, Any], body: Body, what: str) -> Any | None:
    """Return the entry of a robot in a table, by the body's name; None where there is none.

    A body of a robot's name has the robot's numbers whatever its density or sizes are, as long as
    it has the robot's joints.

    Args:
        table: by name of a robot.
        body: any body.
        what: the numbers are for, with which an error begins.

    Raises:
        ValueError: a body of a robot's name that has other joints.
    """
    if body.name not in table:
        return None
    if body.name in ROBOTS and body.joint_names != ROBOTS[body.name].joint_names:
        wanted, got = len(ROBOTS[body.name].joint_names), len(body.joint_names)
        raise ValueError(
            f"{what}: expected a body named {body.name!r} to have the {wanted} joints of {body.name}, "
            f"got {got}{' with other names' if got == wanted else ''}; give it another name"
        )
    return table[body.name]
