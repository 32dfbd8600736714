"""MuJoCo runs: the model they step, one of them, a batch, pictures."""


def __getattr__(name):
    if name == "compiled":  # imported when asked for: OpenGL is chosen before anything imports dm_control
        from arc_suite.simulation.model import compiled

        return compiled
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
