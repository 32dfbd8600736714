"""Check a body in a spec file, or a task.

  arc-suite check spider
  arc-suite check --walk spider
  arc-suite check --tasks spider
  arc-suite check --task crouching:crouch --robot tick

A body: one line for each flaw, with the value that would fit: feet that hang in the air, legs that hold
nothing up, none that can step. Motors that a spec leaves out are chosen to hold any ballast; a line tells how strong
they are where ballast is heavy. An imported body stands for a second; a line tells whether its motors are too
weak to hold it, or its joints buzz.
With --walk its default demonstrator walks it for 100 control steps, an imported robot for 1000. Where it falls,
drags its torso, or stays below 0.7 of the target speed, the demonstrator `medium` tries. Where that fails, too, a
line names the fields to leave out, which are then sized to suit the body; of an imported robot, it says whether
higher gains or stronger motors help. With
--tasks the demonstrator of each task walks it, too, in four episodes of 200 control steps. A line for each
task names the preset, the mean of its metric, and how many episodes it ended without a fall; in `recover`, in
how many of them it got up.

A task: its methods must return what the contract says, and its terms, blocks and reward must be finite. A batch of
environments must compute bit for bit what each computes alone, over 200 control steps; the line names the terms,
metrics and blocks that differ.

Exit status 1 if there is any flaw or difference, or if --walk ends in a fall or a slow walk. What --tasks tells does
not count: few bodies walk well in all tasks.
"""

from collections.abc import Sequence

from absl import flags

from arc_suite import registry
from arc_suite.cli import program
from arc_suite.cli.flags import ROBOT_HELP, define_task, refuse_flags, task_from_flags
from arc_suite.cpg.selection import suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance, cures, suitability, task_results
from arc_suite.models.sizing import size_body
from arc_suite.models.soundness import flaws
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import Body, Joint
from arc_suite.simulation.stillness import Stillness, calming_armature, measure_stillness
from arc_suite.tasks import TASKS

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_bool("walk", False, "Let the demonstrator walk a body, whatever its flaws are, if any walk is possible.")
flags.DEFINE_bool("tasks", False, "Let the demonstrator of each task walk a body, if any walk is possible.")
flags.DEFINE_string("robot", "queen", f"In which a task is checked: {ROBOT_HELP}.")

_SEEDS = suitability.SEEDS[:4]  # of the episodes of each task
_STEPS = 200  # control steps of each of them
_MAX_NAMES = 4  # of joints in one line
_HEAVY_BALLAST = 5.0  # weights of the rest of a body
_SAME_ARMATURE = 0.99  # of what fits; a file rounds numbers
_GOOD_QUALITY = 2  # of a walk that counts as walking; see `cures.FirstWalk`
_FAILURE_TEXTS = {"touch": "drags its torso", "slow": "is slow"}  # by the failures of a walk, except falls


def main(spec: str | None = None) -> int:
    """Print the flaws of the body in a spec file, or how a task differs, and return the exit status."""
    if (spec is None) != FLAGS["task"].present:
        raise ValueError("expected a spec file or --task; see --help")
    for name in ("walk", "tasks"):
        if FLAGS[name].value and spec is None:
            raise ValueError(f"--{name}: expected a spec file, got --task")
    if spec is not None:
        refuse_flags(("set", "arena", "robot"), "goes with --task, not with a spec file")
    is_sound = _check_task() if spec is None else _check_body(spec)
    return 0 if is_sound else 1


def _check_body(spec: str) -> bool:
    """Print the flaws of the body in a spec file, with --walk also those of its walk; return whether it has none."""
    body = registry.body_of(spec)
    body_flaws = flaws(body)
    for flaw in body_flaws:
        print(f"{spec}: {flaw.text}")
    stillness = measure_stillness(body) if body.source else None
    is_held = stillness is None or not stillness.overloaded.any()
    if not body_flaws and is_held:
        print(f"{spec}: {body.name} stands and can take steps")
        _tell_of_heavy_ballast(spec, body)
    stands_still = stillness is None or _check_stillness(spec, body, stillness)
    walks_well = True
    can_walk = not any(flaw.hopeless for flaw in body_flaws)
    if FLAGS.walk and can_walk:
        walks_well = _check_walk(spec, body)
    if FLAGS.tasks and can_walk:
        _try_tasks(spec, body)
    return walks_well and stands_still and not body_flaws


def _tell_of_heavy_ballast(spec: str, body: Body) -> None:
    """Print how strong motors are that the suite chooses for ballast of many times the weight of the rest."""
    ballast_mass = sum(ballast.mass for ballast in body.ballast)
    ratio = ballast_mass / (measure_standing(body).mass - ballast_mass)
    has_chosen_motors = any(joint.torque is None for joint in body.joints)
    if ratio < _HEAVY_BALLAST or not has_chosen_motors:
        return
    largest_torque = max(joint.torque for joint in size_body(body).joints)
    rounded_torque = float(f"{largest_torque:.3g}")
    print(
        f"{spec}: its ballast of {ballast_mass:g} kg weighs {ratio:.0f} times the rest: the suite chooses motors "
        f"of up to {rounded_torque:g} N m for it; a gear in the spec sets others"
    )


def _check_stillness(spec: str, body: Body, stillness: Stillness) -> bool:
    """Print whether motors hold an imported body, and whether its joints buzz; return whether it stands still."""
    if stillness.overloaded.any():
        print(f"{spec}: {body.name} {_describe_overload(body, stillness)}")
        return False
    if stillness.buzzes:
        print(f"{spec}: {body.name} buzzes as it stands: {_describe_buzz(body, stillness)}")
    return not stillness.buzzes


def _describe_overload(body: Body, stillness: Stillness) -> str:
    """Return which motors are too weak to hold a body, and which torque does."""
    weak_joints = [joint for joint, is_weak in zip(body.joints, stillness.overloaded, strict=True) if is_weak]
    names = ", ".join(joint.alias or joint.name for joint in weak_joints[:_MAX_NAMES])
    problem = f"sinks as it stands: {len(weak_joints)} motors give their largest torque all the time ({names})"
    for factor in cures.FACTORS:
        if not measure_stillness(cures.multiply_motors(body, factor)).overloaded.any():
            return f"{problem}; {factor:g} times their torque holds it, {_torque_range(weak_joints, factor)}"
    return f"{problem}; {cures.FACTORS[-1]:g} times their torque does not hold it either"


def _torque_range(joints: Sequence[Joint], factor: float) -> str:
    """Return the least and the greatest limit of joints with servos, times a factor."""
    limits = [factor * joint.servo.limit for joint in joints]
    low = f"{min(limits):.3g}"
    high = f"{max(limits):.3g}"
    return f"{low} N m" if low == high else f"{low} to {high} N m"


def _describe_buzz(body: Body, stillness: Stillness) -> str:
    """Return how joints of an imported body shake, and what calms them."""
    stiffness = max(joint.servo.stiffness for joint in body.joints)
    armature = calming_armature(stiffness, body.simulation.timestep)
    problem = f"its joints shake at {stillness.joint_speed:.2g} rad/s"
    least_armature = min(joint.armature or 0.0 for joint in body.joints)
    if least_armature < _SAME_ARMATURE * armature:
        return f"{problem}: an armature of {armature:.2g} kg m^2 at each joint of its file fits"
    return f"{problem} despite an armature of {least_armature:.2g} kg m^2: lower gains or a shorter time step may fit"


def _check_walk(spec: str, body: Body) -> bool:
    """Print how the default demonstrator of a body walks it, or another, and what would help; return whether one does.

    All bodies have the demonstrator of `cures`, which may walk a body where the default one fails.
    """
    presets = dict.fromkeys((suited_preset(Setup.of(body, "walk").definition), cures.PRESET))
    for preset in presets:
        walk = cures.walk(body, preset)
        if walk.quality == _GOOD_QUALITY:
            print(f"{spec}: {_describe_walk(walk)} by {preset}")
            return True
        advice = _advice(body, walk) if preset == cures.PRESET else ""
        print(f"{spec}: with {preset}, {body.name} {_describe_problem(walk)}{advice}")
    return False


def _describe_problem(walk: cures.FirstWalk) -> str:
    if walk.verdict.fell:
        return f"falls after {walk.length} control steps"
    failures = " and ".join(_FAILURE_TEXTS[failure] for failure in walk.verdict.failures)
    return f"{failures}: it {_describe_walk(walk)}"


def _try_tasks(spec: str, body: Body) -> None:
    """Print how the demonstrator of each task walks a body in it."""
    trials = suitability.try_defaults(body, _SEEDS, _STEPS)
    for trial in program.progress(trials, total=len(TASKS), desc="walk", unit="task", leave=False):
        for text in (trial.describe(), *trial.warnings):
            print(f"{spec}: {trial.task} by {trial.preset}: {text}", flush=True)


def _advice(body: Body, walk: cures.FirstWalk) -> str:
    """Return what would make a body walk: fields of its joints to leave out, or motors of an imported robot.

    Returns:
        Empty if it has none of these fields, and is not imported.
    """
    if body.source:
        return _advice_on_motors(body)
    fields = cures.given_fields(body)
    cure = cures.left_out(body, walk.quality)
    if cure is not None:
        cure_fields, cured_walk = cure
        fields_text = " and ".join(cure_fields)
        return f"; leave out {fields_text} of its joints: then {cures.PRESET} {_describe_walk(cured_walk)}"
    if fields:
        return f"; leaving out {', '.join(fields)} of its joints does not help"
    return ""


def _advice_on_motors(body: Body) -> str:
    """Return which multiple of the gains, or else of torques and gains, makes an imported robot walk."""
    for factor in cures.FACTORS:
        strengthened_body = cures.multiply_gains(body, factor)
        walk = cures.walk(strengthened_body)
        if walk.quality == _GOOD_QUALITY:
            stiffnesses = [joint.servo.stiffness for joint in strengthened_body.joints]
            gains = f"{factor:g} times its stiffness and damping (up to {max(stiffnesses):.3g} N m/rad)"
            return f"; its gains are low, as with {gains} and the same torques {cures.PRESET} {_describe_walk(walk)}"
    for factor in cures.FACTORS:
        walk = cures.walk(cures.multiply_motors(body, factor))
        if walk.quality == _GOOD_QUALITY:
            motors = f"{factor:g} times the torques and gains of its motors ({_torque_range(body.joints, factor)})"
            return f"; its motors are weak, as with {motors} {cures.PRESET} {_describe_walk(walk)}"
    return f"; motors of {cures.FACTORS[-1]:g} times the torques and gains do not help"


def _describe_walk(walk: cures.FirstWalk) -> str:
    speed = f"{walk.speed:.2f} m/s ({walk.verdict.speed:.2f} of the target {walk.target:.2f})"
    return f"walks {walk.length} control steps at {speed}"


def _check_task() -> bool:
    """Print whether a task's results fit and are finite, and a batch computes what each computes alone; return it."""
    task, settings = task_from_flags()
    setup = Setup.of(FLAGS.robot, task, settings)
    task_results.check_results(setup)
    flaw = task_results.find_non_finite(setup, conformance.STEPS)
    if flaw is not None:
        print(f"{setup}: {flaw}, expected finite numbers")
        return False
    difference = conformance.difference(setup)
    if difference is None:
        print(f"{setup}: a batch of environments equals each of them alone over {conformance.STEPS} steps")
        return True
    print(f"{setup}: a batch of environments differs from one alone: {difference}")
    return False
