"""Many simulations at once on a thread pool, of one model or of models of one layout."""

import copy
import types
from collections.abc import Iterable, Mapping, Sequence

import mujoco
import mujoco.batch
import numpy as np

from arc_suite.simulation import forks, timers
from arc_suite.simulation.model import ReadOnly, change_fields, field, merge_lasting
from arc_suite.simulation.state_arrays import LASTING_PREFIX, MODEL_PREFIX, check_snapshot, model_fields

_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
# Sizes of models on which `MjData` does not depend.
_TEXT_SIZES = ("nbuffer", "nnames", "nnames_map", "npaths", "ntext", "ntextdata")


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
            model: one for all simulations, which is copied; or one for each, all of one `layout`, which are kept.
            count: number of simulations.
            threads: number of threads; 0 for as many as there are CPUs.
            fields: fields of `MjData` that `data` has, in addition to qpos, qvel and ctrl.
        """
        self._forks = forks.count
        # Models as compiled, and with changes, one for each simulation; None while they share one.
        self._compiled = None if isinstance(model, mujoco.MjModel) else list(model)
        self._models = self._compiled
        first_model = model if self._compiled is None else model[0]
        self._simulations = mujoco.batch.Batch(first_model, count, threads)
        forks.keep(self._simulations)
        self._simulations.set_models(self._models)
        self._changed_fields: dict[str, None] = {}  # an ordered set of names
        self._lasting: dict[str, np.ndarray] = {}  # (count, *shape) values that stay over resets, NaN for no change
        # Models whose sensors are off. They step all substeps but the last, which alone needs sensors and is slower.
        if self._compiled is None:
            self._sensorless = _without_sensors(model)
        else:
            self._sensorless = [_without_sensors(compiled) for compiled in self._compiled]
        # MuJoCo's batch fills bound arrays in every call, so they are bound before the first one.
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
        return [ReadOnly(model) for model in self._models or self._compiled_models]

    @property
    def _compiled_models(self) -> list[mujoco.MjModel]:
        """The model of each simulation as it was compiled."""
        return self._compiled or [self._simulations.model] * self._simulations.nsim

    @property
    def changed(self) -> list[str]:
        """Names of the models' fields that were changed at any time."""
        return list(self._changed_fields)

    def part(self, mask: np.ndarray | int) -> types.SimpleNamespace:
        """Return `data` of some simulations: copies for a mask (count,), views without that axis for an index."""
        return types.SimpleNamespace(**{name: array[mask] for name, array in vars(self.data).items()})

    def step(self, nstep: int, mask: np.ndarray) -> np.ndarray:
        """Advance some simulations by `nstep` substeps, as `Physics.step` does.

        Where these diverge, MuJoCo continues from the model's default state and counts a warning.

        Args:
            nstep: number of substeps, at least 2.
            mask: (count,) simulations to advance.

        Returns:
            Mask (count,) of simulations that diverged.

        Raises:
            ForkError: made before a fork.
        """
        self.check_process()
        simulations = self._simulations
        simulations.warning[...] = 0
        with timers.off:
            simulations.set_models(self._sensorless)
            try:
                simulations.step(mask, nstep - 1)
            finally:
                simulations.set_models(self._models)
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
            mask: (count,) simulations to restart.
            qpos: (restarted, nq) their positions.
            qvel: (restarted, nv) their velocities.
            mocap_pos: (restarted, nmocap, 3) positions of the arena's movable bodies; None for the model's.
            models: (restarted,) fields of each model that differ until the next reset, by name; empty for none.

        Raises:
            ForkError: made before a fork.
        """
        self.check_process()
        self._simulations.set_models(self._compiled)
        self._simulations.reset(mask)  # runs mj_forward, from whose result the solver starts next
        if self._models is not self._compiled or any(models):
            self._change_for_episode(mask, models or [{}] * len(qpos))
        self._simulations.set_models(self._models)
        self.data.qpos[mask] = qpos
        self.data.qvel[mask] = qvel
        if mocap_pos is not None:
            self.mocap_pos[mask] = mocap_pos
        self._simulations.forward(mask)

    def place(self, mask: np.ndarray, qpos: np.ndarray) -> None:
        """Move some simulations to other positions and update derived quantities.

        Args:
            mask: (count,) simulations to move.
            qpos: (moved, nq) their positions.

        Raises:
            ForkError: made before a fork.
        """
        self.check_process()
        self.data.qpos[mask] = qpos
        self._simulations.forward(mask)

    def compiled_field(self, name: str) -> np.ndarray:
        """Return a field (count, *shape) of the models as they were compiled."""
        return np.stack([field(model, name) for model in self._compiled_models])

    def change_model(self, fields: Mapping[str, np.ndarray], mask: np.ndarray) -> None:
        """Set fields of the models of some simulations from now on, over resets.

        Args:
            fields: values (count, *shape) by name.
            mask: (count,) simulations whose models change.

        Raises:
            ForkError: made before a fork.
        """
        self.check_process()
        for name, values in fields.items():
            lasting = self._lasting.setdefault(name, np.full(values.shape, np.nan))
            lasting[mask] = values[mask]
        changes = [{name: values[index] for name, values in fields.items()} for index in np.flatnonzero(mask)]
        self._write(mask, changes)
        self._simulations.set_models(self._models)

    def _change_for_episode(self, mask: np.ndarray, models: Sequence[Mapping[str, np.ndarray]]) -> None:
        """Set models of some simulations to the compiled ones with fields of one episode, and with lasting changes."""
        self._changed_fields |= dict.fromkeys(name for fields in (*models, self._lasting) for name in fields)
        compiled = self._compiled_models
        changes = []
        for index, fields in zip(np.flatnonzero(mask).tolist(), models, strict=True):
            compiled_fields = {name: field(compiled[index], name) for name in self._changed_fields}
            lasting = self._lasting_of(index)
            episode_fields = {**compiled_fields, **fields}
            merged_fields = {name: merge_lasting(episode_fields[name], lasting.get(name)) for name in episode_fields}
            changes.append(merged_fields)
        self._write(mask, changes)

    def _write(self, mask: np.ndarray, models: Sequence[Mapping[str, np.ndarray]]) -> None:
        """Write fields into the models of some simulations.

        The first change gives each simulation a model of its own.

        Args:
            mask: (count,) the simulations.
            models: fields by name for each of them.
        """
        self._changed_fields |= dict.fromkeys(name for fields in models for name in fields)
        if self._models is self._compiled:
            self._models = [copy.copy(model) for model in self._compiled_models]
            self._sensorless = [_without_sensors(model) for model in self._compiled_models]
        scratch = mujoco.MjData(self._simulations.model)
        for index, fields in zip(np.flatnonzero(mask).tolist(), models, strict=True):
            change_fields(self._models[index], fields, scratch)
            change_fields(self._sensorless[index], fields, scratch)

    def lasting_fields(self, index: int) -> dict[str, np.ndarray]:
        """Return by name those fields of a simulation's model in which some rows stay over resets."""
        return {name: field(self._models[index], name) for name in self._lasting_of(index)}

    def _lasting_of(self, index: int) -> dict[str, np.ndarray]:
        """Return the values of a simulation's model that stay over resets, by name; NaN where values do not."""
        fields = {name: values[index] for name, values in self._lasting.items()}
        return {name: values for name, values in fields.items() if not np.isnan(values).all()}

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return copies of the simulations' state, of `data` and of changed model fields, for `restore`."""
        fields = {name: array.copy() for name, array in vars(self.data).items()}
        models = {
            f"{MODEL_PREFIX}{name}": np.stack([field(model, name) for model in self._models])
            for name in self._changed_fields
        }
        lasting = {f"{LASTING_PREFIX}{name}": values.copy() for name, values in self._lasting.items()}
        return {"state": self._simulations.state.copy(), **fields, **models, **lasting}

    def check_snapshot(self, arrays: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        """Return the arrays of a snapshot if `restore` can take them.

        Raises:
            ValueError: an array is missing, too many, of another shape or type, or holds a value out of range.
        """
        like = {"state": self._simulations.state, **vars(self.data)}
        return check_snapshot(like, self._compiled_models, arrays)

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue bit-identically from the arrays of `snapshot`."""
        fields, self._lasting = model_fields(arrays)
        if fields or self._lasting or self._models is not self._compiled:
            count = self._simulations.nsim
            changes = [{name: values[index] for name, values in fields.items()} for index in range(count)]
            self._change_for_episode(np.ones(count, bool), changes)
            self._simulations.set_models(self._models)
        self._simulations.state[...] = arrays["state"]
        for name, bound in vars(self.data).items():
            _fill(bound, arrays[name])

    def __getstate__(self):
        simulations = self._simulations
        model = self._compiled or simulations.model
        return model, simulations.nsim, simulations.nthread, list(vars(self.data)), self.snapshot()

    def __setstate__(self, state):
        *arguments, arrays = state
        self.__init__(*arguments)
        self.restore(arrays)

    def check_process(self) -> None:
        """Raise ForkError in a child process that was forked after this object was made."""
        if self._forks != forks.count:
            forks.refuse("vector environment")


def layout(model: mujoco.MjModel) -> tuple[int, ...]:
    """Return the sizes of a model that simulations of one batch share; names and texts may differ."""
    names = [name for name in dir(model) if name.startswith("n") and name not in _TEXT_SIZES]
    attributes = [getattr(model, name) for name in names]
    return tuple(attribute for attribute in attributes if isinstance(attribute, int))


def _without_sensors(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model with sensors disabled."""
    sensorless_model = copy.copy(model)
    sensorless_model.opt.disableflags |= _NO_SENSORS
    return sensorless_model


def _fill(array: np.ndarray, values: np.ndarray) -> None:
    """Write into a bound array, which may be a read-only output."""
    was_writeable = array.flags.writeable
    array.flags.writeable = True
    array[...] = values
    array.flags.writeable = was_writeable
