"""Following a command: what a body is asked for, corrected by how its measured motion falls short."""

from collections.abc import Sequence

import numpy as np

_SMOOTHING = 0.25  # cycles over which a new command takes hold
_ONSET = 1.0  # cycles over which the gait grows to its full size


class Following:
    """Feedback of a task's block `command`, by proportion and integral, in the rows of a batch."""

    def __init__(self, gain: tuple[float, float, float], integral: float, cycles: float):
        """Begin with no rows.

        Args:
            gain: of the motion's shortfall, forward, left and turning.
            integral: of the same, a cycle of the gait.
            cycles: of the gait that a control step lasts.
        """
        self._gain, self._integral, self._cycles = gain, integral, cycles
        self._state = None

    def begin(self, rows: Sequence[int]) -> None:
        """Start episodes in some rows, given by their indices."""
        if self._state is not None:
            for field in self._state:
                field[rows] = 0.0

    def asked(self, clock, commanded) -> tuple[np.ndarray, np.ndarray]:
        """Return the motion (rows, 3) to ask for, in units of the command, and the size (rows, 1) of the gait, up to 1.

        Args:
            clock: (rows, 2) the block `gait_clock`, 0 where all is to stand.
            commanded: (rows, 6) the block `command`: what is asked, and the measured motion.
        """
        if self._state is None or len(self._state[0]) != len(clock):
            self._state = np.zeros((len(clock), 3)), np.zeros((len(clock), 3)), np.zeros((len(clock), 1))
        command, integral, size = self._state
        wanted, motion = commanded[:, :3], commanded[:, 3:]
        command += min(1.0, self._cycles / _SMOOTHING) * (wanted - command)
        integral += self._integral * self._cycles * (wanted - motion)
        integral.clip(-1.0, 1.0, out=integral)
        going = clock.any(axis=-1, keepdims=True)
        integral *= going
        size += np.where(going, 1.0, -1.0) * self._cycles / _ONSET
        size.clip(0.0, 1.0, out=size)
        return command + integral + self._gain * (command - motion), size


def phase(clock) -> np.ndarray:
    """Return the phase (rows,) of the gait, cycles, that the block `gait_clock` (rows, 2) tells."""
    return np.arctan2(clock[:, 0], clock[:, 1]) / (2.0 * np.pi)
