"""Many simulations at once on a thread pool, of one model or of models of one layout."""

import copy
import types
from collections.abc import Iterable, Mapping, Sequence

import mujoco
import mujoco.batch
import numpy as np

from arc_suite.simulation import forks, timers
from arc_suite.simulation.model import ReadOnly, change, field
from arc_suite.simulation.state_arrays import LASTING, OF_MODEL, checked_snapshot, model_fields

_SENSOR = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
# Sizes of models that make no difference to `MjData`.
_TEXTS = ("nbuffer", "nnames", "nnames_map", "npaths", "ntext", "ntextdata")


class Batch:
    """Many simulations on a thread pool, bit-identical to as many `Physics`.

    Pickles and copies continue bit-identically.

    Attributes:
        data: live arrays under the names of `MjData`, with a leading axis for the simulations. Writing
            qpos, qvel or ctrl writes the simulations' state.
    """

    def __init__(
        self,
        model: mujoco.MjModel | Sequence[mujoco.MjModel],
        count: int,
        threads: int = 0,
        fields: Iterable[str] = ("qpos", "qvel", "ctrl", "cfrc_ext", "xpos"),
    ):
        """Allocate the simulations.

        Args:
            model: of them all, copied; or one for each, all of one `layout`, which stay as they are.
            count: number of simulations.
            threads: to step on; 0 for as many as there are CPUs.
            fields: of `MjData` that `data` has; qpos, qvel and ctrl always are among them.
        """
        self._forks = forks.count
        # Models as compiled, and as they now are, one for each simulation; None while they share one.
        self._compiled = None if isinstance(model, mujoco.MjModel) else list(model)
        self._own = self._compiled
        self._simulations = mujoco.batch.Batch(model if self._compiled is None else model[0], count, threads)
        forks.keep(self._simulations)
        self._simulations.set_models(self._own)
        self._changed: dict[str, None] = {}  # names of fields that ever were
        self._lasting: dict[str, np.ndarray] = {}  # (count, *shape) values that stay over resets, NaN for none
        self._silent = _silent(model) if self._compiled is None else [_silent(each) for each in model]
        # What is bound is filled by every call, so it must be bound before the first.
        fields = dict.fromkeys(("qpos", "qvel", "ctrl", *fields))
        self.data = types.SimpleNamespace(**{name: self._simulations.bind(name) for name in fields})

    @property
    def mocap_pos(self) -> np.ndarray:
        """Positions (count, nmocap, 3) of the arena's movable bodies, live."""
        return self._simulations.bind("mocap_pos")

    @property
    def xfrc_applied(self) -> np.ndarray:
        """Forces and torques (count, nbody, 6) on the bodies' centers of mass, N and N m, world, live."""
        return self._simulations.bind("xfrc_applied")

    @property
    def models(self) -> list[ReadOnly]:
        """The model of each simulation, to read; `change_model` changes them."""
        return [ReadOnly(model) for model in self._own or [self._simulations.model] * self._simulations.nsim]

    @property
    def changed(self) -> list[str]:
        """Names of the models' fields that ever were changed."""
        return list(self._changed)

    def part(self, mask: np.ndarray | int) -> types.SimpleNamespace:
        """Return `data` of some simulations: copies for a mask (count,), views without that axis for an index."""
        return types.SimpleNamespace(**{name: array[mask] for name, array in vars(self.data).items()})

    def step(self, nstep: int, mask: np.ndarray) -> np.ndarray:
        """Advance some simulations by `nstep` substeps, as `Physics.step` does.

        Where these diverge, MuJoCo goes on from the model's default state, says nothing and counts
        a warning.

        Args:
            nstep: number of substeps, at least 2.
            mask: (count,) of those to advance.

        Returns:
            Mask (count,) of those that diverged.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        simulations = self._simulations
        simulations.warning[...] = 0
        with timers.off:
            simulations.set_models(self._silent)
            try:
                simulations.step(mask, nstep - 1)
            finally:
                simulations.set_models(self._own)
            simulations.step(mask)
        return simulations.warning[..., 1].any(axis=-1)

    def reset(
        self,
        mask: np.ndarray,
        qpos: np.ndarray,
        qvel: np.ndarray,
        mocap_pos: np.ndarray | None = None,
        models: Sequence[Mapping[str, np.ndarray]] = (),
    ) -> None:
        """Restart some simulations, as dm_control's `reset_context` does.

        Args:
            mask: (count,) of those to restart.
            qpos: (restarted, nq) their positions.
            qvel: (restarted, nv) their velocities.
            mocap_pos: (restarted, nmocap, 3) positions of the arena's movable bodies; None for the model's.
            models: (restarted,) fields of the model by name that differ until the next reset; empty for none.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        self._simulations.set_models(self._compiled)
        self._simulations.reset(mask)  # runs mj_forward, from whose result the solver starts next
        if self._own is not self._compiled or any(models):
            self._change(mask, models or [{}] * len(qpos))  # with lasting changes
        self._simulations.set_models(self._own)
        self.data.qpos[mask], self.data.qvel[mask] = qpos, qvel
        if mocap_pos is not None:
            self.mocap_pos[mask] = mocap_pos
        self._simulations.forward(mask)

    def place(self, mask: np.ndarray, qpos: np.ndarray) -> None:
        """Move some simulations to other positions and update derived quantities.

        Args:
            mask: (count,) of those to move.
            qpos: (moved, nq) where to.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        self.data.qpos[mask] = qpos
        self._simulations.forward(mask)

    def change_model(self, fields: Mapping[str, np.ndarray], mask: np.ndarray) -> None:
        """Set fields of the models of some simulations from now on, over resets.

        Args:
            fields: values (count, *shape) by name.
            mask: (count,) of those to change.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        for name, values in fields.items():
            lasting = self._lasting.setdefault(name, np.full(values.shape, np.nan))
            lasting[mask] = values[mask]
        self._write(mask, [{name: fields[name][index] for name in fields} for index in np.flatnonzero(mask)])
        self._simulations.set_models(self._own)

    def _change(self, mask: np.ndarray, models: Sequence[Mapping[str, np.ndarray]]) -> None:
        """Let models of some simulations be the compiled ones with lasting changes, and with fields of one episode."""
        self._changed |= dict.fromkeys(name for fields in models for name in fields)
        compiled = self._compiled or [self._simulations.model] * len(mask)
        changes = []
        for index, fields in zip(np.flatnonzero(mask).tolist(), models, strict=True):
            unchanged = {name: field(compiled[index], name) for name in self._changed}
            changes.append({**unchanged, **fields, **self.lasting(index)})
        self._write(mask, changes)

    def _write(self, mask: np.ndarray, models: Sequence[Mapping[str, np.ndarray]]) -> None:
        self._changed |= dict.fromkeys(name for fields in models for name in fields)
        if self._own is self._compiled:
            compiled = self._compiled or [self._simulations.model] * len(mask)
            self._own, self._silent = [copy.copy(each) for each in compiled], [_silent(each) for each in compiled]
        scratch = mujoco.MjData(self._simulations.model)
        for index, fields in zip(np.flatnonzero(mask).tolist(), models, strict=True):
            for own in (self._own[index], self._silent[index]):
                change(own, fields, scratch)

    def lasting(self, index: int) -> dict[str, np.ndarray]:
        """Return fields of a simulation's model that stay over resets, by name."""
        return {name: each[index] for name, each in self._lasting.items() if not np.isnan(each[index]).any()}

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return copies of the simulations' state, of `data` and of changed model fields, for `restore`."""
        fields = {name: array.copy() for name, array in vars(self.data).items()}
        models = {f"{OF_MODEL}{name}": np.stack([field(own, name) for own in self._own]) for name in self._changed}
        lasting = {f"{LASTING}{name}": values.copy() for name, values in self._lasting.items()}
        return {"state": self._simulations.state.copy(), **fields, **models, **lasting}

    def checked(self, arrays: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """Return the arrays of a snapshot if `restore` can take them.

        Raises:
            ValueError: an array is missing, too many, of another shape or type, or holds a value out of range.
        """
        models = self._compiled or [self._simulations.model] * self._simulations.nsim
        return checked_snapshot({"state": self._simulations.state, **vars(self.data)}, models, arrays)

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue bit-identically from the arrays of `snapshot`."""
        models, self._lasting = model_fields(arrays)
        if models or self._own is not self._compiled:
            each = range(self._simulations.nsim)
            self._change(np.ones(len(each), bool), [{name: models[name][index] for name in models} for index in each])
            self._simulations.set_models(self._own)
        self._simulations.state[...] = arrays["state"]
        for name, bound in vars(self.data).items():
            _fill(bound, arrays[name])

    def __getstate__(self):
        simulations, model = self._simulations, self._compiled or self._simulations.model
        return model, simulations.nsim, simulations.nthread, list(vars(self.data)), self.snapshot()

    def __setstate__(self, state):
        *arguments, arrays = state
        self.__init__(*arguments)
        self.restore(arrays)

    def _check_process(self) -> None:
        if self._forks != forks.count:
            forks.refuse("vector environment")


def layout(model: mujoco.MjModel) -> tuple[int, ...]:
    """Return the sizes of a model that simulations of one batch share; names and texts may differ."""
    names = (name for name in dir(model) if name.startswith("n") and name not in _TEXTS)
    return tuple(size for size in (getattr(model, name) for name in names) if isinstance(size, int))


def _silent(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model with sensors disabled."""
    model = copy.copy(model)
    model.opt.disableflags |= _SENSOR
    return model


def _fill(array: np.ndarray, values: np.ndarray) -> None:
    """Write into a bound array, including read-only outputs."""
    writeable = array.flags.writeable
    array.flags.writeable = True
    array[...] = values
    array.flags.writeable = writeable
