"""What a body looks like: decorations that weigh nothing and touch nothing."""

from dm_control import mjcf

from arc_suite.spec import Body


def decorate(root: mjcf.RootElement, body: Body) -> None:
    """Adds materials, lights and massless, contactless geoms to a built body on its floor."""
    root.worldbody.add("light", name="sun", pos=(0, 0, 5), dir=(0, 0, -1), directional=True)
