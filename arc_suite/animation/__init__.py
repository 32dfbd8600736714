"""Animation: clips for engines, pages to play in, the studio, the search for creatures; the core does not import it."""

import importlib

_MODULE_OF_NAME = {"animate": "arc_suite.animation.clips", "show": "arc_suite.animation.notebook"}

__all__ = ["animate", "show"]  # noqa: F822  # made by __getattr__


def __getattr__(name):
    if name in _MODULE_OF_NAME:  # imported here, as programs do not need all that these import
        return getattr(importlib.import_module(_MODULE_OF_NAME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
