"""Measures worlds of `arc_suite.learning.worlds.mjx` on this machine's accelerator, and writes tables into docs/gpu.md.

Prints control steps a second, memory and compile time, the share of bare simulation in them, whole episodes against a
processor's, and runs of `arc-suite train` from their start: seconds, share of the GPU, returns. Needs the extras
`learn` and `gpu`.

Example:
  python tools/bench_gpu.py --document docs/gpu.md
  python tools/bench_gpu.py --robots queen --worlds 0 --episodes 0 --tasks walk,steer --seeds 0
  python tools/bench_gpu.py --robots leaper --worlds 8 --impl jax --episodes 0 --learn none
"""

import contextlib
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # so that peaks are those of the program

import jax
import jax.numpy as jnp
import numpy as np
from absl import flags

from arc_suite import checks, evaluation, files, versions
from arc_suite.cli import program
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import run_folder
from arc_suite.learning.worlds import device, mjx
from arc_suite.policies import network
from arc_suite.robots import ROBOTS
from arc_suite.simulation.cores import usable_cores

FLAGS = flags.FLAGS
flags.DEFINE_list("robots", list(ROBOTS), "Whose walks.")
flags.DEFINE_list("worlds", ["4096", "16384", "65536"], "Numbers of worlds that step together; 0 for none.")
flags.DEFINE_list("impl", list(device.IMPLEMENTATIONS), "Implementations.")
flags.DEFINE_integer("steps", 50, "Control steps of a measurement.", lower_bound=1)
flags.DEFINE_integer("episodes", 256, "Episodes that are compared with a processor's; 0 for none.", lower_bound=0)
flags.DEFINE_list("learn", ["warp"], "Simulations in which PPO learns: mjx, warp, or none.")
flags.DEFINE_list("tasks", ["walk", "steer"], "Tasks that PPO learns.")
flags.DEFINE_list("seeds", ["0", "1", "2"], "Seeds with which PPO learns, all in one process.")
flags.DEFINE_multi_string("run_flag", [], "Further flag of arc-suite train for these runs.")
flags.DEFINE_float("goal", 3700.0, "Return of an evaluation until which seconds are counted.")
flags.DEFINE_string("runs", None, "Folder in which runs stay; by default they are deleted.")
flags.DEFINE_string("document", None, "A Markdown file between whose <!-- gpu --> marks to put the tables.")

_MARKED_TEXT = re.compile(r"(<!-- gpu -->\n).*?(<!-- end of gpu -->)", re.DOTALL)
_POLL_INTERVAL = 0.2  # s between two looks at a run
_NOT_MEASURED = "not measured"


def prepare_walk(env, preset, steps):
    """Return a compiled walk of so many steps, and the state from which it starts.

    The state is that of the worlds and that of the demonstrator. The walk returns the state after the steps, and
    rewards (steps, worlds), overflows (steps,) and ends of episodes (steps, worlds).
    """
    demonstrator = law(env.task, presets_of(env.task.scene.body)[preset])

    def step(states, _):
        state, demonstrator_state = states
        demonstrator_state, action = demonstrator(demonstrator_state, env.task.split(state.obs))
        state = jax.vmap(env.step)(state, action)
        return (state, demonstrator_state), (state.reward, state.metrics["overflow"].sum(), state.done)

    walk = jax.jit(lambda states: jax.lax.scan(step, states, length=steps))
    state = jax.jit(jax.vmap(env.start))(jnp.arange(env.num_envs))
    demonstrator_state = jax.tree.map(jnp.asarray, demonstrator.initial(env.num_envs))
    return walk, (state, demonstrator_state)


def speed_row(robot, impl, worlds, steps):
    """Return a row of cells: worlds, control steps a second, compile time, peak memory of the device, overflows."""
    env = mjx.load(robot, "walk", impl=impl, num_envs=worlds)
    walk, states = prepare_walk(env, "medium", steps)
    start = time.perf_counter()
    compiled_walk = walk.lower(states).compile()
    compile_seconds = time.perf_counter() - start
    states, _ = jax.block_until_ready(compiled_walk(states))  # the first run also compiles Warp's kernels
    start = time.perf_counter()
    _, (_, overflows, _) = jax.block_until_ready(compiled_walk(states))
    steps_per_second = worlds * steps / (time.perf_counter() - start)
    memory_stats = jax.local_devices()[0].memory_stats() or {}
    peak_bytes = memory_stats.get("peak_bytes_in_use")
    return [
        robot,
        impl,
        f"{worlds}",
        f"{steps_per_second:,.0f}",
        f"{compile_seconds:.0f} s",
        f"{peak_bytes / 2**30:.1f} GiB" if peak_bytes else _NOT_MEASURED,
        f"{int(overflows.sum())}",
    ]


def return_row(robot, impl, count):
    """Return a row of cells: mean returns of whole `tuned` episodes in worlds and on a processor, and falls."""
    env = mjx.load(robot, "walk", impl=impl, num_starts=count, num_envs=count)
    walk, states = prepare_walk(env, "tuned", int(env.episode_length))
    _, (rewards, _, has_ended) = walk(states)
    mean_return = np.asarray(rewards).sum(axis=0).mean()
    falls = int(np.asarray(has_ended).any(axis=0).sum())
    with contextlib.closing(Setup.of(robot).make_vec(count, autoreset_mode="Disabled")) as environment:
        policy = Demonstrator(environment, "tuned")
        episodes = evaluation.episodes_in_batch(environment, policy, range(count))
    processor_return = np.mean([episode.total for episode in episodes])
    difference = 100.0 * (mean_return / processor_return - 1.0)
    return [robot, impl, f"{mean_return:.1f}", f"{processor_return:.1f}", f"{difference:+.2f} %", f"{falls}"]


def ratio_row(robot, impl, worlds, steps):
    """Return a row of cells: bare simulation's time in that of the environment, with the same controls."""
    env = mjx.load(robot, "walk", impl=impl, num_envs=worlds)
    demonstrator = law(env.task, presets_of(env.task.scene.body)["medium"])
    first_state = jax.jit(jax.vmap(env.start))(jnp.arange(worlds))

    def record_step(states, _):
        state, demonstrator_state = states
        demonstrator_state, action = demonstrator(demonstrator_state, env.task.split(state.obs))
        state = jax.vmap(env.step)(state, action)
        return (state, demonstrator_state), (action, state.data.ctrl)

    def step_environment(state, action):
        return jax.vmap(env.step)(state, action), None

    def step_simulation(data, controls):
        data = data.replace(ctrl=controls)
        return jax.vmap(lambda world: device.advance(env.mjx_model, world, env.n_substeps))(data), None

    states = (first_state, jax.tree.map(jnp.asarray, demonstrator.initial(worlds)))
    _, (actions, controls) = jax.jit(lambda states: jax.lax.scan(record_step, states, length=steps))(states)
    step_all = jax.jit(lambda state: jax.lax.scan(step_environment, state, actions))
    simulate_all = jax.jit(lambda data: jax.lax.scan(step_simulation, data, controls))
    environment_seconds = best_seconds(step_all, first_state)
    simulation_seconds = best_seconds(simulate_all, first_state.data)
    return [robot, impl, f"{worlds}", f"{simulation_seconds / environment_seconds:.3f}"]


def best_seconds(function, argument, repeats=3):
    """Return the shortest time of a compiled function, s, after a first call."""
    jax.block_until_ready(function(argument))
    durations = []
    for _ in range(repeats):
        start = time.perf_counter()
        jax.block_until_ready(function(argument))
        durations.append(time.perf_counter() - start)
    return min(durations)


def training_rows(robot, task, simulation, seeds, folder):
    """Return a row of cells for each seed: `arc-suite train` with defaults, from the start of its process.

    Several seeds are one process. Seconds are those to the first line of training.csv, to an evaluation with the return
    of `--goal`, and to the end.
    """
    run_folders = [folder / f"{robot}-{task}-ppo-{seed}" for seed in seeds]
    output = folder if len(seeds) > 1 else run_folders[0]
    flags_of_run = [f"--robot={robot}", f"--task={task}", f"--hp=simulation={simulation}", f"--seed={','.join(seeds)}"]
    command = [sys.executable, "-m", "arc_suite", "train", *flags_of_run, *FLAGS.run_flag, f"--output={output}"]
    start = time.perf_counter()
    seconds_to_first = None
    seconds_to_goal = {}
    with sample_gpu() as shares:
        process = subprocess.Popen(command)
        while process.poll() is None:
            time.sleep(_POLL_INTERVAL)
            seconds = time.perf_counter() - start
            if seconds_to_first is None and run_folder.lines(run_folders[0], "training"):
                seconds_to_first = seconds
                shares.clear()
            for run_path in run_folders:
                if run_path not in seconds_to_goal and best_return(run_path) >= FLAGS.goal:
                    seconds_to_goal[run_path] = seconds
    seconds = time.perf_counter() - start
    if process.returncode:
        raise ValueError(f"{' '.join(command)}: exit status {process.returncode}")
    rows = []
    for seed, run_path in zip(seeds, run_folders, strict=True):
        times = run_folder.table(run_path, "times")
        learning_seconds = times["wall_seconds"][-1] - times["wall_seconds"][0]
        steps_per_second = len(seeds) * (times["step"][-1] - times["step"][0]) / learning_seconds
        totals, falls = evaluate_run(run_path, robot, task)
        row = [
            robot,
            task,
            simulation,
            f"{seed}",
            f"{times['step'][-1] / 1e6:.1f} M",
            f"{totals.mean():.0f}",
            f"{totals.min():.0f}",
            f"{falls}",
            f"{seconds:.0f}",
            _NOT_MEASURED if seconds_to_first is None else f"{seconds_to_first:.0f}",
            f"{seconds_to_goal[run_path]:.0f}" if run_path in seconds_to_goal else "not reached",
            f"{steps_per_second:,.0f}",
            f"{np.mean(shares):.1f} %" if shares else _NOT_MEASURED,
        ]
        print(" | ".join(row), flush=True)
        rows.append(row)
    return rows


@contextlib.contextmanager
def sample_gpu():
    """Yield a list to which the shares of time in which the GPU computes are appended, percent; none without one."""
    shares = []
    command = ["nvidia-smi", "--query-gpu=utilization.gpu", "--format=csv,noheader,nounits", "--loop-ms=200"]
    try:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8")
    except OSError:
        yield shares
        return

    def read_shares():
        for line in process.stdout:
            with contextlib.suppress(ValueError):  # a GPU that does not tell
                shares.append(float(line))

    reader = threading.Thread(target=read_shares, daemon=True)
    reader.start()
    try:
        yield shares
    finally:
        process.terminate()
        reader.join()


def best_return(folder):
    """Return the best mean return of the evaluations of a run so far."""
    lines = run_folder.lines(folder, "evaluations")
    returns_by_step = {}
    for line in lines:
        returns_by_step.setdefault(line["step"], []).append(float(line["return"]))
    return max((np.mean(returns) for returns in returns_by_step.values()), default=-np.inf)


def evaluate_run(folder, robot, task):
    """Return the returns of the protocol's episodes of a run's policy, and the number of those that end early."""
    policy = network.load(folder)
    setup = Setup.of(robot, task)
    options = {"num_threads": usable_cores(), "autoreset_mode": "Disabled"}
    with contextlib.closing(setup.make_vec(evaluation.EPISODES, **options)) as environment:
        episodes = evaluation.episodes_in_batch(environment, policy)
    falls = sum(episode.length < setup.definition.step_limit for episode in episodes)
    return np.array([episode.total for episode in episodes]), falls


def markdown_table(header, rows):
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main():
    """Measure, print and write the tables."""
    robots = [checks.name(robot, ROBOTS, "robot") for robot in FLAGS.robots]
    impls = [device.choose_implementation(impl) for impl in FLAGS.impl]
    if FLAGS.document and jax.default_backend() != "gpu":
        raise ValueError(f"--document: JAX finds no GPU here, and tables of a {jax.default_backend()} are not written")
    packages = ("mujoco", "mujoco-mjx", "warp-lang", "jax")
    package_versions = ", ".join(f"{name} {versions.version_of(name)}" for name in packages)
    worlds = [int(count) for count in FLAGS.worlds if int(count)]
    parts = [f"{jax.devices()[0].device_kind}; {package_versions}.", "<!-- table -->"]

    def add_table(header, rows):
        if rows:
            parts.append(markdown_table(header, rows))
            print(parts[-1], flush=True)

    # Runs come first, since what others compile would make them faster.
    simulations = [name for name in FLAGS.learn if name != "none"]
    rows = []
    with contextlib.ExitStack() as stack:
        folder = pathlib.Path(FLAGS.runs or stack.enter_context(tempfile.TemporaryDirectory()))
        for case in itertools.product(robots, FLAGS.tasks, simulations):
            rows += training_rows(*case, FLAGS.seeds, folder / case[-1])
    seconds = ["seconds", "to the first update", f"to {FLAGS.goal:g}"]
    add_table(
        [
            *("robot", "task", "simulation", "seed", "control steps", "return", "worst", "falls"),
            *seconds,
            "steps/s",
            "GPU",
        ],
        rows,
    )
    cases = [(robot, impl, count) for robot in robots for impl in impls for count in worlds]
    rows = [speed_row(*case, FLAGS.steps) for case in cases]
    add_table(["robot", "impl", "worlds", "control steps/s", "compiling", "peak memory", "overflows"], rows)
    rows = [ratio_row(*case, FLAGS.steps) for case in cases]
    add_table(["robot", "impl", "worlds", "bare simulation / environment"], rows)
    if FLAGS.episodes:
        rows = [return_row(robot, impl, FLAGS.episodes) for robot in robots for impl in impls]
        add_table(["robot", "impl", "return", "on a processor", "apart", "falls"], rows)
    text = "\n\n".join([*parts, "<!-- end -->"])
    if FLAGS.document:
        path = pathlib.Path(FLAGS.document)
        page = path.read_text(encoding="utf-8")
        files.write(path, _MARKED_TEXT.sub(lambda match: f"{match[1]}{text}\n{match[2]}", page))


if __name__ == "__main__":
    program.run(main)
