"""Servos whose torques fall with speed: the drag of a servo is the torque per speed that its motor loses.

A drag adds to the damping of the servo. Where an episode scales the gains of servos, drags stay as they are.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from arc_suite.robots.spec import Body

SERVO_FIELDS = ("actuator_gainprm", "actuator_biasprm")  # of the model: offset, stiffness, damping in each row
_DAMPING = 2  # column


def have_drags(body: Body) -> bool:
    """Return whether the torque of a servo of the body falls with speed."""
    return any(servo.drag is not None for servo in _servos(body))


def scale_servos(body: Body, model: Mapping[str, Any], multiples: np.ndarray) -> dict[str, np.ndarray]:
    """Return the fields of a model for servos that are stiffer or weaker.

    Args:
        body: the body of the model; see `models.source` for the order of its actuators.
        model: fields by name.
        multiples: of a row's numbers; they broadcast to a field.
    """
    drags = _find_drags(body, model)
    return {name: multiples * (model[name] - drags[name]) + drags[name] for name in SERVO_FIELDS}


def _servos(body: Body) -> list:
    """Return the servos of all joints: those of legs, then those that are held."""
    return [*(joint.servo for joint in body.joints if joint.servo), *(joint.servo for joint in body.held)]


def _find_drags(body: Body, model: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return the parts of the fields that are drags.

    The actuators are those of servos, of their releases, which take torque off a weak servo, and of their drags; see
    `Motors.drive`.
    """
    drags = np.array([servo.drag or 0.0 for servo in _servos(body)])
    joints = len(body.joints)
    leg_drags = drags[:joints]
    held_drags = drags[joints:]
    biases = [leg_drags, np.zeros(joints), -leg_drags, held_drags, -held_drags[held_drags > 0.0]]
    fields = {name: np.zeros_like(model[name]) for name in SERVO_FIELDS}
    fields["actuator_biasprm"][:, _DAMPING] = np.concatenate(biases)
    fields["actuator_gainprm"][joints : 3 * joints, _DAMPING] = np.concatenate([-leg_drags, leg_drags])
    return fields
