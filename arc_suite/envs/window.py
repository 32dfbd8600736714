"""A window that shows a body at the pace of its simulated time: MuJoCo's viewer."""

import threading
import time
from collections.abc import Callable, Iterable

import mujoco
import numpy as np

from arc_suite.markers import Marker
from arc_suite.simulation import opengl
from arc_suite.simulation.pictures import Decorated, geom_of

_PATIENCE = 10.0  # s, for the window to close


class Window:
    """Shows a decorated body until a person closes it; it stays closed then."""

    def __init__(
        self,
        shown: Decorated,
        camera_id: int | str = -1,
        pressed: Callable[[int], None] | None = None,
        instead: str = "use render_mode 'rgb_array'",
    ):
        """Open the window.

        Args:
            shown: the decorated body; its owner poses it.
            camera_id: name or index of the first camera, -1 for one that follows the torso and that the mouse turns.
            pressed: called with GLFW's number of each key, in the window's thread.
            instead: the alternative to a window, for the error.

        Raises:
            RenderingUnavailable: no window can be opened here.
        """
        opengl.require_window(instead)
        from mujoco import viewer  # initializes GLFW, which complains where there is no display

        self._model, self._data, others = shown.model.ptr, shown.data.ptr, set(threading.enumerate())
        try:
            self._viewer = viewer.launch_passive(
                self._model, self._data, key_callback=pressed, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:  # macOS has windows under `mjpython` alone
            raise opengl.RenderingUnavailable(f"cannot open a window: {error}; {instead}") from None
        self._threads = set(threading.enumerate()) - others
        index = self._model.camera(camera_id).id if isinstance(camera_id, str) else camera_id
        with self._viewer.lock():
            camera = self._viewer.cam
            if index >= 0:
                camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, index
            else:
                camera.type, camera.trackbodyid = mujoco.mjtCamera.mjCAMERA_TRACKING, self._model.body("torso").id
                camera.azimuth, camera.elevation = 140.0, -15.0
        self._due = time.monotonic()

    @property
    def is_open(self) -> bool:
        """Whether nobody has closed the window."""
        return self._viewer.is_running()

    def show(self, duration: float, markers: Iterable[Marker] = (), text: str = "") -> None:
        """Draw the present pose and return `duration` seconds after the last picture was due; nothing once closed.

        Args:
            duration: s, for which the picture stands.
            markers: debug markers to show.
            text: a line in the lower left corner.
        """
        if not self.is_open:
            return
        with self._viewer.lock():
            scene, markers = self._viewer.user_scn, list(markers)
            scene.ngeom = len(markers)
            for marker, geom in zip(markers, scene.geoms, strict=False):
                geom_of(marker, geom)
        self._viewer.set_texts((None, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT, text, None))
        self._viewer.sync()
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._due = time.monotonic() + duration

    def pulls(self) -> np.ndarray:
        """Return force, N, and torque, N m, with which the mouse pulls at each body of the model: (bodies, 6)."""
        self._data.xfrc_applied[:] = 0.0
        with self._viewer.lock():
            perturb = self._viewer.perturb
            if perturb.active and perturb.select > 0:
                mujoco.mjv_applyPerturbForce(self._model, self._data, perturb)
        return self._data.xfrc_applied.copy()

    def close(self) -> None:
        """Close the window; once more does nothing."""
        self._viewer.close()
        for thread in self._threads:  # were the process to end while one still draws, it would crash
            thread.join(_PATIENCE)
