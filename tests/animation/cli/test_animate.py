"""The program that writes animation clips."""

import json

import gltf_reader
import programs
import pytest
from refusals import refused

from arc_suite import animation
from arc_suite.robots.spec_files import EXAMPLES


def animate(*arguments, cwd=None):
    return programs.run("-m", "arc_suite", "animate", *arguments, cwd=cwd)


@pytest.mark.slow
def test_both_files_and_a_row_for_each_clip(tmp_path):
    arguments = ("--robot=tick", "--clips=walk,idle", "--fps=30", "-o", "tick.glb")
    header, walk, idle, wrote = programs.passed(animate(*arguments, cwd=tmp_path)).splitlines()
    assert header.split("  ")[0] == "clip"
    assert walk.split()[:4] == ["walk", "0.667", "21", "1"]
    assert float(walk.split()[4]) == pytest.approx(0.32, abs=0.01)
    assert idle.split()[3:7] == ["0", "0.000", "0.000", "0.0"]
    assert wrote == "wrote tick.glb and tick.clips.json"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["tick.clips.json", "tick.glb"]
    data = (tmp_path / "tick.glb").read_bytes()
    file, figures = gltf_reader.read(data), json.loads((tmp_path / "tick.clips.json").read_text())
    assert list(figures["clips"]) == [animation["name"] for animation in file.json["animations"]]
    assert figures["clips"]["walk_loop"]["frames"] == 21
    assert file.json["asset"]["generator"].startswith("arc_suite ")
    animate(*arguments, cwd=tmp_path)
    assert (tmp_path / "tick.glb").read_bytes() == data


@pytest.mark.long
def test_any_body_as_rigid_parts(tmp_path):
    flags = ("--legs=4", "--links=2", "--rig=nodes", "--root_motion=moving", "--clips=walk", "-o", "walker.glb")
    programs.passed(animate(*flags, "--triangles=1500", "--uv", "--reduce", cwd=tmp_path))
    file = gltf_reader.read((tmp_path / "walker.glb").read_bytes())
    primitives = [primitive for mesh in file.json["meshes"] for primitive in mesh["primitives"]]
    assert sum(len(file.arrays[each["indices"]]) for each in primitives) <= 3 * 1500
    assert all("TEXCOORD_0" in each["attributes"] for each in primitives)
    inputs = [len(file.arrays[each["input"]]) for each in file.json["animations"][0]["samplers"]]
    assert min(inputs) < 0.5 * max(inputs)
    assert "skins" not in file.json and len(file.json["animations"]) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no file to write; say --output=FILE.glb"),
        (("-o", "a.gltf"), "unknown extension '.gltf'; did you mean '.glb'?"),
        (("-o", "a.fbx"), "a.fbx: clips are written as .glb; tools/to_fbx.py makes .fbx of it, by Blender"),
        (("-o", "a.glb", "--transparent"), "transparent: it is for .webp, .png, not for .glb"),
        (("-o", "a.png", "--rig=nodes"), "rig: it is for .glb, not for .png"),
        (("-o", "a.mp4", "--clips=all"), "clips: expected one for .mp4, got all"),
        (("-o", "a.gif", "--clips=walk"), "fps: expected at most 50 for a GIF, got 60"),
        (("-o", "a.glb", "--rig=bones"), "unknown rig 'bones'; did you mean 'skin'?"),
        (("-o", "a.glb", "--root_motion=none"), "unknown root_motion 'none'"),
        (("-o", "a.glb", "--clips=walk,fly"), "unknown clip 'fly'"),
        (("-o", "a.glb", "--robot=all"), "--robot=all: expected one robot"),
        pytest.param(
            ("-o", "a.glb", "--robot=tick", "--clips=walk,stop", "--policy=zero"),
            "tick, clip walk: the policy moves at 0 % of its command",
            marks=pytest.mark.slow,
        ),
        (("-o", "a.glb", "--clips="), "--clips=: expected a value, got none"),
        (("-o", "nowhere/a.glb"), "cannot write nowhere/a.glb: no such file or directory"),
    ],
)
def test_errors_are_one_line_and_leave_no_file(tmp_path, arguments, message):
    programs.refused(animate(*arguments, cwd=tmp_path), f"arc-suite animate: {message}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_spec_keeps_its_file_next_to_clips_of_its_name(tmp_path):
    spec = tmp_path / "spider.json"
    spec.write_text(EXAMPLES["spider"].read_text())
    before = spec.read_text()
    flags = ("--clips=walk,tuned", "--weight=old", "--output=spider.glb")
    done = animate("--spec=spider.json", *flags, cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr == "arc-suite animate: spider, clip tuned is left out: spider has no preset tuned\n"
    assert spec.read_text() == before
    assert {path.name for path in tmp_path.iterdir()} == {"spider.json", "spider.glb", "spider.clips.json"}
    figures = json.loads((tmp_path / "spider.clips.json").read_text())
    assert figures["left_out"] == {"tuned": "spider has no preset tuned"}
    assert figures["options"] == {"weight": "old", "straight": False, "plant": False}


def test_a_function_refuses_what_the_program_does(tmp_path):
    with refused("unknown option of clips 'sise'; did you mean 'size'? (there are: rig, root_motion, ", begins=True):
        animation.animate("tick", tmp_path / "a.glb", sise=9)
    with refused("size: expected an integer from 16 to 2160, got 9"):
        animation.animate("tick", tmp_path / "a.webp", "walk", size=9)
    with refused("uv: it is for .glb, not for .webp"):
        animation.animate("tick", tmp_path / "a.webp", "walk", uv=True)
    assert list(tmp_path.iterdir()) == []
