"""Animation: clips for engines, pages to play in, the studio, the search for creatures; the core does not import it."""

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from arc_suite.animation.clips import animate
    from arc_suite.animation.notebook import show

_MODULE_OF_NAME = {"animate": "arc_suite.animation.clips", "show": "arc_suite.animation.notebook"}

__all__ = ["animate", "show"]

if not TYPE_CHECKING:  # for checkers every name would exist

    def __getattr__(name: str) -> Any:
        if name in _MODULE_OF_NAME:  # imported here, as programs do not need all that these import
            return getattr(importlib.import_module(_MODULE_OF_NAME[name]), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
