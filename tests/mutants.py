"""Plants mistakes on purpose, one at a time, in a copy of the project, and tells which test catches each.

`python tests/mutants.py` runs all, or those whose names hold the words given; exit status 1 if one
survives. It takes long: `make check-mutants`. With `--check` it only finds where each would be planted.
"""

import concurrent.futures
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
    """A mistake: one text in place of another, which occurs once in the whole package, wherever that is."""

    mistake: str
    old: str
    new: str


MUTANTS = (
    # Bodies.
    Mutant(
        "swapped leg",
        'leg.mirrored(leg.name.replace("l", "r")) for leg in LEFT_LEGS)),\n'
        "    simulation=Simulation(),\n    camera=TrackingCamera(position=(0.0, -7.0, 3.0)",
        'leg.replace(name=leg.name.replace("l", "r")) for leg in LEFT_LEGS)),\n'
        "    simulation=Simulation(),\n    camera=TrackingCamera(position=(0.0, -7.0, 3.0)",
    ),
    Mutant("mirrored axis keeps its sign", "axis=(-a, b, -c)", "axis=(a, b, -c)"),
    Mutant("leg order", '(left, left.mirrored(left.name[0] + "r"))', '(left.mirrored(left.name[0] + "r"), left)'),
    Mutant("armature of the hip", "-40.0, 40.0),\n    armature=1.0", "-40.0, 40.0),\n    armature=2.0"),
    Mutant("sign of zero kept", "float(value) + 0.0", "float(value)"),
    Mutant("a body's joints not looked at", "body.joint_names != ROBOTS[body.name].joint_names", "False"),
    Mutant("both sides of a body in step", '0.5 * (side == "right")', '0.0 * (side == "right")'),
    Mutant("feet of a random body above the floor", "(p.height - foot_radius) /", "p.height * 0.9 /"),
    Mutant("a scaled robot keeps its name", 'name=f"{stem}_{how}"', "name=body.name"),
    # Models.
    Mutant("contact margin doubled", "default=0.005", "default=0.01"),
    Mutant(
        "ballast touches the floor",
        '"mass": solid.mass, **_TOUCHES_NOTHING}',
        '"mass": solid.mass, **touches_floor}',
    ),
    Mutant("wrong number of substeps", "SUBSTEPS = 25", "SUBSTEPS = 24"),
    Mutant("joints of a giant as fast as a mite's", "_STIFFNESS / control_timestep(body)", "7.0"),
    Mutant(
        "contacts of a giant as hard as a mite's", '"solref": (simulation.contact_time, 1.0)', '"solref": (0.02, 1.0)'
    ),
    # Arenas.
    Mutant("triangles of the ground exchanged", "right = u > v", "right = u < v"),
    Mutant("stairs without their fourth tread", "(steps + 1).clip(0, 4) -", "(steps + 1).clip(0, 3) -"),
    Mutant(
        "ground under the torso's middle alone",
        "for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)",
        "for x in (0.0,) for y in (0.0,)",
    ),
    Mutant(
        "lanes all alike",
        "np.random.RandomState((self.seed, KINDS.index(kind), before))",
        "np.random.RandomState(self.seed)",
    ),
    Mutant("feet may sink", "sunk=sinking >= SINKING", "sunk=sinking < 0"),
    Mutant("levels never fall", "numpy.where(stream.outcome < down, (level - 1).clip(0), level)", "level"),
    Mutant("the highest level for ever", "& (stays >= STAYS)", "& False"),
    Mutant(
        "a scan that does not turn",
        "x = position[..., 0:1] + cosine * forward - sine * left",
        "x = position[..., 0:1] + forward",
    ),
    Mutant("a command along the torso", "-numpy.sin(heading), turn", "numpy.sin(heading), turn"),
    Mutant("who lies is healthy", "~(high & ~lies & ", "~(high & "),
    # Simulations.
    Mutant("no sensors, so no contact forces", "option.disableflags = flags\n", "pass\n"),
    Mutant("one substep too few", "mj_step(model, data, nstep - 1)", "mj_step(model, data, nstep - 2)"),
    Mutant("one substep of batches too few", "simulations.step(mask, nstep - 1)", "simulations.step(mask, nstep - 2)"),
    Mutant("margin of a pair not summed", "model.geom_margin[both].sum()", "model.geom_margin[both].max()"),
    Mutant("friction of a pair not mixed", "friction.max(axis=0)", "friction[0]"),
    Mutant("Euler without damping", "        and model.dof_damping.any()\n", ""),
    Mutant("clock not put back", "if self._variable.value is None:", "if False:"),
    Mutant("somebody's own clock taken", "if self._variable.value == self._clock:", "if True:"),
    Mutant(
        "divergence unseen",
        "return simulations.warning[..., 1].any(axis=-1)",
        "return simulations.warning[..., 1].any(axis=-1) & False",
    ),
    Mutant("fork unnoticed", "    global count\n    count += 1\n", "    global count\n    count += 0\n"),
    Mutant("batch destroyed in a forked child", "        forks.keep(self._simulations)\n", ""),
    Mutant("picture of another moment", "        decorated.pose(qpos, share, mocap_pos, markers, failed_legs)\n", ""),
    Mutant("user's choice of OpenGL overwritten", '"MUJOCO_GL" not in os.environ and ', ""),
    # Tasks.
    Mutant(
        "dropped clip of the contact forces",
        "contact_forces=forces.reshape(forces.shape[:-2] + (-1,)).clip(-1.0, 1.0),",
        "contact_forces=forces.reshape(forces.shape[:-2] + (-1,)),",
    ),
    Mutant("sign of a weight", '        "smoothness": -0.02', '        "smoothness": 0.02'),
    Mutant("yaw rate penalised in place of pitch rate", "i) for i in (2, 3, 4))", "i) for i in (2, 3, 5))"),
    Mutant("stance and swing exchanged", "% TWO_PI < TWO_PI", "% TWO_PI > TWO_PI"),
    Mutant("gait clock advances too late", "phases[tick - 1] + turn", "phases[tick - 1] + 0.5 * turn"),
    Mutant("a long episode's clock jumps", "np.argmin(np.abs(np.sin(0.5 * phases[ends])))", "-1"),
    Mutant("previous action forgotten", "previous_action=memory.action", "previous_action=action"),
    Mutant("quaternion not normalised", "qpos[3:7] /= np.linalg.norm(qpos[3:7])", "pass"),
    Mutant("reset noise to one side", "random.uniform(-widths, widths)", "random.uniform(0.0 * widths, widths)"),
    Mutant(
        "speed of the state in place of the frame's",
        "tick, x = memory.tick + 1, component(readings.frame_position, 0)",
        "tick, x = memory.tick + 1, component(readings.torso_position, 0)",
    ),
    Mutant("the first step starts from nowhere", "_replace(x=x, energy=", "_replace(energy="),
    Mutant("swaying pays", "return gained.clip(max=1.0)", "return gained.clip(-1.0, 1.0)"),
    Mutant("costs without a bound", "excess.__array_namespace__().sqrt(1.0 + excess * excess)", "1.0"),
    Mutant("braking counts as work", "(angles - memory.angles)).clip(0.0).sum", "(angles - memory.angles)).sum"),
    Mutant(
        "schedule errors counted twice",
        "memory.all_schedule_errors + schedule_errors",
        "memory.all_schedule_errors + 2.0 * schedule_errors",
    ),
    Mutant(
        "blocks declared in another order",
        '"posture": posture(body),\n        "velocities": velocities(body),',
        '"velocities": velocities(body),\n        "posture": posture(body),',
    ),
    Mutant("blocks cut one too early", "slice(end - size, end)", "slice(max(end - size - 1, 0), end - 1)"),
    Mutant("blocks joined unchecked", "for name, block in blocks.items()] != self._declared", "for name, block in ()]"),
    Mutant(
        "feet stay in the ground",
        "(self.clearances - readings.foot_heights).max",
        "0.0 * (self.clearances - readings.foot_heights).max",
    ),
    Mutant(
        "a memory written in place", "(1.0 - context.leaks) * core.motion", "core.motion.__imul__(1.0 - context.leaks)"
    ),
    Mutant("a command that is ignored", "numpy.where(numpy.isnan(memory.live), scheduled, memory.live)", "scheduled"),
    Mutant("a schedule that does not end", "steps % memory.ends[..., -1]", "steps"),
    Mutant("a live command counts as a new one", "changes & numpy.isnan(memory.live).any(axis=-1)", "changes"),
    Mutant(
        "who rests has another command",
        "~(self._ended | self._resting) & self._task.resampled(self._memory)",
        "~self._ended & self._task.resampled(self._memory)",
    ),
    Mutant("followed from behind", "cosine * x + sine * y", "cosine * x - sine * y"),
    Mutant("turned the wrong way", "2.0 * (w * z + x * y)", "2.0 * (x * y - w * z)"),
    # Modifiers.
    Mutant("a leg limp from the start", "own.elapsed >= FAILS_FROM", "own.elapsed >= 0"),
    Mutant("kicks a step late", "% last + 1 == changes.kick_steps", "% last == changes.kick_steps"),
    Mutant("weak motors give all", "ctrl = own.strength * inputs.ctrl", "ctrl = inputs.ctrl"),
    Mutant("actions not delayed", "own, action = _delayed(own, action)", "own, _ = _delayed(own, action)"),
    Mutant("the same noise in every step", "key ^ (step * _GOLDEN)", "key"),
    Mutant("positions held without damping", "- damping * changes.speeds", "- 0.0 * changes.speeds"),
    Mutant(
        "the reward sees what weak motors give",
        "self.task.before(memory.task, action)",
        "self.task.before(memory.task, own.strength * action)",
    ),
    Mutant("a changed model stays so", "if self._unchanged:", "if False:"),
    Mutant(
        "the last substep of batches on the compiled model",
        "set_models(self._own)\n            simulations.step(mask)",
        "set_models(None)\n            simulations.step(mask)",
    ),
    # Environments.
    Mutant("dropped clip of the action", "return array.clip(-1.0, 1.0)", "return array"),
    Mutant("NaN let through", "invalid = np.isnan(array)", "invalid = np.zeros(array.shape, bool)"),
    Mutant("ignored seed", "RandomState(None if random is None else checks.seed(random))", "RandomState()"),
    Mutant("fall reported as a time limit", "return 0.0 if terminated else", "return 1.0 if terminated else"),
    Mutant(
        "a new stream carries on the old one",
        "value, self.definition.first(), True",
        "value, self.definition.first(), False",
    ),
    Mutant(
        "a new stream of an environment carries on the old one",
        "self._streams_begin[index] = seeds[index], True",
        "self._streams_begin[index] = seeds[index], False",
    ),
    Mutant("environments share a seed", "checks.seed(first + index) for", "checks.seed(first) for"),
    Mutant(
        "observations of a batch handed out live",
        "self._observation = observation.copy()",
        "self._observation = observation",
    ),
    Mutant(
        "a command for all environments",
        "memory = changed if mask is None else trees.chosen(mask, changed, memory)",
        "memory = changed",
    ),
    Mutant(
        "commands of environments replace one another", "value, mask = np.where(mask[:, None], value, before)", "mask"
    ),
    Mutant(
        "a copy resets the shared model",
        "        if share_model:\n            self._shared",
        "        if False:\n            self._shared",
    ),
    Mutant("kicks forgotten in batches", "data.qvel[stepping] += inputs.kick[stepping]", "pass"),
    Mutant("two threads in one environment", "not lock.acquire(False)", "False"),
    # Demonstrators and policies.
    Mutant("sign of the sweep", "= -1.0 if leg.side", "= 1.0 if leg.side"),
    Mutant("steered the wrong way", "copysign(STEERING, speed)", "copysign(STEERING, -speed)"),
    Mutant("damping has the wrong sign", "- damping * velocities", "+ damping * velocities"),
    Mutant("no crouch", "steps < self.settle", "steps < 0"),
    Mutant(
        "an environment walks by another's preset",
        "np.atleast_1d(value) for value in values]",
        "np.atleast_1d(value) for value in values[::-1]]",
    ),
    Mutant(
        "presets take turns from environment to environment", "= np.asarray(seeds) % len", "= np.asarray(rows) % len"
    ),
    Mutant("the same noise in all episodes", "default_rng((seed, 1))", "default_rng(1)"),
    # Style.
    Mutant("feet in the air slip", " * track.contacts", ""),
    Mutant("early taken for late", "actual * wanted.conj()", "wanted * actual.conj()"),
    Mutant("mirror image of a foot's path forgotten", " * (1.0, -1.0, 1.0)", ""),
    Mutant(
        "motors win back what they brake",
        "np.diff(track.joint_angles, axis=0)).clip(0.0).sum()",
        "np.diff(track.joint_angles, axis=0)).sum()",
    ),
    Mutant("a foot that bounces strides", "0.5 * foot_clearance(track)", "0.0"),
    Mutant("order of tracks in a file", "index) for index in range(count)]", "index) for index in range(count)[::-1]]"),
    Mutant(
        "a replay that differs let through",
        "np.array_equal(track.rewards, episode.rewards)",
        "len(track.rewards) == episode.length",
    ),
    # Searches and datasets.
    Mutant("all legs lead alike", "offset + leads[rank]", "offset + leads[0]"),
    Mutant("the fallen go on earning", "totals += rewards * counted", "totals += rewards"),
    Mutant("a search is told its worst", "[-value for value in fitness]", "fitness"),
    Mutant("a damaged episode is read", "if found[key] != value:", "if found[key] is value:"),
    # Clips and pages.
    Mutant("axes of glTF are a mirror", "_AXES = (1, 2, 0)", "_AXES = (0, 2, 1)"),
    Mutant(
        "the seam of a loop is left",
        "np.linspace(-0.5, 0.5, len(motion.joints))",
        "np.zeros(len(motion.joints))",
    ),
    Mutant("clips begin anywhere", "draft.motion.begun(begin)", "draft.motion.begun(0)"),
    Mutant("soles of clips hover", "self.motion.lowered(self.contacts(body)[0])", "self.motion.lowered(0.0)"),
    Mutant(
        "sRGB written as linear",
        "linear = np.where(colour <= 0.04045, colour / 12.92,",
        "linear = np.where(True, colour,",
    ),
    Mutant("the mouse pulls at nothing", "data.xfrc_applied[:] = forces", "data.xfrc_applied[:] = 0.0"),
    # Studies and datasets of agents.
    Mutant("medium agents are the best", ">= MEDIUM * best", ">= best"),
    Mutant("evaluations under way count", "if count == evaluation.EPISODES and step in times", "if step in times"),
    Mutant(
        "runs compared wherever they are", "int(np.flatnonzero(each.steps == max(common))[0]) + 1", "len(each.steps)"
    ),
    Mutant("a run made by two studies", "fcntl.flock(file, fcntl.LOCK_EX", "fcntl.flock(file, fcntl.LOCK_SH"),
    Mutant("shares of a study overlap", "study.runs[part::parts]", "study.runs[part:]"),
)


def place(mutant: Mutant) -> pathlib.Path:
    """Return the one file of the package that holds a mutant's text once, as a path in the project.

    Raises:
        ValueError: there is none, or the text is there more often.
    """
    counts = {path: path.read_text().count(mutant.old) for path in sorted((ROOT / "arc_suite").rglob("*.py"))}
    found = [str(path.relative_to(ROOT)) for path, count in counts.items() for _ in range(count)]
    if len(found) != 1:
        raise ValueError(f"{mutant.mistake}: expected {mutant.old!r} once in the package, found it in {found}")
    return pathlib.Path(found[0])


def copied(folder: pathlib.Path) -> pathlib.Path:
    """Return a copy of the project in a folder."""
    ignored = shutil.ignore_patterns(".git", ".venv*", "out", "__pycache__", "*.egg-info")
    return pathlib.Path(shutil.copytree(ROOT, folder / "project", ignore=ignored))


def caught_by(project: pathlib.Path, first: str = "") -> str | None:
    """Return the first test of a project that fails, or None.

    Args:
        project: its folder.
        first: a folder of tests to try before all others.
    """
    fast = ["-m", "not slow and not long"]
    near = [[*fast, f"tests/{first}"]] if first and (project / "tests" / first).is_dir() else []
    for selection in (*near, fast, ["-m", "slow and not long"], ["-m", "long"]):
        command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *selection]
        environment = {**os.environ, "PYTHONPATH": str(project)}
        result = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
        failed = [line for line in result.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        if failed:
            return failed[0].split(" - ")[0]
        if result.returncode:
            return result.stderr.strip() or result.stdout.strip()
    return None


def tried(mutant: Mutant) -> str | None:
    """Return the first test that catches a mutant, or None."""
    path = place(mutant)
    with tempfile.TemporaryDirectory() as folder:
        project = copied(pathlib.Path(folder))
        text = (project / path).read_text()
        (project / path).write_text(text.replace(mutant.old, mutant.new))
        return caught_by(project, path.parts[1])


def main() -> int:
    """Tries the mutants and prints a line for each."""
    check, words = "--check" in sys.argv[1:], [word for word in sys.argv[1:] if word != "--check"]
    mutants = [mutant for mutant in MUTANTS if all(word in mutant.mistake for word in words)]
    lost = 0
    for mutant in mutants:
        try:
            path = place(mutant)
            compile((ROOT / path).read_text().replace(mutant.old, mutant.new), path, "exec")
            if check:
                print(f"{mutant.mistake:<48} {path}")
        except (ValueError, SyntaxError) as error:
            lost += 1
            print(error)
    if check or lost:
        return int(lost > 0)
    with tempfile.TemporaryDirectory() as folder:
        if test := caught_by(copied(pathlib.Path(folder))):
            print(f"without any mistake: {test}")
            return 1
    survivors = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        tests = tqdm(pool.map(tried, mutants), total=len(mutants), unit="mutant", disable=None)
        for mutant, test in zip(mutants, tests, strict=True):
            survivors += test is None
            tqdm.write(f"{mutant.mistake:<48} {test or 'SURVIVES'}")
    return int(survivors > 0)


if __name__ == "__main__":
    sys.exit(main())
