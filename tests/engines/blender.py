"""Open clips in Blender: one armature, an action for each clip, every bone where MuJoCo has the part, in its limb.

python tests/engines/blender.py FOLDER, in an environment with Blender's `bpy`

FBX is written by tools/to_fbx.py and read back; of two bodies, BVH and Blender's own file, too.
"""

import json
import pathlib
import sys
import tempfile

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
import to_fbx  # noqa: E402

NEAR = 1e-5  # m
MOST_BYTES = 3.0  # of an FBX file, times those of its .glb
STRAIGHT = 1e-6  # of a cosine: a hinge is an axis of its bone
BOUND = 0.01  # standing heights of the lowest point from the ground
CONVERTED = ("queen", "spider")


def main(folder: str) -> None:
    """Check every skin of a folder."""
    files = sorted(pathlib.Path(folder).glob("*-skin.glb"))
    assert files
    refusals(files[0])
    command_of_blender = ["blender", "--background", "--python", "tools/to_fbx.py", "--", "a.glb", "a.fbx"]
    assert to_fbx.program_arguments(command_of_blender) == ["a.glb", "a.fbx"]
    for path in files:
        name = path.name.removesuffix("-skin.glb")
        truth = dict(np.load(path.with_name(f"{name}.npz")))
        parts = truth.pop("parts").tolist()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = 60  # frames of the file then fall on frames of the scene
        bpy.ops.import_scene.gltf(filepath=str(path))
        armature = only("ARMATURE")
        assert sorted(bone.name for bone in armature.data.bones) == sorted(["root", *parts, *swinging_bones(path)])
        told = f"{name}: {len(truth)} actions, bones within {posed(armature, truth, parts):.1e} m, "
        told += limbs(armature, parts, **np.load(path.with_name(f"{name}.bound.npz")))
        print(f"{told}, {converted(path, truth, parts, name in CONVERTED)}", flush=True)


def swinging_bones(path: pathlib.Path) -> list[str]:
    """Return the names of bones of ornaments, which no part of MuJoCo has."""
    return list(json.loads(path.with_suffix(".clips.json").read_text())["swinging_bones"])


def refusals(path: pathlib.Path) -> None:
    """Assert that tools/to_fbx.py names the file that is wrong."""
    wrong = (
        ("missing.glb", "a.fbx", "missing.glb"),
        (path.with_suffix(".clips.json"), "a.fbx", "expected a .glb of arc-suite animate"),
        (path, "a.obj", "expected one of .fbx, .bvh, .blend"),
        (path, "missing/a.fbx", "no such folder"),
    )
    for glb, output, message in wrong:
        try:
            to_fbx.convert(pathlib.Path(glb), pathlib.Path(output))
        except (ValueError, OSError) as error:
            assert message in str(error), error
        else:
            raise AssertionError(message)


def only(kind: str) -> bpy.types.Object:
    """Return the one object of a kind that deforms or is deformed."""
    (found,) = [
        thing for thing in bpy.data.objects if thing.type == kind and (kind == "ARMATURE" or thing.parent is not None)
    ]
    return found


def seen(place) -> np.ndarray:
    """Return a vector (3,) in the axes of glTF in Blender's, whose z is up, and -y ahead."""
    x, y, z = place
    return np.array((x, -z, y))


def posed(armature, truth, parts) -> float:
    """Return how far the farthest bone is from where it should be in all actions, m."""
    actions = {action.name.split("|")[-1]: action for action in bpy.data.actions}
    assert sorted(actions) == sorted(truth), list(actions)
    worst = 0.0
    for track in armature.animation_data.nla_tracks:
        track.mute = True
    for name, places in truth.items():
        armature.animation_data.action = action = actions[name]
        armature.animation_data.action_slot = action.slots[0]
        first, last = action.frame_range
        assert abs(last - first - len(places) + 1) < 1e-3, (name, first, last, len(places))
        for frame in (*range(0, len(places), 5), len(places) - 1):
            bpy.context.scene.frame_set(round(first) + frame)
            heads = [armature.matrix_world @ armature.pose.bones[part].head for part in parts]
            worst = max(
                worst, np.linalg.norm(np.array(heads) - [seen(place) for place in places[frame]], axis=-1).max()
            )
            assert worst < NEAR, f"{name}, frame {frame}: {worst} m"
    return worst


def limbs(armature, parts, hinges, height) -> str:
    """Assert that hinges are axes of bones, that bones point along their links, and that the mesh is on the ground."""
    along, missed = 0, 0.0
    for part, hinge in zip(parts, hinges, strict=True):
        if np.isnan(hinge).any():
            continue
        bone = armature.data.bones[part]
        cosines = abs(seen(hinge) @ np.array(bone.matrix_local)[:3, :3])
        assert cosines.max() > 1.0 - STRAIGHT, f"{part}: {cosines}"
        (child,) = bone.children
        link = np.array(child.head_local - bone.head_local)
        length = np.linalg.norm(link)
        slope = np.arccos(min(abs(seen(hinge) @ link) / length, 1.0))
        off = min(slope, 0.5 * np.pi - slope)  # what the hinge costs
        miss = np.linalg.norm(np.array(bone.tail_local - child.head_local))
        assert miss <= 2.0 * length * np.sin(0.5 * off) + NEAR, f"{part}: {miss} m from the child"
        if off < np.radians(1.0):
            along, missed = along + 1, max(missed, miss / length)
    mesh = only("MESH")
    low = min((mesh.matrix_world @ vertex.co).z for vertex in mesh.data.vertices) / height
    assert abs(low) < BOUND, low
    joints = int((~np.isnan(hinges[:, 0])).sum())
    return (
        f"{joints} hinges along axes, {along} tails at the child within {missed:.1e} of the link, lowest at {low:.4f} h"
    )


def converted(path: pathlib.Path, truth, parts, wholly: bool) -> str:
    """Read back what tools/to_fbx.py makes of a file: FBX alone, or all that it writes."""
    clips = json.loads(path.with_suffix(".clips.json").read_text())["clips"]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for kind in to_fbx.WRITERS if wholly else (".fbx",):
            to_fbx.convert(path, folder / f"body{kind}")
        larger = (folder / "body.fbx").stat().st_size / path.stat().st_size
        assert larger < MOST_BYTES, larger
        markers = {
            name: [[f"{each['foot']} {each['event']}", round(60.0 * each["time"])] for each in clip["foot_contacts"]]
            for name, clip in clips.items()
        }
        told = [f".fbx {larger:.1f} times as large"]
        for kind in (".fbx", ".blend") if wholly else (".fbx",):
            miss = read(folder / f"body{kind}", truth, parts, swinging_bones(path))
            told.append(f"{kind} within {miss:.1e} m")
            assert json.loads(only("ARMATURE")["foot_contacts"]) == markers
        if not wholly:
            return ", ".join(told)
        marked(clips, markers)
        walk = "walk_loop"
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_anim.bvh(filepath=str(folder / f"body_{walk}.bvh"), update_scene_fps=True)
        bpy.data.actions[0].name = walk
        told.append(f".bvh within {posed(only('ARMATURE'), {walk: truth[walk]}, parts):.1e} m")
    return ", ".join(told)


def read(path: pathlib.Path, truth, parts, swinging) -> float:
    """Open a file, and return how far the farthest bone is from where it should be."""
    if path.suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = 60
        bpy.ops.import_scene.fbx(filepath=str(path))
    armature, mesh = only("ARMATURE"), only("MESH")
    assert len(bpy.data.objects) == 2
    others = [bone.name for bone in armature.data.bones if bone.name not in parts]
    assert sorted(others) == sorted(["root", *swinging])
    np.testing.assert_allclose([*armature.matrix_world.to_scale(), *mesh.matrix_world.to_scale()], 1.0, atol=1e-6)
    return posed(armature, truth, parts)


def marked(clips, markers) -> None:
    """Assert that actions of the open file repeat and have markers as the metadata says, and one curve a joint."""
    for action in bpy.data.actions:
        clip = clips[action.name]
        assert action.use_cyclic == clip["loops"]
        assert action.use_frame_range and action.frame_end - action.frame_start == round(60.0 * clip["seconds"])
        assert sorted([each.name, each.frame] for each in action.pose_markers) == sorted(markers[action.name])
        curves = [curve.data_path for curve in action.layers[0].strips[0].channelbags[0].fcurves]
        for pose in bpy.data.objects[to_fbx.ARMATURE_NAME].pose.bones:
            if pose.rotation_mode == "XYZ":
                own = [curve for curve in curves if curve.startswith(f'pose.bones["{pose.name}"]')]
                assert own == [f'pose.bones["{pose.name}"].rotation_euler'], own


if __name__ == "__main__":
    main(*sys.argv[1:])
