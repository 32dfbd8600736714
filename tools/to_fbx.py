"""Writes clips as FBX, BVH or a file of Blender, out of a .glb of `arc-suite animate` and the .clips.json next to it.

Needs Blender's `bpy` in an environment of its own, for Python 3.11:
  tools/ensure_venv.sh .venv-blender && .venv-blender/bin/python -m pip install bpy==5.0.1
  .venv-blender/bin/python tools/to_fbx.py queen.glb queen.fbx
Blender 5 itself may run the program, too, which nobody has tried:
  blender --background --python tools/to_fbx.py -- queen.glb queen.fbx

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
from typing import Any, NamedTuple
from unittest import mock

try:
    import bpy
    from io_scene_fbx import fbx_utils  # of Blender, next to bpy
except ImportError as error:
    sys.exit(f"to_fbx: {error}: pip install bpy==5.0.1, in an environment of its own")
import numpy as np

FPS = 60  # clips last whole frames at this rate
MAX_METADATA_BYTES = 64 * 2**20  # of a .clips.json
TORSO_SHIFT = 1e-7  # m
MAX_ROUNDING_ERROR = 1e-3  # frames, of a time that the file rounds
MAX_CONSTANT_CHANGE = 1e-5  # degrees, m, or of a scale, of a curve that is taken for constant
FRAME_AT_REST = -1  # before all clips
ROTATION = "R"  # FBX's name of the node of a rotation
MAX_OFF_AXIS = 1e-4  # components of a hinge's quaternion about other axes
ARMATURE_NAME = "Armature"  # importers of engines leave a bone of this name out of the skeleton
CONTACTS_PROPERTY = "foot_contacts"  # of the armature

_ROTATION_PATH = re.compile(r'pose\.bones\["(.+)"\]\.rotation_quaternion')


def main(arguments: list[str] | None = None) -> None:
    """Convert a file, or exit with one line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("glb", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parsed = parser.parse_args(program_arguments(sys.argv) if arguments is None else arguments)
    try:
        for path in convert(parsed.glb, parsed.output):
            print(f"wrote {path}")
    except OSError as error:
        sys.exit(f"to_fbx: {error.filename}: {(error.strerror or 'cannot be read').lower()}")
    except ValueError as error:
        sys.exit(f"to_fbx: {error}")


def program_arguments(command: list[str]) -> list[str]:
    """Return the arguments of this program in a command, which Blender's arguments and -- may precede."""
    return command[command.index("--") + 1 :] if "--" in command else command[1:]


def convert(glb: pathlib.Path, output: pathlib.Path) -> list[pathlib.Path]:
    """Convert a file, and return the paths of the files that it wrote.

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
    glb.open("rb").close()  # raises an error with the name of this file, if it is missing
    clips = read_metadata(glb.with_suffix(".clips.json"))
    with tempfile.TemporaryDirectory(dir=output.absolute().parent) as folder:
        hidden_output = io.StringIO()  # Blender prints its progress, and tracebacks of what it cannot read
        try:
            with contextlib.redirect_stdout(hidden_output), contextlib.redirect_stderr(hidden_output):
                armature = import_armature(glb)
                put_on_frames(armature)
                annotate(armature, clips)
                join_rotation_curves(armature)
                write(armature, pathlib.Path(folder) / output.name)
        except (RuntimeError, LookupError, TypeError):
            raise ValueError(f"{glb}: Blender cannot convert it") from None
        return [path.replace(output.parent / path.name) for path in sorted(pathlib.Path(folder).iterdir())]


def read_metadata(path: pathlib.Path) -> dict[str, dict[str, Any]]:
    """Return the metadata of clips by name of the animation.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not what `arc-suite animate` writes.
    """
    if path.stat().st_size > MAX_METADATA_BYTES:
        raise ValueError(f"{path}: expected at most {MAX_METADATA_BYTES} bytes")
    try:
        clips = json.loads(path.read_text(encoding="utf-8"))["clips"]
        for clip in clips.values():  # raises an error if a field is missing or has another type
            bool(clip["loops"])
            for contact in clip["foot_contacts"]:
                _marker(contact)
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        raise ValueError(f"{path}: expected the metadata that arc-suite animate writes") from None
    return clips


def import_armature(path: pathlib.Path) -> bpy.types.Object:
    """Import a file into a new scene at 60 frames a second, and return its armature.

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
    armatures[0].name = ARMATURE_NAME
    for mesh in armatures[0].children:  # its name was taken until now
        mesh.name = mesh.data.name
    _shorten_feet(armatures[0])
    return armatures[0]


def put_on_frames(armature: bpy.types.Object) -> None:
    """Round keys and ends of clips to whole frames; a clip that ends a little early would lose its last frame."""
    for action in bpy.data.actions:
        for bag in _curve_bags(action):
            for curve in bag.fcurves:
                _round_keys(curve)
    for track in armature.animation_data.nla_tracks:
        for strip in track.strips:
            strip.action_frame_start, strip.action_frame_end = strip.action.curve_frame_range
            strip.scale = 1.0
            strip.frame_end = strip.frame_start + strip.action_frame_end - strip.action_frame_start


def annotate(armature: bpy.types.Object, clips: dict[str, dict[str, Any]]) -> None:
    """Give actions what Blender's importer drops: whether they repeat, their frames, and markers at foot contacts.

    Takes of FBX have no markers. A property of the armature holds them as JSON: pairs of a name and a frame by clip.
    """
    markers = {name: [_marker(contact) for contact in clip["foot_contacts"]] for name, clip in clips.items()}
    armature[CONTACTS_PROPERTY] = json.dumps(markers)
    for action in bpy.data.actions:
        if action.name not in clips:
            continue
        action.use_frame_range = True
        action.frame_start, action.frame_end = action.curve_frame_range
        action.use_cyclic = bool(clips[action.name]["loops"])
        for name, frame in markers[action.name]:
            action.pose_markers.new(name).frame = frame


def join_rotation_curves(armature: bpy.types.Object) -> None:
    """Replace the four curves of each hinge's quaternion by one of its angle, and lock its other axes."""
    for bone, rotations in _find_rotations().items():
        keys = [_read_keys(rotation.curves) for rotation in rotations]
        sizes = np.max([abs(quaternions[:, 1:]).max(axis=0) for _, quaternions in keys], axis=0)
        axis = int(sizes.argmax())
        if np.delete(sizes, axis).max() > MAX_OFF_AXIS:
            continue
        pose_bone = armature.pose.bones[bone]
        pose_bone.rotation_mode = "XYZ"
        pose_bone.lock_rotation = [number != axis for number in range(3)]
        pose_bone.lock_location = (True, True, True)
        pose_bone.lock_scale = (True, True, True)
        for rotation, (frames, quaternions) in zip(rotations, keys, strict=True):
            half_angles = np.unwrap(np.arctan2(quaternions[:, 1 + axis], quaternions[:, 0]), period=np.pi)
            for curve in rotation.curves:
                rotation.bag.fcurves.remove(curve)
            _add_curve(rotation.bag, bone, axis, frames, 2.0 * half_angles)


class Rotation(NamedTuple):
    """The rotation of a bone in an action."""

    bag: Any  # that holds the curves of the action
    curves: list  # the four curves of the quaternion, w first


def _curve_bags(action: bpy.types.Action) -> list:
    """Return the bags of an action's curves."""
    return [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]


def _round_keys(curve) -> None:
    """Put keys of a curve that nearly are on a frame exactly there."""
    points = np.empty((len(curve.keyframe_points), 2), np.float32)
    curve.keyframe_points.foreach_get("co", points.ravel())
    is_near = abs(points[:, 0] - points[:, 0].round()) < MAX_ROUNDING_ERROR
    points[is_near, 0] = points[is_near, 0].round()
    curve.keyframe_points.foreach_set("co", points.ravel())
    curve.update()


def _find_rotations() -> dict[str, list[Rotation]]:
    """Return the rotations in all actions, by name of the bone, of bones that only turn."""
    rotations: dict[str, list[Rotation]] = {}
    bones_that_move = set()
    for action in bpy.data.actions:
        for bag in _curve_bags(action):
            curves_by_bone: dict[str, list] = {}
            for curve in bag.fcurves:
                if curve.data_path.endswith("].location"):
                    bones_that_move.add(curve.data_path.split('"')[1])
                elif match := _ROTATION_PATH.fullmatch(curve.data_path):
                    curves_by_bone.setdefault(match[1], []).append(curve)
            for bone, curves in curves_by_bone.items():
                rotation = Rotation(bag, sorted(curves, key=lambda curve: curve.array_index))
                rotations.setdefault(bone, []).append(rotation)
    return {bone: of_bone for bone, of_bone in rotations.items() if bone not in bones_that_move}


def write_fbx(armature: bpy.types.Object, path: pathlib.Path) -> None:
    """Write all clips as takes of one FBX file."""
    _shift_torso(armature)
    armature.animation_data.action = None
    for track in armature.animation_data.nla_tracks:
        track.mute = False
        for strip in track.strips:
            strip.extrapolation = "NOTHING"
    bpy.context.scene.frame_set(FRAME_AT_REST)  # bones without curves then stay as in the bind pose
    with mock.patch.object(fbx_utils.AnimationCurveNodeWrapper, "simplify", _leave_out_constant_curves):
        bpy.ops.export_scene.fbx(
            filepath=str(path),
            object_types={"ARMATURE", "MESH"},
            apply_scale_options="FBX_SCALE_ALL",
            add_leaf_bones=False,
            use_custom_props=True,
            bake_anim_use_nla_strips=True,  # whose names are those of clips
            bake_anim_use_all_actions=False,
        )


def _leave_out_constant_curves(node: Any, *_: Any) -> None:
    """Choose the keys of a node's curves: all of a curve that changes, the first and the last of one that does not.

    A node that stays as in the bind pose has no curves, except a rotation: some importers need a curve of each bone.
    Blender's exporter would key nine curves of each bone at each frame.
    """
    keys = node._frame_write_mask_array  # (curves, frames), what is written
    values = node._frame_values_array
    changes = np.ptp(values, axis=1) > MAX_CONSTANT_CHANGE
    moves = changes.any() or abs(values[:, 0] - node.default_values).max() > MAX_CONSTANT_CHANGE
    keys[:] = changes[:, None]
    if moves or ROTATION in node.fbx_gname:
        keys[:, [0, -1]] = True


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
        bpy.context.scene.frame_start = first
        bpy.context.scene.frame_end = last
        clip_path = path.with_name(f"{path.stem}_{action.name}.bvh")
        bpy.ops.export_anim.bvh(filepath=str(clip_path), frame_start=first, frame_end=last)


def write_blend(armature: bpy.types.Object, path: pathlib.Path) -> None:
    """Write a file of Blender."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)


WRITERS = {".fbx": write_fbx, ".bvh": write_bvh, ".blend": write_blend}


def _marker(contact: dict[str, Any]) -> tuple[str, int]:
    """Return the name and the frame of the marker of a foot contact."""
    return f"{contact['foot']} {contact['event']}", round(FPS * float(contact["time"]))


def _shorten_feet(armature: bpy.types.Object) -> None:
    """Let the bones of feet end at the sole; Blender's importer makes them as long as the link above."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        if not bone.children and bone.head.z > 0.0:
            bone.length = min(bone.length, bone.head.z)
    bpy.ops.object.mode_set(mode="OBJECT")


def _shift_torso(armature: bpy.types.Object) -> None:
    """Move the torso off the end of the root's bone; Blender's importer would attach it there and drop its path."""
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        if bone.parent is not None and bone.parent.parent is None:
            bone.head.x += TORSO_SHIFT
            bone.tail.x += TORSO_SHIFT
    bpy.ops.object.mode_set(mode="OBJECT")


def _read_keys(curves: list) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames (keys,) and the quaternions (keys, 4), w first, of four curves."""
    # Frame and value of each key in turn, as Blender writes them.
    coordinates = np.empty((4, 2 * len(curves[0].keyframe_points)), np.float32)
    for curve, row in zip(curves, coordinates, strict=True):
        curve.keyframe_points.foreach_get("co", row)
    frames = coordinates[0, ::2].astype(float)
    quaternions = coordinates[:, 1::2].T.astype(float)
    return frames, quaternions


def _add_curve(bag, bone: str, axis: int, frames: np.ndarray, angles: np.ndarray) -> None:
    """Add a curve of an Euler angle, rad, with straight lines between its keys."""
    curve = bag.fcurves.new(f'pose.bones["{bone}"].rotation_euler', index=axis, group_name=bone)
    curve.keyframe_points.add(len(frames))
    curve.keyframe_points.foreach_set("co", np.stack([frames, angles], axis=-1).astype(np.float32).ravel())
    for key in curve.keyframe_points:
        key.interpolation = "LINEAR"
    curve.update()


if __name__ == "__main__":
    main()
