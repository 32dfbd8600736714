"""Writes clips as FBX, BVH or a file of Blender, out of a .glb of `arc-suite animate` and the .clips.json next to it.

Needs Blender's `bpy` in an environment of its own, for Python 3.11:
  tools/ensure_venv.sh .venv-blender && .venv-blender/bin/python -m pip install bpy==5.0.1
  .venv-blender/bin/python tools/to_fbx.py queen.glb queen.fbx

The extension of the second file says what is written:
  .fbx    all clips as takes under their names, at scale 1, without leaf bones; foot contacts are a property
  .bvh    a file for each clip, such as queen_walk_loop.bvh
  .blend  actions that repeat where clips loop, with frame ranges and markers at foot contacts, and one curve a joint
"""

import argparse
import contextlib
import io
import json
import math
import pathlib
import re
import sys
import tempfile
from typing import Any

try:
    import bpy
except ImportError as error:
    sys.exit(f"to_fbx: {error}: pip install bpy==5.0.1, in an environment of its own")
import numpy as np

FPS = 60  # clips last whole frames at this rate
LARGEST = 64 * 2**20  # bytes of a .clips.json
NUDGE = 1e-7  # m
ROUNDED = 1e-3  # frames, by which times that the file rounds may miss a frame
HINGED = 1e-4  # by which a quaternion may turn about other axes than that of a hinge
ARMATURE = "Armature"  # a name that importers of engines leave out of the skeleton

CONTACTS = "foot_contacts"  # the property of the armature

_ROTATION = re.compile(r'pose\.bones\["(.+)"\]\.rotation_quaternion')


def main(arguments: list[str] | None = None) -> None:
    """Convert a file, or exit with one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("glb", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    given = parser.parse_args(arguments)
    try:
        for path in converted(given.glb, given.output):
            print(f"wrote {path}")
    except OSError as error:
        sys.exit(f"to_fbx: {error.filename}: {(error.strerror or 'cannot be read').lower()}")
    except ValueError as error:
        sys.exit(f"to_fbx: {error}")


def converted(glb: pathlib.Path, output: pathlib.Path) -> list[pathlib.Path]:
    """Convert a file, and return what was written.

    Raises:
        OSError: a file cannot be read or written.
        ValueError: a file is not what `arc-suite animate` writes, or the extension of the output is unknown.
    """
    write = WRITERS.get(output.suffix.lower())
    if write is None:
        raise ValueError(f"{output}: expected one of {', '.join(WRITERS)}")
    if not output.absolute().parent.is_dir():
        raise ValueError(f"cannot write {output}: no such folder")
    if glb.suffix.lower() != ".glb":
        raise ValueError(f"{glb}: expected a .glb of arc-suite animate")
    glb.open("rb").close()  # the error of a missing file is that of the file that was named
    clips = sidecar(glb.with_suffix(".clips.json"))
    with tempfile.TemporaryDirectory(dir=output.absolute().parent) as folder:
        silent = io.StringIO()
        try:  # Blender's importers and exporters tell their progress, and the tracebacks of what they cannot read
            with contextlib.redirect_stdout(silent), contextlib.redirect_stderr(silent):
                armature = opened(glb)
                put_on_frames(armature)
                annotate(armature, clips)
                one_curve_a_joint(armature)
                write(armature, pathlib.Path(folder) / output.name)
        except (RuntimeError, LookupError, TypeError):
            raise ValueError(f"{glb}: Blender cannot convert it") from None
        return [path.replace(output.parent / path.name) for path in sorted(pathlib.Path(folder).iterdir())]


def sidecar(path: pathlib.Path) -> dict[str, dict[str, Any]]:
    """Return the metadata of clips by name of the animation.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not what `arc-suite animate` writes.
    """
    if path.stat().st_size > LARGEST:
        raise ValueError(f"{path}: expected at most {LARGEST} bytes")
    try:
        clips = json.loads(path.read_text(encoding="utf-8"))["clips"]
        for clip in clips.values():
            bool(clip["loops"])
            for contact in clip["foot_contacts"]:
                _marker(contact)
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        raise ValueError(f"{path}: expected the metadata that arc-suite animate writes") from None
    return clips


def opened(path: pathlib.Path) -> bpy.types.Object:
    """Return the armature of a file, in a scene of its own at 60 frames a second.

    Raises:
        RuntimeError: Blender cannot import it.
        ValueError: it has no armature.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = FPS
    bpy.ops.import_scene.gltf(filepath=str(path), disable_bone_shape=True)
    armatures = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    if len(armatures) != 1:
        raise ValueError(f"{path}: expected one skeleton, got {len(armatures)}; export with --rig=skin")
    armatures[0].name = ARMATURE
    for mesh in armatures[0].children:  # the armature had its name
        mesh.name = mesh.data.name
    _shorten_feet(armatures[0])
    return armatures[0]


def put_on_frames(armature: bpy.types.Object) -> None:
    """Put keys and ends of clips on the frames that they miss: what ends a little early would lose its last frame."""
    for action in bpy.data.actions:
        for curve in (curve for bag in _bags(action) for curve in bag.fcurves):
            points = np.empty((len(curve.keyframe_points), 2), np.float32)
            curve.keyframe_points.foreach_get("co", points.ravel())
            near = abs(points[:, 0] - points[:, 0].round()) < ROUNDED
            points[near, 0] = points[near, 0].round()
            curve.keyframe_points.foreach_set("co", points.ravel())
            curve.update()
    for track in armature.animation_data.nla_tracks:
        for strip in track.strips:
            strip.action_frame_start, strip.action_frame_end = strip.action.curve_frame_range
            strip.scale = 1.0
            strip.frame_end = strip.frame_start + strip.action_frame_end - strip.action_frame_start


def annotate(armature: bpy.types.Object, clips: dict[str, dict[str, Any]]) -> None:
    """Give actions what Blender's importer drops: whether they repeat, their frames, and markers at foot contacts.

    Takes of FBX have no markers: there, a property of the armature has them as JSON, pairs of a name and a frame.
    """
    markers = {name: [_marker(contact) for contact in clip["foot_contacts"]] for name, clip in clips.items()}
    armature[CONTACTS] = json.dumps(markers)
    for action in bpy.data.actions:
        if action.name not in clips:
            continue
        action.use_frame_range = True
        action.frame_start, action.frame_end = action.curve_frame_range
        action.use_cyclic = bool(clips[action.name]["loops"])
        for name, frame in markers[action.name]:
            action.pose_markers.new(name).frame = frame


def one_curve_a_joint(armature: bpy.types.Object) -> None:
    """Make one Euler angle of the four curves of each hinge, and lock what the joint does not turn about."""
    for bone, actions in _rotations().items():
        keys = [_keys(four) for _, four in actions]
        largest = np.max([abs(quaternions[:, 1:]).max(axis=0) for _, quaternions in keys], axis=0)
        axis = int(largest.argmax())
        if np.delete(largest, axis).max() > HINGED:
            continue
        pose = armature.pose.bones[bone]
        pose.rotation_mode = "XYZ"
        pose.lock_rotation = [other != axis for other in range(3)]
        pose.lock_location = pose.lock_scale = (True,) * 3
        for (bag, four), (frames, quaternions) in zip(actions, keys, strict=True):
            half = np.unwrap(np.arctan2(quaternions[:, 1 + axis], quaternions[:, 0]), period=np.pi)
            for curve in four:
                bag.fcurves.remove(curve)
            _curve(bag, bone, axis, frames, 2.0 * half)


def _bags(action: bpy.types.Action) -> list:
    """Return the bags of an action's curves."""
    return [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]


def _rotations() -> dict[str, list[tuple[Any, list]]]:
    """Return by bones that only turn, for each action, the bag of its curves and the four curves of the quaternion."""
    found: dict[str, list[tuple[Any, list]]] = {}
    moving = set()
    for action in bpy.data.actions:
        for bag in _bags(action):
            own: dict[str, list] = {}
            for curve in bag.fcurves:
                if curve.data_path.endswith("].location"):
                    moving.add(curve.data_path.split('"')[1])
                elif match := _ROTATION.fullmatch(curve.data_path):
                    own.setdefault(match[1], []).append(curve)
            for bone, four in own.items():
                found.setdefault(bone, []).append((bag, sorted(four, key=lambda curve: curve.array_index)))
    return {bone: actions for bone, actions in found.items() if bone not in moving}


def write_fbx(armature: bpy.types.Object, path: pathlib.Path) -> None:
    """Write all clips as takes of one FBX file."""
    _part(armature)
    armature.animation_data.action = None
    for track in armature.animation_data.nla_tracks:
        track.mute = False
    bpy.ops.export_scene.fbx(
        filepath=str(path),
        object_types={"ARMATURE", "MESH"},
        apply_scale_options="FBX_SCALE_ALL",
        add_leaf_bones=False,
        use_custom_props=True,
        bake_anim_use_nla_strips=True,  # whose names are those of clips
        bake_anim_use_all_actions=False,
        bake_anim_simplify_factor=0.0,
    )


def write_bvh(armature: bpy.types.Object, path: pathlib.Path) -> None:
    """Write a BVH file for each clip, with y up, as readers expect."""
    bpy.context.view_layer.objects.active = armature
    armature.rotation_mode = "XYZ"
    armature.rotation_euler.x = -0.5 * math.pi
    bpy.ops.object.select_all(action="DESELECT")
    armature.select_set(True)
    bpy.ops.object.transform_apply(location=False, rotation=True, scale=False)
    for action in bpy.data.actions:
        armature.animation_data.action = action
        armature.animation_data.action_slot = action.slots[0]
        first, last = (int(frame) for frame in action.frame_range)
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = first, last
        own = path.with_name(f"{path.stem}_{action.name}.bvh")
        bpy.ops.export_anim.bvh(filepath=str(own), frame_start=first, frame_end=last)


def write_blend(armature: bpy.types.Object, path: pathlib.Path) -> None:
    """Write a file of Blender."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


WRITERS = {".fbx": write_fbx, ".bvh": write_bvh, ".blend": write_blend}


def _marker(contact: dict[str, Any]) -> tuple[str, int]:
    """Return the name and the frame of a marker."""
    return f"{contact['foot']} {contact['event']}", round(FPS * float(contact["time"]))


def _shorten_feet(armature: bpy.types.Object) -> None:
    """Let the bones of feet end near the sole; Blender's importer makes them as long as the link above."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        if not bone.children and bone.head.z > 0.0:
            bone.length = min(bone.length, bone.head.z)
    bpy.ops.object.mode_set(mode="OBJECT")


def _part(armature: bpy.types.Object) -> None:
    """Move the torso off the end of the root's bone: Blender's importer would tie it to there and drop its path."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        if bone.parent is not None and bone.parent.parent is None:
            bone.head.x, bone.tail.x = bone.head.x + NUDGE, bone.tail.x + NUDGE
    bpy.ops.object.mode_set(mode="OBJECT")


def _keys(four: list) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames (keys,) and the quaternions (keys, 4), w first, of four curves."""
    values = np.empty((4, 2 * len(four[0].keyframe_points)), np.float32)
    for curve, row in zip(four, values, strict=True):
        curve.keyframe_points.foreach_get("co", row)
    return values[0, ::2].astype(float), values[:, 1::2].T.astype(float)


def _curve(bag, bone: str, axis: int, frames: np.ndarray, angles: np.ndarray) -> None:
    """Add a curve with straight lines between its keys."""
    curve = bag.fcurves.new(f'pose.bones["{bone}"].rotation_euler', index=axis, group_name=bone)
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.stack([frames, angles], axis=-1).astype(np.float32).ravel())
    for key in curve.keyframe_points:
        key.interpolation = "LINEAR"
    curve.update()


if __name__ == "__main__":
    main()
