"""Measures worlds of `arc_suite.learning.worlds.mjx` on this machine's accelerator, and writes tables into docs/gpu.md.

Prints control steps a second, memory and compile time, whole episodes against a processor's, and the minutes until
PPO has the return of the demonstrator `medium`. Needs the extras `learn` and `gpu`.

Example:
  python tools/bench_gpu.py --document docs/gpu.md
  python tools/bench_gpu.py --robots leaper --worlds 8 --impl jax --episodes 0 --learn ""
"""

import contextlib
import os
import pathlib
import re
import tempfile
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
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.learning.worlds import device, mjx
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_list("robots", list(ROBOTS), "Whose walks.")
flags.DEFINE_list("worlds", ["4096", "16384", "65536"], "Numbers of worlds that step together.")
flags.DEFINE_list("impl", list(device.IMPLEMENTATIONS), "Implementations.")
flags.DEFINE_integer("steps", 50, "Control steps of a measurement.", lower_bound=1)
flags.DEFINE_integer("episodes", 256, "Episodes that are compared with a processor's; 0 for none.", lower_bound=0)
flags.DEFINE_list("learn", ["warp"], "Simulations in which PPO learns: mjx, warp, or none.")
flags.DEFINE_string("document", None, "A Markdown file between whose <!-- gpu --> marks to put the tables.")

_MARKED_TEXT = re.compile(r"(<!-- gpu -->\n).*?(<!-- end of gpu -->)", re.DOTALL)
# Hyperparameters of PPO in thousands of worlds.
HYPERPARAMETERS = {"num_envs": 4096, "horizon": 16, "minibatch": 16_384}


class GoalReached(Exception):
    """A learner has reached a return."""


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
        f"{peak_bytes / 2**30:.1f} GiB" if peak_bytes else "not measured",
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


def learning_row(robot, simulation):
    """Return a row of cells: control steps and minutes until PPO has the return of `medium`, with evaluations."""
    setup = Setup.of(robot)
    with contextlib.closing(setup.make_vec(evaluation.CURVE_EPISODES, autoreset_mode="Disabled")) as environment:
        medium = Demonstrator(environment, "medium")
        goal = np.mean([episode.total for episode in evaluation.episodes_in_batch(environment, medium)])
    hyperparameters = {"simulation": simulation, **HYPERPARAMETERS}
    run = Configuration.of(setup, "ppo", hyperparameters, steps=50_000_000, evaluate_every=10**6)
    start = time.perf_counter()
    steps = run.steps
    minutes = "not reached"

    def on_metrics(step, metrics):
        nonlocal steps, minutes
        if metrics.get("return", -np.inf) >= goal:
            steps = step
            minutes = f"{(time.perf_counter() - start) / 60.0:.1f}"
            raise GoalReached

    with tempfile.TemporaryDirectory() as folder:
        with contextlib.suppress(GoalReached):
            train(run, pathlib.Path(folder), progress=program.progress, on_metrics=on_metrics)
        latest = run_folder.latest_returns(run_folder.table(folder, "evaluations")).mean()
    return [robot, simulation, f"{goal:.0f}", f"{latest:.0f}", f"{steps / 1e6:.1f} M", minutes]


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
    worlds = [int(count) for count in FLAGS.worlds]
    rows = [speed_row(robot, impl, count, FLAGS.steps) for robot in robots for impl in impls for count in worlds]
    header = ["robot", "impl", "worlds", "control steps/s", "compiling", "peak memory", "overflows"]
    parts = [f"{jax.devices()[0].device_kind}; {package_versions}.", "<!-- table -->", markdown_table(header, rows)]
    if FLAGS.episodes:
        rows = [return_row(robot, impl, FLAGS.episodes) for robot in robots for impl in impls]
        parts.append(markdown_table(["robot", "impl", "return", "on a processor", "apart", "falls"], rows))
    simulations = [name for name in FLAGS.learn if name]
    if simulations:
        rows = [learning_row(robot, simulation) for robot in robots for simulation in simulations]
        parts.append(markdown_table(["robot", "simulation", "`medium`", "PPO", "control steps", "minutes"], rows))
    text = "\n\n".join([*parts, "<!-- end -->"])
    print(text)
    if FLAGS.document:
        path = pathlib.Path(FLAGS.document)
        page = path.read_text(encoding="utf-8")
        files.write(path, _MARKED_TEXT.sub(lambda match: f"{match[1]}{text}\n{match[2]}", page))


if __name__ == "__main__":
    program.run(main)
