"""Bones of files that came back from other tools: turned axes, other kinds of keys, scales, and what is no file."""

import drawn_motions
import gltf_editor
import numpy as np
import pytest

from arc_suite import motions, registry
from arc_suite.animation.clips.creatures import glb
from arc_suite.motions import reading

TICK = registry.body_of("tick")
NEAR = 1e-5  # rad, or standing heights


@pytest.fixture(scope="module")
def raised():
    return drawn_motions.raise_leg(TICK, 0)


@pytest.fixture(scope="module")
def file(raised):
    """A file with one animation, `raise`."""
    return glb(TICK, [drawn_motions.clip_of(TICK, raised)], root_motion="moving")


def read(folder, data, body=TICK, **options):
    path = folder / "edited.glb"
    path.write_bytes(data)
    return reading.read(path, body, reading.Options(**options))


def assert_same(motion, expected):
    expected = motions.resample(expected, motion.frame_rate)
    np.testing.assert_allclose(motion.angles, expected.angles, atol=0.01)  # lines between keys
    np.testing.assert_allclose(motion.angles[::3], expected.angles[::3], atol=NEAR)  # keys
    np.testing.assert_allclose(motion.soles[::3], expected.soles[::3], atol=NEAR)


def test_bones_with_other_axes(raised, file, tmp_path):
    editor = gltf_editor.Editor(file)
    gltf_editor.turn_bones(editor)
    motion, notes = read(tmp_path, editor.data())
    assert (motion.name, motion.body, motion.frames, notes) == ("raise", "tick", 121, [])
    assert_same(motion, raised)


def test_steps_between_keys(raised, file, tmp_path):
    editor = gltf_editor.Editor(file)
    for _, sampler in editor.channels():
        sampler["interpolation"] = "STEP"
    motion, _ = read(tmp_path, editor.data())
    np.testing.assert_allclose(motion.angles[1:-1:3], motion.angles[0:-1:3])
    np.testing.assert_allclose(motion.angles[::3], raised.angles, atol=NEAR)


def test_cubic_splines(raised, file, tmp_path):
    """Keys with their slopes on both sides; quaternions are not of length 1 between keys."""
    editor = gltf_editor.Editor(file)
    for (_, path), sampler in list(editor.channels()):
        values = editor.read(sampler["output"]).copy()
        slopes = np.gradient(values, 1.0 / raised.frame_rate, axis=0)
        keys = np.stack([slopes, values, slopes], axis=1).reshape(-1, values.shape[1])
        sampler["output"] = editor.add(keys, "VEC4" if path == "rotation" else "VEC3")
        sampler["interpolation"] = "CUBICSPLINE"
    motion, notes = read(tmp_path, editor.data())
    assert notes == []
    expected = motions.resample(raised, motion.frame_rate)
    np.testing.assert_allclose(motion.angles[3:-3], expected.angles[3:-3], atol=1e-4)


def test_constant_tracks_that_were_dropped(raised, file, tmp_path):
    editor = gltf_editor.Editor(file)
    animation, kept = editor.json["animations"][0], []
    for channel in animation["channels"]:
        values = editor.read(animation["samplers"][channel["sampler"]]["output"])
        if np.ptp(values, axis=0).max() < 1e-6:
            editor.json["nodes"][channel["target"]["node"]][channel["target"]["path"]] = values[0].tolist()
        else:
            kept.append(channel)
    assert len(kept) < len(animation["channels"]) - 10
    animation["channels"] = kept
    motion, _ = read(tmp_path, editor.data())
    assert_same(motion, raised)


def test_scale_and_another_place(raised, file, tmp_path):
    editor = gltf_editor.Editor(file)
    root = editor.json["nodes"].index(editor.node("root"))
    turned = {"name": "Armature", "children": [root], "scale": [100.0] * 3, "translation": [3.0, 0.0, 4.0]}
    editor.json["nodes"].append(turned | {"rotation": [0.0, 0.6, 0.0, 0.8]})
    editor.json["scenes"][0]["nodes"][0] = len(editor.json["nodes"]) - 1
    motion, notes = read(tmp_path, editor.data())
    assert notes == ["lengths are divided by 100"]
    assert_same(motion, raised)


def test_turns_off_the_hinge_are_told(file, tmp_path):
    editor = gltf_editor.Editor(file)
    knee = editor.json["nodes"].index(
        editor.node("l2_tibia" if "l2_tibia" in TICK.part_names else TICK.legs[1].part_names[1])
    )
    (sampler,) = [sampler for (node, path), sampler in editor.channels() if (node, path) == (knee, "rotation")]
    values = editor.read(sampler["output"])
    values[20] = gltf_editor.product(values[20], [0.0, np.sin(np.radians(2.0)), 0.0, np.cos(np.radians(2.0))])
    _, notes = read(tmp_path, editor.data())
    name = editor.json["nodes"][knee]["name"]
    assert notes[0] == f"{name} turns 4 degrees about other axes than its hinge in frame 60; they are left out"
    assert "misses its place by" in notes[1]


def test_loop_that_does_not_quite_close(tmp_path):
    steps = drawn_motions.step_loop(TICK)
    angles = steps.angles + np.linspace(0.0, 0.03, steps.frames)[:, None]
    clip = drawn_motions.clip_of(TICK, steps._replace(angles=angles))
    motion, notes = read(tmp_path, glb(TICK, [clip], root_motion="moving"), clip="walk")
    assert motion.loops and motion.name == "walk"
    np.testing.assert_allclose(motion.angles[-1], motion.angles[0], atol=1e-6)
    assert notes[0] == "the loop was open by 1.7 degrees, which its end takes up"


def accessor_of(editor, change):
    """Change the accessor of the first track's times."""
    _, sampler = next(editor.channels())
    change(editor.json["accessors"][sampler["input"]])


def poison(editor):
    _, sampler = next(editor.channels())
    editor.read(sampler["output"])[1] = np.nan


def rename(editor):
    editor.node("torso")["name"] = "torzo"


def stretch(editor):
    editor.read(editor.json["skins"][0]["inverseBindMatrices"])[3, 3, 0] += 0.1


def below_itself(editor):
    editor.node("torso")["children"].append(editor.json["nodes"].index(editor.node("root")))


HOSTILE = {
    "NaN": (poison, "expected finite numbers"),
    "a billion keys": (lambda e: accessor_of(e, lambda a: a.update(count=10**9)), "count of accessor"),
    "keys behind the end": (lambda e: accessor_of(e, lambda a: a.update(byteOffset=10**6)), "byteOffset|claims"),
    "a view of another file": (lambda e: e.json["bufferViews"][-1].update(buffer=1), "the file's own buffer"),
    "words for numbers": (lambda e: accessor_of(e, lambda a: a.update(count="x")), "count of accessor"),
    "a bone without its name": (
        rename,
        "bones: expected those of tick, and there is no torso; did you mean 'torzo'.*; --of names",
    ),
    "a longer bone": (stretch, "bones: expected .* of tick at .* m from the bone above it, got"),
    "nodes in a ring": (below_itself, "below itself"),
    "no animation": (lambda e: e.json.pop("animations"), "expected an animation, and there is none"),
    "a list of numbers": (lambda e: e.json.update(nodes=[1, 2]), "nodes: expected a list of objects"),
    "lists in lists": (lambda e: e.json.update(nodes={"a": []}), "nodes: expected a list of objects"),
    "a joint too far": (lambda e: e.json["skins"][0]["joints"].append(10**9), "joint of a skin"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_damaged_file_is_one_line(kind, file, tmp_path):
    damage, message = HOSTILE[kind]
    editor = gltf_editor.Editor(file)
    damage(editor)
    with pytest.raises(ValueError, match=message) as error:
        read(tmp_path, editor.data())
    assert str(error.value).startswith(f"{tmp_path / 'edited.glb'}: ") and "\n" not in str(error.value)


@pytest.mark.parametrize("data", [b"", b"glTF", b"glTF" + bytes(40), b"{}"])
def test_other_files_are_one_line(data, tmp_path):
    with pytest.raises(ValueError, match=f"{tmp_path / 'edited.glb'}: "):
        read(tmp_path, data)


def test_truncated_file_is_one_line(file, tmp_path):
    for length in range(20, len(file), len(file) // 15):
        with pytest.raises(ValueError, match="edited.glb: "):
            read(tmp_path, file[:length])


def test_several_animations_need_a_name(raised, tmp_path):
    steps = drawn_motions.step_loop(TICK)
    data = glb(TICK, [drawn_motions.clip_of(TICK, each) for each in (raised, steps)], root_motion="moving")
    with pytest.raises(ValueError, match="clip: expected one of raise, walk_loop"):
        read(tmp_path, data)
    with pytest.raises(ValueError, match="unknown clip 'run'"):
        read(tmp_path, data, clip="run")
    motion, _ = read(tmp_path, data, clip="walk")
    assert motion.loops and motion.name == "walk"


@pytest.mark.parametrize(("name", "loops", "read_name"), [("nod_loop", True, "nod"), ("nod", False, "nod")])
def test_the_name_of_an_animation_says_whether_it_repeats(name, loops, read_name, file, tmp_path):
    """Also where what else the file says of the animation was written under another name."""
    for extra in (True, False):
        editor = gltf_editor.Editor(file)
        editor.json["animations"][0]["name"] = name
        editor.json["animations"][0]["extras"]["loops"] = extra
        motion, _ = read(tmp_path, editor.data())
        assert (motion.loops, motion.name) == (loops, read_name)


def test_an_animation_without_a_name_has_its_number(raised, file, tmp_path):
    editor = gltf_editor.Editor(file)
    editor.json["animations"][0]["name"] = ""
    motion, _ = read(tmp_path, editor.data())
    assert motion.name == "animation 0"
    motions.save(motion, tmp_path / "raise.npz")
    assert motions.digest(motions.load(tmp_path / "raise.npz")) == motions.digest(motion)


def test_two_animations_of_one_name_are_one_line(raised, tmp_path):
    steps = drawn_motions.step_loop(TICK)
    clips = [drawn_motions.clip_of(TICK, motion) for motion in (raised, steps, raised)]
    data = glb(TICK, clips, root_motion="moving")
    with pytest.raises(ValueError, match="clip: expected one animation 'raise', got 2; rename them"):
        read(tmp_path, data, clip="raise")
    assert read(tmp_path, data, clip="walk")[0].loops
    with pytest.raises(ValueError, match="clip: expected one animation 'raise', got 2; rename them"):
        read(tmp_path, glb(TICK, clips[::2], root_motion="moving"))
