"""Visual meshes stay with an imported body: pictures, clips and pages show them, and no dynamics change."""

import importlib.util
import pathlib
import struct
import sys

import gltf_reader
import mujoco
import numpy as np
import pytest

from arc_suite import models, registry
from arc_suite.animation import clips, parts
from arc_suite.importing import import_robot
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
    assert f"looks: 1 visual meshes, for pictures, clips and pages; {LOST_COLOR}" in notes  # of an ellipsoid
    points = WEDGE * (0.2, 0.2, 0.5) - (0.0, 0.0, 0.1)
    assert in_order(visual_points(body, "l1_link3")) == pytest.approx(in_order(points), abs=1e-3)


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
    line = "looks: 1 visual meshes, 1 with the file's color, for pictures, clips and pages"
    assert (f"{line}; {LOST_COLOR}" if kind == "mjcf" else line) in notes
    assert body_from_json(body_to_json(body)) == body
    described, materials = parts.describe_body(body)
    assert materials["visual_color0"].color == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
    assert [shape.kind for part in described for shape in part.shapes if shape.material == "visual_color0"] == ["hull"]
    assert "visual_color0" not in parts.describe_body(body.replace(palette="moss"))[1]
    for options in ({}, {"uv": True}, {"triangles": 800}):
        file = gltf_reader.read(clips.glb(body, [], **options))
        (material,) = [place for place, each in enumerate(file.json["materials"]) if each["name"] == "visual_color0"]
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
    material = '<material name="white"/></visual>'
    texts = {
        "robot.urdf": (A1, "</visual>", material),
        "robot.xml": (GO2, '<geom name="FL" class="foot"', '<geom name="FL" rgba="1 0 0 1" class="foot"'),
    }
    for name, (file, old, new) in texts.items():
        text = file.read_text()
        (tmp_path / name).write_text(text.replace(old, new))
        count = text.count(old) + (file == GO2)  # which has a colored ellipsoid; its floor has a material
        assert f"{COLLIDERS}; colors or textures of {count} shapes are left out" in import_robot(tmp_path / name).notes


def test_materials_of_an_obj_file_are_read_in_its_folder_alone(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    path = write_looks(folder, "obj")
    (folder / "looks.mtl").rename(tmp_path / "looks.mtl")
    obj = folder / "trunk.obj"
    obj.write_text(obj.read_text().replace("looks.mtl", "../looks.mtl"))
    assert "rgba" not in import_robot(path).body.source
