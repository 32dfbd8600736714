"""Switch off MuJoCo's timers in our own steps: they cost small bodies 2 to 7 % of the speed.

To fill `MjData.timer`, a substep reads the clock of the C variable `mjcb_time` some 30 times. MuJoCo
leaves it empty, but its Python bindings install a clock on import.
"""

import contextlib
import ctypes
import pathlib

import mujoco


class Off:
    """A context without the bindings' clock, in which steps leave `MjData.timer` at 0.

    Every exit restores the clock, so threads need no lock: one that is still inside reads the clock again. A clock
    that was installed since (`mujoco.set_mjcb_time`) stays, and our steps read it.
    """

    def __init__(self, variable: ctypes.c_void_p):
        """Store the present clock of a C variable."""
        self._variable = variable
        self._clock = variable.value

    def __enter__(self):
        if self._variable.value == self._clock:
            self._variable.value = None

    def __exit__(self, *_):
        if self._variable.value is None:
            self._variable.value = self._clock


def _clock_variable() -> ctypes.c_void_p | None:
    """Return `mjcb_time` of the loaded MuJoCo, or None if it cannot be reached."""
    for path in pathlib.Path(mujoco.__file__).parent.glob("*mujoco.*"):  # libmujoco.so.3.17.0, .dylib, mujoco.dll
        with contextlib.suppress(OSError, ValueError):
            return ctypes.c_void_p.in_dll(ctypes.CDLL(str(path)), "mjcb_time")
    return None


_variable = _clock_variable()
off = contextlib.nullcontext() if _variable is None else Off(_variable)
