"""OpenGL: chosen on import, opened at the first picture, one context for all pictures of a process.

A context is large and slow to make. So one context draws all pictures of a process, one after the
other, in a daemon thread of its own that leaves other contexts alone. Without OpenGL everything but
rendering works.
"""

import atexit
import concurrent.futures
import contextlib
import ctypes
import importlib
import os
import pathlib
import queue
import sys
import threading
import types

from arc_suite import checks
from arc_suite.simulation import forks

_REMEDY = "on Debian, apt-get install libegl1 libgl1 libgl1-mesa-dri and set MUJOCO_GL=egl"
# For errors that name a variable of the environment.
_REMEDIES_BY_VARIABLE = {
    "PYOPENGL_PLATFORM": "unset PYOPENGL_PLATFORM",
    "MUJOCO_GL must": "unset it, or set MUJOCO_GL=egl",
}
_WINDOWED = ("darwin", "win32")  # platforms that always have a display, and no EGL
_DEVICE = "MUJOCO_EGL_DEVICE_ID"
_OFF = ("off", "disable", "disabled", "false", "0")  # values of MUJOCO_GL that both libraries take for no backend
_BACKEND = "dm_control._render"  # dm_control's choice of a backend, made when this module is executed

_MAX_DRAWINGS = 4  # MuJoCo contexts, of some 30 MB each

_renderer = None
_lock = threading.Lock()


class RenderingUnavailable(RuntimeError):
    """Rendering is impossible here; the message gives the cause and the remedy."""


def select_backend() -> None:
    """Choose the best OpenGL there is and import MuJoCo, without opening anything.

    `MUJOCO_GL` is set to egl if the user has not set it, there is no display and libEGL loads; a
    user's own value stays. dm_control, which would open OpenGL when it is imported and refuse to be
    imported where that fails, does so at the first picture instead.
    """
    if "MUJOCO_GL" not in os.environ and not has_display() and _loads("libEGL.so.1"):
        os.environ["MUJOCO_GL"] = "egl"
    with _environment():
        try:
            import mujoco
        except Exception:  # ImportError, AttributeError, RuntimeError, ...: as many as there are causes
            os.environ["MUJOCO_GL"] = _OFF[0]
            import mujoco  # noqa: F401
    if _BACKEND not in sys.modules:
        _postpone_backend()


def _postpone_backend() -> None:
    """Replace dm_control's backend by an empty module, which loads the real one at first use."""
    import dm_control

    module = types.ModuleType(_BACKEND)
    module.__path__ = [str(pathlib.Path(dm_control.__file__).with_name("_render"))]

    def load(name):
        if name not in ("BACKEND", "Renderer", "USING_GPU"):
            raise AttributeError(f"module {_BACKEND!r} has no attribute {name!r}")
        _reload(module)
        return vars(module)[name]

    module.__getattr__ = load  # type: ignore[method-assign]  # of a module: PEP 562
    sys.modules[_BACKEND] = dm_control._render = module


@contextlib.contextmanager
def _environment():
    """Restore environment variables afterwards, and silence Mesa's warnings."""
    before = {name: os.environ.get(name) for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM", "EGL_LOG_LEVEL")}
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


@contextlib.contextmanager
def _strict_glfw():
    """Turn GLFW's warnings into errors, so that dm_control tries the next backend."""
    import glfw

    before, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "raise"
    try:
        yield
    finally:
        glfw.ERROR_REPORTING = before


def has_display() -> bool:
    """Return whether a window should open: always on macOS and Windows, elsewhere with X11 or Wayland."""
    return sys.platform in _WINDOWED or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def require_window(instead: str = "use render_mode 'rgb_array'") -> None:
    """Check that a window can be opened; MuJoCo's viewer would end the process if not.

    Args:
        instead: the alternative to a window, for the error.

    Raises:
        RenderingUnavailable: no window opens.
    """
    import glfw

    try:
        with _strict_glfw():
            glfw.init()
    except glfw.GLFWError as error:
        raise RenderingUnavailable(f"cannot open a window: {error}; {instead}") from None


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def call(function):
    """Call a function, which may use `contexts`, in OpenGL's thread.

    Args:
        function: takes nothing. One at a time is called.

    Returns:
        What it returns.

    Raises:
        RenderingUnavailable: no OpenGL here. Errors of the function pass through.
    """
    global _renderer
    with _lock:
        if _renderer is None:
            with _errors():
                _renderer = _Renderer()
        renderer = _renderer
    return renderer.call(function)


def contexts(model):
    """Return the contexts with which dm_control draws a model; only within a function given to `call`.

    Args:
        model: dm_control's `MjModel`; its `vis.global_` says how large pictures can be.

    Returns:
        dm_control's `Contexts`, good until the function returns.

    Raises:
        RenderingUnavailable: no OpenGL here.
    """
    with _errors():
        return _renderer.contexts(model)


def driver() -> str:
    """Return the names of OpenGL's renderer and version, after the first picture."""

    def ask():
        from OpenGL import GL

        return " / ".join(GL.glGetString(name).decode() for name in (GL.GL_RENDERER, GL.GL_VERSION))

    return call(ask)


class _Renderer:
    """One OpenGL context, its thread, and a MuJoCo context for each recently drawn body."""

    def __init__(self):
        backend = _backend()
        self._open = backend.Renderer
        self._gl = None
        self._closed = False
        self._drawings = {}  # dm_control's model -> MuJoCo's context for it; the latest used comes last
        self._forks = forks.count
        forks.keep(self)
        self._busy = threading.RLock()
        self._calls = queue.SimpleQueue()
        self._thread = None
        if backend.BACKEND != "glfw":  # GLFW insists on the main thread, from which pictures are wanted as a rule
            self._thread = threading.Thread(target=self._serve, name="arc_suite.simulation.opengl", daemon=True)
            self._thread.start()

    def call(self, function):
        """See the function of that name."""
        if self._forks != forks.count:
            raise RenderingUnavailable(
                "cannot render: OpenGL was opened before this process was forked; "
                "make no picture before the fork, or start processes with multiprocessing's spawn"
            )
        if self._closed:
            raise RenderingUnavailable("cannot render: the interpreter is ending, and has closed OpenGL")
        if self._thread in (None, threading.current_thread()):
            with self._busy:
                return function()
        future = concurrent.futures.Future()
        self._calls.put((future, function))
        return future.result()

    def _serve(self):
        while True:
            future, function = self._calls.get()
            try:
                future.set_result(function())
            except BaseException as error:
                future.set_exception(error)
            if function == self._free:
                return
            del future, function  # and the picture, while there is nothing to do

    def contexts(self, model):
        """See the function of that name."""
        import mujoco
        from dm_control.mujoco import engine, wrapper

        width = model.vis.global_.offwidth
        height = model.vis.global_.offheight
        if self._gl is None:
            self._gl = self._open(width, height)
            self._gl.increment_refcount()  # dm_control frees it with the last MuJoCo context
            atexit.register(self.close)  # after dm_control has registered its own handlers: before them
        drawing = self._drawings.pop(model, None) or wrapper.MjrContext(model, self._gl)
        self._drawings[model] = drawing
        if len(self._drawings) > _MAX_DRAWINGS:
            self._drawings.pop(next(iter(self._drawings))).free()
        if drawing.ptr.offWidth < width or drawing.ptr.offHeight < height:
            mujoco.mjr_resizeOffscreen(width, height, drawing.ptr)
        return engine.Contexts(gl=self._gl, mujoco=drawing)

    def close(self):
        """Free the contexts in their thread before the interpreter ends."""
        gl = self._gl
        if self._forks == forks.count:
            with contextlib.suppress(Exception):  # another library may have closed the display already
                self.call(self._free)
            self._closed = True
        else:  # to free the parent's context would hang
            egl = sys.modules.get(f"{_BACKEND}.pyopengl.egl_renderer")
            if egl is not None:
                atexit.unregister(egl.EGL.eglTerminate)
        gl._render_executor._terminated = True  # dm_control's own handler has nothing left to do

    def _free(self):
        gl, self._gl = self._gl, None
        while self._drawings:
            self._drawings.popitem()[1].free()
        gl.decrement_refcount()
        gl.free()


def _backend():
    """Return dm_control's backend, opened."""
    module = sys.modules[_BACKEND]
    # Imported before us and without a display, dm_control has settled for a GLFW that cannot open.
    if module.BACKEND == "glfw" and not _wants_glfw():
        _reload(module)
    return module


def _reload(module) -> None:
    # GLFW is slow to import; leave it alone where nobody will try it.
    with _environment(), _strict_glfw() if _wants_glfw() else contextlib.nullcontext():
        importlib.reload(module)


def _wants_glfw() -> bool:
    return os.environ.get("MUJOCO_GL") not in ("egl", "osmesa", *_OFF)


@contextlib.contextmanager
def _errors():
    """Turn errors from opening OpenGL into `RenderingUnavailable`.

    Raises:
        RenderingUnavailable: why there is no picture, and the remedy.
    """
    try:
        yield
    except Exception as error:
        raise RenderingUnavailable(_explain(error)) from None


def _explain(error: Exception) -> str:
    setting = os.environ.get("MUJOCO_GL")
    if setting in _OFF:
        return f"cannot render: MUJOCO_GL={setting} turns it off; unset it, or set MUJOCO_GL=egl"
    cause = error.__cause__ or error
    if (isinstance(cause, ValueError) or _DEVICE in str(cause)) and (wrong := _wrong_device()):
        return f"cannot render: {wrong}"
    missing = isinstance(error, AttributeError)  # PyOpenGL's way to say that a library is not there
    reason = "the OpenGL library is missing" if missing else checks.quote(cause).rstrip(".")
    backend = f" with MUJOCO_GL={setting}" if setting else ""
    remedy = _remedy(cause)
    return f"cannot render{backend}: {reason}" + (f"; {remedy}" if remedy else "")


def _wrong_device() -> str | None:
    """Return what is wrong with `MUJOCO_EGL_DEVICE_ID`; None if nothing is, or if EGL has not listed its devices."""
    device = os.environ.get(_DEVICE)
    egl = sys.modules.get(f"{_BACKEND}.pyopengl.egl_ext")
    if device is None or egl is None:
        return None
    last = len(egl.eglQueryDevicesEXT()) - 1
    index = checks.digits(device.strip())
    if last < 0 or (index is not None and index <= last):
        return None
    if not device.strip():
        return f"{_DEVICE} is set, but empty; unset it to take any device"
    expected = f"an integer from 0 to {last}" if last else "0, as there is one device"
    return f"{_DEVICE}: expected {expected}, got {checks.quote(device)!r}; unset it to take any device"


def _remedy(cause: BaseException) -> str | None:
    """Return the remedy for the cause of an error; None for one that has nothing to do with the choice of OpenGL."""
    for variable, remedy in _REMEDIES_BY_VARIABLE.items():
        if variable in str(cause):
            return remedy
    if _lacks_resources(cause):
        return None
    return "unset MUJOCO_GL: pictures are drawn by GLFW here" if sys.platform in _WINDOWED else _REMEDY


def _lacks_resources(cause: BaseException) -> bool:
    """Return whether the machine has no memory, file or thread left."""
    is_system_call = isinstance(cause, OSError) and cause.errno is not None  # a library that is missing has no number
    return isinstance(cause, MemoryError) or is_system_call or "new thread" in str(cause)


# A fork waits for a renderer that is being made, so that the child finds none or a whole one.
forks.at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release)
