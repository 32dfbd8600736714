"""Many simulations of one model at once, on a thread pool."""

import copy
import types
from collections.abc import Iterable, Mapping

import mujoco
import mujoco.batch
import numpy as np

from arc_suite.simulation import forks, timers

_SENSOR = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)


class Batch:
    """Many simulations of one model, bit-equal to as many `Physics`, on a thread pool.

    Pickles and copies go on to the bit.

    Attributes:
        data: live arrays under the names of `MjData`, with a leading axis for the rows. Writing
            qpos, qvel or ctrl writes the simulations' state.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        rows: int,
        threads: int = 0,
        fields: Iterable[str] = ("qpos", "qvel", "ctrl", "cfrc_ext", "xpos"),
    ):
        """Allocate the simulations, which share the model.

        Args:
            model: of them all; copied.
            rows: how many.
            threads: to step on; 0 for as many as there are CPUs.
            fields: of `MjData` that `data` has; qpos, qvel and ctrl always are among them.
        """
        self._forks = forks.count
        self._simulations = mujoco.batch.Batch(model, rows, threads)
        forks.keep(self._simulations)
        self._silent = copy.copy(model)
        self._silent.opt.disableflags |= _SENSOR
        # What is bound is filled by every call, so it must be bound before the first.
        fields = dict.fromkeys(("qpos", "qvel", "ctrl", *fields))
        self.data = types.SimpleNamespace(**{name: self._simulations.bind(name) for name in fields})

    def part(self, rows: np.ndarray) -> types.SimpleNamespace:
        """Return a copy of `data` for some rows alone, (rows,) booleans."""
        return types.SimpleNamespace(**{name: array[rows] for name, array in vars(self.data).items()})

    def step(self, nstep: int, rows: np.ndarray) -> np.ndarray:
        """Advance some rows by `nstep` substeps, as `Physics.step` does.

        Where these diverge, MuJoCo goes on from the model's default state, says nothing and counts
        a warning.

        Args:
            nstep: number of substeps, at least 2.
            rows: mask (rows,) of whom to advance.

        Returns:
            Mask (rows,) of those that diverged.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        simulations = self._simulations
        simulations.warning[...] = 0
        with timers.off:
            simulations.set_models(self._silent)
            try:
                simulations.step(rows, nstep - 1)
            finally:
                simulations.set_models(None)
            simulations.step(rows)
        return simulations.warning[..., 1].any(axis=-1)

    def reset(self, rows: np.ndarray, qpos: np.ndarray, qvel: np.ndarray, mocap_pos: np.ndarray | None = None) -> None:
        """Restart some rows, as dm_control's `reset_context` does.

        Args:
            rows: mask (rows,) of whom to restart.
            qpos: (restarted, nq) their positions.
            qvel: (restarted, nv) their velocities.
            mocap_pos: (restarted, nmocap, 3) positions of the arena's movable bodies; None for the model's.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        self._simulations.reset(rows)  # runs mj_forward, from whose result the solver starts next
        self.data.qpos[rows], self.data.qvel[rows] = qpos, qvel
        if mocap_pos is not None:
            self._simulations.bind("mocap_pos")[rows] = mocap_pos
        self._simulations.forward(rows)

    def place(self, rows: np.ndarray, qpos: np.ndarray) -> None:
        """Move some rows to other positions, and bring derived quantities up to date.

        Args:
            rows: mask (rows,) of whom to move.
            qpos: (moved, nq) where to.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        self.data.qpos[rows] = qpos
        self._simulations.forward(rows)

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return copies of the simulations' state and of `data`, from which `restore` goes on to the bit."""
        fields = {name: array.copy() for name, array in vars(self.data).items()}
        return {"state": self._simulations.state.copy(), **fields}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `snapshot` returned.

        Raises:
            KeyError, ValueError: an array is missing or does not fit.
        """
        self._simulations.state[...] = arrays["state"]
        for name, bound in vars(self.data).items():
            _fill(bound, arrays[name])

    def __getstate__(self):
        simulations = self._simulations
        return simulations.model, simulations.nsim, simulations.nthread, list(vars(self.data)), self.snapshot()

    def __setstate__(self, state):
        *arguments, arrays = state
        self.__init__(*arguments)
        self.restore(arrays)

    def _check_process(self) -> None:
        if self._forks != forks.count:
            forks.refuse("vector environment")


def _fill(array: np.ndarray, values: np.ndarray) -> None:
    """Write into a bound array, be it an output, which MuJoCo hands out for reading alone."""
    writeable = array.flags.writeable
    array.flags.writeable = True
    array[...] = values
    array.flags.writeable = writeable
