"""Open clips in Blender: one armature, an action for each clip, every bone where MuJoCo has the part.

python tests/engines/blender.py FOLDER, in an environment with Blender's `bpy`
"""

import pathlib
import sys

import bpy
import numpy as np

NEAR = 1e-5  # m


def main(folder: str) -> None:
    """Check every skin of a folder."""
    files = sorted(pathlib.Path(folder).glob("*-skin.glb"))
    assert files
    for path in files:
        worst, actions = check(path)
        print(f"{path.name}: {actions} actions, bones within {worst:.1e} m")


def check(path: pathlib.Path) -> tuple[float, int]:
    """Return how far the farthest bone is from where it should be, m, and the number of actions."""
    truth = dict(np.load(path.with_name(path.name.replace("-skin.glb", ".npz"))))
    parts = truth.pop("parts").tolist()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = 60  # frames of the file then fall on frames of the scene
    bpy.ops.import_scene.gltf(filepath=str(path))
    (armature,) = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    assert sorted(bone.name for bone in armature.data.bones) == sorted(["root", *parts])
    actions = [action.name for action in bpy.data.actions]
    assert sorted(actions) == sorted(truth), actions
    worst = 0.0
    for name, places in truth.items():
        for track in armature.animation_data.nla_tracks:
            track.mute = True
        armature.animation_data.action = bpy.data.actions[name]
        armature.animation_data.action_slot = armature.animation_data.action.slots[0]
        first, last = bpy.data.actions[name].frame_range
        for frame in range(0, len(places), 5):
            time = first + (last - first) * frame / (len(places) - 1)
            scene.frame_set(int(time), subframe=time % 1.0)
            for bone, (x, y, z) in zip(parts, places[frame], strict=True):
                head = armature.matrix_world @ armature.pose.bones[bone].head
                miss = np.linalg.norm(np.array(head) - (x, -z, y))  # Blender's z is up, and its -y ahead
                worst = max(worst, float(miss))
                assert miss < NEAR, f"{path.name}, {name}, frame {frame}, {bone}: {miss} m"
    return worst, len(actions)


if __name__ == "__main__":
    main(*sys.argv[1:])
