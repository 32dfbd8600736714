"""Judge checkpoints with arc-suite evaluate, and plot them over the paper's returns. The training scripts use it.

    python examples/training/judging.py runs/sb3-sac-tick-walk --robot tick

plots the evaluations `<steps>.json` of a folder anew.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import numpy as np

from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, published
from arc_suite.learning.agents import plots


def evaluate(policy: pathlib.Path, robot: str, task: str, episodes: int) -> None:
    """Write the evaluation of a policy next to it."""
    command = [sys.executable, "-m", "arc_suite", "evaluate", f"--robot={robot}", f"--task={task}"]
    command += [f"--policy={policy}", f"--episodes={episodes}", f"--json={policy.with_suffix('.json')}"]
    subprocess.run(command, check=True)


def plot(folder: pathlib.Path, robot: str, task: str) -> None:
    """Draw the returns of a folder's evaluations over steps, over standing still, the demonstrator and the paper."""
    reports = {int(path.stem): json.loads(path.read_text())["robots"][robot] for path in folder.glob("*.json")}
    rows = [(step, episode["total"]) for step in sorted(reports) for episode in reports[step]["episodes"]]
    steps, returns = np.array(rows).T
    scale = anchors.anchors(Setup.of(robot, task))
    lines = {"standing still": scale.zero, f"demonstrator {scale.preset}": scale.demonstrator}
    finals = published.FINALS.get(robot, {}) if task == "walk" else {}
    evaluations = {"step": steps, "return": returns}
    plots.plot_run(evaluations, folder.name, f"{robot}, {task}", lines, finals).savefig(folder / "curve.png")
    print(f"wrote {folder / 'curve.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    arguments = parser.parse_args()
    plot(arguments.folder, arguments.robot, arguments.task)
