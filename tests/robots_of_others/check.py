"""Import the robots of `zoo.py`, compare their dynamics with their files, and walk them: `make check-robots`, minutes.

python tests/robots_of_others/check.py FOLDER [--tasks] [NAME ...]
python tests/robots_of_others/check.py FOLDER --page studies/robots_of_others.md

Prints a table and writes it to FOLDER/robots.csv. Of each file: whether it comes in, in how many of 200 states the
accelerations have the same bits as the file's own, and the walks of two presets, three seeds of 20 s. With `--tasks`
(`make check-robots-release`, hours), and for the page, all presets are tried in all tasks, too. Of each task: the
preset that suits it, its metric, and how many of eight episodes end upright. Fails where
  - a file that should come in does not, or one that should not does;
  - accelerations differ;
  - a robot of MUST_WALK does not walk, or is at its torque limits in 3 % of the samples;
  - fewer than seven tenths of the NEW robots walk;
  - the preset that suits a task gains .05 less than another that obeys the same commands, in 32 episodes on which
    neither was chosen.
"""

import csv
import multiprocessing
import pathlib
import sys
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[2] / "tools")]

import reference  # noqa: E402
import zoo  # noqa: E402
from studies.pages import table_writer  # noqa: E402

from arc_suite.cpg import Demonstrator  # noqa: E402
from arc_suite.envs.setup import Setup  # noqa: E402
from arc_suite.evaluation import protocol, suitability, walking  # noqa: E402
from arc_suite.importing import import_robot  # noqa: E402
from arc_suite.models.soundness import flaws  # noqa: E402
from arc_suite.robots.spec import Body  # noqa: E402
from arc_suite.tasks import TASKS  # noqa: E402

WALKS = {"medium": "walk", "steered": "steer"}  # task of each preset
SEEDS, SECONDS = 3, 20.0
LEAST, MOST, MOST_LIMITED = 0.8, 1.25, 0.03
MUST_WALK = ("go2_like", "a1_like", "hexapod", "go2", "aliengo", "anymal_b", "a1")
SHARE = 0.7  # of the NEW robots
STEPS = 300  # control steps of an episode of each task
STEPS_OF_LEAP = 1000  # the first trench is 7 to 9 standing heights from the start
JUDGING_SEEDS = range(508, 540)  # of a preset that eight episodes have found to be better than the default
MIN_GAIN = 0.2  # of the best preset over standing still, reward of a control step; a task with less is not solved


class Walk(NamedTuple):
    """Of one preset, over all seeds.

    Attributes:
        slowest, fastest: speeds as shares of the target.
        falls: of seeds.
        limited: share of samples, of all joints at all control steps, in which a motor is at its torque limit.
    """

    slowest: float
    fastest: float
    falls: int
    limited: float

    @property
    def good(self) -> bool:
        return self.slowest >= LEAST and self.fastest <= MOST and not self.falls


class TaskTrials(NamedTuple):
    """Of the presets that suit a task and obey its commands, the default first."""

    presets: tuple[suitability.Trial, ...]
    shortfall: float

    def __str__(self) -> str:
        default = self.presets[0]
        return f"{default.preset}, {_tried_text(default)}"


class Row(NamedTuple):
    """Of one file; see the table."""

    robot: zoo.Robot
    line: str  # that refuses it, or the first flaw of the body, or why it could not be walked
    legs: int = 0
    same: int | None = None
    walks: dict[str, Walk | None] = {}
    tasks: tuple["TaskTrials", ...] = ()

    @property
    def came(self) -> bool:
        return self.legs > 0

    @property
    def walked(self) -> bool:
        return bool(self.walks) and all(one is not None and one.good for one in self.walks.values())

    @property
    def strained(self) -> bool:
        return any(one is not None and one.limited >= MOST_LIMITED for one in self.walks.values())

    def gains(self) -> list[str]:
        """Return a line for each task in which another preset gains more than the default."""
        lines = []
        for trials in self.tasks:
            if trials.shortfall > suitability.MAX_SHORTFALL:
                default, best = trials.presets[0], max(trials.presets, key=lambda trial: trial.mean_return)
                lines.append(f"{default.task}: {default.preset} gains {trials.shortfall:.0%} less than {best.preset}")
        return lines

    def faults(self) -> list[str]:
        found = []
        if self.came == (self.robot.refused is not None):
            found.append(f"expected it {'to come in' if self.robot.refused is None else 'to be refused'}")
        if not self.came and (self.robot.refused or "") not in self.line:
            found.append(f"expected a line with {self.robot.refused!r}, got {self.line!r}")
        if self.came and self.same != reference.STATES:
            found.append(f"same bits in {self.same} of {reference.STATES} states")
        if self.robot.name in MUST_WALK and (not self.walked or self.strained):
            found.append("does not walk within the limits of its motors")
        found += self.gains()
        return [f"{self.robot.name}: {fault}" for fault in found]


def row(robot: zoo.Robot, folder: pathlib.Path, with_tasks: bool) -> Row:
    """Import a file and try the body; an error that is no single line is shown by its type."""
    path = zoo.place(robot, folder)
    found, refusal = attempt(import_robot, path, feet=robot.feet)
    if found is None:
        return Row(robot, refusal)
    body = found.body
    same, line = attempt(reference.same_bits, path, body)
    lines, walks = [line], {}
    if robot.group != zoo.ODD:
        for preset, task in WALKS.items():
            walks[preset], line = attempt(walk, body, task, preset)
            lines.append(line)
    tasks = ()
    if with_tasks and robot.group != zoo.ODD:
        tasks, line = attempt(try_tasks, body)
        lines.append(line)
    flawed, line = attempt(flaws, body)
    lines += [line, *(flaw.text for flaw in flawed or ())]
    return Row(robot, next(filter(None, lines), ""), len(body.legs), same, walks, tasks or ())


def try_tasks(body: Body) -> tuple[TaskTrials, ...]:
    """Try the presets of a body in each task."""
    trials_of_tasks = []
    for task in TASKS:
        steps = STEPS_OF_LEAP if task == "leap" else STEPS
        trials = suitability.try_presets(body, task, suitability.SEEDS, steps)
        trials_of_tasks.append(TaskTrials(tuple(trials), find_shortfall(body, task, trials, steps)))
    return tuple(trials_of_tasks)


def find_shortfall(body: Body, task: str, trials: Sequence[suitability.Trial], steps: int) -> float:
    """Return how much less the default gains than the best preset, as a share of its gain.

    The best of several presets is partly lucky. A preset that seems better is tried again, beside the default, in
    episodes on which it was not chosen.
    """
    standing = suitability.stand_still(body, task, suitability.SEEDS, steps)
    best = max(trials, key=lambda trial: trial.mean_return)
    if best.mean_return - standing.mean_return < MIN_GAIN * steps:
        return 0.0
    shortfall = suitability.shortfall(trials, standing)
    if shortfall <= suitability.MAX_SHORTFALL:
        return shortfall
    setup = Setup.of(body, task)
    rivals = [suitability.try_preset(setup, trial.preset, JUDGING_SEEDS, steps) for trial in (trials[0], best)]
    return suitability.shortfall(rivals, suitability.stand_still(body, task, JUDGING_SEEDS, steps))


def attempt(function, *arguments, **keywords):
    """Return what a function returns and no line; or None and the line of its error."""
    try:
        return function(*arguments, **keywords), ""
    except ValueError as error:  # SpecError is one
        return None, str(error)
    except Exception as error:
        return None, f"{type(error).__name__}: {error}"


def walk(body: Body, task: str, preset: str) -> Walk:
    """Walk a body straight ahead."""
    tries = [_tried(body, task, preset, seed) for seed in range(SEEDS)]
    speeds, falls, limited = zip(*tries, strict=True)
    return Walk(min(speeds), max(speeds), sum(falls), float(np.mean(limited)))


def _tried(body: Body, task: str, preset: str, seed: int) -> tuple[float, bool, float]:
    """Return speed as a share of the target, whether it fell, and the share of samples at the torque limit."""
    environment = Setup.of(body, task, {"time_limit": SECONDS, "on_divergence": "truncate"}).load()
    steps = round(SECONDS / environment.control_timestep())
    limits = np.array([joint.torque for leg in body.legs for joint in leg.joints])
    names = body.joint_names
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    motors = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in names]
    limited, watcher = [], walking.WalkWatcher(environment)
    for timestep in protocol.rollout(environment, Demonstrator(environment, preset), seed, steps):
        if timestep.first() and "command" in environment.task.definition.commands:
            environment.command("command", (1.0, 0.0, 0.0))
        watcher(timestep)
        limited.append((abs(data.actuator_force[motors]) >= 0.999 * limits).mean())
        if watcher.ending != walking.TIME:
            break
    verdict = watcher.verdict(steps)
    return verdict.speed, verdict.fell, float(np.mean(limited[1:]))


HEADER = ["robot", "group", "legs", "same bits"]
HEADER += [f"{preset} {figure}" for preset in WALKS for figure in ("slowest", "fastest", "falls", "at limit")]
HEADER += [*TASKS, "walks", "line"]


def cells(row: Row) -> list[str]:
    """Return a row of the table."""
    figures = []
    for preset in WALKS:
        one = row.walks.get(preset)
        figures += ["", "", "", ""] if one is None else [f"{value:.3g}" for value in one]
    came = ["" if not row.came else str(row.legs), "" if row.same is None else str(row.same)]
    tasks = [str(trials) for trials in row.tasks] or [""] * len(TASKS)
    return [row.robot.name, row.robot.group, *came, *figures, *tasks, "yes" if row.walked else "no", row.line]


def page(rows: list[Row]) -> str:
    """Return tables of Markdown: speeds, results of each task, and the tasks in which the default is not the best."""
    found = []
    for one in (one for one in rows if one.walks):
        medium, steered = ("did not run" if each is None else _said(each) for each in one.walks.values())
        found.append(f"| {one.robot.name} | {one.robot.group} | {one.legs} | {medium} | {steered} |")
    speeds = ["| robot | | legs | `medium` | `steered` |", "|---|---|---|---|---|", *found]
    tasks = [task for task in TASKS if task != "walk"]
    trials = [f"| | {' | '.join(tasks)} |", "|---" * (1 + len(tasks)) + "|"]
    for one in rows:
        if one.tasks:
            texts = {each.presets[0].task: _tried_text(each.presets[0]) for each in one.tasks}
            trials.append(f"| {one.robot.name} | {' | '.join(texts[task] for task in tasks)} |")
    gains = ["| robot | another preset is better |", "|---|---|"]
    gains += [f"| {one.robot.name} | {'; '.join(one.gains())} |" for one in rows if one.gains()]
    return "\n".join([*speeds, "", *trials, "", *gains])


def _tried_text(trial: suitability.Trial) -> str:
    return f"{trial.value:.2f}, {trial.upright}/{trial.episodes}"


def _said(each: Walk) -> str:
    falls = f", falls in {each.falls} of {SEEDS}" if each.falls else ""
    return f"{each.slowest:.2f} to {each.fastest:.2f}{falls}, limit {100.0 * each.limited:.1f}"


def main(folder: str, *names: str) -> int:
    """Try all files, or those that are named; print, write and judge the table."""
    place, write = pathlib.Path(folder), None
    with_tasks = "--page" in names or "--tasks" in names
    if "--page" in names:
        write, names = table_writer(pathlib.Path(names[-1])), ()
    names = [name for name in names if name != "--tasks"]
    chosen = [robot for robot in zoo.ROBOTS if not names or robot.name in names]
    rows = []
    with multiprocessing.get_context("spawn").Pool() as pool:
        for one in [pool.apply_async(row, (robot, place, with_tasks)) for robot in chosen]:
            rows.append(one.get())
            print(" | ".join(cells(rows[-1])), flush=True)
    with (place / "robots.csv").open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([HEADER, *map(cells, rows)])
    if write is not None:
        write(page(rows))
    came = [one for one in rows if one.came]
    same = sum(one.same == reference.STATES for one in came)
    print(f"{len(came)} of {len(rows)} files come in, {same} with the same bits")
    faults = [fault for one in rows for fault in one.faults()]
    for group, share in ((zoo.MET, 0.0), (zoo.NEW, SHARE)):
        ones = [one for one in rows if one.robot.group == group]
        line = f"{sum(one.walked for one in ones)} of {len(ones)} {group} robots walk"
        print(line)
        if sum(one.walked for one in ones) < share * len(ones):
            faults.append(f"{line}: expected {share:.0%}")
    print(*faults, sep="\n")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
