"""Headless rendering: which OpenGL there is, and one line when there is none."""

import contextlib
import ctypes
import os

_REMEDY = "on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri, then MUJOCO_GL=egl"


class RenderingUnavailable(RuntimeError):
    """No picture can be made here; the message says what to install."""


def select_backend() -> None:
    """Makes dm_control importable whatever OpenGL there is, preferring EGL where there is no display.

    `MUJOCO_GL` is set to egl only if the user has not set it, there is no display and libEGL
    loads. dm_control opens its backend on import and refuses to be imported where that fails;
    then it is imported without one, and rendering raises `RenderingUnavailable`.
    """
    chosen = os.environ.get("MUJOCO_GL")
    if chosen is None and not has_display() and _loads("libEGL.so.1"):
        os.environ["MUJOCO_GL"] = "egl"
    elif chosen is None and not has_display():
        os.environ["MUJOCO_GL"] = "disable"
    try:
        import dm_control._render  # noqa: F401
    except Exception:
        before = os.environ["MUJOCO_GL"]
        os.environ["MUJOCO_GL"] = "disable"
        try:
            import dm_control._render  # noqa: F401
        finally:
            os.environ["MUJOCO_GL"] = before
    if os.environ.get("MUJOCO_GL") == "disable" and chosen is None:
        del os.environ["MUJOCO_GL"]


def has_display() -> bool:
    """Whether a window can be opened."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def errors():
    """Turns whatever goes wrong in OpenGL into one line."""
    try:
        yield
    except (RuntimeError, ImportError, AttributeError) as error:
        raise RenderingUnavailable(f"cannot render: {str(error).rstrip('.')}; {_REMEDY}".replace("\n", " ")) from None
