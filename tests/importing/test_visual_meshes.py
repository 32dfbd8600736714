"""Visual meshes, shapes and colors stay with an imported body: pictures show them, and no dynamics change."""

import importlib.util
import pathlib
import re
import struct
import sys
import xml.etree.ElementTree as ElementTree

import gltf_reader
import mujoco
import numpy as np
import pytest

from arc_suite import models, registry
from arc_suite.animation import clips, parts
from arc_suite.importing import import_robot
from arc_suite.robots import sources
from arc_suite.robots.spec_files import body_from_json, body_to_json

TESTS = pathlib.Path(__file__).parents[1]
FOLDER = TESTS / "fixtures" / "robots"
GO2, A1 = FOLDER / "go2_like.xml", FOLDER / "a1_like.urdf"
WEDGE = np.array([(-0.15, -0.1, 0.0), (0.15, -0.1, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.2)])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
TRUNK_VISUAL = (
    '<visual><origin xyz="0 0 0"/><geometry><mesh filename="package://quadruped_description/meshes/trunk.dae"/>'
)
LOST_COLOR = "colors or textures of 1 shapes are left out"
COLLIDERS = "looks: pictures show the colliders, in colors of the suite"


def write_stl(path, points, faces):
    rows = [struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel(), 0) for face in faces]
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(rows))


def write_urdf(folder, points=WEDGE, faces=FACES, origin="0.1 0 0", more=""):
    """Write a robot with a visual mesh on its trunk, and return its path."""
    write_stl(folder / "trunk.stl", points, faces)
    text = A1.read_text()
    assert TRUNK_VISUAL in text
    visual = f'<visual><origin xyz="{origin}"/><geometry><mesh filename="trunk.stl"/>'
    path = folder / "robot.urdf"
    path.write_text(text.replace(TRUNK_VISUAL, visual).replace("</robot>", f"{more}</robot>"))
    return path


def write_mjcf(folder):
    """Write a robot with a visual mesh on a calf, and return its path."""
    write_stl(folder / "calf.stl", WEDGE, FACES)
    calf = '<body name="FL_calf" pos="0 0 -0.213">'
    text = GO2.read_text().replace(calf, f'{calf}<geom class="looks" type="mesh" mesh="calf" pos="0 0 -0.1"/>')
    path = folder / "robot.xml"
    path.write_text(text.replace("<asset>", '<asset><mesh name="calf" file="calf.stl" scale="0.2 0.2 0.5"/>'))
    return path


def visual_points(body, part):
    """Return the points of a body's visual meshes on a part, in its frame."""
    model = mujoco.MjModel.from_xml_string(body.source)
    (geom,) = [
        geom
        for geom in range(model.ngeom)
        if model.geom_group[geom] == 2 and model.geom_bodyid[geom] == model.body(part).id
    ]
    mesh = model.geom_dataid[geom]
    points = model.mesh_vert[model.mesh_vertadr[mesh] : model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh]]
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    return points @ rotation.reshape(3, 3).T + model.geom_pos[geom]


def in_order(points):
    return np.array(sorted(np.round(points, 4).tolist()))


def same_bits(path, body):
    spec = importlib.util.spec_from_file_location("reference", TESTS / "robots_of_others" / "reference.py")
    module = sys.modules.setdefault("reference", importlib.util.module_from_spec(spec))
    spec.loader.exec_module(module)
    return module.same_bits(path, body)


def test_a_mesh_of_a_urdf_stays_in_its_place(tmp_path):
    path = write_urdf(tmp_path)
    body, notes = import_robot(path)
    assert "looks: 1 visual meshes, for pictures, clips and pages" in notes
    assert in_order(visual_points(body, "torso")) == pytest.approx(in_order(WEDGE + (0.1, 0.0, 0.0)), abs=1e-3)
    assert same_bits(path, body) == 200
    assert body_from_json(body_to_json(body)) == body


def test_a_mesh_of_an_mjcf_file_stays_in_its_place(tmp_path):
    body, notes = import_robot(write_mjcf(tmp_path))
    line = "looks: 1 visual meshes and 1 visual shapes, 1 with the file's color, for pictures, clips and pages"
    assert line in notes  # the shape is an ellipsoid
    points = WEDGE * (0.2, 0.2, 0.5) - (0.0, 0.0, 0.1)
    assert in_order(visual_points(body, "l1_link3")) == pytest.approx(in_order(points), abs=1e-3)


def unit_notes(notes):
    return [note for note in notes if note.startswith("repaired: ")]


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "mm"), (100.0, "cm")])
def test_a_mesh_in_another_unit_is_repaired_with_a_note(factor, unit, tmp_path):
    path = write_urdf(tmp_path, factor * WEDGE)
    body, notes = import_robot(path)
    (note,) = unit_notes(notes)
    assert note == f"repaired: 1 visual meshes are in {unit}, as {0.2062 * factor:.3g} m is far beyond the joints"
    assert in_order(visual_points(body, "torso")) == pytest.approx(in_order(WEDGE + (0.1, 0.0, 0.0)), abs=1e-3)
    path.write_text(path.read_text().replace('<box size="0.267 0.194 0.114"/>', '<mesh filename="trunk.stl"/>'))
    body, notes = import_robot(path)
    assert [re.sub(", as .*", "", note) for note in unit_notes(notes)] == [
        f"repaired: 1 meshes are in {unit}",
        f"repaired: 1 visual meshes are in {unit}",
    ]
    assert in_order(visual_points(body, "torso")) == pytest.approx(in_order(WEDGE + (0.1, 0.0, 0.0)), abs=1e-3)


def test_a_mesh_in_the_unit_of_the_joints_stays_beside_one_in_another(tmp_path):
    path = write_mjcf(tmp_path)
    write_stl(tmp_path / "shin.stl", 1000.0 * WEDGE, FACES)
    text = path.read_text().replace("<asset>", '<asset><mesh name="shin" file="shin.stl"/>')
    shin = '<geom name="FR" class="foot"'
    assert shin in text
    path.write_text(text.replace(shin, f'<geom class="looks" type="mesh" mesh="shin"/>{shin}'))
    body, notes = import_robot(path)
    assert unit_notes(notes) == ["repaired: 1 visual meshes are in mm, as 206 m is far beyond the joints"]
    assert in_order(visual_points(body, "r1_link3")) == pytest.approx(in_order(WEDGE), abs=1e-3)
    points = WEDGE * (0.2, 0.2, 0.5) - (0.0, 0.0, 0.1)
    assert in_order(visual_points(body, "l1_link3")) == pytest.approx(in_order(points), abs=1e-3)


@pytest.mark.parametrize("attributes", ['class="looks"', ""], ids=["visual", "collider"])
def test_a_large_mesh_of_a_scene_leaves_the_robots_meshes_alone(attributes, tmp_path):
    path = write_mjcf(tmp_path)
    body = import_robot(path).body
    write_stl(tmp_path / "hill.stl", 1000.0 * WEDGE, FACES)
    text = path.read_text().replace("<asset>", '<asset><mesh name="hill" file="hill.stl"/>')
    path.write_text(text.replace("<worldbody>", f'<worldbody><geom {attributes} type="mesh" mesh="hill"/>'))
    hilly_body, notes = import_robot(path)
    assert unit_notes(notes) == [] and hilly_body.source == body.source


def signed_volume(points, faces):
    return sum(points[a] @ np.cross(points[b], points[c]) / 6.0 for a, b, c in faces)


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, -1, 1), (-1, -1, -1)])
@pytest.mark.parametrize("kind", ["urdf", "mjcf"])
def test_a_mirrored_mesh_shows_its_outside(kind, signs, tmp_path):
    text_of_signs = " ".join(map(str, signs))
    if kind == "urdf":
        path, share = write_urdf(tmp_path, origin="0 0 0"), (1.0, 1.0, 1.0)
        path.write_text(path.read_text().replace("trunk.stl", f'trunk.stl" scale="{text_of_signs}'))
    else:
        path, share = write_mjcf(tmp_path), (0.2, 0.2, 0.5)
        scale = " ".join(str(sign * number) for sign, number in zip(signs, share, strict=True))
        path.write_text(path.read_text().replace("0.2 0.2 0.5", scale).replace(' pos="0 0 -0.1"', ""))
    mesh = ElementTree.fromstring(import_robot(path).body.source).find("asset/mesh")
    points = np.array(mesh.get("vertex").split(), float).reshape(-1, 3)
    faces = np.array(mesh.get("face").split(), int).reshape(-1, 3)
    assert in_order(points) == pytest.approx(in_order(WEDGE * share * signs), abs=1e-3)
    assert signed_volume(WEDGE, FACES) == pytest.approx(0.002)
    assert signed_volume(points, faces) == pytest.approx(0.002 * np.prod(share), rel=0.01)


def test_it_turns_and_grows_with_the_robot(tmp_path):
    turn = '<link name="first"/><joint name="turn" type="fixed"><origin rpy="0 0 1.5707963267948966"/>'
    path = write_urdf(tmp_path, more=f'{turn}<parent link="first"/><child link="base"/></joint>')
    points = visual_points(import_robot(path).body, "torso")
    assert in_order(points) == pytest.approx(in_order(WEDGE + (0.1, 0.0, 0.0)), abs=1e-3)
    points = visual_points(import_robot(path, scale=0.5).body, "torso")
    assert in_order(points) == pytest.approx(in_order(0.5 * (WEDGE + (0.1, 0.0, 0.0))), abs=1e-3)


def test_dynamics_have_no_visual_meshes_and_pictures_have_them_in_place_of_colliders(tmp_path):
    body = import_robot(write_urdf(tmp_path)).body
    bare = models.model_spec(body).compile()
    assert bare.nmesh == 0 and bare.ngeom == models.model_spec(import_robot(A1).body).compile().ngeom
    decorated = models.model_spec(body, decorated=True).compile()
    groups = {decorated.geom(geom).name: decorated.geom_group[geom] for geom in range(decorated.ngeom)}
    assert groups["visual0"] == 0 and groups["torso_geom0"] == 4 and groups["l1_link3_geom0"] == 0
    torso = next(part for part in parts.describe_body(body)[0] if part.name == "torso")
    (shape,) = torso.shapes
    assert (shape.kind, len(shape.hull.points), len(shape.hull.triangles)) == ("hull", 4, 4)


def test_a_large_mesh_gets_fewer_points(tmp_path):
    rows, columns = 120, 160
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, rows), np.linspace(0.0, 2.0 * np.pi, columns), indexing="ij")
    ball = 0.2 * np.stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)), axis=-1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    faces = np.concatenate(
        [
            np.stack((corner, corner + columns, corner + 1), 1),
            np.stack((corner + 1, corner + columns, corner + columns + 1), 1),
        ]
    )
    body, notes = import_robot(write_urdf(tmp_path, ball.reshape(-1, 3), faces.tolist()))
    (note,) = [note for note in notes if note.startswith("looks: 1 visual meshes, with ")]
    points = visual_points(body, "torso")
    assert 2000 < len(points) <= 8000 and len(body.source) < 1_000_000, note
    assert np.linalg.norm(points - (0.1, 0.0, 0.0), axis=1) == pytest.approx(0.2, abs=0.005)


@pytest.mark.parametrize(
    "data", [b"", b"solid nothing", bytes(80) + struct.pack("<I", 5_000_000)], ids=["empty", "text", "lie"]
)
def test_a_mesh_that_cannot_be_read_keeps_no_robot_out(data, tmp_path):
    path = write_urdf(tmp_path)
    (tmp_path / "trunk.stl").write_bytes(data)
    body, notes = import_robot(path)
    assert COLLIDERS in notes and body.source == import_robot(A1).body.source
    (tmp_path / "trunk.stl").unlink()
    assert COLLIDERS in import_robot(path).notes


def test_meshes_of_other_formats_and_missing_ones_are_named(tmp_path):
    line = "looks: {} visual meshes are of a format that is not read ({}.dae): save them as STL or OBJ"
    assert line.format(4, "trunk.dae, hip.dae, thigh.dae, calf") in import_robot(A1).notes
    path = write_urdf(tmp_path)
    notes = import_robot(path).notes
    assert line.format(3, "hip.dae, thigh.dae, calf") in notes and not [note for note in notes if "missing" in note]
    (tmp_path / "trunk.stl").unlink()
    assert "looks: 1 files of visual meshes are missing (trunk.stl)" in import_robot(path).notes


def test_the_file_of_a_mesh_is_followed(tmp_path):
    path = write_urdf(tmp_path)
    body = registry.body_of(path)
    assert registry.body_of(path) is body
    write_stl(tmp_path / "trunk.stl", 2.0 * WEDGE, FACES)
    assert registry.body_of(path) != body


def write_obj(folder):
    lines = ["mtllib looks.mtl", *(f"v {x} {y} {z}" for x, y, z in WEDGE)]
    for number, face in enumerate(FACES):
        lines += ["usemtl dark" if number else "usemtl light", "f " + " ".join(str(index + 1) for index in face)]
    (folder / "trunk.obj").write_text("\n".join(lines))
    (folder / "looks.mtl").write_text("newmtl light\nKd 1 1 1\nnewmtl dark\nNs 9\nKd 0.1 0.2 0.3\n")


def test_materials_of_an_obj_file_are_followed(tmp_path):
    path = write_looks(tmp_path, "obj")
    body = registry.body_of(path)
    assert registry.body_of(path) is body
    materials = tmp_path / "looks.mtl"
    text = materials.read_text()
    materials.unlink()
    bare_body = registry.body_of(path)
    assert bare_body != body and registry.body_of(path) is bare_body
    materials.write_text(text)
    assert registry.body_of(path) == body


def write_looks(folder, kind):
    """Write a robot whose visual mesh has the color (0.1, 0.2, 0.3), and return its path."""
    if kind == "mjcf":
        path = write_mjcf(folder)
        text = path.read_text().replace('class="looks" type="mesh"', 'class="looks" material="m" type="mesh"')
        path.write_text(text.replace("<asset>", '<asset><material name="m" rgba="0.1 0.2 0.3 1"/>'))
        return path
    path = write_urdf(folder)
    text = path.read_text()
    mesh = '<mesh filename="trunk.stl"/></geometry>'
    assert text.count(mesh) == 1
    if kind == "urdf":
        text = text.replace(mesh, f'{mesh}<material name="m"><color rgba="0.1 0.2 0.3 1"/></material>')
    elif kind == "shared":
        text = text.replace(mesh, f'{mesh}<material name="m"/>')
        text = text.replace("</robot>", '<material name="m"><color rgba="0.1 0.2 0.3 0.5"/></material></robot>')
    else:
        write_obj(folder)
        text = text.replace("trunk.stl", "trunk.obj")
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", ["mjcf", "urdf", "shared", "obj"])
def test_a_mesh_keeps_its_color(kind, tmp_path):
    body, notes = import_robot(write_looks(tmp_path, kind))
    counts = "1 visual meshes and 1 visual shapes, 2" if kind == "mjcf" else "1 visual meshes, 1"
    assert f"looks: {counts} with the file's color, for pictures, clips and pages" in notes
    assert body_from_json(body_to_json(body)) == body
    name = "visual_color1" if kind == "mjcf" else "visual_color0"  # after that of an ellipsoid
    described, materials = parts.describe_body(body)
    assert materials[name].color == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
    assert [shape.kind for part in described for shape in part.shapes if shape.material == name] == ["hull"]
    assert name not in parts.describe_body(body.replace(palette="moss"))[1]
    for options in ({}, {"uv": True}, {"triangles": 800}):
        file = gltf_reader.read(clips.glb(body, [], **options))
        (material,) = [place for place, each in enumerate(file.json["materials"]) if each["name"] == name]
        color = file.json["materials"][material]["pbrMetallicRoughness"]["baseColorFactor"]
        assert color == pytest.approx((0.01, 0.033, 0.073, 1.0), abs=1e-3)  # linear
        primitives = [primitive for mesh in file.json["meshes"] for primitive in mesh["primitives"]]
        (shown,) = [each for each in primitives if each["material"] == material]
        assert len(file.arrays[shown["indices"]]) == 3 * len(FACES)


@pytest.mark.parametrize("rgba", ["", "1 0", "a b c d", "nan 0 0 1"])
def test_a_color_that_is_none_is_left_out(rgba, tmp_path):
    path = write_looks(tmp_path, "urdf")
    path.write_text(path.read_text().replace("0.1 0.2 0.3 1", rgba))
    body, notes = import_robot(path)
    assert f"looks: 1 visual meshes, for pictures, clips and pages; {LOST_COLOR}" in notes
    assert "rgba" not in body.source


def test_colors_that_pictures_lack_are_counted(tmp_path):
    text = A1.read_text()
    path = tmp_path / "robot.urdf"
    path.write_text(text.replace("</visual>", '<material name="white"/></visual>'))
    lost = f"colors or textures of {text.count('</visual>')} shapes are left out"
    assert f"{COLLIDERS}; {lost}" in import_robot(path).notes

    path = tmp_path / "robot.xml"
    path.write_text(GO2.read_text().replace('rgba="0.9 0.9 0.9 1"', 'material="grid"'))  # which is a texture
    assert f"looks: 1 visual shapes, for pictures, clips and pages; {LOST_COLOR}" in import_robot(path).notes


SHIN = '<link name="FL_calf">'
SHAPES = """
<visual><origin xyz="0.01 0 -0.1" rpy="0 0 1.5707963267948966"/><geometry><box size="0.02 0.04 0.2"/></geometry>
  <material name="blue"><color rgba="0.1 0.2 0.8 1"/></material></visual>
<visual><geometry><cylinder radius="0.03" length="0.05"/></geometry></visual>
<visual><geometry><sphere radius="0.025"/></geometry></visual>
"""


def shown_geoms(body, part):
    """Return kind and color of the geoms of a part that pictures show, by name."""
    model = models.model_spec(body, decorated=True).compile()
    shown = {}
    for index in range(model.ngeom):
        geom = model.geom(index)
        if geom.bodyid[0] == model.body(part).id and geom.group[0] == 0:
            rgba = model.mat_rgba[geom.matid[0]]
            shown[geom.name] = (
                mujoco.mjtGeom(geom.type[0]).name[7:].lower(),
                *rgba[:3].astype(float).round(2).tolist(),
            )
    return shown


def test_shapes_of_a_urdf_stay_in_their_places(tmp_path):
    text = A1.read_text()
    assert text.count(SHIN) == 1
    first, rest = text.split(SHIN)
    mesh_visual = rest[rest.index("<visual>") : rest.index("</visual>") + len("</visual>")]
    path = tmp_path / "robot.urdf"
    path.write_text(first + SHIN + rest.replace(mesh_visual, SHAPES, 1))
    body, notes = import_robot(path)
    assert "looks: 3 visual shapes, 1 with the file's color, for pictures, clips and pages" in notes
    assert body_from_json(body_to_json(body)) == body and same_bits(path, body) == 200
    shown = shown_geoms(body, "l1_link3")
    assert shown["visual0"] == ("box", 0.1, 0.2, 0.8)
    assert (shown["visual1"][0], shown["visual2"][0]) == ("cylinder", "sphere")
    assert "l1_link3_geom0" not in shown and "r1_link3_geom0" in shown_geoms(body, "r1_link3")
    described, materials = parts.describe_body(body)
    shin = next(part for part in described if part.name == "l1_link3")
    assert [(shape.kind, shape.material) for shape in shin.shapes][:2] == [
        ("box", "visual_color0"),
        ("cylinder", "limb"),
    ]
    assert materials["visual_color0"].color == pytest.approx((0.1, 0.2, 0.8), abs=1e-6)
    model = mujoco.MjModel.from_xml_string(body.source)
    box = model.geom("visual0")
    assert (box.pos, box.size) == (pytest.approx((0.01, 0.0, -0.1)), pytest.approx((0.01, 0.02, 0.1)))
    assert abs(box.quat) == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5), abs=1e-4)
    half = mujoco.MjModel.from_xml_string(import_robot(path, scale=0.5).body.source).geom("visual0")
    assert (half.pos, half.size) == (pytest.approx((0.005, 0.0, -0.05)), pytest.approx((0.005, 0.01, 0.05)))


def test_a_shape_of_a_torso_turns_with_it(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(
        GO2.read_text().replace('class="looks" type="ellipsoid"', 'class="looks" pos="0.1 0 0" type="ellipsoid"')
    )
    geom = mujoco.MjModel.from_xml_string(import_robot(path, forward="-y").body.source).geom("visual0")
    assert geom.pos == pytest.approx((0.0, 0.1, 0.0), abs=1e-6)  # the file's x is to the left
    assert abs(geom.quat) == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5), abs=1e-4)


def test_colliders_keep_the_colors_that_a_file_shows(tmp_path):
    foot = '<geom name="FL" class="foot"'
    texts = {
        "shown": GO2.read_text().replace(foot, '<geom name="FL" group="0" rgba="1 0 0 1" class="foot"'),
        "of a material": GO2.read_text()
        .replace(foot, '<geom name="FL" group="0" material="red" class="foot"')
        .replace("<asset>", '<asset><material name="red" rgba="1 0 0 1"/>'),
        "hidden": GO2.read_text().replace(foot, '<geom name="FL" group="3" rgba="1 0 0 1" class="foot"'),
        "clear": GO2.read_text().replace(foot, '<geom name="FL" group="0" rgba="1 0 0 0" class="foot"'),
    }
    for name, text in texts.items():
        path = tmp_path / f"{name}.xml"
        path.write_text(text)
        body, notes = import_robot(path)
        colliders = " and 1 colliders, 2" if name in ("shown", "of a material") else ", 1"
        assert f"looks: 1 visual shapes{colliders} with the file's color, for pictures, clips and pages" in notes, name
        colors = [color[1:] for part in body.part_names for color in shown_geoms(body, part).values()]
        assert ((1.0, 0.0, 0.0) in colors) == (name in ("shown", "of a material")), name
        assert same_bits(path, body) == 200
        assert "rgba" not in ElementTree.tostring(
            sources.remove_visuals(ElementTree.fromstring(body.source)), "unicode"
        )
        painted = body.replace(palette="moss")
        colors = [color[1:] for part in body.part_names for color in shown_geoms(painted, part).values()]
        assert (1.0, 0.0, 0.0) not in colors


def test_a_shape_decorates_colliders_that_a_file_shows(tmp_path):
    path = tmp_path / "robot.xml"
    trunk = '<geom type="box" size="0.19 0.0468 0.057"/>'
    shown_trunk = trunk.replace("/>", ' group="0"/>')
    assert trunk in GO2.read_text()
    path.write_text(GO2.read_text().replace(trunk, shown_trunk))
    body, notes = import_robot(path)
    assert "looks: 2 visual shapes, 1 with the file's color, for pictures, clips and pages" in notes
    assert sorted(kind for kind, *_ in shown_geoms(body, "torso").values()) == ["box", "ellipsoid"]


def test_a_box_that_fits_a_mesh_stands_beside_the_mesh(tmp_path):
    path = write_mjcf(tmp_path)
    foot = '<geom name="FL" class="foot"'
    colliders = '<geom type="box" mesh="calf" pos="0 0 -0.1"/><geom type="mesh" mesh="calf" pos="0 0 -0.1"/>'
    path.write_text(path.read_text().replace(foot, f"{colliders}{foot}"))
    body = import_robot(path).body
    assert body.source.count('type="mesh"') == 2 and same_bits(path, body) == 200


def test_materials_of_an_obj_file_are_read_in_its_folder_alone(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    path = write_looks(folder, "obj")
    (folder / "looks.mtl").rename(tmp_path / "looks.mtl")
    obj = folder / "trunk.obj"
    obj.write_text(obj.read_text().replace("looks.mtl", "../looks.mtl"))
    assert "rgba" not in import_robot(path).body.source
