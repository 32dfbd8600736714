"""Draw clips as strips of pictures without titles, for people who are to name them.

python tests/clip_strips.py FOLDER

Draws eight clips of Queen and of random:0, without and with weight, under numbers in shuffled order. FOLDER/key.csv
says which strip shows which clip. A loop is shown for two cycles or more, at least a second.
"""

import csv
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from arc_suite.animation.clips import clips
from arc_suite.envs.setup import Setup
from arc_suite.simulation import opengl, pictures

BODIES = ("queen", "random:0")
CLIPS = ("walk", "run", "jump", "attack", "hit_left", "stagger_left", "death", "turn_90")
WEIGHTS = (0.0, 1.0)
COLUMNS = 4
ROWS = 4
SIZE = (320, 240)  # pixels of a picture, width and height
SEED = 70
FREE_CAMERA = -1


def list_poses(clip) -> tuple[np.ndarray, np.ndarray]:
    """Return poses (pictures, nq) of a clip in the world, and their times (pictures,), s."""
    motion = clip.motion
    repeats = max(2, math.ceil(1.0 / motion.seconds)) if clip.loops else 1
    for _ in range(repeats - 1):
        motion = motion.append(clip.motion)
    samples = np.linspace(0, len(motion.joints) - 1, ROWS * COLUMNS).round().astype(int)
    return motion.poses()[samples], samples * motion.time_step


def watch_all(model, body, poses: np.ndarray) -> None:
    """Put the free camera where it sees the whole way of poses (pictures, nq), from the side."""
    height = body.torso.standing_height
    first, last = poses[:, :2].min(axis=0), poses[:, :2].max(axis=0)
    model.stat.center[:] = [*(0.5 * (first + last)), 0.5 * height]
    model.stat.extent = (4.0 * height + np.linalg.norm(last - first)) / 1.5  # the camera is 1.5 extents away
    model.vis.global_.azimuth = 115.0
    model.vis.global_.elevation = -15.0


def draw_strip(body, clip) -> Image.Image:
    """Return the strip of a clip: pictures in rows, with the time in the corner of each."""
    drawing = pictures.Decorated.from_body(body, quality=pictures.QUALITIES["film"])
    poses, times = list_poses(clip)
    watch_all(drawing.model.ptr, body, poses)
    strip = Image.new("RGB", (COLUMNS * SIZE[0], ROWS * SIZE[1]))
    for index, (pose, time) in enumerate(zip(poses, times, strict=True)):
        drawing.pose(pose)
        picture = Image.fromarray(drawing.render(SIZE[1], SIZE[0], FREE_CAMERA))
        ImageDraw.Draw(picture).text((6, 4), f"{time:.2f} s", fill="white")
        strip.paste(picture, (index % COLUMNS * SIZE[0], index // COLUMNS * SIZE[1]))
    drawing.free()
    return strip


def make_strips() -> Iterator[tuple[str, float, str, Image.Image]]:
    """Yield body, weight, name of the clip, and strip."""
    for name in BODIES:
        setup = Setup.of(name, "steer")
        for weight in WEIGHTS:
            for clip in clips(setup, CLIPS, weight=weight):
                strip = opengl.call(lambda body=setup.body, clip=clip: draw_strip(body, clip))
                yield name, weight, clip.name, strip


def main(folder: str) -> None:
    """Write strips and their key."""
    strips = list(make_strips())
    order = np.random.RandomState(SEED).permutation(len(strips))
    with (Path(folder) / "key.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["strip", "body", "weight", "clip"])
        for number, index in enumerate(order):
            body, weight, clip, strip = strips[index]
            strip.save(Path(folder) / f"{number:02d}.png")
            rows.writerow([f"{number:02d}", body, weight, clip])


if __name__ == "__main__":
    main(*sys.argv[1:])
