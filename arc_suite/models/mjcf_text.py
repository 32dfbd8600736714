"""The text of a model, as MuJoCo and dm_control's PyMJCF read it."""

import numpy as np
from dm_control import mjcf
from lxml import etree


def to_mjcf(root: mjcf.RootElement) -> str:
    """Return a model of `assemble` as MJCF, with the standing pose as the keyframe `home`.

    PyMJCF calls the global defaults "/" when it writes, and refuses that name when it reads. MuJoCo needs no name.

    Args:
        root: the model. Without a free joint the text has no keyframe, since PyMJCF's `attach` would shift its numbers.

    Returns:
        The text. It compiles to the same model as `root`, except the keyframe.
    """
    text = root.to_xml()
    for whole in text.findall("default"):
        (own,) = whole
        text.replace(whole, own) if len(own) else text.remove(whole)
    for element in text.iterfind(".//*[@class='/']"):
        del element.attrib["class"]
    if root.find("joint", "root") and not root.find("key", "home"):
        angles = [0.0 for joint in root.find_all("joint") if joint.tag == "joint"]
        qpos = (*root.find("body", "torso").pos, 1.0, 0.0, 0.0, 0.0, *angles)
        home = etree.SubElement(etree.SubElement(text, "keyframe"), "key", name="home")
        home.set("qpos", exact(qpos))
    return etree.tostring(text, encoding="unicode", pretty_print=True)


def exact(values) -> str:
    """Return numbers as text that is read back as the same bits."""
    return " ".join(str(number) if isinstance(number, int) else repr(number) for number in np.ravel(values).tolist())
