"""What weight and paces change in the clips of bodies.

python tests/clip_weight.py BODY ...

A body is a robot, an example, a file, or random:SEED. Prints for each body the range of the torso's height in the walk
and the run, standing heights, its roll and mean pitch, degrees, and the slip of its feet, without and with weight; the
largest pitch that weight adds into the acceleration of a start and a stop, degrees; how far it moves the torso back,
down and ahead in starts, stops, strikes and jumps, standing heights, with the share that legs allow; and the numbers
of each pace, see `clip_sets.measure_paces`.
"""

import sys

import clip_sets
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import planting, swaying
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.envs.setup import Setup

ACTIONS = ["attack", "jump"]


def tilts(draft) -> np.ndarray:
    """Return roll and pitch (samples, 2) of a draft, degrees."""
    matrices = rotations.matrix(draft.motion.quaternions)
    roll = np.arctan2(matrices[:, 2, 1], matrices[:, 2, 2])
    return np.degrees(np.stack([roll, -np.arcsin(matrices[:, 2, 0])], axis=-1))


def gait_numbers(body, walk) -> str:
    """Return range of the height, amplitude of the roll at the frequency of the gait, mean pitch, and slip."""
    samples = len(walk.motion.joints) - 1
    turns = np.exp(-2.0j * np.pi * walk.cycles * np.arange(samples) / samples)
    bob = np.ptp(walk.motion.positions[:, 2]) / body.torso.standing_height
    roll = 2.0 * abs((tilts(walk)[:-1, 0] * turns).mean())
    pitch = tilts(walk)[:-1, 1].mean()
    return f"bob {bob:.3f}, roll {roll:.1f}, pitch {pitch:.1f}, slip {planting.slip(body, walk.motion):.3f}"


def main(*names: str) -> None:
    """Print the numbers of bodies."""
    for name in names:
        body = Setup.of(name, "steer").body
        recorder, left_out = clip_sets.make_recorder(body), {}
        clips = [*clip_sets.PACES, "start", "stop", *ACTIONS]
        light, heavy = (
            make_drafts(recorder, clips, iter, left_out, character=swaying.choose_character(size))
            for size in (0.0, 1.0)
        )
        lines = []
        for clip in [clip for clip in ("walk", "run") if clip in heavy]:
            lines.append(f"{clip} without weight: {gait_numbers(body, light[clip])}")
            lines.append(f"{clip} with it: {gait_numbers(body, heavy[clip])}")
        for clip, sign in (("start", 1.0), ("stop", -1.0)):
            if clip in heavy:
                lines.append(f"pitch in {clip} {(sign * (tilts(heavy[clip]) - tilts(light[clip]))[:, 1]).max():.1f}")
        for clip in [clip for clip in ("start", "stop", *ACTIONS) if clip in heavy]:
            changes = (heavy[clip].motion.positions - light[clip].motion.positions) / body.torso.standing_height
            back, _, down = changes.min(axis=0)
            ahead = changes[:, 0].max()
            lines.append(f"{clip}: back {-back:.3f}, down {-down:.3f}, ahead {ahead:.3f}, weight {heavy[clip].weight}")
        for key, number in clip_sets.measure_paces(body, recorder, light).items():
            lines.append(f"{key} {number:.2f}")
        lines += [f"no {clip}: {reason}" for clip, reason in left_out.items()]
        print("; ".join([name, *lines]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
