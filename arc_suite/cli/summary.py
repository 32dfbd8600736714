"""A body in a few numbers, and what to know about a number of its own."""

from collections.abc import Iterable

from arc_suite.envs.setup import Setup
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.energy import torques

_STRONG = 50.0  # torque of a motor by weight and standing height; those that the suite sizes have some 2 to 20


def body_summary(body: Body) -> str:
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


def transport_footnote(bodies: Iterable[Body]) -> str:
    """Return the line under a table with costs of transport; "" where no body's motors make it high."""
    strength = {body.name: torques(body).max() / standing(body).height for body in bodies}
    strong = [f"{name} ({share:.0f} times weight times height)" for name, share in strength.items() if share > _STRONG]
    line = "The cost of transport is high where motors are strong: {}. Compare policies of one body."
    return line.format(", ".join(strong)) if strong else ""
