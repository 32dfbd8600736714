"""Plants mistakes on purpose, one at a time, in a copy of the project, and tells which test catches each.

`python tests/mutants.py` runs all; exit status 1 if one survives. It takes minutes: `make mutants`.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
from typing import NamedTuple

from tqdm import tqdm

ROOT = pathlib.Path(__file__).parents[1]


class Mutant(NamedTuple):
    """A mistake: in a file of the package, one text in place of another that occurs once."""

    mistake: str
    file: str
    old: str
    new: str


MUTANTS = (
    Mutant("swapped leg", "robots/queen.py", "leg.mirrored(leg.name.replace", "leg.replace(name=leg.name.replace"),
    Mutant("mirrored axis keeps its sign", "spec.py", "axis=(-a, b, -c)", "axis=(a, b, -c)"),
    Mutant(
        "leg order",
        "robots/leaper.py",
        '(left, left.mirrored(left.name[0] + "r"))',
        '(left.mirrored(left.name[0] + "r"), left)',
    ),
    Mutant("dropped clip of the action", "tasks/walker.py", "return array.clip(-1.0, 1.0)", "return array"),
    Mutant("dropped clip of the contact forces", "tasks/readings.py", ".clip(-1.0, 1.0)", ""),
    Mutant("sign of a weight", "tasks/walk.py", '"smoothness": -0.02', '"smoothness": 0.02'),
    Mutant("sign of the sweep", "cpg/demonstrator.py", "= -1.0 if leg.side", "= 1.0 if leg.side"),
    Mutant(
        "ignored seed",
        "tasks/walk.py",
        "RandomState(None if random is None else checks.seed(random))",
        "RandomState()",
    ),
    Mutant("wrong number of substeps", "robots/sizing.py", "SUBSTEPS = 25", "SUBSTEPS = 24"),
    Mutant(
        "gait clock advances too late",
        "tasks/walker.py",
        "(self.phase + self._clock)",
        "(self.phase + 0.5 * self._clock)",
    ),
    Mutant(
        "previous action forgotten",
        "tasks/walker.py",
        "self._previous_action, self._action = self._action, action",
        "self._previous_action, self._action = action, action",
    ),
    Mutant(
        "velocity of the wrong frame",
        "tasks/readings.py",
        "angular_velocity=qvel[..., 3:6]",
        "angular_velocity=qvel[..., 0:3]",
    ),
    Mutant(
        "yaw rate penalised in place of pitch rate",
        "tasks/rewards.py",
        "component(readings.angular_velocity, 1)",
        "component(readings.angular_velocity, 2)",
    ),
    Mutant("stance and swing exchanged", "tasks/rewards.py", "% TWO_PI < TWO_PI", "% TWO_PI > TWO_PI"),
    Mutant("quaternion not normalised", "tasks/walk.py", "    qpos[3:7] /= np.linalg.norm(qpos[3:7])\n", ""),
    Mutant(
        "reset noise of the joints halved",
        "tasks/walk.py",
        "random.uniform(-joint, joint, joints)",
        "random.uniform(0.0, joint, joints)",
    ),
    Mutant("fall reported as a time limit", "tasks/walk.py", "return 0.0 if failed", "return 1.0 if failed"),
    Mutant("no sensors, so no contact forces", "physics.py", "option.disableflags = flags\n", "pass\n"),
    Mutant("one substep too few", "physics.py", "mj_step(model, data, nstep - 1)", "mj_step(model, data, nstep - 2)"),
    Mutant("contact margin doubled", "spec.py", "default=0.005", "default=0.01"),
    Mutant("armature of the hip", "robots/tick.py", "armature=1.0", "armature=2.0"),
    Mutant("ballast touches the floor", "robots/builder.py", '{"contype": 0,', '{"contype": 1,'),
    Mutant("NaN let through", "tasks/walker.py", "invalid = np.isnan(array)", "invalid = np.zeros(array.shape, bool)"),
    Mutant("feet in the air slip", "style/metrics.py", " * track.contacts", ""),
    Mutant("early taken for late", "style/metrics.py", "actual * wanted.conj()", "wanted * actual.conj()"),
    Mutant("mirror image of a foot's path forgotten", "style/metrics.py", " * (1.0, -1.0, 1.0)", ""),
    Mutant("motors win back what they brake", "style/metrics.py", ".clip(0.0).sum()", ".sum()"),
    Mutant("a foot that bounces strides", "style/metrics.py", "0.5 * foot_clearance(track)", "0.0"),
    Mutant("order of tracks in a file", "style/files.py", "in range(count)]", "in range(count)[::-1]]"),
    Mutant(
        "a replay that differs let through",
        "style/sources.py",
        "np.array_equal(track.rewards, episode.rewards)",
        "len(track.rewards) == episode.length",
    ),
    Mutant("rows share a seed", "vector.py", "checks.seed(first + row)", "checks.seed(first)"),
    Mutant(
        "observations of a batch handed out live",
        "vector.py",
        "self._observation = observation.copy()",
        "self._observation = observation",
    ),
    Mutant(
        "divergence unseen",
        "physics.py",
        "return simulations.warning[..., 1].any(axis=-1)",
        "return simulations.warning[..., 1].any(axis=-1) & False",
    ),
    Mutant("both sides of a body in step", "gaits.py", "0.5 * (leg.side ==", "0.0 * (leg.side =="),
    Mutant("steered the wrong way", "cpg/stride.py", "copysign(STEERING, froude)", "copysign(STEERING, -froude)"),
    Mutant("joints of a giant as fast as a mite's", "robots/sizing.py", "_STIFFNESS / control_timestep(body)", "7.0"),
    Mutant(
        "contacts of a giant as hard as a mite's",
        "robots/builder.py",
        '"solref": (simulation.contact_time,',
        '"solref": (0.02,',
    ),
    Mutant(
        "feet of a random body above the floor", "robots/generator.py", "(p.height - foot_radius) /", "p.height * 0.9 /"
    ),
    Mutant("sign of zero kept", "spec.py", "float(value) + 0.0", "float(value)"),
    Mutant("fork unnoticed", "forks.py", "    count += 1\n", "    count += 0\n"),
    Mutant("batch destroyed in a forked child", "physics.py", "        forks.keep(self._simulations)\n", ""),
    Mutant("picture of another moment", "physics.py", "        shared.pose(self)\n", ""),
    Mutant("user's choice of OpenGL overwritten", "rendering.py", '"MUJOCO_GL" not in os.environ and ', ""),
    Mutant("two threads in one environment", "envs/lock.py", "not lock.acquire(False)", "False"),
    Mutant("damping has the wrong sign", "cpg/law.py", "- damping * velocities", "+ damping * velocities"),
    Mutant("no crouch", "cpg/demonstrator.py", "steps < self.settle", "steps < 0"),
    Mutant(
        "a row walks by another's preset", "cpg/demonstrator.py", "for value in values]", "for value in values[::-1]]"
    ),
    Mutant("all legs lead alike", "tuning/space.py", "offset + leads[rank]", "offset + leads[0]"),
    Mutant("the fallen go on earning", "tuning/judge.py", "totals += rewards * upright", "totals += rewards"),
    Mutant("a search is told its worst", "tuning/search.py", "[-value for value in fitness]", "fitness"),
    Mutant("the same noise in all episodes", "data/actors.py", "default_rng((seed, 1))", "default_rng(1)"),
    Mutant("a damaged episode is read", "data/episodes.py", "!= value:", "is value:"),
)


def plant(mutant: Mutant, folder: pathlib.Path) -> None:
    """Copies the project to a folder and plants the mistake there.

    Raises:
        ValueError: the text to replace does not occur once.
    """
    shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(".git", ".venv", "out", "__pycache__", "*.egg-info"))
    path = folder / "arc_suite" / mutant.file
    text = path.read_text()
    if text.count(mutant.old) != 1:
        raise ValueError(f"{mutant.file}: expected {mutant.old!r} once, found it {text.count(mutant.old)} times")
    path.write_text(text.replace(mutant.old, mutant.new))


def caught_by(folder: pathlib.Path) -> str | None:
    """The first test of a project that fails, or None."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "--no-header",
        "-p",
        "no:cacheprovider",
        "--ignore=tests/test_mutants.py",
    ]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    result = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    failed = [line for line in result.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0].split(" - ")[0] if failed else None


def main() -> int:
    """Tries every mutant and prints a table."""
    survivors = 0
    for mutant in tqdm(MUTANTS, unit="mutant"):
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / "project"
            plant(mutant, copy)
            test = caught_by(copy)
        survivors += test is None
        tqdm.write(f"{mutant.mistake:<40} {test or 'SURVIVES'}")
    return int(survivors > 0)


if __name__ == "__main__":
    sys.exit(main())
