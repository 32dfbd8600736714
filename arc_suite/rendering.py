"""Which OpenGL there is to render with, and one line when there is none.

MuJoCo and dm_control open their backend when they are imported, and refuse to be imported where
that fails. `select_backend` imports them so that everything but rendering works all the same.
"""

import contextlib
import ctypes
import os
import sys

_REMEDY = "on Debian, apt-get install libegl1 libgl1 libgl1-mesa-dri and set MUJOCO_GL=egl"
_OFF = ("off", "disable", "disabled", "false", "0")  # values of MUJOCO_GL that both libraries take for no backend

_failure = None  # what kept the backend from being imported


class RenderingUnavailable(RuntimeError):
    """No picture can be made here; the message says why, and what to do about it."""


def select_backend() -> None:
    """Imports MuJoCo and dm_control with the best OpenGL there is, or else with none.

    `MUJOCO_GL` is set to egl if the user has not set it, there is no display and libEGL loads; a
    user's own value stays. Where the backend does not work, dm_control is imported without one and
    rendering raises `RenderingUnavailable`.
    """
    global _failure
    if "MUJOCO_GL" not in os.environ and not has_display() and _loads("libEGL.so.1"):
        os.environ["MUJOCO_GL"] = "egl"
    before = {name: os.environ.get(name) for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM", "EGL_LOG_LEVEL")}
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # Mesa without a driver warns on standard error
    try:
        _import_mujoco()
    except Exception as error:  # ImportError, AttributeError, RuntimeError, ...: as many as there are causes
        _failure = error
        os.environ["MUJOCO_GL"] = _OFF[0]
        _import_mujoco()
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


def _import_mujoco() -> None:
    # GLFW is slow to import; leave it alone where nobody will try it.
    glfw_tried = os.environ.get("MUJOCO_GL") not in ("egl", *_OFF)
    with _strict_glfw() if glfw_tried else contextlib.nullcontext():
        import dm_control._render  # noqa: F401
        import mujoco  # noqa: F401


@contextlib.contextmanager
def _strict_glfw():
    """Lets GLFW raise what it warns of by default, which makes dm_control go on to the next backend."""
    import glfw

    before, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "raise"
    try:
        yield
    finally:
        glfw.ERROR_REPORTING = before


def has_display() -> bool:
    """Whether windows can be expected to open: always on macOS and Windows, elsewhere with X11 or Wayland."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def require_window() -> None:
    """Makes sure that a window can be opened, where MuJoCo's viewer would end the process.

    Raises:
        RenderingUnavailable: it cannot; why, and the remedy.
    """
    import glfw

    try:
        with _strict_glfw():
            glfw.init()
    except glfw.GLFWError as error:
        raise RenderingUnavailable(f"cannot open a window: {error}; use render_mode 'rgb_array'") from None


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def errors():
    """Turns whatever goes wrong while OpenGL is opened into one line.

    Raises:
        RenderingUnavailable: why there is no picture, and the remedy.
    """
    try:
        yield
    except Exception as error:
        raise RenderingUnavailable(_explain(_failure or error)) from None


def _explain(error: Exception) -> str:
    setting = os.environ.get("MUJOCO_GL")
    if setting in _OFF:
        return f"cannot render: MUJOCO_GL={setting} turns it off; unset it, or set MUJOCO_GL=egl"
    if isinstance(error, AttributeError):  # PyOpenGL's way to say that a library is not there
        reason = "the OpenGL library is missing"
    else:
        reason = " ".join(str(error.__cause__ or error).split())
    backend = f" with MUJOCO_GL={setting}" if setting else ""
    return f"cannot render{backend}: {reason}; {_REMEDY}"
