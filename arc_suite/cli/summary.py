"""A body in a few figures."""

from arc_suite.envs.prepare import prepared
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body


def summary(body: Body) -> str:
    """Return a table of what a body is, how it is to walk and what keeps it from that, as text of several lines."""
    pose, (task, _) = standing(body), prepared(body, "walk")
    parameters = task.parameters
    links = sorted({len(leg.joints) for leg in body.legs})
    rows = {
        "name": body.name,
        "legs": f"{len(body.legs)}",
        "links": " or ".join(map(str, links)) + " actuated a leg",
        "degrees of freedom": f"{len(body.joint_names)} + 6",
        "mass": f"{pose.mass:.4g} kg",
        "standing height": f"{pose.height:.4g} m",
        "observation": f"{task.size} numbers",
        "stability margin": f"{pose.margin:.4g} m ({pose.margin / pose.height:.2f} of the height)",
        "control step": f"{task.scene.control_timestep:.4g} s",
        "target velocity": f"{parameters.target_velocity:.4g} m/s",
        "gait": f"{parameters.gait_frequency:.4g} Hz, duty factor {parameters.duty_factor:.2f}",
    }
    width = max(map(len, rows))
    lines = [*rows.items(), *(("flaw", flaw.text) for flaw in flaws(body))]
    return "\n".join(f"{name:<{width}}  {value}" for name, value in lines)
