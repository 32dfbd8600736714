"""Switch off MuJoCo's timers in our own steps: they cost small bodies 2 to 7 % of the speed.

To fill `MjData.timer`, a substep reads the clock of the C variable `mjcb_time` some 30 times. MuJoCo
leaves it empty, but its Python bindings install a clock on import.
"""

import contextlib
import ctypes
import pathlib
import threading

import mujoco

from arc_suite.simulation import forks


class Off:
    """A context without the bindings' clock, in which steps leave `MjData.timer` at 0.

    Any number of threads may enter; the last to leave restores the clock. A clock that was installed
    since (`mujoco.set_mjcb_time`) stays, and our steps read it. Meanwhile simulations of other threads
    read no clock either.
    """

    def __init__(self, variable: ctypes.c_void_p):
        """Store the present clock of a C variable."""
        self._variable = variable
        self._clock = variable.value
        self._lock = threading.Lock()
        self._inside = 0  # threads
        self._taken = False
        forks.at_fork(after_in_child=self._leave_all)

    def __enter__(self):
        with self._lock:
            self._inside += 1
            if self._variable.value == self._clock:
                self._taken = True
                self._variable.value = None

    def __exit__(self, *_):
        with self._lock:
            self._inside -= 1
            if not self._inside:
                self._put_back()

    def _put_back(self) -> None:
        if self._taken and self._variable.value is None:
            self._variable.value = self._clock
        self._taken = False

    def _leave_all(self) -> None:
        """Reset in a forked child, which has no other threads."""
        self._lock, self._inside = threading.Lock(), 0
        self._put_back()


def _clock_variable() -> ctypes.c_void_p | None:
    """Return `mjcb_time` of the loaded MuJoCo, or None if it cannot be reached."""
    for path in pathlib.Path(mujoco.__file__).parent.glob("*mujoco.*"):  # libmujoco.so.3.17.0, .dylib, mujoco.dll
        with contextlib.suppress(OSError, ValueError):
            return ctypes.c_void_p.in_dll(ctypes.CDLL(str(path)), "mjcb_time")
    return None


_variable = _clock_variable()
off = contextlib.nullcontext() if _variable is None else Off(_variable)
