"""A window that shows a body at the pace of its simulated time: MuJoCo's viewer."""

import threading
import time
from collections.abc import Callable, Iterable

import mujoco
import numpy as np

from arc_suite.markers import Marker
from arc_suite.simulation import opengl
from arc_suite.simulation.pictures import Decorated, geom_of

_CLOSING_TIMEOUT = 10.0  # s
_AZIMUTH = 140.0  # degrees, of the camera that the mouse turns
_ELEVATION = -15.0  # degrees


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
            shown: the decorated body that the window shows; the caller sets its poses.
            camera_id: name or index of the first camera, -1 for one that follows the torso and that the mouse turns.
            pressed: function that is called with GLFW's number of each key that is pressed, in the window's thread.
            instead: alternative to a window, for the error.

        Raises:
            RenderingUnavailable: no window can be opened here.
        """
        opengl.require_window(instead)
        from mujoco import viewer  # imported here: it initializes GLFW, which prints errors where there is no display

        self._model = shown.model.ptr
        self._data = shown.data.ptr
        other_threads = set(threading.enumerate())
        try:
            self._viewer = viewer.launch_passive(
                self._model, self._data, key_callback=pressed, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:  # macOS opens windows only under `mjpython`
            raise opengl.RenderingUnavailable(f"cannot open a window: {error}; {instead}") from None
        self._threads = set(threading.enumerate()) - other_threads
        self._set_camera(camera_id)
        self._next_picture_time = time.monotonic()  # s

    def _set_camera(self, camera_id: int | str) -> None:
        camera_index = self._model.camera(camera_id).id if isinstance(camera_id, str) else camera_id
        with self._viewer.lock():
            camera = self._viewer.cam
            if camera_index >= 0:
                camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
                camera.fixedcamid = camera_index
            else:
                camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
                camera.trackbodyid = self._model.body("torso").id
                camera.azimuth = _AZIMUTH
                camera.elevation = _ELEVATION

    @property
    def is_open(self) -> bool:
        """Whether nobody has closed the window."""
        return self._viewer.is_running()

    def show(self, duration: float, markers: Iterable[Marker] = (), text: str = "") -> None:
        """Draw the present pose, and wait until the duration of the previous picture is over.

        A window that was closed shows nothing and does not wait.

        Args:
            duration: duration for which this picture stands, s.
            markers: debug markers to show.
            text: a line in the lower left corner.
        """
        if not self.is_open:
            return
        shown_markers = list(markers)
        with self._viewer.lock():
            user_scene = self._viewer.user_scn
            user_scene.ngeom = len(shown_markers)
            for marker, geom in zip(shown_markers, user_scene.geoms, strict=False):  # there are more geoms
                geom_of(marker, geom)
        self._viewer.set_texts((None, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT, text, None))
        self._viewer.sync()
        time.sleep(max(0.0, self._next_picture_time - time.monotonic()))
        self._next_picture_time = time.monotonic() + duration

    def pulls(self) -> np.ndarray:
        """Return the force, N, and torque, N m, of the mouse on each body of the model: (bodies, 6)."""
        self._data.xfrc_applied[:] = 0.0
        with self._viewer.lock():
            perturbation = self._viewer.perturb
            if perturbation.active and perturbation.select > 0:
                mujoco.mjv_applyPerturbForce(self._model, self._data, perturbation)
        return self._data.xfrc_applied.copy()

    def close(self) -> None:
        """Close the window; a second call does nothing."""
        self._viewer.close()
        # A thread that still draws while the process ends would crash.
        for thread in self._threads:
            thread.join(_CLOSING_TIMEOUT)
