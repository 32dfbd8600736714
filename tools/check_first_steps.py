"""Goes six roads of newcomers in an empty folder, by what the pages say alone.

    python tools/check_first_steps.py
    python tools/check_first_steps.py --short --only designer

A road is some sections of pages, whose commands and code run in order, and commands of `make` that pages name. It ends
with files that are not empty. Later roads find what earlier ones left, such as runs. `pip` lines are left to the
environment, which has the extras of README. Prints a line for each and exits with status 1 if one fails.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import page_commands
from absl import flags

from arc_suite.cli import program

# By name: a page and the heading of a section, or a command of `make` on a page.
ROADS = {
    "learner": (("README", "Use"), ("first_steps", "A creature learns to walk")),
    "researcher": (
        *(("coming_from_gymnasium", "Coming from Gymnasium"), ("coming_from_dm_control", "Coming from dm_control")),
        *(("observations", "Pixels and depth"), ("adding_a_task", "Adding a task")),
        *(("datasets", "Datasets"), ("datasets", "Datasets of agents")),
    ),
    "animator": (
        *(("clips", "Animation clips"), ("engines", "Clips in Blender and game engines")),
        *(("engines", "FBX, BVH and Blender"), ("play", "make web"), ("play", "Play")),
    ),
    "designer": (
        *(("first_steps", "A spider as animation clips"), ("bodies", "Bodies"), ("bodies", "Longer front legs")),
        *(("bodies", "Heads, tails and ballast"), ("bodies", "Out to other scenes")),
        *(("design", "Creatures found by search"), ("design", "Files")),
    ),
    "roboticist": (("imported", "Robots in MJCF and URDF"), ("first_steps", "Rough ground, as ONNX")),
    "a clip learned": (("motions", "Motions"),),
}
RUN_BEFORE = {"researcher": "learner"}  # a road that needs what another one leaves

# By road: what it leaves, patterns of files in its folder. Policies of runs earn more than a body that stands still.
GOALS = {
    "learner": ("runs/tick-walk-ppo-0/policy.npz", "tick.mp4"),
    "researcher": ("crouching.py", "runs/clone/policy.npz", "videos/*.mp4", "datasets/**/main_data.hdf5"),
    "animator": ("spider.glb", "trained.glb", "spider.fbx", "queen.html", "runs/queen-steer-dagger-0/policy.npz"),
    "designer": ("spider.mp4", "clips.glb", "mantis.json", "brute.json", "gallery/gallery.html", "creature.glb"),
    "roboticist": ("runs/go2/policy.npz", "robot/run.py", "runs/rough/policy.npz", "rough.onnx"),
    "a clip learned": ("limp.npz", "runs/queen-mimic-ppo-0/policy.npz", "limp.mp4"),
}

MAX_SECONDS = 5400  # of a command, which hangs after that
ELSEWHERE = ("pip install", "python learn.py", "python play.py", "blender ")  # the two scripts are of docs/clients.md

# What a folder has at the start: parts of the clone, which pages name, and a robot in place of the reader's: its file
# and the module of its own computer. Blender's environment is that of `make check-blender`, where there is one.
FILES = {
    "tools": "tools",
    "examples": "examples",
    ".venv-blender": ".venv-blender",
    "go2.xml": "tests/fixtures/robots/go2_like.xml",
    "my_robot.py": "tests/fixtures/my_robot.py",
}

_SHORT = flags.DEFINE_bool("short", False, "One episode in place of many, and at most two minutes of a training.")
_ONLY = flags.DEFINE_multi_enum("only", [], list(ROADS), "Road to go, after the one that it needs; all without it.")


def work(name: str) -> Iterator[tuple[list[str], str, str]]:
    """Yield the steps of a road: a command, its input, and the file that the input goes into instead, or ""."""
    for page, section in ROADS[name]:
        if section.startswith("make "):
            targets = section.split()[1:]
            yield ["make", "-C", str(page_commands.ROOT), *targets], "", ""
            continue
        text = page_commands.sections(page_commands.page(page))[section]
        for block in page_commands.blocks(text):
            for command in block.commands:
                if not command.startswith(ELSEWHERE):
                    if _SHORT.value:
                        command = page_commands.shorten(command)
                    yield ["bash", "-c", command], "", ""
            if block.kind == "python":
                yield [sys.executable, "-"], block.text, block.file or ""


def check(name: str, folder: pathlib.Path) -> str:
    """Go a road in a folder, and return what is wrong, in one line."""
    modules = os.pathsep.join([str(folder), str(folder / "robot")])
    variables = {"MINARI_DATASETS_PATH": str(folder / "datasets"), "MPLBACKEND": "Agg", "PYTHONPATH": modules}
    path = f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for command, text, file in work(name):
        if file:
            (folder / file).write_text(text, encoding="utf-8")
            continue
        environ = os.environ | variables | {"PATH": path}
        command_text = " ".join(command[2:]) or "code of a page"
        try:
            result = subprocess.run(
                command,
                cwd=folder,
                env=environ,
                input=text,
                capture_output=True,
                encoding="utf-8",
                timeout=MAX_SECONDS,
            )
        except subprocess.TimeoutExpired:
            return f"{command_text}: it did not end within {MAX_SECONDS} s"
        if result.returncode != 0:
            output = (result.stderr or result.stdout)[-300:]
            one_line = re.sub(r"\s+", " ", output).strip()
            return f"{command_text}: status {result.returncode}: {one_line}"
    return find_unmet_goal(name, folder)


def find_unmet_goal(name: str, folder: pathlib.Path) -> str:
    """Return which goal of a road a folder does not meet; "" if it meets all."""
    for pattern in GOALS[name]:
        files = [file for file in folder.glob(pattern) if file.stat().st_size]
        if not files:
            return f"it leaves no {pattern}"
        if pattern.startswith("runs/"):
            gain = measure_gain(files[0].parent)
            if gain <= 0.0:
                return f"{pattern} earns {-gain:.1f} less than a body that stands still"
    return ""


def measure_gain(run: pathlib.Path) -> float:
    """Return how much more the policy of a run earns in two episodes than a body that stands still."""
    results = run / "first_steps.json"
    program_path = pathlib.Path(sys.executable).parent / "arc-suite"
    command = [program_path, "evaluate", f"--policy={run}", "--episodes=2", f"--json={results}"]
    subprocess.run(command, check=True, capture_output=True)
    (summary,) = json.loads(results.read_text(encoding="utf-8"))["robots"].values()
    return summary["return"]["mean"] - summary["zero_return"]


def list_roads(names: list[str]) -> list[str]:
    """Return the roads to go, in order: those of names and those that they need; all without a name."""
    needed = {RUN_BEFORE[name] for name in names if name in RUN_BEFORE}
    return [road for road in ROADS if not names or road in needed.union(names)]


def main() -> int:
    """Print a line for each road; return the exit status."""
    has_failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, part in FILES.items():
            if (page_commands.ROOT / part).exists():
                (folder / file).symlink_to(page_commands.ROOT / part)
        for road in list_roads(_ONLY.value):
            start = time.perf_counter()
            problem = check(road, folder)
            if problem:
                has_failed = True
            print(f"{road:16}{time.perf_counter() - start:7.1f} s  {problem or 'ok'}", flush=True)
    return int(has_failed)


if __name__ == "__main__":
    program.run(main)
