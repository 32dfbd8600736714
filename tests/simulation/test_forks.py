"""Forks: what was made before one says so in the child, and lets it live and end in peace."""

import copy
import gc
import multiprocessing
import os

import gymnasium
import interpreters
import numpy as np
import pytest
from tiers import never, tiers

import arc_suite

WATCHDOG = 120  # s; ends what hangs, and nothing that is only slow

# Makes something, forks, and reports from the child, which then ends as any script does.
SCRIPT = """
import gc, os, signal, sys
import gymnasium
import numpy as np
import arc_suite

what, then = sys.argv[1:]
if what == "vector environment":
    thing = gymnasium.make_vec("arc_suite/tick-steer-v0", num_envs=4, num_threads=4)
    uses = {"reset": thing.reset, "step": lambda: thing.step(np.zeros((4, 18)))}
elif what == "bodies":
    thing = gymnasium.make_vec("arc_suite/bodies-steer-v0", num_envs=2, bodies=("tick", "queen"))
    uses = {"reset": thing.reset, "step": lambda: thing.step(np.zeros(thing.action_space.shape))}
elif what == "gymnasium environment":
    thing = gymnasium.make("arc_suite/tick-steer-v0").unwrapped
    uses = {"reset": thing.reset, "step": lambda: thing.step(np.zeros(18, np.float32))}
else:
    thing = arc_suite.load("tick", "steer")
    uses = {"reset": thing.reset, "step": lambda: thing.step(np.zeros(18)), "render": thing.physics.render}
thing.reset()
uses["step"]()
arrays = thing.snapshot()
uses["snapshot"] = thing.snapshot
uses["restore"] = lambda: thing.restore(arrays)
uses["command"] = lambda: thing.command("command", (0.5, 0.0, 0.0))
uses["change_model"] = lambda: thing.change_model({"friction": 0.5})
uses["change_settings"] = lambda: thing.change_settings({"kicks": 0.0})
if what in ("vector environment", "bodies"):
    uses["rest"] = lambda: thing.rest(np.ones(thing.num_envs, bool))
    uses["close"] = thing.close
if what == "renderer":
    thing.physics.render(32, 32)
    def picture_of_a_new_one():
        environment = arc_suite.load("tick", "walk")
        environment.reset()
        environment.physics.render(32, 32)
    uses["new"] = picture_of_a_new_one
if os.fork():
    status = os.wait()[1]
    thing.reset()
    uses["step"]()  # the parent notices nothing
    if what == "renderer":
        thing.physics.render(32, 32)
    sys.exit(status != 0)
signal.alarm(60)  # ends a child that hangs
if then == "use":
    for name, use in uses.items():
        try:
            print(name, "returned", use())
        except Exception as error:
            print(name, f"{type(error).__name__}: {error}")
elif then == "collect":
    del thing, uses
    gc.collect()
print("ends")
"""
MADE_BEFORE = (
    "ForkError: this {} was made before a fork and cannot be used in the child process: "
    "make it after the fork, or start processes with multiprocessing's spawn"
)
OPENED_BEFORE = (
    "new RenderingUnavailable: cannot render: OpenGL was opened before this process was forked; "
    "make no picture before the fork, or start processes with multiprocessing's spawn"
)
CALLS = ("snapshot", "restore", "command", "change_model", "change_settings")


def refused_calls(what, *calls):
    return [f"{call} {MADE_BEFORE.format(what)}" for call in calls]


REFUSED = {
    "environment": refused_calls("environment", "reset", "step", "render", *CALLS),
    "gymnasium environment": refused_calls("environment", "reset", "step", *CALLS),
    "renderer": [*refused_calls("environment", "reset", "step", "render", *CALLS), OPENED_BEFORE],
    "vector environment": [
        *refused_calls("vector environment", "reset", "step", *CALLS, "rest"),
        "close returned None",
    ],
    "bodies": [*refused_calls("vector environment", "reset", "step", *CALLS, "rest"), "close returned None"],
}

SLOW, LONG = pytest.mark.slow, pytest.mark.long
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")


@forks
@pytest.mark.parametrize("then", tiers(["use", "collect", "exit"], never, lambda then: then == "use"))
@pytest.mark.parametrize("what", REFUSED)
def test_what_was_made_before_a_fork(what, then):
    expected = [*(REFUSED[what] if then == "use" else []), "ends"]
    assert interpreters.printed(SCRIPT, what, then) == expected


@pytest.mark.parametrize(
    "method",
    [pytest.param(m, marks=SLOW if m == "spawn" else LONG) for m in multiprocessing.get_all_start_methods()],
)
def test_async_vector_environments_work(method):
    """With pictures, unless this process has opened OpenGL and is forked."""
    size = {} if method == "fork" else {"render_mode": "rgb_array", "width": 32, "height": 32}
    kwargs = {"vectorization_mode": "async", "vector_kwargs": {"context": method}}
    envs = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2, **kwargs, **size)
    observations, _ = envs.reset(seed=5)
    rewards = [envs.step(np.zeros((2, 18), np.float32))[1] for _ in range(3)]
    pictures = envs.call("render")
    envs.close()
    for index in range(2):
        env = gymnasium.make("arc_suite/tick-walk-v0", **size)
        np.testing.assert_array_equal(observations[index], env.reset(seed=5 + index)[0])
        assert [float(reward[index]) for reward in rewards] == [env.step(np.zeros(18, np.float32))[1] for _ in range(3)]
        np.testing.assert_array_equal(pictures[index], env.render())


@pytest.mark.slow
@forks
def test_pictures_in_forked_children_of_a_process_that_made_none():
    code = (
        "import os, signal, sys, arc_suite\n"
        "child = os.fork() == 0\n"
        "signal.alarm(25)\n"
        "environment = arc_suite.load('tick', 'walk', {'random': 0}); environment.reset()\n"
        "picture = environment.physics.render(32, 32)\n"
        "if child: sys.exit(int(picture.std() < 5))\n"
        "sys.exit(os.wait()[1])\n"
    )
    assert interpreters.printed(code) == []


@forks
def test_a_copy_made_in_the_child_works():
    environment = arc_suite.load("tick", "walk", {"random": 0})
    environment.reset()
    expected = copy.deepcopy(environment).step(np.zeros(18)).reward
    receiver, sender = multiprocessing.Pipe(duplex=False)
    pid = os.fork()
    if pid == 0:
        try:
            sender.send(copy.deepcopy(environment).step(np.zeros(18)).reward)
        finally:
            os._exit(0)
    assert receiver.poll(WATCHDOG)
    assert receiver.recv() == expected
    os.waitpid(pid, 0)


def test_batches_are_destroyed_where_they_were_made():
    from arc_suite.simulation import forks

    gc.collect()
    before = len(forks._threaded)
    envs = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2)
    assert len(forks._threaded) == before + 1
    envs.close()
    del envs
    gc.collect()
    assert len(forks._threaded) == before
