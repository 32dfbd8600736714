"""Ground from files: heights are those of the file and of the physics, one environment is a batch, the scan sees it."""

import json
import os
import pickle
import struct
import zlib

import ground_files
import imageio.v3 as imageio
import mujoco
import numpy as np
import pytest
import rays
import scipy.spatial
from numpy.testing import assert_allclose, assert_array_equal
from programs import arc_suite as run
from programs import passed, refused
from tiers import tiers

import arc_suite
from arc_suite import models, registry
from arc_suite.arenas import ground_text
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks.sensors import SCAN

TICK = ROBOTS["tick"]
HEIGHT = TICK.torso.standing_height

# File -> a function that writes the hill, given its path, and returns the word of the arena.
HILLS = {
    "hill.png": ground_files.write_png,
    "hill.obj": ground_files.write_obj,
    "HILL.STL": ground_files.write_stl,
    "milli.stl": lambda path: f"{ground_files.write_stl(path, 1000.0)}:0.001",
}


FIELD = '<geom type="hfield" hfield="a"'


def field(geoms, nodes='nrow="2" ncol="3" elevation="0 1 2 3 4 5"'):
    """Return a scene with a height field, whose first row is the far side in y."""
    asset = f'<hfield name="a" size="6 4 0.5 1" {nodes}/>'
    return f"<mujoco><asset>{asset}</asset><worldbody>{geoms}</worldbody></mujoco>".encode()


def model_of(arena, body=TICK):
    return mujoco.MjModel.from_xml_string(models.assemble(body, arena).to_xml_string())


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(columns, rows, bits=16, kind=0, content=b""):
    header = struct.pack(">IIBBBBB", columns, rows, bits, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(content)) + chunk(b"IEND", b"")


def scene(content):
    return f"<mujoco><worldbody>{content}</worldbody></mujoco>".encode()


@pytest.mark.parametrize("name", tiers(HILLS, lambda name: name == "hill.png"))
def test_heights_are_those_of_the_file_and_of_rays(tmp_path, name):
    arena = registry.arena_of(HILLS[name](tmp_path / name), TICK)
    x, y = ground_files.places()
    heights = arena.height(x, y)
    expected = ground_files.hill()
    middle = expected[ground_files.ROWS // 2, ground_files.COLUMNS // 2]
    # Of a mesh, a finer grid is sampled: a corner of it may lie between two nodes.
    tolerance = 2e-5 if name == "hill.png" else 2e-3
    assert_allclose(heights, expected - middle, rtol=0.0, atol=tolerance)
    assert arena.height(np.float64(0.0), np.float64(0.0)) == pytest.approx(0.0, abs=1e-12)
    points = np.random.RandomState(0).uniform((-6.0, -5.0), (6.0, 5.0), (300, 2))
    rays.assert_heights(arena, model_of(arena), points, HEIGHT)
    assert arena.has_left(np.array([0.0, 6.2, 0.0, 0.0]), np.array([0.0, 0.0, -5.2, 5.1])).tolist() == [0, 1, 1, 0]


def test_the_top_of_a_picture_is_far_to_the_left(tmp_path):
    """Columns of a picture lead along x, and the first row lies at the greatest y, as MuJoCo reads pictures."""
    pixels = np.zeros((21, 31), np.uint8)
    pixels[0, -1] = 255
    imageio.imwrite(tmp_path / "corner.png", pixels)
    arena = registry.arena_of(f"{tmp_path}/corner.png:12x8x0.25", TICK)
    corners = arena.height(np.array([6.0, 6.0, -6.0, -6.0]), np.array([4.0, -4.0, 4.0, -4.0]))
    assert_allclose(corners, [0.25, 0.0, 0.0, 0.0], atol=1e-6)


def test_maps_of_eight_bits_and_level_ones_and_large_ones(tmp_path):
    exact = registry.arena_of(ground_files.write_png(tmp_path / "fine.png"), TICK)
    coarse = registry.arena_of(ground_files.write_png(tmp_path / "coarse.png", bits=8), TICK)
    x, y = ground_files.places()
    assert 0.0 < abs(exact.height(x, y) - coarse.height(x, y)).max() < ground_files.TOP / 255.0
    imageio.imwrite(tmp_path / "level.png", np.full((700, 900), 99, np.uint8))
    level = registry.arena_of(f"{tmp_path}/level.png:9x7x1", TICK)
    assert not level.height(x, y).any()
    assert level.surface.heights.shape == (512, 512)
    assert len(registry.arena_word(f"{tmp_path}/level.png:9x7x1")) < 2000
    # Cells of a sixteenth of a standing height are fine enough: larger bodies have fewer.
    assert registry.arena_of(f"{tmp_path}/level.png:9x7x1", ROBOTS["queen"]).surface.heights.shape == (150, 193)


def test_a_map_of_height_0_is_level(tmp_path):
    word = ground_files.write_png(tmp_path / "hill.png").removesuffix("0.5") + "0"
    arena = registry.arena_of(word, TICK)
    points = np.random.RandomState(0).uniform(-4.0, 4.0, (100, 2))
    assert not arena.height(points[:, 0], points[:, 1]).any()
    model = mujoco.MjModel.from_xml_string(models.assemble(TICK, arena).to_xml_string())
    rays.assert_heights(arena, model, points, HEIGHT)


def test_a_path_stands_for_its_file(tmp_path):
    path = tmp_path / "hill.obj"
    word = ground_files.write_obj(path)
    settings = {"arena": path}
    for environment in (arc_suite.load("tick", "walk", settings), VectorEnv("tick", "walk", task_kwargs=settings)):
        assert environment.task.definition.scene.arena == registry.arena_of(word, TICK)
    assert Setup.of("tick", "walk", {"arena": path}) == Setup.of("tick", "walk", {"arena": word})


def test_a_scene_keeps_its_solids(tmp_path):
    arena = registry.arena_of(ground_files.write_yard(tmp_path / "yard.xml"), TICK)
    model = model_of(arena)
    kinds = [int(kind) for name, kind in geoms(model) if name.startswith("floor")]
    assert sorted(kinds) == [0, 5, 6, 6, 6]  # plane, boxes, cylinder; what touches nothing is left out
    assert not arena.has_left(np.float64(1e3), np.float64(0.0))  # the plane has no end
    x, y = np.array([0.0, 0.0, 0.0, -3.0, 50.0]), np.array([0.0, 3.0, 3.8, 0.0, 0.0])
    assert_allclose(arena.height(x, y), [0.0, 0.25, 0.1, 0.2, 0.0], atol=1e-6)
    ramp = arena.height(np.array([3.0, 5.0]), np.zeros(2))
    assert_allclose(np.diff(ramp), 2.0 * np.tan(np.deg2rad(10.0)), rtol=1e-3)


def scene_of(tmp_path, content):
    """Return the ground of a scene for Tick."""
    (tmp_path / "scene.xml").write_bytes(scene(content))
    return registry.arena_of(str(tmp_path / "scene.xml"), TICK)


def test_a_scene_reaches_as_far_as_a_walk(tmp_path):
    arena = scene_of(tmp_path, '<geom type="box" size="50 50 .5" pos="0 0 -.5"/>')
    longest_walk = 92.0 * HEIGHT  # m, of Tick in 1000 control steps
    assert not arena.has_left(np.float64(longest_walk), np.float64(0.0))
    assert arena.has_left(np.float64(50.0), np.float64(0.0))
    arena = scene_of(tmp_path, '<geom type="plane" size="1 1 1"/><geom type="box" size="3 1 .04" pos="14 0 0"/>')
    assert_allclose(arena.height(np.array([10.0, 14.0, 18.0]), np.zeros(3)), [0.0, 0.04, 0.0], atol=1e-9)


@pytest.mark.parametrize("places", [("40 0 0",), ("0 -70 0",), ("40 0 0", "3 0 0")])
def test_solids_beyond_the_reach_leave_the_plane_level(tmp_path, places):
    boxes = "".join(f'<geom type="box" size="1 1 .1" pos="{place}"/>' for place in places)
    arena = scene_of(tmp_path, '<geom type="plane" size="1 1 1"/>' + boxes)
    assert_allclose(arena.height(np.array([0.0, -7.0, 9.0]), np.array([0.0, 5.0, 0.0])), 0.0, atol=1e-9)
    expected = 0.1 if "3 0 0" in places else 0.0
    assert_allclose(arena.height(np.float64(3.0), np.float64(0.0)), expected, atol=1e-9)


def test_heights_of_a_scene_are_known_as_the_page_says(tmp_path):
    cell = scene_of(tmp_path, '<geom type="box" size="3.4 3.4 .5"/>').surface.cell
    assert max(cell) <= HEIGHT / 16.0  # m
    cell = scene_of(tmp_path, '<geom type="box" size="50 50 .5"/>').surface.cell
    assert_allclose(cell, 240.0 * HEIGHT / 640.0)


def geoms(model):
    return [(model.geom(geom).name, model.geom_type[geom]) for geom in range(model.ngeom)]


@pytest.mark.slow
def test_a_mesh_in_a_scene_is_its_hull(tmp_path):
    ground_files.write_stl(tmp_path / "hill.stl")
    text = '<mujoco><asset><mesh name="a" file="hill.stl"/></asset><worldbody><geom type="mesh" mesh="a"/></worldbody>'
    (tmp_path / "hull.xml").write_text(text + "</mujoco>")
    arena = registry.arena_of(str(tmp_path / "hull.xml"), TICK)
    x, y = ground_files.places()
    points, _ = ground_files.triangles()
    faces = scipy.spatial.ConvexHull(points).equations
    faces = faces[faces[:, 2] > 1e-9, None, None].transpose(3, 0, 1, 2)  # those that face up
    hull = ((-faces[3] - faces[0] * x - faces[1] * y) / faces[2]).min(axis=0)
    middle = hull[ground_files.ROWS // 2, ground_files.COLUMNS // 2]
    assert_allclose(arena.height(x, y)[1:-1, 1:-1], hull[1:-1, 1:-1] - middle, atol=1e-3)
    assert_allclose(arena.surface.low, [-6.5, -5.5], atol=0.01)
    assert arena.has_left(np.float64(6.3), np.float64(0.0))


@pytest.mark.parametrize("name", tiers(["hill.png", "yard.xml"], lambda name: name == "hill.png"))
def test_one_environment_is_a_batch_and_the_scan_sees_the_ground(tmp_path, name):
    writer = ground_files.write_yard if name == "yard.xml" else HILLS[name]
    settings = {"arena": writer(tmp_path / name), "scan": True}
    single = arc_suite.load("tick", "steer", {**settings, "random": 0})
    batch = VectorEnv("tick", "steer", 2, 1, task_kwargs=settings)
    timestep = single.reset()
    batch.reset(seed=0)
    policy = Demonstrator("tick", "climbing")
    for _ in range(40):
        action = policy(timestep)
        timestep = single.step(action)
        observation, reward, *_ = batch.step(np.stack([action, action]))
        blocks = batch.task.definition.split(observation[0])
        assert_array_equal(blocks["scan"], timestep.observation["scan"].astype(np.float32))
        assert reward[0] == timestep.reward
    definition = single.task.definition
    x, y, z = single.physics.position()[:3]
    w, _, _, turn = single.physics.position()[3:7]
    heading, reach = 2.0 * np.arctan2(turn, w), definition.context.reach
    forward, left = SCAN * reach
    heights = definition.scene.arena.height(
        x + np.cos(heading) * forward - np.sin(heading) * left, y + np.sin(heading) * forward + np.cos(heading) * left
    )
    assert_allclose(timestep.observation["scan"], ((heights - z) / HEIGHT + 1.0).clip(-1.0, 1.0), atol=0.02)


def test_settings_hold_the_ground_and_not_its_file(tmp_path):
    """A policy, a dataset or a snapshot opens without the file; and no file names another one."""
    word = ground_files.write_png(tmp_path / "hill.png")
    setup = Setup.of("tick", "steer", {"arena": word})
    assert setup == Setup.of("tick", "steer", {"arena": os.path.relpath(tmp_path / "hill.png") + word[-10:]})
    (tmp_path / "hill.png").unlink()
    stored = Setup.from_dict(json.loads(json.dumps(setup.to_dict())))
    assert stored == pickle.loads(pickle.dumps(setup)) == setup
    assert stored.definition.scene.arena.map.size == (13.0, 11.0, 0.5)
    assert str(setup) == 'tick, steer, {"arena": "hill"}'
    with pytest.raises(ValueError, match=r"arena '.*hill.png:13x11x0.5': what is stored cannot name a file"):
        Setup.from_dict({**setup.to_dict(), "task_kwargs": {"arena": word}})


PLANE = '<geom type="plane" size="1 1 1"/>'
BOX = '<geom type="box" size="4 4 1"/>'
# Name of a file -> its content, and what the error says after the name.
REFUSED = {
    "words.png:9x9x1": (b"hello", "expected a PNG"),
    "short.png:9x9x1": (b"\x89PNG\r\n\x1a\n", "expected a PNG"),
    "colors.png:9x9x1": (png(9, 9, 8, 2), "expected a PNG in shades of gray of 16 bits, or of 8, without colors and"),
    "bits.png:9x9x1": (png(9, 9, 1), "expected a PNG in shades of gray of 16 bits, or of 8, without colors and"),
    "huge.png:9x9x1": (
        png(1 << 30, 1 << 30),
        "expected 2 to 8192 pixels along each side, got 1073741824 by 1073741824",
    ),
    "thin.png:9x9x1": (png(9, 1), "expected 2 to 8192 pixels along each side, got 9 by 1"),
    "damaged.png:9x9x1": (png(9, 9)[:-30], ""),
    "scale.png": (
        png(9, 9),
        "expected length, width and height of white over black, m, after its name: scale.png:20x20x",
    ),
    "scale.png:9x9": (
        png(9, 9),
        "expected length, width and height of white over black, m, after its name: scale.png:20",
    ),
    "far.png:9e9x9x1": (png(9, 9, 16, 0, bytes(9 * 19)), "size: expected one number from 0 to 1000 or 3 of them"),
    "small.png:1x9x1": (
        png(9, 9, 16, 0, bytes(9 * 19)),
        "expected sides of at least 6 standing heights of the body (1.08 m",
    ),
    "words.obj": (b"hello", ""),
    "empty.obj": (b"", ""),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", ""),
    "wall.obj": (b"v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", "expected a mesh at most 1000 m long, z up, got 1 x 0 x 1 m"),
    "far.obj": (
        b"v 0 0 0\nv 9e6 0 0\nv 0 1 0\nf 1 2 3\n",
        "expected a mesh at most 1000 m long, z up, got 9e+06 x 1 x 0 m; lengths in mm? far.obj:0.001",
    ),
    "nan.obj": (b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", ""),
    "deep.obj": (
        b"v 0 0 0\nv 90 0 0\nv 0 90 0\n" + b"f 1 2 3\n" * 2000,
        "expected ground: too many of its triangles lie over each other",
    ),
    "words.stl": (b"solid hello", ""),
    "many.stl": (bytes(80) + b"\xff\xff\xff\xff" + bytes(50), ""),
    "words.xml": (b"hello", "expected XML"),
    "entities.xml": (b'<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "expected XML without a document type and entities"),
    "robot.xml": (b"<robot/>", "expected MJCF (mujoco), got an element 'robot'"),
    "empty.xml": (scene(""), "expected geoms that collide, got none"),
    "visual.xml": (scene('<geom size="1" contype="0" conaffinity="0"/>'), "expected geoms that collide, got none"),
    "joint.xml": (
        scene(f'{PLANE}<body><joint name="hip"/>{BOX}</body>'),
        "joint 'hip': expected a scene without a robot, in which nothing moves",
    ),
    "tilted.xml": (
        scene('<geom name="a" type="plane" size="1 1 1" euler="9 0 0"/>'),
        "geom 'a': expected a level plane; a tilted one can be a box",
    ),
    "next.xml": (field(f"{FIELD}/>{PLANE}"), "expected nothing next to a height field that collides"),
    "turned.xml": (field(f'{FIELD} euler="0 0 9"/>'), "expected a height field that is not turned"),
    "aside.xml": (field(f'{FIELD} pos="1 0 0"/>'), "with its middle at x = y = 0"),
    "falling.xml": (
        field(f'<body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{FIELD}/></body>'),
        "",
    ),
    "passwd.xml": (field(f"{FIELD}/>", 'file="/etc/passwd"'), ""),
    "wide.xml": (field(f"{FIELD}/>", 'nrow="9999" ncol="9"'), "nrow"),
    "missing.xml": (
        b'<mujoco><asset><mesh file="no.stl"/></asset><worldbody><geom type="mesh" mesh="no"/></worldbody></mujoco>',
        "",
    ),
    "many.xml": (scene(f'<replicate count="9999">{PLANE}</replicate>'), "expected at most 2048 elements 'body'"),
    "crowd.xml": (scene(f'<replicate count="2000" offset="0 0 1">{BOX}</replicate>'), "expected 1 to 1024 solids"),
    "nothing.xml": (
        scene('<geom type="box" size="1 1 1" pos="9 0 0"/>'),
        "expected ground under the start, at x = y = 0",
    ),
    "small.xml": (
        scene('<geom type="box" size=".5 4 1"/>'),
        "expected sides of at least 6 standing heights of the body",
    ),
    "scale.xml:2": (scene(BOX), "expected no scale: MJCF is in m"),
    "ground.tif": (b"", "expected a file .png, .obj, .stl, .xml, or one of flat, bumps,"),
}


@pytest.mark.parametrize("from_file", [False, True])
def test_a_height_field_of_a_scene_is_a_map(tmp_path, from_file):
    path = tmp_path / "field.xml"
    path.write_bytes(field(f'{FIELD} pos="0 0 3"/><geom type="box" size="1 1 1" contype="0" conaffinity="0"/>'))
    if from_file:
        levels = np.arange(6).reshape(2, 3) * 51
        imageio.imwrite(tmp_path / "levels.png", levels.astype(np.uint8))
        path.write_bytes(field(f"{FIELD}/>", 'file="levels.png"'))
    scene = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(scene)
    mujoco.mj_forward(scene, data)
    arena = registry.arena_of(str(path), TICK)
    places = np.random.RandomState(0).uniform(-0.95, 0.95, (20, 2)) * (6.0, 4.0)
    heights = []
    for place in [(0.0, 0.0), *places]:
        above = np.array([*place, 9.0])
        hit = mujoco.mj_ray(scene, data, above, np.array([0.0, 0.0, -1.0]), None, 1, -1, np.zeros(1, np.int32))
        heights.append(9.0 - hit)
    assert_allclose(arena.height(*places.T), np.array(heights[1:]) - heights[0], atol=2e-5)


def test_the_picture_of_a_height_field_is_missing(tmp_path):
    (tmp_path / "lost.xml").write_bytes(field(f"{FIELD}/>", 'file="no.png"'))
    with pytest.raises(OSError, match="cannot read .*no.png: no such file"):
        registry.arena_of(f"{tmp_path}/lost.xml", TICK)


@pytest.mark.parametrize("word", REFUSED)
def test_files_without_ground_are_refused_in_one_line(tmp_path, word):
    content, reason = REFUSED[word]
    (tmp_path / word.partition(":")[0]).write_bytes(content)
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        registry.arena_of(f"{tmp_path}/{word}", TICK)
    message = str(caught.value)
    assert reason in message
    assert "\n" not in message
    assert len(message) < 500
    assert word.partition(".")[0] in message


TEXT = {"name": "a", "size": [9, 9, 1], "shape": [2, 2], "heights": "eJxjYGBgAAAABAAB"}
CORNER = {"kind": "mesh", "pos": [0, 0, 0], "quat": [1, 0, 0, 0], "size": [], "points": [[0, 0, 0]]}
BALL = {"kind": "sphere", "pos": [0, 0, 0], "quat": [1, 0, 0, 0], "size": [1], "points": []}


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ([], "expected a mapping"),
        ({}, "'name' is missing"),
        ({"name": "a\nb"}, "name: expected 1 to 40 characters"),
        (TEXT | {"shape": [4096, 4096]}, "rows: expected an integer from 2 to 512, got 4096"),
        (TEXT | {"shape": [2, 3]}, "heights: expected 2 rows of 3"),
        (TEXT | {"size": [9, 9, float("inf")]}, "size: expected one number"),
        (TEXT | {"heights": "no"}, ""),
        ({"name": "a", "parts": []}, "expected 1 to 1024 solids"),
        ({"name": "a", "parts": [BALL | {"kind": "cube"}]}, "unknown kind of solid 'cube'"),
        ({"name": "a", "parts": [BALL | {"size": [-1]}]}, "size: expected one number"),
        ({"name": "a", "parts": [BALL | {"pos": [0, 0, "1"]}]}, "pos: expected one number"),
        (
            {"name": "a", "parts": [BALL | {"kind": "mesh", "size": [], "points": [[0, 0, 0]]}]},
            "mesh: expected 4 to 16384 points",
        ),
    ],
)
def test_damaged_text_is_refused_in_one_line(fields, reason):
    with pytest.raises(ValueError, match="arena: expected a name, a file or ground as JSON") as caught:
        Setup.of("tick", "walk", {"arena": json.dumps(fields) if fields else "{" + json.dumps(fields)[1:-1] + "}"})
    assert reason in str(caught.value) or not fields
    assert "\n" not in str(caught.value)


def test_a_text_gives_its_ground_back(tmp_path):
    word = registry.arena_word(ground_files.write_yard(tmp_path / "yard.xml"))
    assert ground_text.to_text(ground_text.from_text(word)) == word
    assert registry.arena_word(word) == word
    assert registry.arena_of(word, TICK) == registry.arena_of(word, TICK) != registry.arena_of(word, ROBOTS["queen"])


@pytest.mark.long
def test_programs_take_ground_from_files(tmp_path):
    word = ground_files.write_png(tmp_path / "hill.png")
    told = passed(run("evaluate", "--robot", "tick", "--task", "steer", "--arena", word, "--episodes", "1"))
    assert "tick" in told
    both = run("evaluate", "--robot", "tick", "--arena", word, "--set", "arena=flat")
    refused(both, "arc-suite evaluate: expected one of --arena and --set arena, got both")
    missing = run("evaluate", "--robot", "tick", "--arena", f"{tmp_path}/no.png:9x9x1")
    refused(missing, f"arc-suite evaluate: cannot read {tmp_path}/no.png: no such file")


@pytest.mark.long
def test_pages_show_the_ground(tmp_path):
    play_pages = pytest.importorskip("arc_suite.animation.play_pages")
    scenery = pytest.importorskip("arc_suite.animation.scenery")
    for name, writer in (("hill.png", ground_files.write_png), ("yard.xml", ground_files.write_yard)):
        word = writer(tmp_path / name)
        environment = arc_suite.load("tick", "steer", {"arena": word, "random": 0})
        environment.reset()
        arena = environment.task.definition.scene.arena
        shown = scenery.describe_ground(environment, np.array([-2.0, -1.0]), np.array([3.5, 3.6]))
        (field,) = shown["fields"]
        rows, columns = field["heights"].shape
        x, y = np.meshgrid(
            field["low"][0] + field["cell"][0] * np.arange(columns),
            field["low"][1] + field["cell"][1] * np.arange(rows),
        )
        assert_allclose(field["heights"], arena.height(x, y), atol=1e-9)
        assert x.min() <= -2.0
        assert y.max() >= 3.5
        assert shown["planes"] == ([] if name == "hill.png" else [pytest.approx(-0.01 * HEIGHT)])
        assert shown["solids"] == []
        grounds = play_pages.creature(TICK, arena=word)["grounds"]
        assert list(grounds) == [name.partition(".")[0], "level", "bumps", "slopes"]
        surface = next(iter(grounds.values()))["surface"]
        # Points of a page are farther apart.
        assert_allclose(max(map(max, surface["heights"])), arena.surface.heights.max(), atol=0.02 * HEIGHT)
