"""Demonstrators whose feet are lifted as the speed asks for, in pages to play in and in the studio."""

from arc_suite.animation.clips.standing_legs import has_free_feet
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import preset_of, suited_preset
from arc_suite.cpg.stepping import SteppingParameters
from arc_suite.robots import gaits
from arc_suite.tasks import Task


def paced_demonstrator(task: Task, preset: str | None = None, speed: float = 1.0) -> Demonstrator:
    """Return a demonstrator that lifts its feet by the pace of its command, as clips do; see `gaits.Pace`.

    Laws without such a height, and bodies with legs of two joints, which higher steps make slower, are as usual.

    Args:
        task: task in which it acts.
        preset: name of the preset; None for the one that suits the task and the body.
        speed: target velocity of the task, as a multiple of the body's own.

    Raises:
        ValueError: as `Demonstrator`.
    """
    body = task.scene.body
    demonstrator = Demonstrator(task, preset)  # with its warnings of the preset
    parameters = preset_of(body, preset or suited_preset(task))
    if not isinstance(parameters, SteppingParameters) or not has_free_feet(body):
        return demonstrator
    lift = gaits.pace_at(speed).height * parameters.lift
    return Demonstrator(task, parameters._replace(lift=lift, lift_by_pace=True))
