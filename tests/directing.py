"""How well bodies keep poses and change gaits by command: `make check-directing`, some minutes.

python tests/directing.py [NUMBER OF BODIES OF EACH FAMILY]

Prints for each body, by `steered` or `balanced`: standing, the largest error of twelve poses within the room of planted
feet; walking, the error of motion that a pose within the room of feet that may slide adds, in target velocities, and
that of the attitude; and of gaits that change every forty control steps, the error that they add and their compliance,
by those of the same gaits for themselves. The last lines count bodies, and the exit status is 1 where too few do.
"""

import pathlib
import sys

import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(pathlib.Path(__file__).parent / "fixtures"))

from arc_suite.bodies.families import sound_body  # noqa: E402
from arc_suite.cpg import Demonstrator  # noqa: E402
from arc_suite.cpg.selection import suited_preset  # noqa: E402
from arc_suite.envs.vector import VectorEnv  # noqa: E402
from arc_suite.models.posture import measure_room  # noqa: E402
from arc_suite.robots import ROBOTS, gaits  # noqa: E402
from arc_suite.tasks import gait_and_pose  # noqa: E402

FIRST = 7000  # seed of the first body of a family, of those that nothing else uses
POSES = [(-0.15, 0, 0, 0, 0, 0), (-0.3, 0, 0, 0, 0, 0), (0.1, 0, 0, 0, 0, 0)]
POSES += [(0, 0, 0, sign * 0.12, 0, 0) for sign in (1, -1)] + [(0, 0, 0, 0, sign * 0.12, 0) for sign in (1, -1)]
WALKS = ((1.0, 0.0, 0.0), (0.5, 0.0, 0.5))
STRAIGHT = ((0.7, 0.0, 0.0), (0.4, 0.0, 0.3))
SWITCHES, HELD, SETTLES = 20, 60, 30
STANDING = {"height": 0.02, "attitude": 0.01}
ADDED, TILTED, COMPLIANT = 0.05, 0.03, 0.95
RISEN, SHARE = 0.1, 0.9  # standing heights that a body that rose is off its pose, and share of bodies that succeed
STEADY = 0.1  # error of motion with which a body walks a gait steadily


class Run:
    """Environments of a body in `directed`, with a demonstrator."""

    def __init__(self, body, count, **settings):
        """Open them."""
        settings = {"poses": 0.0, "gaits": (), **settings}
        self.envs = VectorEnv(body, "directed", count, task_kwargs=settings, autoreset_mode="Disabled")
        self.task = self.envs.task.definition
        self.policy = Demonstrator(self.task, suited_preset(self.task))
        self.observation = self.envs.reset(seed=5000)[0]
        self.fell = np.zeros(count, bool)

    def walk(self, steps, last):
        """Walk, and return means over the last steps: motion, pose and compliance."""
        motion, poses, compliance = [], [], []
        for step in range(steps):
            blocks = self.envs.task.split(self.observation)
            self.observation, _, terminated, *_ = self.envs.step(self.policy.act(blocks))
            self.fell |= terminated
            if step >= steps - last:
                blocks, readings = self.envs.task.split(self.observation), self.task.read(self.envs.batch.data)
                legs = len(self.task.scene.body.legs)
                sine, cosine, (duty, _) = blocks["gait"][:, :legs], blocks["gait"][:, legs:-2], blocks["gait"][:, -2:].T
                stands = np.arctan2(sine, cosine) / (2.0 * np.pi) % 1.0 < duty[:, None]
                stands |= ~blocks["gait_clock"].any(axis=-1)[:, None]
                motion.append(blocks["command"][:, 3:])
                poses.append(gait_and_pose.measure_pose(self.task.context, readings))
                on_ground = readings.foot_heights < self.task.parameters.stance_threshold
                compliance.append((on_ground == stands).mean(axis=-1))
        return [np.mean(values, axis=0) for values in (motion, poses, compliance)]


def standing(body) -> dict:
    """Return the largest errors of poses of a body that stands."""
    random = np.random.RandomState(0)
    shares = random.uniform(-1.0, 1.0, (12, 6))
    shares[6:] /= abs(shares[6:]).sum(axis=-1, keepdims=True)  # some of all numbers, some of one
    shares[:6] *= np.eye(6)
    low, high = measure_room(body).T
    asked = np.where(shares < 0.0, -low, high) * shares
    run = Run(body, len(asked))
    run.envs.command("command", (0.0, 0.0, 0.0))
    run.envs.command("pose", asked)
    off = abs(run.walk(150, 30)[1] - asked)
    return {
        "place": off[:, :3].max(),
        "height": off[:, 0].max(),
        "attitude": off[:, 3:5].max(),
        "yaw": off[:, 5].max(),
        "fell": int(run.fell.sum()),
    }


def walking(body) -> dict:
    """Return what poses add to the error of motion of a body that walks, and its largest error of attitude."""
    low, high = measure_room(body, planted=False).T
    poses = [pose for pose in POSES if (low - 1e-9 <= pose).all() and (pose <= high + 1e-9).all()]
    asked = np.repeat([np.zeros(6), *poses], len(WALKS), axis=0)
    walks = np.tile(WALKS, (len(poses) + 1, 1))
    run = Run(body, len(asked))
    run.envs.command("command", walks)
    run.envs.command("pose", asked)
    motion, found, _ = run.walk(280, 120)
    error = abs(motion - walks).mean(axis=-1).reshape(-1, len(WALKS)).mean(axis=-1)
    off = abs(found - asked)
    return {
        "poses": len(poses),
        "upright": error[0],
        "added": max(0.0, (error[1:] - error[0]).max(initial=0.0)),
        "height off": off[:, 0].max(),
        "tilt": off[:, 3:5].max(),
        "walk fell": int(run.fell.sum()),
    }


def switching(body) -> dict:
    """Return what changes of gait add to the error of motion, and the compliance after one by that before."""
    names = gaits.fitting_gaits(body)
    run = Run(body, len(names))
    run.envs.command("command", STRAIGHT[0])
    numbers = {name: np.append(run.task.named_command("gait", name)[:-1], np.nan) for name in names}
    run.envs.command("gait", np.array(list(numbers.values())))
    motion, _, compliance = run.walk(240, 120)
    error = abs(motion - STRAIGHT[0]).mean(axis=-1)
    steady = {name: (error[i], compliance[i]) for i, name in enumerate(names) if not run.fell[i] and error[i] <= STEADY}
    if not steady:
        return {"gaits": 0, "change": np.nan, "compliance": np.nan, "change fell": 0}
    run, random = Run(body, len(STRAIGHT)), np.random.RandomState(1)
    run.envs.command("command", STRAIGHT)
    frequency, added, compliances, names = run.task.parameters.gait_frequency, [], [], list(steady)
    run.walk(100, 1)
    for switch in range(SWITCHES):
        name = names[switch % len(names)]
        run.envs.command("gait", np.append(numbers[name][:-1], frequency * random.uniform(0.8, 1.2)))
        motion, _, compliance = run.walk(HELD, HELD - SETTLES)
        added.append(abs(motion - STRAIGHT).mean(axis=-1).mean() - steady[name][0])
        compliances.append(compliance.mean() / steady[name][1])
    return {
        "gaits": len(names),
        "change": max(0.0, np.mean(added)),
        "compliance": np.mean(compliances),
        "change fell": int(run.fell.sum()),
    }


def rising(body) -> dict:
    """Return how many of three starts on the belly a body does not rise from."""
    run = Run(body, 3, start="belly")
    run.envs.command("command", (0.0, 0.0, 0.0))
    _, found, _ = run.walk(120, 10)
    return {"lie": int((run.fell | (abs(found[:, 0]) > RISEN)).sum())}


def failures(found: dict) -> dict[str, bool]:
    """Return by what is measured whether a body fails at it."""
    walks = not found["walk fell"] and found["added"] <= ADDED and found["tilt"] <= TILTED
    changes = not found["change fell"] and found["change"] <= ADDED and found["compliance"] >= COMPLIANT
    return {
        "standing": bool(found["fell"]) or any(found[name] > most for name, most in STANDING.items()),
        "walking": not walks,
        "changing gaits": not (found["gaits"] and changes),
        "rising": bool(found["lie"]),
    }


def main(count: str = "40") -> int:
    """Measure the bodies, print them, and return the exit status."""
    bodies = dict(ROBOTS)
    bodies |= {f"random:{seed}": sound_body(seed) for seed in range(FIRST, FIRST + int(count))}
    fails: dict[str, dict[str, bool]] = {}
    for name, body in tqdm(bodies.items(), disable=None, unit="body"):
        found = standing(body) | walking(body) | switching(body) | rising(body)
        fails[name] = failures(found)
        links = "-".join(sorted({str(len(leg.joints)) for leg in body.legs}))
        told = ", ".join(f"{key} {value:.3g}" for key, value in found.items())
        wrong = [what for what, failed in fails[name].items() if failed]
        print(f"{name} ({len(body.legs)} legs of {links}): {told}; fails: {', '.join(wrong) or 'none'}", flush=True)
    random = [each for name, each in fails.items() if name not in ROBOTS]
    most = int((1.0 - SHARE) * len(random))
    enough = True
    for what in random[0] if random else ():
        failed = sum(each[what] for each in random)
        enough &= failed <= most
        print(f"{what}: {len(random) - failed} of {len(random)} random bodies; {most} may fail")
    return int(not enough)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
