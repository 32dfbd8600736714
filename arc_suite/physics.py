"""The simulation of one body: dm_control's `Physics`, cheaper to step and good to look at."""

from __future__ import annotations

import copy
import functools

import mujoco
from dm_control import mujoco as dm_mujoco

from arc_suite import forks, models, names, rendering
from arc_suite.robots import looks
from arc_suite.robots.looks.scene import MAX_HEIGHT, MAX_WIDTH
from arc_suite.spec import Body

_SENSOR = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)


class Physics(dm_mujoco.Physics):
    """Steps the undecorated model and renders the decorated one.

    A step leaves everything as `mj_step` does, with derived quantities one substep behind the
    state. Only the last of its substeps computes sensors, and with them `cfrc_ext`, so that the
    result is bit-equal to plain substeps and cheaper.

    Attributes:
        shown_reward: share of the greatest reward, 0 to 1, that pictures show as the colour of
            whatever glows; None leaves it its own colour.
    """

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
        """Advances by `nstep` substeps."""
        self._check_process()
        with self.check_invalid_state():
            model, data = self.model.ptr, self.data.ptr
            if nstep > 1:
                self._option.disableflags |= _SENSOR
                mujoco.mj_step(model, data, nstep - 1)
                self._option.disableflags &= ~_SENSOR
            mujoco.mj_step(model, data)

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
        return rendering.call(functools.partial(self._draw, height, width, camera_id, **kwargs))

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
            names.check(camera_id, cameras, "camera")
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
        return rendering.contexts(self.model)


# The decorated bodies that pictures are drawn of, whatever simulation asks for them.
_shared = functools.lru_cache(maxsize=8)(Decorated.from_body)
