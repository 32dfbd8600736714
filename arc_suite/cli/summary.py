"""A body in a few figures."""

from arc_suite.models.sizing import control_timestep
from arc_suite.models.standing import standing as stance
from arc_suite.robots.spec import Body
from arc_suite.tasks.walk import settings


def summary(body: Body) -> str:
    """A table of what a body is and how it is to walk, as text of several lines."""
    standing, parameters = stance(body), settings(body, {}).parameters
    joints, parts = len(body.joint_names), len(body.part_names)
    links = sorted({len(leg.joints) for leg in body.legs})
    rows = {
        "name": body.name,
        "legs": f"{len(body.legs)}",
        "links": " or ".join(map(str, links)) + " actuated a leg",
        "degrees of freedom": f"{joints} + 6",
        "mass": f"{standing.mass:.4g} kg",
        "standing height": f"{standing.height:.4g} m",
        "observation": f"{13 + 2 * joints + 6 * parts} numbers",
        "stability margin": f"{standing.margin:.4g} m ({standing.margin / standing.height:.2f} of the height)",
        "control step": f"{control_timestep(body):.4g} s",
        "target velocity": f"{parameters.target_velocity:.4g} m/s",
        "gait": f"{parameters.gait_frequency:.4g} Hz, duty factor {parameters.duty_factor:.2f}",
    }
    width = max(map(len, rows))
    return "\n".join(f"{name:<{width}}  {value}" for name, value in rows.items())
