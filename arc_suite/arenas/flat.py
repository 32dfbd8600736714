"""What a body walks on. An arena writes its geoms into a model that holds the body."""

from dm_control import mjcf

from arc_suite.models import builder
from arc_suite.robots.spec import Simulation


def add_floor(root: mjcf.RootElement, simulation: Simulation) -> None:
    """Adds `floor`, an endless flat plane at height 0."""
    root.worldbody.add(
        "geom", name="floor", type="plane", size=(0.0, 0.0, 1.0), conaffinity=1, **builder.contact(simulation)
    )
