"""Texts about bodies: a table of a body in a few numbers, and a footnote about costs of transport."""

from collections.abc import Iterable

from arc_suite import registry
from arc_suite.envs.setup import Setup
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.energy import torques

# Torque of a motor, divided by weight and standing height, from which a motor counts as strong. Motors that the suite
# sizes have 2 to 20.
_STRONG_TORQUE = 50.0


def body_summary(body: Body) -> str:
    """Return a table of a body's size, gait and flaws, as text of several lines."""
    pose = measure_standing(body)
    task = Setup.of(body).definition
    parameters = task.parameters
    link_counts = sorted({len(leg.joints) for leg in body.legs})
    values = {
        "name": body.name,
        "legs": f"{len(body.legs)}",
        "links": " or ".join(str(count) for count in link_counts) + " actuated a leg",
        "degrees of freedom": f"{len(body.joint_names)} + 6",
        "mass": f"{pose.mass:.4g} kg",
        "standing height": f"{pose.height:.4g} m",
        "observation": f"{task.size} numbers",
        "stability margin": f"{pose.margin:.4g} m ({pose.margin / pose.height:.2f} of the height)",
        "control step": f"{task.scene.control_timestep:.4g} s",
        "target velocity": f"{parameters.target_velocity:.4g} m/s",
        "gait": f"{parameters.gait_frequency:.4g} Hz, duty factor {parameters.duty_factor:.2f}",
    }
    width = max(len(name) for name in values)
    lines = [f"{name:<{width}}  {value}" for name, value in values.items()]
    lines += [f"{'flaw':<{width}}  {flaw.text}" for flaw in flaws(body)]
    return "\n".join(lines)


def transport_footnote(bodies: Iterable[Body]) -> str:
    """Return the line under a table with costs of transport; "" if no body has strong motors."""
    torque_by_name = {
        registry.distinct_name(body): torques(body).max() / measure_standing(body).height for body in bodies
    }
    strong_bodies = [
        f"{name} ({torque:.0f} times weight times height)"
        for name, torque in torque_by_name.items()
        if torque > _STRONG_TORQUE
    ]
    if not strong_bodies:
        return ""
    line = "The cost of transport is high where motors are strong: {}. Compare policies of one body."
    return line.format(", ".join(strong_bodies))
