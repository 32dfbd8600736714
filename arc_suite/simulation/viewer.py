"""Check of dm_control's viewer: one error with a remedy where no window opens, in place of warnings and many errors."""

import functools
import importlib.abc
import importlib.machinery
import sys
from types import ModuleType

from arc_suite.simulation import opengl

_VIEWER = "dm_control.viewer"
_INSTEAD = "arc-suite render --robot ROBOT -o walk.mp4 films a walk"


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads the viewer with a check in front of its `launch`."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        _add_check(module)


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the viewer for `_Loader`, as it is imported later than this suite, or never."""

    def find_spec(self, fullname: str, path=None, target=None) -> importlib.machinery.ModuleSpec | None:
        if fullname != _VIEWER:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(fullname, spec.origin)
        return spec


def check_windows() -> None:
    """Let `dm_control.viewer.launch` raise RenderingUnavailable where no window opens."""
    if _VIEWER in sys.modules:
        _add_check(sys.modules[_VIEWER])
    else:
        sys.meta_path.insert(0, _Finder())


def _add_check(viewer: ModuleType) -> None:
    launch = viewer.launch

    @functools.wraps(launch)
    def launch_in_window(*args, **kwargs):
        opengl.require_window(_INSTEAD)
        return launch(*args, **kwargs)

    viewer.launch = launch_in_window  # type: ignore[attr-defined]  # of a module
