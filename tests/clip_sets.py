"""All clips of robots, examples and random bodies: `make check-clip-sets`, two hours on two cores.

python tests/clip_sets.py [NUMBER OF RANDOM BODIES] [FOLDER]

Bodies are measured in as many processes as there are cores. The folder, `out/clip_sets`, holds a file for each body:
a run that was interrupted goes on. Remove it when clips change.

Prints for each body the cycles of its loops and the largest seam, how far its start and stop are from walk and idle
before they are made to meet, the slip of its walk as it is and planted, and what was left out. Lengths are in standing
heights. `clip_sets.csv` in the folder has these numbers. Then prints how many bodies have each clip, and the most
frequent line of those that are left out. Of `slow` and `run` it prints speed and cadence as multiples of the walk, and
of all paces the duty factor of feet and the share of samples in which feet follow the schedule of the gait. Fails if a
frame of a clip breaks a bound, a body has no file, fewer than 95 % of the random bodies with three joints a leg or more
have loops of one cycle, or fewer than 85 % of the bodies stop from a pose within 0.08 of the walk's. Bodies with two
joints a leg often need two cycles.
"""

import collections
import concurrent.futures
import csv
import functools
import json
import os
import re
import sys
from pathlib import Path

import mujoco
import numpy as np
from tqdm import tqdm

from arc_suite.animation.clips import bounds, on_ground, planting, swaying
from arc_suite.animation.clips.catalog import CLIPS, WalkLoop
from arc_suite.animation.clips.clips import FPS, sample_clip
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.animation.clips.passages import cut_passage
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.bodies.families import sound_body
from arc_suite.envs.setup import Setup
from arc_suite.models.kinematics import Legs
from arc_suite.robots import ROBOTS, gaits, spec_files
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import clock

ONE_CYCLE, CONNECTED, APART = 0.95, 0.85, 0.08  # legs of two joints often stop from poses of their own
LOW = 0.01  # of a sole that slips
PACES = ("slow", "walk", "fast", "run")


def make_recorder(body) -> Recorder:
    """Return a recorder that records each walk and each passage once."""
    recorder = Recorder(Setup.of(body, "steer"), "cpg", None)
    recorder.record_walk = functools.cache(recorder.record_walk)
    recorder.record_transition = functools.cache(recorder.record_transition)
    return recorder


def apart(body, one, other) -> float:
    """Return the distance of the farthest part of two poses above the same place of the ground, standing heights."""
    model = compile_model(body)
    data, places = mujoco.MjData(model), []
    for pose in (one, other):
        data.qpos[:] = np.concatenate([pose.position, pose.quaternion, pose.joints])
        mujoco.mj_kinematics(model, data)
        frame = data.body("torso").xmat.reshape(3, 3)
        ahead = frame[:2, 0] / np.linalg.norm(frame[:2, 0])
        level = np.array([[ahead[0], ahead[1], 0.0], [-ahead[1], ahead[0], 0.0], [0.0, 0.0, 1.0]])
        places.append((data.xpos[1:] - pose.position * (1.0, 1.0, 0.0)) @ level.T)
    return float(np.linalg.norm(places[0] - places[1], axis=-1).max() / body.torso.standing_height)


def slip(body, motion) -> tuple[float, float]:
    """Return the path of soles near the ground by that of the root, and how far they sink in it, standing heights."""
    legs, height = Legs.of(body), body.torso.standing_height
    feet = planting._foot_positions(legs, motion) - (0.0, 0.0, 1.0) * legs.radii[:, None]
    low = feet[..., 2] < LOW * height
    paths = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * (low[1:] & low[:-1])
    root = np.linalg.norm(np.diff(motion.root[:, :2], axis=0), axis=-1).sum()
    return float(paths.sum(axis=0).mean() / root), float(-feet[..., 2].min() / height)


def broken(body, made) -> dict[str, str]:
    """Return which bounds are broken in the frames of clips, by name."""
    excesses = {}
    for name, draft in made.items():
        excess = bounds.find_excess(body, CLIPS[name], sample_clip(name, body, draft, FPS).motion)
        if excess:
            excesses[name] = excess
    return excesses


def measure_paces(body, recorder: Recorder, made) -> dict[str, float]:
    """Return speed, cadence, duty factor, share of samples in schedule and height of steps of paces, by name.

    Speed and cadence are multiples of the walk's, heights standing heights. The schedule is that of the gait at the
    pace, from the touchdown of the first foot on, with which loops begin.
    """
    numbers = {}
    for name in [name for name in PACES if name in made]:
        draft = made[name]
        setup = recorder._setup_at_pace(gaits.PACES[name]) if name in gaits.PACES else recorder._setup
        parameters = setup.definition.parameters
        soles = on_ground.measure_ground(body, draft.motion).soles[:-1]
        is_down = soles < LOW * body.torso.standing_height
        phases = 2.0 * np.pi * draft.cycles * np.arange(len(is_down)) / len(is_down) - parameters.phase_offsets[0]
        schedule = clock.desired_contacts(phases, parameters.duty_factor, parameters.phase_offsets)
        numbers[f"{name} duty"] = is_down.mean()
        numbers[f"{name} in schedule"] = (is_down == schedule).mean()
        numbers[f"{name} clearance"] = soles.max(axis=0).mean() / body.torso.standing_height
        if name != "walk" and "walk" in made:
            numbers[f"{name} speed"] = draft.motion.twist[0] / made["walk"].motion.twist[0]
            numbers[f"{name} cadence"] = made["walk"].cycle / draft.cycle
    return numbers


def measured(body) -> tuple[dict[str, float], dict[str, str]]:
    """Return numbers of the clips of a body by name, and the reasons of those that are left out."""
    recorder, left_out = make_recorder(body), {}
    made = make_drafts(recorder, list(CLIPS), iter, left_out)
    light = make_drafts(recorder, ["walk", "idle"], iter, {}, character=swaying.choose_character(0.0))
    loops = [draft for name, draft in made.items() if isinstance(CLIPS[name], WalkLoop)]
    found = {"clips": len(CLIPS) - len(left_out), "cycles": max((draft.cycles for draft in loops), default=np.nan)}
    found["joints"] = min(len(leg.joints) for leg in body.legs)
    found["broken"] = len(excesses := broken(body, {name: made[name] for name in CLIPS if name not in left_out}))
    left_out |= {name: f"BROKEN: {excess}" for name, excess in excesses.items()}
    found |= measure_paces(body, recorder, made)
    found["seam"] = np.degrees(max((draft.motion.seam for draft in loops), default=np.nan))
    if "walk" in made and "idle" in made:
        walk, transition = light["walk"], recorder.record_transition(CLIPS["walk"].command)
        start, stop = (cut_passage(body, CLIPS[name], transition).motion for name in ("start", "stop"))
        pairs = {"start": (start.pose(-1), walk.start), "stop": (stop.pose(0), walk.start)}
        pairs["idle"] = stop.pose(-1), made["idle"].start
        found |= {name: apart(body, *pair) for name, pair in pairs.items()}
        found["slip"], found["sinks"] = slip(body, walk.motion)
        found["slip planted"], found["sinks planted"] = slip(body, walk.plant_feet(body).motion)
        found["weight"] = made["walk"].weight
    return found, left_out


def measure_once(name: str, folder: Path) -> tuple[dict[str, float], dict[str, str]]:
    """Return what `measured` returns for a robot, an example or `random_SEED`, from its file if there is one."""
    file = folder / f"{name}.json"
    if not file.exists():
        try:
            numbers, left_out = measured(load_body(name))
        except ValueError as error:
            numbers, left_out = {"clips": 0}, dict.fromkeys(CLIPS, str(error))
        new_file = file.with_suffix(f".{os.getpid()}")
        new_file.write_text(json.dumps([{key: float(value) for key, value in numbers.items()}, left_out]))
        new_file.replace(file)
    numbers, left_out = json.loads(file.read_text())
    return numbers, left_out


def load_body(name: str):
    """Return the body of a robot, an example or `random_SEED`."""
    if name in ROBOTS:
        return ROBOTS[name]
    return sound_body(int(name.removeprefix("random_"))) if name.startswith("random_") else spec_files.load_body(name)


def table(left_out_of_body: dict[str, dict[str, str]], others) -> str:
    """Return a table in Markdown: how many bodies have clips, and the lines that leave them out most often."""
    clips_of_row = collections.defaultdict(list)
    for clip in CLIPS:
        counts = []
        for is_other in (True, False):
            reasons = [left_out for name, left_out in left_out_of_body.items() if (name in others) == is_other]
            counts.append(f"{sum(clip not in left_out for left_out in reasons)} of {len(reasons)}")
        lines = [left_out[clip] for left_out in left_out_of_body.values() if clip in left_out]
        kinds = collections.Counter(re.sub(r"-?\d+(\.\d+)?", "n", line) for line in lines)
        cells = *counts, "; ".join(f"{kind} ({number})" for kind, number in kinds.most_common(2)) or "-"
        clips_of_row[cells].append(f"`{clip}`")
    rows = [f"| {' | '.join([', '.join(clips), *cells])} |" for cells, clips in clips_of_row.items()]
    return "\n".join(["| clip | robots and examples | random bodies | left out, as |", "|---|---|---|---|", *rows])


def write_numbers(file: Path, numbers: dict[str, dict[str, float]], left_out_of_body: dict[str, dict[str, str]]):
    """Write a line for each body: its numbers, and the names of the clips that are left out."""
    columns = list(dict.fromkeys(key for numbers_of_body in numbers.values() for key in numbers_of_body))
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["body", *columns, "left_out"])
        for name, numbers_of_body in numbers.items():
            cells = [f"{numbers_of_body[column]:.5g}" if column in numbers_of_body else "" for column in columns]
            writer.writerow([name, *cells, " ".join(left_out_of_body[name])])


def main(count: str = "100", folder: str = "out/clip_sets") -> int:
    """Measure the bodies, and return the exit status."""
    bodies = [f"random_{seed}" for seed in range(int(count))]
    others = [*ROBOTS, *spec_files.EXAMPLES]
    names = others + bodies
    Path(folder).mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ProcessPoolExecutor() as pool:
        measurements = pool.map(functools.partial(measure_once, folder=Path(folder)), names)
        measurement_of_body = dict(
            zip(names, tqdm(measurements, total=len(names), disable=None, unit="body"), strict=True)
        )
    numbers = {name: numbers for name, (numbers, _) in measurement_of_body.items()}
    left_out_of_body = {name: left_out for name, (_, left_out) in measurement_of_body.items()}
    write_numbers(Path(folder, "clip_sets.csv"), numbers, left_out_of_body)
    for name in names:
        values_of_body = ", ".join(f"{key} {value:.3g}" for key, value in numbers[name].items())
        missing = [f"no {clip}: {reason}" for clip, reason in left_out_of_body[name].items()]
        print("; ".join([f"{name}: {values_of_body}", *missing]))

    def values(key, names):
        return np.array([numbers[name].get(key, np.nan) for name in names])

    for key in (key for key in numbers["tick"] if key.startswith(PACES)):
        ratios = values(key, numbers)
        quantiles = ", ".join(f"{value:.2f}" for value in np.nanquantile(ratios, (0.0, 0.1, 0.5, 0.9, 1.0)))
        print(f"{key}, {np.isfinite(ratios).sum()} bodies: least, 10 %, median, 90 % and most: {quantiles}")
    for key in ("seam", "start", "stop", "idle", "slip", "slip planted", "sinks", "sinks planted"):
        for kind, names in (("robots and examples", others), ("random bodies", bodies)):
            quantiles = ", ".join(f"{value:.3f}" for value in np.nanquantile(values(key, names), (0.5, 0.9, 0.95, 1.0)))
            print(f"{key}, {kind}: median, 90 %, 95 % and most: {quantiles}")
    print(table(left_out_of_body, others))
    breaks = np.nansum(values("broken", numbers))
    print(f"clips that break a bound: {breaks:.0f}")
    cycles = values("cycles", bodies)
    joints = values("joints", bodies)
    one_cycle = (cycles == 1)[joints >= 3].mean()
    connected = (values("stop", numbers) <= APART).mean()
    files = (values("clips", numbers) > 0).sum()
    print(f"loops of one cycle: {one_cycle:.0%} of random bodies with three joints a leg or more")
    print(f"loops of one cycle: {(cycles == 1)[joints == 2].sum()} of {(joints == 2).sum()} random bodies with two")
    print(f"stop within {APART} of the walk: {connected:.0%} of all")
    print(f"a file for {files} of {len(numbers)} bodies")
    return int(breaks > 0 or one_cycle < ONE_CYCLE or connected < CONNECTED or files < len(numbers))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
