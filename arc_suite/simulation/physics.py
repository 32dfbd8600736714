"""Simulations of a body: one, as dm_control's `Physics`, or many at once on a thread pool."""

from __future__ import annotations

import copy
import functools
import types

import mujoco
import mujoco.batch
import numpy as np
from dm_control import mujoco as dm_mujoco

from arc_suite import checks, models
from arc_suite.models import looks
from arc_suite.models.looks.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.robots.spec import Body
from arc_suite.simulation import forks, opengl

_SENSOR = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)


class Physics(dm_mujoco.Physics):
    """Steps the undecorated model and renders the decorated one.

    A step leaves everything as `mj_step` does, with derived quantities one substep behind the
    state. Only the last of its substeps computes sensors, and with them `cfrc_ext`, so that the
    result is bit-equal to plain substeps and cheaper.

    Attributes:
        shown_reward: share of the greatest reward, 0 to 1, that pictures show as the colour of
            whatever glows; None leaves it its own colour.
        divergence: how the physics diverged in the latest step, in one line, or None.
    """

    divergence: str | None = None

    @classmethod
    def from_body(cls, body: Body) -> Physics:
        """Compiles the body on its floor."""
        physics = cls.from_xml_string(models.assemble(body).to_xml_string())
        physics.body = body
        return physics

    def _reload_from_data(self, data):
        super()._reload_from_data(data)
        self._decorated = None
        self.shown_reward = None
        self._forks = forks.count
        self._option = self.model.ptr.opt

    def reset(self, keyframe_id=None) -> None:
        """As in dm_control."""
        self._check_process()
        super().reset(keyframe_id)

    def step(self, nstep: int = 1) -> None:
        """Advances by `nstep` substeps.

        Where these diverge, MuJoCo goes on from the model's default state; `divergence` then says
        what happened, and nothing is raised.
        """
        self._check_process()
        model, data, option = self.model.ptr, self.data.ptr, self._option
        time = data.time
        self._warnings.fill(0)
        if nstep > 1:
            flags = option.disableflags
            option.disableflags = flags | _SENSOR
            mujoco.mj_step(model, data, nstep - 1)
            option.disableflags = flags
        elif nstep != 1:
            raise ValueError(f"nstep: expected an integer from 1, got {nstep!r}")
        mujoco.mj_step(model, data)
        self.divergence = self._describe_divergence(time) if np.count_nonzero(self._warnings) else None

    def _describe_divergence(self, time: float) -> str:
        kind = int(self._warnings.argmax())
        cause = mujoco.mju_warningText(kind, int(self.data.warning.lastinfo[kind])).split(". ")[0]
        return f"physics diverged in the step from {time:.3f} s: {cause}"

    def _check_process(self) -> None:
        if self._forks != forks.count:
            forks.refuse("environment")

    def render(self, height=480, width=640, camera_id="tracking", **kwargs):
        """A picture of the decorated body, (height, width, 3) uint8; other arguments as in dm_control.

        Raises:
            ValueError: no such camera, or an impossible size; one line.
            RenderingUnavailable: no OpenGL here.
            ForkError: made before a fork.
        """
        self._check_process()
        self.check_camera(camera_id)
        for name, size, limit in (("height", height, MAX_HEIGHT), ("width", width, MAX_WIDTH)):
            if size not in range(1, limit + 1):
                raise ValueError(f"{name}: expected an integer from 1 to {limit}, got {size!r}")
        return opengl.call(functools.partial(self._draw, height, width, camera_id, **kwargs))

    def _draw(self, height, width, camera_id, **kwargs):
        shared = _shared(self.body)
        shared.pose(self)
        return shared.render(height, width, camera_id, **kwargs)

    def decorated(self) -> Decorated:
        """The decorated body in the present pose, to look at in a window; the same object at every call."""
        if self._decorated is None:
            self._decorated = Decorated.from_body(self.body)
        self._decorated.pose(self)
        return self._decorated

    def check_camera(self, camera_id) -> None:
        """Raises ValueError, one line, if there is no such camera (a name, an index, or -1 for the free one)."""
        cameras = [self.model.id2name(i, "camera") for i in range(self.model.ncam)]
        if isinstance(camera_id, str):
            checks.name(camera_id, cameras, "camera")
        elif camera_id not in range(-1, len(cameras)):
            raise ValueError(f"no camera {camera_id}: expected -1 (free) to {len(cameras) - 1}, or one of {cameras}")

    def free(self) -> None:
        """Frees the simulation, and what a window showed of it."""
        if self._decorated is not None:
            self._decorated.free()
            self._decorated = None
        super().free()

    def copy(self, share_model: bool = False) -> Physics:
        """An independent copy of the simulation, as it stands."""
        copied = super().copy(share_model)
        mujoco.mj_copyData(copied.data.ptr, copied.model.ptr, self.data.ptr)
        copied.body = self.body
        return copied

    def __getstate__(self):
        return super().__getstate__(), self.body

    def __setstate__(self, state):
        data, self.body = state
        # dm_control recomputes the derived quantities; here they are one substep behind the state.
        as_it_stands = copy.copy(data.ptr)
        super().__setstate__(data)
        mujoco.mj_copyData(data.ptr, data.model.ptr, as_it_stands)


class Decorated(dm_mujoco.Physics):
    """A body with its looks, which takes the pose of a simulation to be looked at."""

    @classmethod
    def from_body(cls, body: Body) -> Decorated:
        """Compiles the decorated body on its floor."""
        decorated = cls.from_xml_string(models.assemble(body, decorated=True).to_xml_string())
        decorated._glow = decorated.model.ptr.material("glow").rgba.copy()
        buffer = decorated.model.vis.global_
        buffer.offwidth = buffer.offheight = 1  # it grows with the pictures that are asked for
        return decorated

    def pose(self, simulation: Physics) -> None:
        """Takes the state of a simulation of the same body, and shows its reward."""
        self.set_state(simulation.get_state())
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight):
            update(self.model.ptr, self.data.ptr)
        share = simulation.shown_reward
        self.model.ptr.material("glow").rgba = self._glow if share is None else looks.reward_colour(share)

    def render(self, height, width, camera_id, **kwargs):
        """As in dm_control."""
        buffer = self.model.vis.global_
        buffer.offheight, buffer.offwidth = max(height, buffer.offheight), max(width, buffer.offwidth)
        return super().render(height, width, camera_id, **kwargs)

    @property
    def contexts(self):
        """Those that all pictures of this process are drawn with."""
        return opengl.contexts(self.model)


# The decorated bodies that pictures are drawn of, whatever simulation asks for them.
_shared = functools.lru_cache(maxsize=8)(Decorated.from_body)


class Batch:
    """Many simulations of one model, bit-equal to as many `Physics`, on a thread pool.

    Attributes:
        data: live arrays under the names of `MjData`, with a leading axis for the rows. Writing
            qpos, qvel or ctrl writes the simulations' state.
    """

    def __init__(self, model: mujoco.MjModel, rows: int, threads: int = 0):
        """Allocates the simulations, which share the model.

        Args:
            model: of them all; copied.
            rows: how many.
            threads: to step on; 0 for as many as there are CPUs.
        """
        self._forks = forks.count
        self._simulations = mujoco.batch.Batch(model, rows, threads)
        forks.keep(self._simulations)
        self._silent = copy.copy(model)
        self._silent.opt.disableflags |= _SENSOR
        # What is bound is filled by every call, so it must be bound before the first.
        fields = ("qpos", "qvel", "ctrl", "cfrc_ext", "xpos")
        self.data = types.SimpleNamespace(**{name: self._simulations.bind(name) for name in fields})

    def part(self, rows: np.ndarray) -> types.SimpleNamespace:
        """A copy of `data` for some rows alone, (rows,) booleans."""
        return types.SimpleNamespace(**{name: array[rows] for name, array in vars(self.data).items()})

    def step(self, nstep: int, rows: np.ndarray) -> np.ndarray:
        """Advances some rows by `nstep` substeps, as `Physics.step` does.

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
        simulations.set_models(self._silent)
        simulations.step(rows, nstep - 1)
        simulations.set_models(None)
        simulations.step(rows)
        return simulations.warning[..., 1].any(axis=-1)

    def reset(self, rows: np.ndarray, qpos: np.ndarray, qvel: np.ndarray) -> None:
        """Restarts some rows, as dm_control's `reset_context` does.

        Args:
            rows: mask (rows,) of whom to restart.
            qpos: (restarted, nq) their positions.
            qvel: (restarted, nv) their velocities.

        Raises:
            ForkError: made before a fork.
        """
        self._check_process()
        self._simulations.reset(rows)  # runs mj_forward, from whose result the solver starts next
        self.data.qpos[rows], self.data.qvel[rows] = qpos, qvel
        self._simulations.forward(rows)

    def _check_process(self) -> None:
        if self._forks != forks.count:
            forks.refuse("vector environment")
