"""References of a robot's file to parts of a scene that is not in it, such as contact pairs with its floor."""

from collections.abc import Iterator

import mujoco

# What may name parts of the scene, with the attributes that name them and the kind of these parts.
_REFERENCES = (
    ("pairs", ("geomname1", "geomname2"), "geoms"),
    ("excludes", ("bodyname1", "bodyname2"), "bodies"),
    ("cameras", ("targetbody",), "bodies"),
    ("lights", ("targetbody",), "bodies"),
)
# The same for what names the type of a part: pairs of attributes for type and name.
_TYPED_REFERENCES = (
    ("sensors", (("objtype", "objname"), ("reftype", "refname"))),
    ("equalities", (("objtype", "name1"), ("objtype", "name2"))),
)
_KINDS = {
    mujoco.mjtObj.mjOBJ_BODY: "bodies",
    mujoco.mjtObj.mjOBJ_XBODY: "bodies",
    mujoco.mjtObj.mjOBJ_GEOM: "geoms",
    mujoco.mjtObj.mjOBJ_SITE: "sites",
}


def delete_references(spec: mujoco.MjSpec) -> tuple[str, ...]:
    """Delete what refers to parts that are not in a spec, and return a note if anything does."""
    missing_names = []
    for element, names in list(_list_references(spec)):
        missing = [name for kind, name in names if name and name not in _names_of(spec, kind)]
        if missing:
            spec.delete(element)
            missing_names.append(missing[0])
    if not missing_names:
        return ()
    return (f"left out: {len(missing_names)} references to parts that are not in the file, such as {missing_names[0]}",)


def _list_references(spec: mujoco.MjSpec) -> Iterator[tuple[object, list[tuple[str, str]]]]:
    """Yield elements that name parts, each with the kinds and names of these parts."""
    for collection, attributes, kind in _REFERENCES:
        for element in getattr(spec, collection):
            yield element, [(kind, getattr(element, attribute)) for attribute in attributes]
    for collection, attributes in _TYPED_REFERENCES:
        for element in getattr(spec, collection):
            names = [(_KINDS.get(getattr(element, type_)), getattr(element, name)) for type_, name in attributes]
            yield element, [(kind, name) for kind, name in names if kind is not None]


def _names_of(spec: mujoco.MjSpec, kind: str) -> set[str]:
    return {part.name for part in getattr(spec, kind)}
