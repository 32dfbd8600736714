"""Notes on links and bodies to which a file gives no mass, a line each."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence

import mujoco
import numpy as np

from arc_suite import checks


def describe_links(links: Mapping[str, ElementTree.Element]) -> Iterator[str]:
    """Yield notes on links of a URDF without a mass, in a file where other links have one.

    Args:
        links: by name; those without a mass have no `inertial`.
    """
    massless = [name for name, link in links.items() if link.find("inertial") is None]
    solid = [name for name in massless if links[name].find("collision") is not None]
    empty = [name for name in massless if name not in solid]
    if solid:
        text = f"masses: {len(solid)} links with colliders have none in the file, and get 1000 kg/m^3"
        yield f"{text} ({checks.join_first(solid)})"
    if empty:
        text = f"masses: {len(empty)} links have no mass and no collider in the file, and weigh nothing here"
        yield f"{text} ({checks.join_first(empty)})"


def describe_bodies(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int) -> Sequence[str]:
    """Return notes on bodies of an MJCF file without an `inertial`, which weigh what their shapes do.

    Args:
        spec: spec of the file.
        model: compiled from it.
        torso: body of the torso.
    """
    bodies = np.flatnonzero(model.body_rootid == torso).tolist()
    inferred = [body for body in bodies if not spec.bodies[body].explicitinertial and model.body_mass[body] > 0.0]
    if not inferred:
        return ()
    return (
        f"masses: {len(inferred)} of {len(bodies)} bodies have no inertial in the file: they have the mass or density "
        "of their shapes",
    )
