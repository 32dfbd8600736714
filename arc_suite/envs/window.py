"""A window that shows a simulation at the pace of its time: Gymnasium's viewer, made safe to close."""

import contextlib
import time
from collections.abc import Iterable

import glfw
import mujoco
from gymnasium.envs.mujoco.mujoco_rendering import WindowViewer

from arc_suite.markers import Marker
from arc_suite.simulation import opengl, pictures


class _Viewer(WindowViewer):
    def _key_callback(self, window, key, scancode, action, mods):
        if key == glfw.KEY_ESCAPE:  # the viewer would end GLFW for everybody, and then go on drawing
            glfw.set_window_should_close(window, True)
        else:
            super()._key_callback(window, key, scancode, action, mods)


class Window:
    """Stays closed once a person has closed it, by its button or the escape key."""

    def __init__(self, physics, camera_id: int | str, width: int, height: int):
        """Open the window.

        Args:
            physics: the dm_control simulation to show; updated by its owner.
            camera_id: name or index of the camera to begin with, -1 for a free one.
            width: pixels.
            height: pixels.

        Raises:
            RenderingUnavailable: no window can be opened here.
        """
        opengl.require_window()
        before = glfw.get_current_context()
        self._viewer = _Viewer(physics.model.ptr, physics.data.ptr, width, height)
        glfw.make_context_current(before)
        index = physics.model.name2id(camera_id, "camera") if isinstance(camera_id, str) else camera_id
        if index >= 0:
            self._viewer.cam.type, self._viewer.cam.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, index
        self._due = time.monotonic()

    def show(self, duration: float, marks: Iterable[Marker] = ()) -> None:
        """Draw the present state and marks, and return `duration` seconds after the last picture was due."""
        if self._viewer is None:
            return
        if glfw.window_should_close(self._viewer.window):
            self.close()
            return
        for mark in marks:
            geom = pictures.geom_of(mark)
            shape = {"type": geom.type, "size": geom.size, "pos": geom.pos, "mat": geom.mat.ravel(), "rgba": geom.rgba}
            self._viewer.add_marker(**shape)
        with _current(self._viewer):
            self._viewer.render()
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._due = time.monotonic() + duration

    def close(self) -> None:
        """Close the window; once more does nothing."""
        if self._viewer is not None:
            with _current(self._viewer):
                self._viewer.con.free()
            self._viewer.free()
            self._viewer = None


@contextlib.contextmanager
def _current(viewer):
    """Draws in the viewer's context, then gives way to that of pictures rendered beside the window."""
    before = glfw.get_current_context()
    viewer.make_context_current()
    try:
        yield
    finally:
        glfw.make_context_current(before)
