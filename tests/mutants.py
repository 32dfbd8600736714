"""Plants mistakes on purpose, one at a time, in a copy of the project, and tells which test catches each.

`python tests/mutants.py` runs all, or those whose names hold the words given; exit status 1 if one
survives. It takes long: `make check-mutants`. With `--check` it only finds where each would be planted.
"""

import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from tqdm import tqdm

ROOT = pathlib.Path(__file__).parents[1]
ROOMS = ("arc_suite", "tools/preset_search")

# By mistake: a text that `ROOMS` hold once, in which «right→wrong» marks the right code and the wrong code.
MUTANTS = {
    # Bodies.
    "swapped leg": 'leg.«mirrored(→replace(name=»leg.name.replace("l", "r")) for leg in LEFT_LEGS)\n\n'
    'BODY = Body(\n    name="queen"',
    "mirrored axis keeps its sign": "axis=(«-→»x, y, -z)",
    "leg order": "legs=(«FRONT_LEFT_LEG, FRONT_RIGHT_LEG→FRONT_RIGHT_LEG, FRONT_LEFT_LEG»,",
    "armature of the hip": "-40.0, 40.0),\n    armature=«1.0→2.0»",
    "sign of zero kept": "float(value)« + 0.0→»",
    "a body's joints not looked at": "«body.joint_names != robot.joint_names→False»",
    "both sides of a body in step": 'side_offset = «0.5→0.0» if leg.side == "right"',
    "feet of a random body above the floor": "down = «(height - foot_radius)→height * 0.9» /",
    "a scaled robot keeps its name": 'return «f"{stem}_{change}"→body.name»',
    # Models.
    "contact margin doubled": "default=«0.005→0.01»",
    "ballast touches the floor": '"mass": ballast.mass, **«_TOUCHES_NOTHING→touches_floor»}',
    "wrong number of substeps": "2, 1000, default=«25→24»",
    "joints of a giant as fast as a mite's": "«_FREQUENCY_SHARE / control_timestep(body)→7.0»",
    "contacts of a giant as hard as a mite's": '"solref": («simulation.contact_time→0.02», 1.0)',
    # Arenas.
    "triangles of the ground exchanged": "is_right = u_in_cell «>→<» v_in_cell",
    "stairs without their fourth tread": "(treads + 1).clip(0, «4→3») -",
    "ground under the torso's middle alone": "x in («-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0→0.0,) for y in (0.0,»)",
    "lanes all alike": "np.random.RandomState(«(self.seed, KINDS.index(kind), kinds_before.count(kind))→self.seed»)",
    "feet may sink": "is_stuck=steps_under_ground «>= SUNK_STEPS→< 0»",
    "levels never fall": "«xp.where(stream.outcome < down, (level - 1).clip(0), level)→level»",
    "the highest level for ever": "& «(chance >= STAY_PROBABILITY)→False»",
    "a scan that does not turn": "x = position[..., 0:1] + «cosine * forward - sine * left→forward»",
    "a command along the torso": "«-→»xp.sin(heading), turning",
    "who lies is healthy": "is_healthy = is_high & «~lies & →»(",
    # Simulations.
    "no sensors, so no contact forces": "«option.disableflags = flags→pass»\n",
    "one substep too few": "mj_step(model, data, nstep - «1→2»)",
    "one substep of batches too few": "simulations.step(mask, nstep - «1→2»)",
    "margin of a pair not summed": "model.geom_margin[pair].«sum→max»()",
    "friction of a pair not mixed": "friction«.max(axis=0)→[0]»",
    "Euler without damping": "«        and model.dof_damping.any()\n→»",
    "clock not put back": "if «self._variable.value is None→False»:",
    "somebody's own clock taken": "if «self._variable.value == self._clock→True»:",
    "divergence unseen": "return simulations.warning[..., 1].any(axis=-1)«→ & False»",
    "fork unnoticed": "    global count\n    count += «1→0»\n",
    "batch destroyed in a forked child": "«        forks.keep(self._simulations)\n→»",
    "picture of another moment": "«        decorated.pose(qpos, share, mocap_pos, markers, failed_legs, swings)\n→»",
    "user's choice of OpenGL overwritten": '«"MUJOCO_GL" not in os.environ and →»',
    # Tasks.
    "dropped clip of the contact forces": "forces.reshape(forces.shape[:-2] + (-1,))«.clip(-1.0, 1.0)→»,",
    "sign of a weight": '        "vertical_velocity": «-→»0.02',
    "yaw rate penalized in place of pitch rate": "pitch_rate = component(velocities, «4→5»)",
    "stance and swing exchanged": "+ offsets) % TWO_PI «<→>» TWO_PI",
    "gait clock advances too late": "phases[tick - 1] + «→0.5 * »advance",
    "a long episode's clock jumps": "ends[«np.argmin(distances_from_zero)→-1»]",
    "previous action forgotten": (
        'the action itself as what to write."""\n'
        "        return memory._replace(action=action, previous_action=«memory.→»action)"
    ),
    "quaternion not normalized": "«qpos[3:7] /= np.linalg.norm(qpos[3:7])→pass»",
    "reset noise to one side": "random.uniform(«-→0.0 * »widths, widths)",
    "speed of the state in place of the frame's": "x = component(readings.«frame→torso»_position, 0) + 0.0  # a copy\n",
    "the first step starts from nowhere": "_replace(«x=x, →»energy=",
    "swaying pays": "return speed_share.clip(«max=→-1.0, »1.0)",
    "costs without a bound": "«ratio.__array_namespace__().sqrt(1.0 + ratio * ratio)→1.0»",
    "braking counts as work": "(angles - memory.angles)).«clip(0.0).→»sum",
    "schedule errors counted twice": "memory.all_schedule_errors + «→2.0 * »schedule_errors",
    "blocks declared in another order": '«→"velocities": velocities(body, headed),\n'
    '        »"posture": posture(body),«\n'
    '        "velocities": velocities(body, headed),→»',
    "blocks cut one too early": "slice«(end - size, end→(max(end - size - 1, 0), end - 1»)",
    "blocks joined unchecked": "for name, block in «blocks.items()] != self._sizes_in_order→()]»",
    "feet stay in the ground": "«→0.0 * »(self.clearances - readings.foot_heights).max",
    "a memory written in place": "«(1.0 - leaks) * core.motion→core.motion.__imul__(1.0 - leaks)»",
    "a command that is ignored": "xp.where(xp.isnan(memory.live), scheduled, «memory.live→0.0»)",
    "a schedule that does not end": "step = steps« % ends[..., -1]→»\n    ended_values",
    "a live command counts as a new one": "return begins« & schedule_holds→»",
    "who rests has another command": "~«(self._ended | self._resting)→self._ended» & self._task.resampled(",
    "followed from behind": "cosine * x «+→-» sine * y",
    "turned the wrong way": "xp.arctan2(2.0 * («w * z + x * y→x * y - w * z»)",
    # Modifiers.
    "a leg limp from the start": "(elapsed >= «FAILS_FROM→0»",
    "kicks a step late": "step = elapsed % period« + 1→»",
    "weak motors give all": "ctrl = «strength * →»inputs.ctrl",
    "actions not delayed": "return state._replace(waiting=under_way[..., :-1, :]), «arrived→action»",
    "the same noise in every step": "key« ^ (step * _GOLDEN)→»",
    "positions held without damping": "(«self.damping→0.0» * state.speeds)",
    "the reward sees what weak motors give": "self.task.before(memory.task, «→0.5 * »action)",
    "a changed model stays so": "«self._restore_compiled_fields()→pass»\n        super().reset(keyframe_id)",
    "the last substep of batches on the compiled model": "set_models(«self._models→None»)\n"
    "            simulations.step(mask)",
    # Environments.
    "dropped clip of the action": "return array«.clip(-1.0, 1.0)→»",
    "NaN let through": "is_finite = np.«isfinite(array→ones(array.shape, bool»)",
    "ignored seed": "np.random.RandomState(«valid_seed→»), valid_seed)",
    "fall reported as a time limit": "if terminated:\n            return «0.0→1.0»",
    "a new stream carries on the old one": "self._stream_begins = «True→False»  # with the next episode",
    "a new stream of an environment carries on the old one": "self._streams_begin[index] = «True→False»",
    "environments share a seed": "[first« + index→» for index in range(self.num_envs)]",
    "observations of a batch handed out live": "self._observation = observation«.copy()→»",
    "a command for all environments": "memory = changed_memory"
    "« if mask is None else trees.where(mask, changed_memory, memory)→»",
    "commands of environments replace one another": "value = «np.where(mask[:, None], value, earlier_value)→value»",
    "a copy resets the shared model": "        if «share_model→False»:\n            self._shared",
    "kicks forgotten in batches": "«data.qvel[mask, : inputs.kick.shape[-1]] += inputs.kick[mask]→pass»",
    "two threads in one environment": "«not lock.acquire(False)→False»",
    # Demonstrators and policies.
    "sign of the sweep": "= «-→»1.0 if leg.side",
    "steered the wrong way": "copysign(STEERING, «→-»speed)",
    "damping has the wrong sign": "«-→+» damping * velocities",
    "no crouch": "steps < «self.settle→0»",
    "an environment walks by another's preset": "np.atleast_1d(value) for value in values«→[::-1]»]",
    "presets take turns from environment to environment": "= np.asarray(«seeds→rows») % len",
    "the same noise in all episodes": "default_rng(«(seed, 1)→1»)",
    # Style.
    "feet in the air slip": "« * track.contacts→»",
    "early taken for late": "«actual * prescribed→prescribed * actual».conj()",
    "mirror image of a foot's path forgotten": "« * (1.0, -1.0, 1.0)→»",
    "motors win back what they brake": "np.diff(track.joint_angles, axis=0)).«clip(0.0).→»sum()",
    "a foot that bounces strides": "«0.5 * foot_clearance(track)→0.0»",
    "order of tracks in a file": "for index in range(len(arrays_by_index))«→[::-1]»]",
    "a replay that differs let through": "«np.array_equal(track.rewards, episode.rewards)→"
    "len(track.rewards) == episode.length»",
    # Searches and datasets.
    "all legs lead alike": "offset + leads[«rank→0»]",
    "the fallen go on earning": "totals += rewards« * counts→»",
    "a search is told its worst": "«[-value for value in fitness]→fitness»",
    "a damaged episode is read": "if stored_attributes[key] «!=→is» value:",
    # Clips and pages.
    "axes of glTF are a mirror": "_AXES = («1, 2, 0→0, 2, 1»)",
    "the seam of a loop is left": "np.«linspace(-0.5, 0.5, →zeros(»len(motion.joints))",
    "clips begin anywhere": "draft.motion.start_at(«begin→0»)",
    "soles of clips hover": "self.motion.lower(«height→0.0»)",
    "sRGB written as linear": "linear = np.where(«color <= 0.04045, color / 12.92→True, color»,",
    "the mouse pulls at nothing": "data.xfrc_applied[:] = «forces→0.0»",
    # Studies and datasets of agents.
    "medium agents are the best": ">= «MEDIUM * →»best",
    "evaluations under way count": "if« count == evaluation.CURVE_EPISODES and→» step in times",
    "a run made by two studies": "fcntl.flock(file, fcntl.«LOCK_EX→LOCK_SH»",
    "shares of a study overlap": "study.runs[part:«:parts→»]",
}


def texts(marked: str) -> tuple[str, str]:
    """Return a marked text as it is in the code, and with the mistake."""
    old, new = (re.sub("«(.*?)→(.*?)»", which, marked, flags=re.DOTALL) for which in (r"\1", r"\2"))
    return old, new


def place(mistake: str) -> pathlib.Path:
    """Return the one file of `ROOMS` that holds a mutant's text once, as a path in the project.

    Raises:
        ValueError: there is none, or the text is there more often.
    """
    old, _ = texts(MUTANTS[mistake])
    counts = {path: path.read_text().count(old) for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))}
    found = [str(path.relative_to(ROOT)) for path, count in counts.items() for _ in range(count)]
    if len(found) != 1:
        raise ValueError(f"{mistake}: expected {old!r} once in {' and '.join(ROOMS)}, found it in {found}")
    return pathlib.Path(found[0])


def planted(mistake: str, folder: pathlib.Path) -> str:
    """Return the source of a mutant's file in a folder of the project, with the mistake."""
    return (folder / place(mistake)).read_text().replace(*texts(MUTANTS[mistake]))


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
    fast = ["-m", "not slow and not long and not release"]
    near = [[*fast, f"tests/{first}"]] if first and (project / "tests" / first).is_dir() else []
    for selection in (*near, fast, ["-m", "slow and not long and not release"], ["-m", "long and not release"]):
        command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider", *selection]
        environment = {**os.environ, "PYTHONPATH": str(project)}
        result = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
        failed = [line for line in result.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
        if failed:
            return failed[0].split(" - ")[0]
        if result.returncode:
            return result.stderr.strip() or result.stdout.strip()
    return None


def tried(mistake: str) -> str | None:
    """Return the first test that catches a mutant, or None."""
    path = place(mistake)
    with tempfile.TemporaryDirectory() as folder:
        project = copied(pathlib.Path(folder))
        (project / path).write_text(planted(mistake, project))
        return caught_by(project, path.parts[1])


def main() -> int:
    """Tries the mutants and prints a line for each."""
    check, words = "--check" in sys.argv[1:], [word for word in sys.argv[1:] if word != "--check"]
    mutants = [mistake for mistake in MUTANTS if all(word in mistake for word in words)]
    lost = 0
    for mistake in mutants:
        try:
            compile(planted(mistake, ROOT), mistake, "exec")
            if check:
                print(f"{mistake:<48} {place(mistake)}")
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
        for mistake, test in zip(mutants, tests, strict=True):
            survivors += test is None
            tqdm.write(f"{mistake:<48} {test or 'SURVIVES'}")
    return int(survivors > 0)


if __name__ == "__main__":
    sys.exit(main())
