"""Write the clips of many bodies, which real programs then open: `make check-glb`, `check-blender`, `check-godot`.

python tests/engines/make_files.py FOLDER [few]
"""

import pathlib
import sys

import mujoco
import numpy as np
from tqdm import tqdm

from arc_suite.animation import clips as export
from arc_suite.animation.clips.catalogue import CLIPS
from arc_suite.envs.setup import Setup
from arc_suite.models.importing import imported
from arc_suite.robots import ROBOTS, generator, spec_files
from arc_suite.simulation.model import compiled

OTHERS = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"  # files of robots that are imported
FEW = ("walk", "turn_left", "stop", "idle")
WHOLE = "queen"  # has all clips


def main(folder: str, few: str = "") -> None:
    """Write FOLDER/<body>-<rig>.glb and .npz, the positions of all bones on every frame; delete old ones."""
    out = pathlib.Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    for old in [*out.glob("*.glb"), *out.glob("*.npz")]:
        old.unlink()
    bodies = dict(ROBOTS)
    if not few:
        bodies |= {name: spec_files.load_body(name) for name in spec_files.EXAMPLES}
        bodies |= {f"random_{seed}": generator.random_body(seed) for seed in range(100)}
        bodies |= {path.stem: imported(path).body for path in sorted(OTHERS.iterdir())}
    for name, body in tqdm(bodies.items(), disable=None, unit="body"):
        names = tuple(CLIPS) if name == WHOLE else export.DEFAULT if name in spec_files.EXAMPLES else FEW
        clips = export.clips(Setup.of(body, "steer"), names)
        for rig in export.RIGS if name in ROBOTS or body.source else ("skin",):
            (out / f"{name}-{rig}.glb").write_bytes(export.glb(body, clips, rig))
        if not body.source:  # whose bones stand at the joints, not where MuJoCo's bodies do
            np.savez(out / f"{name}.npz", **truth(body, clips))


def truth(body, clips) -> dict[str, np.ndarray]:
    """Return where MuJoCo has the parts, (frames, parts, 3) in the axes of glTF, by animation; and their names."""
    model = compiled(body)
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


if __name__ == "__main__":
    main(*sys.argv[1:])
