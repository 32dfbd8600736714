"""Animation: clips for engines, pages to play in, the studio, the search for creatures; the core does not import it."""

__all__ = ["show"]  # noqa: F822  # made by __getattr__


def __getattr__(name):
    if name == "show":  # only notebooks need what it imports
        from arc_suite.animation.notebook import show

        return show
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
