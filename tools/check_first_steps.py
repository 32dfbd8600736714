"""Goes six roads of newcomers in an empty folder, by what the pages say alone.

    python tools/check_first_steps.py
    python tools/check_first_steps.py --short --only designer

A road is some sections of pages, whose commands and code run in order, and commands of `make` that pages name. Later
roads find what earlier ones left, such as runs. `pip` lines are left to the environment, which has the extras of
README. Prints a line for each and exits with status 1 if one fails.
"""

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
        *(("clips", "Animation clips"), ("engines", "Clips in Blender, Godot and three.js")),
        *(("engines", "FBX, BVH and Blender"), ("play", "make web"), ("play", "Play")),
    ),
    "designer": (
        *(("first_steps", "A spider as animation clips"), ("bodies", "Bodies"), ("bodies", "Out to other scenes")),
        *(("design", "Creatures found by search"), ("design", "Files")),
    ),
    "roboticist": (("imported", "Robots in MJCF and URDF"), ("first_steps", "Rough ground, as ONNX")),
    "a clip learned": (("motions", "Motions"),),
}
ELSEWHERE = ("pip install", "python learn.py", "python play.py")  # the last two are of docs/clients.md
OF_THE_ROBOT = "import my_robot"  # in code that a robot's own computer runs

# What a folder has at the start: parts of the clone, which pages name, and a robot in place of the reader's. Blender's
# environment is that of `make check-blender`, where there is one.
FILES = {
    "tools": "tools",
    "examples": "examples",
    ".venv-blender": ".venv-blender",
    "go2.xml": "tests/fixtures/robots/go2_like.xml",
}

_SHORT = flags.DEFINE_bool("short", False, "One episode in place of many, and at most two minutes of a training.")
_ONLY = flags.DEFINE_multi_enum("only", [], list(ROADS), "Road to go; all without it.")


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
            if block.kind == "python" and OF_THE_ROBOT not in block.text:
                yield [sys.executable, "-"], block.text, block.file or ""


def check(name: str, folder: pathlib.Path) -> str:
    """Go a road in a folder, and return what is wrong, in one line."""
    variables = {"MINARI_DATASETS_PATH": str(folder / "datasets"), "MPLBACKEND": "Agg", "PYTHONPATH": str(folder)}
    path = f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for command, text, file in work(name):
        if file:
            (folder / file).write_text(text, encoding="utf-8")
            continue
        environ = os.environ | variables | {"PATH": path}
        result = subprocess.run(command, cwd=folder, env=environ, input=text, capture_output=True, encoding="utf-8")
        if result.returncode != 0:
            output = (result.stderr or result.stdout)[-300:]
            one_line = re.sub(r"\s+", " ", output).strip()
            command_text = " ".join(command[2:]) or "code of a page"
            return f"{command_text}: status {result.returncode}: {one_line}"
    return ""


def main() -> int:
    """Print a line for each road; return the exit status."""
    has_failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, part in FILES.items():
            if (page_commands.ROOT / part).exists():
                (folder / file).symlink_to(page_commands.ROOT / part)
        for road in _ONLY.value or ROADS:
            start = time.perf_counter()
            problem = check(road, folder)
            if problem:
                has_failed = True
            print(f"{road:16}{time.perf_counter() - start:7.1f} s  {problem or 'ok'}", flush=True)
    return int(has_failed)


if __name__ == "__main__":
    program.run(main)
