"""Judge checkpoints with arc-suite evaluate, and plot them over the paper's returns. The training scripts use it.

    python examples/training/judging.py runs/sb3-sac-tick --robot tick

plots the evaluations `<steps>.json` of a folder anew.
"""

import argparse
import json
import pathlib
import subprocess
import sys

from matplotlib.figure import Figure

from arc_suite.evaluation import published


def evaluate(policy: pathlib.Path, robot: str, task: str, episodes: int) -> None:
    """Write the evaluation of a policy next to it."""
    command = [sys.executable, "-m", "arc_suite", "evaluate", f"--robot={robot}", f"--task={task}"]
    command += [f"--policy={policy}", f"--episodes={episodes}", f"--json={policy.with_suffix('.json')}"]
    subprocess.run(command, check=True)


def plot(folder: pathlib.Path, robot: str, task: str) -> None:
    """Draw the mean returns of a folder's evaluations over steps, and the paper's final returns as lines."""
    reports = {int(path.stem): json.loads(path.read_text()) for path in folder.glob("*.json")}
    steps = sorted(reports)
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axis = figure.subplots()
    axis.plot(steps, [reports[step]["robots"][robot]["return"]["mean"] for step in steps], marker=".")
    lines = (
        {**published.FINALS.get(robot, {}), "demonstrator": published.DEMONSTRATORS.get(robot)}
        if task == "walk"
        else {}
    )
    for name, value in lines.items():
        axis.axhline(value, color="gray", linestyle="--", linewidth=0.8)
        axis.annotate(name, (1.0, value), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=7)
    axis.set(xlabel="environment steps", ylabel="return", title=f"{robot}, {task}; lines: the paper, 1,000,000 steps")
    figure.savefig(folder / "curve.png")
    print(f"wrote {folder / 'curve.png'}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--robot", default="tick")
    parser.add_argument("--task", default="walk")
    arguments = parser.parse_args()
    plot(arguments.folder, arguments.robot, arguments.task)
