"""The text of a model, as MuJoCo and dm_control's PyMJCF read it."""

import numpy as np
from dm_control import mjcf
from lxml import etree

from arc_suite import rotations


def to_mjcf(root: mjcf.RootElement) -> str:
    """Return a model of `assemble` as MJCF, with the standing pose as the keyframe `home`.

    PyMJCF calls the global defaults "/" when it writes, and refuses that name when it reads. MuJoCo needs no name.

    Args:
        root: the model. Without a free joint the text has no keyframe, since PyMJCF's `attach` would shift its numbers.

    Returns:
        The text. It compiles to the same model as `root`, except for the keyframe.
    """
    tree = root.to_xml()
    for defaults in tree.findall("default"):
        (global_defaults,) = defaults  # the class "/"
        if len(global_defaults):
            tree.replace(defaults, global_defaults)
        else:
            tree.remove(defaults)
    for element in tree.iterfind(".//*[@class='/']"):
        del element.attrib["class"]
    if root.find("joint", "root") and not root.find("key", "home"):
        hinges = [joint for joint in root.find_all("joint") if joint.tag == "joint"]
        torso_pose = (*root.find("body", "torso").pos, *rotations.NO_TURN)
        keyframe = etree.SubElement(tree, "keyframe")
        home = etree.SubElement(keyframe, "key", name="home")
        home.set("qpos", exact((*torso_pose, *(0.0 for _ in hinges))))
    return etree.tostring(tree, encoding="unicode", pretty_print=True)


def exact(values) -> str:
    """Return numbers as text that is read back as the same bits."""
    return " ".join(repr(number) for number in np.ravel(values).tolist())
