"""Endurance: what memory, threads and file descriptors do in the long run; `make check-soak`, minutes.

`python tests/soak.py` steps environments of `walk` two million times and of other tasks some 100,000 times,
single ones and environments of a vector environment in turn, with resets and a frame of each every
5,000 steps; then it makes, steps, renders and closes 500 environments. Exit status 1 if memory grows
faster or threads or file descriptors become more than the targets of studies/reliability.md allow.
Linux only.
"""

import argparse
import os
import sys

import gymnasium
import numpy as np
from tqdm import tqdm

import arc_suite  # noqa: F401 (registers)

# Steps by task. Of the others, episodes draw goals, gaps and a ground. On the ground of roam the renderer takes some
# MB more until 160,000 steps with a picture each 5,000, as views show more of it; then memory is flat.
STEPS = {"walk": 2_000_000, "directed": 200_000, "leap": 200_000, "roam": 600_000}
NUM_ENVS = 8
GROWTH = 20.0  # MB, that 500 lives may cost
WARM_UP = 0.3  # share of the samples that come before the memory's slope


def memory() -> float:
    """Resident memory of this process, MB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def handles() -> tuple[int, int]:
    """Threads and open file descriptors of this process."""
    return len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))


def soak(task: str, steps: int, block: int) -> tuple[float, set[tuple[int, int]], int]:
    """Steps for long, with a frame of each environment after every block of steps.

    Returns:
        Slope of the memory after the warm-up, MB per million steps; all pairs of threads and file
        descriptors seen at the end of a block; and the number of resets.
    """
    single = gymnasium.make(f"arc_suite/queen-{task}-v0", render_mode="rgb_array")
    envs = gymnasium.make_vec(f"arc_suite/tick-{task}-v0", num_envs=NUM_ENVS, render_mode="rgb_array")
    random = np.random.default_rng(0)
    single.reset(seed=0)
    envs.reset(seed=0)
    samples, seen, resets = [], set(), 0
    for _ in tqdm(range(steps // block), unit="block", smoothing=0.0):
        for _ in range(block // 2):
            _, _, terminated, truncated, _ = single.step(random.uniform(-1, 1, 18).astype(np.float32))
            if terminated or truncated:
                single.reset()
                resets += 1
        for _ in range(block // 2 // NUM_ENVS):
            _, _, terminated, truncated, _ = envs.step(random.uniform(-1, 1, (NUM_ENVS, 18)).astype(np.float32))
            resets += int((terminated | truncated).sum())
        single.render(), envs.render([0])
        samples.append(memory())
        seen.add(handles())
    first = int(WARM_UP * len(samples)) + 1
    million = np.arange(len(samples)) * block / 1e6
    slope = np.polyfit(million[first:], samples[first:], 1)[0]
    single.close(), envs.close()
    return float(slope), seen, resets


def lives(count: int) -> float:
    """Makes, steps, renders and closes environments; returns by how much memory grew after the first ten, MB."""
    robots = list(arc_suite.TASKS_BY_DOMAIN)
    for i in tqdm(range(10 + count), unit="life"):
        if i == 10:
            before = memory()
        env = gymnasium.make(f"arc_suite/{robots[i % len(robots)]}-walk-v0", render_mode="rgb_array")
        env.reset(seed=i)
        env.step(env.action_space.sample())
        env.render()
        env.close()
    return memory() - before


def main() -> int:
    """Runs both and prints what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", choices=STEPS, default=list(STEPS))
    parser.add_argument("--steps", type=int, help="of each task, at least four blocks; by default those of `STEPS`")
    parser.add_argument("--block", type=int, default=5_000, help="steps between frames")
    parser.add_argument("--lives", type=int, default=500)
    parser.add_argument("--slope", type=float, default=1.0, help="MB per million steps that memory may grow")
    options = parser.parse_args()
    is_flat = True
    for task in options.tasks:
        steps = options.steps or STEPS[task]
        slope, seen, resets = soak(task, steps, options.block)
        threads, files = (sorted({pair[i] for pair in seen}) for i in (0, 1))
        print(
            f"{task}: {steps} steps, {resets} resets: {slope:+.2f} MB per million steps; "
            f"threads {threads}, files {files}",
            flush=True,
        )
        is_flat &= slope <= options.slope and len(seen) == 1
    growth = lives(options.lives)
    print(f"{options.lives} lives: {growth:+.1f} MB")
    return int(not is_flat or growth > GROWTH)


if __name__ == "__main__":
    sys.exit(main())
