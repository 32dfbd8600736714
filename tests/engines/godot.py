"""Open clips in Godot 3, headless: a skeleton, every clip under its name, and those called loop do loop.

python tests/engines/godot.py FOLDER [GODOT]
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

LONGEST = 60  # s, for an import
SCRIPT = """\
extends SceneTree
func _init():
	var scene = load("res://body.glb").instance()
	var player = scene.get_node("AnimationPlayer")
	for name in player.get_animation_list():
		var animation = player.get_animation(name)
		print("clip ", name, " ", animation.loop, " ", animation.length)
	for child in scene.get_children():
		if child is Skeleton:
			for bone in range(child.get_bone_count()):
				print("bone ", child.get_bone_name(bone))
	quit()
"""


def main(folder: str, godot: str = "godot3-server") -> None:
    """Check every skin of a folder."""
    files = sorted(pathlib.Path(folder).glob("*-skin.glb"))
    assert files
    for path in files:
        truth = np.load(path.with_name(path.name.replace("-skin.glb", ".npz")))
        names = [name for name in truth.files if name != "parts"]
        told = opened(path, godot)
        clips = dict(re.findall(r"^clip (\S+) (\w+) ", told, re.MULTILINE))
        assert clips == {name: "True" if name.endswith("loop") else "False" for name in names}, told
        bones = re.findall(r"^bone (\S+)", told, re.MULTILINE)
        swinging = json.loads(path.with_suffix(".clips.json").read_text())["swinging_bones"]
        expected_bones = [name.replace("_", "") for name in ("root", *truth["parts"], *swinging)]
        # Godot 3 writes l1_foot as l_1_foot.
        assert sorted(bone.replace("_", "") for bone in bones) == sorted(expected_bones), told
        print(f"{path.name}: {len(clips)} clips, {len(bones)} bones")


def opened(path: pathlib.Path, godot: str) -> str:
    """Return what the script prints of a file that Godot has imported."""
    with tempfile.TemporaryDirectory() as name:
        project = pathlib.Path(name)
        (project / "project.godot").write_text("config_version=4\n")
        (project / "script.gd").write_text(SCRIPT)
        shutil.copy(path, project / "body.glb")
        start = [godot, "--path", project]
        # The editor imports what it finds; headless, it does not always quit when it is told to.
        editor = subprocess.Popen([*start, "--editor"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            for _ in range(LONGEST):
                time.sleep(1.0)
                if list(project.glob(".import/body.glb-*.md5")):  # which is written last
                    break
        finally:
            editor.kill()
            editor.wait()
        done = subprocess.run([*start, "--script", "script.gd"], capture_output=True, text=True, timeout=LONGEST)
    return done.stdout


if __name__ == "__main__":
    main(*sys.argv[1:])
