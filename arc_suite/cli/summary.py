"""A body in a few numbers."""

from arc_suite.envs.setup import Setup
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body


def summary(body: Body) -> str:
    """Return a table of a body's size, gait and flaws, as text of several lines."""
    pose, task = standing(body), Setup.of(body).definition
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
