"""Check a body in a spec file, or a task.

  arc-suite check spider
  arc-suite check --walk spider
  arc-suite check --task crouching:crouch --robot tick

A body: one line for each flaw, with the value that would fit: feet that hang in the air, legs that hold
nothing up, none that can step. With --walk the demonstrator walks it for 100 control steps. Where it falls,
drags its torso, or stays below 0.7 of the target speed, the line names the fields to leave out, which are
then sized to suit the body.

A task: a batch of environments must compute bit for bit what each computes alone, over 200 control steps;
the line names the terms, metrics and blocks that differ.

Exit status 1 if there is any flaw, fall, slow walk or difference.
"""

from absl import flags

from arc_suite import registry
from arc_suite.cli.flags import ROBOT_HELP, define_task, task_from_flags
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance, cures
from arc_suite.models.soundness import flaws
from arc_suite.robots.spec import Body

FLAGS = flags.FLAGS
define_task()
flags.DEFINE_bool("walk", False, "Let the demonstrator walk a body, whatever its flaws are, if any walk is possible.")
flags.DEFINE_string("robot", "queen", f"In which a task is checked: {ROBOT_HELP}.")


_FLAWS = {"touch": "drags its torso", "slow": "is slow"}  # by the names of failures, except falls


def main(spec: str | None = None) -> int:
    """Print the flaws of the body in a spec file, or how a task differs, and return the exit status."""
    if (spec is None) != FLAGS["task"].present:
        raise ValueError("expected a spec file or --task; see --help")
    if FLAGS.walk and spec is None:
        raise ValueError("--walk: expected a spec file, got --task")
    return _check_task() if spec is None else _check_body(spec)


def _check_body(spec: str) -> int:
    body = registry.body_of(spec)
    found = flaws(body)
    for flaw in found:
        print(f"{spec}: {flaw.text}")
    if not found:
        print(f"{spec}: {body.name} stands and can take steps")
    walked = _check_walk(spec, body) if FLAGS.walk and not any(flaw.hopeless for flaw in found) else 0
    return int(bool(found) or walked)


def _check_walk(spec: str, body: Body) -> int:
    tried = cures.walk(body)
    if tried.quality == 2:
        print(f"{spec}: {_said(tried)}")
        return 0
    cure = cures.left_out(body, tried.quality)
    advice, given = "", cures.given_fields(body)
    if cure is not None:
        advice = f": leave out {' and '.join(cure[0])} of its joints: it then {_said(cure[1])}"
    elif given:
        advice = f": leaving out {', '.join(given)} of its joints does not help"
    if tried.verdict.fell:
        flaw = f"falls after {tried.length} control steps"
    else:
        flaw = f"{' and '.join(_FLAWS[failure] for failure in tried.verdict.failures)}: {_said(tried)}"
    print(f"{spec}: {body.name} {flaw}{advice}")
    return 1


def _said(tried: cures.FirstWalk) -> str:
    speed = f"{tried.speed:.2f} m/s ({tried.verdict.speed:.2f} of the target {tried.target:.2f})"
    return f"walks {tried.length} control steps at {speed}"


def _check_task() -> int:
    setup = Setup.of(FLAGS.robot, *task_from_flags())
    found = conformance.difference(setup)
    same = f"a batch of environments equals each of them alone over {conformance.STEPS} steps"
    print(f"{setup}: {same}" if found is None else f"{setup}: a batch of environments differs from one alone: {found}")
    return int(found is not None)
