"""Errors that repeat a value from outside hold the beginning of its text."""

import gymnasium
import programs
import pytest

import arc_suite
from arc_suite import checks, data, files, policies, registry
from arc_suite.learning.agents.hyperparameters import ProximalPolicy, SoftActorCritic

LONG = "x" * 1_000_000


def environment():
    made = arc_suite.load("tick", "steer", {"random": 0})
    made.reset()
    return made


def gym():
    return gymnasium.make("arc_suite/tick-walk-v0").unwrapped


PLACES = {
    "robot": lambda: arc_suite.load(LONG, "walk"),
    "module of a robot": lambda: arc_suite.load(f"{LONG}:queen", "walk"),
    "no module of a robot": lambda: arc_suite.load(f"{LONG}-:queen", "walk"),
    "name in a module": lambda: arc_suite.load(f"creature:{LONG}", "walk"),
    "name in a file": lambda: registry.refuse_import("task", f"{LONG}:walk"),
    "task": lambda: arc_suite.load("tick", LONG),
    "setting": lambda: arc_suite.load("tick", "walk", {LONG: 1}),
    "value of a setting": lambda: arc_suite.load("tick", "walk", {"target_velocity": LONG}),
    "motion": lambda: arc_suite.load("tick", "mimic", {"motion": f"{LONG}.npz"}),
    "ground": lambda: arc_suite.load("tick", "walk", {"arena": f"{LONG}.png:1x1x1"}),
    "spec": lambda: arc_suite.load(f"{LONG}.json", "walk"),
    "folder": lambda: files.folder(LONG),
    "target": lambda: files.check_target(LONG),
    "policy": lambda: policies.policy(LONG, "tick"),
    "module of a policy": lambda: policies.policy(f"{LONG}:make", "tick"),
    "name of a policy": lambda: policies.policy(f"os:{LONG}", "tick"),
    "family": lambda: arc_suite.register(families={f"{LONG}-": None}),
    "dataset": lambda: data.open(LONG),
    "id of a dataset": lambda: data.open(f"{LONG} "),
    "command": lambda: environment().command(LONG, [0.0, 0.0, 0.0]),
    "value of a command": lambda: environment().command("command", LONG),
    "attribute": lambda: setattr(gym(), LONG, 1),
    "option of reset": lambda: gym().reset(options={LONG: 1}),
    "steps": lambda: environment().physics.step(-(10**4000)),
    "blocks": lambda: SoftActorCritic(exclude_blocks=(LONG, 1)),
    "updates": lambda: SoftActorCritic(utd_ratio=LONG),
    "share": lambda: ProximalPolicy(discount=LONG),
    "import": lambda: checks.import_object(f"os:{LONG}", "policy"),
}


@pytest.mark.parametrize("place", PLACES)
def test_a_long_text_is_shortened(place):
    with pytest.raises((ValueError, AttributeError, OSError)) as caught:
        PLACES[place]()
    assert str(caught.value).count("x") < 500


# A program's argument has at most 131,072 characters on Linux.
ARGUMENT = LONG[:100_000]


@pytest.mark.parametrize(
    "argument",
    [
        ARGUMENT,
        f"--steps={ARGUMENT}",
        f"--robot={ARGUMENT}",
        f"--set={ARGUMENT}",
        f"--set=random={ARGUMENT}",
        f"--vecnormalize={ARGUMENT}",
        f"--policy={ARGUMENT}",
        f"--length={ARGUMENT}",
        f"--spec={ARGUMENT}",
        f"--{ARGUMENT}=1",
    ],
    ids=lambda argument: argument[:16],
)
def test_a_long_argument_is_shortened(argument):
    done = programs.arc_suite("evaluate", argument)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.count("x") < 500
