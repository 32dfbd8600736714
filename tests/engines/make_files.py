"""Write the clips of many bodies, which real programs then open: `make check-glb`, `check-blender`, `check-godot`.

python tests/engines/make_files.py FOLDER [few|bones]

Without a word: robots, examples, 100 random and the imported bodies, each also with few triangles, places in a texture
and few keys. few: the robots. bones: also an example with eight legs, and idle of the other examples and of 30 random
bodies.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np
from tqdm import tqdm

from arc_suite.animation import clips as export
from arc_suite.animation.clips.catalog import CLIPS
from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.importing import import_robot
from arc_suite.robots import ROBOTS, spec_files
from arc_suite.simulation.model import compile_model

OTHERS = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"  # files of robots that are imported
FEW = ("walk", "turn_left", "stop", "idle")
WHOLE = "queen"  # has all clips
EIGHT = "spider"  # has eight legs
UNSEEN = range(9_000_000, 9_000_030)  # seeds of random bodies that nothing else looks at


def chosen(kind: str) -> dict:
    """Return bodies by name, each with the names of its clips."""
    examples = {name: spec_files.load_body(name) for name in spec_files.EXAMPLES}
    found = {name: (body, tuple(CLIPS) if name == WHOLE else FEW) for name, body in ROBOTS.items()}
    if kind == "bones":
        others = examples | {f"random_{seed}": generator.random_body(seed) for seed in UNSEEN}
        found |= {name: (body, FEW if name == EIGHT else ("idle",)) for name, body in others.items()}
    elif not kind:
        found |= {name: (body, export.DEFAULT) for name, body in examples.items()}
        found |= {f"random_{seed}": (generator.random_body(seed), FEW) for seed in range(100)}
        found |= {path.stem: (import_robot(path).body, FEW) for path in sorted(OTHERS.iterdir())}
    return found


def main(folder: str, kind: str = "") -> None:
    """Write FOLDER/<body>-<rig>.glb, .clips.json, .npz and .bound.npz, what MuJoCo has; delete old ones."""
    out = pathlib.Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    for old in [*out.glob("*.glb"), *out.glob("*.json"), *out.glob("*.npz")]:
        old.unlink()
    for name, (body, names) in tqdm(chosen(kind).items(), disable=None, unit="body"):
        clips = export.clips(Setup.of(body, "steer"), names)
        for rig in export.RIGS if name in ROBOTS or body.source else ("skin",):
            (out / f"{name}-{rig}.glb").write_bytes(export.glb(body, clips, rig))
            (out / f"{name}-{rig}.clips.json").write_text(json.dumps(export.sidecar(body, clips)))
        if not kind:
            (out / f"{name}-low.glb").write_bytes(export.glb(body, clips, triangles=3000, uv=True, reduced=True))
        if not body.source:  # whose bones stand at the joints, not where MuJoCo's bodies do
            np.savez(out / f"{name}.npz", **truth(body, clips))
            np.savez(out / f"{name}.bound.npz", **bound(body, clips))


def truth(body, clips) -> dict[str, np.ndarray]:
    """Return where MuJoCo has the parts, (frames, parts, 3) in the axes of glTF, by animation; and their names."""
    model = compile_model(body)
    data, parts, places = mujoco.MjData(model), [model.body(name).id for name in body.part_names], {}
    for clip in clips:
        for motion, end in ((clip.motion, ""), (clip.motion._replace(root=0.0 * clip.motion.root), "_in_place")):
            frames = []
            for pose in motion.poses():
                data.qpos[:] = pose
                mujoco.mj_kinematics(model, data)
                frames.append(data.xpos[parts][:, [1, 2, 0]])
            places[f"{clip.name}{end if clip.moves else ''}{'_loop' if clip.loops else ''}"] = np.stack(frames)
    return places | {"parts": np.array(body.part_names)}


def bound(body, clips) -> dict[str, np.ndarray]:
    """Return the hinges of the parts in the first pose of idle, (parts, 3) in the axes of glTF, and the height, m.

    Parts without a joint have NaN.
    """
    model, (idle,) = compile_model(body), [clip for clip in clips if clip.name == "idle"]
    data = mujoco.MjData(model)
    data.qpos[:] = idle.motion.poses()[0]
    mujoco.mj_kinematics(model, data)
    hinges = np.full((len(body.part_names), 3), np.nan)
    for hinge, name in zip(hinges, body.part_names, strict=True):
        if name != "torso" and model.body(name).jntnum[0]:
            hinge[:] = data.xaxis[model.body(name).jntadr[0]][[1, 2, 0]]
    return {"hinges": hinges, "height": np.array(body.torso.standing_height)}


if __name__ == "__main__":
    main(*sys.argv[1:])
