"""One simulation of a body in an arena, as dm_control's `Physics`."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from dm_control.mujoco import wrapper
from numpy.typing import ArrayLike

from arc_suite import checks
from arc_suite.arenas import FLAT, Arena
from arc_suite.models.swinging import Swinging, list_bones
from arc_suite.models.visuals.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.robots.spec import Body
from arc_suite.simulation import forks, pictures, timers
from arc_suite.simulation.annotations import Data, Model, Named
from arc_suite.simulation.model import FIELDS, change_fields, compile_model, field, merge_lasting, shared_model
from arc_suite.simulation.state_arrays import LASTING_PREFIX, MODEL_PREFIX, check_snapshot, model_fields

if TYPE_CHECKING:
    from arc_suite.simulation import mujoco_types as dm_mujoco
else:
    from dm_control import mujoco as dm_mujoco

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)


class Physics(dm_mujoco.Physics):
    """Steps the undecorated model and renders the decorated one.

    A step leaves everything as `mj_step` does, with derived quantities one substep behind the
    state. Only the last of its substeps computes sensors, and with them `cfrc_ext`, so that the
    result is bit-equal to plain substeps and cheaper.

    In most arenas the model lists its contacts as pairs of geoms (`model.npair` > 0). There, at run
    time, write `pair_friction`, `pair_solref`, `pair_solimp`, `pair_margin` and `pair_gap`; fields of
    geoms, `contype` and `conaffinity` have no effect. `change_model` of the environments writes what
    contacts read. Steps leave `data.timer` at 0; see `timers`.

    Attributes:
        body: the body.
        arena: the ground and obstacles.
        shown_reward: share of the greatest reward, 0 to 1, that pictures show as the color of
            the material `glow`; None keeps its own color.
        marker: returns the debug markers of pictures, given this simulation; None for none.
        failed_legs: returns the names of the legs that pictures show dark; None for none.
        divergence: a text on how the physics diverged in the latest step, or None.
    """

    divergence: str | None = None
    _shared = False  # whether another simulation has the same model

    if TYPE_CHECKING:  # dm_control leaves these types open

        @property
        def data(self) -> Data: ...
        @property
        def model(self) -> Model: ...
        @property
        def named(self) -> Named: ...
        def time(self) -> float: ...
        def timestep(self) -> float: ...
        def control(self) -> np.ndarray: ...
        def velocity(self) -> np.ndarray: ...
        def position(self) -> np.ndarray: ...
        def get_state(self, sig: int | None = None) -> np.ndarray: ...
        def set_state(self, physics_state: np.ndarray, sig: int | None = None) -> None: ...
        def set_control(self, control: ArrayLike) -> None: ...
        def activation(self) -> np.ndarray: ...
        def state(self) -> np.ndarray: ...
        def forward(self) -> None: ...
        def check_divergence(self) -> None: ...
        def check_invalid_state(self) -> AbstractContextManager[None]: ...
        def suppress_physics_errors(self) -> AbstractContextManager[None]: ...
        def reset_context(self) -> AbstractContextManager[Physics]: ...
        def enable_profiling(self) -> None: ...

    @classmethod
    def from_body(cls, body: Body, arena: Arena = FLAT) -> Physics:
        """Return the simulation of a body in an arena, in its standing pose."""
        model = compile_model(body, arena)
        model.vis.global_.offwidth = MAX_WIDTH  # for renderers of other packages
        model.vis.global_.offheight = MAX_HEIGHT
        physics = cls.from_model(wrapper.MjModel(model))
        physics.body = body
        physics.arena = arena
        return physics

    def _reload_from_data(self, data):
        super()._reload_from_data(data)
        self._decorated = None
        self._written = {}  # values of fields of the model, as they were written last
        self._lasting = {}  # fields of the model that stay over resets; NaN where they do not
        self._scratch = None
        self.shown_reward = None
        self.marker = None
        self.failed_legs = None
        self._forks = forks.count
        self._option = self.model.ptr.opt  # kept, as a step is faster without this look-up

    def reset(self, keyframe_id: int | None = None) -> None:
        """Restart from the default pose, as in dm_control, with the compiled model and its lasting changes."""
        self.check_process()
        self._keep_edits(self._written)
        self._restore_compiled_fields()
        super().reset(keyframe_id)
        if self._lasting:
            self._write_fields({name: self.compiled_field(name) for name in self._lasting})

    def after_reset(self) -> None:
        """Compute derived quantities of the start; servos act, whereas dm_control disables motors."""
        self.forward()

    def change_model(self, fields: Mapping[str, np.ndarray], lasting: bool = False) -> None:
        """Set fields of the model.

        Rows of a field that a user has written into the model meanwhile, such as the mass of one body, count as
        lasting ones.

        Args:
            fields: values by name, in the shapes of the model's fields.
            lasting: whether they stay over resets and prevail over later values; else they hold until the next reset.
        """
        self._keep_edits(fields)
        if lasting:
            self._lasting = {**self._lasting, **fields}
        self._write_fields(fields)

    def compiled_field(self, name: str) -> np.ndarray:
        """Return a field of the model as it was compiled."""
        return field(shared_model(self.body, self.arena), name)

    @property
    def lasting_fields(self) -> Mapping[str, np.ndarray]:
        """Those fields of the model in which some rows stay over resets, by name."""
        self._keep_edits(self._written)
        return {name: field(self.model.ptr, name) for name in self._lasting}

    def _keep_edits(self, names: Iterable[str]) -> None:
        """Make those rows of fields lasting that a user has written into the model."""
        model = self.model.ptr
        compiled_model = shared_model(self.body, self.arena)
        for name in names:
            present_values = field(model, name)
            known_values = self._written.get(name)
            if known_values is None:
                known_values = field(compiled_model, name)
            differs = present_values != known_values
            if differs.any():
                is_edited = differs.reshape(len(differs), -1).any(axis=1)
                values = self._lasting.get(name, np.full_like(present_values, np.nan)).copy()
                values[is_edited] = present_values[is_edited]
                self._lasting = {**self._lasting, name: values}
                self._written[name] = present_values.copy()

    def _restore_compiled_fields(self) -> None:
        """Write the compiled values of all fields that were written, and forget that they were."""
        if self._written:
            compiled_fields = {name: self.compiled_field(name) for name in self._written}
            change_fields(self.model.ptr, compiled_fields, self._get_scratch())
            self._written = {}

    def _write_fields(self, fields: Mapping[str, np.ndarray]) -> None:
        """Write fields of the model, with lasting values in place of others."""
        merged_fields = {name: merge_lasting(values, self._lasting.get(name)) for name, values in fields.items()}
        change_fields(self.model.ptr, merged_fields, self._get_scratch())
        self._remember_values(merged_fields)

    def _remember_values(self, names: Iterable[str]) -> None:
        """Remember the present values of fields, with which later ones are compared."""
        self._written |= {name: field(self.model.ptr, name).copy() for name in names}

    def _get_scratch(self) -> mujoco.MjData:
        """Return data that `change_fields` overwrites."""
        if self._scratch is None:
            self._scratch = mujoco.MjData(self.model.ptr)
        return self._scratch

    def step(self, nstep: int = 1) -> None:
        """Advance by `nstep` substeps.

        Where these diverge, MuJoCo goes on from the model's default state; `divergence` then says
        what happened, and nothing is raised.

        Raises:
            ValueError: `nstep` is no integer from 1.
            ForkError: made before a fork.
        """
        self.check_process()
        model = self.model.ptr
        data = self.data.ptr
        option = self._option
        time = data.time
        self._warnings.fill(0)
        if nstep < 1:
            raise ValueError(f"nstep: expected an integer from 1, got {checks.preview(nstep)}")
        with timers.off:
            if nstep > 1 and not self._shared:  # another thread may be using the options of a shared model
                flags = option.disableflags
                option.disableflags = flags | _NO_SENSORS
                try:
                    mujoco.mj_step(model, data, nstep - 1)
                finally:  # an interrupt from the keyboard arrives here
                    option.disableflags = flags
                nstep = 1
            mujoco.mj_step(model, data, nstep)
        self.divergence = self._describe_divergence(time) if np.count_nonzero(self._warnings) else None

    def _describe_divergence(self, time: float) -> str:
        kind = int(self._warnings.argmax())
        cause = mujoco.mju_warningText(kind, int(self.data.warning.lastinfo[kind])).split(". ")[0]
        return f"physics diverged in the step from {time:.3f} s: {cause}"

    def check_process(self) -> None:
        """Raise ForkError in a child process that was forked after this object was made."""
        if self._forks != forks.count:
            forks.refuse("environment")

    def render(
        self,
        height: int = 480,
        width: int = 640,
        camera_id: int | str | Any = "tracking",  # editors do not know the type of a placed camera
        **kwargs: Any,
    ) -> np.ndarray:
        """Draw the decorated body in its present pose; other arguments as in dm_control.

        `camera_id` is a camera's name or index, -1 for a free one, or a `mujoco.MjvCamera` that the caller places. The
        decorated model has cameras of its own: `model.cam_pos` and other fields of cameras have no effect.

        With `quality="film"` edges of shadows are finer; with "still" all edges are. The default is "fast". Through the
        camera `eye` it is "sense", without shadows, ornaments and markers.

        Returns:
            (height, width, 3) uint8; with `depth=True`, (height, width) float32, m.

        Raises:
            ValueError: no such camera or quality, or an impossible size.
            RenderingUnavailable: no OpenGL here.
            ForkError: made before a fork.
        """
        self.check_process()
        options = self._pose() | kwargs
        return pictures.picture(self.body, self.arena, height=height, width=width, camera_id=camera_id, **options)

    def decorated_pose(self) -> pictures.Decorated:
        """Return the decorated body in the present pose, for a window; the same object at every call.

        Ornaments swing between the calls; in pictures, which depend on the present state alone, they are at rest.
        """
        if self._decorated is None:
            self._decorated = pictures.Decorated.from_body(self.body, self.arena)
            self._swinging = Swinging(list_bones(self.body))
        swings = self._swinging.follow(self.data.time, self.data.qpos[:7], self.arena)
        self._decorated.pose(**self._pose(), swings=swings)
        return self._decorated

    def _pose(self) -> dict:
        data = self.data.ptr
        return {
            "qpos": data.qpos,
            "share": self.shown_reward,
            "mocap_pos": data.mocap_pos,
            "markers": self.marker(self) if self.marker else (),
            "failed_legs": self.failed_legs() if self.failed_legs else (),
        }

    def free(self) -> None:
        """Free the simulation and the decorated body."""
        if self._decorated is not None:
            self._decorated.free()
            self._decorated = None
        super().free()

    def copy(self, share_model: bool = False) -> Physics:
        """Return a copy of the simulation in its present state.

        Args:
            share_model: the copy has this simulation's model, with every change of it, rather than one of its own.
                Its `reset` leaves the model as it is. Each may be stepped by a thread of its own; steps of both cost
                more from then on, as all of their substeps compute sensors.
        """
        physics = super().copy(share_model)
        mujoco.mj_copyData(physics.data.ptr, physics.model.ptr, self.data.ptr)
        physics.body = self.body
        physics.arena = self.arena
        physics.shown_reward = self.shown_reward
        if share_model:
            self._shared = True
            physics._shared = True
        else:
            self._keep_edits(self._written)
            physics._written = dict(self._written)
            physics._lasting = self._lasting
        return physics

    def snapshot(self, fields: Iterable[str]) -> dict[str, np.ndarray]:
        """Return the simulation's state and derived fields of `MjData` as a snapshot of a `Batch` of one.

        It has the fields of the model that differ from the compiled ones. MuJoCo's constants that follow from a user's
        edits are updated, as they are where the snapshot is restored.
        """
        earlier_lasting = self._lasting
        self._keep_edits(FIELDS)
        if self._lasting is not earlier_lasting:
            change_fields(self.model.ptr, {}, self._get_scratch())
        models = {f"{MODEL_PREFIX}{name}": field(self.model.ptr, name)[None].copy() for name in self._written}
        lasting = {f"{LASTING_PREFIX}{name}": np.array(values)[None] for name, values in self._lasting.items()}
        return self._state_arrays(fields) | models | lasting

    def _state_arrays(self, fields: Iterable[str]) -> dict[str, np.ndarray]:
        """Return the arrays of a snapshot that do not depend on changes of the model."""
        model = self.model.ptr
        data = self.data.ptr
        state = np.empty((1, mujoco.mj_stateSize(model, _STATE)))
        mujoco.mj_getState(model, data, state[0], _STATE)
        names = dict.fromkeys(("qpos", "qvel", "ctrl", *fields))
        return {"state": state, **{name: getattr(data, name)[None].copy() for name in names}}

    def check_snapshot(self, arrays: Mapping[str, np.ndarray], fields: Iterable[str]) -> Mapping[str, np.ndarray]:
        """Return the arrays of a snapshot if `restore` can take them; see `Batch.check_snapshot`."""
        return check_snapshot(self._state_arrays(fields), [self.model.ptr], arrays)

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Continue bit-identically from the arrays of `snapshot`, without later edits of the model."""
        self.check_process()
        self._keep_edits(FIELDS)
        fields_of_batch, lasting_of_batch = model_fields(arrays)
        fields = {name: values[0] for name, values in fields_of_batch.items()}
        self._restore_compiled_fields()
        self._lasting = {name: values[0] for name, values in lasting_of_batch.items() if not np.isnan(values).all()}
        if fields:
            self._write_fields(fields)
        model = self.model.ptr
        data = self.data.ptr
        mujoco.mj_setState(model, data, arrays["state"][0], _STATE)
        mujoco.mj_forward(model, data)
        mujoco.mj_setState(model, data, arrays["state"][0], _STATE)  # again, as the solver starts from it
        for name, array in arrays.items():
            if name != "state" and not name.startswith((MODEL_PREFIX, LASTING_PREFIX)):
                getattr(data, name)[:] = array[0]
        self.divergence = None
        self.shown_reward = None

    def __getstate__(self):
        self._keep_edits(self._written)
        written_names = list(self._written)
        return super().__getstate__(), self.body, self.arena, written_names, self._lasting, self.shown_reward

    def __setstate__(self, state):
        data, self.body, self.arena, written_names, lasting, *shown_rewards = state
        # dm_control recomputes the derived quantities; here they are one substep behind the state.
        saved_data = copy.copy(data.ptr)
        super().__setstate__(data)
        mujoco.mj_copyData(data.ptr, data.model.ptr, saved_data)
        self._lasting = lasting
        self._remember_values(written_names)
        self.shown_reward = shown_rewards[0] if shown_rewards else None  # pickles of earlier versions have none
