"""Imported bodies with links of other lengths: their source, in which a link stretches with all that it carries."""

import functools
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.models.mjcf_text import exact
from arc_suite.robots import sources
from arc_suite.robots.spec import Body

_MIN_LENGTH = 1e-3  # standing heights; a joint that is nearer to the next one ends a link without a length
_SAME_PLACE = 1e-9  # m
_MIN_INERTIA = 1e-12  # share of the largest principal inertia


class _Stretch(NamedTuple):
    """What a link does to the points that it carries, in the world's axes, in the standing pose.

    Attributes:
        turn: (3, 3) rotation.
        stretch: (3, 3) symmetric, before the rotation.
    """

    turn: np.ndarray
    stretch: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """Return both as a matrix (3, 3)."""
        return self.turn @ self.stretch

    def inside(self, axes: np.ndarray) -> "_Stretch":
        """Return the same in a frame with these axes (3, 3), as columns."""
        return _Stretch(axes.T @ self.turn @ axes, axes.T @ self.stretch @ axes)


_UNCHANGED = _Stretch(np.eye(3), np.eye(3))


def adjustable_links(body: Body) -> tuple[str, ...]:
    """Return the names of the parts of an imported body that are links with a length of their own.

    A link ends at the next joint of its leg. One that ends at its own joint has none, nor have links between which a
    loop closes.
    """
    return tuple(_legs_of(body).lengths)


def change_link_ends(body: Body, ends: Mapping[str, Sequence[float]]) -> Body:
    """Return an imported body whose links have other ends; its lowest foot stands on the floor.

    A link turns to its new end and stretches along it, with all that it carries up to the next joint: colliders, visual
    meshes and mass of the same density. Motors and the axes of joints stay. Without new ends, this is the body itself.

    Args:
        body: with a source.
        ends: ends (3,) of links by name of the part, m, as those of the spec: in the torso's frame as it stands.

    Raises:
        ValueError: a link has no length of its own.
        SpecError: a number is out of range.
    """
    legs = _legs_of(body)
    stretches = {}
    new_legs = []
    for leg in body.legs:
        links = []
        for link in leg.links:
            part = leg.full_name(link)
            end = tuple(map(float, ends.get(part, link.end)))
            if end != link.end:
                if part not in legs.lengths:
                    names = ", ".join(legs.lengths) or "none"
                    raise ValueError(f"links: {part} of {body.name} has no length of its own (those with one: {names})")
                stretches[part] = _stretch_between(np.array(link.end), np.array(end))
            links.append(link.replace(end=end))
        new_legs.append(leg.replace(links=tuple(links)))
    if not stretches:
        return body
    drop = max(leg.foot_depth for leg in new_legs) - max(leg.foot_depth for leg in body.legs)  # m, of the lowest foot
    torso = body.torso.replace(standing_height=body.torso.standing_height + drop)
    new_source = _stretch_source(legs, stretches, drop)
    return sources.check(body.replace(torso=torso, legs=tuple(new_legs), source=new_source))


def _stretch_between(end: np.ndarray, new_end: np.ndarray) -> _Stretch:
    """Return the shortest turn from an end (3,) of a link to a new one, and the stretch along the link before it."""
    length = np.linalg.norm(end)
    new_length = np.linalg.norm(new_end)
    if not new_length:
        raise ValueError("ends: expected an end away from the joint, got 0 0 0")
    axis = end / length
    stretch = np.eye(3) + (new_length / length - 1.0) * np.outer(axis, axis)
    return _Stretch(_turn_between(axis, new_end / new_length), stretch)


def _turn_between(start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Return the shortest rotation (3, 3) between two directions (3,): two reflections (Householder)."""
    half_way = start + goal
    if np.linalg.norm(half_way) < 1e-9:  # opposite ones: half a turn about any axis across
        across = np.cross(start, np.eye(3)[abs(start).argmin()])
        return 2.0 * np.outer(across, across) / (across @ across) - np.eye(3)
    half_way /= np.linalg.norm(half_way)
    return (2.0 * np.outer(half_way, half_way) - np.eye(3)) @ (2.0 * np.outer(start, start) - np.eye(3))


class _Legs:
    """The links of an imported body in its model, in the standing pose.

    Attributes:
        body: the body.
        model: of its source, with visual meshes.
        data: in the standing pose.
        link_of_body: name of the part to which a body of the model belongs, by index; those of the torso are missing.
        joint_of_link: index of the joint of a part, by name.
        lengths: lengths of links that have one of their own, m, by name of the part.
    """

    def __init__(self, body: Body):
        self.body = body
        self.model = mujoco.MjModel.from_xml_string(body.source)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        mujoco.mj_kinematics(self.model, self.data)
        self.joint_of_link = {}
        for leg in body.legs:
            for link in leg.links:
                self.joint_of_link[leg.full_name(link)] = self.model.joint(leg.full_name(link.joint)).id
        body_of_link = {part: int(self.model.jnt_bodyid[joint]) for part, joint in self.joint_of_link.items()}
        last_link = {index: part for part, index in body_of_link.items()}  # of bodies with several joints of a leg
        self.link_of_body: dict[int, str] = {}
        for index in range(1, self.model.nbody):
            part = last_link.get(index, self.link_of_body.get(int(self.model.body_parentid[index])))
            if part is not None:
                self.link_of_body[index] = part
        self.lengths = self._measure_lengths(last_link, body_of_link)

    def _measure_lengths(self, last_link: Mapping[int, str], body_of_link: Mapping[str, int]) -> dict[str, float]:
        min_length = _MIN_LENGTH * self.body.torso.standing_height
        links_in_loops = self._find_links_in_loops()
        lengths = {}
        for leg in self.body.legs:
            parts = leg.part_names[:-1]
            points = [self.data.xanchor[self.joint_of_link[part]] for part in parts]
            points.append(self.data.site(leg.part_names[-1]).xpos)
            for index, part in enumerate(parts):
                length = float(np.linalg.norm(points[index + 1] - points[index]))
                joints_of_body = [joint_part for joint_part in parts if body_of_link[joint_part] == body_of_link[part]]
                anchors = [self.data.xanchor[self.joint_of_link[joint_part]] for joint_part in joints_of_body]
                have_one_anchor = np.ptp(anchors, axis=0).max() < _SAME_PLACE
                is_last = last_link[body_of_link[part]] == part
                if is_last and have_one_anchor and length > min_length and part not in links_in_loops:
                    lengths[part] = length
        return lengths

    def _find_links_in_loops(self) -> set[str | None]:
        """Return the links between which loops close; a loop within one link stretches with it."""
        model = self.model
        links_in_loops: set[str | None] = set()
        for equality in range(model.neq):
            if model.eq_objtype[equality] != mujoco.mjtObj.mjOBJ_SITE:
                continue
            sites = (model.eq_obj1id[equality], model.eq_obj2id[equality])
            first_line, second_line = (self._line_of_parents(int(model.site_bodyid[site])) for site in sites)
            shared = [index for index in first_line if index in second_line]  # the nearest first
            path = set(first_line) ^ set(second_line) | set(shared[:1])
            links = {self.link_of_body.get(index) for index in path}
            if len(links) > 1:
                links_in_loops |= links
        return links_in_loops

    def _line_of_parents(self, index: int) -> list[int]:
        """Return a body and the bodies that carry it, the world last."""
        line = [index]
        while line[-1]:
            line.append(int(self.model.body_parentid[line[-1]]))
        return line

    def axes(self, index: int) -> np.ndarray:
        """Return the axes (3, 3) of a body of the model, as columns."""
        return self.data.xmat[index].reshape(3, 3)


@functools.lru_cache(maxsize=8)
def _legs_of(body: Body) -> _Legs:
    return _Legs(body)


def _stretch_source(legs: _Legs, stretches: Mapping[str, _Stretch], drop: float) -> str:
    """Return the MJCF of a body's source with stretched links.

    Args:
        legs: of the body.
        stretches: by name of the part.
        drop: m, by which the torso rises over the floor.
    """
    root = ElementTree.fromstring(legs.body.source)
    elements = list(root.find("worldbody").iter("body"))  # in the order of the model, whose first body is the world
    asset = root.find("asset")
    local_stretches = [_UNCHANGED]
    for index, element in enumerate(elements, start=1):
        stretch = _UNCHANGED
        link = legs.link_of_body.get(index)
        if link in stretches:
            stretch = stretches[link].inside(legs.axes(index))
            _stretch_inertia(legs.model, index, element, stretch)
            _stretch_geoms(legs.model, index, element, stretch, asset)
            for site in element.findall("site"):
                _map_position(site, stretch)
        local_stretches.append(stretch)
        parent_stretch = local_stretches[legs.model.body_parentid[index]]
        if parent_stretch is not _UNCHANGED or stretch is not _UNCHANGED:
            _move_body(legs.model, index, element, parent_stretch, stretch)
    _remove_unused_meshes(root)
    position = np.array(elements[0].get("pos", "0 0 0").split(), float) + (0.0, 0.0, drop)
    elements[0].set("pos", exact(position))
    (key,) = root.iter("key")
    qpos = np.array(key.get("qpos").split(), float)
    qpos[2] += drop
    key.set("qpos", exact(qpos))
    return ElementTree.tostring(root, encoding="unicode")


def _move_body(
    model: mujoco.MjModel, index: int, element: ElementTree.Element, parent_stretch: _Stretch, stretch: _Stretch
) -> None:
    """Move a body so that the anchor of its first joint goes with its parent; its joints have one anchor."""
    anchor = np.zeros(3)
    if model.body_jntnum[index]:
        anchor = model.jnt_pos[model.body_jntadr[index]]
    axes = rotations.matrix(model.body_quat[index])
    anchor_in_parent = model.body_pos[index] + axes @ anchor
    new_position = parent_stretch.matrix @ anchor_in_parent - axes @ stretch.matrix @ anchor
    element.set("pos", exact(new_position))
    for joint in element.findall("joint"):
        _map_position(joint, stretch)


def _map_position(element: ElementTree.Element, stretch: _Stretch) -> None:
    """Move an element, if it is away from the origin of its body."""
    if "pos" in element.attrib:
        element.set("pos", exact(stretch.matrix @ np.array(element.get("pos").split(), float)))


def _stretch_inertia(model: mujoco.MjModel, index: int, element: ElementTree.Element, stretch: _Stretch) -> None:
    """Stretch the mass of a body at the same density.

    With the second moments S of its mass, the inertia is tr(S) 1 - S. Stretched by M, they are det(M) M S M^T.
    """
    inertial = element.find("inertial")
    if inertial is None:
        return
    matrix = stretch.matrix
    volume_factor = np.linalg.det(matrix)
    axes = rotations.matrix(model.body_iquat[index])
    inertia = axes @ np.diag(model.body_inertia[index]) @ axes.T
    moments = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    new_moments = volume_factor * matrix @ moments @ matrix.T
    principal, new_axes = np.linalg.eigh(np.trace(new_moments) * np.eye(3) - new_moments)
    new_axes[:, 2] *= np.sign(np.linalg.det(new_axes))
    inertial.set("mass", exact(volume_factor * model.body_mass[index]))
    inertial.set("diaginertia", exact(principal.clip(_MIN_INERTIA * principal.max())))
    inertial.set("quat", exact(rotations.from_matrix(new_axes)))
    inertial.set("pos", exact(matrix @ model.body_ipos[index]))


def _stretch_geoms(
    model: mujoco.MjModel,
    index: int,
    element: ElementTree.Element,
    stretch: _Stretch,
    asset: ElementTree.Element | None,
) -> None:
    """Stretch the geoms of a body. Spheres keep their radius, as do capsules and cylinders."""
    for geom, geom_element in enumerate(element.findall("geom"), start=int(model.body_geomadr[index])):
        shape = geom_element.get("type", "sphere")
        position = model.geom_pos[geom]
        axes = rotations.matrix(model.geom_quat[geom])
        if shape == "mesh":
            _stretch_mesh(model, geom, geom_element, stretch.matrix, asset)
            continue
        geom_element.set("pos", exact(stretch.matrix @ position))
        size = model.geom_size[geom].copy()
        turn = stretch.turn
        if shape in ("capsule", "cylinder"):
            new_axis = stretch.matrix @ axes[:, 2]
            size[1] *= np.linalg.norm(new_axis)
            turn = _turn_between(axes[:, 2], new_axis / np.linalg.norm(new_axis))
            size = size[:2]
        elif shape in ("box", "ellipsoid"):
            size *= np.linalg.norm(stretch.stretch @ axes, axis=0)
        else:
            continue
        geom_element.set("size", exact(size))
        geom_element.set("quat", exact(rotations.from_matrix(turn @ axes)))


def _stretch_mesh(
    model: mujoco.MjModel,
    geom: int,
    element: ElementTree.Element,
    matrix: np.ndarray,
    asset: ElementTree.Element | None,
) -> None:
    """Give a geom a mesh of its own, stretched by a matrix (3, 3), in the frame of its body."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(float)
    points = model.geom_pos[geom] + vertices @ rotations.matrix(model.geom_quat[geom]).T
    (old_mesh,) = (mesh_element for mesh_element in asset if mesh_element.get("name") == element.get("mesh"))
    attributes = {name: text for name, text in old_mesh.attrib.items() if name not in ("scale", "refpos", "refquat")}
    first_face = int(model.mesh_faceadr[mesh])
    faces = model.mesh_face[first_face : first_face + int(model.mesh_facenum[mesh])]
    name = f"{element.get('mesh')}_{geom}"
    new_points = (points @ matrix.T).astype(np.float32)
    vertex_text = " ".join(f"{number:.7g}" for number in new_points.ravel().tolist())
    face_text = " ".join(map(str, faces.ravel().tolist()))
    attributes |= {"name": name, "vertex": vertex_text, "face": face_text}
    ElementTree.SubElement(asset, "mesh", attributes)
    element.set("mesh", name)
    for attribute in ("pos", "quat"):
        element.attrib.pop(attribute, None)


def _remove_unused_meshes(root: ElementTree.Element) -> None:
    """Remove the meshes that no geom has any more."""
    asset = root.find("asset")
    if asset is None:
        return
    used_names = {geom.get("mesh") for geom in root.iter("geom")}
    for mesh in list(asset):
        if mesh.get("name") not in used_names:
            asset.remove(mesh)
