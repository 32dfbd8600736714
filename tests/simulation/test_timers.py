"""MuJoCo's clock is out while our own steps run, and back after them, whatever happens."""

import concurrent.futures
import multiprocessing
import os
import threading

import interpreters
import mujoco
import numpy as np
import pytest

from arc_suite.robots import ROBOTS
from arc_suite.simulation import timers
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model
from arc_suite.simulation.physics import Physics

BODY = ROBOTS["tick"]
STEP = mujoco.mjtTimer.mjTIMER_STEP


@pytest.fixture
def clock():
    """The C variable, which holds after a test what it held before."""
    variable = timers._clock_variable()
    before = variable.value
    assert before is not None
    yield variable
    after, variable.value = variable.value, before
    assert after == before


def seconds_of_steps():
    """What MuJoCo measures of steps that are not ours: > 0 if there is a clock."""
    model = compile_model(BODY)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10)
    return data.timer[STEP].duration


def test_our_steps_read_no_clock_and_others_do(clock):
    physics = Physics.from_body(BODY)
    physics.step(25)
    assert physics.data.ptr.timer[STEP].number >= 25
    assert physics.data.ptr.timer[STEP].duration == 0.0
    assert seconds_of_steps() > 0.0
    Batch(compile_model(BODY), 2, 2).step(25, np.ones(2, bool))
    assert seconds_of_steps() > 0.0


def test_an_exception_puts_the_clock_and_sensors_back(clock):
    physics = Physics.from_body(BODY)
    flags = physics.model.opt.disableflags
    with pytest.raises(TypeError):
        physics.step(2.5)
    assert seconds_of_steps() > 0.0 and physics.model.opt.disableflags == flags
    with pytest.raises(ValueError):
        Batch(compile_model(BODY), 2, 2).step(25, np.ones(3, bool))
    assert seconds_of_steps() > 0.0


def test_no_thread_leaves_it_out(clock):
    inside, leave = threading.Barrier(3), [threading.Event(), threading.Event()]

    def stay(event):
        with timers.off:
            inside.wait(20)
            event.wait(20)

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        stays = [pool.submit(stay, event) for event in leave]
        inside.wait(20)
        assert clock.value is None
        for event, thread in zip(leave, stays, strict=True):
            event.set()
            thread.result()
            assert clock.value is not None


def test_a_clock_of_the_users_own_stays(clock):
    ticks, physics = iter(range(10**6)), Physics.from_body(BODY)
    mujoco.set_mjcb_time(lambda: float(next(ticks)))
    own = clock.value
    physics.step(25)
    assert clock.value == own
    mujoco.set_mjcb_time(None)  # installs that of the bindings again
    assert physics.data.ptr.timer[STEP].duration >= 25


def test_one_installed_meanwhile_stays(clock):
    with timers.off:
        mujoco.set_mjcb_time(lambda: 0.0)
        own = clock.value
    assert clock.value == own
    mujoco.set_mjcb_time(None)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_fork_in_the_midst_of_steps_restores_it_with_the_first_own_step(clock):
    def in_child(sender):
        with timers.off:
            inside = clock.value
        sender.send([inside, clock.value])

    receiver, sender = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(target=in_child, args=(sender,))
    before = clock.value
    with timers.off:
        child.start()
    assert receiver.poll(20)
    assert receiver.recv() == [None, before]
    child.join(20)
    assert child.exitcode == 0


SCRIPT = """
import ctypes, mujoco, pathlib
variable = None
if {reachable}:
    library = next(pathlib.Path(mujoco.__file__).parent.glob("*mujoco.*"))
    variable = ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")
else:
    def refuse(self, name, *args, **kwargs):
        raise OSError(name)
    ctypes.CDLL.__init__ = refuse
before = variable and variable.value
import arc_suite
assert (variable and variable.value) == before
from arc_suite.robots import ROBOTS
from arc_suite.simulation.physics import Physics
physics = Physics.from_body(ROBOTS["tick"])
physics.step(25)
assert (variable and variable.value) == before
print(before is not None, physics.data.ptr.timer[int(mujoco.mjtTimer.mjTIMER_STEP)].duration > 0.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("reachable", "told"), [(True, "True False"), (False, "False True")])
def test_import_changes_nothing_and_without_the_symbol_all_works(reachable, told):
    assert interpreters.printed(SCRIPT.format(reachable=reachable), MUJOCO_GL="disable") == [told]
